r"""The pipeline on one screen: what each command does, stage by stage.

In: paths and settings. Out: a report, and files where the command writes some. A stage runs only when the ones before
it found nothing wrong; nothing is written unless all that was asked for is proved.

    check    load -> resolve -> prove             -> report
    compile  load -> resolve -> prove -> lower -> emit -> write -> report
    test     load -> resolve -> prove -> emit -> run against the interpreter -> report
    certify  load -> resolve -> prove, or a kept certificate -> the checker -> report

>>> from pathlib import Path
>>> from tempfile import TemporaryDirectory
>>> from rcsc import driver
>>> from rcsc.driver.settings import Settings
>>> from rcsc.solvers.options import Options
>>> with TemporaryDirectory() as folder:
...     _ = Path(folder, "a.rcs").write_text("input a : bool\ntable t {\n| line | a ||\n|------|---||\n| 1 | true ||\n}\n")
...     report = driver.check(Settings((folder,), Options(), use_cache=False))
>>> [(one.code.value, one.message) for one in report.found]
[('RCS401', 'no line of table `t` matches 1 of 2 (50 %) of the inputs')]

What was proved stays proved while nothing that it depends on changes; an unchanged project is not even parsed again.
Trusted: that only what was proved is emitted, which the types say (`lower` takes a `ProvedProgram`), and the cache
(`rcsc.host`).

Modules, in the order the data flows: `settings` (what commands are given and hand back), `unchanged` (a whole check
remembered), `proofs` (of one program), `outline` and `together` (what earlier proofs of the levels say), `trials`
(`rcsc test`), `certified` (`rcsc certify`), `reformat` (`rcsc fmt`).
"""

import os
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from rcsc.diagnostics.codes import Code
from rcsc.diagnostics.diagnostic import Diagnostic, Label, sort_key
from rcsc.diagnostics.report import Report, merged
from rcsc.diagnostics.source import Span
from rcsc.driver.settings import Effort, Made, Proof, Settings
from rcsc.host.cache import Cache, open_cache

if TYPE_CHECKING:
    from rcsc.driver.certified import Checking
    from rcsc.emit.plan import Plan
    from rcsc.lang.model import Program, ProvedProgram
    from rcsc.lang.project import Loaded

TARGETS = ("python", "c")


def check(settings: Settings) -> Report:
    """Prove every table; of those that a system's levels run, say what is known of the levels together."""
    from rcsc.driver.together import with_levels

    cache = _cache(settings)
    report = _checked(settings, cache)
    return report if cache is None else with_levels(report, cache)


def _checked(settings: Settings, cache: Cache | None) -> Report:
    """Every table by itself; an unchanged project is recognised without being parsed."""
    from rcsc.driver.unchanged import recall, remember

    whole = None if settings.stdin is not None else cache
    known = recall(whole, settings.paths, settings.options) if whole else None
    if known is not None:
        return known
    loaded = _load(settings)
    report = _report(loaded, tuple(_proofs(loaded, settings, cache)))
    if whole is not None:
        remember(whole, settings.paths, settings.options, loaded, report)
    return report


def compile_(
    settings: Settings, out: Path, targets: tuple[str, ...], *, only_check: bool, defensive: bool = False
) -> Made:
    """Prove every table anew, then write the executors, or say whether they are fresh."""
    loaded = _load(settings)
    proofs = tuple(_proofs(loaded, settings, None))
    report = _report(loaded, proofs)
    if report.failed:
        return Made(report, "nothing was written")
    from rcsc.emit.write import stale, write

    files, clashes = _executors(proofs, targets, defensive=defensive)
    found = clashes or (stale if only_check else write)(files, str(out))
    report = _report(loaded, proofs, found)
    if report.failed:
        return Made(report, "" if only_check else "nothing was written")
    return Made(report, f"{len(files)} files {'are fresh' if only_check else 'written'} in {out}")


def test(settings: Settings, effort: Effort) -> Made:
    """Prove every table, then test its executors against its meaning, and write vectors if asked."""
    from rcsc.driver.trials import try_out, write_vectors

    loaded = _load(settings)
    proofs = tuple(_proofs(loaded, settings, None))
    report = _report(loaded, proofs)
    if report.failed:
        return Made(report, "nothing was tested: not everything is proved")
    found: list[Diagnostic] = []
    figures = []
    programs = [proof.proved for proof in proofs if proof.proved is not None and _runs(proof.proved.program)]
    for proved in programs:
        one, text = try_out(
            proved.program, _emitted(_plan(proved), TARGETS), settings.options, effort, settings.progress
        )
        found += one
        figures.append(text)
    if effort.vectors is not None:
        found += write_vectors([one.program for one in programs], settings.options, effort.vectors)
    settings.progress("")
    return Made(_report(loaded, proofs, tuple(found)), "\n".join(figures))


