"""Names, kinds, units and ranges: every code from a minimal text, on its line and on the smallest span."""

import sys
from collections.abc import Callable
from itertools import product

import pytest

from rcsc.base.diagnostics.diagnostic import Diagnostic
from rcsc.base.diagnostics.source import Source
from rcsc.lang.interpret import call, evaluate, holds
from rcsc.lang.leaves import parts
from rcsc.lang.model import (
    Assign,
    Call,
    Int,
    Program,
    Real,
    Select,
    Test,
    ToElement,
    ToLeaf,
    Value,
    VariableName,
)
from rcsc.lang.operator_table import single as to_single
from rcsc.lang.resolve import compile_text
from tests.support.programs.stages import program_of, refused
from tests.support.programs.texts import edited

# Each case: the text, and for every error in it its line, its code and the text of its span.
TWO = "| x | true || true |\n| y | false || false |\n"
U = f"table u {{\n| line | a || b |\n{TWO}}}\nlevel l {{ table t table u }}"
CASES: dict[str, tuple[str, list[tuple[int, str, str]]]] = {
    "unknown type": ("state n : widht", [(1, "RCS201", "widht")]),
    "unknown variable": ("invariant i : nothing = 1", [(1, "RCS201", "nothing")]),
    "unknown field": ("record r { a : bool }\nstate s : r\ninvariant i : s.b", [(3, "RCS201", "b")]),
    "unknown member": ("enum e { a }\nstate s : e\ninvariant i : s = e.b", [(3, "RCS201", "b")]),
    "unknown procedure": ("procedure p { q }", [(1, "RCS201", "q")]),
    "unknown member of an owner": ("owner o { nobody }", [(1, "RCS201", "nobody")]),
    "unknown table": ("level l { period 40 table none }", [(1, "RCS201", "none")]),
    "member of two enums": (
        "enum e { a, b }\nenum f { a, c }\nprocedure p { if a = a { } }",
        [(3, "RCS201", "a"), (3, "RCS201", "a")],
    ),
    "member or variable": (
        "enum e { a, b }\nstate b : e\nstate s : e\ninvariant i : s = b",
        [(4, "RCS201", "b")],
    ),
    "doubled variable": ("state n : bool\ninput n : bool", [(2, "RCS202", "n")]),
    "doubled type": ("type n = bool\nenum n { a }", [(1, "RCS202", "n")]),
    "doubled member": ("enum e { a, b, a }", [(1, "RCS202", "a")]),
    "doubled field": ("record r { a : bool a : bool }", [(1, "RCS202", "a")]),
    "doubled unit": ("unit tick\nunit tick", [(2, "RCS202", "tick")]),
    "doubled procedure": ("procedure p { }\nowner p { }", [(2, "RCS202", "p")]),
    "doubled local": (
        "procedure p {\n  local n : bool\n  local n : bool\n}",
        [(3, "RCS202", "n")],
    ),
    "call cycle": (
        "procedure a { b }\nprocedure b { c }\nprocedure c { a }",
        [(3, "RCS203", "a")],
    ),
    "call of itself": ("procedure a { a }", [(1, "RCS203", "a")]),
    "input written": ("input n : bool\nprocedure p { n := true }", [(2, "RCS206", "n")]),
    "constant written": ("const n = 1\nprocedure p { n := 2 }", [(2, "RCS206", "n")]),
    "parameter written": ("procedure p(n : bool) { n := true }", [(1, "RCS206", "n")]),
    "loop variable written": ("procedure p { for i in 0 .. 3 { i := 2 } }", [(1, "RCS206", "i")]),
    "input in writes": ("input n : bool\nmodule m writes n { }", [(2, "RCS206", "n")]),
    "doubled line": (
        "input a : bool\ntable t {\n| line | a ||\n| x | true ||\n| x | false ||\n}",
        [(5, "RCS207", "x")],
    ),
    "module reads": (
        "input a : bool\ninput b : bool\nstate c : bool\nmodule m reads a writes c { c := a and b }",
        [(4, "RCS208", "b")],
    ),
    "module writes": ("state c : bool\nmodule m reads c {\n  c := true\n}", [(3, "RCS208", "c := true")]),
    "module calls": (
        "state c : bool\nprocedure p { c := not c }\nmodule m reads c { p }",
        [(3, "RCS208", "p")],
    ),
    "arguments": ("procedure p(n : bool) { }\nprocedure q { p }", [(2, "RCS209", "p")]),
    "arguments of a function": (
        "state n : int 0 .. 3\ninvariant i : abs(n, n) = 1",
        [(2, "RCS209", "abs(n, n)")],
    ),
    "argument in an owner": ("procedure p(n : bool) { }\nowner o { p }", [(2, "RCS209", "p")]),
    "next of what is not deferred": ("state n : bool\nprocedure p { next n := true }", [(2, "RCS210", "n")]),
    "next of a local": ("procedure p { local n : bool next n := true }", [(1, "RCS210", "n")]),
    "an input deferred": ("input n : bool deferred until n", [(1, "RCS210", "n")]),
    "command without a table": (
        "enum e { a, b, c }\ninput s : e\ntable t {\n| line | s ||\n| x | a ||\n}\nlevel l {\n table by s { a : t }\n}",
        [(8, "RCS211", "s")],
    ),
    "selector that a line changes": (
        "state s : bool\ntable t {\n| line | s || s |\n| x | DEFAULT || not s |\n}\nlevel l { table by s { true : t  false : t } }",
        [(6, "RCS214", "s")],
    ),
    "selector by index": (
        "state s : array[2] of bool\ninput n : int 0..1\ntable t {\n| line ||\n| x ||\n}\nlevel l { table by s[n] { true : t false : t } }",
        [(7, "RCS214", "s[n]")],
    ),
    "two DEFAULT lines": (
        "input a : bool\ntable t {\n| line | a ||\n| x | DEFAULT ||\n| y | DEFAULT ||\n}",
        [(5, "RCS212", "y")],
    ),
    "lines above each other": (
        "input a : bool\ntable t {\n| line | a ||\n| x above y | true ||\n| y above x | true ||\n}",
        [(4, "RCS217", "y")],
    ),
    "requirement named twice": (
        'state n : bool\ninvariant i req "A", "A" : n',
        [(2, "RCS218", "A")],
    ),
    "requirement with a bar": (
        'state n : bool\nproperty p req "A|B", "", " a", "a  b" : n',
        [(2, "RCS218", "A|B"), (2, "RCS218", ""), (2, "RCS218", " a"), (2, "RCS218", "a  b")],
    ),
    "long requirement of a line": (
        f'input a : bool\ntable t {{\n| line | a || req |\n| x | DEFAULT || "{"x" * 81}" |\n}}',
        [(4, "RCS218", "x" * 81)],
    ),
    "owner cycle": ("owner a { b }\nowner b { a }", [(2, "RCS213", "a")]),
    "bool and int": ("state n : int 0 .. 3\ninvariant i : n = true", [(2, "RCS301", "n = true")]),
    "two enumerations": (
        "enum e { a }\nenum f { b }\nstate s : e\nprocedure p { s := b }",
        [(4, "RCS301", "b")],
    ),
    "order of members": ("enum e { a }\nstate s : e\ninvariant i : s < a", [(3, "RCS301", "s < a")]),
    "condition that is a number": ("procedure p { if 3 { } }", [(1, "RCS301", "3")]),
    "int and real": ("state n : int 0 .. 3\ninvariant i : n < 1.0", [(2, "RCS301", "n < 1.0")]),
    "mod of reals": (
        "state n : real 0.0 .. 3.0\ninvariant i : n mod 2.0 = 0.0",
        [(2, "RCS301", "n mod 2.0")],
    ),
    "copy of another type": (
        "record r { a : bool }\nrecord q { a : bool }\nstate s : r\nstate t : q\nprocedure p { s := t }",
        [(5, "RCS301", "s := t")],
    ),
    "index that the copy changes": (
        "record r { k : int 0 .. 1 }\nstate a : array[2] of r\nstate b : r\nprocedure p { a[a[0].k] := b }",
        [(4, "RCS301", "a[a[0].k] := b")],
    ),
    "clamp of an enumeration": ("enum e { a }\ninput s : e clamp", [(2, "RCS301", "s")]),
    "the cycle before, in an invariant": ("state a : bool\ninvariant i : was a", [(2, "RCS315", "was a")]),
    "property of nothing": ("property i : 1 = 1", [(1, "RCS316", "1 = 1")]),
    "invariant about an input": ("input a : bool\ninvariant i : a", [(2, "RCS301", "a")]),
    "type made of itself": ("record r { a : r }", [(1, "RCS301", "r")]),
    "units differ": (
        "input w : int 0 .. 9 [mm]\ninput t : int 0 .. 9 [s]\nassume a : w < t",
        [(3, "RCS302", "w < t")],
    ),
    "unit against a number type": (
        "input w : int 0 .. 9\nassume a : w < 3 [mm]",
        [(2, "RCS302", "w < 3 [mm]")],
    ),
    "unit of a product": (
        "input w : int 0 .. 9 [mm]\nstate a : int 0 .. 81 [mm]\nprocedure p { a := w * w }",
        [(3, "RCS302", "w * w")],
    ),
    "unit of a quotient that may divide by zero": (
        "input w : real 0.0 .. 9.0 [mm]\ninput t : real 0.0 .. 9.0 [s]\nassume a : w / t < 3.0 [mm]",
        [(3, "RCS302", "w / t < 3.0 [mm]")],
    ),
    "unknown unit": ("input w : int 0 .. 9 [furlong]", [(1, "RCS302", "furlong")]),
    "period in mm": (
        "input a : bool\ntable t {\n| line | a ||\n| x | true ||\n}\nlevel l { period 40 [mm] table t }",
        [(6, "RCS302", "40 [mm]")],
    ),
    "range upside down": ("input w : int 9 .. 0", [(1, "RCS303", "int 9 .. 0")]),
    "real range upside down": ("input w : real 1.0 .. 0.0", [(1, "RCS303", "real 1.0 .. 0.0")]),
    "cell upside down": (
        "input w : int 0 .. 9\ntable t {\n| line | w ||\n| x | 7 .. 3 ||\n}",
        [(4, "RCS303", "7 .. 3")],
    ),
    "number beyond 64 bits": ("const n = 18446744073709551616", [(1, "RCS304", "18446744073709551616")]),
    "hexadecimal beyond 64 bits": (f"const n = 0x1{'0' * 9000}", [(1, "RCS304", f"0x1{'0' * 9000}")]),
    "constant beyond 64 bits": (
        "const n = 18446744073709551615 * 2",
        [(1, "RCS304", "18446744073709551615 * 2")],
    ),
    "range beyond 64 bits": (
        "input w : int -1 .. 18446744073709551615",
        [(1, "RCS304", "int -1 .. 18446744073709551615")],
    ),
    "bound that is a variable": ("input w : int 0 .. 9\ninput v : int 0 .. w", [(2, "RCS305", "w")]),
    "constant divided by zero": ("const n = 1 / 0", [(1, "RCS305", "1 / 0")]),
    "constant made of itself": ("const a = b\nconst b = a", [(2, "RCS305", "a")]),
    "member of a set": ("input a : int 0 .. 9\nassume s : a in {a}", [(2, "RCS305", "a")]),
    "initial value": ("state n : int 0 .. 9 = 10", [(1, "RCS306", "10")]),
    "assigned constant": ("state n : int 0 .. 9\nprocedure p { n := 10 }", [(2, "RCS306", "10")]),
    "constant index": (
        "state a : array[3] of bool\nprocedure p { a[3] := true }",
        [(2, "RCS306", "3")],
    ),
    "arm never taken": ("state n : int 0 .. 9\nprocedure p { case n { 10 { } } }", [(2, "RCS306", "10")]),
    "one double, two numbers": (
        "const a = 0.1\nconst b = 0.1000000000000000055511151231257827",
        [(2, "RCS307", "0.1000000000000000055511151231257827")],
    ),
    "one double, two numbers, in cells": (
        "input w : real 0.0 .. 9.0\ntable t {\n| line | w ||\n| x | < 0.3 ||\n| y | >= 0.30000000000000001 ||\n}",
        [(5, "RCS307", "0.30000000000000001")],
    ),
    "length": ("state a : array[0] of bool", [(1, "RCS308", "0")]),
    "number beyond doubles": ("const n = 1e999", [(1, "RCS309", "1e999")]),
    "constant beyond doubles": ("const n = 1e300 * 1e300", [(1, "RCS309", "1e300 * 1e300")]),
    "arm twice": ("state n : int 0 .. 9\nprocedure p { case n { 1 { } 2, 1 { } } }", [(2, "RCS310", "1")]),
    "signed and unsigned": (
        "input a : int -1 .. 1\ninput b : int 0 .. 18446744073709551615\nassume s : a < b",
        [(3, "RCS311", "a < b")],
    ),
    "too many leaves": (
        "state a : array[4096] of bool\nstate b : array[4096] of bool\nstate c : array[4096] of bool",
        [(3, "RCS312", "c")],
    ),
    "type too large": (
        "type a = array[4096] of array[4096] of bool",
        [(1, "RCS312", "array[4096] of array[4096] of bool")],
    ),
    "loop between units": (
        "procedure p { for i in 0 [mm] .. 3 [s] { } }",
        [(1, "RCS302", "for i in 0 [mm] .. 3 [s] { }")],
    ),
    "long loop": ("procedure p { for i in 0 .. 4096 { } }", [(1, "RCS313", "for i in 0 .. 4096 { }")]),
    "many statements": (
        "state n : bool\nprocedure p { for i in 1 .. 4096 { for j in 1 .. 4096 { n := true } } }",
        [(2, "RCS313", "p")],
    ),
    "cell that nothing satisfies": (
        "input w : int 0 .. 9\ntable t {\n| line | w ||\n| x | > 9 ||\n}",
        [(4, "RCS314", "> 9")],
    ),
    "contradiction under `when`": (
        "input w : int 0 .. 900\ntable t {\n| line | when ||\n| x | w < 3 and w > 3 ||\n}",
        [(4, "RCS314", "w < 3 and w > 3")],
    ),
    "time that is no number of cycles": (
        "input a : bool\ntable t {\n| line | a ||\n| x | true for 50 [ms] ||\n| y | DEFAULT ||\n}\nlevel l { table t }",
        [(4, "RCS317", "50 [ms]")],
    ),
    "tables that wait for each other": (
        f"state a : bool state b : bool\ntable t {{\n| line | b || a |\n{TWO}}}\n{U}",
        [(12, "RCS215", "l")],
    ),
    "tables that write one variable": (
        f"input a : bool output b : bool\ntable t {{\n| line | a || b |\n{TWO}}}\n{U}",
        [(12, "RCS216", "l")],
    ),
    "table that runs twice": (
        f"input a : bool\noutput b : bool\ntable t {{\n| line | a || b |\n{TWO}}}\nlevel l {{ table t table t }}",
        [(8, "RCS202", "t")],
    ),
    "extern names": (
        'state n : bool\nextern procedure e writes n python "a b" c "1"',
        [(2, "RCS504", "e"), (2, "RCS504", "e")],
    ),
}


