"""One output that several levels and parties read."""

from pathlib import Path

import pytest

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic
from rcsc.compose.proof.system import prove_transition_systems, transition_systems
from rcsc.driver.compile import compile_system
from rcsc.run.description import BadDescription, Wire, description
from rcsc.run.link.drawn_script import drawing, script
from rcsc.run.log.schema import outside_wires
from rcsc.run.orders.script import outside_buffers
from rcsc.run.plant.bind import buffers_of
from rcsc.run.system import assemble, check_fit, signatures
from tests.link.played import CSystem, by_python, first_difference
from tests.support.programs.texts import edit_file

ESTOP = '"base.estop" = ["lead.estop", "left.estop", "right.estop"]'
READERS = ("lead.estop", "left.estop", "right.estop")
TELL = """input heard : int 0 .. 9
output said : int 0 .. 9
table t {
  | line | heard || said  |
  | low  | < 5   || heard |
  | high | >= 5  || 5     |
}
level NAME { table t }
"""


def write(folder: Path, buffers: str, **texts: str) -> Path:
    """Write a system of levels with these tables."""
    for name, text in texts.items():
        (folder / f"{name}.rcs").write_text(text.replace("NAME", name), encoding="utf-8")
    levels = "".join(f'[[level]]\nname = "{name}"\n' for name in texts)
    path = folder / "system.toml"
    path.write_text(
        f'name = "s"\ngenerated = "g"\ntick_ms = 40\n{levels}[buffers]\n{buffers}\n', encoding="utf-8"
    )
    return path


def refused(path: Path) -> list[tuple[str, str]]:
    """What is wrong with a description, and the text at its place."""
    with pytest.raises(BadDescription) as raised:
        description(path)
    return [
        (one.message, raised.value.sources[one.primary.span.file].slice(one.primary.span))
        for one in raised.value.diagnostics
    ]


def test_a_buffer_has_a_reader_for_each_element_of_its_list(axes: Path) -> None:
    system = description(axes)
    assert system.readers()["base.estop"] == READERS
    assert [system.taken_by(level.name).count("base.estop") for level in system.levels] == [1, 1, 1]
    place = system.review().span(system.place_of(Wire("base.estop", "left.estop")))
    assert system.review().source.slice(place) == '"left.estop"'


def test_a_list_of_one_says_what_the_name_alone_says(axes: Path) -> None:
    wires = description(axes).wires
    edit_file(axes, ('= "left.position_mm"', '= ["left.position_mm"]'))
    assert description(axes).wires == wires


def test_a_plant_of_a_model_is_bound_to_any_reader_and_to_the_one_output(axes: Path) -> None:
    edit_file(
        axes,
        ('"left.speed_mm_s" = "base.left_speed"', '"left.speed_mm_s" = ["base.left_speed", "base.shown"]'),
    )
    text = axes.read_text(encoding="utf-8").partition("[plant]")[0]
    model = """[plant.mujoco]
model = "two.xml"
sensors = { "base.estop" = { value = false } }
actuators = { "base.left_speed" = { actuator = "left" }, "base.shown" = { ignore = true } }
"""
    axes.write_text(text + model, encoding="utf-8")
    assert [spec.name for spec in description(axes).plants] == ["mujoco"]
    axes.write_text(text + model.replace("base.shown", "base.showed"), encoding="utf-8")
    [(message, _)] = refused(axes)
    assert "`base.showed` is no end of a buffer that goes outside" in message


@pytest.mark.parametrize(
    ("row", "wrong", "at"),
    [
        (ESTOP.replace('"right', '"left'), "`left.estop` is named twice", '"left.estop"'),
        (f'{ESTOP}\n"base.off" = ["left.estop"]', "`left.estop` is filled twice", '"left.estop"'),
        (ESTOP.replace("right.estop", "left.other"), "level `left` would read `base.estop` twice", '"left.other"'),
        (ESTOP.replace("right.", "Right."), "neither end of `base.estop` and `Right.estop` is a level", '"Right.estop"'),
        (f'{ESTOP}\n"lead.to_left" = ["left.lead", "spy.x"]', "`lead.to_left` is one end of what `lead` and `left`", '"spy.x"'),
        (f'{ESTOP}\n"left.to_lead" = ["lead.from_left", "spy.x"]', "would be read by several", '"spy.x"'),
        (f'{ESTOP}\n"hmi.order" = ["lead.person", "spy.x"]', "would be read by several", '"spy.x"'),
        ('"base.estop" = []', "a list of at least 1 elements", '"base.estop" = []'),
    ],
)  # fmt: skip
def test_what_cannot_be_read_by_several_is_told_at_the_reader(
    axes: Path, row: str, wrong: str, at: str
) -> None:
    edit_file(axes, (ESTOP, row))
    assert any(wrong in message and place == at for message, place in refused(axes)), refused(axes)


