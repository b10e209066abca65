"""`rcsc compile` of a system: what is written where, what is refused, and names that would be spelled alike."""

import subprocess
from pathlib import Path

import pytest

from rcsc.front.commands import run
from rcsc.run.description import description
from rcsc.run.link.drawn_script import drawing, script
from rcsc.run.system import signatures
from tests.link.played import CSystem, by_python, first_difference
from tests.support.programs.stages import STRICT
from tests.support.programs.texts import edit_file, system

PROGRAM = """
record r {{ a : int 0 .. 9  b : array[2] of bool }}
input {x} : int 0 .. 9
input given : r
output {y} : int 0 .. 9
output gives : r
procedure p {{ {y} := {x} }}
table t {{
  | line | {x} || procedures |
  | one  | < 5 || p          |
  | two  | >=5 ||            |
}}
level {name} {{ period {period} [ms] table t }}
"""


def written(
    folder: Path, names: dict[str, int], buffers: dict[str, str], called: str = "whole", **words: str
) -> Path:
    """A system of levels with these periods; the path of its description."""
    folder.mkdir(exist_ok=True)
    (folder / "rcsc.toml").write_text('name = "p"\n', encoding="utf-8")
    x, y = words.get("x", "x"), words.get("y", "y")
    for name, period in names.items():
        text = PROGRAM.format(name=name, period=period, x=x, y=y)
        (folder / f"{name}.rcs").write_text(text, encoding="utf-8")
    (folder / "system.toml").write_text(system(names, buffers, name=called, tick_ms="10"), encoding="utf-8")
    return folder / "system.toml"


def built(folder: Path, called: str, *programs: str) -> str:
    """What the compiler says of a system's C; empty for nothing."""
    sources = [f"generated/c/{name}.c" for name in (called, *programs)]
    ran = subprocess.run(
        ["cc", *STRICT, "-c", *sources], cwd=folder, capture_output=True, text=True, check=False
    )
    return ran.stderr


BUFFERS = {"b.y": "a.x", "a.gives": "b.given", "who.x": "b.x", "a.y": "who.y"}