def reported(text: str) -> list[tuple[int, str, str]]:
    found = refused(text)
    source = Source("case.rcs", text)
    for finding in found:
        assert finding.message[0].islower() or not finding.message[0].isalpha()
        assert not finding.message.endswith(".")
        assert finding.primary.span.file == "case.rcs"
        assert all(label.span.file == "case.rcs" for label in finding.related)
    return [
        (source.position(d.primary.span.start).line, d.code.value, source.slice(d.primary.span))
        for d in found
    ]


@pytest.mark.parametrize("name", CASES)
def test_each_error_is_reported_once_on_its_smallest_span(name: str) -> None:
    text, expected = CASES[name]
    assert reported(text) == expected


def test_every_code_of_names_kinds_and_ranges_has_a_case() -> None:
    from rcsc.base.diagnostics.codes import Code

    cased = {code for _, expected in CASES.values() for _, code, _ in expected}
    elsewhere = {
        "RCS204",
        "RCS205",
        "RCS219",
        "RCS318",
        "RCS319",
        "RCS320",
        "RCS321",
        "RCS322",
        "RCS323",
        "RCS324",
        "RCS325",
    }  # test_project, tests/across; warnings: test_messages, test_unread
    assert {c.value for c in Code if c.value[3] in "23"} - cased == elsewhere


