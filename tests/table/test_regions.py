"""Relational tables: the tree of regions against brute force, on the families, and its limits."""

import itertools
import math
import operator
import random
from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from functools import reduce

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rcsc.lang.interpret import matching_lines
from rcsc.lang.leaves import parts
from rcsc.lang.model import (
    Among,
    Apply,
    Assumption,
    AssumptionName,
    Bool,
    Box,
    Column,
    Default,
    Enum,
    Expr,
    Int,
    Kind,
    Line,
    LineName,
    Literal,
    Op,
    Program,
    Read,
    Real,
    Scalar,
    Single,
    Snapshot,
    Standing,
    Table,
    TableName,
    Test,
    Value,
    Variable,
    VariableName,
    key_bounds,
    value_of_key,
)
from rcsc.proof.solvers import smt
from rcsc.proof.table import relational
from rcsc.proof.table.confirm import TableSolver
from rcsc.proof.table.decide import prove_table
from rcsc.proof.table.regions import counting, splitting
from rcsc.proof.table.regions.atoms import Universe, assumptions_of, lines_of
from rcsc.proof.table.regions.ends import Ends
from rcsc.proof.table.regions.least import find, least, negated, never, whole, widest
from rcsc.proof.table.regions.linear import Simplex, integer_point, least_point
from rcsc.proof.table.regions.points import projected
from rcsc.proof.table.regions.region import (
    Bounds,
    Candidate,
    Counted,
    Empty,
    Node,
    NoWitness,
    Only,
    Open,
    OutsideAssumption,
    Question,
    Search,
    Split,
)
from rcsc.proof.table.regions.splitting import Tree
from rcsc.proof.table.verdict import ContradictoryAssumptions, DeadLine, Gap, Overlap, Undecided
from tests.bench.made import families
from tests.support.programs.stages import BOXES, verdict_of
from tests.support.programs.stages import program_of as compiled

BOOL = Bool()
SMALL = Int(0, 4)
WIDE = Int(-(10**6), 10**6)
COLOUR = Enum("colour", ("red", "green", "blue"))
LEAVES: dict[str, Scalar] = {"b": BOOL, "c": COLOUR, "d": COLOUR, "x": SMALL, "y": SMALL, "z": Int(-2, 2)}


def read(name: str, kind: Scalar | None = None) -> Read:
    return Read(VariableName(name), LEAVES[name] if kind is None else kind)


def number(value: int) -> Literal:
    return Literal(value, Int(value, value))


def compare(op: Op, left: Expr, right: Expr) -> Expr:
    return Apply(op, (left, right), BOOL)


def total(coefficients: Sequence[int], names: Sequence[str], kind: Scalar | None = None) -> Expr:
    """The sum of coefficients times leaves."""
    whole_: Expr = number(0)
    for k, name in zip(coefficients, names, strict=True):
        if k:
            term = Apply(Op.MUL, (number(k), read(name, kind)), WIDE)
            whole_ = Apply(Op.ADD, (whole_, term), WIDE)
    return whole_


def program_of(
    lines: Sequence[Sequence[Expr]], default: Default | None = None, assumed: Sequence[Expr] = ()
) -> Program:
    """A program of one table, whose cells all stand under `when`."""
    kinds: dict[str, Scalar] = {}
    for condition in (*itertools.chain.from_iterable(lines), *assumed):
        kinds |= {part.name: part.type for part in parts(condition) if isinstance(part, Read)}
    names = sorted(kinds)
    variables = tuple(
        Variable(VariableName(n), Kind.INPUT, kinds[n], value_of_key(kinds[n], key_bounds(kinds[n])[0]))
        for n in names
    )
    tests: dict[Expr, Test] = {}
    for condition in itertools.chain.from_iterable(lines):
        used = {part.name for part in parts(condition) if isinstance(part, Read)}
        tests.setdefault(
            condition, Test("", condition, tuple(VariableName(n) for n in names if n in used), None)
        )
    width = max([1, *map(len, lines)])
    rows = tuple(
        Line(LineName(str(i + 1)), (*(tests[c] for c in row), *[None] * (width - len(row))), ())
        for i, row in enumerate(lines)
    )
    assumptions = tuple(
        Assumption(AssumptionName(f"a{i}"), Standing.ASSUMED, condition)
        for i, condition in enumerate(assumed)
    )
    table = Table(
        TableName("t"),
        tuple(Column("when", None, None) for _ in range(width)),
        rows,
        default,
        tuple(v.name for v in variables),
        tuple(a.name for a in assumptions),
    )
    return Program("p", "p.rcs", (), (), (), variables, (), assumptions, (), (table,), (table.name,), (), ())


def searched(program: Program) -> tuple[Universe, Search]:
    """The search of the program's only table, without a solver."""
    table = program.tables[0]
    universe = Universe()
    lines = lines_of(universe, table)
    assumptions = assumptions_of(universe, program, table)
    default = table.default is not None and not table.default.unreachable
    return universe, Tree(universe, lines, assumptions, lambda _: NoWitness.UNKNOWN, default=default).run()


MEANING: dict[Op, Callable[[Value, Value], Value]] = {
    Op.AND: lambda a, b: a and b, Op.OR: lambda a, b: a or b, Op.IMPLIES: lambda a, b: b if a else True, Op.XOR: operator.xor,
    Op.EQ: operator.eq, Op.NE: operator.ne, Op.LT: operator.lt, Op.LE: operator.le,
    Op.GT: operator.gt, Op.GE: operator.ge, Op.ADD: operator.add, Op.SUB: operator.sub, Op.MUL: operator.mul,
}  # fmt: skip


def value_of(expr: Expr, at: Snapshot) -> Value:
    """A reference meaning of its own, for what these tests write."""
    match expr:
        case Literal(value=value):
            return value
        case Read(name=name):
            return at[name]
        case Among(subject=subject, values=values):
            return value_of(subject, at) in values
        case Apply(op=op, args=args):
            a, *rest = [value_of(arg, at) for arg in args]
            if op is Op.NOT:
                return not a
            b = rest[0]
            return MEANING[op](a, b)
    raise AssertionError(expr)


def inputs(program: Program) -> list[dict[str, Value]]:
    """Every input that the assumptions admit, least first in declared order."""
    ranges = [
        [value_of_key(v.type, k) for k in range(key_bounds(v.type)[0], key_bounds(v.type)[1] + 1)]
        for v in program.variables
    ]
    names = [str(v.name) for v in program.variables]
    points = (dict(zip(names, values, strict=True)) for values in itertools.product(*ranges))
    return [p for p in points if all(value_of(a.condition, p) for a in program.assumptions)]


def matches(line: Line, at: Snapshot) -> bool:
    return all(value_of(test.condition, at) for test in line.tests if test is not None)


def matching(program: Program, at: Snapshot) -> list[int]:
    return [i for i, line in enumerate(program.tables[0].lines) if matches(line, at)]


