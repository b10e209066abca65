"""One file of tables run as several levels, with constants of their own."""

import shutil
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

import pytest

from rcsc.base.diagnostics.source import Span
from rcsc.compose.proof.candidates import content
from rcsc.compose.proof.system import NoProgramError, transition_systems
from rcsc.driver.compile import compile_, compile_system, with_programs
from rcsc.driver.outline import outline
from rcsc.driver.pipeline import proved
from rcsc.driver.settings import Settings
from rcsc.front.commands import run as rcsc
from rcsc.lang.model import Int, Program
from rcsc.lang.project import Instance, InstanceParameter, again, load
from rcsc.lang.resolve import resolve
from rcsc.proof.solvers.options import Options
from rcsc.run.description import BadDescription, description
from rcsc.run.log.schema import system_facts, system_of
from tests.support.programs.texts import edit_file

FAST = "parameters = { fast = 500, late = 100 }"
TEXT = """unit bar
enum mode { slow, quick }
enum other { slow, never }
const limit = 5 [bar]
const low = -5
const share = 0.5
const on = true
const way = mode.quick
const double = limit * 2
input heard : int 0 .. 9 [bar]
output said : int 0 .. 2 * limit
table t {
  | line | heard    || said  |
  | low  | < limit  || 0 [bar] |
  | high | >= limit || double |
}
level one { table t }
"""
NOWHERE = Span("system.toml", 0, 0)
TEMPLATE = Path(__file__).parents[2] / "rcsc/front/commands/templates/system"


def instance(
    folder: Path, text: str = TEXT, values: Mapping[str, bool | int | float | str] = MappingProxyType({})
) -> Program | list[str]:
    """Resolve an instance of a text; its messages where it is none."""
    file = folder / "one.rcs"
    file.write_text(text, encoding="utf-8")
    parameters = tuple(InstanceParameter(name, value, NOWHERE) for name, value in values.items())
    loaded = again(str(file), Instance(str(file), "two", parameters, NOWHERE))
    program = resolve(loaded.roots[0], loaded)
    if isinstance(program, Program):
        return program
    assert all(one.primary.span.file == "system.toml" for one in program), program
    return [one.message for one in program]


def test_an_instance_has_its_name_and_what_is_computed_from_its_constants(tmp_path: Path) -> None:
    program = instance(tmp_path, values={"limit": 7})
    assert isinstance(program, Program)
    assert (program.name, [level.name for level in program.levels]) == ("two", ["two"])
    assert program.variable("said").type == Int(0, 14, (("bar", 1),))
    declared = instance(tmp_path)
    assert isinstance(declared, Program)
    assert declared.variable("said").type == Int(0, 10, (("bar", 1),))
    plain = load([str(tmp_path / "one.rcs")])
    own = resolve(plain.roots[0], plain)
    assert isinstance(own, Program)
    assert (own.name, own.levels[0].name, own.variables) == ("one", "one", declared.variables)


@pytest.mark.parametrize(
    ("values", "wrong"),
    [
        ({"limit": 4, "low": -3, "share": 1, "on": False, "way": "slow"}, ""),
        ({"low": 3, "share": -0.25}, ""),
        ({"limt": 4}, "the tables of level `two` declare no constant `limt`"),
        ({"heard": 4}, "declare no constant `heard`"),
        ({"limit": True}, "constant `limit` is a whole number, not `true`"),
        ({"limit": 4.0}, "constant `limit` is a whole number, not `4.0`"),
        ({"limit": "slow"}, "constant `limit` is a whole number, not `slow`"),
        ({"on": 1}, "constant `on` is true or false, not `1`"),
        ({"share": "slow"}, "constant `share` is a real number"),
        ({"share": float("nan")}, "constant `share` is a real number"),
        ({"share": True}, "constant `share` is a real number"),
        ({"way": "never"}, "constant `way` is one of quick, slow, not `never`"),
        ({"way": 1}, "constant `way` is one of quick, slow, not `1`"),
        ({"double": 4}, "constant `double` is not written as one value"),
        ({"limit": -1}, "level `two`: the range 0 .. -2 is empty"),
        ({"limit": 2**64}, "no 64-bit integer holds this number"),
    ],
)
def test_a_constant_takes_a_value_of_its_own_sort(
    tmp_path: Path, values: dict[str, bool | int | float | str], wrong: str
) -> None:
    made = instance(tmp_path, values=values)
    assert isinstance(made, Program) if not wrong else isinstance(made, list) and wrong in " ".join(made), (
        made
    )


