"""Words of more than 16 bits, which Z3 is asked about as bits: they mean what the interpreter says, whatever is done with them.

Conditions are drawn about two wide words, a narrow one and a number that may be below zero: bits, masks, comparisons, arithmetic and
choices, so that each kind of term meets each other. The interpreter is the oracle, at values that lie at edges.
"""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rcsc.lang.expressions.words import bits_alone
from rcsc.lang.interpret import UNDEFINED, holds
from rcsc.lang.model import Program, Test, Value
from rcsc.lang.resolve import compile_text
from rcsc.proof.solvers import smt
from rcsc.proof.solvers.smt import Answer, Solver
from rcsc.proof.symbolic import trial, values
from rcsc.proof.symbolic.encode import declared, encode, within
from rcsc.proof.symbolic.execution import Run

HEAD = """input w : int 0 .. 18446744073709551615
input v : int 0 .. 131071
input u : int 5 .. 200000
input n : int 0 .. 255
input k : int -5 .. 5
input s : bool
output o : int 0 .. 1
"""
WIDTHS = {"w": 64, "v": 17, "u": 18, "n": 8}


def masks(name: str) -> st.SearchStrategy[str]:
    """A mask of the word, of few or many bits."""
    width = WIDTHS[name]
    return st.text("xxx01", min_size=width, max_size=width).map(lambda digits: f"{name} = 0b{digits}")


def fields(name: str) -> st.SearchStrategy[str]:
    """Bits of the word as a number."""
    ends = st.tuples(st.integers(0, WIDTHS[name] - 1), st.integers(0, WIDTHS[name] - 1))
    return ends.map(lambda two: f"{name}[{max(two)}..{min(two)}]")


words = st.sampled_from(("w", "v", "u", "n"))
edges = st.sampled_from(
    (0, 1, 2, 3, 5, 7, 255, 256, 65535, 65536, 131070, 131071, 200_000, 2**31, 2**63 - 1, 2**63, 2**64 - 1)
)
numbers = st.recursive(
    st.one_of(words, st.just("k"), words.flatmap(fields), edges.map(str)),
    lambda inner: st.one_of(
        st.tuples(inner, st.sampled_from(("+", "-")), inner).map(lambda of: f"({' '.join(of)})"),
        st.tuples(st.sampled_from(("min", "max")), inner, inner).map(lambda of: f"{of[0]}({of[1]}, {of[2]})"),
        inner.map(lambda of: f"abs({of})"),
        st.tuples(inner, st.sampled_from(("/", "mod")), st.sampled_from(("1", "2", "3", "64", "65536"))).map(
            lambda of: f"({' '.join(of)})"
        ),
    ),
    max_leaves=3,
)
conditions = st.recursive(
    st.one_of(
        words.flatmap(masks),
        st.tuples(numbers, st.sampled_from(("=", "/=", "<", "<=", ">", ">=")), numbers).map(" ".join),
        words.flatmap(lambda name: edges.map(lambda edge: f"{name} in {{1, {edge % 2 ** WIDTHS[name]}}}")),
        words.map(lambda name: f"{name}[{WIDTHS[name] - 1}]"),
    ),
    lambda inner: st.one_of(
        st.tuples(inner, st.sampled_from(("and", "or")), inner).map(lambda of: f"({' '.join(of)})"),
        inner.map(lambda of: f"not ({of})"),
    ),
    max_leaves=4,
)
points = st.fixed_dictionaries(
    {
        "w": st.one_of(edges, st.integers(0, 2**64 - 1)),
        "v": st.one_of(edges.map(lambda edge: edge % 2**17), st.integers(0, 2**17 - 1)),
        "u": st.one_of(st.sampled_from((5, 6, 131071, 131072, 199_999, 200_000)), st.integers(5, 200_000)),
        "n": st.integers(0, 255),
        "k": st.integers(-5, 5),
        "s": st.booleans(),
    }
)


def compiled(condition: str) -> tuple[Program, Test] | None:
    """A program with a table that looks at the condition alone; None where the language does not have it."""
    row = f"table t {{\n | line | when || procedures | o |\n | a | {condition} || | 1 |\n | b | not ({condition}) || | 0 |\n}}\n"
    program = compile_text(HEAD + row)
    if not isinstance(program, Program):
        return None
    test = program.tables[0].lines[0].tests[0]
    return None if test is None else (program, test)


