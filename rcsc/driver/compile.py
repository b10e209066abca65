"""`rcsc compile`: the executors of every proved program."""

import os
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic, Label
from rcsc.base.diagnostics.source import Span
from rcsc.base.host import children
from rcsc.base.host.tools import Absent, c_compiler, ending, run_command, write_c
from rcsc.code.emit import TARGETS, emitted
from rcsc.code.emit.generated import lies_in, lying, stale, write
from rcsc.code.emit.lower import lower
from rcsc.code.emit.plan import Plan
from rcsc.code.testing.executors.externs import not_importable
from rcsc.code.testing.executors.native import COMPILE_S
from rcsc.driver.pipeline import Proved, proved
from rcsc.driver.settings import CodeWanted, Conclusion, Settings
from rcsc.lang.model import ProvedProgram
from rcsc.lang.project import PROJECT_FILE, Instance, prefix, project_root, systems_above
from rcsc.proof.solvers.options import Options
from rcsc.run.description import BadDescription, Description, LevelSpec, description, places
from rcsc.run.link import Linked, emit_system, linked, outward

DESCRIPTION = "system.toml"
"""What the description of a system is called in its folder."""


def compile_(
    settings: Settings,
    out: Path | None,
    targets: Collection[str],
    *,
    only_check: bool,
    defensive: bool = False,
) -> Conclusion:
    """Prove every table anew, then write the executors and the C of systems, or tell whether they are fresh.

    Args:
        settings: Which tables and systems, and how they are proved. A system is given by its description, or by the folder that holds it.
        out: The generated folder; None for the one that the systems' descriptions name, or else the usual one.
        targets: Languages, as `TARGETS` names them.
        only_check: Whether nothing is written.
        defensive: Whether the executors check their state in every cycle.

    Raises:
        BadDescription: A system is not in order, does not fit its programs, or names another folder than another system.
    """
    systems = tuple(systems_in(settings.paths))
    folder = out or _folder(systems)
    project = proved(with_programs(settings, systems))
    report = project.report()
    if report.failed:
        return Conclusion(report, "nothing was written")
    generated = generated_of(project, systems, targets, defensive)
    files = generated.files
    diagnostics = generated.clashes or _kept(files, str(folder), only_check=only_check)
    report = project.report(tuple(diagnostics))
    if report.failed:
        return Conclusion(report, "" if only_check else "nothing was written")
    return Conclusion(report, f"{len(files)} files {'are fresh' if only_check else 'written'} in {folder}")


def _kept(files: Mapping[str, str], folder: str, *, only_check: bool) -> Sequence[Diagnostic]:
    """Tell which files are not fresh, or write them: only if all can be imported and compiled."""
    old = stale(files, folder)
    if only_check or not old:
        return old
    return tuple(_unusable(files)) or write(files, folder)


def _unusable(files: Mapping[str, str]) -> Iterator[Diagnostic]:
    """Yield what cannot be used: Python that cannot be imported, C that a compiler refuses, where there is one."""
    for path, text in files.items():
        if path.endswith(".py") and (wrong := not_importable(text, path)):
            message = f"the generated `{path}` cannot be imported: {wrong}"
            yield Diagnostic(Code.INTERNAL, message, Label(Span(path, 0, 0)))
    compiler = c_compiler()
    if isinstance(compiler, Absent) or not any(path.endswith(".c") for path in files):
        return
    with children.scratch("compile") as place:
        sources = write_c(files, place)
        ran = run_command([compiler, "-std=c99", "-fsyntax-only", "-w", *sources], place, COMPILE_S)
    if ran.status != 0:
        message = f"the generated C does not compile: {ending(ran, COMPILE_S)}"
        yield Diagnostic(Code.NO_C_COMPILER, message, Label(Span(sources[0], 0, 0)))


def compile_system(path: Path, *, only_check: bool = False) -> Conclusion:
    """Prove the tables of a system's levels anew, and write their executors and the system's C where its description says.

    Args:
        path: Of the description.
        only_check: Whether nothing is written, and what is there is held against the tables.

    Raises:
        BadDescription: It is not in order.
    """
    return compile_(
        Settings((str(path),), Options()), description(path).generated, TARGETS, only_check=only_check
    )


def systems_in(paths: Iterable[str]) -> Iterator[Path]:
    """Yield the descriptions of systems among the paths: files that are one, and those in folders."""
    for path in map(Path, paths):
        if path.suffix == ".toml" and path.name != PROJECT_FILE and path.is_file():
            yield path
        elif (path / DESCRIPTION).is_file():
            yield path / DESCRIPTION


def tables_in(paths: tuple[str, ...], systems: tuple[Path, ...]) -> tuple[str, ...]:
    """Return the files to read tables from: those given that are no descriptions, and those of the systems' levels."""
    return _given(paths, systems, (str(file) for *_, file in _levels(systems)))


