"""Names: every one is where it stands, renaming changes the name and nothing else, and is refused where it would."""

import shutil
from collections.abc import Iterator, Mapping
from pathlib import Path

import pytest

from rcsc.desk.editor.names.find import Names
from rcsc.desk.editor.names.index import Occurrence, Space, occurrences
from rcsc.desk.editor.names.rename import RefusedError, renamed
from rcsc.lang.digest import Digests
from rcsc.lang.model import Program
from rcsc.lang.project import load
from rcsc.lang.resolve import compile_text, resolve
from tests.editor.client import WHOLE, Client, applied
from tests.editor.client import RefusedError as Refused

REPO = Path(__file__).parents[2]
FILES = sorted(str(path.relative_to(REPO)) for path in (REPO / "tables").rglob("*.rcs"))


@pytest.mark.parametrize("file", FILES)
def test_every_name_stands_where_it_is_said_to(file: str) -> None:
    """Those that are broken in a heading in pieces; no two at one place."""
    loaded = load([str(REPO / file)])
    [root] = loaded.roots
    source, places = loaded.sources[root], set()
    for each in occurrences(loaded.files[root]):
        if each.space is not Space.FILE:
            assert "".join(source.slice(span) for span in (each.span, *each.further)) == each.text
            assert each.span.start not in places
            places.add(each.span.start)


TEXT = """## Doc.
enum mode { off, on }
const most = 9
input now : mode
input width_of_it : int 0 .. 9
state count_so_far : int 0 .. 3
output order : int 0 .. 3
assume calm : width_of_it < most

procedure step(by : int 0 .. 3) {
  local twice : int 0 .. 6 := by + by
  if twice > 2 { count_so_far := 3 } else { count_so_far := by }
}

table t assuming calm {
  | line       | now | width_of_ || procedures | order |
  |            |     | it        ||            |       |
  |------------|-----|-----------||------------|-------|
  | a          | off | < 3       || step(1)    | 1     |
  | b          | off | >= 3      ||            | 2     |
  | c          | on  |           ||            | 3     |
  | d above c  | on  | 5         || step(2)    |       |
}
"""


def names_of(text: str) -> Names:
    loaded = load(["-"], stdin=text, stdin_name="a.rcs")
    program = resolve("a.rcs", loaded)
    return Names(loaded.files, loaded.sources, program if isinstance(program, Program) else None)


def in_order(texts: Mapping[str, str]) -> str:
    [text] = texts.values()
    program = compile_text(text, "a.rcs")
    return "" if isinstance(program, Program) else program[0].message


def declared() -> Iterator[Occurrence]:
    yield from (each for each in names_of(TEXT).every() if each.declares)


@pytest.mark.parametrize("name", list(declared()), ids=lambda each: each.text)
def test_renaming_there_and_back_is_nothing(name: Occurrence) -> None:
    """Between the two the program resolves, has the new name and not the old."""
    there = renamed(names_of(TEXT), name, "zebra", in_order)
    [changed] = there.texts.values()
    again = names_of(changed)
    assert not [each for each in again.every() if each.text == name.text and each.space is name.space]
    new = next(each for each in again.every() if each.text == "zebra" and each.declares)
    back = renamed(again, new, name.text, in_order)
    assert back.count == there.count
    [text] = back.texts.values()
    before, after = compile_text(TEXT, "a.rcs"), compile_text(text, "a.rcs")
    assert isinstance(before, Program)
    assert isinstance(after, Program)
    assert Digests(before).whole() == Digests(after).whole()


@pytest.mark.parametrize(
    ("name", "new", "why"),
    [
        ("now", "width_of_it", "become one"), ("off", "on", "become one"), ("now", "off", "become one"), ("by", "twice", "become one"),
        ("count_so_far", "twice", "become one"), ("a", "b", "become one"), ("now", "1st", "no name"),
        ("now", "", "no name"), ("now", "a b", "no name"), ("mode", "int", "not be the same"), ("now", "true", "not be the same"),
    ],
)  # fmt: skip
def test_renaming_that_would_capture_is_refused(name: str, new: str, why: str) -> None:
    found = next(each for each in names_of(TEXT).every() if each.declares and each.text == name)
    with pytest.raises(RefusedError, match=why):
        renamed(names_of(TEXT), found, new, in_order)


def test_a_name_with_two_declarations_is_not_renamed() -> None:
    text = "enum a { off, on }\nenum b { off, away }\ninput x : a = off\n"
    found = next(each for each in names_of(text).every() if each.text == "off")
    with pytest.raises(RefusedError, match="2 places"):
        renamed(names_of(text), found, "zebra", in_order)


def test_renaming_goes_through_the_project(tmp_path: Path) -> None:
    """A state of TASK in every file that has it, through the server; every table still means the same."""
    shutil.copytree(REPO / "tables", tmp_path / "tables", ignore=shutil.ignore_patterns("*.md"))
    client = Client(tmp_path / "tables", WHOLE)
    name = "task/acquire.rcs"
    text = (tmp_path / "tables" / name).read_text()
    client.open(name, text)
    head = next(number for number, row in enumerate(text.split("\n")) if "cur_state" in row and "|" in row)
    where = client.at(name, head, text.split("\n")[head].index("cur_state"))
    with pytest.raises(Refused, match="become one"):
        client.ask("textDocument/rename", {**where, "newName": "nextstate"})
    edit = client.ask("textDocument/rename", {**where, "newName": "zebra"})
    files = {uri.rpartition("/")[2] for uri in edit["changes"]}
    assert {"common.rcs", "acquire.rcs", "move.rcs", "clear.rcs"} <= files
    root = str(tmp_path / "tables/task/task.rcs")
    loaded = load([root])
    before = resolve(root, loaded)
    for uri, edits in edit["changes"].items():
        path = Path(uri.removeprefix("file://"))
        path.write_text(applied(path.read_text(), edits))
    after = resolve(root, load([root]))
    assert isinstance(before, Program)
    assert isinstance(after, Program)
    assert {str(each.name) for each in after.variables} == {
        str(each.name).replace("cur_state", "zebra") for each in before.variables
    }
    client.stop()