INTS = st.sampled_from(["x", "y", "z"])
ORDER = st.sampled_from([Op.LT, Op.LE, Op.GT, Op.GE, Op.EQ, Op.NE])
ATOMS: st.SearchStrategy[Expr] = st.one_of(
    st.builds(compare, ORDER, st.builds(read, INTS), st.builds(read, INTS)),
    st.builds(compare, ORDER, st.builds(read, INTS), st.integers(-3, 5).map(number)),
    st.builds(
        lambda op, ks, n: compare(op, total(ks, ["x", "y", "z"]), number(n)),
        ORDER, st.tuples(*[st.integers(-3, 3)] * 3), st.integers(-6, 9),
    ),
    st.builds(lambda vs: Among(read("x"), tuple(vs)), st.sets(st.integers(0, 4), min_size=1)),
    st.builds(lambda v: Among(read("c"), (v,)), st.integers(0, 2)),
    st.builds(lambda op: compare(op, read("c"), read("d")), st.sampled_from([Op.EQ, Op.NE])),
    st.just(read("b")),
    st.builds(lambda a: compare(Op.EQ, read("b"), a), st.builds(compare, ORDER, st.just(read("x")), st.just(read("y")))),
)  # fmt: skip
CONDITIONS = st.recursive(
    ATOMS,
    lambda inner: st.one_of(
        st.builds(lambda a: Apply(Op.NOT, (a,), BOOL), inner),
        st.builds(
            lambda op, a, b: Apply(op, (a, b), BOOL),
            st.sampled_from([Op.AND, Op.OR, Op.XOR, Op.IMPLIES]),
            inner,
            inner,
        ),
    ),
    max_leaves=3,
)


@st.composite
def cuts(draw: st.DrawFn) -> list[list[Expr]]:
    """Lines by cutting the space again and again: right by construction, unless one is then changed."""
    lines: list[list[Expr]] = [[]]
    for _ in range(draw(st.integers(1, 6))):
        line = lines.pop(draw(st.integers(0, len(lines) - 1)))
        condition = draw(CONDITIONS)
        lines += [[*line, condition], [*line, Apply(Op.NOT, (condition,), BOOL)]]
    if draw(st.booleans()):
        at = draw(st.integers(0, len(lines) - 1))
        lines[at] = [draw(CONDITIONS), *lines[at][1:]]
    return lines


DEFAULTS = st.sampled_from(
    [None, Default(LineName("d"), (), unreachable=True), Default(LineName("d"), (), unreachable=False)]
)


@given(cuts(), DEFAULTS, st.lists(CONDITIONS, max_size=2))
def test_verdict_pairs_and_gap_are_those_of_brute_force(
    lines: list[list[Expr]], default: Default | None, assumed: list[Expr]
) -> None:
    program = program_of(lines, default, assumed)
    _, search = searched(program)
    found = [(point, matching(program, point)) for point in inputs(program)]
    pairs = {pair for _, lines_ in found for pair in itertools.combinations(lines_, 2)}
    covers = default is None or default.unreachable
    assert set(search.overlaps) == pairs
    assert bool(search.gaps) == (covers and any(not lines_ for _, lines_ in found))
    assert search.undecided == 0
    assert search.proved == (Open() not in search.nodes)


@given(cuts(), st.lists(CONDITIONS, max_size=1))
def test_least_point_is_the_first_of_brute_force(lines: list[list[Expr]], assumed: list[Expr]) -> None:
    program = program_of(lines, None, assumed)
    universe = Universe()
    table = program.tables[0]
    wanted = [whole(c) for c in (lines_of(universe, table)[0], *assumptions_of(universe, program, table))]
    columns = [universe.column(Read(v.name, v.type)) for v in program.variables]
    point = least(universe, wanted, columns)
    expected = next((p for p in inputs(program) if matches(table.lines[0], p)), None)
    if expected is None:
        assert point is NoWitness.NONE
    else:
        assert not isinstance(point, NoWitness)
        assert [point[c] for c in columns] == [int(v) for v in expected.values()]
        refuted = negated(universe, whole(lines_of(universe, table)[0]))

        def excluded(box: Mapping[int, Bounds]) -> bool:
            atoms = [universe.atom(universe.single[c], (bounds,)) for c, bounds in box.items()]
            right = find(universe, [*atoms, refuted]) is NoWitness.NONE
            assert never(universe, box, refuted) in {None, right}  # what the ends of forms tell is so
            return right

        box = widest(universe, point, columns, excluded)
        inside = [
            dict(zip(expected, values, strict=True))
            for values in itertools.product(*(range(box[c][0], box[c][1] + 1) for c in columns))
        ]
        assert expected in inside
        assert all(matches(table.lines[0], p) for p in inside)


