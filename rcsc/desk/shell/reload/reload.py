"""New tables for a level that runs: proved and compiled beside it, in its present state.

In: a running level, the system's description and where it stands. Out: `Reloaded`, or a refusal that says why; then the
old level runs on. Whether it is taken is for `gate` to judge. The sources of what runs are kept from before anybody edits them.
"""

import os
from collections.abc import Callable, Iterator, Mapping
from collections.abc import Set as AbstractSet
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from rcsc.base.diagnostics.coded import Refused
from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Severity
from rcsc.base.diagnostics.render import with_witness
from rcsc.base.diagnostics.report import Report
from rcsc.base.host.children import scratch
from rcsc.code.emit import TARGETS
from rcsc.desk.shell.reload.gate import witness
from rcsc.driver.compile import compile_
from rcsc.driver.settings import Settings
from rcsc.lang.hidden import fed_with
from rcsc.lang.interpret import holds
from rcsc.lang.model import Program, Value
from rcsc.lang.project import PROJECT_FILE, again, load, project_root
from rcsc.lang.resolve import resolve
from rcsc.proof.solvers.options import Options
from rcsc.run.description import BadDescription, Description, LevelSpec, places
from rcsc.run.executors import NotBuilt
from rcsc.run.levels import Query, RunningLevel, running_level
from rcsc.run.log.schema import fingerprints
from rcsc.run.signature import Leaf, Signature, generated_files, number_word, signature
from rcsc.run.system import Kind, executors

MOST_SHOWN = 5


@dataclass(frozen=True, slots=True)
class KeptSources:
    """A root file and all that it uses.

    Attributes:
        root: The root file below the project's folder.
        texts: Contents by path below the project's folder; the project's own file, too.
    """

    root: str
    texts: Mapping[str, bytes]


def kept(source: Path) -> KeptSources:
    """The texts as they are now, of exactly the files that a check reads; what cannot be read is left out."""
    project = os.path.abspath(project_root(str(source)))
    texts = {_below(name, project): file.text.encode() for name, file in load([str(source)]).sources.items()}
    return KeptSources(_below(str(source), project), {PROJECT_FILE: b"", **texts})


def _below(file: str, project: str) -> str:
    """Return the path below the project's folder, by names or else by links; the whole path of a file elsewhere."""
    whole = os.path.abspath(file)
    folder, name = os.path.split(whole)
    for path, above in (
        (whole, project),
        (os.path.join(os.path.realpath(folder), name), os.path.realpath(project)),
    ):
        if os.path.commonpath((path, above)) == above:
            return os.path.relpath(path, above)
    return whole


@contextmanager
def laid_out(held: KeptSources) -> Iterator[Path]:
    """Write the files to a temporary folder, and give the root file there."""
    with scratch("reload") as place:
        for name, text in held.texts.items():
            if os.path.isabs(name):
                continue
            path = place / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(text)
        yield place / held.root


@dataclass(frozen=True, slots=True)
class Origin:
    """Where a system comes from, to make a level of it again.

    Attributes:
        path: Its description; sources stand beside it.
        unwritten: Gives the real paths of texts that somebody has changed and not written.
    """

    path: Path
    system: Description
    kind: Kind
    queries: Mapping[str, Query]
    unwritten: Callable[[], AbstractSet[str]] = frozenset


@dataclass(frozen=True, slots=True)
class Reloaded:
    """A level with new tables, in the state of the old one.

    Attributes:
        digest: Of its executors, as `rcsc.run.log.schema.fingerprints` has it.
        sources: What they were compiled from.
        carried: What became of its variables, in words.
    """

    level: RunningLevel
    program: Program
    digest: str
    sources: KeptSources
    carried: str


def source_of(plant: Origin, spec: LevelSpec) -> Path:
    """Return the file that a level's program is compiled from.

    Raises:
        Refused: It is not where it is looked for.
    """
    tried = places(plant.path, spec.source)
    source = next((path for path in tried if path.is_file()), None)
    if source is None:
        looked = " and ".join(f"`{path}`" for path in tried)
        raise Refused(
            Code.SHELL_RELOAD, f"the tables of level `{spec.name}` are not there", f"looked for {looked}"
        )
    return source


