"""Draw slips in the generated C of the shipped levels, play the vectors on each, and say what became of them.

`python -m tests.slips` takes some minutes a level; `tests/slips/test_slips.py` plays a sample.
"""

import argparse
import re
import sys
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter

from rcsc.code.emit import emitted
from rcsc.code.testing.coverage.case import Entry, entries, function_of
from rcsc.code.testing.coverage.document import VectorSet
from rcsc.code.testing.coverage.harness import vectors_c
from rcsc.code.testing.coverage.vector_set import vector_set
from rcsc.code.testing.esbmc import EsbmcAnswer, ask, harness_file
from rcsc.driver.compile import planned
from rcsc.driver.pipeline import proved
from rcsc.driver.settings import Settings
from rcsc.driver.trials import proofs
from rcsc.proof.solvers.options import Options
from tests.slips.alike import reason_of
from tests.slips.drawn import Slip, slips_of, source_of
from tests.slips.played import Bench, with_slips
from tests.slips.text import functions

LEVELS = ("task", "emove", "primitive", "vision", "gripper")
TRIES = 20_000
"""States that are drawn for a slip that no vector notices."""
ESBMC_S = 30.0


@dataclass(frozen=True, slots=True)
class Judged:
    """A slip, and what became of it: `noticed`, `equivalent`, `missed` or `undecided`; and by what."""

    slip: Slip
    fate: str
    why: str = ""


def main() -> int:
    """Draw, play, judge, and print a table; the status is 1 where too many were missed."""
    parser = argparse.ArgumentParser(prog="python -m tests.slips", description=__doc__)
    parser.add_argument("levels", nargs="*", default=list(LEVELS))
    parser.add_argument(
        "--most", type=int, default=3, help="slips drawn at one place, of those of which there are many"
    )
    parser.add_argument("--seed", type=int, default=7)
    parser.add_argument(
        "--esbmc", type=float, default=ESBMC_S, metavar="SECONDS", help="for one function; 0 leaves it out"
    )
    parser.add_argument("--show", action="store_true", help="print every slip that is not noticed")
    wanted = parser.parse_args()
    rows = []
    for level in wanted.levels:
        began = perf_counter()
        document, files = vectors_of_level(level)
        made = perf_counter()
        judged = judged_slips(document, files, wanted.most, wanted.seed, wanted.esbmc)
        print(
            f"{level}: {len(document.kept)} vectors in {made - began:.0f} s, {perf_counter() - made:.0f} s of slips",
            file=sys.stderr,
        )
        if wanted.show:
            print("\n".join(_shown(each, document, files) for each in judged if each.fate != "noticed"))
        print(_by_operator(level, judged))
        rows.append((level, document, judged))
    return _closing(rows)


def vectors_of_level(level: str) -> tuple[VectorSet, dict[str, str]]:
    """Return the vectors of a shipped level, as `rcsc test --vectors` makes them, and its C."""
    options = Options()
    [(_, program)] = proved(Settings((f"tables/{level}/{level}.rcs",), options)).executable
    plan = planned(program)
    files = emitted(plan)
    return vector_set(plan, files, options, proofs(options).solver, lambda _: None), files


