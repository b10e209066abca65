"""The whole system proved, level by level.

In: a system's description. Out: `SystemProof`. The proofs of the levels are put together by `compose.__doc__`'s
argument; here it is checked that what a level assumes of a neighbour is what was proved of that neighbour, and that
they begin in agreement.
"""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path

from rcsc.compose.contract.claims import UNKNOWN, Closed, Key, Need, Promise, closed
from rcsc.compose.contract.environment import Links, check_ends, links
from rcsc.compose.contract.obligations import Obligation, obligations
from rcsc.compose.contract.transition import Safety, TransitionSystem
from rcsc.compose.invariant.search import Effort
from rcsc.compose.proof.assume_guarantee import agreements, claims, other_end
from rcsc.compose.proof.kept import keep, recall
from rcsc.compose.proof.level import LevelProof, Verdict, besides, essential, prove_level
from rcsc.diagnostics.coded import CodedError
from rcsc.diagnostics.codes import Code
from rcsc.diagnostics.diagnostic import Diagnostic
from rcsc.host import children
from rcsc.host.cache import Cache
from rcsc.lang.meaning import with_stops
from rcsc.lang.model import AssumptionName, Program
from rcsc.lang.project import Loaded, load
from rcsc.run.description import BadDescription, Description, description, places
from rcsc.symbolic.values import TRUE

SHOWN_HERE = frozenset({Code.ASSUMPTION_NOT_PROVED, Code.INVARIANT_BROKEN, Code.TWO_WRITERS})
"""What is proved of the levels, or is no fault of a cycle as it runs."""


class NoProgramError(CodedError):
    """A level's tables cannot be read, or are not in order; says which."""


@dataclass(frozen=True, slots=True)
class SystemProof:
    """What was found of a whole system.

    Attributes:
        closed: What follows of each claim over the whole chain; of levels that were not proved nothing is known.
    """

    levels: tuple[LevelProof, ...]
    agreements: tuple[Promise, ...]
    seconds: float = field(compare=False)
    closed: Mapping[Need, Closed] = field(default_factory=dict)

    @property
    def proved(self) -> bool:
        """Whether every obligation that could be stated, and every agreement between levels, is found so."""
        return all(not essential(proof) for proof in self.levels) and all(
            agreement.holds for agreement in self.agreements
        )

    @property
    def whole(self) -> bool:
        """Whether it is proved, nothing was left out, and nothing rests on what is not known."""
        besides_ = {(proof.level, obligation.key) for proof in self.levels for obligation in besides(proof)}
        return (
            self.proved
            and not any(proof.unstated for proof in self.levels)
            and all(one.proved for need, one in self.closed.items() if need not in besides_)
        )

    def of(self, level: str, key: Key) -> Closed:
        """What follows of a claim."""
        return self.closed.get((level, key), UNKNOWN)


def transition_systems(path: Path) -> dict[str, TransitionSystem]:
    """Make a transition system for each level that the file describes, from the top down.

    Each subordinate may assume that the fields stand still which its superior is built to number: the
    fields that the superior compares with the last order. That the superior keeps them is proved with it.

    Raises:
        BadDescription: The description says something that cannot be.
        NoProgramError: The tables of a level cannot be read.
    """
    system = description(path)
    read = {spec.name: checked(path, spec.program) for spec in system.levels}
    made = transition_systems_of(system, {name: program for name, (program, _) in read.items()})
    return {name: replace_safety(one, read[name][1]) for name, one in made.items()}


def transition_systems_of(
    system: Description, programs: Mapping[str, Program]
) -> dict[str, TransitionSystem]:
    """Make the transition systems of programs that were read, one for each level.

    Raises:
        BadDescription: The description says something that cannot be.
        NoProgramError: A program has no such level.
    """
    check_ends(system, programs)
    every = {name: links(system, name, program) for name, program in programs.items()}
    _check_ranks(every)
    found = {}
    for name, program in programs.items():
        level = next((one for one in program.levels if one.name == name), None)
        if level is None:
            raise NoProgramError(f"program `{program.name}` has no level `{name}`")
        found[name] = TransitionSystem(program, level, _narrowed(every[name], every, programs))
    return found


def _check_ranks(every: Mapping[str, Links]) -> None:
    """Check that no level is its own superior at any distance: each would end its commands given that the other does.

    Raises:
        BadDescription: One is.
    """
    for name in every:
        way = [name]
        while (above := every[way[-1]].above) is not None and above.name in every and above.name not in way:
            way.append(above.name)
        if above is not None and above.name == name:
            said = ", ".join(f"`{one}` takes orders of `{two}`" for one, two in pairwise((*way, name)))
            raise BadDescription(f"there is no highest level: {said}")


def _narrowed(mine: Links, every: Mapping[str, Links], programs: Mapping[str, Program]) -> Links:
    """Narrow a level's numbered fields to those that its superior compares."""
    above = mine.above
    if above is None or above.outside:
        return mine
    from rcsc.compose.contract.predicates import compared

    upper = next((below for below in every[above.name].below if below.name == mine.level), None)
    if upper is None:
        raise BadDescription(
            f"`{mine.level}.{above.order}` is an order of `{above.name}`, which takes no report of it"
        )
    pairs = {leaf for pair in compared(programs[above.name]) for leaf in pair}
    kept = tuple(leaf for leaf in above.numbered if other_end(leaf, above.order, upper.order) in pairs)
    return replace(mine, above=replace(above, numbered=kept))


