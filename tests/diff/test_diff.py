"""`rcsc diff`: the regions it claims against seeded edits, against every input of small tables, and over git revisions."""

import json
import shutil
import subprocess
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import fields, is_dataclass, replace
from enum import StrEnum
from itertools import combinations, product
from pathlib import Path
from random import Random

import pytest

from rcsc.base.diagnostics.render import plain
from rcsc.front.commands import run
from rcsc.lang.interpret import cycle, evaluate, execute, initial, matching_lines
from rcsc.lang.model import (
    Bool,
    Default,
    Enum,
    Invariant,
    Kind,
    Level,
    Line,
    Owner,
    Program,
    Property,
    Scalar,
    Table,
    Value,
    key_bounds,
    key_of,
    spell,
    value_of_key,
)
from rcsc.proof.solvers import smt
from rcsc.proof.solvers.options import Options
from rcsc.proof.solvers.smt import Answer, Solver, UndecidedError
from rcsc.views.diff.changes.difference import (
    Basis,
    Change,
    ComparedPart,
    Difference,
    PartSort,
    ProgramDifference,
)
from rcsc.views.diff.compare import compare
from rcsc.views.diff.present import knows, within_reach
from rcsc.views.diff.rows import rows
from tests.support.programs.examples import WALKER
from tests.support.programs.stages import program_of, shipped
from tests.support.programs.texts import edit_file, edited, one_row_a_line

REPO = Path(__file__).parents[2]


def differ(before: str, after: str) -> ProgramDifference:
    found = compare("case", program_of(before), program_of(after), Options())
    assert not found.undecided
    return found


def part(found: ProgramDifference, name: str, what: str = "table") -> ComparedPart:
    return next(compared for compared in found.parts if (compared.what, compared.name) == (what, name))


def regions(changes: tuple[Change, ...]) -> set[tuple[str, str, tuple[str, ...]]]:
    """Each box of each change, in words; all must be exact."""
    assert all(change.where.exact and not change.where.also for change in changes)
    return {(change.before, change.after, box) for change in changes for box in change.where.words}


# --- seeded edits of shipped tables ----------------------------------------------------------

ACQUIRE = one_row_a_line(REPO / "tables/task/acquire.rcs")


@pytest.fixture(scope="module")
def task(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Program]:
    """The program of the TASK level, with texts of its files replaced."""
    folder = tmp_path_factory.mktemp("tables")
    for name in ("rcsc.toml", "vocabulary.rcs"):
        shutil.copy(REPO / "tables" / name, folder / name)
    shutil.copytree(REPO / "tables/task", folder / "task")
    (folder / "task/acquire.rcs").write_text(ACQUIRE, encoding="utf-8")

    def with_edits(name: str = "acquire.rcs", *edits: tuple[str, str]) -> Program:
        path = folder / "task" / name
        kept = path.read_text(encoding="utf-8")
        edit_file(path, *edits)
        try:
            return shipped("task/acquire.rcs", folder)
        finally:
            path.write_text(kept, encoding="utf-8")

    return with_edits


def line_of(name: str) -> str:
    """A line of ACQUIRE, as it stands."""
    return next(row for row in ACQUIRE.splitlines(keepends=True) if row.startswith(f"  | {name} "))


def acquire(
    task: Callable[..., Program], *edits: tuple[str, str], file: str = "acquire.rcs"
) -> ProgramDifference:
    return compare("acquire", task(), task(file, *edits), Options())


def test_the_same_text_is_known_by_digest_and_no_solver_is_asked(
    task: Callable[..., Program], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Solver, "check", lambda *_: pytest.fail("the solver was asked"))
    found = acquire(task, ("## ACQUIRE (OBJ [at A]), level TASK.", "## Another doc line."))
    assert not found.changed
    assert {compared.basis for compared in found.parts} == {Basis.DIGEST}


def test_a_narrowed_condition_gives_what_it_lost_to_default(task: Callable[..., Program]) -> None:
    nine = line_of("9")
    found = acquire(
        task, (nine, edited(nine, ("| pause         |              |", "| pause         | done         |")))
    )
    changed = part(found, "acquire")
    assert regions(changed.changes) == {
        (
            "line `9`",
            "DEFAULT `16`",
            ("new_command = false", "emove.command = pause", "emove.status /= done", "cur_state = d_state"),
        )
    }
    [change] = changed.changes
    assert change.sort is PartSort.EFFECT
    assert change.where.inputs == (32, 5184)
    assert dict(change.witness)["emove.status"] == "executing"
    assert {(v.leaf, v.headings, v.at) for v in change.values} == {
        ("cur_state.next", ("procedures",), ("d_state", "f_state")),
        ("to_workstation.status_report", ("status_out",), ("done", "failed")),
        ("to_workstation.failure", ("procedures",), ("none", "state")),
    }
    assert changed.basis is Basis.SOLVER
    assert [compared.name for compared in found.parts if compared.changed] == ["acquire"]


def test_a_widened_condition_meets_another_line_where_both_now_match(task: Callable[..., Program]) -> None:
    five = line_of("5")
    wide = edited(five, ("| done         | state_4 ", "| /= executing | state_4 "))
    changed = part(acquire(task, (five, wide)), "acquire")
    assert regions(changed.changes) == {
        (
            "line `11`",
            "several lines",
            (
                "new_command = false",
                "emove.command = move_to_obj",
                "emove.status = failed",
                "cur_state = state_4",
            ),
        )
    }
    assert changed.changes[0].sort is PartSort.FAULT
    assert changed.changes[0].where.inputs == (16, 5184)


def test_two_lines_that_change_places_mean_the_same(task: Callable[..., Program]) -> None:
    found = acquire(task, (line_of("6") + line_of("7"), line_of("7") + line_of("6")))
    assert not found.changed
    assert part(found, "acquire").basis is Basis.SOLVER
    assert part(found, "acquire").moved == ()


def test_a_renamed_line_is_another_line_with_the_same_effect(task: Callable[..., Program]) -> None:
    found = acquire(task, (line_of("7"), edited(line_of("7"), ("| 7    |", "| 7a   |"))))
    assert not found.changed
    assert regions(part(found, "acquire").moved) == {
        (
            "line `7`",
            "line `7a`",
            ("new_command = false", "emove.command = locate", "emove.status = done", "cur_state = state_3"),
        )
    }


