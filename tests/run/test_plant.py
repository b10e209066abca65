"""Plants in Python: what fits is bound and moves the docking robot, and everything that does not fit is told before anything moves."""

import copy
import math
import shutil
import signal
import sys
from collections.abc import Callable, Mapping
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest

from rcsc.base.diagnostics.codes import Code
from rcsc.front.commands import run
from rcsc.run.description import BadDescription, description
from rcsc.run.levels import misfit
from rcsc.run.plant import Range, fields
from rcsc.run.plant.bind import BadPlant, BoundPlant, PlantFailed, bind
from rcsc.run.plant.load import _query as plant_query
from rcsc.run.plant.load import load
from rcsc.run.plant.units import factor
from rcsc.run.plant.values import BadValue, Misfit, link, shape
from rcsc.run.signature import Leaf, Values, signature
from rcsc.run.system import StateTableError, assemble, signatures
from tests.support.programs.texts import edited


def bound(folder: Path, plant: str | None = None) -> BoundPlant:
    """The plant of a docking robot's folder."""
    system = description(folder / "system.toml")
    [one] = load(system, signatures(system), plant).plants
    return one


def refused(folder: Path, *edits: tuple[str, str], plant: str | None = None) -> BadPlant:
    """What is wrong with the plant after these edits of `base.py`."""
    text = (folder / "base.py").read_text(encoding="utf-8")
    (folder / "base.py").write_text(edited(text, *edits), encoding="utf-8")
    with pytest.raises(BadPlant) as caught:
        bound(folder, plant)
    assert caught.value.code is Code.BAD_PLANT
    return caught.value


def nothing(_: str) -> Values | None:
    """No buffer holds anything."""
    return None


def holding(held: Mapping[str, Values]) -> Callable[[str], Values | None]:
    return held.get


# --- what fits ---


def test_fields_are_read_and_written_by_the_names_of_the_buffers(dock: Path) -> None:
    plant = bound(dock)
    given = plant.step(0, nothing)
    assert given == {
        "base.travelled": (0,),
        "base.lateral": (120,),
        "base.bumper": (False,),
        "base.beacon": (True,),
        "base.contact": (False,),
    }
    given = plant.step(1, holding({"drive.speed_mm_s": (100,)}))
    assert (plant.plant.speed, given["base.travelled"], given["base.lateral"]) == (100, (4,), (120,))
    assert plant.faults == ("wheel_slips",)
    plant.plant.wheel_slips = True
    assert plant.step(2, holding({"drive.speed_mm_s": (400,)}))["base.travelled"] == (4,)


def test_two_plants_of_one_class_share_nothing(dock: Path) -> None:
    first, second = bound(dock), bound(dock)
    first.step(0, holding({"drive.speed_mm_s": (800,)}))
    assert second.plant.travelled == 0.0


def test_a_field_without_a_value_starts_as_its_variable_does(dock: Path) -> None:
    text = (dock / "base.py").read_text(encoding="utf-8")
    changed = edited(
        text,
        ('lateral: Annotated[float, Range(-0.5, 0.5, "m")] = 0.12', "lateral: int"),
        ("speed: Annotated[int, Range(-1000, 1000)] = 0", "speed: float"),
    )
    (dock / "base.py").write_text(changed, encoding="utf-8")
    assert bound(dock).step(0, nothing)["base.lateral"] == (0,)


def test_a_reading_is_rounded_and_clamped_as_its_variable_says(dock: Path) -> None:
    plant = bound(dock)
    plant.plant.wheel_slips = True  # it stays where it is put
    for metres, millimetres in (
        (0.0004, 0),
        (0.0006, 1),
        (19.9996, 20_000),
        (77.0, 20_000),
        (-3.0, 0),
        (1e300, 20_000),
    ):
        plant.plant.travelled = metres
        assert plant.step(0, nothing)["base.travelled"] == (millimetres,)


def test_a_plant_in_a_file_of_the_command_line_takes_the_place_of_the_declared_one(dock: Path) -> None:
    text = (dock / "base.py").read_text(encoding="utf-8")
    (dock / "other.py").write_text(
        text.replace("class Base", "class Other").replace("0.12", "0.3"), encoding="utf-8"
    )
    for name in (f"{dock / 'other.py'}", f"{dock / 'other.py'}:Other"):
        assert bound(dock, name).plant.lateral == 0.3