CHOOSING = """input a : bool
{selector}
procedure p {{ q }}
procedure q {{ s := a }}
procedure r {{ next s := a }}
extern procedure e reads a writes s python "m:f" c "m_f"
table t {{
  | line | a       || procedures |
  | x    | DEFAULT || {calls}    |
}}
table u {{
  | line | a       || procedures |
  | x    | DEFAULT || p          |
}}
level k {{ table u }}
level l {{ {before} table by s {{ true : t  false : t }} {after} }}
"""
PLAIN, LATER, SAFE = "state s : bool", "state s : bool deferred until a", "output s : bool safe true"


@pytest.mark.parametrize(
    ("selector", "before", "calls", "after", "steady"),
    [
        (PLAIN, "", "", "", True),
        (PLAIN, "preprocess p", "", "", True),
        (LATER, "preprocess p", "r", "postprocess r", True),
        (PLAIN, "", "p", "", False),
        (PLAIN, "", "e", "", False),
        (LATER, "", "r; q", "", False),
        (PLAIN, "", "", "postprocess p", False),
        (PLAIN, "", "", "postprocess e", False),
        (SAFE, "", "", "", False),
    ],
)
def test_what_chooses_the_table_stays_from_the_preprocess_on(  # the places that may write it
    selector: str, before: str, calls: str, after: str, steady: bool
) -> None:
    """Else a state that a cycle leaves would show another table than the one that ran; another level's lines do no harm."""
    text = CHOOSING.format(selector=selector, before=before, calls=calls, after=after)
    if selector != LATER:
        text = edited(text, ("procedure r { next s := a }\n", ""))
    found = compile_text(text)
    codes = [] if isinstance(found, Program) else [finding.code.value for finding in found]
    assert codes == ([] if steady else ["RCS214"])