def test_a_line_split_in_two_with_the_same_effect_is_told_apart(task: Callable[..., Program]) -> None:
    ten = line_of("10")
    cell = "| /= f_state                              |"
    others = "| in {state_3, state_4, state_5, state_6, state_7, state_8} |"
    low = edited(ten, (cell, "| in {d_state, state_2} |"))
    rest = edited(ten, ("| 10   |", "| 10b  |"), (cell, others))
    found = acquire(task, (ten, low + rest))
    assert not found.changed
    [moved] = part(found, "acquire").moved
    assert (moved.before, moved.after, moved.sort) == ("line `10`", "line `10b`", PartSort.LINE)
    assert moved.where.inputs == (6 * 16, 5184)
    assert "cur_state in {state_3, state_4, state_5, state_6, state_7, state_8}" in moved.where.words[0]


def test_a_constant_in_a_line_changes_its_effect_and_the_steps_of_the_state_graph(
    task: Callable[..., Program],
) -> None:
    six = line_of("6")
    found = acquire(task, (six, edited(six, ("nextstate(state_3)", "nextstate(state_4)"))))
    [change] = part(found, "acquire").changes
    assert [(v.leaf, v.before, v.after) for v in change.values] == [("cur_state.next", "state_3", "state_4")]
    assert change.where.words == (
        ("new_command = false", "emove.command = move_to", "emove.status = done", "cur_state = state_2"),
    )


def test_a_constant_in_a_procedure_changes_every_line_that_calls_it(task: Callable[..., Program]) -> None:
    old = "  to_workstation.failure := loc\n  remember_current_loc := 0\n"
    common = (REPO / "tables/task/common.rcs").read_text(encoding="utf-8")
    assert common.count("  to_workstation.failure := loc\n") == 1, old
    found = acquire(
        task, ("  to_workstation.failure := loc\n", "  to_workstation.failure := cmd\n"), file="common.rcs"
    )
    assert {(compared.what, compared.name) for compared in found.parts if compared.changed} == {
        ("table", "acquire"), ("procedure", "loc_failure")
    }  # fmt: skip
    [change] = part(found, "acquire").changes
    assert (change.before, change.after) == ("line `12`", "line `12`")
    assert change.where.words == (
        ("new_command = false", "emove.command = locate", "emove.status = failed", "cur_state /= f_state"),
    )
    assert [(v.leaf, v.before, v.after) for v in change.values] == [("to_workstation.failure", "loc", "cmd")]


def test_independent_assignments_in_another_order_mean_the_same(task: Callable[..., Program]) -> None:
    one, two = "  to_emove.sector := source_sector\n", "  to_emove.locpt_ptr := source_vupos\n"
    found = acquire(task, (one + two, two + one), file="common.rcs")
    assert not found.changed
    assert part(found, "vupos_setup", "procedure").basis is Basis.SOLVER
    assert part(found, "acquire").basis is Basis.SOLVER


# --- every input of small tables -----------------------------------------------------------------

HEAD = """\
enum colour { red, green, blue }
input a : colour
input b : bool
input c : int 0 .. 3
state s : int 0 .. 3
output o : int 0 .. 3
procedure up { if s < 3 { s := s + 1 } }
procedure copy { s := c }
procedure keep { s := s }
procedure both { if b { s := 2 } else { o := 3 } }
"""
ACTIONS = (
    "", "", "o := 0", "o := 1", "o := c", "up", "copy", "keep", "both", "up; o := 2", "o := 2; up", "o := s",
)  # fmt: skip
CELLS = {
    "a": ("", "", "red", "green", "/= blue", "in {red, blue}"),
    "b": ("", "", "true", "false"),
    "c": ("", "", "0", "<= 1", "> 1", "1 .. 2", "in {0, 3}"),
    "when": ("", "", "", "", "c < s", "s = 1", "b or s > 2"),
}
Row = list[str]


def drawn(random: Random) -> list[Row]:
    """Rows: a name, a cell a column, an action."""
    names = [f"l{at}" for at in range(random.randint(1, 4))]
    return [
        [name, *(random.choice(cells) for cells in CELLS.values()), random.choice(ACTIONS)] for name in names
    ]


def shuffled(random: Random, rows: list[Row]) -> list[Row]:
    """A few random edits."""
    made = [list(row) for row in rows]
    for _ in range(random.randint(0, 3)):
        row = random.choice(made)
        kind = random.randrange(8)
        if kind < 4:
            column = random.randrange(4)
            row[1 + column] = random.choice(list(CELLS.values())[column])
        elif kind < 6:
            row[5] = random.choice(ACTIONS)
        elif kind == 6:
            row[0] = f"r{random.randint(0, 9)}{len({one[0] for one in made})}"
        elif len(made) > 1:
            made.remove(row)
    seen: dict[str, Row] = {row[0]: row for row in made}
    return list(seen.values())


def spelled(rows: list[Row], default: bool) -> str:
    lines = [f"  | {' | '.join(row[:5])} || {row[5]} |" for row in rows]
    lines += ["  | rest | DEFAULT | | | || o := 3 |"] if default else []
    head = "  | line | a | b | c | when || procedures |\n  |---|---|---|---|---||---|"
    return HEAD + "table t {\n" + "\n".join([head, *lines]) + "\n}\n"


def outcome(made: Program, table: Table, snapshot: dict[str, Value]) -> tuple[str, tuple[Value, ...] | None]:
    """The line or fault, and the state behind it."""
    names = matching_lines(table, snapshot)
    lines = {line.name: line.actions for line in table.lines}
    if len(names) > 1 or (not names and table.default is None):
        return ("several lines" if names else "no line"), None
    after = dict(snapshot)
    name = names[0] if names else "rest"
    actions = lines[names[0]] if names else (table.default.actions if table.default else ())
    execute(made, [action.statement for action in actions], after, {})
    return name, tuple(after[variable.name] for variable in made.variables)


def inputs(made: Program) -> list[dict[str, Value]]:
    kinds = [(str(v.name), v.type) for v in made.variables]
    ranges = [range(low, high + 1) for low, high in (key_bounds(kind) for _, kind in kinds)]
    return [
        {name: value_of_key(kind, key) for (name, kind), key in zip(kinds, keys, strict=True)}
        for keys in product(*ranges)
    ]


def bare(label: str) -> str:
    return label.split("`")[1] if "`" in label else label