def test_a_seed_goes_to_a_plant_that_takes_one(dock: Path) -> None:
    text = (dock / "base.py").read_text(encoding="utf-8")
    (dock / "base.py").write_text(
        text + "\n    def __init__(self, seed: int = 0) -> None:\n        self.seed = seed\n",
        encoding="utf-8",
    )
    system = description(dock / "system.toml")
    [plant] = load(system, signatures(system), seed=7).plants
    assert plant.plant.seed == 7


RECORDS = """
from dataclasses import dataclass
from enum import Enum
from typing import Literal


class dock_command(Enum):
    stop = 0
    dock = 1
    undock = 2


@dataclass
class Order:
    inc_command: int = 0
    input_command: Literal["stop", "dock", "undock"] = "stop"


@dataclass
class Report:
    inc_command_echo: int
    ref_command_echo: dock_command
    status_report: str
    reason: Literal["none", "no_beacon", "blocked", "drive_fault", "restarted", "more"]


class Fleet:
    order: Order = Order()
    report: Report

    def step(self, seconds: float) -> None:
        if self.report.ref_command_echo is dock_command.stop:
            self.order = Order(self.order.inc_command + 1, "dock")
"""


def test_records_and_enumerations_are_objects_and_words(dock: Path) -> None:
    system = (dock / "system.toml").read_text(encoding="utf-8")
    (dock / "fleet.py").write_text(RECORDS, encoding="utf-8")
    (dock / "system.toml").write_text(
        edited(system, ('python = "base.py"', 'python = "fleet.py:Fleet"\nparties = ["fleet"]')),
        encoding="utf-8",
    )
    plant = bound(dock)
    assert plant.step(0, nothing) == {"fleet.order": (1, 1)}
    given = plant.step(1, holding({"supervisor.report": (1, 1, 1, 3)}))
    assert given == {"fleet.order": (1, 1)}
    assert (plant.plant.report.status_report, plant.plant.report.reason) == ("executing", "drive_fault")
    assert plant.step(2, holding({"supervisor.report": (1, 0, 1, 3)})) == {"fleet.order": (2, 1)}


# --- what does not ---

SPEED = "speed: Annotated[int, Range(-1000, 1000)] = 0"
TRAVELLED = 'travelled: Annotated[float, Range(0, 20, "m")] = 0.0'
LATERAL = 'lateral: Annotated[float, Range(-0.5, 0.5, "m")] = 0.12'
METHOD = "def step(self, seconds: float) -> None:"
AS_VARIABLE = "and the variable is `int -500 .. 500 [mm]`"
LAST = "wheel_slips: Fault = False"
MISFITS = {
    "missing": (TRAVELLED, "traveled: float = 0.0", "class `Base` has no field `travelled`", "did you mean `traveled`?"),
    "bool": ("bumper: bool = False", "bumper: int = 0", "`bumper` of `Base` (base.py:49) is `int`, and the variable is `bool`",
             "declare it `bool`"),
    "number": (LATERAL, "lateral: bool = False", f"is `bool`, {AS_VARIABLE}", "declare it `int`"),
    "unit": (TRAVELLED, TRAVELLED.replace('"m"', '"s"'), "is in `s`, and the variable is in `mm`", ""),
    "no unit": (SPEED, 'speed: Annotated[float, Range(-1, 1, "m/s")] = 0', "and the variable has no unit", ""),
    "garbled unit": (TRAVELLED, TRAVELLED.replace('"m"', '"m per s"'), "`m per s` is no unit", ""),
    "whole in another unit": (TRAVELLED, TRAVELLED.replace("float", "int"), "a whole number in `m`", "declare it `float`"),
    "range": (SPEED, SPEED.replace("-1000", "0"), "takes 0 to 1000, and the variable holds -200 .. 800",
              "widen the field's range"),
    "no such type": (SPEED, "speed: bytes = b''", "`bytes` is no type of a field", ""),
    "annotation": (SPEED, "speed: 'Speed' = 0", "an annotation of class `Base` cannot be read", ""),
    "step": (METHOD, "def step(self) -> None:", "cannot be called with the seconds of a tick", "write `def step"),
    "no step": ("def step", "def stop", "no class with `step(self, seconds)`", ""),
    "constructor": (LAST, f"{LAST}\n\n    def __init__(self, mass: float) -> None: ...", "`Base()` failed: TypeError",
                    "without arguments"),
    "import": ("HELD_M = 0.655", "HELD_M = 0.655 +", "`base.py` cannot be imported: SyntaxError", ""),
    "name": ("HELD_M = 0.655", "HELD_M = FAST", "NameError: name 'FAST' is not defined (base.py, line 14)", ""),
    "exit": ("HELD_M = 0.655", "raise SystemExit", "cannot be imported: SystemExit", ""),
}  # fmt: skip