def program_of(plant: Origin, spec: LevelSpec, held: KeptSources | None) -> Program:
    """Return the meaning of the tables of the executors.

    Args:
        plant: Where the system comes from.
        spec: The level.
        held: Its sources as they were when it began to run; None where they were not there.

    Raises:
        Refused: They had changed since they were compiled, or are not in order.
    """
    source = source_of(plant, spec)
    with laid_out(held or kept(source)) as there:
        compiled = compile_(_settings(plant, spec, there), plant.system.generated, TARGETS, only_check=True)
        if compiled.report.failed:
            raise Refused(
                Code.SHELL_RELOAD,
                f"`{source}` is not what level `{spec.name}` runs: {_why(compiled.report)}",
                f"`reload {spec.name}` takes it",
            )
        return _resolved(plant, spec, there)


def reload(plant: Origin, spec: LevelSpec, old: RunningLevel, runs: Callable[[], Program | None]) -> Reloaded:
    """The level with the tables as they are now.

    Args:
        plant: Where the system comes from.
        spec: The level.
        old: As it runs.
        runs: Gives what its tables mean; None where their sources are not known.

    Raises:
        Refused: They are not proved, or the present state is not in what was proved.
    """
    source = source_of(plant, spec)
    _written(plant, spec, source)
    sources = kept(source)
    with scratch("reload") as place:
        compiled = compile_(_settings(plant, spec, source), place, TARGETS, only_check=False)
        if compiled.report.failed:
            raise _refused(spec.name, f"it is not proved: {_why(compiled.report)}")
        program = _resolved(plant, spec, source)
        try:
            there = replace(plant.system, generated=place)
            sign = signature(generated_files(there.generated, spec.program)[0])
            executor = executors(there, {spec.name: sign}, plant.kind)[spec.name]
            level = running_level(spec, there, sign, executor, plant.queries)
        except (OSError, ValueError, StopIteration, BadDescription, NotBuilt) as error:
            raise _refused(spec.name, str(error) or "it has no such level") from error
        digest = fingerprints(there)[spec.program]
    _same_buffers(old, level)
    carried = _carried(old, level, _histories(program, runs))
    _in_proof(level, program)
    return Reloaded(level, program, digest, sources, carried)


def _written(plant: Origin, spec: LevelSpec, source: Path) -> None:
    """Refuse to take what is on disk where somebody sees another text of it."""
    held = plant.unwritten()
    if not held:
        return
    used = {os.path.realpath(file): file for file in load([str(source)]).files}
    names = [os.path.basename(used[path]) for path in used if path in held]
    if names:
        raise _refused(
            spec.name,
            f"{' and '.join(names)} {'is' if len(names) == 1 else 'are'} changed here and not written",
            "write the file first, or take the changes back: what is on disk is taken",
        )


def _settings(plant: Origin, spec: LevelSpec, source: Path) -> Settings:
    instance = plant.system.instance(spec, str(source))
    if instance is None:
        return Settings((str(source),), Options())
    return Settings((instance.root,), Options(), instances={instance.root: instance})


def _resolved(plant: Origin, spec: LevelSpec, source: Path) -> Program:
    loaded = again(str(source), plant.system.instance(spec, str(source)))
    program = resolve(loaded.roots[0], loaded)
    assert isinstance(program, Program)  # it was compiled a moment ago
    return program


def _refused(level: str, why: str, *helps: str) -> Refused:
    return Refused(Code.SHELL_RELOAD, f"level `{level}` keeps its tables: {why}", *helps)


def _why(report: Report) -> str:
    errors = [diagnostic for diagnostic in report.diagnostics if diagnostic.severity is Severity.ERROR]
    shown = [with_witness(error, report.sources) for error in errors[:MOST_SHOWN]]
    more = [f"and {len(errors) - MOST_SHOWN} more"] if len(errors) > MOST_SHOWN else []
    return "\n".join(["", *shown, *more])