def certify(settings: Settings, how: "Checking", write: Path | None, against: Path | None) -> Made:
    """Check a certificate, made now or kept, by the checker alone.

    Nothing is proved where a kept one is checked: then what the checker leaves has nobody's word, and is an error.
    """
    from rcsc.driver.certified import keep, kept, reviewed

    loaded = _load(settings)
    if against is not None:
        return reviewed(loaded, kept(against), replace(how, strict=True))
    proofs = tuple(_proofs(loaded, settings, None))
    report = _report(loaded, proofs)
    [proof] = proofs or (None,)
    if report.failed or proof is None or proof.certificate is None:
        return Made(report, "nothing is certified: not everything is proved")
    found = keep(proof.certificate, write) if write is not None else ()
    made = reviewed(loaded, proof.certificate, how, proof.proved)
    report = _report(loaded, proofs, (*found, *made.report.found))
    return Made(replace(report, tables=()), made.closing)  # the verdicts are the prover's, not the checker's


# --- parts -----------------------------------------------------------------------------


def _cache(settings: Settings) -> Cache | None:
    from rcsc.lang.project import project_root

    if not settings.use_cache:
        return None
    first = settings.paths[0]
    inside = os.path.join(first, "-") if os.path.isdir(first) else first
    return open_cache(Path(project_root(inside)))


def _load(settings: Settings) -> "Loaded":
    from rcsc.lang.project import load

    settings.progress("reading")
    return load(settings.paths, settings.stdin)


def _proofs(loaded: "Loaded", settings: Settings, cache: Cache | None) -> Iterator[Proof]:
    """Resolve and prove each root; findings of its files where it cannot be resolved."""
    from rcsc.driver.proofs import prove
    from rcsc.lang.model import Program
    from rcsc.lang.resolve import resolve

    for root in loaded.roots:
        settings.progress(f"proving {root}")
        program = resolve(root, loaded)
        if isinstance(program, Program):
            yield prove(root, program, loaded, settings.options, cache)
        else:
            yield Proof(root, program)
    settings.progress("")


def _report(loaded: "Loaded", proofs: tuple[Proof, ...], found: tuple[Diagnostic, ...] = ()) -> Report:
    """Everything found, each once, and each table once, with the worst verdict of all programs that it is in."""
    every = {*loaded.found, *found, *(one for proof in proofs for one in proof.found)}
    tables = merged(table for proof in proofs for table in proof.tables)
    return Report(tuple(sorted(every, key=sort_key)), tables, loaded.sources)


def _executors(
    proofs: tuple[Proof, ...], targets: tuple[str, ...], *, defensive: bool
) -> tuple[dict[str, str], tuple[Diagnostic, ...]]:
    """The generated files of every program that declares a table or a level, by path under the folder."""
    files: dict[str, str] = {}
    found = []
    paths: dict[str, str] = {}
    names: dict[str, tuple[str, str]] = {}
    for proof in proofs:
        if proof.proved is None or not _runs(proof.proved.program):
            continue
        plan = _plan(proof.proved, defensive=defensive)
        made = _emitted(plan, targets)
        taken = next((path for path in made if paths.get(path.casefold(), proof.root) != proof.root), None)
        if taken is not None:
            found.append(_same_file(taken, proof.root, paths[taken.casefold()]))
            continue
        paths |= {path.casefold(): proof.root for path in made}
        if "c" in targets:
            found += _same_names(plan, proof.root, names)
        files |= made
    return files, tuple(found)


def _same_names(plan: "Plan", root: str, names: dict[str, tuple[str, str]]) -> Iterator[Diagnostic]:
    """The first name in C that this program shares with another, or gives to two things; `names` has who has which, and gets its own."""
    from rcsc.emit.c99 import outward

    for name, what in outward(plan):
        other, said = names.setdefault(name, (root, what))
        if said != what:
            message = f"`{name}` would be two things in C: {said} in `{other}`, and {what} in `{root}`"
            helps = ("rename one of the programs, or the table, level or type",)
            yield Diagnostic(Code.NAME_COLLISION, message, Label(Span(root, 0, 0)), help=helps)
            return


def _emitted(plan: "Plan", targets: tuple[str, ...]) -> dict[str, str]:
    from rcsc.emit import emit_c, emit_python

    return (emit_python(plan) if "python" in targets else {}) | (emit_c(plan) if "c" in targets else {})


def _plan(proved: "ProvedProgram", *, defensive: bool = False) -> "Plan":
    from rcsc.emit.lower import lower
    from rcsc.lang.project import project_root

    return lower(proved, project_root(proved.program.file), defensive=defensive)


def _runs(program: "Program") -> bool:
    own_levels = any(level.span.file == program.file for level in program.levels)
    return own_levels or bool(program.own_tables)


def _same_file(path: str, root: str, other: str) -> Diagnostic:
    message = f"`{root}` and `{other}` would both be compiled to `{path}`"
    return Diagnostic(
        Code.NAME_COLLISION, message, Label(Span(root, 0, 0)), help=("rename one of the files",)
    )