@pytest.mark.parametrize("what", list(MISFITS))
def test_what_does_not_fit_is_told_before_anything_moves(what: str, dock: Path) -> None:
    before, after, message, help_ = MISFITS[what]
    error = refused(dock, (before, after))
    [diagnostic] = error.diagnostics
    assert message in diagnostic.message
    assert any(help_ in said for said in diagnostic.help) or not help_
    source = error.sources[diagnostic.primary.span.file]
    line = source.text.splitlines()[source.position(diagnostic.primary.span.start).line - 1]
    assert '"base.' in line or '= "base.' in line or "plant" in line or "python" in line


def test_all_that_does_not_fit_is_told_at_once(dock: Path) -> None:
    error = refused(
        dock, ("bumper: bool", "bumper: int"), ("contact: bool", "contact: float"), (SPEED, "fast: int = 0")
    )
    assert len(error.diagnostics) == 3


def test_a_range_beyond_the_variables_is_refused_unless_the_variable_clamps() -> None:
    leaf = Leaf("x", "input", "x", "x", "uint8_t", (), 0, 200, "mm", 0, "")
    for clamp, beyond in ((False, 1), (True, 0)):
        misfits: list[Misfit] = []
        link(
            shape([replace(leaf, clamp=clamp)], "x"), fields.Number(True, Range(0, 201)), misfits, gives=True
        )
        assert len(misfits) == beyond


def test_members_must_be_the_variables(dock: Path) -> None:
    (dock / "fleet.py").write_text(
        RECORDS.replace('"stop", "dock", "undock"]', '"stop", "dok"]'), encoding="utf-8"
    )
    with pytest.raises(BadPlant) as caught:
        load_of_fleet(dock)
    assert "may be `dok`, which the variable has not" in str(caught.value)
    assert caught.value.diagnostics[0].help == ("did you mean `dock`?",)
    (dock / "fleet.py").write_text(
        RECORDS.replace(', "drive_fault"', "").replace("inc_command_echo: int", "inc_comand_echo: int"),
        encoding="utf-8",
    )
    with pytest.raises(BadPlant) as caught:
        load_of_fleet(dock)
    messages = str(caught.value)
    assert "has no `drive_fault`, which the variable may be" in messages
    assert "`report.inc_command_echo` of `Fleet`" in messages
    assert "is missing in class `Report`" in messages


def load_of_fleet(folder: Path) -> BoundPlant:
    """The plant of `fleet.py`, for the party `fleet`."""
    system = (folder / "system.toml").read_text(encoding="utf-8")
    if "parties" not in system:
        text = edited(system, ('python = "base.py"', 'python = "fleet.py:Fleet"\nparties = ["fleet"]'))
        (folder / "system.toml").write_text(text, encoding="utf-8")
    return bound(folder)