def with_programs(settings: Settings, systems: tuple[Path, ...]) -> Settings:
    """Return the settings with the programs of the systems' levels, instances too, in place of the descriptions."""
    programs: dict[str, Instance | None] = {}
    for system, spec, file in _levels(systems):
        instance = system.instance(spec, str(file))
        programs[str(file) if instance is None else instance.root] = instance
    instances = {root: instance for root, instance in programs.items() if instance is not None}
    return replace(
        settings,
        paths=_given(settings.paths, systems, programs),
        instances={**settings.instances, **instances},
    )


def _given(paths: tuple[str, ...], systems: tuple[Path, ...], levels: Iterable[str]) -> tuple[str, ...]:
    return tuple(dict.fromkeys([*(path for path in paths if Path(path) not in systems), *levels]))


def _levels(systems: tuple[Path, ...]) -> Iterator[tuple[Description, LevelSpec, Path]]:
    """Yield each level that has tables, with their file."""
    for path in systems:
        system = description(path)
        for spec in system.levels:
            if (file := _root(path, spec)) is not None:
                yield system, spec, file


def _root(path: Path, spec: LevelSpec) -> Path | None:
    return next((file for file in places(path, spec.source) if file.is_file()), None)


def _folder(systems: tuple[Path, ...]) -> Path:
    """Return the generated folder that the systems' descriptions name, as seen from here; without systems the usual one."""
    folders = {description(path).generated for path in systems}
    if len(folders) > 1:
        names = " and ".join(f"`{folder}`" for folder in sorted(folders))
        raise BadDescription(f"the systems are to be compiled to {names}: choose one with --out")
    return Path(os.path.relpath(folders.pop())) if folders else Path("generated")


@dataclass(frozen=True, slots=True)
class CodeFound:
    """The generated files of a program or system that are looked at.

    Attributes:
        files: Text by path below the generated folder; files of symbols as the tables give them.
        folder: Where they lie; None where they were made just now.
        lie: Languages that lie there; those that it has nothing of were made just now.
        defensive: Whether they check their whole state.
        stale: Each file that differs from what the tables give, or is missing.
        lacking: C and Python that are missing or cannot be read; nothing runs without them.
    """

    files: Mapping[str, str]
    folder: Path | None = None
    lie: tuple[str, ...] = ()
    defensive: bool = False
    stale: tuple[Diagnostic, ...] = ()
    lacking: tuple[str, ...] = ()

    @property
    def words(self) -> str:
        """Where the code is, in words."""
        if self.folder is None:
            return "what the tables give now"
        lie = " and ".join(str(self.folder / name) for name in self.lie)
        made = [name for name in _languages(self.files) if name not in self.lie]
        now = "".join(f"; {TARGETS[name].title} as the tables give it now" for name in made)
        return f"{lie}{' (defensive)' if self.defensive else ''}{now}"


def code_of(
    root: str, makes: Callable[[bool], Mapping[str, str]], wanted: CodeWanted, systems: Iterable[Path] = ()
) -> CodeFound:
    """Return the code of a program or system as it lies in the folder that is wanted, or else beside its project.

    Args:
        root: The root file of the program, or the description of the system.
        makes: Gives its files as the tables give them now; asked whether defensive ones.
        wanted: Which folder.
        systems: Descriptions whose `generated` is looked into first.
    """
    usual = makes(False)
    folder = wanted.folder or next((at for at in _beside(root, systems) if lies_in(usual, at)), None)
    if wanted.anew or folder is None:
        return CodeFound(usual)
    found = _lying(usual, folder, defensive=False)
    other = _lying(makes(True), folder, defensive=True) if found.stale else found
    return found if other.stale else other


def files_of(program: ProvedProgram, targets: Collection[str], defensive: bool) -> dict[str, str]:
    """Return the generated files of a program in some languages, as its tables give them."""
    return emitted(planned(program, defensive=defensive), targets)


def files_of_system(path: Path, project: Proved, targets: Collection[str], defensive: bool) -> dict[str, str]:
    """Return the generated files of a system and its programs, as their tables give them; raises `BadDescription`."""
    return generated_of(project, (path,), targets, defensive).files


def _lying(made: Mapping[str, str], folder: Path, *, defensive: bool) -> CodeFound:
    """Hold what lies in a folder against what the tables give, language by language; of none of them all is missing."""
    lie = tuple(name for name in _languages(made) if (folder / name).is_dir()) or _languages(made)
    asked = {path: text for path, text in made.items() if path.partition("/")[0] in lie}
    texts, stale = lying(asked, str(folder))
    symbols = {path: text for path, text in made.items() if path.endswith(".json")}
    code = (path for path in asked if path.endswith((".c", ".h", ".py")))
    missing = tuple(path for path in code if path not in texts)
    return CodeFound({**made, **texts, **symbols}, folder, lie, defensive, stale, missing)


def _languages(files: Iterable[str]) -> tuple[str, ...]:
    folders = {path.partition("/")[0] for path in files}
    return tuple(name for name in TARGETS if name in folders)


