"""What all commands that prove begin with: the files read, each root resolved and proved."""

from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic, sort_key
from rcsc.base.diagnostics.report import Report, merged
from rcsc.base.diagnostics.source import Source
from rcsc.base.host.cache import Cache
from rcsc.base.host.files.read import Malformed, text
from rcsc.base.host.memory import uncollected
from rcsc.driver.proofs import prove
from rcsc.driver.settings import Proof, Settings
from rcsc.lang.model import Program, ProvedProgram
from rcsc.lang.project import Instance, Loaded, load
from rcsc.lang.resolve import closure, noted, resolve
from rcsc.lang.syntax.tree import Declaration, PropertyDecl, RequirementDecl


@dataclass(frozen=True, slots=True)
class Proved:
    """The files, and the proof of each root; `asked` are the paths that were given, or that a system's levels have."""

    loaded: Loaded
    proofs: tuple[Proof, ...]
    asked: tuple[str, ...] = ()

    def report(self, diagnostics: tuple[Diagnostic, ...] = ()) -> Report:
        """Report each finding once, and each table once, with the worst verdict of all programs that it is in."""
        every = {
            *self.loaded.diagnostics,
            *diagnostics,
            *(diagnostic for proof in self.proofs for diagnostic in proof.diagnostics),
        }
        tables = merged(table for proof in self.proofs for table in proof.tables)
        return Report(tuple(sorted(every, key=sort_key)), tables, self.loaded.sources)

    def unread(self) -> Iterator[Diagnostic]:
        """Yield warnings of names that the programs declare and do not read."""
        from rcsc.proof.table.findings.unread import unread  # keep lazy: `rcsc check` alone asks

        for proof in self.proofs:
            if proof.program is not None:
                files = {name: self.loaded.files[name] for name in closure(proof.root, self.loaded)}
                yield from unread(proof.program, files)

    @property
    def executable(self) -> tuple[tuple[str, ProvedProgram], ...]:
        """The proved programs with a table or a level, each with its root file; a file with instances only where it was asked for."""
        programs = [(proof.root, proof.proved) for proof in self.proofs if proof.proved is not None]
        instances = [one.program.instance for _, one in programs if one.program.instance is not None]
        names, files = {(one.file, one.name) for one in instances}, {one.file for one in instances}
        return tuple(
            (root, one)
            for root, one in programs
            if _runs(one.program)
            and (
                one.program.instance is not None
                or root not in files
                or (root in self.asked and (root, one.program.name) not in names)
            )
        )


@uncollected()
def proved(settings: Settings, cache: Cache | None = None) -> Proved:
    """Read, resolve and prove; with a cache only what it does not have."""
    loaded = read(settings)
    return Proved(loaded, tuple(_proofs(loaded, settings, cache)), settings.paths)


def read(settings: Settings) -> Loaded:
    """Load the files, and all that they use."""
    settings.progress("reading")
    loaded = load(settings.paths, settings.stdin, instances=settings.instances)
    asked = {instance.span.file for instance in settings.instances.values()}
    return replace(loaded, sources={**loaded.sources, **dict(_described(asked))})


def _described(files: Iterable[str]) -> Iterator[tuple[str, Source]]:
    """Yield the texts of the descriptions that ask for instances."""
    for file in sorted(files):
        with suppress(OSError, Malformed):  # who made the instances has read it
            yield file, Source(file, text(Path(file)))


def _proofs(loaded: "Loaded", settings: Settings, cache: Cache | None) -> Iterator[Proof]:
    """Resolve and prove each root; where it cannot be resolved, give the findings of its files."""
    for root in loaded.roots:
        settings.progress(f"proving {root}")
        program = resolve(root, loaded)
        if isinstance(program, Program):
            yield _said(prove(root, program, loaded, settings.options, cache), loaded.instances.get(root))
        else:
            yield Proof(root, _across(root, loaded, program))
    settings.progress("")


def _across(root: str, loaded: Loaded, found: tuple[Diagnostic, ...]) -> tuple[Diagnostic, ...]:
    """Return what is wrong with a file that is no program: less, where it states requirements across levels, or a name is unknown."""
    if any(isinstance(each, RequirementDecl | PropertyDecl) for each in _declared(root, loaded)):
        from rcsc.compose.together.words import told_across  # keep lazy: few files state such

        found = told_across(root, loaded, found)
    if any(each.code is Code.UNKNOWN_NAME for each in found):
        from rcsc.driver.missing import told  # keep lazy: most files name what is declared

        found = told(root, loaded, found)
    return found


def _declared(root: str, loaded: Loaded) -> tuple[Declaration, ...]:
    return loaded.files[root].declarations if root in loaded.files else ()


def _said(proof: Proof, instance: Instance | None) -> Proof:
    """Return a proof whose findings say of which instance they are."""
    if instance is None:
        return proof
    return replace(proof, diagnostics=tuple(noted(found, instance) for found in proof.diagnostics))


def _runs(program: Program) -> bool:
    own_levels = any(level.span.file == program.file for level in program.levels)
    return own_levels or bool(program.own_tables)