@pytest.mark.parametrize(
    ("plant", "message"),
    [
        ("mujocco", "the description has no plant `mujocco`"),
        ("no_such.py", "there is no file `no_such.py`"),
        ("base.py:Bas", "has no class `Bas`"),
    ],
)
def test_a_plant_that_is_not_there_is_told(
    plant: str, message: str, dock: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(dock)
    assert message in str(refused(dock, ("HELD_M = 0.655", "HELD_M = 0.656"), plant=plant))


DECLARED = {
    "outside the project": ('python = "base.py"', 'python = "../base.py"', "leads out of the project"),
    "unknown module": ('python = "base.py"', 'python = "no_such_module:Base"', "cannot be imported: No module named"),
    "unknown name": ('python = "base.py"', 'python = "rcsc.run.plant:Basis"', "has no attribute 'Basis'"),
    "party": ('python = "base.py"', 'python = "base.py"\nparties = ["bas"]', "no buffer has a party `bas` outside the levels"),
    "level as a party": ('python = "base.py"', 'python = "base.py"\nparties = ["drive"]', "no buffer has a party `drive` outside"),
}  # fmt: skip


@pytest.mark.parametrize("what", list(DECLARED))
def test_a_declared_plant_that_cannot_be_is_told(what: str, dock: Path) -> None:
    before, after, message = DECLARED[what]
    system = (dock / "system.toml").read_text(encoding="utf-8")
    (dock / "system.toml").write_text(edited(system, (before, after)), encoding="utf-8")
    with pytest.raises(BadPlant, match=message.replace("(", r"\(")):
        bound(dock)


KEYS = {
    "key": ('python = "base.py"', 'pithon = "base.py"', "`plant.pithon` means nothing here"),
    "text": ('python = "base.py"', "python = 3", "`plant.python` must be a text"),
    "named": ("[plant]", "[plant.sim]\npyton = 3\n[plant]", "`plant.sim` lacks `python`"),
    "model": ('python = "base.py"', 'model = "robot.xml"', "`[plant]` itself is in Python"),
    "sensor": ("[plant]", '[plant.a]\nmodel = "a.xml"\n[plant.a.sensors]\n"base.traveled" = { sensor = "x" }\n[plant]',
               "`base.traveled` is no end of a buffer that comes from outside"),
    "no table": ("[plant]", "plant = 3", "`plant` must be a table"),
}  # fmt: skip


@pytest.mark.parametrize("what", list(KEYS))
def test_the_keys_of_a_plant_are_checked_with_their_lines(what: str, dock: Path) -> None:
    before, after, message = KEYS[what]
    system = (dock / "system.toml").read_text(encoding="utf-8")
    if what == "no table":
        system = system.partition("[plant]")[0]
        before, after = "tick_ms", f"{after}\ntick_ms"
    text = edited(system, (before, after))
    (dock / "system.toml").write_text(text, encoding="utf-8")
    with pytest.raises(BadDescription) as caught:
        description(dock / "system.toml")
    assert any(message in one.message for one in caught.value.diagnostics), str(caught.value)


# --- what goes wrong while it runs ---


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("1 / 0", "the plant failed in cycle 3: ZeroDivisionError: division by zero (base.py, line 65)"),
        ("raise SystemExit(0)", "the plant failed in cycle 3: SystemExit: 0 (base.py, line 65)"),
        ("self.bumper = 2", "the plant's `bumper` is `2`, which is no bool, in cycle 3"),
        ("self.lateral = None", "the plant's `lateral` is `None`, which is no number, in cycle 3"),
        (
            "self.travelled = float('nan')",
            "the plant's `travelled` is nan, and `travelled_mm` is a whole number",
        ),
        ("del self.contact", "the plant's `contact`"),
        ("self.lateral = 10**400", "the plant's `lateral` is "),
        ("self.travelled = 10**5000", "the plant's `travelled` "),
        ("raise GeneratorExit", "the plant failed in cycle 3: GeneratorExit"),
        (
            "self.lateral = type('Odd', (), {'__repr__': lambda _: 1 / 0})()",
            "is `Odd, raising ZeroDivisionError`",
        ),
        (
            "type(self).bumper = property(lambda _: 1 / 0)",
            "the plant's `bumper` cannot be read: ZeroDivisionError",
        ),
        (
            "type(self).__setattr__ = lambda *_: 1 / 0; self.lateral = 1",
            "the plant failed in cycle 3: ZeroDivisionError",
        ),
    ],
)
def test_a_plant_that_fails_names_the_field_and_the_cycle(line: str, message: str, dock: Path) -> None:
    text = (dock / "base.py").read_text(encoding="utf-8")
    (dock / "base.py").write_text(
        f"{text.replace('contact: bool = False', 'contact: bool')}        {line}\n", encoding="utf-8"
    )
    with pytest.raises(PlantFailed) as caught:
        bound(dock).step(2, nothing)
    assert message in str(caught.value)