def planes(count: int, seed: int, names: Sequence[str] = ("p", "q", "r", "s")) -> list[list[Expr]]:
    """Lines from recursive cuts by random planes; the two sides spell the plane differently."""
    rng = random.Random(seed)  # noqa: S311 - tables by seed
    kind = Int(-1000, 1000)
    regions: list[tuple[list[Expr], list[tuple[int, ...]]]] = [
        ([], [tuple(rng.randint(-1000, 1000) for _ in names) for _ in range(3 * count)])
    ]
    while len(regions) < count:
        regions.sort(key=lambda region: len(region[1]))
        path, points = regions.pop()
        ks = [rng.randint(-3, 3) for _ in names]
        values = sorted(sum(k * v for k, v in zip(ks, p, strict=True)) for p in points)
        cut = values[len(values) // 2]
        if values[0] <= cut < values[-1]:
            low = compare(Op.LE, total([2 * k for k in ks], names, kind), number(2 * cut + 1))
            high = compare(Op.LT, number(cut), total(ks, names, kind))
            sides = [
                [p for p in points if (sum(map(int.__mul__, ks, p)) <= cut) == side] for side in (True, False)
            ]
            regions += [([*path, low], sides[0]), ([*path, high], sides[1])]
        else:
            regions.append((path, points))
    return [path for path, _ in regions]


def orders(size: int) -> list[list[Expr]]:
    """One line an order of `size` integers, stated by neighbours only."""
    kind = Int(0, 100)
    return [
        [
            compare(Op.LT if a > b else Op.LE, read(f"v{a}", kind), read(f"v{b}", kind))
            for a, b in itertools.pairwise(order)
        ]
        for order in itertools.permutations(range(size))
    ]


@pytest.mark.parametrize("lines", [planes(300, 1), orders(5)], ids=["planes", "orders"])
def test_families_are_proved_and_each_planted_fault_is_found(lines: list[list[Expr]]) -> None:
    assert searched(program_of(lines))[1].proved
    gap = searched(program_of(lines[:7] + lines[8:]))[1]
    assert gap.gaps
    assert not gap.overlaps
    doubled = searched(program_of([*lines, lines[3]]))[1]
    assert set(doubled.overlaps) == {(3, len(lines))}
    wider = searched(program_of([*lines[:5], lines[5][:-1], *lines[6:]]))[1]
    assert wider.overlaps
    assert not wider.gaps


CURVED = st.one_of(
    st.builds("x * y {} {}".format, st.sampled_from(["<", ">", "=", "/="]), st.integers(0, 12)),
    st.builds("(x + y) mod 3 {} {}".format, st.sampled_from(["<", ">", "="]), st.integers(0, 2)),
    st.builds("x {} {} * y - {}".format, st.sampled_from(["<", ">", "<=", "="]), st.integers(1, 3), st.integers(0, 4)),
    st.just("true"),
)  # fmt: skip


@settings(max_examples=25, deadline=None)
@given(st.lists(st.lists(CURVED, min_size=1, max_size=2), min_size=2, max_size=5), st.booleans())
def test_all_pairs_and_the_least_gap_are_told_where_the_solver_is_asked_of_regions(
    lines: list[list[str]], default: bool
) -> None:
    """Which input it gives of a region depends on what it was asked before; what is told does not."""
    rows = "".join(f"| l{at} | {' and '.join(line)} ||\n" for at, line in enumerate(lines))
    tail = "| d | DEFAULT ||\n" if default else ""
    program = compiled(
        f"input x : int 0 .. 5\ninput y : int 0 .. 5\ntable t {{\n| line | when ||\n{rows}{tail}}}\n"
    )
    [table] = program.tables
    points: list[dict[str, Value]] = [{"x": x, "y": y} for x in range(6) for y in range(6)]
    names = [line.name for line in table.lines]
    at = [[names.index(name) for name in matching_lines(table, point)] for point in points]
    findings = prove_table(program, table, BOXES).findings
    told = {(one.first, one.second): one.witness for one in findings if isinstance(one, Overlap)}
    for pair in {pair for lines_ in at for pair in itertools.combinations(sorted(lines_), 2)} | told.keys():
        first = next(p for p, lines_ in zip(points, at, strict=True) if {*pair} <= {*lines_})
        assert told[pair] == {name: first[name] for name in table.variables}
    gaps = [gap.witnesses[0] for gap in findings if isinstance(gap, Gap)]
    missed = [p for p, lines_ in zip(points, at, strict=True) if not lines_][:1]
    assert gaps == [{name: first[name] for name in table.variables} for first in missed]


@pytest.mark.parametrize("given_", [{"x": 0, "y": 0}, {"x": 0, "y": 1}, {"x": 5, "y": 5}])
def test_whatever_input_the_solver_gives_of_a_region_the_rest_is_asked_for(
    given_: dict[str, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(relational._Decision, "oracle", lambda *_: given_)  # else it chooses
    program = compiled(
        "input x : int 0 .. 5\ninput y : int 0 .. 5\ntable t {\n| line | when ||\n"
        "| a | x * y < 3 ||\n| b | x * y < 5 ||\n| c | x * y < 2 and x > 3 ||\n}\n"
    )
    findings = prove_table(program, program.tables[0], BOXES).findings
    told = {(one.first, one.second): one.witness for one in findings if isinstance(one, Overlap)}
    assert told == {(0, 1): {"x": 0, "y": 0}, (0, 2): {"x": 4, "y": 0}, (1, 2): {"x": 4, "y": 0}}
    assert [gap.witnesses[0] for gap in findings if isinstance(gap, Gap)] == [{"x": 1, "y": 5}]


def test_of_several_gaps_the_least_input_is_told() -> None:
    program = compiled(
        "input x : int 0 .. 9\ninput y : int 0 .. 9\ntable t {\n| line | when ||\n"
        "| a | x + y < 5 ||\n| b | x + y > 6 and x - y /= 3 ||\n}\n"
    )
    [gap] = prove_table(program, program.tables[0], BOXES).findings
    assert isinstance(gap, Gap)
    assert gap.witnesses == ({"x": 0, "y": 5},)


@pytest.mark.parametrize("lines", [12, 80])
@pytest.mark.parametrize("default", ["", "| d | DEFAULT ||\n"])
def test_the_least_gap_of_planes_is_told_with_few_lines_and_with_many(
    lines: int, default: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of many lines without the solver, which would have to be told all of them."""
    if lines > 64:
        monkeypatch.setattr(TableSolver, "holds", None)
    text = families.linear(lines, 3, lines, "gap").replace("\n}", f"\n{default}}}")
    program = compiled(text)
    [table] = program.tables
    findings = prove_table(program, table, BOXES).findings
    [gap] = [finding for finding in findings if isinstance(finding, Gap)]
    assert len(findings) == 1
    assert not matching_lines(table, gap.witnesses[0])
    hole = text.partition("and not (")[2].partition(")")[0]
    assert hole == " and ".join(f"{name} = {value}" for name, value in gap.witnesses[0].items())


def test_overlaps_of_planes_are_told_with_their_least_inputs_by_few_simplexes(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Without the solver, and with no tree but the table's: an input is minimised, a region grown by the ends of forms."""
    monkeypatch.setattr(TableSolver, "holds", None)
    calls: dict[str, int] = {}

    def counted(of: type, name: str) -> None:
        work = getattr(of, name)

        def wrapped(*args: object) -> object:
            calls[name] = calls.get(name, 0) + 1
            return work(*args)

        monkeypatch.setattr(of, name, wrapped)

    counted(Simplex, "refute")
    counted(Tree, "run")
    program = compiled(families.linear(128, 4, 2, widened=4))
    [table] = program.tables
    findings = prove_table(program, table, BOXES).findings
    assert len(findings) > 20
    for overlap in findings:
        assert isinstance(overlap, Overlap)
        names = {table.lines[at].name for at in (overlap.first, overlap.second)}
        assert names <= set(matching_lines(table, overlap.witness))
    assert calls["run"] == 1
    assert calls["refute"] <= 60 * len(findings)


@pytest.mark.parametrize("lines", range(3, 6))
def test_every_pair_is_told_where_two_lines_match_everywhere(lines: int) -> None:
    """That two of them overlap is known from the first region; that they do with a line that matches one value, only from its own."""
    for narrow in itertools.combinations(range(lines), lines - 2):
        conditions = [[compare(Op.EQ, read("x"), number(2))] if at in narrow else [] for at in range(lines)]
        found = searched(program_of(conditions))[1]
        assert set(found.overlaps) == set(itertools.combinations(range(lines), 2)), narrow


def test_planes_take_a_node_for_each_line_and_its_split_and_next_to_no_simplex(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Cuts that part all lines are found by masks, and points of lines by projecting."""
    simplexes = 0

    def counted(simplex: Simplex, refute: Callable[[Simplex], object] = Simplex.refute) -> object:
        nonlocal simplexes
        simplexes += 1
        return refute(simplex)

    monkeypatch.setattr(Simplex, "refute", counted)
    program = compiled(families.linear(256, 6, 1))
    verdict = prove_table(program, program.tables[0], BOXES)
    assert verdict.findings == ()
    assert verdict.certificate is not None
    assert len(verdict.certificate["tree"]) == 2 * 256 - 1  # type: ignore[arg-type]  # a list
    assert simplexes <= 25


SPANS = st.tuples(st.integers(0, 2), st.tuples(st.integers(0, 9), st.integers(0, 9)).map(sorted).map(tuple))


@given(st.dictionaries(st.integers(0, 40), st.lists(SPANS, max_size=3), max_size=8))
def test_ends_say_what_a_cut_parts(lines: dict[int, list[tuple[int, tuple[int, int]]]]) -> None:
    single = {number: list(dict(spans).items()) for number, spans in lines.items()}
    ends = Ends(single)
    for form, at in itertools.product(range(3), range(-1, 11)):
        of_form = {number: dict(spans)[form] for number, spans in single.items() if form in dict(spans)}
        below = sum(1 << number for number, (_, high) in of_form.items() if high <= at)
        above = sum(1 << number for number, (low, _) in of_form.items() if low > at)
        here = sum(1 << number for number, (low, high) in of_form.items() if at in {low - 1, high})
        assert ends.beyond(form, at) == (below, above)
        told = [cut[2:] for cut in ends.cuts if cut[:2] == (form, at)]
        assert told == [(here, below, above, below | above)] * bool(here)


@given(
    st.lists(
        st.tuples(st.tuples(*[st.integers(-9, 9)] * 3), st.integers(-60, 60), st.integers(0, 20)), max_size=5
    ),
    st.dictionaries(st.integers(0, 2), st.integers(-99, 99)),
    st.sampled_from([1, 10**18, 10**400]),
)
def test_what_projecting_returns_is_within_all_bounds(
    rows: list[tuple[tuple[int, ...], int, int]], near: dict[int, int], scale: int
) -> None:
    """However it rounds, and where no double is as large."""
    universe = Universe()
    kind = Int(-7 * scale, 9 * scale)
    columns = [universe.column(read(name, kind)) for name in ("x", "y", "z")]
    bounds: dict[int, tuple[int, int]] = {universe.single[columns[0]]: (-3 * scale, 2 * scale)}
    for ks, low, width in rows:
        terms = tuple((c, k) for c, k in zip(columns, ks, strict=True) if k)
        if len(terms) > 1:
            bounds[universe.form(terms)] = (low * scale, (low + width) * scale)
    point = projected(universe, bounds, near)
    for form, (low, high) in bounds.items():
        if point is not None and point.keys() >= {column for column, _ in universe.forms[form]}:
            assert low <= sum(k * point[c] for c, k in universe.forms[form]) <= high


def test_respelt_conditions_meet_in_one_form() -> None:
    universe = Universe()
    x, y = read("x"), read("y")
    first = universe.of(compare(Op.LE, total([2, -2], ["x", "y"]), number(3)))
    second = universe.of(Apply(Op.NOT, (compare(Op.GT, x, Apply(Op.ADD, (y, number(1)), WIDE)),), BOOL))
    third = universe.of(compare(Op.GE, total([-6, 6], ["x", "y"]), number(-11)))
    opposite = Apply(Op.NEG, (x,), WIDE)
    fourth = universe.of(compare(Op.GE, opposite, Apply(Op.SUB, (number(-1), y), WIDE)))
    assert first == second == third == fourth
    assert len([form for form in universe.forms if len(form) > 1]) == 1


def test_doubles_compare_by_their_rank() -> None:
    kind = Real(-1.0, 1.0)
    f, g = read("f", kind), read("g", kind)
    right = [[compare(Op.LT, f, g)], [compare(Op.EQ, f, g)], [compare(Op.GT, f, g)]]
    assert searched(program_of(right))[1].proved
    assert searched(program_of([[compare(Op.LE, f, g)], [compare(Op.GE, f, g)]]))[1].overlaps


def test_a_term_that_is_not_linear_is_left_to_the_solver() -> None:
    square = Apply(Op.MUL, (read("x"), read("x")), Int(0, 16))
    shared = [[compare(Op.LT, square, number(5))], [compare(Op.GE, square, number(5))]]
    assert searched(program_of(shared))[1].proved  # whatever the product is
    odd = searched(program_of([[compare(Op.LT, square, number(5))], [compare(Op.GE, square, number(8))]]))[1]
    assert odd.undecided == 1
    assert not odd.proved


def test_a_comparison_of_what_may_be_infinite_is_one_truth() -> None:
    program = compiled(
        "input r : real 0.0 .. 1.0e200\ntable t {\n| line | when ||\n| a | r * r > 1.0 ||\n| b | not (r * r > 1.0) ||\n}\n"
    )
    universe, search = searched(program)
    assert len(universe.forms) == 1
    assert search.proved


@pytest.mark.parametrize(
    ("more", "other"),
    [
        ("x /= 5", "x = 5"),
        ("x in {1, 5, 7}", "x not in {1, 5, 7}"),
        ("(x = 1 or y = 2)", "x /= 1 and y /= 2"),
        ("(x = 1 or x + y = 2)", "x /= 1 and x + y /= 2"),
    ],
)
def test_what_holds_everywhere_is_in_the_way_of_no_count(more: str, other: str) -> None:
    """It is left out, and the rest of its line is not."""
    program = compiled(
        "input x : int 0 .. 9\ninput y : int 0 .. 9\ntable t {\n| line | when ||\n"
        f"| a | (x < y or x >= y) and {more} ||\n| b | {other} ||\n}}\n"
    )
    assert searched(program)[1].proved


def test_of_what_a_line_leaves_open_a_box_that_is_all_of_its_range_is_left_out_and_no_other() -> None:
    universe, _ = searched(
        compiled(
            "input x : int 0 .. 9\ninput y : int 0 .. 9\ntable t {\n| line | x | y ||\n| a | < 5 | < 5 ||\n}\n"
        )
    )
    tree = Tree(universe, [], [], lambda _: NoWitness.UNKNOWN, default=True)
    whole, half = ((0, 9),), ((0, 4),)
    for boxes, left in (({0: whole, 1: half}, {1: half}), ({0: half, 1: half}, None), ({0: whole}, {})):
        line = Candidate(3, boxes, ())
        assert tree._dropped(tree.root, line) == (line if left is None else Candidate(3, left, ()))


@pytest.mark.parametrize("known", [{0: 3, 1: 4}, None])
def test_an_input_that_is_known_shows_two_lines_meet_where_no_other_is_found(
    known: dict[int, int] | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    program = compiled(
        "input x : int 0 .. 9\ninput y : int 0 .. 9\ntable t {\n| line | when ||\n| a | x + y < 8 ||\n| b | x + y >= 7 ||\n}\n"
    )
    monkeypatch.setattr(relational, "least", lambda *_: NoWitness.UNKNOWN)
    monkeypatch.setattr(TableSolver, "witness", lambda *_, **__: None)
    decision = relational._Decision(program, program.tables[0], BOXES)
    decision._tried = (({"x": 0, "y": 0}, frozenset((0,))),)  # which one of them matches
    found = decision.overlap(0, 1, known, grown=False).finding
    assert found == (Undecided("lines `a` and `b`") if known is None else Overlap(0, 1, {"x": 3, "y": 4}))


def test_inputs_of_a_region_that_one_line_matches_show_nothing_wrong() -> None:
    program = compiled(
        "input x : int 0 .. 9\ninput y : int 0 .. 9\ntable t {\n| line | when ||\n| a | x * y < 7 ||\n| b | x * y >= 7 ||\n}\n"
    )
    decision = relational._Decision(program, program.tables[0], BOXES)
    assert decision.oracle(Question((), (0, 1))) is NoWitness.NONE
    tried = relational._Decision(program, program.tables[0], BOXES)
    assert isinstance(tried.oracle(Question((), (0,))), dict)
    assert (decision.by_solver, tried.by_solver) == (True, False)


HYPERBOLA = (
    "input x : int 0 .. 9\ninput y : int 0 .. 9\ntable t {\n| line | when ||\n"
    "| a | x * y < 7 ||\n| b | (x + 1) * y >= 7 + y ||\n}\n"
)
"""Right, which takes the solver: the terms of the two lines are two."""


def deciding(text: str) -> relational._Decision:
    program = compiled(text)
    return relational._Decision(program, program.tables[0], BOXES)


def test_a_search_that_is_to_go_without_the_solver_asks_it_nothing() -> None:
    for how in ({"alone": True}, {"covering": True}):
        decision = deciding(HYPERBOLA)
        assert decision.search((), **how).undecided
        assert not decision.by_solver


@pytest.mark.parametrize(
    ("other", "third", "wrong"),
    [
        (">= 7", "", []),
        (">= 6", "", [Overlap]),
        ("> 7", "", [Gap]),
        (">= 7", "| c | x * y = 3 ||", [Overlap]),
        ("in {7, 8}", "| c | x * y > 8 ||", []),
        ("in {7, 8}", "| c | x * y > 7 ||", [Overlap]),
        ("in {7, 9}", "| c | x * y > 9 ||", [Gap]),
    ],
)
def test_of_products_two_lines_that_meet_and_inputs_that_none_matches_are_found(
    other: str, third: str, wrong: list[type]
) -> None:
    decision = deciding(
        "input x : int 0 .. 9\ninput y : int 0 .. 9\ntable t {\n| line | when ||\n"
        f"| a | x * y < 7 ||\n| b | x * y {other} ||\n{third}\n}}\n"
    )
    assert [type(each) for each in decision.decided().findings] == wrong
    asked = decision.asked
    for lines in itertools.combinations(range(len(decision.clauses)), 2):
        meets = any(
            isinstance(each, Overlap) and (each.first, each.second) == lines
            for each in decision.decided().findings
        )
        fault = asked.holds(decision.fault(lines), smt.any_of([asked.line(at) for at in lines]))
        assert (fault is smt.Answer.SATISFIABLE) == meets


@pytest.mark.parametrize(("least_", "covers"), [(7, True), (8, False)])
def test_nothing_is_left_to_default_only_where_the_solver_says_that_lines_take_all(
    least_: int, covers: bool
) -> None:
    decision = deciding(
        HYPERBOLA.replace("(x + 1) * y >= 7 + y", f"x * y >= {least_}").replace(
            "\n}", "\n| d | DEFAULT ||\n}"
        )
    )
    assert decision.covered(Search()) is covers
    assert [type(each) for each in decision.decided().findings] == ([] if covers else [Gap])


def test_a_table_of_products_has_a_certificate_of_its_own_that_rests_on_the_solver() -> None:
    program = compiled(HYPERBOLA)
    assert relational.certificate_alone(program, program.tables[0], BOXES) is not None


def test_what_few_steps_leave_open_is_decided_with_all_of_them(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(relational, "WRONG_STEPS", 2)
    monkeypatch.setattr(relational._Decision, "refuted_by_trial", property(lambda _: False))
    program = compiled(HYPERBOLA)
    assert relational._Decision(program, program.tables[0], BOXES, few=True).decided().findings
    decided = relational.decide(program, program.tables[0], BOXES)
    assert (decided.findings, decided.by_solver) == ((), True)


def test_the_proof_rests_on_the_assumptions_that_it_needs_alone() -> None:
    """Each is tried to be spared by a search of more than one region."""
    program = compiled(
        "input x : int 0 .. 9\ninput y : int 0 .. 9\nassume no assumed : x + y /= 7\nassume idle assumed : x + y < 9\n"
        "table t assuming no, idle {\n| line | when ||\n| a | x + y < 7 ||\n| b | x + y > 7 ||\n}\n"
    )
    decided = relational.decide(program, program.tables[0], BOXES)
    assert (decided.findings, decided.used) == ((), (AssumptionName("no"),))


def test_an_input_that_is_known_is_not_told_where_a_lesser_one_is_found() -> None:
    decision = deciding(HYPERBOLA)
    assert decision.witness([{"x": 9, "y": 9}], lambda z3: (z3.line(1),)) == {"x": 1, "y": 7}


def test_two_lines_that_an_input_is_known_to_match_need_no_solver() -> None:
    decision = deciding(HYPERBOLA.replace("< 7", "< 8"))
    decision._tried = (({"x": 1, "y": 7}, frozenset((0, 1))),)
    assert decision.oracle(Question((), (0, 1))) == {"x": 1, "y": 7}
    assert not decision.by_solver


def test_each_two_lines_that_match_an_input_which_the_solver_gave_are_told() -> None:
    decision = deciding(HYPERBOLA.replace("< 7", "< 8").replace("\n}", "\n| c | x * y >= 6 ||\n}"))
    found = [each.finding for each in decision.overlaps(Search(witnesses=[{"x": 7, "y": 1}]))]
    assert [(each.first, each.second) for each in found if isinstance(each, Overlap)] == [
        (0, 1),
        (0, 2),
        (1, 2),
    ]


def test_an_input_that_is_known_is_a_gap_in_a_region_that_was_given_up() -> None:
    decision = deciding(HYPERBOLA.replace(">= 7", "> 7"))
    decision._tried = (({"x": 7, "y": 1}, frozenset()),)
    [found] = decision.gap(Search(undecided=1))
    assert found.finding == Gap(({"x": 1, "y": 7},), (None,))


def test_an_input_that_shows_no_further_pair_ends_the_search_for_these(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Z3 may say that two lines meet, and give an input at which the interpreter does not see it."""
    decision = deciding(HYPERBOLA.replace(">= 7", ">= 6"))
    monkeypatch.setattr(TableSolver, "model", lambda _: {"x": 0, "y": 0})
    assert decision.others(Question((), (0, 1)), frozenset()) == set()


@pytest.mark.parametrize(
    ("needed", "other", "only"),
    [("x * y < 20", ">= 20", True), ("x * x < 20", ">= 100", False), ("x * x < 20", "= 79", False)],
)
def test_a_line_is_told_apart_that_only_an_assumption_excludes_though_it_is_not_linear(
    needed: str, other: str, only: bool
) -> None:
    """As it is where only the solver knows that no input matches: 79 is a prime."""
    decision = deciding(
        f"input x : int 0 .. 9\ninput y : int 0 .. 9\nassume small assumed : {needed}\n"
        "table t assuming small {\n| line | when ||\n"
        f"| a | x * y < 20 ||\n| b | x * y {other} ||\n}}\n"
    )
    assert decision.dead() == [DeadLine(1, only)]


def test_a_region_reaches_below_its_input_where_an_assumption_allows_that() -> None:
    decision = deciding(
        "input x : int 0 .. 9\ninput y : int 0 .. 9\nassume some assumed : x + y >= 5\n"
        "table t assuming some {\n| line | when ||\n| a | x + y >= 5 ||\n| b | x + y >= 4 ||\n}\n"
    )
    [found] = [each for each in decision.decided().findings if isinstance(each, Overlap)]
    assert (found.witness, found.region) == ({"x": 0, "y": 5}, {})


@pytest.mark.parametrize(
    ("kind", "value", "most"),
    [("real 0.0 .. 1.0", 0.5, 0.75), ("single 0.0 .. 1.0", 0.5, 0.75), ("int 0 .. 9", 5, 7)],
)
def test_a_gap_that_an_assumption_allows_is_told_at_its_witness(kind: str, value: Value, most: Value) -> None:
    """It is tried at its own value alone: 0 is allowed, too, and no gap."""
    decision = deciding(
        f"input x : {kind}\nassume some assumed : x <= {most}\n"
        f"table t assuming some {{\n| line | when ||\n| a | x < {value} ||\n| d | DEFAULT ||\n}}\n"
    )
    gap = Gap(({"x": value},), (None,))
    assert decision.narrowed_gap(gap) == [gap]


@pytest.mark.parametrize(
    ("allowed", "line", "least_"),
    [("x + y >= 3", "x + y = 3", {"x": 0, "y": 4}), ("x * y >= 9", "x * y = 9", {"x": 2, "y": 5})],
)
def test_a_gap_whose_witnesses_no_assumption_allows_is_looked_for_anew(
    allowed: str, line: str, least_: dict[str, Value]
) -> None:
    decision = deciding(
        f"input x : int 0 .. 9\ninput y : int 0 .. 9\nassume some assumed : {allowed}\n"
        f"table t assuming some {{\n| line | when ||\n| a | {line} ||\n| d | DEFAULT ||\n}}\n"
    )
    [found] = decision.narrowed_gap(Gap(({"x": 0, "y": 0}, {"x": 1, "y": 1}), (None, None)))
    assert isinstance(found, Gap)
    assert found.witnesses == (least_,)


def test_inputs_are_counted_where_all_regions_can_be(monkeypatch: pytest.MonkeyPatch) -> None:
    decision = deciding(
        "input x : int 0 .. 9\ninput y : int 0 .. 9\nassume less assumed : x < y\n"
        "table t assuming less {\n| line | x ||\n| a | < 5 ||\n| d | DEFAULT ||\n}\n"
    )
    assert decision.allowed_in({}) == 45
    assert decision.allowed_in({"x": ((3, 4),)}) == 11
    search = decision.search((0,), covering=True)
    assert decision.counted(search) == (10, 45)
    monkeypatch.setattr(counting, "inputs", lambda *_: None)
    assert decision.allowed_in({}) is None
    assert decision.counted(search) is None


def test_inputs_that_an_assumption_allows_are_counted_one_by_one_where_it_is_not_linear() -> None:
    """Of a region of keys; of the singles from 1.0 on there are four."""
    decision = deciding(
        "input x : int 0 .. 9\ninput r : single 1.0 .. 1.0000003576278687\nassume some assumed : x * x < 30 + x\n"
        "table t assuming some {\n| line | x | r ||\n| a | < 5 | > 1.0 ||\n| d | DEFAULT | ||\n}\n"
    )
    least_ = decision.program.variables[1].type
    assert isinstance(least_, Single)
    low, high = key_bounds(least_)
    assert high - low == 3
    for x in range(10):
        for r in range(low, high + 1):
            region: dict[str, Box] = {"x": ((x, 9),), "r": ((low, r),)}
            assert decision.allowed_in(region) == max(0, 6 - x) * (r - low + 1)


@pytest.mark.parametrize(
    ("more", "asked"), [("x + y < 1 and x > 3", False), ("x * y = 7 and (x + 1) * y = 9 + y", True)]
)
def test_of_a_contradiction_it_is_told_whether_the_solver_was_asked(more: str, asked: bool) -> None:
    decision = deciding(
        f"input x : int 0 .. 9\ninput y : int 0 .. 9\nassume no assumed : {more}\n"
        "table t assuming no {\n| line | when ||\n| a | x < 4 ||\n| b | x >= 4 ||\n}\n"
    )
    decided = decision.decided()
    assert (decided.findings, decided.by_solver) == ((ContradictoryAssumptions(),), asked)


def test_what_is_not_looked_for_any_more_is_not_told_of() -> None:
    program = compiled(
        "input x : int 0 .. 9\ninput y : int 0 .. 9\n"
        "table t {\n| line | when ||\n| a | x + y < 7 ||\n| b | x + y >= 7 ||\n| c | x + y > 10 and x - y > 9 ||\n}\n"
    )
    decision = relational._Decision(program, program.tables[0], BOXES)
    with smt.until(lambda: True):
        assert decision.dead() == []
    assert decision.dead() == [DeadLine(2, False)]


@pytest.mark.parametrize("asked", [0, 2, splitting.MOST_PAST])
def test_past_the_budget_nothing_is_proved(asked: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of each region that is left it is said so, whether the solver is asked about some or not."""
    monkeypatch.setattr(splitting, "MOST_PAST", asked)
    program = program_of(orders(5))
    universe = Universe()
    lines = lines_of(universe, program.tables[0])
    questions = []

    def oracle(question: Question) -> NoWitness:
        questions.append(question)
        return NoWitness.UNKNOWN

    search = Tree(universe, lines, (), oracle, default=False, budget=50).run()
    assert search.undecided == search.nodes.count(Open()) > 3
    assert len(questions) == min(asked, splitting._PATIENCE)
    assert not search.proved


@given(
    st.lists(
        st.tuples(st.tuples(*[st.integers(-3, 3)] * 3), st.integers(-9, 9), st.integers(0, 5)), max_size=6
    )
)
def test_simplex_gives_a_point_or_a_sum_that_cannot_be(rows: list[tuple[tuple[int, ...], int, int]]) -> None:
    simplex = Simplex()
    coefficients = {form: tuple(int(i == form) for i in range(3)) for form in range(3)}
    for form in range(3):
        simplex.add_column(form, -2, 3)
    for form, (ks, low, width) in enumerate(rows, start=3):
        coefficients[form] = ks
        simplex.add_form(form, [(c, k) for c, k in enumerate(ks) if k], low, low + width)
    multipliers = simplex.refute()
    if multipliers is None:
        values = [simplex.value(form) for form in range(3)]
        for form, ks in coefficients.items():
            at = sum((k * v for k, v in zip(ks, values, strict=True)), Fraction(0))
            assert simplex.low[form] <= at <= simplex.high[form]
    else:
        summed = [sum(k * coefficients[form][c] for form, k in multipliers) for c in range(3)]
        bound = sum(k * (simplex.high if k > 0 else simplex.low)[form] for form, k in multipliers)
        assert summed == [0, 0, 0]
        assert bound < 0


@given(
    st.lists(
        st.tuples(st.tuples(*[st.integers(-3, 3)] * 2), st.integers(-9, 9), st.integers(0, 3)), max_size=4
    )
)
def test_a_point_of_integers_is_found_wherever_there_is_one(
    rows: list[tuple[tuple[int, ...], int, int]],
) -> None:
    simplex = Simplex()
    for form in range(2):
        simplex.add_column(form, -4, 5)
    for form, (ks, low, width) in enumerate(rows, start=2):
        simplex.add_form(form, [(c, k) for c, k in enumerate(ks) if k], low, low + width)
    there = [
        point
        for point in itertools.product(range(-4, 6), repeat=2)
        if all(low <= sum(map(operator.mul, ks, point)) <= low + width for ks, low, width in rows)
    ]
    found = integer_point(simplex, range(2), 200)
    assert (found is None) == (not there)
    if found is not None:
        assert tuple(int(found.value(form)) for form in range(2)) in there


@given(
    st.lists(
        st.tuples(st.tuples(*[st.integers(-5, 5)] * 3), st.integers(-12, 12), st.integers(0, 6)), max_size=5
    ),
    st.permutations(range(3)),
    st.tuples(*[st.integers(-9, 9)] * 3),
)
def test_the_least_point_and_the_least_value_of_each_form_are_those_of_brute_force(
    rows: list[tuple[tuple[int, ...], int, int]], order: list[int], near: tuple[int, ...]
) -> None:
    """Wherever the system begins."""
    simplex = Simplex()
    for form in range(3):
        simplex.add_column(form, -2, 3, near[form])
    for form, (ks, low, width) in enumerate(rows, start=3):
        simplex.add_form(form, [(c, k) for c, k in enumerate(ks) if k], low, low + width)
    there = [
        point
        for point in itertools.product(range(-2, 4), repeat=3)
        if all(low <= sum(map(operator.mul, ks, point)) <= low + width for ks, low, width in rows)
    ]
    found = least_point(simplex.copy(), order, 500)
    assert found == min(([point[c] for c in order] for point in there), default=None)
    if simplex.refute() is None:
        for form, ks in enumerate([(1, 0, 0), (0, 1, 0), (0, 0, 1), *(ks for ks, _, _ in rows)]):
            least_value = simplex.minimise(form)
            assert simplex.refute() is None
            assert least_value == simplex.value(form)
            assert all(least_value <= sum(map(operator.mul, ks, point)) for point in there)
            below = simplex.copy()
            below.restrict(form, below.low[form], math.ceil(least_value) - 1)
            assert below.low[form] > below.high[form] or below.refute() is not None


def test_a_copy_of_what_was_refuted_is_refuted_for_the_same_reason() -> None:
    simplex = Simplex()
    for column in (0, 1):
        simplex.add_column(column, 0, 9)
    simplex.add_form(2, ((0, 1), (1, 1)), 30, 40)
    why = simplex.refute()
    assert why is not None
    assert simplex.copy().refute() == why


def test_looking_for_a_point_of_integers_has_an_end() -> None:
    simplex = Simplex()
    for form in range(2):
        simplex.add_column(form, 0, 10**6)
    simplex.add_form(2, [(0, 3), (1, -3)], 1, 2)
    with pytest.raises(TimeoutError):
        integer_point(simplex, range(2), 20)


# --- trees, node by node ------------------------------------------------------------------

INPUTS = "input x : int 0 .. 20\ninput y : int 0 .. 20\ninput r : real -1.0 .. 1.0\ninput s : real -1.0 .. 1.0\ninput p : bool\n"
TREES: dict[str, tuple[str, tuple[str, ...], str]] = {
    "apart": (
        "2 * x /= 3 * y + 1 and x + y <= 30",
        (
            "2 * x - 3 * y < 1 and r < s",
            "2 * x - 3 * y > 1 and r < s",
            "r > s",
            "r = s and (x < 5 or y < 7)",
            "r = s and x >= 5 and y >= 7",
        ),
        (
            "1x, 1y, 2x -3y, 1r, 1s, 1r -1s, 1x 1y\n"
            "6<=30; 5<=-1; 2<=0; line 0; 2<=1; outside 0; line 1; 5<=0; 0<=4; line 3; counted 21 (1,); "
            "line 2; outside 0\n"
            "0 [0]"
        ),
    ),
    "default": (
        "",
        ("x + y < 9 and x /= 4", "x + y > 11 or x = 4 and y < 3", "DEFAULT"),
        ("1x, 1y, 1x 1y\n2<=8; counted None (0,); line -1\n0 []"),
    ),
    "wrong": (
        "",
        (
            "3 * x + 3 * y < 10",
            "x + y > 4 and x < y",
            "x + y > 5 and x >= y + 1",
            "2 * x = 2 * y and x > 1",
            "x * y = 7 and y < 3",
        ),
        (
            "1x, 1y, 1x 1y, 1x -1y, 1(* x y)\n"
            "2<=3; 0<=1; 1<=2; 4<=6; line 0; 4<=7; open; line 0; line 0; 1<=2; 3<=-1; "
            "empty -1*0 1*1 1*3; 3<=0; empty -2*0 1*2 1*3; 4<=6; line 0; 4<=7; open; line 0; "
            "empty -1*0 -1*1 1*2; 3<=-1; 1<=2; empty 2*1 -1*2 1*3; 2<=4; open; line 1; 3<=0; 0<=1; "
            "empty 2*0 -1*2 -1*3; 1<=2; 4<=6; line 3; 4<=7; open; line 3; line 3; 1<=2; 2<=5; 4<=6; "
            "open; 4<=7; line 4; open; 4<=6; line 2; 4<=7; open; line 2; 2<=5; empty -2*1 1*2 -1*3; "
            "line 2\n"
            "[(1, (3, 20)), (2, (4, 4)), (3, (-20, -1))]: [(0, 1), (1, 3), (2, 0)]\n"
            "6 []"
        ),
    ),
    "truths": (
        "p or x < 9",
        ("p = (x < 4)", "p /= (x < 4) and not (y in {2, 3, 9})", "p /= (x < 4) and -y in {-2, -3, -9}"),
        (
            "1p, 1x, 1y\n"
            "2<=1; 0<=0; counted 21 (1,); counted 21 (1,); 2<=3; 0<=0; counted 21 (1,); counted 21 (1,); "
            "2<=8; 0<=0; counted 21 (1,); counted 21 (1,); 2<=9; 0<=0; counted 21 (1,); counted 21 (1,); "
            "0<=0; counted 21 (1,); counted 21 (1,)\n"
            "0 []"
        ),
    ),
    "rounded": (
        "x in {1, 2, 5}",
        ("2 * x + 4 * y <= 21", "2 * (y + x) + 2 * y > 20 and 3 * x > 1"),
        ("1x, 1y, 1x 2y\n2<=10; line 0; 0<=0; outside 0; line 1\n0 [0]"),
    ),
    "between": (
        "",
        ("4 * x - 6 * y = 3", "x < y", "x >= y and (x > 9 or y > 9)", "x >= y and x <= 9 and y <= 9"),
        ("1x, 1y, 2x -3y, 1x -1y\n3<=-1; line 1; 0<=9; counted 21 (1,); line 2\n0 []"),
    ),
    "fractions": (
        "",
        (
            "5 * x + 3 * y < 22",
            "5 * x + 3 * y > 23",
            "7 * x - 4 * y < 3 and 5 * x + 3 * y = 22",
            "7 * x - 4 * y > 4 and 5 * x + 3 * y = 23",
        ),
        (
            "1x, 1y, 5x 3y, 7x -4y\n"
            "2<=22; 2<=21; line 0; 3<=2; line 2; 0<=4; 1<=0; empty 5*0 3*1 -1*2; 0<=3; 1<=2; "
            "empty 5*0 3*1 -1*2; 0<=2; empty 41*0 -4*2 -3*3; empty -5*0 -3*1 1*2; empty -5*0 -3*1 1*2; "
            "empty -5*0 -3*1 1*2; 2<=23; 3<=4; 0<=2; 1<=4; empty 5*0 3*1 -1*2; 0<=1; open; "
            "empty -5*0 -3*1 1*2; empty -41*0 4*2 3*3; line 3; line 1\n"
            "[(0, (0, 1)), (1, (5, 20)), (2, (23, 23)), (3, (-80, 4))]: [(0, 1), (1, 6)]\n"
            "0 []"
        ),
    ),
    "fraction": (
        "",
        (
            "2 * x + 3 * y < 11 or 3 * x - 2 * y > 2",
            "2 * x + 3 * y >= 11 and 3 * x - 2 * y <= 2 and 5 * x + y /= 13",
        ),
        (
            "1x, 1y, 2x 3y, 3x -2y, 5x 1y\n"
            "2<=10; line 0; 3<=2; 4<=12; line 1; 4<=13; 0<=2; open; empty -13*0 1*3 2*4; line 1; line 0\n"
            "[(0, (0, 2)), (2, (11, 100)), (3, (-40, 2)), (4, (13, 13))]: [(0, 2), (1, 3)]\n"
            "0 []"
        ),
    ),
    "crossing": (
        "",
        ("3 * x + 2 * y < 30 and x > y", "3 * x + 2 * y > 26 and y >= x", "x - y > 3", "x + y = 9"),
        (
            "1x, 1y, 3x 2y, 1x -1y, 1x 1y\n"
            "3<=0; 2<=26; 4<=8; open; 4<=9; line 3; open; 4<=8; empty -2*2 1*3 5*4; 4<=9; "
            "empty -2*2 1*3 5*4; line 1; 2<=29; 3<=3; 4<=8; line 0; 4<=9; open; line 0; 4<=8; open; "
            "4<=9; open; open; 3<=3; 4<=8; empty -1*1 -1*2 3*4; 4<=9; line 3; open; 4<=8; "
            "empty -1*1 -1*2 3*4; 4<=9; empty -1*1 -1*2 3*4; line 2\n"
            "(0, 3): [(0, 5), (1, 4)]\n"
            "(0, 2): [(0, 4), (1, 0)]\n"
            "(2, 3): [(0, 7), (1, 2)]\n"
            "[(2, (0, 26)), (3, (-20, 0)), (4, (0, 8))]: [(0, 0), (1, 0)]\n"
            "[(2, (0, 26)), (3, (-20, 0)), (4, (10, 40))]: [(0, 5), (1, 5)]\n"
            "[(2, (30, 100)), (3, (1, 3)), (4, (10, 40))]: [(0, 8), (1, 6)]\n"
            "0 []"
        ),
    ),
}


def written(node: Node) -> str:
    """A node of a tree in a few letters."""
    match node:
        case Split(form, cut):
            return f"{form}<={cut}"
        case Only(line):
            return f"line {line}"
        case OutsideAssumption(assumption):
            return f"outside {assumption}"
        case Empty(multipliers):
            return "empty " + " ".join(f"{k}*{form}" for form, k in multipliers)
        case Counted(count, parts_):
            return f"counted {count} {parts_}"
        case _:
            return type(node).__name__.lower()


@pytest.mark.parametrize("name", TREES)
def test_the_tree_is_this_one(name: str) -> None:
    """Which bound is split first, and why each leaf holds: not only whether."""
    assumed, lines, expected = TREES[name]
    head = f"assume it assumed : {assumed}\ntable t assuming it {{\n" if assumed else "table t {\n"
    rows = "".join(f"| l{number} | {line} ||\n" for number, line in enumerate(lines))
    program = compiled(f"{INPUTS}{head}| line | when ||\n{rows}}}\n")
    universe, search = searched(program)
    forms = [" ".join(f"{k}{universe.columns[c].name}" for c, k in form) for form in universe.forms]
    pairs = [f"{pair}: {sorted(point.items())}" for pair, point in search.overlaps.items()]
    gaps = [f"{sorted(bounds.items())}: {sorted(point.items())}" for bounds, point in search.gaps]
    said = [
        ", ".join(forms),
        "; ".join(map(written, search.nodes)),
        *pairs,
        *gaps,
        f"{search.undecided} {sorted(search.used)}",
    ]
    assert "\n".join(said) == expected


@pytest.mark.parametrize(
    ("rounds", "undecided", "nodes"), [(0, 2, 11), (1, 2, 15), (2, 2, 19), (3, 1, 23), (4, 1, 25), (5, 0, 27)]
)
def test_a_vertex_is_rounded_so_often_and_not_more(
    rounds: int, undecided: int, nodes: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(splitting, "_ROUNDS", rounds)
    rows = "".join(f"| l{number} | {line} ||\n" for number, line in enumerate(TREES["fractions"][1]))
    _, search = searched(compiled(f"{INPUTS}table t {{\n| line | when ||\n{rows}}}\n"))
    assert (search.undecided, len(search.nodes)) == (undecided, nodes)


@pytest.mark.parametrize("word", ["xor", "="])
def test_a_condition_that_would_be_too_long_written_out_is_left_to_the_solver(word: str) -> None:
    """Each `xor` doubles what negations are pushed into: forty would never end."""
    many = reduce(lambda whole, at: f"({whole}) {word} (a < b + {at})", range(1, 40), "a < b")
    rows = f"| line | when ||\n| l | {many} ||\n| m | not ({many}) ||"
    verdict = verdict_of(f"input a : int 0 .. 9\ninput b : int 0 .. 9\ntable t {{\n{rows}\n}}\n")
    assert [finding.code for finding in verdict.findings] == []


def test_points_within_sums_are_counted_as_they_are_enumerated() -> None:
    rng, planes = random.Random(3), 0  # noqa: S311
    for _ in range(600):
        many = rng.choice((1, 2, 2, 2, 3, 4))
        lows = [rng.randint(-6, 6) for _ in range(many)]
        columns = [counting.Column(low, low + rng.randint(0, 7)) for low in lows]
        sums = []
        for _ in range(rng.randint(1, 3)):
            factors, low = tuple(rng.randint(-4, 4) for _ in range(many)), rng.randint(-20, 20)
            sums += [counting.Sum(factors, low, low + rng.randint(0, 25))] if any(factors) else []
        points = itertools.product(*(range(low, high + 1) for low, high in columns))
        inside = [
            point
            for point in points
            if all(low <= sum(map(operator.mul, k, point)) <= high for k, low, high in sums)
        ]
        assert counting._counted(columns, sums, counting.MOST_SLICES) == len(inside), (columns, sums)
        planes += len(inside) > 0 and many == 2
    assert planes > 50


def test_points_of_64_bits_are_counted_without_going_through_them() -> None:
    whole = counting.Column(0, 2**63 - 1)
    below = counting.Sum((1, -1), -(2**63), -1)  # x < y
    assert counting._counted([whole, whole], [below], 1) == 2**63 * (2**63 - 1) // 2
    assert counting._counted([whole] * 3, [counting.Sum((1, 1, 1), 0, 9)], counting.MOST_SLICES) is None
