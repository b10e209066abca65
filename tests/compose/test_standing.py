"""What `rcsc check` says of the levels together: only what was proved, of this very content, and nothing else."""

import json
import re
import shutil
from collections.abc import Callable
from importlib import resources
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from rcsc.base.host.cache import FOLDER, Cache, open_cache
from rcsc.base.host.files.plain import plain, read
from rcsc.compose.contract.predicates import Predicate
from rcsc.compose.invariant.cubes import as_condition
from rcsc.compose.proof.standing import KnownSystem, KnownVerdict, SystemOutline, standing
from rcsc.driver import outline, requirements
from rcsc.front.commands import run
from rcsc.lang.interpret import initial, run_table
from rcsc.lang.model import Apply, Bool, Op, Read, VariableName
from tests.support.programs.stages import program_of
from tests.support.programs.systems import HOPED, small_system, small_text, solo_system
from tests.support.programs.texts import edit_file, level, table

KEPT = "assuming in_step (proved), kept by the levels together, system.toml"
DECIDES = "are not proved of the levels together: `rcsc prove system.toml` decides them"
DONE = "| 4    | false       | d_state   |       ||                | done       |"

Said = Callable[..., str]


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The small system, stood in."""
    monkeypatch.delenv("RCSC_CACHE_DIR", raising=False)
    small_system(tmp_path)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def proved_here(here: Path, small_proved: Path) -> Path:
    """The small system, stood in, after `rcsc prove`; what a test edits then is not proved yet."""
    shutil.copytree(small_proved / FOLDER, here / FOLDER)
    return here


@pytest.fixture
def check(capfd: pytest.CaptureFixture[str]) -> Said:
    """`rcsc check` with these arguments, of `upper.rcs` where there are none; what it prints."""

    def said(*args: str, status: int = 0) -> str:
        capfd.readouterr()
        assert run(["check", *(args or ("upper.rcs",))]) == status
        return capfd.readouterr().out

    return said


def prove(*args: str) -> int:
    return run(["prove", "system.toml", "--trace", "0", *args])


NEVER_TOLD_TO_STOP = """\
enum phase { off, on }
input stop : bool
state now : phase
output works : bool
assume stops_what_works assumed : stop implies works
table work assuming stops_what_works {
  | line  | now | stop  || now | works |
  |-------|-----|-------||-----|-------|
  | begin | off | false || on  | true  |
  | goes  | on  | false ||     |       |
  | end   | on  | true  || off | false |
}
level machine { period 10 [ms] table work }
"""


def test_what_was_proved_together_is_told_with_what_to_write(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """Alone the table has a gap that no cycle comes to: with the invariant that `rcsc prove` prints it is proved alone, too."""
    monkeypatch.delenv("RCSC_CACHE_DIR", raising=False)
    monkeypatch.chdir(tmp_path)
    table = tmp_path / "machine.rcs"
    table.write_text(NEVER_TOLD_TO_STOP, encoding="utf-8")
    wires = '[buffers]\n"a.stop" = "machine.stop"\n"machine.works" = "a.works"\n'
    head = 'name = "s"\ngenerated = "generated"\ntick_ms = 10\n[[level]]\nname = "machine"\n'
    (tmp_path / "system.toml").write_text(head + wires, encoding="utf-8")
    assert run(["check", "machine.rcs"]) == 1
    assert "comes in system.toml: proved" not in capfd.readouterr().out
    assert prove("--invariants") == 0
    [said] = [
        line for line in capfd.readouterr().out.splitlines() if line.startswith("  invariant of_machine : ")
    ]
    assert run(["check", "machine.rcs"]) == 1
    out = capfd.readouterr().out
    assert "none comes in system.toml: proved of the levels together" in out
    assert "`rcsc prove system.toml --level machine --invariants`" in out
    table.write_text(f"{NEVER_TOLD_TO_STOP}{said.strip()}\n", encoding="utf-8")
    assert run(["check", "machine.rcs"]) == 0


COUNTS_AND_LOOKS_BACK = """\
input go : bool
state left : int 0 .. 100
output quick : bool
property quick_counts : quick implies left > 0
property rises : was left <= left or left = 0
table count {
  | line  | go    | left  || left     | quick |
  |-------|-------|-------||----------|-------|
  | first | true  | 0     || 1        | true  |
  | more  | true  | 1..99 || left + 1 | true  |
  | full  | true  | 100   ||          | true  |
  | off   | false |       || 0        | false |
}
level machine { period 10 [ms] table count }
"""


def test_the_invariant_that_is_printed_is_in_the_language_and_speaks_of_what_is_declared(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "machine.rcs").write_text(COUNTS_AND_LOOKS_BACK, encoding="utf-8")
    head = 'name = "s"\ngenerated = "generated"\ntick_ms = 10\n[[level]]\nname = "machine"\n'
    (tmp_path / "system.toml").write_text(
        f'{head}[buffers]\n"a.go" = "machine.go"\n"machine.quick" = "a.quick"\n', encoding="utf-8"
    )
    assert prove("--invariants") == 0
    out = capfd.readouterr().out
    [said] = [line for line in out.splitlines() if line.startswith("  invariant of_machine : ")]
    assert "left = 0" in said or "left > 0" in said
    assert "(>" not in out
    assert "was_" not in said
    (tmp_path / "machine.rcs").write_text(f"{COUNTS_AND_LOOKS_BACK}{said.strip()}\n", encoding="utf-8")
    assert run(["check", "machine.rcs"]) == 0


def reported_table(form: str, name: str = "work") -> dict[str, Any]:
    found: dict[str, Any] = next(one for one in json.loads(form)["tables"] if one["table"] == name)
    return found


# --- what is proved, and of what ---------------------------------------------------------------


@pytest.mark.usefixtures("here")
def test_an_assumption_is_proved_where_the_levels_together_are(check: Said) -> None:
    before = check()
    assert "assuming in_step (monitored), " in before
    assert before.count(DECIDES) == 1
    assert prove() == 0
    assert KEPT in check()
    assert DECIDES not in check()
    assert KEPT in check()  # from what the last check kept
    form = check("--json", "upper.rcs")
    assert reported_table(form)["assumptions"] == [{"name": "in_step", "standing": "proved"}]
    assert reported_table(form)["together"]["proved"] == ["in_step"]
    assert json.loads(form)["systems"] == [
        {"system": "system.toml", "standing": "proved", "wanted": False, "missing": []}
    ]
    properties = json.loads(check("--sarif", "upper.rcs"))["runs"][0]["properties"]
    assert properties["tables"][0]["assumptions"] == [{"name": "in_step", "standing": "proved"}]


@pytest.mark.usefixtures("proved_here")
@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("upper", "|| nextstate(d_state)      | pause       | done       |", "|| nextstate(d_state)      | pause       | executing  |"),
        ("lower", DONE, DONE.replace("done     ", "executing")),
        ("system", '"upper.to_lower" = "lower.command"', '"upper.to_lower" = "hand.command"'),
        ("words", "enum stage { d_state,", "enum stage { spare, d_state,"),
    ],
    ids=["a cell", "a cell of a neighbour", "the buffers", "a file that is used"],
)  # fmt: skip
def test_a_proof_is_of_its_content_alone(check: Said, name: str, old: str, new: str) -> None:
    assert KEPT in check()
    path = Path("system.toml" if name == "system" else f"{name}.rcs")
    kept = path.read_text(encoding="utf-8")
    edit_file(path, (old, new))
    if name == "system":
        edit_file(path, ('"lower.report" = "upper.lower"', '"hand.report" = "upper.lower"'))
    changed = check()
    assert "assuming in_step (monitored), " in changed
    assert changed.count(DECIDES) == 1
    path.write_text(kept, encoding="utf-8")
    assert KEPT in check()


@pytest.mark.usefixtures("proved_here")
def test_words_that_mean_nothing_leave_a_proof_as_it_is(check: Said) -> None:
    edit_file(Path("lower.rcs"), ("table go {", "# Another word.\n\ntable go {"))
    assert KEPT in check()


def test_a_proof_holds_wherever_the_files_stand(
    here: Path, check: Said, small_proved: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("RCSC_CACHE_DIR", str(shutil.copytree(small_proved / FOLDER, here / "cache")))
    moved = here / "moved"
    moved.mkdir()
    for file in ("system.toml", "upper.rcs", "lower.rcs", "words.rcs"):
        shutil.move(here / file, moved / file)
    assert KEPT.replace("system.toml", "moved/system.toml") in check("moved/upper.rcs")
    assert f"kept by the levels together, {moved}/system.toml" in check(str(moved / "upper.rcs"))


@pytest.mark.usefixtures("here")
def test_one_level_alone_is_not_the_levels_together(check: Said) -> None:
    assert prove("--level", "upper") == 0
    assert DECIDES in check()
    assert prove("--level", "lower") == 0
    assert KEPT in check()


@pytest.mark.usefixtures("proved_here")
def test_no_cache_and_no_levels_say_nothing(check: Said, tmp_path: Path) -> None:
    assert "in_step (monitored)" in check("--no-cache", "upper.rcs")
    assert DECIDES not in check("--no-cache", "upper.rcs")
    (tmp_path / "other").mkdir()
    Path("other/alone.rcs").write_text(small_text("upper", ("level upper", "level alone")), encoding="utf-8")
    shutil.copy("words.rcs", "other/words.rcs")
    beside = check("other/alone.rcs")  # below a system that has no such level
    assert "in_step (monitored)" in beside
    assert "rcsc prove" not in beside


@pytest.mark.usefixtures("proved_here")
def test_an_unchanged_system_is_not_read_again(check: Said, monkeypatch: pytest.MonkeyPatch) -> None:
    assert KEPT in check()

    def never(_: Path) -> None:
        raise AssertionError

    monkeypatch.setattr(outline, "_read", never)
    assert KEPT in check()
    edit_file(Path("lower.rcs"), (DONE, DONE.replace("done     ", "executing")))
    assert run(["check", "upper.rcs"]) == 3  # it would have been


@pytest.mark.usefixtures("here")
def test_a_variant_of_the_tables_is_not_kept(check: Said) -> None:
    assert prove("--first-match") == 0
    assert KEPT not in check()


# --- what is not proved -----------------------------------------------------------------------


@pytest.mark.usefixtures("proved_here")
def test_what_was_found_not_to_be_proved_is_a_warning(check: Said) -> None:
    Path("upper.rcs").write_text(HOPED, encoding="utf-8")
    assert prove() == 1
    said = check()
    assert (
        "warning[RCS751]: level `upper` is not proved together with its neighbours in system.toml\n"
        "   --> upper.rcs:"
    ) in said
    assert "= note: not proved: table `work`: assumption `never_failed`" in said
    assert "never_failed (monitored, not proved of the levels together)" in said
    assert "in_step (proved)" in said
    form = check("--json", "upper.rcs")
    assert json.loads(form)["systems"][0]["standing"] == "not proved"
    assert reported_table(form)["together"]["not_proved"] == ["never_failed"]
    assert "::warning file=upper.rcs," in check("--github", "upper.rcs")
    assert "RCS751" not in check("lower.rcs")  # another level's


@pytest.mark.usefixtures("proved_here")
def test_nothing_is_proved_of_levels_that_do_not_agree(check: Said) -> None:
    """The lower level echoes what it does not run: the proof of the upper one rests on that it does not."""
    edit_file(
        Path("lower.rcs"),
        ("report.ref_command_echo := command.input_command", "report.ref_command_echo := pause"),
    )
    assert prove() == 1
    said = check()
    assert (
        "in_step (monitored, conditional of the levels together), conditional in system.toml: rests on"
        in said
    )
    assert "level `lower`: the report echoes the command that it answers `report`" in said
    form = json.loads(check("--json", "upper.rcs"))
    assert reported_table(json.dumps(form))["together"]["conditional"] == ["in_step"]
    assert form["systems"][0] | {"missing": []} == {
        "system": "system.toml", "standing": "not proved", "wanted": False, "missing": [],
    }  # fmt: skip
    assert "error" not in said.splitlines()[0]
    assert (
        "warning[RCS752]: level `upper` assumes that what `lower` reports under the number of the last"
        in said
    )
    assert "warning[RCS751]: level `lower` is not proved" in check("lower.rcs")


@pytest.mark.usefixtures("here")
def test_what_the_tables_declare_is_not_called_proved_and_is_named_by_what_rests_on_it(check: Said) -> None:
    """What is assumed of an input is as true as somebody believes it, however much the levels prove from it."""
    one_level(
        "input x : int 0 .. 9\nstate n : int 0 .. 9\nassume small assumed : x < 5\nassume kept monitored : n < 5\n"
        "property below : n < 5\n",
        table("t", "line | x | n || n", "a | 0 .. 4 | < 5 || x", assuming="small, kept"),
    )
    assert prove() == 0
    said = check("solo.rcs")
    trusting = "system.toml, trusting assumption `small` of level `solo`"
    assert f"assuming small (assumed), kept (proved), kept by the levels together, {trusting}, " in said
    assert f"= note: proved of the levels together, {trusting}" in said
    found = reported_table(check("--json", "solo.rcs"), "t")
    assert found["together"]["proved"] == ["kept"]
    assert found["together"]["trusts"] == ["assumption `small` of level `solo`"]


@pytest.mark.usefixtures("here")
def test_lines_that_never_run_because_of_what_is_declared_say_so(
    check: Said, capfd: pytest.CaptureFixture[str]
) -> None:
    one_level(
        "input x : int 0 .. 9\nassume small assumed : x < 5\n",
        table("t", "line | x ||", "a | < 5 ||", "b | >= 5 ||", assuming="small"),
    )
    assert prove() == 0
    trusting = "trusting assumption `small` of level `solo`"
    assert f"lines never reached here:\n    t b: proved, {trusting}\n" in capfd.readouterr().out
    assert f"line b never reached in system.toml, {trusting}, " in check("solo.rcs")


@pytest.mark.usefixtures("here")
def test_what_rests_on_what_is_not_proved_is_conditional_and_says_on_what(check: Said) -> None:
    """Every verdict of a level whose index is safe only under an invariant that does not hold within the cycle."""
    one_level(
        "input x : bool\nstate at : int 0 .. 9\nstate n : int 0 .. 9\nstate list : array[3] of bool\n"
        "invariant inside : at < 3\nassume fine monitored : n < 9\nproperty stays : n < 9\n"
        "procedure mark { list[at] := x }\nmodule spoil writes at { at := 5 }\nmodule mend writes at { at := 0 }\n",
        table(
            "t",
            "line | x | n || procedures",
            "a | true | < 9 || mark",
            "b | false | < 9 || ",
            assuming="fine",
        ),
        "spoil",
        "mend",
    )
    assert prove() == 1
    said = check("solo.rcs", status=1)
    rests = "rests on every operation is defined and in range within a cycle"
    assert (
        f"fine (monitored, conditional of the levels together), conditional in system.toml: {rests}" in said
    )
    assert f"= note: conditional in system.toml: {rests}" in said


@pytest.mark.usefixtures("here")
def test_what_was_not_looked_at_is_named(check: Said) -> None:
    for name in ("lower", "upper"):
        renamed = small_text(name).replace("new_command", "fresh")
        Path(f"{name}.rcs").write_text(renamed, encoding="utf-8")
    assert prove() == 0
    assert prove("--strict") == 1
    said = check()
    missing = "level `upper`: not looked at: a command number is taken up once: there is no state `new_command : bool`"
    assert f"system.toml is proved as far as it was looked at: {missing}; " in said
    assert " and 1 more\n" in said
    assert DECIDES not in said
    form = check("--json", "upper.rcs")
    assert missing in json.loads(form)["systems"][0]["missing"]
    schema = json.loads(
        resources.files("rcsc.base.diagnostics").joinpath("schema/report.schema.json").read_text()
    )
    jsonschema.validate(json.loads(form), schema, jsonschema.Draft202012Validator)


def one_level(declared: str, rows: str, before: str = "", after: str = "") -> None:
    """A system of one level without neighbours, by its declarations and its table `t`."""
    solo_system(Path(), f"{declared}{rows}{level('solo', before=before, after=after)}")


# --- properties ---------------------------------------------------------------------------------


@pytest.mark.usefixtures("proved_here")
@pytest.mark.parametrize(
    ("words", "proved"), [("status_report in {done, executing, failed}", True), ("begun", False)]
)
def test_properties_that_the_levels_keep_are_said_to_be_proved(check: Said, words: str, proved: bool) -> None:
    edit_file(Path("upper.rcs"), ("level upper {", f"property stated : {words}\nlevel upper {{"))
    note = "= note: proved of the levels together, system.toml"
    help_ = "= help: `rcsc prove` proves what a level does"
    before = check()
    assert (note in before, help_ in before) == (False, True)
    assert prove() == (0 if proved else 1)
    said = check()
    assert (note in said, help_ in said) == (proved, not proved)
    assert "property `stated` is not proved here" in said
    assert ("= note: not proved: property `stated`" in said) is not proved
    edit_file(Path("upper.rcs"), (f"stated : {words}", f"stated : {words} and begun = begun"))
    assert note not in check()


@pytest.mark.usefixtures("proved_here")
@pytest.mark.parametrize(
    "edits",
    [
        {"words": ("record lower_report {\n  inc_command_echo : number", "record lower_report {\n  echo : number")},
        {"words": ("record lower_order {\n  inc_command : number", "record lower_order {\n  number : number")},
        {"system": ('"lower.report" = "upper.lower"', '"lower.report" = "upper.nothing"')},
        {"system": ("[buffers]", "[buffers")},
        {"lower": ("table go {", "table gone {")},
    ],
)  # fmt: skip
def test_a_system_that_is_not_in_order_does_not_stop_a_check(edits: dict[str, tuple[str, str]]) -> None:
    for name, edit in edits.items():
        edit_file(Path("system.toml" if name == "system" else f"{name}.rcs"), edit)
    assert run(["check", "upper.rcs", "lower.rcs"]) in {0, 1}


# --- lines that never run ------------------------------------------------------------------------


def with_tries(text: str) -> str:
    """A variable that is always 0, and a line that wants it to be: by itself the table sends the rest to DEFAULT."""
    above, work = text.split("table work", 1)
    work, below = work.split("}", 1)
    cells = {"line": " tries ", "----": "---", "3   ": " 0 "}

    def widened(row: str) -> str:
        if not row.startswith("  |"):
            return row
        first, name, test, rest = row.split("|", 3)
        return "|".join((first, name, test, cells.get(name[1:5], "   "), rest))

    rows = "\n".join(map(widened, work.split("\n")))
    above = above.replace(
        "state begun", "state tries : int 0 .. 3\nproperty untried : tries = 0\nstate begun"
    )
    return f"{above}table work{rows}}}{below}".replace("DEFAULT unreachable", "DEFAULT")


@pytest.mark.usefixtures("proved_here")
def test_a_default_that_no_run_of_the_system_reaches_is_said_to_be_so(check: Said) -> None:
    path = Path("upper.rcs")
    path.write_text(with_tries(path.read_text(encoding="utf-8")), encoding="utf-8")
    assert "note[RCS407]" in check()
    assert "none of them comes" not in check()
    assert prove() == 0
    assert "= note: none of them comes in system.toml: proved of the levels together" in check()
    assert "line 7 never reached in system.toml" in check()
    assert reported_table(check("--json", "upper.rcs"))["together"]["unreached"] == ["7"]


# --- what follows from what -------------------------------------------------------------------


def test_an_outline_comes_back_as_it_was(here: Path) -> None:
    found = outline._read(here / "system.toml")
    assert found is not None
    made = outline.outline(found[0])
    assert standing_of(made).of_level("upper") is KnownVerdict.UNKNOWN
    assert read(SystemOutline, json.loads(json.dumps(plain(made)))) == made
    assert [one.name for one in made.levels] == ["upper", "lower"]
    assert {level for promise in made.assumed for level, _ in promise.needs} == {"upper", "lower"}


def standing_of(made: SystemOutline) -> KnownSystem:
    return standing(Cache(Path("nowhere"), b"secret", "tool"), made)


# --- facts about the environment ------------------------------------------------------------------


DOOR = "input at_left : bool\ninput at_right : bool\noutput closed : bool\nassume one_end {}: not (at_left and at_right)\n"
DOOR_LINES = (
    "line | at_left | at_right || closed",
    "l | true | || true",
    "r | | true || true",
    "m | false | false || false",
)


@pytest.mark.usefixtures("here")
@pytest.mark.parametrize(
    ("standing", "status", "told"),
    [
        ("", 0, []),
        ("assumed ", 0, []),
        ("assumed monitored ", 0, ["one_end"]),
        ("monitored ", 1, ["one_end"]),
    ],
)
def test_a_fact_about_inputs_is_trusted_where_assumed_and_watched_where_monitored(
    standing: str, status: int, told: list[str], check: Said, capfd: pytest.CaptureFixture[str]
) -> None:
    one_level(DOOR.format(standing), table("t", *DOOR_LINES, assuming="one_end"))
    assert prove() == status
    trusting = "trusting assumption `one_end` of level `solo`"
    said = capfd.readouterr().out
    assert (f"no two lines match: 1 of 1 proved, {trusting}\n" in said) == (not status)
    form = reported_table(check("--json", "solo.rcs"), "t")
    assert form["tells"] == told
    assert form["assumptions"] == [{"name": "one_end", "standing": standing.strip() or "assumed"}]
    program = program_of(Path("solo.rcs").read_text(encoding="utf-8"))
    both = {"at_left": True, "at_right": True, "closed": False}
    assert list(run_table(program, program.tables[0], both).failed_assumptions) == told
    assert run_table(program, program.tables[0], {**both, "at_left": False}).failed_assumptions == ()


@pytest.mark.usefixtures("here")
def test_executors_tell_where_a_fact_that_is_trusted_and_watched_fails(
    check: Said, capfd: pytest.CaptureFixture[str]
) -> None:
    """`rcsc test` compares what failed, too, in inputs for which the assumption does not hold."""
    one_level(
        DOOR.format("assumed monitored "),
        table(
            "t", "line | at_left || closed", "l | true || at_right", "r | false || true", assuming="one_end"
        ),
    )
    assert run(["test", "--examples", "5", "--mutants", "0", "--no-cortex", "solo.rcs"]) == 0
    assert "interpreter = Python = C" in capfd.readouterr().out
    assert "only tells where `one_end` fails" in check("solo.rcs")
    assert run(["compile", "--out", "made", "solo.rcs"]) == 0
    for file in ("made/c/solo.h", "made/python/solo.py"):
        assert "one_end: only told in t" in Path(file).read_text(encoding="utf-8")


@pytest.mark.usefixtures("here")
@pytest.mark.parametrize("facts", [("x > z", "z > x"), ("x + z > 18",), ("x > 4 and z = x + 5",)])
def test_facts_that_no_input_satisfies_prove_nothing(facts: tuple[str, ...], check: Said) -> None:
    declared = "".join(f"assume f{at} assumed : {fact}\n" for at, fact in enumerate(facts))
    names = ", ".join(f"f{at}" for at in range(len(facts)))
    one_level(
        f"input x : int 0 .. 9\ninput z : int 0 .. 9\n{declared}",
        table("t", "line | x ||", "a | > 3 ||", assuming=names),
    )
    assert "error[RCS405]" in check("solo.rcs", status=1)
    assert prove() == 1


@pytest.mark.usefixtures("here")
@pytest.mark.parametrize(
    ("fact", "status"),
    [
        ("x = was x + 12", 1),  # the first cycle takes 12, and the second nothing
        ("x = was x + 9 or x = 0", 0),
        ("x + was x = 12", 0),  # 12 and 0 in turn, for ever
        ("x /= was x and x < 12 and was o = 0", 1),
    ],
)
def test_a_fact_that_holds_in_one_cycle_and_in_none_after_it_proves_nothing(fact: str, status: int) -> None:
    one_level(
        f"input x : int 0 .. 19\noutput o : int 0 .. 9\nassume so assumed : {fact}\nproperty few : o <= 2\n",
        table("t", "line | x || o", "a | < 9 || 1", "b | >= 9 || 2", assuming="so"),
    )
    assert prove("--strict") == status


@pytest.mark.usefixtures("here")
@pytest.mark.parametrize(
    ("fact", "status"),
    [("new_command implies not there", 0), ("command.input_command = pause", 1), ("there and not there", 1)],
)
def test_a_fact_below_a_superior_is_believed_only_where_its_commands_leave_a_cycle_for_it(
    fact: str, status: int, capfd: pytest.CaptureFixture[str]
) -> None:
    """Alone the second can hold; of a table that runs under another command, it cannot."""
    edit_file(Path("lower.rcs"), ("table go {", f"assume so assumed : {fact}\ntable go assuming so {{"))
    assert prove() == status
    said = capfd.readouterr().out
    assert ("so                       assumed, as the tables declare it" in said) == (not status)
    assert ("proved, trusting assumption `so` of level `lower`" in said) == (not status)


@pytest.mark.usefixtures("here")
def test_a_fact_about_change_is_believed_from_one_cycle_to_the_next(
    capfd: pytest.CaptureFixture[str],
) -> None:
    """A rate of change carries a property that is false without it; the executors watch it."""
    declared = (
        "input x : int 0 .. 9\noutput fast : bool\nassume slow assumed monitored : abs(x - was x) <= 2\n"
        "property smooth : not fast\nproperty slow_itself : x - was x <= {0}\n"
    )

    def written(most: int) -> None:
        rows = "line | x - was x || fast", "a | -2 .. 0 || false", f"b | 1 .. 2 || x - was x > {most}"
        one_level(declared.format(most), table("t", *rows, assuming="slow"))

    written(2)
    assert prove() == 0
    said = capfd.readouterr().out
    trusting = "proved, trusting assumption `slow` of level `solo`"
    assert re.search(rf"property +smooth +{trusting}\n", said)
    assert f"no two lines match: 1 of 1 {trusting}\n" in said
    written(1)
    assert prove() == 1
    assert "not proved: property `smooth`" in "".join(capfd.readouterr())
    program = program_of(Path("solo.rcs").read_text(encoding="utf-8"))
    jump = {**initial(program), "x": 3}
    assert run_table(program, program.tables[0], jump).failed_assumptions == ("slow",)
    assert run_table(program, program.tables[0], {**jump, "x": 2}).failed_assumptions == ()


def test_a_condition_of_two_parts_stays_one_beside_others_in_what_is_printed() -> None:
    """`a or b` beside `c` is not `a or b and c`."""
    read = {name: Read(VariableName(name), Bool()) for name in "abc"}
    either = Predicate("a or b", Bool(), condition=Apply(Op.OR, (read["a"], read["b"]), Bool()))
    chosen, nameable = (either, Predicate("c", Bool())), frozenset("abc")
    assert as_condition(chosen, [((0, 1), (1, 1))], nameable) == "not ((a or b) and c = true)"
    assert as_condition(chosen, [((0, 0), (1, 1))], nameable) == "not (not (a or b) and c = true)"


def test_a_claim_is_refuted_until_any_level_changes(tmp_path: Path) -> None:
    """The run that breaks it is one that the neighbours can make as they are; until `prove` shows one it is open."""
    folder = tmp_path / "cart"
    assert run(["new", str(folder), "--template", "system"]) == 0
    with (folder / "axis.rcs").open("a", encoding="utf-8") as file:
        file.write("\nrequirement stands : always speed_mm_s = 0 [mm/s]\n")

    def state() -> str:
        cache = open_cache(folder)
        every = requirements.known_requirements(requirements.read(folder / "system.toml", cache), cache)
        return next(one.state for one in every if one.stated.name == "stands")

    assert state() == "unknown"
    assert run(["prove", str(folder), "--trace", "0"]) == 1
    assert state() == "open"
    assert run(["prove", str(folder)]) == 1
    assert state() == "refuted"
    edit_file(folder / "supervisor.rcs", ("move(target_mm := 0)", "move(target_mm := 1)"))
    assert state() in {"open", "unknown"}