@pytest.mark.parametrize(
    "answer",
    ["5", "None", "'ab'", "[]", "[1, 2]", "[None]", "[10**400]", "['x']", "{}", "1 / 0", "sys.exit(3)"],
)
def test_an_answer_of_another_shape_than_was_asked_for_is_the_plant_s_failure(answer: str) -> None:
    """Of a feed's query, whenever it is asked."""

    class Plant:
        asked = 0

        def place(self, _: int) -> object:
            self.asked += 1
            return (1,) if self.asked == 1 else eval(answer)  # noqa: S307  # of this test

    query = plant_query(Plant(), "place")
    assert misfit("<i", query(0)) == ""
    failed = ""
    try:
        failed = misfit("<i", query(0))
    except PlantFailed as error:
        failed = str(error)
    assert failed


@pytest.mark.parametrize(
    "published",
    [5, None, [("a", (1,))], {"base.travelled": 5}, {"base.travelled": ("x",)}, {"base.lateral": (10**400,)}],
)
def test_what_stands_outside_publishes_buffers_and_values_or_is_told_apart(
    published: object, dock: Path
) -> None:
    class Outside:
        def step(self, _tick: int, _latest: object) -> Any:
            return published

    system = assemble(description(dock / "system.toml"), "python", {}, (Outside(),))
    with pytest.raises(StateTableError, match=r"outside published|cannot hold what was published"):
        system.step()