def disagreements(before: Program, after: Program, seen: Counter[str]) -> list[str]:
    """Compares the claimed regions with every input."""
    found = compare("t", before, after, Options())
    assert not found.undecided
    claimed = part(found, "t")
    kinds = {str(v.name): v.type for v in before.variables}
    wrong = []
    for snapshot in inputs(before):
        keys = {name: key_of(kind, snapshot[name]) for name, kind in kinds.items()}
        one = outcome(before, before.tables[0], snapshot)
        two = outcome(after, after.tables[0], snapshot)
        sort = None
        if one[1] != two[1] or (one[1] is None and one != two):
            sort = PartSort.FAULT if one[1] is None or two[1] is None else PartSort.EFFECT
        elif one[0] != two[0]:
            sort = PartSort.LINE
        says = set()
        for change in (*claimed.changes, *claimed.moved):
            if (bare(change.before), bare(change.after)) == (one[0], two[0]):
                inside = any(
                    all(any(low <= keys[name] <= high for low, high in part) for name, part in box.items())
                    for box in change.where.boxes
                )
                exact = change.where.exact and not change.where.also
                seen["exact" if exact else "besides"] += inside
                if inside if exact else (inside and change.sort is sort):
                    says.add(change.sort)
                elif not change.where.exact and change.sort is sort:
                    says.add(change.sort)  # boxes are part of the region
        seen[str(sort)] += 1
        if says != ({sort} if sort else set()):
            wrong.append(f"{snapshot}: {one} -> {two}: {sort}, said {says}")
    return wrong


@pytest.mark.parametrize("seed", range(8))
def test_the_regions_are_those_that_every_input_shows(seed: int) -> None:
    random, seen = Random(seed), Counter[str]()  # noqa: S311  # repeatable on purpose
    for _ in range(5):
        rows = drawn(random)
        default = random.random() < 0.5
        before, after = (
            program_of(spelled(rows, default)),
            program_of(spelled(shuffled(random, rows), default)),
        )
        assert disagreements(before, after, seen) == []
    assert seen["exact"] > seen["besides"]


# --- what is not a box -----------------------------------------------------------------------------

GRIP = """\
enum status { executing, done }
input reported : status
input width : int 0 .. 9
input wanted : int 0 .. 9
state near : bool
output order : int 0 .. 3
procedure look { near := width >= wanted }
table grip {
  | line | reported  | width || procedures | order |
  |------|-----------|-------||------------|-------|
  | wait | executing |       ||            | 0     |
  | held | done      | <= 4  || look       | 1     |
  | wide | done      | > 4   ||            | 2     |
}
"""


def test_a_region_across_variables_is_said_as_a_condition() -> None:
    found = differ(GRIP, edited(GRIP, ("width >= wanted", "width > wanted")))
    [change] = part(found, "grip").changes
    assert change.where.exact
    assert change.where.words == (("reported = done", "width <= 4"),)
    assert change.where.also == "(wanted <= width) /= (wanted < width)"
    assert change.where.inputs is None
    assert dict(change.witness) == {"reported": "done", "width": "0", "wanted": "0"}
    assert [(v.leaf, v.at) for v in change.values] == [("near", ("true", "false"))]


def test_a_line_across_variables_is_said_in_its_own_conditions() -> None:
    text = edited(
        GRIP,
        ("| line | reported  | width ||", "| line | reported  | width - wanted ||"),
        ("width : int 0 .. 9", "width : int 0 .. 60"),
        ("wanted : int 0 .. 9", "wanted : int 0 .. 60"),
    )
    found = differ(text, edited(text, ("| 1     |", "| 3     |")))
    [change] = part(found, "grip").changes
    assert (change.where.exact, change.where.words) == (True, (("reported = done",),))
    assert change.where.also == "(width - wanted) <= 4"


def test_an_effect_that_is_written_otherwise_but_is_the_same_is_the_same() -> None:
    found = differ(
        GRIP,
        edited(
            GRIP, ("near := width >= wanted", "if width < wanted { near := false } else { near := true }")
        ),
    )
    assert not found.changed
    assert part(found, "look", "procedure").basis is Basis.SOLVER


def test_a_gap_and_an_overlap_are_faults_in_their_own_regions() -> None:
    found = differ(GRIP, edited(GRIP, ("| <= 4  |", "| <= 3  |"), ("| > 4   |", "| in {3, 5, 6, 7, 8, 9} |")))
    assert regions(part(found, "grip").changes) == {
        ("line `held`", "no line", ("reported = done", "width = 4")),
        ("line `held`", "several lines", ("reported = done", "width = 3")),
    }


def test_a_region_that_reaches_past_the_assumptions_stays_one() -> None:
    text = edited(GRIP, ("table grip {", "assume narrow assumed : width <= 7\ntable grip assuming narrow {"))
    [change] = part(differ(text, edited(text, ("| 2     |", "| 3     |"))), "grip").changes
    assert change.relied_on
    assert regions((change,)) == {("line `wide`", "line `wide`", ("reported = done", "width >= 5"))}


def test_an_input_outside_every_assumption_is_marked() -> None:
    text = edited(GRIP, ("table grip {", "assume narrow assumed : width <= 7\ntable grip assuming narrow {"))
    one = edited(text, ("| wide | done      | > 4 ", "| wide | done      | in {5, 6, 7} "))
    [change] = part(differ(text, one), "grip").changes
    assert (change.relied_on, change.after) == (False, "no line")
    assert regions((change,)) == {("line `wide`", "no line", ("reported = done", "width >= 8"))}


def test_a_changed_assumption_is_a_region() -> None:
    text = edited(GRIP, ("table grip {", "assume narrow assumed : width <= 7\ntable grip assuming narrow {"))
    found = differ(text, edited(text, ("width <= 7", "width <= 8")))
    assert regions(part(found, "narrow", "assumption").changes) == {("false", "true", ("width = 8",))}


def test_where_only_one_version_goes_wrong_is_a_change() -> None:
    text = edited(
        GRIP,
        ("near := width >= wanted", "count := min(count + 1, 9)"),
        ("output order", "state count : int 0 .. 9\noutput order"),
    )
    found = differ(text, edited(text, ("min(count + 1, 9)", "count + 1")))
    [change] = part(found, "grip").changes
    assert regions((change,)) == {
        ("line `held`", "line `held`", ("reported = done", "width <= 4", "count = 9"))
    }
    assert [v.leaf for v in change.values] == ["the run"]


# --- properties --------------------------------------------------------------------------------------

COUNTED = """\
enum stage { begun, done }
input width : int 0 .. 9
state count : int 0 .. 9
state at : stage
procedure up { count := min(count + 1, 9) }
property rises : count >= was count
property ends : at = done until width = 0
table t {
  | line | at   || procedures |
  | a    | done || up         |
  | b    | /= done ||         |
}
level l { period 40 [ms]  table t }
"""


def property_part(old: str, new: str, name: str = "rises") -> ComparedPart:
    return part(differ(COUNTED, edited(COUNTED, (old, new))), name, "property")