def test_many_errors_are_reported_in_one_run_in_order_of_position() -> None:
    text = "state a : int 9 .. 0\nstate b : nothing\nprocedure p { c := 1 }\ntable t {\n| line | a ||\n| x | q ||\n}"
    assert [line for line, _, _ in reported(text)] == [1, 2, 3, 6]


def test_of_several_variables_that_two_tables_write_the_first_by_name_is_told() -> None:
    """Not any one of them: the order of names in a set differs from process to process."""
    names = "gcfbhdae"
    declared = "".join(f"output {name} : int 0 .. 9\n" for name in names)
    heads, ones, twos = (" | ".join(each) for each in (names, "1" * 8, "2" * 8))
    rows = f"| line | i || {heads} |\n| x | true || {ones} |\n| y | false || {twos} |\n"
    tables = f"table t {{\n{rows}}}\ntable u {{\n{rows}}}\n"
    [error] = refused(f"input i : bool\n{declared}{tables}level l {{ period 100 [ms] table t table u }}\n")
    assert "both write `a`" in error.message


def test_an_error_in_a_constant_is_not_reported_again_where_it_is_used() -> None:
    assert [code for _, code, _ in reported("const a = 1 / 0\nconst b = a + 1\nstate n : int 0 .. b")] == [
        "RCS305"
    ]


def _only(text: str) -> Diagnostic:
    (finding,) = refused(text)
    return finding


def test_a_close_name_is_suggested() -> None:
    finding = _only("input width_mm : bool\nassume a : widht_mm")
    assert finding.help == ("did you mean `width_mm`?",)


def test_the_first_of_two_places_is_related() -> None:
    text = "state n : bool\nstate n : bool"
    (label,) = _only(text).related
    assert (label.span.start, label.span.end) == (6, 7)


def test_a_cycle_of_calls_names_its_path() -> None:
    assert "b -> c -> b" in _only("procedure a { b }\nprocedure b { c }\nprocedure c { b }").message


def test_a_heading_is_wrong_once_not_in_every_line() -> None:
    text = "table t {\n| line | nobody || nowhere |\n| x | 1 || 2 |\n| y | 2 || 3 |\n}"
    assert [(line, what) for line, _, what in reported(text)] == [(2, "nobody"), (2, "nowhere")]


def test_declarations_may_stand_in_any_order() -> None:
    text = "state r : rec\nrecord rec { w : width }\ntype width = int 0 .. most\nconst most = half * 2\nconst half = 4"
    assert program_of(text).variable("r.w").type == Int(0, 8)
    assert program_of(text).records[0].name == "rec"


def test_records_and_arrays_come_to_leaves_in_declared_order() -> None:
    text = "record r { a : bool b : array[2] of int 0 .. 3 }\nstate s : array[2] of r\nstate d : bool deferred until d"
    names = [str(v.name) for v in program_of(text).variables]
    assert names == ["s[0].a", "s[0].b[0]", "s[0].b[1]", "s[1].a", "s[1].b[0]", "s[1].b[1]", "d", "d.next"]


def test_a_record_is_copied_leaf_by_leaf() -> None:
    text = "record r { a : bool b : bool }\nstate s : array[2] of r\nstate t : r\nstate i : int 0 .. 1\n"
    whole, part = program_of(text + "procedure p { t := s[1] }\nprocedure q { s[i] := t }").procedures
    assert [statement.place for statement in whole.body if isinstance(statement, Assign)] == [
        ToLeaf(VariableName(name), kind.type)
        for name in ("t.a", "t.b")
        for kind in [program_of(text).variable(name)]
    ]
    (first, _) = part.body
    assert isinstance(first, Assign)
    assert isinstance(first.place, ToElement)
    assert first.place.leaves == ("s[0].a", "s[1].a")


def test_locals_of_one_name_are_kept_apart() -> None:
    text = "procedure p { if true { local n : bool } else { local n : bool } for n in 0 .. 1 { } }"
    shown = repr(program_of(text).procedures[0].body)
    assert all(f"name='{name}'" in shown for name in ("n", "n_2", "n_3"))


def test_reads_and_writes_go_through_calls_in_declared_order() -> None:
    text = (
        "input a : array[11] of bool\ninput i : int 0 .. 10\nstate y : bool\nstate x : bool deferred until y\n"
        "procedure inner { next x := a[i] }\nprocedure outer { y := x inner }"
    )
    outer = program_of(text).procedures[1]
    assert outer.writes == ("y", "x.next")
    assert outer.reads == (*(f"a[{at}]" for at in range(11)), "i", "x")


def test_a_declared_path_covers_what_is_below_it() -> None:
    text = (
        "record r { a : bool b : bool }\ninput s : r\nstate x : bool deferred until x\n"
        "module m reads s writes x { next x := s.a or s.b }"
    )
    (module,) = program_of(text).procedures
    assert module.reads == ("s.a", "s.b")
    assert module.writes == ("x", "x.next")


