"""The whole system proved, level by level.

In: a system's description. Out: `SystemProof`. The proofs of the levels are put together by `compose.__doc__`'s
argument; here it is checked that what a level assumes of a neighbour is what was proved of that neighbour, and that
they begin in agreement.
"""

import time
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field, replace
from multiprocessing import get_context
from pathlib import Path

from rcsc.cache import Cache
from rcsc.compose.contract import COMMAND, ECHO, ECHOED, NUMBER, Links, links
from rcsc.compose.goals import Goal, Sort, goals
from rcsc.compose.kept import keep, recall
from rcsc.compose.level import LevelProof, Verdict, prove_level
from rcsc.compose.search import Effort
from rcsc.compose.transition import Stepper
from rcsc.model import Program
from rcsc.prove.values import TRUE
from rcsc.system.description import description


class NoProgramError(Exception):
    """A level's tables cannot be read; says which."""


@dataclass(frozen=True, slots=True)
class Agreement:
    """One thing that a level assumes of a neighbour, and why it may.

    Attributes:
        level: Who assumes it.
        assumed: In words.
        reason: Whose guarantee it is, in words.
        holds: Whether it is proved; where the neighbour stands outside the levels it is the neighbour's to keep.
    """

    level: str
    assumed: str
    reason: str
    holds: bool
    outside: bool = False


@dataclass(frozen=True, slots=True)
class SystemProof:
    """What was found of a system; `steppers` by level, to look further."""

    levels: tuple[LevelProof, ...]
    agreements: tuple[Agreement, ...]
    seconds: float = field(compare=False)

    @property
    def proved(self) -> bool:
        """Whether every goal and every agreement between levels is proved."""
        return all(not essential(proof) for proof in self.levels) and all(
            one.holds for one in self.agreements
        )


def essential(proof: LevelProof) -> tuple[Goal, ...]:
    """Goals that failed; a field that is not numbered is no failure, but nobody may assume that it is; a command is."""
    beside = besides(proof)
    return tuple(goal for goal in proof.open if goal not in beside)


def besides(proof: LevelProof) -> tuple[Goal, ...]:
    """Fields of orders that change under the same number, commands apart."""
    return tuple(
        goal for goal in proof.open if goal.sort is Sort.NUMBERED and not goal.name.endswith(f".{COMMAND}")
    )


def steppers(path: Path) -> dict[str, Stepper]:
    """A stepper for each level of the system described by the file, from the top down.

    Each subordinate may assume that the fields stand still which its superior is built to number: the
    fields that the superior compares with the last order. That the superior keeps them is proved with it.

    Raises:
        BadDescription: The description says something that cannot be.
        NoProgramError: The tables of a level cannot be read.
    """
    system = description(path)
    programs = {spec.name: program_of(path, spec.program) for spec in system.levels}
    every = {name: links(system, name, program) for name, program in programs.items()}
    found = {}
    for name, program in programs.items():
        level = next((one for one in program.levels if one.name == name), None)
        if level is None:
            raise NoProgramError(f"program `{program.name}` has no level `{name}`")
        found[name] = Stepper(program, level, _narrowed(every[name], every, programs))
    return found


def _narrowed(mine: Links, every: Mapping[str, Links], programs: Mapping[str, Program]) -> Links:
    """The links, with only those fields numbered that the superior compares."""
    above = mine.above
    if above is None or above.outside:
        return mine
    from rcsc.compose.features import compared

    upper = next(one for one in every[above.name].below if one.name == mine.level)
    pairs = {leaf for pair in compared(programs[above.name]) for leaf in pair}
    kept = tuple(leaf for leaf in above.numbered if _other(leaf, above.order, upper.order) in pairs)
    return replace(mine, above=replace(above, numbered=kept))


def _other(leaf: str, record: str, other: str) -> str:
    """The same field at the other end of the buffer."""
    return other + leaf.removeprefix(record)


def program_of(path: Path, name: str) -> Program:
    """The program of a level, beside the description.

    Raises:
        NoProgramError: It is not there, or does not resolve.
    """
    from rcsc.project import load
    from rcsc.resolve import resolve

    for file in (path.parent / name / f"{name}.rcs", path.parent / f"{name}.rcs"):
        if file.is_file():
            loaded = load([str(file)])
            program = resolve(loaded.roots[0], loaded)
            if isinstance(program, Program) and not loaded.found:
                return program
            raise NoProgramError(f"`{file}` is not in order: see `rcsc check {file}`")
    raise NoProgramError(f"there is no program `{name}` beside {path}")


def prove_system(path: Path, effort: Effort | None = None, jobs: int = 1) -> SystemProof:
    """Proves every level of the system described by the file.

    Raises:
        BadDescription: The description says something that cannot be.
        NoProgramError: The tables of a level cannot be read.
    """
    made = steppers(path)
    return prove_steppers(made, effort, jobs, tuple(made))