def test_it_is_written_where_the_description_says(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = written(tmp_path / "robot", {"a": 20, "b": 10}, BUFFERS)
    monkeypatch.chdir(tmp_path)
    for given in ("robot", "robot/system.toml"):
        assert run(["compile", "-q", given]) == 0
        assert run(["compile", "-q", "--check", given]) == 0
    here = path.parent / "generated/c"
    assert {f"whole.{end}" for end in ("h", "c", "cmake", "pc")} <= {file.name for file in here.iterdir()}
    assert built(path.parent, "whole", "a", "b") == ""
    text = (here / "whole.c").read_text(encoding="utf-8")
    assert "const bool due_a = (s->tick % UINT64_C(2)) == UINT64_C(0);" in text
    assert "s->between.a_gives.b[i0] = s->a.gives.b[i0];" in text  # each program has a type of its own
    (here / "whole.c").write_text(text.replace("UINT64_C(2)", "UINT64_C(3)"), encoding="utf-8")
    assert run(["compile", "-q", "--check", "robot"]) == 1
    edit_file(path, ('"who.x" = "b.x"\n', ""))
    assert run(["compile", "-q", "robot"]) == 0
    assert "from_who" not in (here / "whole.h").read_text(encoding="utf-8")
    assert run(["compile", "-q", "--target", "python", "--out", "only", "robot"]) == 0
    assert not (tmp_path / "only/c").exists()


@pytest.mark.parametrize(
    ("edit", "said"),
    [
        (('name = "b"', 'name = "c"'), "there is no program `c`"),
        (('"b.y" = "a.x"', '"b.y" = "a.z"'), "program `a` has no variable `z`"),
        (("tick_ms = 10", "tick_ms = 15"), "no whole number of ticks"),
        (('"b.y" = "a.x"', '"b.gives" = "a.x"'), "hold other things"),
    ],
)
def test_what_does_not_fit_is_told_with_its_line(
    edit: tuple[str, str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = written(tmp_path, {"a": 20, "b": 10}, BUFFERS)
    edit_file(path, edit)
    if "name" in edit[0]:
        path.write_text(
            path.read_text().replace('"b.', '"c.').replace("a.gives", "a.y").replace('"a.y" = "who.y"', "")
        )
    assert run(["compile", str(path)]) in {1, 2}
    told = "".join(capsys.readouterr())
    assert said in told
    assert "system.toml" in told
    assert not (tmp_path / "generated/c").exists()


def test_two_systems_that_name_two_folders_need_a_choice(tmp_path: Path) -> None:
    one = written(tmp_path / "one", {"a": 10}, {"who.x": "a.x"})
    two = written(tmp_path / "two", {"b": 10}, {"who.x": "b.x"}, called="other")
    assert run(["compile", str(one), str(two)]) == 1
    assert run(["compile", "-q", str(one), str(two), "--out", str(tmp_path / "both")]) == 0
    assert {"whole.c", "other.c", "a.c", "b.c"} <= {file.name for file in (tmp_path / "both/c").iterdir()}


def test_a_system_called_as_its_level_is_called_otherwise(tmp_path: Path) -> None:
    written(tmp_path, {"a": 10}, {"a.y": "a.x"}, called="a")
    assert run(["compile", "-q", str(tmp_path)]) == 0
    assert built(tmp_path, "a_system", "a") == ""


def test_a_type_that_is_two_things_is_an_error(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    written(tmp_path, {"whole_in": 10}, {"who.x": "whole_in.x"})
    assert run(["compile", str(tmp_path)]) == 1
    assert "`whole_in_t` would be two things in C" in "".join(capsys.readouterr())


def test_any_word_may_be_a_name(tmp_path: Path) -> None:
    words = ("in_", "tick", "between", "now", "at", "level", "faulted", "s", "from_")
    names = dict.fromkeys(words, 10) | {"tick": 20, "at": 30}
    buffers = {
        "tick.y": "between.x",
        "int.while": "now.x",
        "int.while_": "at.x",
        "NULL.I": "s.x",
        "level.y": "int.for",
    }
    buffers |= {"s.y": "s.given.a", "int.b[1]": "now.given.b[0]", "int.b_1": "now.given.b[1]"}
    path = written(tmp_path, names, buffers, called="9-time.x", x="line", y="fault")
    text = path.read_text(encoding="utf-8").replace(".x", ".line").replace(".y", ".fault")
    path.write_text(text, encoding="utf-8")
    assert run(["compile", "-q", str(tmp_path)]) == 0
    [word] = [file.stem for file in (tmp_path / "generated/c").glob("p9*.h")]
    programs = [file.stem for file in (tmp_path / "generated/c").glob("*.c") if file.stem != word]
    assert built(tmp_path, word, *programs) == ""


def test_two_levels_of_one_program_have_a_state_each(tmp_path: Path) -> None:
    path = written(
        tmp_path, {"left": 10}, {"left.y": "right.x", "right.y": "left.x", "who.x": "left.given.a"}
    )
    text = (tmp_path / "left.rcs").read_text(encoding="utf-8")
    (tmp_path / "limb.rcs").write_text(f"{text}level right {{ period 20 [ms] table t }}\n", encoding="utf-8")
    (tmp_path / "left.rcs").unlink()
    edit_file(
        path,
        ('name = "left"', 'name = "left"\nprogram = "limb"\n[[level]]\nname = "right"\nprogram = "limb"'),
    )
    assert run(["compile", "-q", str(path)]) == 0
    assert built(tmp_path, "whole", "limb") == ""
    described = description(path)
    signs = signatures(described)
    ticks = script(described, signs, drawing(3), 60)
    assert (
        first_difference(by_python(described, ticks), CSystem(described, signs, tmp_path).play(ticks)) == ""
    )


def test_questions_of_one_name_and_other_types_are_two_functions(tmp_path: Path) -> None:
    path = written(tmp_path, {"a": 10, "b": 10}, {"who.x": "a.x"})
    feeds = '[[level.feed]]\ninto = "{}"\nquery = "take_a"\nkeys = ["x"]\n'
    edit_file(path, ('name = "a"\n', f'name = "a"\n{feeds.format("given")}{feeds.format("given.a")}'))
    edit_file(path, ('name = "b"\n', f'name = "b"\n{feeds.format("given.a")}{feeds.format("given.b")}'))
    assert run(["compile", "-q", str(path)]) == 0
    assert built(tmp_path, "whole", "a", "b") == ""
    header = (tmp_path / "generated/c/whole.h").read_text(encoding="utf-8")
    assert "extern void whole_take_a_2(uint8_t key_0, a_r_t *answer);" in header
    assert "/* yours: a.given.a of x; b.given.a of x; asked" in header
    assert "extern void whole_take_a_4(uint8_t key_0, bool answer[2]);" in header