def test_a_property_that_says_the_same_in_other_words_is_the_same() -> None:
    made = property_part("count >= was count", "not was count > count")
    assert (made.changed, made.basis) == (False, Basis.SOLVER)
    assert property_part("count >= was count", "count >= was count # as it was").basis is Basis.DIGEST
    found = differ(COUNTED, edited(COUNTED, ("{ begun, done }", "{ done, begun }")))
    assert not part(found, "ends", "property").changed  # members are the same by name, here too


def test_a_property_that_says_something_else_is_a_region_over_two_cycles() -> None:
    made = property_part("count >= was count", "count >= was count or width = 0")
    assert made.notes == ("count >= was count -> count >= was count or width = 0",)
    [change] = made.changes
    assert (change.sort, change.before, change.after) == (PartSort.CONDITION, "false", "true")
    assert change.where.inputs == (45, 1000)  # width = 0, and 45 of 100 pairs that fall
    assert dict(change.witness) == {"width": "0", "count": "0", "was count": "1"}


def test_what_is_not_defined_does_not_hold() -> None:
    [change] = property_part("count >= was count", "count >= was count and 10 / count >= 0").changes
    assert regions((change,)) == {("true", "false", ("count = 0", "was count = 0"))}


def test_a_property_that_is_new_or_gone_is_said_with_its_words() -> None:
    line = "property ends : at = done until width = 0\n"
    assert property_part(line, "", "ends").notes == ("gone: at = done until width = 0",)
    made = property_part(line, f"{line}property small : count <= width\n", "small")
    assert made.notes == ("new: count <= width",)


def test_a_condition_about_a_variable_of_another_kind_cannot_be_compared() -> None:
    before = edited(COUNTED, ("level l", "assume low : width <= 8 and count <= 9\nlevel l"))
    after = edited(
        before,
        ("input width : int 0 .. 9", "input width : real 0.0 .. 9.0"),
        ("until width = 0", "until width = 0.0"),
        ("width <= 8 and", "width <= 8.0 and"),
    )
    found = differ(before, after)
    for name, what in (("ends", "property"), ("low", "assumption")):
        assert part(found, name, what).notes == ("cannot be compared: `width` changed its kind",)
    assert not part(found, "rises", "property").changed


# --- declarations ------------------------------------------------------------------------------------


def test_members_are_the_same_by_name_whatever_their_number() -> None:
    found = differ(GRIP, edited(GRIP, ("{ executing, done }", "{ done, failed, executing }")))
    assert [
        (declaration.what, declaration.before, declaration.after)
        for declaration in found.declarations
        if "enum" in declaration.what
    ] == [("enumeration `status`", "executing, done", "done, failed, executing")]
    assert part(found, "grip").changes == ()
    changed = differ(
        GRIP, edited(GRIP, ("{ executing, done }", "{ done, executing }"), ("| 1     |", "| 3     |"))
    )
    assert regions(part(changed, "grip").changes) == {
        ("line `held`", "line `held`", ("reported = done", "width <= 4"))
    }


def test_a_variable_of_another_kind_cannot_be_compared() -> None:
    in_mm = [
        (f"input {name} : int 0 .. 9", f"input {name} : int 0 .. 9 [mm]") for name in ("width", "wanted")
    ]
    found = differ(GRIP, edited(GRIP, *in_mm))
    assert found.changed
    assert part(found, "grip").notes == ("cannot be compared: `wanted`, `width` changed its kind",)
    assert part(found, "grip").basis is None


def test_a_wider_range_is_a_changed_declaration_and_compares_where_both_have_values() -> None:
    found = differ(GRIP, edited(GRIP, ("input width : int 0 .. 9", "input width : int 0 .. 12")))
    assert [declaration.what for declaration in found.declarations] == ["variable `width`"]
    assert part(found, "grip").changes == ()
    assert part(found, "grip").basis is Basis.SOLVER


def test_a_table_and_a_level_that_are_new_or_gone_are_said() -> None:
    more = GRIP + "table other {\n  | line | width ||\n  |------|-------||\n  | all  |       ||\n}\n"
    assert part(differ(GRIP, more), "other").notes == ("new",)
    assert part(differ(more, GRIP), "other").notes == ("gone",)


# --- conditions that are not defined everywhere ----------------------------------------------------------

PARTLY = """
state a : int 0 .. 3
state b : int 0 .. 3
state n : int 0 .. 3{until}
{what}
table t {{
  | line | a      ||
  | l    | 0 .. 3 ||
}}
"""
CONDITIONS = (
    "a < 3",
    "a < 3 or 3 / b > 3",
    "a < 3 or 3 / b > 0",
    "a < 3 and 3 / b >= 0",
    "b = 0 and a < 3 or a * 3 / b < 9 and a < 3",
    "not (b = 0 implies 1 / b > 0) or a < 3",
)
WHERE_ASKED = ("assume c monitored : ", "invariant c : ", "property c : ", "deferred until ")


@pytest.mark.parametrize("where", WHERE_ASKED)
def test_a_condition_that_becomes_undefined_changed(where: str) -> None:
    for pair in combinations(CONDITIONS, 2):
        deferred = where.startswith("deferred")
        texts = [
            PARTLY.format(until=f" {where}{one}" if deferred else "", what="" if deferred else where + one)
            for one in pair
        ]
        sides = [program_of(text) for text in texts]
        worths = [worth(side, where.split(maxsplit=1)[0]) for side in sides]
        expected = {(one, two) for one, two in zip(*worths, strict=True) if one != two}
        found = differ(*texts)
        changed = [change for part in found.parts for change in part.changes if part.what != "table"]
        assert {(change.before, change.after) for change in changed} == expected, pair
        for change in changed:
            point = dict(change.point)
            at = 4 * int(point["a"]) + int(point["b"])
            assert (worths[0][at], worths[1][at]) == (change.before, change.after), pair


def worth(side: Program, what: str) -> list[str]:
    """What the condition is for every `a` and, within it, every `b`."""
    made = side.assumptions or side.invariants or side.properties
    until = next((v.deferred_until for v in side.variables if v.deferred_until is not None), None)
    condition = made[0].condition if made else until
    assert condition is not None

    def at(a: int, b: int) -> str:
        try:
            return str(bool(evaluate(condition, {"a": a, "b": b, "n": 0}))).lower()
        except ZeroDivisionError:
            return "false" if what == "property" else "undefined"

    return [at(a, b) for a, b in product(range(4), repeat=2)]


# --- extern procedures --------------------------------------------------------------------------------