def test_owners_are_laid_out_in_order() -> None:
    text = (
        "input a : bool\nstate n : bool\nprocedure p { n := a }\nprocedure q { n := not a }\n"
        "owner inner { q, p }\nowner outer { p, inner }\ntable t {\n| line | a ||\n| x | true ||\n| y | false ||\n}\n"
        "level l { period 2 [s] preprocess outer, q table t postprocess inner }"
    )
    (level,) = program_of(text).levels
    assert (level.period_ms, level.preprocess, level.postprocess) == (2000, ("p", "q", "p", "q"), ("q", "p"))


def test_one_meaning_is_one_test_shared_by_its_lines() -> None:
    text = (
        "enum e { a, b }\ninput s : e\ntable t {\n| line | s ||\n| x | a ||\n| y | = a ||\n| z |  =   a ||\n}"
    )
    lines = program_of(text).tables[0].lines
    assert lines[0].tests[0] is lines[1].tests[0] is lines[2].tests[0]
    assert isinstance(lines[0].tests[0], Test)


def test_expressions_in_cells_have_spans_in_the_file() -> None:
    text = (
        "input w : int 0 .. 9\nstate n : int 0 .. 9\nstate a : array[3] of int 0 .. 9\nprocedure p(k : int 0 .. 9) { }\n"
        "table t {\n| line | w + 1 || procedures | a[n] |\n| x | < 3 || p(w); p(n) | a[w] |\n| y | >= 3 || p(w); p(n) | |\n}"
    )
    table = program_of(text).tables[0]
    for line, begin in zip(table.lines, ("| x", "| y"), strict=True):
        row = text.index(begin)
        for action in line.actions[:2]:
            assert isinstance(action.statement, Call)
            (arg,) = action.statement.args
            assert text[arg.span.start : arg.span.end] in "wn"
            assert arg.span.start > row
            assert text[action.statement.span.start : action.statement.span.end] == action.text
    stored = table.lines[0].actions[2].statement
    assert isinstance(stored, Assign)
    assert isinstance(stored.value, Select)
    assert text[stored.value.index.span.start] == "w"
    assert isinstance(stored.place, ToElement)
    assert text[stored.place.index.span.start : stored.place.index.span.end] == "n"
    assert text.index("| line") < stored.place.index.span.start < text.index("| x")


def test_a_quotient_whose_divisor_may_be_zero_keeps_its_unit() -> None:
    text = "input w : real 0.0 .. 9.0 [mm]\ninput t : real 0.0 .. 9.0 [s]\nassume a : w / t < 3.0 [mm/s]"
    condition = program_of(text).assumptions[0].condition
    kind = condition.args[0].type  # type: ignore[union-attr]  # a comparison
    assert isinstance(kind, Real)
    assert kind.unit == (("mm", 1), ("s", -1))


HOSTILE = {
    "long sum": "state n : int 0 .. 9\nprocedure p { n := " + " + ".join(["1"] * 700) + " }",
    "records doubling": "record r0 { a : bool }\n"
    + "\n".join(f"record r{n + 1} {{ a : r{n} b : r{n} }}" for n in range(80))
    + "\nstate s : r80",
    "owners doubling": "procedure p { }\nowner o0 { p }\n"
    + "\n".join(f"owner o{n + 1} {{ o{n}, o{n} }}" for n in range(80)),
    "calls doubling": "state n : bool\nprocedure p0 { n := true }\n"
    + "\n".join(f"procedure p{n + 1} {{ p{n} p{n} }}" for n in range(80)),
    "long chain of calls": "procedure p0 { }\n"
    + "\n".join(f"procedure p{n + 1} {{ p{n} }}" for n in range(3000)),
    "long chain of calls, callers first": "\n".join(f"procedure p{n} {{ p{n + 1} }}" for n in range(3000))
    + "\nprocedure p3000 { }",
    "long chain of owners": "\n".join(f"owner o{n} {{ o{n + 1} }}" for n in range(3000))
    + "\nowner o3000 { }",
    "long chain of constants": "\n".join(f"const c{n} = c{n + 1}" for n in range(3000)) + "\nconst c3000 = 1",
    "products without end": "input n : int 0 .. 18446744073709551615\nassume a : "
    + " * ".join(["n"] * 150)
    + " > 0",
    "copies": "state a : array[4096] of array[2] of bool\nstate i : int 0 .. 4095\nprocedure p { "
    + "a[i] := a[i] " * 2000
    + "}",
    "long number": f"const a = {'9' * 100_000}",
    "long fraction": f"const a = 0.{'9' * 100_000}",
    "long exponent": f"const a = 1e-{'9' * 100_000}",
    "deep exponent": "const a = 1e-99999\nconst b = 2e-99999",
    "huge period": "input a : bool\ntable t {\n| line | a ||\n| x | true ||\n}\nlevel l { period 18446744073709551615 [s] table t }",
    "reals that overflow": "input n : real -1e308 .. 1e308\nassume a : n * n - n * n < int(n * n) * 1",
    "remainder by nothing": "input n : int 0 .. 9\nassume a : n mod 0 = 0 and n / 0 = 1",
}


@pytest.mark.parametrize("name", HOSTILE)
@pytest.mark.timeout(20)
def test_hostile_texts_are_answered_soon(name: str) -> None:
    found = compile_text(HOSTILE[name])
    assert isinstance(found, Program) or found


def test_the_steps_to_resolve_a_table_grow_with_its_lines() -> None:
    """Calls of functions, which are the same on every machine: twice the lines, about twice the calls."""
    few, many = (calls_to_resolve(count) for count in (128, 256))
    assert many < 2.5 * few