def checked(path: Path, name: str) -> tuple[Program, Safety]:
    """Return the program of a level, and why a cycle as nodes is what its executors do.

    It is so only where nothing leaves its range and every operation is defined: that is shown of the program by itself, where
    it has to be given its invariants, which are obligations here. An assumption that is needed for it stops the cycle where it fails.

    Raises:
        NoProgramError: It is not there, does not resolve, or something in it may leave its range or not be defined.
    """
    from rcsc.procedures.obligations import Obligations
    from rcsc.solvers.options import Options

    program = loaded_program(path, name)[0]
    owed = Obligations(program, Options())
    found = owed.prove(program.tables)
    for diagnostic in found:
        if diagnostic.code not in SHOWN_HERE:
            raise NoProgramError(f"{diagnostic.message}: see `rcsc check {diagnostic.primary.span.file}`")
    return with_stops(program, owed.stops), _safety(program, owed.stops, found)


def _safety(
    program: Program, stops: Mapping[str, tuple[AssumptionName, ...]], found: Sequence[Diagnostic]
) -> Safety:
    """Decide whether safety needs the invariants: not where all is shown without them, under no other stopping assumptions."""
    from rcsc.procedures.obligations import Obligations
    from rcsc.solvers.options import Options

    if not program.invariants:
        return Safety()
    without = Obligations(replace(program, invariants=()), Options())
    wrong = any(diagnostic.code not in SHOWN_HERE for diagnostic in without.prove(program.tables))
    if not wrong and all(set(names) <= set(stops.get(table, ())) for table, names in without.stops.items()):
        return Safety()
    broken = any(diagnostic.code is Code.INVARIANT_BROKEN for diagnostic in found)
    return Safety(tuple(invariant.name for invariant in program.invariants), broken)


def replace_safety(ts: TransitionSystem, safety: Safety) -> TransitionSystem:
    """Return the transition system with what is known of its program's safety."""
    return TransitionSystem(ts.program, ts.level, ts.links, safety)


def loaded_program(path: Path, name: str) -> tuple[Program, Loaded]:
    """Return the program of a level, and the files that it was read from.

    Raises:
        NoProgramError: It is not there, or does not resolve.
    """
    from rcsc.lang.resolve import resolve

    for file in places(path, name):
        if file.is_file():
            loaded = load([str(file)])
            program = resolve(loaded.roots[0], loaded)
            if isinstance(program, Program) and not loaded.diagnostics:
                return program, loaded
            raise NoProgramError(f"`{file}` is not in order: see `rcsc check {file}`")
    raise NoProgramError(f"there is no program `{name}` beside {path}")


def prove_transition_systems(
    made: Mapping[str, TransitionSystem],
    effort: Effort | None,
    jobs: int,
    only: tuple[str, ...],
    said: Callable[[LevelProof], None] | None = None,
    cache: Cache | None = None,
) -> SystemProof:
    """Prove these levels, except those in the cache; call `said` with each as it is done.

    Agreements are looked at only for all levels.
    """
    begun = time.perf_counter()
    proofs: dict[str, LevelProof] = {}
    for name, proof in _each_unless_kept(made, effort or Effort(), jobs, only, cache):
        proofs[name] = proof
        if said is not None:
            said(proof)
    agreed = tuple(agreements(made, proofs)) if set(proofs) == set(made) else ()
    follows = closed(claims(made, proofs))
    return SystemProof(tuple(proofs.values()), agreed, time.perf_counter() - begun, follows)


def _each_unless_kept(
    made: Mapping[str, TransitionSystem],
    effort: Effort,
    jobs: int,
    only: tuple[str, ...],
    cache: Cache | None,
) -> Iterator[tuple[str, LevelProof]]:
    """Yield each level's proof, in order."""
    known = {name: recall(cache, made[name], effort) for name in only} if cache is not None else {}
    new = _each(made, effort, jobs, tuple(name for name in only if known.get(name) is None))
    for name in only:
        kept = known.get(name)
        if kept is not None:
            yield name, kept
            continue
        _, proof = next(new)
        if cache is not None:
            keep(cache, made[name], effort, proof)
        yield name, proof


def _each(
    made: Mapping[str, TransitionSystem], effort: Effort, jobs: int, only: tuple[str, ...]
) -> Iterator[tuple[str, LevelProof]]:
    """Yield each level's proof; made in processes where there are several jobs."""
    if jobs == 1 or len(only) <= 1:
        for name in only:
            yield name, prove_level(made[name], effort)
        return
    with children.pool(min(jobs, len(only))) as pool:
        waiting = {name: pool.submit(_proved, made[name], effort) for name in only}
        for name, future in waiting.items():
            proof = children.answer(future)
            yield name, replace(proof, found=_again(made[name], proof))


def _proved(ts: TransitionSystem, effort: Effort) -> LevelProof:
    """Prove in a process of its own; obligations return without their many nodes and are made anew."""
    found = prove_level(ts, effort)
    return replace(
        found, found=tuple((replace(obligation, holds=TRUE), verdict) for obligation, verdict in found.found)
    )


def _again(ts: TransitionSystem, proof: LevelProof) -> tuple[tuple[Obligation, Verdict], ...]:
    wanted = obligations(ts, ts.cycle(ts.havoc()))
    return tuple((obligation, verdict) for obligation, (_, verdict) in zip(wanted, proof.found, strict=True))
