r"""The pipeline on one screen: what each command does, stage by stage.

In: paths and settings. Out: a report, and files where the command writes some. A stage runs only when the ones before
it found nothing wrong; nothing is written unless all that was asked for is proved.

    check    load -> resolve -> prove             -> report
    compile  load -> resolve -> prove -> lower -> emit -> write -> report
    test     load -> resolve -> prove -> emit -> run against the interpreter -> report

>>> from pathlib import Path
>>> from tempfile import TemporaryDirectory
>>> from rcsc.driver.check import check
>>> from rcsc.driver.settings import Settings
>>> from rcsc.proof.solvers.options import Options
>>> with TemporaryDirectory() as folder:
...     _ = Path(folder, "a.rcs").write_text("input a : bool\ntable t {\n| line | a ||\n|------|---||\n| 1 | true ||\n}\n")
...     report = check(Settings((folder,), Options(), use_cache=False))
>>> [(diagnostic.code.value, diagnostic.message) for diagnostic in report.diagnostics]
[('RCS401', 'no line of table `t` matches 1 of 2 (50 %) of the inputs')]

What was proved stays proved while nothing that it depends on changes; an unchanged project is not even parsed again.
Trusted: that only what was proved is emitted, which the types say (`lower` takes a `ProvedProgram`), and the cache
(`rcsc.base.host`).

Modules, in the order the data flows: `settings` (what commands are given and hand back), `unchanged` (a whole check remembered), `proofs`
(of one program), `missing` (what is told once of names that nothing declares), `pipeline` (read, resolve, prove), `outline` and `together`
(what earlier proofs of the levels say), `requirements` (how all that is required stands), `watched` (what was proved, for `rcsc campaign`);
then `check`, `compile` and `trials` (`rcsc test`).
"""