def judged_slips(
    document: VectorSet,
    files: dict[str, str],
    most: int,
    seed: int,
    esbmc_s: float,
    only: int | None = None,
    tries: int = TRIES,
) -> list[Judged]:
    """Draw slips (`only` so many of them), play the vectors, and judge what no vector notices."""
    source = source_of(document.program, document.symbols, files, most)
    slips = list(slips_of(source, seed))
    if only is not None:
        slips = slips[seed % max(1, len(slips) // only) :: max(1, len(slips) // only)]
    with TemporaryDirectory() as folder:
        vectors = vectors_c(document.program, document.symbols, document.kept)
        bench = Bench(document.program, document.symbols, files, slips, vectors, Path(folder))
        first = bench.first_failing()
        assert len(first) == len(slips), "the program that plays the vectors stopped"
        alive = [at for at, number in enumerate(first, 1) if number == 0]
        apart = {at for at, told in zip(alive, bench.told_apart(alive, tries), strict=True) if told}
        fates = {
            at: ("noticed", "it stops, or does not end" if number < 0 else f"vector {number}")
            for at, number in enumerate(first, 1)
        }
        fates |= {at: ("equivalent", reason_of(bench.text, slips[at - 1], source.greatest)) for at in alive}
        fates |= dict.fromkeys(apart, ("missed", "drawn states tell it apart"))
        open_ = [at for at in alive if not fates[at][1]]
        same = set(bench.same_code(open_))
        fates |= dict.fromkeys(same, ("equivalent", "the compiler makes the same code"))
        left = [at for at in open_ if at not in same]
        fates |= dict.fromkeys(left, ("undecided", "no reason is known"))
        fates |= Prover(document, bench, esbmc_s).all(left) if esbmc_s else {}
        return [Judged(slip, *fates[at]) for at, slip in enumerate(slips, 1)]


@dataclass(frozen=True, slots=True)
class Prover:
    """Asks ESBMC whether slips change anything, many of one function at once: which one is left open."""

    document: VectorSet
    bench: Bench
    esbmc_s: float

    def all(self, numbers: Sequence[int]) -> dict[int, tuple[str, str]]:
        """Return what became of each slip: first of its function by itself, then of every function of the header that may call it."""
        fates: dict[int, tuple[str, str]] = {}
        groups: dict[str, list[int]] = {}
        for number in numbers:
            groups.setdefault(self.bench.slips[number - 1].function, []).append(number)
        for name, group in groups.items():
            if harness := _of_function(self.document, self.bench, name):
                alike = "ESBMC: the function does the same on every state in range"
                fates |= {
                    each: fate
                    for each, fate in self._halved(name, harness, group, alike).items()
                    if fate[0] == "equivalent"
                }
            rest = [each for each in group if each not in fates]
            for entry in _reaching(self.document, self.bench, name) if rest else ():
                alike = "ESBMC: every function does the same on every state that `check` accepts"
                told = self._halved(
                    function_of(self.document.symbols, entry), _of_entry(self.document, entry), rest, alike
                )
                fates |= told
                rest = [each for each in rest if told[each][0] == "equivalent"]
        return fates

    def _halved(self, name: str, harness: str, group: list[int], alike: str) -> dict[int, tuple[str, str]]:
        """Ask about all of a group at once; where that is not proved, about each half."""
        chosen = " || ".join(f"which == {at}" for at, _ in enumerate(group, 1))
        text = harness.replace("CHOSEN;", f"const int which = nondet_which(); __ESBMC_assume({chosen});")
        slips = [self.bench.slips[number - 1] for number in group]
        files = {
            path: with_slips(text, slips) if text == self.bench.text else text
            for path, text in self.bench.files.items()
        }
        verdict = ask(files, name, text, self.esbmc_s, with_sources=False)
        if verdict.answer is EsbmcAnswer.PROVED:
            return dict.fromkeys(group, ("equivalent", alike))
        if len(group) > 1:
            half = len(group) // 2
            return self._halved(name, harness, group[:half], alike) | self._halved(
                name, harness, group[half:], alike
            )
        fate = "missed" if verdict.answer is EsbmcAnswer.REFUTED else "undecided"
        return {group[0]: (fate, f"{name}: {verdict.answer}: {verdict.detail[:100]}")}


def _same(document: VectorSet) -> list[str]:
    """Return C that asserts that `a` and `b` are alike."""
    symbols = document.symbols
    places = [
        *(symbols.path(v.name) for v in document.program.variables),
        "fault",
        "line",
        "fault_at",
        *symbols.failed,
    ]
    kinds = [symbols.c_type(v.name) for v in document.program.variables] + ["int"] * (len(places))
    return [
        f'__ESBMC_assert({f"ref_same(a.{p}, b.{p})" if kind in ("double", "float") else f"a.{p} == b.{p}"}, "{p}");'
        for p, kind in zip(places, kinds, strict=False)
    ]


def _of_function(document: VectorSet, bench: Bench, name: str) -> str:
    """Return the harness of the function itself; empty where it looks at no state, or is to take any."""
    function = next(each for each in functions(bench.text) if each.name == name)
    words = [each.split() for each in function.parameters.split(",")]
    own = function.name.removeprefix(document.symbols.program)
    if (
        not words[0][-1].startswith("*")
        or len(words[0]) > 3
        or own in ("_admit", "_check", "_init")
        or "n" in words[-1]
    ):
        return ""
    given = [f"{' '.join(each[:-1])} {each[-1]} = nondet_{at}();" for at, each in enumerate(words[1:])]
    heads = [
        "int nondet_which(void);",
        *(f"{' '.join(each[:-1])} nondet_{at}(void);" for at, each in enumerate(words[1:])),
    ]
    call = f"{function.name}({{}}{''.join(f', {each[-1]}' for each in words[1:])})"
    body = ["CHOSEN; __ESBMC_assume(ref_ranges(&a, 1));", *given, f"{document.symbols.struct} b = a;"]
    text = (
        "int32_t"
        if f"int32_t {function.name}(" in bench.text
        else "bool"
        if f"bool {function.name}(" in bench.text
        else ""
    )
    for who, number in (("a", "which"), ("b", "0")):
        got = f"const {text} got_{who} = " if text else ""
        body.append(f"rcsc_slip = {number}; {got}{call.format(f'&{who}')};")
    body += ['__ESBMC_assert(got_a == got_b, "result");'] if text else []
    made = harness_file(
        document.program, document.symbols, document.symbols.source, [*body, *_same(document)]
    )
    return made.replace("int main(void) {", "\n".join([*heads, "int main(void) {"]))


def _of_entry(document: VectorSet, entry: Entry) -> str:
    """Return the harness of a function of the header, on any state that `check` accepts."""
    symbols, name = document.symbols, function_of(document.symbols, entry)
    body = ["CHOSEN;"]
    body += [] if entry.kind in ("check", "init") else [f"__ESBMC_assume({symbols.check}(&a) == -1);"]
    if entry.kind == "line":
        number = [table.name for table in document.program.tables].index(entry.name)  # type: ignore[arg-type]
        body += [f"__ESBMC_assume(ref_ranges(&a, 1) && ref_t{number}_safe(&a));"]
    got = "" if entry.kind == "init" else "const int32_t {} = "
    body += [f"{symbols.struct} b = a;", f"rcsc_slip = which; {got.format('got_a')}{name}(&a);"]
    body += [f"rcsc_slip = 0; {got.format('got_b')}{name}(&b);"]
    body += ['__ESBMC_assert(got_a == got_b, "result");'] if got else []
    made = harness_file(document.program, symbols, symbols.source, [*body, *_same(document)])
    return made.replace("int main(void) {", "int nondet_which(void);\nint main(void) {")


def _reaching(document: VectorSet, bench: Bench, function: str) -> list[Entry]:
    """Return the functions of the header that may call the one with the slip."""
    bodies = {each.name: bench.text[each.body.start : each.body.end] for each in functions(bench.text)}
    reached, open_ = {function}, [function]
    while open_:
        name = open_.pop()
        callers = [
            other
            for other, body in bodies.items()
            if re.search(rf"\b{name}\b", body) and other not in reached
        ]
        reached.update(callers)
        open_ += callers
    return [
        e
        for e in entries(document.program)
        if e.kind != "lines" and function_of(document.symbols, e) in reached
    ]


# --- tables ---


def _shown(judged: Judged, document: VectorSet, files: dict[str, str]) -> str:
    text = next(text for path, text in files.items() if path.endswith(f"/{document.symbols.source}"))
    slip = judged.slip
    line = text.count("\n", 0, slip.start) + 1
    old = " ".join(text[slip.start : slip.end].split())
    change = f"{slip.operator}: {old[:70]} -> {slip.new[:70]}"
    return f"  {judged.fate}: {document.symbols.source}:{line} {slip.function}: {change} ({judged.why})"


def _by_operator(level: str, judged: list[Judged]) -> str:
    """Return a table: by operator, how many were drawn, noticed, equivalent, missed and undecided."""
    fates = ("noticed", "equivalent", "missed", "undecided")
    count = Counter((each.slip.operator, each.fate) for each in judged)
    lines = [f"{level:30} {'drawn':>8}{''.join(f'{fate:>12}' for fate in fates)}"]
    for operator in dict.fromkeys(each.slip.operator for each in judged):
        numbers = [count[(operator, fate)] for fate in fates]
        lines.append(f"  {operator:28} {sum(numbers):8}{''.join(f'{number:12}' for number in numbers)}")
    return "\n".join(lines)


def _closing(rows: list[tuple[str, VectorSet, list[Judged]]]) -> int:
    """Print figures of each level, and the reasons; return 1 where less than 99 of 100 that are not equivalent were noticed."""
    every = [each for _, _, judged in rows for each in judged]
    for name, judged in [*((level, own) for level, _, own in rows), ("all", every)]:
        fates = Counter(each.fate for each in judged)
        counted = len(judged) - fates["equivalent"]
        share = fates["noticed"] / max(1, counted)
        print(
            f"{name}: {len(judged)} slips, {fates['equivalent']} equivalent; {fates['noticed']} of {counted} others noticed, {share:.2%}"
        )
    for level, document, _ in rows:
        kinds = Counter(kept.case.entry.kind for kept in document.kept)
        print(
            f"{level}: {len(document.kept)} vectors, of which {kinds['cycle']} run whole cycles and {kinds['step']} steps"
        )
    stopped = sum(each.why.startswith("it stops") for each in every)
    print(f"  noticed because the C stops or does not end: {stopped}")
    for why, number in Counter(each.why for each in every if each.fate == "equivalent").most_common():
        print(f"  equivalent: {number}: {why}")
    fates = Counter(each.fate for each in every)
    return int(fates["noticed"] < 0.99 * (len(every) - fates["equivalent"]))


if __name__ == "__main__":
    sys.exit(main())