def test_the_parameter_that_brings_it_is_blamed(tmp_path: Path) -> None:
    (tmp_path / "one.rcs").write_text(TEXT, encoding="utf-8")
    places = [Span("system.toml", at, at + 1) for at in range(3)]
    parameters = (InstanceParameter("low", 1, places[1]), InstanceParameter("limit", -1, places[2]))
    loaded = again(
        str(tmp_path / "one.rcs"), Instance(str(tmp_path / "one.rcs"), "two", parameters, places[0])
    )
    found = resolve(loaded.roots[0], loaded)
    assert not isinstance(found, Program)
    assert {one.primary.span for one in found} == {places[2]}
    assert found[0].related[0].span.file.endswith("one.rcs")


@pytest.mark.parametrize(
    ("text", "wrong"),
    [
        (TEXT.replace("level one", "level a { table t }\nlevel b"), "none becomes level `two`"),
        (TEXT.replace("level one { table t }", ""), "declares no level"),
        (TEXT.replace("table t", "table two"), "`two` is declared twice"),
        (TEXT.replace("level one", "level a { table t }\nlevel one"), ""),
        (TEXT.replace("level one", "level a { table t }\nlevel two"), ""),
    ],
)
def test_one_level_takes_the_name(tmp_path: Path, text: str, wrong: str) -> None:
    made = instance(tmp_path, text)
    if wrong:
        assert isinstance(made, list)
        assert wrong in made[0]
    else:
        assert isinstance(made, Program)
        assert "two" in [level.name for level in made.levels]


def test_a_record_that_other_programs_use_keeps_its_types(tmp_path: Path) -> None:
    shared = "const most = 9\nconst least = 0\ntype width = int 0 .. most\nrecord pair { a : int least .. most  b : bool }\n"
    (tmp_path / "words.rcs").write_text(shared, encoding="utf-8")
    text = """use words
input p : pair
input w : width
output q : bool
table t {
  | line | p.b   || q     |
  | x    | true  || true  |
  | y    | false || false |
}
level one { table t }
"""
    assert isinstance(instance(tmp_path, text), Program)
    wrong = instance(tmp_path, text, {"most": 8})
    assert isinstance(wrong, list)
    assert "would have another record `pair`" in wrong[0]
    (tmp_path / "words.rcs").write_text(shared.replace("least .. most", "0 .. 9"), encoding="utf-8")
    assert isinstance(instance(tmp_path, text, {"most": 8}), Program)  # a range without a name of its own


# --- the system ---


def test_instances_may_command_instances_where_rows_say_whom(tmp_path: Path) -> None:
    """The template's system twice, but for its plant: two supervisors, each with an axis."""
    shutil.copytree(TEMPLATE, tmp_path / "twice")
    path = tmp_path / "twice" / "system.toml"
    levels = {"s1": "supervisor", "s2": "supervisor", "a1": "axis", "a2": "axis"}
    rows = [
        f'"s{at}.to_axis" = "a{at}.supervisor"\n"a{at}.to_supervisor" = "s{at}.from_axis"\n'
        f'"person.job{at}" = "s{at}.person"\n"s{at}.to_person" = "person.done{at}"'
        for at in (1, 2)
    ]
    text = "".join(f'[[level]]\nname = "{name}"\ntables = "{of}"\n' for name, of in levels.items())
    head = 'name = "twice"\ngenerated = "g"\ntick_ms = 40\n'
    path.write_text(head + text + "[buffers]\n" + "\n".join(rows), encoding="utf-8")
    systems = transition_systems(path)
    assert [[one.name for one in ts.links.below] for ts in systems.values()] == [["a1"], ["a2"], [], []]
    assert [ts.links.above and ts.links.above.name for ts in systems.values()] == [
        "person",
        "person",
        "s1",
        "s2",
    ]