def calls_to_resolve(count: int) -> int:
    columns = 20
    head = (
        "".join(f"input x{n} : int 0 .. 1000000\n" for n in range(columns))
        + "state s : int 0 .. 9\ntable t {\n"
    )
    heading = "| line | " + " | ".join(f"x{n}" for n in range(columns)) + " || s |\n"
    rows = "".join(
        f"| {row} | " + " | ".join(f">= {(row * n) % 30}" for n in range(columns)) + f" || {row % 10} |\n"
        for row in range(count)
    )
    calls = 0

    def counted(_frame: object, event: str, _argument: object) -> None:
        nonlocal calls
        calls += event == "call"

    before = sys.getprofile()
    sys.setprofile(counted)
    try:
        found = program_of(head + heading + rows + "}\n")
    finally:
        sys.setprofile(before)
    assert len(found.tables[0].lines) == count
    return calls


SETS = """\
enum status { executing, done, failed }
set bad : status = {failed}
set ended : status = {done, bad}
set edges : int 0 .. 20 = {0 .. 2, few, 19 .. 20}
set few : int 0 .. 20 = {5, 7}
input s : status
input x : int 0 .. 20
state b : bool
table t {
  | line | s | x | when ||
  | a    | CELLS ||
}
"""


@pytest.mark.parametrize(
    ("kind", "member"),
    [
        ("int 0 .. 9", "1"),
        ("int 0 .. 9", "2 .. 5"),
        ("int 0 .. 255", "0bx0xx_1010"),
        ("real 0.0 .. 1.0", "0.5"),
    ],
)
def test_a_set_that_names_sets_has_each_member_once(kind: str, member: str) -> None:
    """Thirty sets, each of which names the one before three times, would have 3**30 members."""
    sets = "".join(f"set s{at + 1} : {kind} = {{s{at}, s{at}, s{at}}}\n" for at in range(30))
    first = f"set s0 : {kind} = {{{member}}}\n"
    rows = "| in | in s30 || true |\n| out | not in s30 || false |\n"
    text = f"{first}{sets}input a : {kind}\noutput o : bool\ntable t {{\n| line | a || o |\n{rows}}}\n"
    [table] = program_of(text).tables
    [test] = [each for each in table.lines[0].tests if each is not None]
    assert len(list(parts(test.condition))) < 50


@pytest.mark.parametrize(
    ("cells", "plain"),
    [
        ("in ended | - | -", "in {done, failed} | |"),
        ("not in ended | in edges | -", "executing | | x <= 2 or x = 5 or x = 7 or x >= 19"),
        ("done, failed | not in edges | -", "/= executing | | not (x <= 2 or x = 5 or x = 7 or x >= 19)"),
        ("bad, executing | 3 .. 4, 8 | -", "/= done | | x in 3 .. 4 or x = 8"),
        ("not in {bad} | not in 0 .. 18 | -", "/= failed | >= 19 |"),
        ("in {ended, executing} | not in {few, 1 .. 4} | -", " | | not (x in {5, 7} or x in 1 .. 4)"),
        ("- | - | s in ended and x not in few", " | | s /= executing and x /= 5 and x /= 7"),
        ("- | - | x not in 3 .. 30 or s not in {done, bad}", " | | x < 3 or s = executing"),
    ],
)
def test_sets_mean_what_they_name(cells: str, plain: str) -> None:
    """Held against the same without sets, for every input."""
    both = [program_of(SETS.replace("CELLS", text)) for text in (cells, plain)]
    for s in range(3):
        for x in range(21):
            matches = [
                all(
                    test is None or holds(test.condition, {"s": s, "x": x, "b": False})
                    for test in program.tables[0].lines[0].tests
                )
                for program in both
            ]
            assert matches[0] is matches[1], (s, x)


@pytest.mark.parametrize(
    ("declared", "cell", "code", "message"),
    [
        ("", "in ends", "RCS201", "no set is called `ends`"),
        ("", "= ended", "RCS301", "`ended` is a set, not a value"),
        ("", "in {ended, edges}", "RCS301", ""),
        ("set odd : status = {done, 5}", "done", "RCS301", ""),
        ("set odd : int 0 .. 9 = {8 .. 3}", "done", "RCS303", ""),
        ("set odd : int 0 .. 9 = {x}", "done", "RCS305", "`x` is a variable"),
        ("set odd : status = {other}\nset other : status = {odd}", "done", "RCS305", "by means of itself"),
        ("set odd : int 0 .. 9 = {10}", "done", "RCS306", "10 is not in 0 .. 9"),
        ("set odd : int 0 .. 9 = {3 .. 10}", "done", "RCS306", "10 is not in 0 .. 9"),
        ("set odd : int 0 .. 9 = {few, 19 .. 20, edges}", "done", "RCS306", "19 is not in 0 .. 9"),
        ("set odd : int 0 .. 9 = {edges}", "done", "RCS306", "19 is not in 0 .. 9"),
        ("set odd : int 0 .. 9 [mm] = {3 [N]}", "done", "RCS302", ""),
        ("set odd : int 0 .. 9 [mm] = {3, 5 [mm]}", "done, odd", "RCS301", ""),
        ("enum other { done, more }\nset odd : status = {other.done}", "done", "RCS301", ""),
        ("enum other { done, more }\nset odd : other = {done}", "in odd", "RCS301", ""),
        ("set ended : status = {done}", "done", "RCS202", "declared twice"),
        ("record r { a : bool }\nset odd : r = {1}", "done", "RCS301", "a set has values of a scalar type"),
    ],
)
def test_what_is_wrong_with_a_set_is_said(declared: str, cell: str, code: str, message: str) -> None:
    text = SETS.replace("table t", f"{declared}\ntable t").replace("CELLS", f"{cell} | - | -")
    diagnostics = refused(text)
    assert (code, True) in {(each.code.value, message in each.message) for each in diagnostics}