EXTERN = edited(
    GRIP,
    (
        "procedure look { near := width >= wanted }",
        'extern procedure ask reads wanted writes near python "nowhere:ask" c "ask"\nprocedure look { seen := true; ask }',
    ),
    ("output order", "state seen : bool\noutput order"),
)


def test_an_extern_procedure_is_taken_to_answer_the_same_to_the_same() -> None:
    found = differ(EXTERN, edited(EXTERN, ("seen := true; ask", "seen := not false; ask; near := near")))
    assert not found.changed
    assert part(found, "grip").basis is Basis.SOLVER
    other = differ(EXTERN, edited(EXTERN, ("; ask }", "; ask; near := not near }")))
    assert [v.leaf for v in part(other, "grip").changes[0].values] == ["near"]


@pytest.mark.parametrize("back", [False, True])
def test_an_extern_procedure_that_takes_more_is_called_otherwise(back: bool) -> None:
    more = edited(EXTERN, ("ask reads", "ask(k : int 0 .. 9) reads"), ("; ask }", "; ask(1) }"))
    found = differ(more, EXTERN) if back else differ(EXTERN, more)
    [change] = part(found, "grip").changes
    assert "extern calls" in [v.leaf for v in change.values]


@pytest.mark.parametrize("back", [False, True])
def test_what_is_written_before_an_extern_call_is_seen_since_the_cycle_may_end_there(back: bool) -> None:
    """Whichever of the versions writes it."""
    before, after = EXTERN, edited(EXTERN, ("seen := true; ask", "ask; seen := true"))
    found = differ(after, before) if back else differ(before, after)
    [change] = part(found, "grip").changes
    assert [v.leaf for v in change.values] == ["extern calls"]


# --- levels ---------------------------------------------------------------------------------------------

SMALL = edited(
    WALKER,
    ("procedure sense { seen := go }\n", "procedure sense { seen := go }\nprocedure send { }\n"),
    ("table walk }", "table walk  postprocess send }"),
)
LEVEL = edited(
    SMALL,
    ("echo : int 0 .. 2", "echo : int 0 .. 9"),
    ("sent : int 0 .. 2", "sent : int 0 .. 9"),
    ("next at := where  sent := (sent + 1) mod 3 }", "next at := where }"),
    ("procedure send { }", "procedure send { sent := echo }"),
    ("| at     | seen  ||", "| at     | go    ||"),
)


def test_new_steps_of_a_state_graph_come_with_the_shortest_trace() -> None:
    found = differ(LEVEL, edited(LEVEL, ("|| to(end)    |", "|| to(start)  |")))
    [traces] = found.traces
    assert [(t.before, t.after, t.trace) for t in traces.new] == [
        ("middle", "start", (("start", "off"), ("middle", "on"), ("start", "")))
    ]
    assert [(t.before, t.after) for t in traces.gone] == [("middle", "end")]
    assert traces.new[0].by == ("table `walk`, line `on`",)
    assert dict(traces.new[0].witness) == {"go": "true", "at": "middle"}


def test_a_level_is_compared_by_what_runs_around_its_table() -> None:
    found = differ(
        LEVEL, edited(LEVEL, ("seen := go", "seen := not go"), ("period 40 [ms]", "period 20 [ms]"))
    )
    assert part(found, "walker", "preprocess").changes
    assert part(found, "walker", "postprocess").basis is Basis.DIGEST
    assert part(found, "walker", "level").notes == ("period: 40 ms, now 20 ms",)
    assert part(found, "walk").basis is Basis.DIGEST


def test_a_deferral_that_ends_otherwise_is_a_changed_condition() -> None:
    found = differ(LEVEL, edited(LEVEL, ("deferred until echo = sent", "deferred until echo >= sent")))
    [change] = part(found, "at", "deferred value").changes
    assert (change.before, change.after) == ("false", "true")


# --- from the state in which a level stands ---------------------------------------------------------

EDITS: dict[str, tuple[tuple[str, str], ...]] = {
    "a step": (("to(end)    |", "to(start)  |"),),
    "members numbered anew": (
        ("{ start, middle, end }", "{ end, start, middle }"),
        ("to(end)    |", "to(start)  |"),
    ),
    "when it is taken": (("deferred until echo = sent", "deferred until echo >= sent"),),
    "what it senses": (("{ seen := go }", "{ seen := go and echo = 2 }"),),
    "what it senses where": (("{ seen := go }", "{ seen := go and at = start }"),),
    "behind the table": (("procedure send { }", "procedure send { if at = end { sent := 0 } }"),),
    "another line, the same": (("| back |", "| home |"),),
    "a period": (("period 40 [ms]", "period 80 [ms]"),),
}


def states(made: Program) -> Iterator[dict[str, Value]]:
    """Every state, inputs as they are initially."""
    own = [v for v in made.variables if v.kind is not Kind.INPUT]
    kinds = [range(low, high + 1) for low, high in (key_bounds(v.type) for v in own)]
    for keys in product(*kinds):
        here = {str(v.name): value_of_key(v.type, key) for v, key in zip(own, keys, strict=True)}
        yield initial(made) | here


def shown_cycle(made: Program, words: dict[str, str]) -> dict[str, str]:
    """What a cycle leaves, in words, as another version may number members otherwise."""
    kinds = {str(v.name): v.type for v in made.variables}
    now = {
        name: kind.members.index(words[name]) if isinstance(kind, Enum) else parsed(kind, words[name])
        for name, kind in kinds.items()
    }
    left = cycle(made, made.levels[0], now).snapshot
    return {name: spell(kind, left[name]) for name, kind in kinds.items()}


def parsed(kind: Scalar, word: str) -> Value:
    return word == "true" if isinstance(kind, Bool) else int(word)


@pytest.mark.parametrize("edits", EDITS.values(), ids=EDITS)
def test_out_of_reach_is_where_no_input_makes_a_difference(edits: tuple[tuple[str, str], ...]) -> None:
    before, after = program_of(SMALL), program_of(edited(SMALL, *edits))
    found = compare("case", before, after, Options())
    kinds = {str(v.name): v.type for v in after.variables}
    taken = [v for v in after.variables if v.kind is Kind.INPUT]
    differs = reached = 0
    for state in states(after):
        met = within_reach(found, after, after.levels[0], state, Options())
        said = {name: spell(kind, state[name]) for name, kind in kinds.items()}
        other = False
        for keys in product(*(range(key_bounds(v.type)[1] + 1) for v in taken)):
            given = {
                str(v.name): spell(v.type, value_of_key(v.type, k)) for v, k in zip(taken, keys, strict=True)
            }
            other |= shown_cycle(before, said | given) != shown_cycle(after, said | given)
        assert met or not other, said
        differs += other
        reached += bool(met)
    parts = {compared.what for compared in found.parts if compared.changed}
    if parts == {"table"}:
        assert 0 < differs == reached < 54  # a region that is reached makes a difference
    assert bool(reached) == found.changed