def test_a_file_that_is_run_as_instances_alone_is_no_program_of_its_folder(axes: Path) -> None:
    """Its declared values are proved, and nobody runs them; who asks for the file has it."""
    for paths, names in (
        ((str(axes.parent),), ["lead", "left", "right"]),
        ((str(axes.parent / "node.rcs"), str(axes)), ["lead", "left", "node", "right"]),
    ):
        project = proved(with_programs(Settings(paths, Options()), (axes,)))
        assert sorted(one.program.name for _, one in project.executable) == names
        assert len(project.proofs) == 4


def c_of(system: Path, level: str) -> str:
    return (system.parent / f"generated/c/{level}.c").read_text(encoding="utf-8")


def test_two_levels_of_one_file_are_programs_of_their_own(compiled: Path) -> None:
    python = (compiled.parent / "generated/python").glob("*.py")
    assert {path.name for path in python} == {"lead.py", "left.py", "right.py"}
    assert c_of(compiled, "left").startswith("/* generated by rcsc from node.rcs (left), do not edit */")
    assert "500" in c_of(compiled, "right")
    assert "500" not in c_of(compiled, "left")


@pytest.mark.thorough
def test_two_with_the_same_constants_differ_in_their_names_alone(compiled: Path) -> None:
    edit_file(compiled, (FAST, ""))
    assert not compile_system(compiled).report.failed
    left, right = c_of(compiled, "left"), c_of(compiled, "right")
    assert left.replace("left", "N").replace("LEFT", "N") == right.replace("right", "N").replace("RIGHT", "N")


def proofs_kept(axes: Path) -> dict[str, str]:
    return {name: content(ts) for name, ts in transition_systems(axes).items()}


def test_the_cache_tells_instances_apart(axes: Path) -> None:
    before = proofs_kept(axes)
    assert len(set(before.values())) == 3
    edit_file(axes, ("fast = 500", "fast = 400"))
    after = proofs_kept(axes)
    assert {name for name in before if before[name] != after[name]} == {"right"}
    edit_file(axes, (FAST.replace("500", "400"), "parameters = { fast = 300, late = 200 }"))
    declared = proofs_kept(axes)
    edit_file(axes, ("parameters = { fast = 300, late = 200 }", ""))
    assert proofs_kept(axes) == declared  # the same values, said or not


@pytest.mark.parametrize(
    "command",
    ["compile", *(pytest.param(name, marks=pytest.mark.thorough) for name in ("run", "test", "prove"))],
)
def test_no_verdict_on_the_declared_values_is_taken_for_an_instance(
    axes: Path, capsys: pytest.CaptureFixture[str], command: str
) -> None:
    """With the values of the file no input is left; with 7 nothing matches at 6."""
    node = axes.parent / "node.rcs"
    text = node.read_text(encoding="utf-8").replace("> 5            |", "> near         |")
    node.write_text(f"{text}\nconst near = 5 [mm]\n", encoding="utf-8")
    assert rcsc(["check", str(node)]) == 0
    edit_file(axes, (FAST, "parameters = { near = 7 }"))
    assert rcsc(["check", str(node)]) == 0
    more = ["--level", "right"] if command == "prove" else []
    assert rcsc([command, str(axes), *more]) == 1
    out, err = capsys.readouterr()
    said = out + err
    assert "| lead.target_mm | 6" in said or "table `move`: refuted: some line matches" in said
    assert ("closes the gap" if command == "prove" else "with near = 7") in said


def test_what_is_proved_of_other_constants_is_not_said_of_the_file(axes: Path) -> None:
    """`rcsc check` tells of the file's tables what is proved of a level that keeps the declared values."""
    levels = {level.name: level for level in outline(transition_systems(axes)).levels}
    assert [len(levels[name].tables) for name in ("lead", "left", "right")] == [2, 2, 0]
    assert [bool(levels[name].properties) for name in ("lead", "left", "right")] == [True, True, False]