def holds_so(condition: str, given_points: list[dict[str, Value]]) -> bool:
    """Hold Z3's meaning of a condition, of both ways into it, and that of trial to the interpreter's; whether it compiles."""
    made = compiled(condition)
    if made is None:
        return False
    program, test = made
    frames = [declared(program.variables, [test.condition])[0], declared(program.variables)[0]]
    for name in ("w", "v", "u"):  # whatever is done with them
        frames[1].leaves[name] = smt.word(name, WIDTHS[name])
    kinds = {str(each.name): each.type for each in program.variables}
    start = {name: values.variable(name, kind) for name, kind in kinds.items()}
    for name in ("w", "u"):
        start[name].term = smt.word(name, WIDTHS[name])
    node = Run({}, kinds, dict(start)).evaluate(test.condition)
    tried = trial.ready(test.condition)
    ways = [
        *((encode(test.condition, frame), frame.leaves) for frame in frames),
        (values.term_of(node), {name: values.term_of(of) for name, of in start.items()}),
    ]
    pinned = [each for each in program.variables if str(each.name) in WIDTHS or each.name in ("k", "s")]
    for point in given_points:
        try:
            expected = holds(test, point)
        except UNDEFINED:
            continue
        assert tried(point) is expected
        assert trial.holds_at(node, point) is expected
        for said, leaves in ways:
            solver = Solver()
            for each in pinned:
                solver.add(within(leaves[str(each.name)], each.type))
                given_value = smt.literal(each.type, point[str(each.name)])
                solver.add(smt.equal(leaves[str(each.name)], given_value, each.type))
            opposite = smt.negation(said)
            assert solver.check(said if expected else opposite) is Answer.SATISFIABLE
            assert point == {
                str(each.name): solver.value(leaves[str(each.name)], each.type) for each in pinned
            }
            assert solver.check(opposite if expected else said) is Answer.UNSATISFIABLE
    return True


@settings(max_examples=40)
@given(conditions, st.lists(points, min_size=1, max_size=4))
def test_z3_says_what_the_interpreter_says(condition: str, given_points: list[dict[str, Value]]) -> None:
    holds_so(condition, given_points)


EDGES: list[dict[str, Value]] = [
    {"w": w, "v": v, "u": 5 + w % 199_996, "n": n, "k": k, "s": s}
    for w, v, n, k, s in (
        (0, 0, 0, 0, False), (0, 1, 1, -1, True), (131071, 131071, 255, -5, True), (131072, 131071, 7, 5, False),
        (131070, 131071, 8, -5, False), (2**64 - 1, 0, 128, 1, True), (2**63, 65536, 127, -2, False), (5, 5, 5, 5, True),
        (2**17, 0, 0, 0, True),
    )
]  # fmt: skip


@pytest.mark.parametrize(
    "condition",
    [
        "w < v", "w <= v", "w > v", "w >= v", "w = v", "w /= v", "v < n", "n <= v", "k < v", "v <= k", "v = k", "v > k",
        "w + 0 = 131072", "v + 1 > 131071", "v - 1 < 0", "w - v < 0", "0 - v <= k", "abs(k) = 5", "abs(w - 131071) <= 1",
        "abs(v) = v", "min(v, k) < 0", "max(v, k) = v",
        "max(v, 131072) = 131072", "min(w, v) = w", "max(w, 131072) > 131072", "min(v, 200000) = v",
        "v < max(k, 131072)", "v /= max(k, 131072)", "w[63] and not w[0]", "w[16..0] = v", "w[16..0] < v", "v[16..9] = n", "v[7..0] >= n",
        "u < v", "u[17]", "u[16..0] = v", "u >= 200000", "u <= 5", "u / 131072 = 1", "w[17..0] = u", "u = w", "min(u, v) = v",
        "w / 65536 = 1", "w mod 3 = 1", "w / 131072 mod 2 = 1", "v / 131072 = 0", "v mod 1 = 0", "v mod 131072 = v", "w / 1 = w",
        "real(w) > 131071.0", "single(v) = single(k)", "real(v) * 2.0 > 4.0",
    ],
)  # fmt: skip
def test_each_kind_of_term_meets_each_other(condition: str) -> None:
    assert holds_so(condition, EDGES)


@pytest.mark.parametrize(
    ("condition", "words"),
    [
        ("w = 0b" + "x" * 63 + "1", {"w"}),
        ("w[16..0] = v and v < 7", {"w", "v"}),
        ("u[17] and u > 7", {"u"}),  # whose least and greatest value leave out some
        ("w[7..0] = n", set()),  # a narrow word is a number
        ("w[7..0] < v[7..0] and v + 1 > 3", set()),  # what is compared with a number is one
        ("w[63] and v + 1 > 3", {"w"}),
        ("w[63] and v[16] and max(v, 3) > 4", {"w"}),
        ("w < 7 and v > 3", set()),  # no bits of any
        ("w mod 3 = 1 and v[3]", {"v"}),
        ("w[5] or w in {1, 2}", {"w"}),
        ("w[5] and (v[3] implies real(w) > 1.0)", {"v"}),
    ],
)
def test_words_of_which_bits_alone_are_looked_at(condition: str, words: set[str]) -> None:
    made = compiled(condition)
    assert made is not None
    program, test = made
    kinds = {str(each.name): each.type for each in program.variables}
    assert bits_alone([test.condition], kinds) == {name: WIDTHS[name] for name in words}


def test_masks_of_many_bits_cost_few_steps() -> None:
    made = compiled(" or ".join(f"w = 0b{'01x' * at}{'x10' * (20 - at)}xx01" for at in range(21)))
    assert made is not None
    program, test = made
    word = program.variables[0]
    frame, domain = declared(program.variables, [test.condition])
    solver = Solver()
    solver.add(*domain, encode(test.condition, frame))
    with smt.together(200_000):  # a fifth of what integers take, and ten times what bits do
        assert solver.check() is Answer.SATISFIABLE
        nothing = smt.equal(frame.leaves["w"], smt.literal(word.type, 0), word.type)
        assert solver.check(nothing) is Answer.UNSATISFIABLE