def _same_buffers(old: RunningLevel, new: RunningLevel) -> None:
    """Refuse a buffer of another form: the neighbours were compiled for the old."""
    for forms, others in ((_buffers(old), _buffers(new)), (_buffers(new), _buffers(old))):
        for name, form in forms.items():
            if others.get(name) != form:
                raise _refused(
                    old.name,
                    f"buffer `{name}` has another form",
                    "reload is of one level; end the shell and compile",
                )


def _buffers(level: RunningLevel) -> dict[str, list[object]]:
    runs = [(take.buffer, take.first, take.first + take.count) for take in level.takes]
    runs += [(give.buffer, give.first, give.end) for give in level.gives]
    return {
        name: [
            (leaf.name, leaf.c_type, leaf.members, leaf.low, leaf.high)
            for leaf in level.sign.leaves[first:end]
        ]
        for name, first, end in runs
    }


@dataclass(frozen=True, slots=True)
class _Origin:
    """The old leaf whose value a new one takes, empty for none; a counter goes no further than its new end."""

    leaf: str
    counts: bool = False


def _histories(program: Program, runs: Callable[[], Program | None]) -> dict[str, _Origin]:
    """The old leaf that holds what each new one looks back at, by what feeds both; none where that is not known."""
    hidden = [variable for variable in program.variables if fed_with(variable) is not None]
    before = runs() if hidden else None
    known = {} if before is None else {fed_with(v): str(v.name) for v in before.variables}
    return {str(v.name): _Origin(known.get(fed_with(v), ""), v.counts is not None) for v in hidden}


def _carried(old: RunningLevel, new: RunningLevel, histories: Mapping[str, _Origin]) -> str:
    """Put the old values into the new level, by name, or by what they look back at; return what became of them."""
    origins = {leaf.name: histories.get(leaf.name, _Origin(leaf.name)) for leaf in new.sign.leaves}
    added = [name for name, origin in origins.items() if origin.leaf not in old.sign.index]
    values: list[Value] = [
        leaf.initial if leaf.name in added else _value(old, leaf, origins[leaf.name])
        for leaf in new.sign.leaves
    ]
    new.put_back(tuple(values))  # `_in_proof` looks at it
    taken = {origin.leaf for origin in origins.values()}
    gone = [leaf.name for leaf in old.sign.leaves if leaf.name not in taken]
    parts = [f"{len(values) - len(added)} variables keep their values"]
    parts += [f"new: {', '.join(added)}"] if added else []
    parts += [f"gone: {', '.join(gone)}"] if gone else []
    return "; ".join(parts)


def _value(old: RunningLevel, leaf: Leaf, origin: _Origin) -> Value:
    """The old value as a value of the new leaf."""
    before, value = old.sign.leaves[old.sign.index[origin.leaf]], old.value(origin.leaf)
    if origin.counts and leaf.high is not None:
        return min(value, int(leaf.high))
    if _form(before) != _form(leaf):
        raise _refused(old.name, f"`{leaf.name}` was {_form(before)} and is now {_form(leaf)}")
    shown = before.shown(value)
    if leaf.members:
        if shown not in leaf.members:
            raise _refused(old.name, f"`{leaf.name}` = {shown}, which its new type does not have")
        return leaf.members.index(shown)
    if leaf.low is not None and leaf.high is not None and not leaf.low <= value <= leaf.high:
        raise _refused(
            old.name, f"`{leaf.name}` = {shown} lies outside its new range {leaf.low} .. {leaf.high}"
        )
    return value


def _form(leaf: Leaf) -> str:
    if leaf.members:
        return "an enumeration"
    if leaf.c_type == "bool":
        return "a bool"
    return f"{'an' if number_word(leaf) == 'int' else 'a'} {number_word(leaf)}{f' in {leaf.unit}' if leaf.unit else ''}"


def _in_proof(level: RunningLevel, program: Program) -> None:
    """Refuse where an invariant does not hold of the present values."""
    sign: Signature = level.sign
    now = {leaf.name: value for leaf, value in zip(sign.leaves, level.values, strict=False)}
    for invariant in program.invariants:
        if not holds(invariant.condition, now):
            raise _refused(
                level.name,
                f"invariant `{invariant.name}` does not hold of the present state: {witness(program, invariant.condition, now)}",
                "it is proved to be kept, but of a state in which it holds: set what it speaks of first",
            )