@pytest.mark.parametrize(
    ("was", "now", "place"),
    [
        ("fast = 500", "fats = 500", "fats = 500"),
        ("fast = 500", "fast = 5000", "fast = 5000"),
        ("fast = 500", "fast = [5]", "fast = [5]"),
        (FAST, f'{FAST}\nprogram = "node"', 'program = "node"'),
        ("fast = 500", '"a b" = 500', '"a b" = 500'),
        ('"node"\nparameters', '"nod"\nparameters', 'name = "lead"'),
    ],
)
def test_what_does_not_fit_is_told_at_its_place_in_the_description(
    axes: Path, was: str, now: str, place: str
) -> None:
    edit_file(axes, (was, now))
    found = []
    try:
        report = compile_system(axes, only_check=True).report
        found = [report.sources[one.primary.span.file].slice(one.primary.span) for one in report.diagnostics]
    except BadDescription as error:
        found = [error.sources[one.primary.span.file].slice(one.primary.span) for one in error.diagnostics]
    assert place in found
    with pytest.raises((BadDescription, NoProgramError)):
        transition_systems(axes)


@pytest.mark.thorough
def test_an_instance_may_have_the_name_of_its_file(axes: Path) -> None:
    """Its program stands for the file's own, which the folder names, too."""
    for file in (axes, axes.parent / "lead.rcs", axes.parent / "base.py"):
        file.write_text(file.read_text(encoding="utf-8").replace("left", "node"), encoding="utf-8")
    edit_file(axes, ('name = "node"\ntables = "node"', 'name = "node"\nparameters = { late = 50 }'))
    asked = Settings((str(axes.parent),), Options())
    done = compile_(asked, axes.parent / "generated", ("c", "python"), only_check=False)
    assert not done.report.failed, done.report.diagnostics
    assert "50" in (axes.parent / "generated/python/node.py").read_text(encoding="utf-8")
    assert not compile_system(axes, only_check=True).report.failed


def test_a_log_says_of_which_tables_a_level_is_an_instance(axes: Path) -> None:
    system = description(axes)
    again_ = system_of(system_facts(system), system.generated, system.database)
    assert again_.levels == system.levels
    assert again_.levels[2].parameters == (("fast", 500), ("late", 100))
    assert (
        "tables"
        not in system_facts(description(axes.parents[0] / "system.toml"))["levels"].partition("left")[0]
    )


def test_two_descriptions_are_compared_level_by_level(axes: Path, capsys: pytest.CaptureFixture[str]) -> None:
    slow = axes.with_name("slow.toml")
    slow.write_text(axes.read_text(encoding="utf-8").replace("fast = 500", "fast = 400"), encoding="utf-8")
    assert rcsc(["diff", "-q", str(axes), str(slow)]) == 1
    said = capsys.readouterr().out
    assert "right" in said
    assert "speed_mm_s: 500 -> 400" in said
    assert "left" not in said
    assert rcsc(["diff", "-q", str(axes), str(axes)]) == 0


def log_of(system: Path, *how: str) -> bytes:
    """Run the script; return its log."""
    log = system.with_name("run.mcap")
    assert rcsc(["run", str(system), "-q", "--no-compile", *how, "--log", str(log)]) == 0
    return log.read_bytes()


def test_it_runs_alike_in_python_and_in_c_and_is_replayed(
    compiled: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Out and back, then the switch: both axes and their lead read the one buffer."""
    assert log_of(compiled, "--executor", "c") == log_of(compiled, "--executor", "python")
    capsys.readouterr()
    assert rcsc(["log", str(compiled.with_name("run.mcap"))]) == 0
    assert capsys.readouterr().out.count("switch: 1") == 2
    assert rcsc(["replay", str(compiled.with_name("run.mcap")), "--system", str(compiled)]) == 0


@pytest.mark.thorough
def test_in_processes_it_runs_as_in_one(compiled: Path) -> None:
    assert log_of(compiled, "--executor", "c") == log_of(compiled, "--processes", "--in-step")


def test_one_instance_is_started_again_and_reloaded_by_its_name(
    compiled: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    commands = compiled.with_name("commands.txt")
    commands.write_text(
        "freeze base.estop\nbuffers base.estop\nstep 2\nrestart right\nstep 2\nreload right\n",
        encoding="utf-8",
    )
    assert rcsc(["shell", str(compiled), "--no-compile", "--script", str(commands)]) == 0
    said = capsys.readouterr().out
    assert "base.estop = lead.estop, left.estop, right.estop: nothing yet, frozen" in said
    assert "level `right` is started again" in said
    assert "level `right` runs these very tables" in said