def test_orders_by_hand_have_one_reader_too(tmp_path: Path) -> None:
    order = "record o { inc_command : int 0 .. 9  input_command : int 0 .. 9 }\ninput o : o\n"
    path = write(tmp_path, '"p.order" = ["a.o", "b.o"]', a=order + TELL, b=order + TELL)
    [found] = misfits(path)
    assert "would be read by several" in found.message
    with pytest.raises(BadDescription, match="would be read by several"):
        transition_systems(path)


def misfits(path: Path) -> tuple[Diagnostic, ...]:
    """What of a system does not fit its programs."""
    with pytest.raises(BadDescription) as raised:
        compile_system(path)
    assert {one.code for one in raised.value.diagnostics} == {Code.BAD_SYSTEM}
    return raised.value.diagnostics


@pytest.mark.parametrize(
    ("one", "other", "differs"),
    [
        ("int 0 .. 9", "int 0 .. 8", "from 0 to 9 against `heard` from 0 to 8"),
        ("int 0 .. 9", "real 0.0 .. 9.0", "other types"),
        ("int 0 .. 9", "int 0 .. 9 = 3", "begins with 0, `heard` with 3"),
        ("int 0 .. 9", "int 0 .. 9", ""),
    ],
)
def test_who_reads_one_buffer_from_outside_declares_it_alike(
    tmp_path: Path, one: str, other: str, differs: str
) -> None:
    text = TELL.replace("said : int 0 .. 9", "said : int 0 .. 5").replace("|| heard |", "|| 0     |")
    texts = {name: text.replace("int 0 .. 9", kind) for name, kind in (("a", one), ("b", other))}
    if "real" in other:
        texts["b"] = texts["b"].replace("< 5 ", "< 5.0").replace(">= 5 ", ">= 5.0")
    path = write(tmp_path, '"p.x" = ["a.heard", "b.heard"]', **texts)
    if not differs:
        assert not compile_system(path).report.failed
        return
    [found] = misfits(path)
    assert differs in found.message


def test_each_reader_may_rest_on_what_the_writer_is_proved_to_keep(tmp_path: Path) -> None:
    """The writer says at most 5: that is owed to each reader that assumes it, and broken for each where it says 6."""
    reader = "assume small : heard <= LIMIT\n" + TELL.replace("table t {", "table t assuming small {")
    texts = {"w": TELL, "a": reader.replace("LIMIT", "5"), "b": reader.replace("LIMIT", "4")}
    path = write(tmp_path, '"p.x" = "w.heard"\n"w.said" = ["a.heard", "b.heard", "p.y"]', **texts)
    systems = transition_systems(path)
    assert [one.name for one in systems["w"].links.owes] == ["a.small", "b.small"]
    proof = prove_transition_systems(systems, None, 1, ("w",))
    verdicts = {
        owed.name: verdict.value for owed, verdict in proof.levels[0].verdicts if owed.name.endswith("small")
    }
    assert verdicts["a.small"] == "proved"
    assert verdicts["b.small"] != "proved"


def test_what_levels_give_each_reader_admits(tmp_path: Path) -> None:
    narrow = TELL.replace("heard : int 0 .. 9", "heard : int 0 .. 5")
    path = write(tmp_path, '"w.said" = ["a.heard", "b.heard"]', w=TELL, a=TELL, b=narrow)
    with pytest.raises(BadDescription, match=r"`b.heard` does not admit all that is given"):
        transition_systems(path)


def test_in_c_all_readers_share_one_place_and_see_what_they_see_in_python(tmp_path: Path) -> None:
    """To a level and itself, to a level and a party, and from outside to two levels."""
    more = TELL.replace("input heard", "input other : int 0 .. 9\ninput heard")
    path = write(
        tmp_path, '"p.x" = ["a.other", "b.other"]\n"a.said" = ["a.heard", "b.heard", "p.y"]', a=more, b=more
    )
    assert not compile_system(path).report.failed
    header = (tmp_path / "g/c/s.h").read_text(encoding="utf-8")
    assert header.count("/* p.x = a.other, b.other;") == 1
    assert header.count("/* a.said = a.heard, b.heard;") == 1
    assert header.count("/* a.said = p.y;") == 1
    system = description(path)
    signs = signatures(system)
    ticks = script(system, signs, drawing(3), 100)
    assert first_difference(by_python(system, ticks), CSystem(system, signs, tmp_path).play(ticks)) == ""


def test_what_stands_outside_writes_and_scripts_and_logs_have_it_once(tmp_path: Path) -> None:
    path = write(tmp_path, '"p.x" = ["a.heard", "b.heard"]', a=TELL, b=TELL)
    assert not compile_system(path).report.failed
    system = description(path)
    signs = signatures(system)
    check_fit(system, signs)
    assert [buffer.name for buffer in outside_buffers(system, signs)] == ["p.x"]
    assert outside_wires(system) == (Wire("p.x", "a.heard"),)
    assert [buffer.end for buffer in buffers_of(system, signs, ("p",))] == ["p.x"]
    running = assemble(system, "python", {})
    running.buffers.publish("p.x", (4,))
    running.step()
    assert [level.value("heard") for level in running.levels] == [4, 4]