def test_a_region_that_boxes_do_not_say_counts_as_met() -> None:
    after = program_of(edited(LEVEL, ("|| to(end)    |", "|| to(start)  |")))
    found = compare("case", program_of(LEVEL), after, Options())
    level, [table, *_] = after.levels[0], found.parts
    [change] = table.changes
    for where, met in ((change.where, False), (replace(change.where, exact=False), True)):
        difference = replace(found, parts=(replace(table, changes=(replace(change, where=where),)),))
        assert bool(within_reach(difference, after, level, initial(after), Options())) is met


def test_a_state_is_known_where_some_line_is_for_it() -> None:
    made = program_of(
        edited(
            LEVEL,
            ("  | back | end    |       || to(start)  |\n", ""),
            (
                "| rest | /= end | false ||            |\n",
                "| rest | /= end | false || |\n  | lost | DEFAULT | || |\n",
            ),
        )
    )
    table = made.tables[0]
    assert [knows(made, table, "at", value, Options()) for value in range(3)] == [True, True, False]
    narrow = program_of(
        edited(LEVEL, ("table walk {", "assume early monitored : at /= end\ntable walk assuming early {"))
    )
    assert [knows(narrow, narrow.tables[0], "at", value, Options()) for value in range(3)] == [
        True,
        True,
        False,
    ]


def walked(made: Program) -> set[tuple[str, str]]:
    """Pairs of lines in successive cycles, by trying everything; at first nothing is under way."""
    pairs = set()
    level, taken = made.levels[0], [v for v in made.variables if v.kind is Kind.INPUT]
    every = [
        {str(v.name): value_of_key(v.type, key) for v, key in zip(taken, keys, strict=True)}
        for keys in product(*(range(key_bounds(v.type)[1] + 1) for v in taken))
    ]
    for state in states(made):
        if state["at"] == state["at.next"]:
            for one in every:
                first = cycle(made, level, state | one)
                pairs |= {
                    (str(first.line), str(cycle(made, level, first.snapshot | two).line)) for two in every
                }
    return pairs


@pytest.mark.parametrize("edits", EDITS.values(), ids=EDITS)
def test_lines_that_can_newly_follow_are_those_that_do(edits: tuple[tuple[str, str], ...]) -> None:
    text = edited(SMALL, *edits)
    before, after = program_of(SMALL), program_of(text)
    found = compare("case", before, after, Options(), follow=True)
    names = {"back": "home"} if "| home |" in text else {}
    one = {(names.get(a, a), names.get(b, b)) for a, b in walked(before)}
    two = walked(after)
    assert {pair for follows in found.follows for pair in follows.new} == two - one
    assert {pair for follows in found.follows for pair in follows.gone} == one - two


def test_a_question_without_an_answer_leaves_the_steps_open(monkeypatch: pytest.MonkeyPatch) -> None:
    def unanswered(*_: object) -> None:
        raise UndecidedError

    monkeypatch.setattr("rcsc.views.diff.changes.cycles.following", unanswered)
    found = compare(
        "case",
        program_of(LEVEL),
        program_of(edited(LEVEL, ("to(end)    |", "to(start)  |"))),
        Options(),
        follow=True,
    )
    [follows] = found.follows
    assert (follows.new, follows.gone, follows.decided) == ((), (), False)
    assert "which line can follow which was not decided" in plain(rows(Difference("a", "b", (found,))))


# --- the command ------------------------------------------------------------------------------------------


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.rcs").write_text(GRIP, encoding="utf-8")
    (tmp_path / "b.rcs").write_text(edited(GRIP, ("| 1     |", "| 3     |")), encoding="utf-8")
    return tmp_path


def git(*args: str) -> None:
    subprocess.run(
        ["git", "-c", "user.name=t", "-c", "user.email=t@t", "-c", "init.defaultBranch=main", *args],
        check=True, capture_output=True,
    )  # fmt: skip