@pytest.mark.parametrize(
    "does",
    ["raise ValueError('boom')", "raise SystemExit(3)", "raise GeneratorExit", "return of()", "", "1 / 0"],
)
def test_an_extern_procedure_that_fails_is_told_as_such(
    does: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """In a cycle, or as its module is imported; with no status that is a bug's."""
    inside = does.startswith(("raise", "return"))
    code = f"def of(*_):\n    {does}\n" if inside else does or "import no_such_module_here"
    with_extern(tmp_path, code, monkeypatch)
    assert run(["run", str(tmp_path), "-q", "--executor", "python", "--cycles", "3"]) == 1
    said = capsys.readouterr().err
    assert (
        "error[RCS725]: level `l`: an extern procedure failed" if inside else "cannot be imported"
    ) in said
    assert "RCS9" not in said


def with_extern(folder: Path, code: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Write a system of one level whose extern procedure is `of` of a module with this code."""
    (folder / "t.rcs").write_text(
        'input n : int 0 .. 5\nstate s : int 0 .. 9\nextern procedure look reads n writes s python "failing_part:of" c "part_of"\n'
        "table t {\n| line | n || procedures |\n| a | 0 .. 5 || look |\n}\nlevel l { period 40 [ms]  table t }\n",
        encoding="utf-8",
    )
    text = 'name = "ext"\ntick_ms = 40\ngenerated = "generated"\n[[level]]\nname = "l"\nprogram = "t"\n[buffers]\n"outside.n" = "l.n"\n'
    (folder / "system.toml").write_text(text, encoding="utf-8")
    (folder / "failing_part.py").write_text(f"{code}\n", encoding="utf-8")
    monkeypatch.syspath_prepend(str(folder))
    monkeypatch.delitem(sys.modules, "failing_part", raising=False)


@pytest.mark.parametrize(
    "does", ["raise ValueError('boom')", "raise KeyError('boom')", "raise SystemExit(3)", "return of()"]
)
@pytest.mark.parametrize("command", ["replay", "step", "l-level", "look", "t"])
def test_an_extern_procedure_that_fails_fails_alike_whoever_calls_it(
    command: str,
    does: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """A log that is replayed, a shell that steps a level, runs it alone or a part of it: as a run does."""
    with_extern(tmp_path, "def of(*_): return 3", monkeypatch)
    log = tmp_path / "run.mcap"
    quick = [str(tmp_path), "--executor", "python"]
    assert run(["run", *quick, "-q", "--cycles", "3", "--log", str(log)]) == 0
    with_extern(tmp_path, f"def of(*_):\n    {does}", monkeypatch)
    (tmp_path / "script").write_text(f"{command}\n", encoding="utf-8")
    ask = (
        ["replay", str(log), "--system"]
        if command == "replay"
        else ["shell", "--script", str(tmp_path / "script")]
    )
    assert run([*ask, *quick]) == 1
    said = capsys.readouterr().err
    assert "error[RCS725]: " in said
    assert "an extern procedure" in said
    assert "failed: " in said
    assert "RCS9" not in said


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM"])
@pytest.mark.parametrize(
    ("place", "catches"), [("extern", False), ("plant", False), ("extern", True), ("plant", True)]
)
def test_who_ends_a_run_has_a_code_and_every_cycle_before(
    name: str,
    place: str,
    catches: bool,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """In an extern procedure or a plant that is waited for; where that catches it, with the cycle that came to its end so."""
    does = (
        "import signal\nclass Ends:\n    times = 0\n    def now(self):\n        self.times += 1\n        if self.times == 30:\n"
        f"            try: signal.raise_signal(signal.{name})\n            except BaseException:\n                if not {catches}: raise\n"
        "ends = Ends()\n"
    )
    with_extern(
        tmp_path,
        f"{does}def of(*_):\n    {'ends.now()' if place == 'extern' else ''}\n    return 3",
        monkeypatch,
    )
    step = "ends.now()" if place == "plant" else "pass"
    plant = (
        f"{does}class Cell:\n    n: int = 0\n    def step(self, seconds: float) -> None:\n        {step}\n"
    )
    (tmp_path / "cell.py").write_text(plant, encoding="utf-8")
    system = (tmp_path / "system.toml").read_text(encoding="utf-8").replace("outside.n", "cell.n")
    (tmp_path / "system.toml").write_text(
        f'{system}[plant.cell]\npython = "cell.py:Cell"\n', encoding="utf-8"
    )
    log = tmp_path / "run.mcap"
    before = signal.getsignal(signal.SIGTERM)
    assert (
        run(["run", str(tmp_path), "--executor", "python", "--cycles", "99", "-q", "--log", str(log)]) == 130
    )
    assert signal.getsignal(signal.SIGTERM) is before
    whole = 30 if catches else 29
    said = capsys.readouterr().err
    assert f"error[RCS724]: interrupted in cycle {whole + 1}; the log holds the {whole} before it" in said
    assert run(["replay", str(log), "--system", str(tmp_path), "--executor", "python"]) == 0
    assert f"{whole} ticks replayed: nothing differs; sealed" in capsys.readouterr().out


SVG = '<svg xmlns="http://www.w3.org/2000/svg"/>'


@pytest.mark.parametrize(
    ("method", "message"),
    [
        ("picture(self): raise ValueError('no pen')", "the plant's `picture` failed: ValueError: no pen (base.py, line"),
        ("picture(self): return 5", "it gave a int, which is no text"),
        ("picture(self): return '<p>here</p>'", "it gave a document of `p`, which is no SVG"),
        ("picture(self): return '<svg>'", "the plant's `picture` failed: Malformed"),
        ("__deepcopy__(self, memo): raise ValueError('one of a kind')", "the plant cannot be copied: ValueError: one of a kind"),
        ("over(self): return 1 / 0", "the plant's `over` failed: ZeroDivisionError"),
    ],
)  # fmt: skip
def test_whatever_a_plant_raises_is_told_as_the_plant_s(method: str, message: str, dock: Path) -> None:
    text = (dock / "base.py").read_text(encoding="utf-8")
    wrapped = "    @property\n" * method.startswith("over")
    (dock / "base.py").write_text(f"{text}\n{wrapped}    def {method}\n", encoding="utf-8")
    plant = bound(dock)
    plant.step(1, nothing)
    with pytest.raises(PlantFailed) as caught:
        copy.deepcopy(plant).over or plant.pictures["plant"]()  # what they raise
    assert message in str(caught.value)


def test_a_plant_s_picture_is_shown_as_it_is(dock: Path) -> None:
    text = (dock / "base.py").read_text(encoding="utf-8")
    assert bound(dock).pictures == {}
    (dock / "base.py").write_text(f"{text}\n    def picture(self): return {SVG!r}\n", encoding="utf-8")
    assert bound(dock).pictures["plant"]() == SVG


def test_a_number_that_the_variable_does_not_hold_is_refused_where_nothing_clamps() -> None:
    leaf = Leaf("x", "input", "x", "x", "int8_t", (), -100, 100, "mm", 0, "")
    made = link(shape([leaf], "x"), fields.Number(False, None), [], gives=True)
    assert made is not None
    assert list(made.given(127.4)) == [127]  # what the level refuses, it refuses itself
    with pytest.raises(BadValue, match=r"is 128 \[mm\], and `x` holds -100 \.\. 100"):
        list(made.given(127.6))


# --- units ---


@pytest.mark.parametrize(
    ("unit", "into", "expected"),
    [
        ("m", "mm", Fraction(1000)),
        ("mm/s", "m*s^-1", Fraction(1, 1000)),
        ("m/s^2", "mm/s^2", Fraction(1000)),
        ("N", "kg*m/s^2", Fraction(1)),
        ("Hz", "1/ms", Fraction(1, 1000)),
        ("lb", "kg", Fraction(45359237, 100000000)),
        ("V*A", "N*m/s", Fraction(1)),
        ("", "", Fraction(1)),
        ("tick", "tick", Fraction(1)),
        ("m/m", "", Fraction(1)),
    ],
)  # fmt: skip
def test_units_are_converted_exactly(unit: str, into: str, expected: Fraction) -> None:
    by = factor(unit, into)
    assert by is not None
    assert (by.fraction, by.pi) == (expected, 0)


def test_an_angle_is_converted_by_pi_and_is_no_bare_number() -> None:
    by = factor("rad", "deg")
    assert by is not None
    assert by.times(math.pi) == pytest.approx(180.0)
    assert by.inverse.times(180.0) == pytest.approx(math.pi)
    assert factor("rad", "") is None
    assert factor("m", "s") is None
    assert factor("tick", "tock") is None


@pytest.mark.parametrize("text", ["m per s", "m//s", "*m", "m^", "3", "m s"])
def test_what_is_no_unit_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="is no unit"):
        factor(text, "m")


def test_the_symbol_file_says_which_inputs_clamp(dock: Path) -> None:
    sign = signature(dock / "generated" / "c" / "drive.json")
    assert {leaf.name for leaf in sign.leaves if leaf.clamp} == {"travelled_mm", "lateral_mm"}


def test_a_field_of_two_parties_is_told(dock: Path) -> None:
    """As where an operator's order and a hand's have one name."""
    system = (dock / "system.toml").read_text(encoding="utf-8").partition("\n[plant.mujoco]")[0]
    edits = ('"base.bumper"', '"wall.bumper"'), ('"base.contact"', '"wall.beacon"')
    (dock / "system.toml").write_text(edited(system, *edits), encoding="utf-8")
    with pytest.raises(BadPlant) as caught:
        bound(dock)
    [diagnostic] = caught.value.diagnostics
    assert diagnostic.message == "`beacon` of `Base` would be `base.beacon` and `wall.beacon`"
    assert diagnostic.help == (
        "say whom the plant stands for: `parties = [...]`",
        "or give the class an attribute `wall` with the field in it",
    )
    base = (dock / "base.py").read_text(encoding="utf-8")
    wall = "class Wall:\n    bumper: bool = False\n    beacon: bool = False\n\n\n"
    walled = edited(base, ("class Base:", f"{wall}class Base:\n    wall: Wall = Wall()"))
    (dock / "base.py").write_text(walled, encoding="utf-8")
    plant = bound(dock)
    plant.plant.wall.beacon = True
    assert plant.step(0, nothing)["wall.beacon"] == (True,)
    assert plant.step(0, nothing)["base.beacon"] == (True,)
    described = description(dock / "system.toml")
    second = bind(described, signatures(described), described.plants[0], type(plant.plant))
    assert second.step(0, nothing)["wall.beacon"] == (False,)


def test_a_class_that_cannot_be_made_of_its_fields_is_told(dock: Path) -> None:
    text = RECORDS.replace("    inc_command_echo: int\n", "    weight: float\n    inc_command_echo: int\n")
    (dock / "fleet.py").write_text(text, encoding="utf-8")
    with pytest.raises(BadPlant) as caught:
        load_of_fleet(dock)
    assert "`report` cannot be made: TypeError" in str(caught.value)
    assert "'weight'" in str(caught.value)


def test_two_systems_may_call_their_plants_alike(dock: Path, tmp_path: Path) -> None:
    other = tmp_path / "other"
    shutil.copytree(dock, other)
    base = (other / "base.py").read_text(encoding="utf-8")
    head = "from __future__ import annotations\n\nfrom typing import Literal\n\nWord = Literal['a']\n"
    (other / "base.py").write_text(f"{head}{base}    word: Word = 'a'\n", encoding="utf-8")
    first = bound(other)
    bound(dock)
    assert first.faults == ("wheel_slips",)