HIDING = """\
enum status { executing, done, failed }
const lim = 5
const step = 0.1
set low : int 0 .. 9 = {0 .. lim, 9}
set near : single 0.0 .. 1.0 = {step, 0.5 .. 1.0}
set ended : status = {done, failed}
set both : status = {ended}
input x : int 0 .. 9
input s : status
input r : single 0.0 .. 1.0
output o : bool
BODY
table t {
  | line | when ||
  | a    | true ||
}
"""


@pytest.mark.parametrize(
    ("body", "wanted"),
    [
        (
            "procedure p(lim : int 0 .. 9) { o := x in low }",
            "procedure p(q : int 0 .. 9) { o := x <= 5 or x = 9 }",
        ),
        ("procedure p(lim : int 0 .. 9) { o := x not in {low, lim} }", "RCS305"),
        (
            "procedure p { for lim in 2 .. 3 { o := x in {low, 7} } }",
            "procedure p { for q in 2 .. 3 { o := x <= 5 or x = 9 or x = 7 } }",
        ),
        ("procedure p { local lim : bool := true  o := x in low }", "procedure p { o := x <= 5 or x = 9 }"),
        ("procedure p(done : bool) { o := s in both }", "procedure p(q : bool) { o := s /= executing }"),
        ("procedure p(low : int 0 .. 9) { o := x in {low} }", "RCS305"),
        (
            "procedure p(low : int 0 .. 9) { o := x in low }",
            "procedure p(q : int 0 .. 9) { o := x <= 5 or x = 9 }",
        ),
        (
            "procedure p(step : single 0.0 .. 1.0) { o := r in near }",
            "procedure p(q : bool) { o := r = 0.1 or r in 0.5 .. 1.0 }",
        ),
        (
            "procedure p { local s : int 0 .. 9 := 3  o := s in low }",
            "procedure p { local q : int 0 .. 9 := 3  o := q <= 5 or q = 9 }",
        ),
        ("procedure p(lim : int 0 .. 9) { local k : int 0 .. lim := 0  o := k = 0 }", "RCS305"),
        ("procedure p(lim : int 0 .. 9) { for k in 0 .. lim { o := k = 0 } }", "RCS305"),
        ("procedure p(lim : int 0 .. 9) { case x { lim { o := true } else { o := false } } }", "RCS305"),
        ("procedure p(lim : int 0 .. 9, k : int 0 .. lim) { o := k = 0 }", "RCS305"),
        ("procedure p(done : status) { case s { done { o := true } else { o := false } } }", "RCS305"),
    ],
)
def test_a_local_hides_constants_where_it_stands_and_in_no_set(body: str, wanted: str) -> None:
    """A set means what it meant where it was declared; what has to be constant is none where a local has its name."""
    text = HIDING.replace("BODY", body)
    if wanted.startswith("RCS"):
        assert wanted in {each.code.value for each in refused(text)}
        return
    programs = program_of(text), program_of(HIDING.replace("BODY", wanted))
    for x, s, r in product(range(10), range(3), (0.0, to_single(0.1), 0.5, 1.0)):
        found = []
        for program in programs:
            now: dict[str, Value] = {"x": x, "s": s, "r": r, "o": False}
            call(program, "p", [0 for _ in program.procedures[0].params], now)
            found.append(now["o"])
        assert found[0] is found[1], (x, s, r)


COUNTS = """\
input a : bool
input b : bool
input n : int 0 .. 3
input lid : int 0 .. 9 [mm]
state count : int 0 .. 9
table t {
  | line | when ||
  | a    | CELL ||
}
"""


@pytest.mark.parametrize(
    ("cell", "plain"),
    [
        ("count(a, b, n > 1) <= 1", "not (a and b) and not (a and n > 1) and not (b and n > 1)"),
        ("count(a) = n", "a and n = 1 or not a and n = 0"),
        ("count(a, a, not b, true) = 3", "a and b"),
        ("int(a) + int(b) = 1", "a xor b"),
        ("n = int(true) + int(a and b)", "n = 1 and not (a and b) or n = 2 and a and b"),
        ("int(a) = int(n = 3)", "a = (n = 3)"),
    ],
)
def test_counts_mean_how_many_hold(cell: str, plain: str) -> None:
    """Held against the same with `and`, `or` and `xor` alone, for every input."""
    both = [program_of(COUNTS.replace("CELL", text)).tables[0].lines[0].tests[0] for text in (cell, plain)]
    assert all(both)
    for a, b, n in product((False, True), (False, True), range(4)):
        snapshot = {"a": a, "b": b, "n": n, "lid": 0, "count": 0}
        matches = [holds(test.condition, snapshot) for test in both if test]
        assert matches[0] is matches[1], (a, b, n)


@pytest.mark.parametrize(
    ("cell", "code", "message"),
    [
        ("count(a, n) = 1", "RCS301", "a condition is a bool, this is int"),
        ("int(n) = 1", "RCS301", "`int` converts a real number, a single or a bool"),
        ("count(a, b) = 3.0", "RCS301", ""),
        ("abs(a) = 1", "RCS301", "arithmetic takes numbers, this is bool"),
    ],
)
def test_what_is_wrong_with_a_count_is_said(cell: str, code: str, message: str) -> None:
    diagnostics = refused(COUNTS.replace("CELL", cell))
    assert (code, True) in {(each.code.value, message in each.message) for each in diagnostics}


def test_elsewhere_count_is_a_name() -> None:
    program = program_of(
        COUNTS.replace("CELL", "count = count(a, b) and lid >= count(a) * 2")
        + "procedure count_up { count := min(count + 1, 9) }\nprocedure p { count_up }"
    )
    assert program.tables[0].variables == ("a", "b", "lid", "count")


WORDS = """\
const three = 0b11
input w : int 0 .. 1023
input several : array[2] of int 0 .. 7
input at : int 0 .. 1
input signed : int -1 .. 9
input length : int 0 .. 9 [mm]
input on : bool
state n : int 0 .. 1000000
table t {
  | line | HEADING ||
  | a    | CELL    ||
}
"""
Holds = Callable[[int], bool]