def test_exit_statuses_same_changed_and_wrong(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert run(["diff", "a.rcs", "a.rcs"]) == 0
    assert "same meaning; 1 as before, proved" in capfd.readouterr().out
    assert run(["diff", "a.rcs", "b.rcs"]) == 1
    shown = capfd.readouterr().out
    assert "where  reported = done, width <= 4" in shown
    assert "order: 1 -> 3  [order]" in shown
    assert "proved: nothing else changed" in shown
    assert run(["diff", "a.rcs", "none.rcs"]) == 2
    assert "error[RCS781]" in capfd.readouterr().out
    assert run(["diff", "a.rcs"]) == 2
    (folder / "c.rcs").write_text("table {", encoding="utf-8")
    assert run(["diff", "a.rcs", "c.rcs"]) == 2
    assert "c.rcs:1" in capfd.readouterr().out


def test_json_and_markdown_say_the_same(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert folder.is_dir()
    assert run(["diff", "a.rcs", "b.rcs", "--json"]) == 1
    said = json.loads(capfd.readouterr().out)
    [table] = [one for one in said["programs"][0]["parts"] if one["what"] == "table"]
    assert table["changes"][0]["where"] == {
        "boxes": [["reported = done", "width <= 4"]], "exact": True, "also": "", "inputs": {"in": 5, "of": 20},
    }  # fmt: skip
    assert run(["diff", "a.rcs", "b.rcs", "--format", "markdown"]) == 1
    text = capfd.readouterr().out
    assert text.startswith("### rcsc diff: 1 table changed; 0 as before, proved\n")
    assert (
        "| line `held`: another effect | reported = done, width &lt;= 4 | `order`: 1 -> 3 | 5 of 20 inputs |"
        in text
    )
    assert text.count("<details>") == text.count("</details>") == 1


def test_a_property_changes_the_exit_status_in_every_form(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    one, two = tmp_path / "one.rcs", tmp_path / "two.rcs"
    one.write_text(COUNTED, encoding="utf-8")
    two.write_text(edited(COUNTED, ("count >= was count", "count > was count")), encoding="utf-8")
    for form, said in (
        ("text", "property `rises`  count >= was count -> count > was count\n    was true, is false"),
        ("json", '"count >= was count -> count > was count"'),
        ("markdown", "**property `rises`**: count >= was count -> count > was count"),
    ):
        assert run(["diff", str(one), str(two), "--format", form]) == 1
        assert said in capfd.readouterr().out
    two.write_text(edited(COUNTED, ("count >= was count", "was count <= count")), encoding="utf-8")
    assert run(["diff", str(one), str(two)]) == 0
    assert "property `rises`  proved: nothing changed" in capfd.readouterr().out


def test_the_command_shows_which_lines_can_follow_which(
    folder: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    (folder / "c.rcs").write_text(LEVEL, encoding="utf-8")
    (folder / "d.rcs").write_text(edited(LEVEL, ("|| to(end)    |", "|| to(start)  |")), encoding="utf-8")
    assert run(["diff", "c.rcs", "d.rcs"]) == 1
    assert "from line to line" not in capfd.readouterr().out
    assert run(["diff", "c.rcs", "d.rcs", "--follow"]) == 1
    assert (
        "  level `walker`, table `walk`: 1 step from line to line newly possible\n    on -> off\n"
        in capfd.readouterr().out
    )
    assert run(["diff", "c.rcs", "d.rcs", "--follow", "--format", "markdown"]) == 1
    assert "- on → off" in capfd.readouterr().out
    assert run(["diff", "c.rcs", "d.rcs", "--follow", "--json"]) == 1
    [follows] = json.loads(capfd.readouterr().out)["programs"][0]["follows"]
    assert follows["new"] == [["on", "off"]]
    assert follows["gone"] == [["on", "back"]]


def test_what_the_solver_gives_up_on_is_an_error(
    folder: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert folder.is_dir()
    monkeypatch.setattr(Solver, "check", lambda *_: Answer.UNKNOWN)
    assert run(["diff", "a.rcs", "b.rcs"]) == 2
    shown = capfd.readouterr().out
    assert "error[RCS409]: the solver gave up on table `grip`" in shown
    assert "proved" not in shown


def test_two_revisions_and_the_files_as_they_are(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    inner = folder / "cell"
    inner.mkdir()
    (inner / "rcsc.toml").write_text("", encoding="utf-8")
    (inner / "words.rcs").write_text(GRIP.split("input reported", maxsplit=1)[0], encoding="utf-8")
    rest = "use words\n" + "input reported" + GRIP.split("input reported")[1]
    (inner / "grip.rcs").write_text(rest, encoding="utf-8")
    git("init", "-q")
    git("add", ".")
    git("commit", "-qm", "one")
    (inner / "grip.rcs").write_text(edited(rest, ("| 1     |", "| 3     |")), encoding="utf-8")
    git("commit", "-qam", "two")
    (inner / "grip.rcs").write_text(edited(rest, ("| 2     |", "| 3     |")), encoding="utf-8")
    before = (inner / "grip.rcs").read_text(encoding="utf-8")
    assert run(["diff", "--rev", "HEAD~1..HEAD", "cell"]) == 1
    first = capfd.readouterr().out
    assert "HEAD~1 -> HEAD" in first
    assert "line `held`: another effect" in first
    assert "wide" not in first
    assert run(["diff", "HEAD~1:cell/grip.rcs", "cell/grip.rcs"]) == 1
    second = capfd.readouterr().out
    assert "line `wide`: another effect" in second
    assert "held" not in second
    assert run(["diff", "--rev", "HEAD", "cell"]) == 1
    third = capfd.readouterr().out
    assert "held" in third
    assert "wide" in third
    assert run(["diff", "--rev", "HEAD~1..HEAD~1"]) == 0
    assert run(["diff", "--rev", "nowhere"]) == 2
    assert "there is no revision `nowhere`" in capfd.readouterr().out
    assert (inner / "grip.rcs").read_text(encoding="utf-8") == before


def test_an_error_in_a_revision_names_the_revision(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (folder / "a.rcs").write_text("use nothing\n" + GRIP, encoding="utf-8")
    git("init", "-q")
    git("add", ".")
    git("commit", "-qm", "one")
    assert run(["diff", "HEAD:a.rcs", "b.rcs"]) == 2
    shown = capfd.readouterr().out
    assert "HEAD:a.rcs:1:1" in shown
    assert "rcsc-diff-" not in shown


# --- whatever differs is told, or proved to mean the same ------------------------------------

EVERYTHING = """
enum mode { idle, run }
unit tick
record pair {
  a : int 0 .. 9
  b : bool
}
input m : mode
input x : int 0 .. 9 clamp
input r : real 0.0 .. 2.0 [m]
input p : pair
state s : mode = idle deferred until x = 3
state n : int 0 .. 20 = 4
state k : array[2] of int 0 .. 5
output o : int 0 .. 9
output q : bool
assume low monitored : x <= 7
assume slow assumed : x <= 8 or n <= 3
invariant small : n <= 20
property kept : n <= 20
procedure count(by : int 0 .. 3) { if n + by <= 20 { n := n + by } next s := run }
extern procedure ask reads x writes k python "plant:ask" c "plant_ask"
module tidy reads x, r writes q { q := x in {1, 2} and r < 1.0 [m] }
owner hands { tidy }
table t assuming low, slow {
  | line | m    | x    || procedures | o |
  | a    | idle | <= 4 || count(2)   | 1 |
  | b    | idle | > 4  || ask        | 2 |
  | d    | DEFAULT |   || count(1)   | 3 |
}
table u {
  | line | x || o |
  | e | < 5  || 1 |
  | f | >= 5 || 2 |
  | z | DEFAULT unreachable || 2 |
}
level top {
  period 20 [ms]
  preprocess hands
  table by m { idle : t  run : u }
}
"""
WORDS = {"doc", "text", "box", "heading", "columns", "variables", "file", "stops"}
"""What is made from other fields, or said for people."""
RENAMED = (Line, Default, Level, Owner, Property, Invariant)


def otherwise(value: object, owner: object, name: str) -> Iterator[object]:
    """Other values for one field of the model, of its own type, one change each."""
    match value:
        case StrEnum():
            yield next(one for one in type(value) if one is not value)
        case bool():
            yield not value
        case int() | float():
            yield value + 1
        case str() if name in {"python", "c"} or (name == "name" and isinstance(owner, RENAMED)):
            yield f"{value}2"
        case tuple():
            yield from otherwise_made(value, owner, name)
        case Enum() if not isinstance(owner, Program):
            return  # it is declared elsewhere
        case _ if is_dataclass(value) and not isinstance(value, type):
            for field in fields(value):
                if field.compare and field.name not in WORDS:
                    for other in otherwise(getattr(value, field.name), value, field.name):
                        yield replace(value, **{field.name: other})
            if name in {"deferred_until", "default"}:
                yield None


def otherwise_made(value: tuple[object, ...], owner: object, name: str) -> Iterator[object]:
    """One member fewer, two in another order, or one of them otherwise."""
    if value:
        yield value[:-1]
    if len(value) > 1 and value[0] != value[1]:
        yield (value[1], value[0], *value[2:])
    for at, part in enumerate(value):
        yield from ((*value[:at], other, *value[at + 1 :]) for other in otherwise(part, owner, name))


def test_whatever_differs_is_told_or_proved_to_mean_the_same() -> None:
    whole = program_of(EVERYTHING)
    assert not compare("case", whole, whole, Options()).changed
    told: Counter[str] = Counter()
    for field in fields(Program):
        if field.name in {"name", "file", "own_tables", "instance"}:
            continue
        for value in otherwise(getattr(whole, field.name), whole, field.name):
            other = replace(whole, **{field.name: value})  # type: ignore[arg-type]  # of the field's own type
            try:
                found = compare("case", whole, other, Options(steps=2))
            except (LookupError, ValueError, TypeError, AttributeError, AssertionError):
                continue  # no program that `resolve` makes
            proved = any(part.basis is Basis.SOLVER or part.moved for part in found.parts)
            assert found.changed or found.undecided or proved, (field.name, value)
            told[field.name] += found.changed
    assert sum(told.values()) > 40, told


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("assuming low, slow", "assuming low"), "no longer assumes `slow`"),
        (("table u {", "table u assuming low {"), "assumes `low`, too"),
        (("assuming low, slow", "assuming slow, low"), "its assumptions stand in another order"),
        (("| z | DEFAULT unreachable", "| z | DEFAULT"), "its DEFAULT line: unreachable, now reachable"),
        (("  | z | DEFAULT unreachable || 2 |\n", ""), "its DEFAULT line: unreachable, now none"),
        (("assume low monitored", "assume low assumed"), "monitored, now assumed"),
        (("x : int 0 .. 9 clamp", "x : int 0 .. 9"), "input : int 0 .. 9 = 0 clamp -> input : int 0 .. 9 = 0 reject"),
        (("0 .. 20 = 4", "0 .. 20 = 5"), "state : int 0 .. 20 = 4 -> state : int 0 .. 20 = 5"),
        (('"plant:ask"', '"plant:tell"'), "line `b`: another effect"),
        (("by : int 0 .. 3", "by : int 0 .. 4"), "procedure `count`  declared otherwise"),
        (("until x = 3", "until x = 4"), "deferred value `s`"),
        (("invariant small : n <= 20", ""), "invariant `small`  gone"),
    ],
)  # fmt: skip
def test_what_no_region_shows_is_said(change: tuple[str, str], said: str) -> None:
    made = program_of(edited(EVERYTHING, change))
    found = compare("case", program_of(EVERYTHING), made, Options())
    assert found.changed
    assert said in plain(list(rows(Difference("a", "b", (found,)))))


STOPPED = """
input place : int 0 .. 20
state counts : array[8] of int 0 .. 9
state low : int 0 .. 9
assume near monitored : place < 8
assume odd monitored : place /= 4
procedure count { counts[place] := 9 }
table tally assuming near, odd {
  | line | place || procedures |
  | a    | < 4   || count      |
  | b    | >= 4  || count      |
}
table other assuming odd {
  | line | place || low |
  | a    |       || 1   |
}
"""


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("array[8] of", "array[21] of", "no longer stops"),
        ("counts[place] := 9", "counts[min(place, 7)] := 9", "no longer stops"),
        ("| >= 4  || count", "| >= 4  ||      ", "no longer stops"),
        ("place : int 0 .. 20", "place : int 0 .. 7", "no longer stops"),
        ("procedure count {", "invariant little : low < 9\nprocedure count {", ""),
        ("|| 1   |", "|| 2   |", ""),
    ],
)
def test_an_assumption_that_newly_stops_or_no_longer_does_is_said(old: str, new: str, said: str) -> None:
    before, after = program_of(STOPPED), program_of(edited(STOPPED, (old, new)))
    for one, two, word in ((before, after, said), (after, before, said.replace("no longer", "newly"))):
        found = compare("case", one, two, Options())
        assert (found.changed, found.undecided) == (True, ())
        text = plain(list(rows(Difference("a", "b", (found,)))))
        assert text.count(f"`near` {word} the cycle where it fails") == bool(word)
        assert "`odd` n" not in text


def test_what_a_role_or_a_restart_declares_otherwise_is_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("a", "b"):
        shutil.copytree(
            REPO / "tests/data/protocol", tmp_path / name, ignore=shutil.ignore_patterns(".rcsc-cache")
        )
    path = tmp_path / "b" / "supervisor.rcs"
    text = path.read_text(encoding="utf-8")
    changed = text.replace("restart bad", "restart rest").replace(
        "within 25 cycles else drive_silent", "within 25 cycles else blocked"
    )
    assert changed.count("restart rest") == changed.count("else blocked") == 1
    path.write_text(changed, encoding="utf-8")
    run(["diff", str(tmp_path / "a" / "supervisor.rcs"), str(path)])
    said = capsys.readouterr().out
    assert "`now`" in said
    assert "restart" in said


def test_what_masks_of_wide_words_change_is_known_in_few_steps() -> None:
    """Which lines other inputs reach was one question of 20,000,000 steps and a minute, where a mask was sixty remainders."""
    masks = (
        "0bx1x0x1x1xx1xxx01xxx1xx0xx1xx1xxxxxx1xxx0x1xx110xxxxx0xx1101xxxxx",
        "0b0x0xxx0xxx001xx1xx00x0xx1xxx1001xx0xx010x10xxxx00x1xx0xxx01xxx1x",
    )
    declared = (
        "input a : bool\ninput b : int 0 .. 18446744073709551615\nstate p : bool\noutput o : int 0 .. 9\n"
    )
    rows = (
        f"| n0 | {masks[0]} | CELL | false || 1 |\n| n1 | {masks[1]} | | false || 0 |\n"
        "| n2 | | was a or a | || 1 |\n| n3 | | | true || 0 |\n"
    )
    before, after = (
        f"{declared}table t {{\n| line | b[63..0] | when | a || o |\n{rows.replace('CELL', cell)}}}\n"
        for cell in ("a", "")
    )
    with smt.together(10_000_000) as budget:
        found = differ(before, after)
    assert budget.left > 5_000_000
    assert part(found, "t").changes
