"""`rcsc compile`: the executors of every proved program."""

from collections.abc import Collection, Iterator
from pathlib import Path

from rcsc.diagnostics.codes import Code
from rcsc.diagnostics.diagnostic import Diagnostic, Label
from rcsc.diagnostics.source import Span
from rcsc.driver.pipeline import Proved, proved
from rcsc.driver.settings import Conclusion, Settings
from rcsc.emit import TARGETS, Target, emitted
from rcsc.emit.generated import stale, write
from rcsc.emit.lower import lower
from rcsc.emit.plan import Plan
from rcsc.lang.model import ProvedProgram
from rcsc.lang.project import project_root
from rcsc.run.description import description, places
from rcsc.solvers.options import Options


def compile_(
    settings: Settings, out: Path, targets: Collection[str], *, only_check: bool, defensive: bool = False
) -> Conclusion:
    """Prove every table anew, then write the executors, or say whether they are fresh."""
    project = proved(settings)
    report = project.report()
    if report.failed:
        return Conclusion(report, "nothing was written")
    files, clashes = _executors(project, targets, defensive=defensive)
    diagnostics = clashes or (stale if only_check else write)(files, str(out))
    report = project.report(diagnostics)
    if report.failed:
        return Conclusion(report, "" if only_check else "nothing was written")
    return Conclusion(report, f"{len(files)} files {'are fresh' if only_check else 'written'} in {out}")


def compile_system(path: Path) -> Conclusion:
    """Prove the tables of a system's levels anew, and write their executors where its description says.

    Raises:
        BadDescription: It is not in order.
    """
    system = description(path)
    files = tuple(
        str(next(file for file in places(path, spec.program) if file.is_file()))
        for spec in system.levels
        if any(file.is_file() for file in places(path, spec.program))
    )
    return compile_(Settings(files, Options()), system.generated, TARGETS, only_check=False)


def _executors(
    project: Proved, targets: Collection[str], *, defensive: bool
) -> tuple[dict[str, str], tuple[Diagnostic, ...]]:
    """The generated files of every program that declares a table or a level, by path under the folder."""
    files: dict[str, str] = {}
    diagnostics = []
    paths: dict[str, tuple[str, str]] = {}
    names: dict[str, dict[str, tuple[str, str]]] = {}
    for root, program in project.executable:
        plan = planned(program, defensive=defensive)
        emitted_ = emitted(plan, targets)
        taken = next((path for path, text in emitted_.items() if _other(paths, path, text)), None)
        if taken is not None:
            diagnostics.append(_same_file(taken, root, paths[taken.casefold()][0]))
            continue
        paths |= {path.casefold(): (root, text) for path, text in emitted_.items()}
        for name in targets:
            diagnostics += _same_names(TARGETS[name], plan, root, names.setdefault(name, {}))
        files |= emitted_
    return files, tuple(diagnostics)


def _same_names(
    target: Target, plan: Plan, root: str, names: dict[str, tuple[str, str]]
) -> Iterator[Diagnostic]:
    """The first name that this program shares with another, or gives to two things; `names` has who has which, and gets its own."""
    for name, what in target.outward(plan):
        other, other_what = names.setdefault(name, (root, what))
        if other_what != what:
            message = f"`{name}` would be two things in {target.title}: {other_what} in `{other}`, and {what} in `{root}`"
            helps = ("rename one of the programs, or the table, level or type",)
            yield Diagnostic(Code.NAME_COLLISION, message, Label(Span(root, 0, 0)), help=helps)
            return


def planned(proved: ProvedProgram, *, defensive: bool = False) -> Plan:
    """How the executors of a proved program are laid out."""
    return lower(proved, project_root(proved.program.file), defensive=defensive)


def _other(paths: dict[str, tuple[str, str]], path: str, text: str) -> bool:
    """Whether another text goes to the file already; types that programs share have one text."""
    return path.casefold() in paths and paths[path.casefold()][1] != text


def _same_file(path: str, root: str, other: str) -> Diagnostic:
    message = f"`{root}` and `{other}` would both be compiled to `{path}`"
    helps = ("rename one of the files",)
    if path.endswith("_types.h"):
        message = f"`{root}` and `{other}` would each make other types of `{path}`"
        helps = (
            "let the file that declares them use all that its types need, or rename one of two files of one name",
        )
    return Diagnostic(Code.NAME_COLLISION, message, Label(Span(root, 0, 0)), help=helps)