def word_table(heading: str, cell: str) -> str:
    return WORDS.replace("HEADING", heading).replace("CELL", cell)


@pytest.mark.parametrize(
    ("heading", "cell", "wanted"),
    [
        ("w", "xx 01x0 1xx1", lambda w: w & 0b1101_1001 == 0b0100_1001),
        ("w", "/= 0bxx_xxxx_xx10", lambda w: w & 3 != 2),
        ("w", "00 0000 0101", lambda w: w == 5),
        ("w", "0b101", lambda w: w == 5),
        ("w", "0x10", lambda w: w == 16),
        ("w", "10", lambda w: w == 10),
        ("w", "0b0xxxxxxxxx, 1023", lambda w: w < 512 or w == 1023),
        ("w", "not in {0bxxxxxxxxx1, 0b1xxxxxxxxx}", lambda w: not (w & 1 or w & 512)),
        ("w[7..4]", "1x x0", lambda w: w >> 4 & 0b1001 == 0b1000),
        ("w[7..4][2..1]", "0b01", lambda w: w >> 5 & 3 == 1),
        ("w / 2 mod 16", "x1 0x", lambda w: w >> 1 & 0b0110 == 0b0100),
        ("w[9..0]", "5", lambda w: w == 5),
        ("w[9]", "true", lambda w: w >= 512),
        ("w[three]", "false", lambda w: not w & 8),
        ("three[1]", "true", lambda w: w >= 0),
        ("w & 0b1110 << 2", "0b11000", lambda w: w & 14 == 6),
        ("(w & 0b11_0101_1001) * 2", "0b1000010", lambda w: (w & 0b1101011001) * 2 == 66),
        ("0xF0F0 & w", "0x50", lambda w: w & 0xF0F0 == 0x50),
        ("w & 0", "0", lambda w: w >= 0),
        ("w >> 3 & 1", "1", lambda w: bool(w & 8)),
        ("w << 2 >> 4", "3", lambda w: w << 2 >> 4 == 3),
        ("w >> 63", "0", lambda w: w >= 0),
        ("when", "w = 0bxx_xxxx_x11x and not w[0]", lambda w: w & 7 == 6),
        ("when", "count(w[0], w[1], w[2]) = int(w[9])", lambda w: (w & 7).bit_count() == w >> 9),
    ],
)
def test_bits_are_those_of_the_word(heading: str, cell: str, wanted: Holds) -> None:
    found = compile_text(word_table(heading, cell))
    assert isinstance(found, Program)
    [test] = found.tables[0].lines[0].tests
    for w in range(1024):
        assert (test is None or holds(test.condition, {"w": w})) is wanted(w), w


def test_a_constant_is_added_to_the_bits_of_a_word() -> None:
    """`|`, which no cell can have."""
    program = program_of(
        f"{WORDS.replace('HEADING', 'on').replace('CELL', 'true')}procedure p {{ n := w | 0b101_0000 | 2 }}"
    )
    [assignment] = program.procedures[0].body
    assert isinstance(assignment, Assign)
    assert assignment.value.type == Int(0b101_0010, 1023)
    for w in range(1024):
        assert evaluate(assignment.value, {"w": w}) == w | 0b101_0010


def test_masks_of_one_byte_are_boxes() -> None:
    program = program_of(
        "input b : int 0 .. 255\ntable t {\n| line | b ||\n| a | 1xxx xxxx ||\n| b | 01xx xxx0 ||\n| c | DEFAULT ||\n}"
    )
    boxes = [test.box for line in program.tables[0].lines for test in line.tests if test]
    assert boxes == [((128, 255),), tuple((key, key) for key in range(64, 128, 2))]


@pytest.mark.parametrize(
    ("heading", "cell", "code", "message"),
    [
        ("w", "x1 0x", "RCS306", "the mask has 4 bits, the word has 10"),
        ("w[10]", "true", "RCS306", "there is no bit 10, the word has 9..0"),
        ("w[0..3]", "1", "RCS303", "the bits 0..3 are none"),
        ("w[at]", "true", "RCS305", "the number of a bit is a constant"),
        ("w[on..0]", "1", "RCS305", ""),
        ("signed", "xx 11", "RCS301", "this is one that can be negative"),
        ("signed[0]", "true", "RCS301", "this is one that can be negative"),
        ("length[2..0]", "3", "RCS301", "this is one with a unit"),
        ("on", "x1 11", "RCS301", "this is bool"),
        ("on & on", "true", "RCS301", "this is bool"),
        ("w & at", "1", "RCS305", "one side of `&` is a constant"),
        ("w << at", "1", "RCS305", "a shift is by a constant from 0 to 63"),
        ("w >> 64", "0", "RCS305", "a shift is by a constant from 0 to 63"),
        ("w", "< 0bxx", "RCS301", "a mask is no value"),
        ("when", "0bxx", "RCS301", "a mask is no value"),
        ("several[at][3]", "true", "RCS306", "there is no bit 3"),
        ("several[2][1]", "true", "RCS306", "the index 2 is not in 0 .. 1"),
        ("nothing[1]", "true", "RCS201", "nothing"),
    ],
)
def test_what_is_wrong_with_bits_is_said(heading: str, cell: str, code: str, message: str) -> None:
    diagnostics = refused(word_table(heading, cell))
    assert (code, True) in {(each.code.value, message in each.message) for each in diagnostics}
    assert len(diagnostics) == 1


def test_a_field_may_be_called_set() -> None:
    text = "record r { set : bool  in_set : bool }\ninput set : r\nset few : int 0 .. 9 = {1, 3}\ninput x : int 0 .. 9\n"
    program_of(text + "table t {\n  | line | x | set.set ||\n  | a | in few | ||\n}\n")