def prove_steppers(
    made: Mapping[str, Stepper],
    effort: Effort | None,
    jobs: int,
    only: tuple[str, ...],
    said: Callable[[LevelProof], None] | None = None,
    cache: Cache | None = None,
) -> SystemProof:
    """Proves these levels, but for those that the cache has; `said` is called with each as it is done.

    Agreements are looked at only for all levels.
    """
    begun = time.perf_counter()
    proofs: dict[str, LevelProof] = {}
    for name, proof in _each_unless_kept(made, effort or Effort(), jobs, only, cache):
        proofs[name] = proof
        if said is not None:
            said(proof)
    agreed = tuple(agreements(made, proofs)) if set(proofs) == set(made) else ()
    return SystemProof(tuple(proofs.values()), agreed, time.perf_counter() - begun)


def _each_unless_kept(
    made: Mapping[str, Stepper], effort: Effort, jobs: int, only: tuple[str, ...], cache: Cache | None
) -> Iterator[tuple[str, LevelProof]]:
    """Each level's proof, in order."""
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
    made: Mapping[str, Stepper], effort: Effort, jobs: int, only: tuple[str, ...]
) -> Iterator[tuple[str, LevelProof]]:
    """Each level's proof; in processes where there are several jobs."""
    if jobs == 1 or len(only) <= 1:
        for name in only:
            yield name, prove_level(made[name], effort)
        return
    pool = ProcessPoolExecutor(min(jobs, len(only)), mp_context=get_context("spawn"))
    try:
        waiting = {name: pool.submit(_proved, made[name], effort) for name in only}
        for name, one in waiting.items():
            yield name, replace(one.result(), found=_again(made[name], one.result()))
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _proved(stepper: Stepper, effort: Effort) -> LevelProof:
    """In a process of its own: goals come back without their nodes, which are many, and are made anew."""
    found = prove_level(stepper, effort)
    return replace(found, found=tuple((replace(goal, holds=TRUE), verdict) for goal, verdict in found.found))


def _again(stepper: Stepper, proof: LevelProof) -> tuple[tuple[Goal, Verdict], ...]:
    wanted = goals(stepper, stepper.cycle(stepper.anywhere()))
    return tuple((goal, verdict) for goal, (_, verdict) in zip(wanted, proof.found, strict=True))


def agreements(made: Mapping[str, Stepper], proofs: Mapping[str, LevelProof]) -> list[Agreement]:
    """What each level assumes of each neighbour, matched with what was proved there."""
    found = []
    for name, stepper in made.items():
        found += _of_above(name, stepper, made, proofs)
        for below in stepper.links.below:
            words = f"what `{below.name}` reports under the number of the last order is about that order"
            if below.outside:
                found.append(
                    Agreement(name, words, f"`{below.name}` stands outside the levels", True, outside=True)
                )
                continue
            lower = made[below.name].links.above
            assert lower is not None
            echoes = proofs[below.name].verdict(Sort.ECHOES, "", lower.report) is Verdict.PROVED
            begins = _begin(stepper, below.order, made[below.name], lower.order)
            reason = f"proved of `{below.name}`: {Sort.ECHOES.value}; both begin with the same order"
            found.append(Agreement(name, words, reason, echoes and begins))
    return found


def _of_above(
    name: str, stepper: Stepper, made: Mapping[str, Stepper], proofs: Mapping[str, LevelProof]
) -> list[Agreement]:
    above = stepper.links.above
    if above is None:
        return []
    fields = ", ".join(f"`{leaf}`" for leaf in above.numbered)
    words = (
        f"while the number of `{above.order}` stays, so do {fields}"
        if fields
        else f"the numbers of `{above.order}` come one after the other"
    )
    if above.outside:
        return [Agreement(name, words, f"`{above.name}` stands outside the levels", True, outside=True)]
    upper = next(one for one in made[above.name].links.below if one.name == name)
    proof = proofs[above.name]
    held = all(
        proof.verdict(Sort.NUMBERED, "", _other(leaf, above.order, upper.order)) is Verdict.PROVED
        for leaf in above.numbered
    )
    held = held and proof.verdict(Sort.NEXT_NUMBER, "", upper.order) is Verdict.PROVED
    return [Agreement(name, words, f"proved of `{above.name}`: {Sort.NUMBERED.value}", held)]


def _begin(upper: Stepper, order: str, lower: Stepper, record: str) -> bool:
    """Before the first cycle the lower level's order is the upper's, and the upper sees it echoed."""
    first = {str(v.name): v.initial for v in upper.program.variables}
    other = {str(v.name): v.initial for v in lower.program.variables}
    leaves = (f"{order}.{NUMBER}", f"{order}.{COMMAND}")
    report = next(one.report for one in upper.links.below if one.order == order)
    echoed = first[f"{report}.{ECHO}"] != first[leaves[0]] or first[f"{report}.{ECHOED}"] == first[leaves[1]]
    return echoed and all(first[leaf] == other[_other(leaf, order, record)] for leaf in leaves)