def _beside(root: str, systems: Iterable[Path]) -> Iterator[Path]:
    """Yield the folders that may hold what was compiled from a root file, as seen from here."""
    project = Path(project_root(root))
    folders = []
    for path in (*systems, *systems_above(root)):
        with suppress(BadDescription):
            folders.append(description(path).generated)
    folders += [project / "generated", project / ".." / "generated", Path("generated")]
    yield from dict.fromkeys(Path(os.path.relpath(folder)) for folder in folders)


@dataclass(slots=True)
class Generated:
    """Collects generated files.

    Attributes:
        files: By path under the folder.
        clashes: Files and names that would be two things.
        plans: Of each program, by its root file's real path.
        systems: By the path of the description.
    """

    targets: tuple[str, ...]
    defensive: bool
    files: dict[str, str] = field(default_factory=dict)
    clashes: list[Diagnostic] = field(default_factory=list)
    plans: dict[str, Plan] = field(default_factory=dict)
    systems: dict[Path, Linked] = field(default_factory=dict)
    _paths: dict[str, tuple[str, str]] = field(default_factory=dict)
    _names: dict[str, dict[str, tuple[str, str]]] = field(default_factory=dict)

    def add_program(self, root: str, program: ProvedProgram) -> None:
        """Add the executors of a program that declares a table or a level."""
        plan = self.plans[os.path.realpath(root)] = planned(program, defensive=self.defensive)
        if self._add(root, emitted(plan, self.targets)):
            for name in self.targets:
                self._share(root, name, TARGETS[name].outward(plan))

    def add_system(self, path: Path) -> None:
        """Add the C of a system whose programs were added.

        Raises:
            BadDescription: It does not fit them.
        """
        if "c" not in self.targets:
            return
        system, page = description(path), description(path).review()
        plans = {}
        for at, spec in enumerate(system.levels):
            plan = self._plan(path, system, spec)
            if plan is not None:
                plans[spec.name] = plan
            else:
                tried = " and ".join(f"`{file}`" for file in places(path, spec.source))
                page.wrong(
                    ("level", at, spec.key), f"there is no program `{spec.source}`", f"looked for {tried}"
                )
        if page.faults:
            raise page.bad(BadDescription)
        source = os.path.relpath(path, project_root(str(path))).replace("\\", "/")
        whole = self.systems[path] = linked(system, plans, source)
        if self._add(str(path), emit_system(whole)):
            self._share(str(path), "c", outward(whole))

    def _plan(self, path: Path, system: Description, spec: LevelSpec) -> Plan | None:
        """Return the plan of a level's program, if that was added."""
        file = _root(path, spec)
        instance = None if file is None else system.instance(spec, str(file))
        return self.plans.get(os.path.realpath(str(file) if instance is None else instance.root))

    def _add(self, root: str, files: Mapping[str, str]) -> bool:
        """Add files, if no other text goes to one of them already; types that programs share have one text."""
        for path, text in files.items():
            other, there = self._paths.get(path.casefold(), (root, text))
            if there != text:
                self.clashes.append(_same_file(path, root, other))
                return False
        self._paths |= {path.casefold(): (root, text) for path, text in files.items()}
        self.files |= files
        return True

    def _share(self, root: str, target: str, names: Iterable[tuple[str, str]]) -> None:
        """Report the first name that another root has, too, for another thing."""
        known = self._names.setdefault(target, {})
        for name, what in names:
            other, other_what = known.setdefault(name, (root, what))
            if other_what != what:
                title = TARGETS[target].title
                message = f"`{name}` would be two things in {title}: {other_what} in `{other}`, and {what} in `{root}`"
                helps = ("rename one of the programs, or the table, level or type",)
                self.clashes.append(
                    Diagnostic(Code.NAME_COLLISION, message, Label(Span(root, 0, 0)), help=helps)
                )
                return


def generated_of(
    project: Proved, systems: Iterable[Path], targets: Collection[str], defensive: bool
) -> Generated:
    """Make the files of all programs of a project, and the C of systems of them.

    Raises:
        BadDescription: A system does not fit its programs.
    """
    found = Generated(
        tuple(targets), defensive
    )  # a trial apart is handed it, and takes no view of a table of functions
    for root, program in project.executable:
        found.add_program(root, program)
    for path in systems:
        found.add_system(path)
    return found


def planned(proved: ProvedProgram, *, defensive: bool = False) -> Plan:
    """Make the plan of a proved program's executors."""
    root = project_root(proved.program.file)
    return lower(proved, root, defensive=defensive, prefix=prefix(root))


def _same_file(path: str, root: str, other: str) -> Diagnostic:
    message = f"`{root}` and `{other}` would both be compiled to `{path}`"
    helps = ("rename one of the files",)
    if path.endswith("_types.h"):
        message = f"`{root}` and `{other}` would each make other types of `{path}`"
        helps = (
            "let the file that declares them use all that its types need, or rename one of two files of one name",
        )
    return Diagnostic(Code.NAME_COLLISION, message, Label(Span(root, 0, 0)), help=helps)
