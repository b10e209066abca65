"""Descriptions and data files: every fault is told, with its line, and nothing that is wrong is taken."""

import copy
import json
import os
import random
import re
import shutil
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.source import Source
from rcsc.base.host.described import (
    MOST_FAULTS,
    BadFile,
    Document,
    Either,
    Entries,
    FileName,
    Flag,
    KeyPath,
    Kind,
    Listing,
    Number,
    Record,
    Text,
    _Scan,
    read_document,
)
from rcsc.base.host.files.names import MOST_FILE_CHARACTERS
from rcsc.base.host.files.read import MOST_TOML_BYTES
from rcsc.front import commands
from rcsc.run.declared_plant import ACTUATOR, FAULT, MODEL, PYTHON, SENSOR
from rcsc.run.description import FEED, LEVEL, SYSTEM, BadDescription, description, needs_data
from rcsc.run.orders.script import OWN
from rcsc.run.signature import Signature
from rcsc.run.system import signatures
from rcsc_cell.database.build import BadData, build
from rcsc_cell.workstation.prepared import limits_of, parts_of

SHIPPED = ("tables/system.toml", "tables/cell.toml")


def paths(value: object, here: KeyPath = ()) -> Iterator[KeyPath]:
    """Of every key and every element, however deep."""
    inside = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, one in inside:
        yield (*here, key)
        yield from paths(one, (*here, key))


# --- places ---

HARD = r"""
# a = 1
plain = 1 # = [ { "
"quo\"ted.\u0041" = 'it''s' # no
'lit.eral' = "a # b ] }"
a.b."c.d" = [1, [2, [3, { x = 1, y = [ ] }]], ]
many = '''
[not]
= a table'' '''
more = '''quotes'''''
basic = '''x'''
escaped = "\\"
date = 1979-05-27T07:32:00Z
inline = { "a]" = "}", b.c = 2 }
[ table . 'sub' ] # comment
x = -inf
[[list]]
[[list]]
name = "second"
[list.under]
k = 1
[[list.deep]]
[[list.deep]]
z = true
[table.sub.more]
"""
HARD = HARD.replace("'it''s'", "'its'").replace("basic = '''x'''", 'basic = """x\\\\\\" " "" """')


@pytest.mark.parametrize(
    "text", ["", "\n#", "a=1", "a = []\r\nb = { }\r\n", HARD, *SHIPPED, "pyproject.toml"]
)
def test_every_key_has_a_place_and_nothing_else_has(repo: Path, text: str) -> None:
    text = (repo / text).read_text(encoding="utf-8") if text.endswith(".toml") else text
    assert set(_Scan(text).places) == set(paths(tomllib.loads(text)))


@pytest.mark.parametrize("name", SHIPPED)
def test_a_place_is_where_the_key_and_its_value_are_written(repo: Path, name: str) -> None:
    text = (repo / name).read_text(encoding="utf-8")
    value = tomllib.loads(text)
    for path, (start, end) in _Scan(text).places.items():
        said: Any = value
        for part in path:
            said = said[part]
        written = text[start:end]
        if isinstance(path[-1], str) and not written.startswith("["):
            assert re.match(rf'"?{re.escape(path[-1])}"? *=', written), (path, written)
            written = written.partition("=")[2].strip() if path[-1] == written.partition(" ")[0] else written
        if isinstance(said, str | int | float) and not written.startswith("["):
            found = tomllib.loads(f"x = {written}" if "=" not in written else written)
            assert said in found.values(), (path, written)


keys = st.sampled_from(["a", "b", "c d", "e.f", "é", ""])
values = st.recursive(
    st.integers() | st.booleans() | st.text(max_size=5) | st.floats(allow_nan=False),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(keys, inner, max_size=3),
    max_leaves=8,
)


@given(st.dictionaries(keys, values, max_size=4))
@settings(max_examples=40)
def test_places_of_whatever_can_be_written(said: dict[str, Any]) -> None:
    text = toml(said)
    assert tomllib.loads(text) == said
    assert set(_Scan(text).places) == set(paths(said))


def toml(said: dict[str, Any]) -> str:
    return "".join(f"{json.dumps(key)} = {inline(one)}\n" for key, one in said.items())


def inline(value: object) -> str:
    match value:
        case dict():
            return "{ " + ", ".join(f"{json.dumps(key)} = {inline(one)}" for key, one in value.items()) + " }"
        case list():
            return "[" + ", ".join(map(inline, value)) + "]"
        case str():
            return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007F")
        case bool():
            return str(value).lower()
        case _:
            return repr(value)


# --- kinds ---

GOOD: list[tuple[Kind, object]] = [
    (Number(), 0), (Number(), -1e6), (Number(), 1e6), (Number(1, 2), 1.5), (Number(1, 2, whole=True), 2),
    (Text(), "x"), (FileName(), "a.b-c_9"), (FileName(), "a" * 100), (Flag(), False), (Listing(Flag(), 0), []),
    (Listing(Flag(), 1, 2), [True, False]), (Entries(Flag()), {}), (Entries(Flag(), 1), {"x": True}),
    (Record({"a": Flag()}, {"b": Text()}), {"a": True}), (Either((Number(), Text())), "x"),
    (Either((Number(), Listing(Number(), 1))), [1]),
]  # fmt: skip
NAN, INF = float("nan"), float("inf")


def each(kind: Kind, *wrong: object) -> list[tuple[Kind, object, int]]:
    return [(kind, one, 1) for one in wrong]


BAD: list[tuple[Kind, object, int]] = [
    *each(Number(), NAN, INF, -INF, 1000000.1, -1000000.1, 10**400, True, "1", [], {}),
    *each(Number(1, 2, whole=True), 1.0, 0, 3, NAN, True),
    *each(Text(), "", " ", 1, False, []),
    *each(FileName(), "", "..", "../x", "a/b", ".a", "a" * (MOST_FILE_CHARACTERS + 1), "-a", "a\n", "a b", "é", "\0", 1),
    *each(Flag(), 0, 1, "true"),
    *each(Listing(Flag(), 1, 2), [], [True] * 3, {}, "ab", [1]),
    (Listing(Number()), [1, "a", NAN, 2], 2),
    *each(Entries(Flag(), 1), {}, [], {"a": 1}),
    *each(Record({"a": Flag()}, {"b": Text()}), {}, {"b": "x"}, {"a": True, "c": 1}, []),
    (Record({"a": Flag()}, {"b": Text()}), {"c": 1, "b": 2}, 3),
    (Either((Number(), Listing(Number()))), [NAN, "a"], 2),
    (Either((Number(), Text())), [], 1),
]  # fmt: skip


def page(value: object) -> Document:
    return Document("file", Source("file", ""), {"x": value}, Code.BAD_DATA, _places={})


@pytest.mark.parametrize(("kind", "value"), GOOD)
def test_what_may_stand_there_is_taken(kind: Kind, value: object) -> None:
    document = page(value)
    document.check(Record({"x": kind}))
    assert document.faults == []
    assert document.holds(Record({"x": kind}))


@pytest.mark.parametrize(("kind", "value", "many"), BAD)
def test_what_may_not_is_told_once_each(kind: Kind, value: object, many: int) -> None:
    document = page(value)
    document.check(Record({"x": kind}))
    assert len(document.faults) == many
    assert all(fault.message.startswith("`x") for fault in document.faults)
    assert not document.holds(Record({"x": kind}))


def test_faults_have_lines_and_come_in_order_and_not_without_end(tmp_path: Path) -> None:
    path = tmp_path / "file.toml"
    path.write_text("colour = 1\n[[row]]\nnmae = 'x'\n" + "[[row]]\n" * 500, encoding="utf-8")
    document = read_document(path, Code.BAD_DATA, BadFile)
    document.check(Record({"row": Listing(Record({"name": Text()}))}))
    error = document.bad(BadFile)
    assert str(error).startswith(
        f"{path}:1: `colour` means nothing here; {path}:2: `row[1]` lacks `name`: a text in quotes, not empty; "
        f"{path}:3: `row[1].nmae` means nothing here; {path}:4: `row[2]` lacks `name`"
    )
    assert error.diagnostics[2].help == ("did you mean `name`?",)
    assert len(error.diagnostics) == MOST_FAULTS + 1
    assert error.diagnostics[-1].message == f"and {503 - MOST_FAULTS} faults more"


UNREAD = {
    "cannot be read": None,
    "is not UTF-8 at byte 4": b"a = \xff",
    "is not TOML: Cannot overwrite": b"a = 1\na = 2",
    "is not TOML: Invalid value": b"a = ",
    "nested more than 32 deep": b"a = " + b"[" * 5000 + b"]" * 5000,
    "has more than 4 MiB": b"#" * (MOST_TOML_BYTES + 1),
}


@pytest.mark.parametrize("why", UNREAD)
@pytest.mark.parametrize("name", ["system.toml", "cell.toml"])
def test_what_is_no_toml_is_a_coded_error(
    repo: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str, why: str
) -> None:
    laid(repo, tmp_path)
    text = UNREAD[why]
    (tmp_path / name).unlink()
    if text is not None:
        (tmp_path / name).write_bytes(text)
    else:
        (tmp_path / name).mkdir()
    if (name, text) == ("system.toml", None):
        return  # the command line asks for a file
    assert commands.run(["db", "check", "--system", str(tmp_path / "system.toml")]) == 1
    said = capsys.readouterr().err
    assert why in said
    assert said.startswith("error[RCS721]" if name == "system.toml" else "error[RCS722]")


# --- the shipped ones, changed ---


def laid(repo: Path, folder: Path, system: object = None, cell: object = None) -> Path:
    """The shipped description and data in a folder, or what stands for them."""
    texts = [(repo / name).read_text(encoding="utf-8") for name in SHIPPED]
    texts[0] = texts[0].replace('"../generated"', '"generated"')
    if not (folder / "generated").exists():
        shutil.copytree(
            repo / "generated", folder / "generated", copy_function=os.link
        )  # nobody writes there
    for at, said in enumerate((system, cell)):
        if isinstance(said, dict):
            texts[at] = toml(said)
    (folder / "system.toml").write_text(texts[0], encoding="utf-8")
    (folder / "cell.toml").write_text(texts[1], encoding="utf-8")
    return folder / "system.toml"


def changed(now: Any, how: str) -> object:
    """The value in another form; itself where that form is not one of its own."""
    if how in {"text", "list", "number", "flag"}:
        return {"text": "x", "list": [1], "number": 7, "flag": True}[how]
    if isinstance(now, str):
        return now + "x" if how == "more" else now
    if isinstance(now, bool) or not isinstance(now, int | float):
        return now
    return {"negate": -now, "nan": NAN, "inf": -INF, "huge": now * 10**30, "zero": 0, "more": now * 3}[how]


WAYS = ("drop", "rename", "text", "list", "number", "flag", "negate", "nan", "inf", "huge", "zero", "more")


def changes(said: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Every key and element dropped, renamed by a letter, of another type; every number negated, not finite, huge, nothing."""
    for path in paths(said):
        for how in WAYS:
            made = copy.deepcopy(said)
            inside: Any = made
            for part in path[:-1]:
                inside = inside[part]
            last = path[-1]
            if how == "drop":
                del inside[last]
            elif how == "rename" and isinstance(last, str):
                new = {key + "x" if key == last else key: one for key, one in inside.items()}
                inside.clear()
                inside.update(new)
            elif how != "rename":
                inside[last] = changed(inside[last], how)
            if repr(made) != repr(said):
                yield f"{path}: {how}", made


KNOWN: dict[bytes, dict[str, Signature]] = {}


def looked_at(folder: Path) -> None:
    """As `rcsc db check` does, but that the arm goes nowhere."""
    said = description(folder / "system.toml")
    text = (folder / "system.toml").read_bytes()
    signs = KNOWN[text] if text in KNOWN else KNOWN.setdefault(text, signatures(said))
    needs_data(said)
    build(said.database, folder / "made.sqlite", parts_of(signs), limits_of(said, signs))


def answered(folder: Path) -> tuple[str, ...]:
    """The faults of the description and the data in a folder; of each the code, a line and no bug. None where it is taken."""
    try:
        looked_at(folder)
    except (BadDescription, BadData) as error:
        refused: BadFile = error
    else:
        return ()
    for finding in refused.diagnostics:
        assert finding.code in (Code.BAD_SYSTEM, Code.BAD_DATA)
        assert finding.primary.span.file in refused.sources or "cannot be read" in finding.message
    return tuple(finding.message for finding in refused.diagnostics) or (str(refused),)


SAMPLE = 24


@pytest.mark.parametrize("which", [0, 1])
def test_a_description_that_was_changed_anywhere_is_taken_or_refused_with_a_code(
    repo: Path, tmp_path: Path, which: int
) -> None:
    """A sample; all of them by `python -m tests.host.test_described`."""
    laid(repo, tmp_path)
    said = tomllib.loads((tmp_path / ("system.toml", "cell.toml")[which]).read_text(encoding="utf-8"))
    made = list(changes(said))
    refused = sum(
        bool(answered(laid(repo, tmp_path, *((None, one) if which else (one, None))).parent))
        for _, one in random.Random(1).sample(made, SAMPLE)  # noqa: S311  # chance of a test
    )
    assert refused > SAMPLE // 2
    assert answered(laid(repo, tmp_path).parent) == ()


def edited(path: KeyPath, value: object) -> tuple[str, KeyPath, object]:
    return (SHIPPED[path[0] in {"robot", "trajectory", "object", "station", "location", "part"}], path, value)


WRONG = [
    (*edited(("tick_ms",), 30), "`tick_ms` is 30, and level `task` runs every 40 ms"),
    (*edited(("tick_ms",), 0), "`tick_ms` must be a whole number from 1"),
    (*edited(("name",), "../x"), "`name` must be a name of"),
    (*edited(("level", 0, "name"), "tasx"), "`task` is neither a level"),
    (*edited(("level", 1, "name"), "task"), "there are two levels `task`"),
    (*edited(("level", 0, "feed", 0, "into"), "sourc"), "has no variable `sourc`"),
    (*edited(("level", 0, "feed", 0, "into"), "cur_state"), "is filled, and is no input"),
    (*edited(("level", 0, "feed", 0, "keys", 0), "workstation"), "name one"),
    (*edited(("buffers", "task.to_workstation"), "worksttion.report"), "`worksttion` is neither a level nor in `outside`"),
    (*edited(("buffers", "task.to_workstation"), "workstation"), "`workstation` is no buffer's end"),
    (*edited(("buffers", "task.to_emove"), "emove.comand"), "has no variable `comand`"),
    (*edited(("buffers", "task.to_emove"), "primitive.emove"), "`primitive.emove` is filled twice"),
    (*edited(("buffers", "task.to_emove"), "gripper.primitive"), "`gripper.primitive` is filled twice"),
    (*edited(("displays", "path", 0), "primitiv.x"), "there is no level `primitiv` to show"),
    (*edited(("trajectory", "fast", "speed_mm_s"), 9000), "`primitive.goal.speed_mm_s` would be 9000, and holds 1 .. 2000"),
    (*edited(("object", "tbox", "grasp", "2", "force_n"), 99999), "`primitive.fingers.force_n` would be 99999"),
    (*edited(("object", "tbox", "grasp", "2", "force_n"), NAN), "must be a number from 0 to 100000, not `nan`"),
    (*edited(("location", "BUFFER", "safe"), "BUFFER-SAF"), "no location is called `BUFFER-SAF`"),
    (*edited(("robot", "reach_mm", 0), 950.0), "`reach_mm` goes from 950 to 900"),
    (*edited(("part", 0, "object"), "tbx"), "no part is called `tbx`"),
]  # fmt: skip


@pytest.mark.parametrize(("file", "path", "value", "message"), WRONG)
def test_what_is_wrong_is_said_where_it_stands(
    repo: Path, tmp_path: Path, file: str, path: KeyPath, value: object, message: str
) -> None:
    laid(repo, tmp_path)
    place = tmp_path / Path(file).name
    said = tomllib.loads(place.read_text(encoding="utf-8"))
    inside: Any = said
    for part in path[:-1]:
        inside = inside[part]
    inside[path[-1]] = value
    place.write_text(toml(said), encoding="utf-8")
    with pytest.raises((BadDescription, BadData)) as raised:
        looked_at(tmp_path)
    found = next(finding for finding in raised.value.diagnostics if message in finding.message)
    source = raised.value.sources[str(place)]
    line = source.line(source.position(found.primary.span.start).line)
    assert line.startswith(json.dumps("buffers" if value == "tasx" else path[0]))


PARTIES = {
    "tsak.report": "`tsak` is no level, and is spelled almost as `task`",
    "worksttion.report": "`worksttion` is no level, and is spelled almost as `workstation`",
}


@pytest.mark.parametrize("end", PARTIES)
def test_a_party_that_is_almost_another_is_a_slip_where_nobody_says_who_is_outside(
    repo: Path, tmp_path: Path, end: str
) -> None:
    text = laid(repo, tmp_path).read_text(encoding="utf-8")
    text = re.sub(r"(?m)^outside = .*\n", "", text)
    (tmp_path / "system.toml").write_text(text, encoding="utf-8")
    assert answered(tmp_path) == ()
    text = text.replace('"workstation.report"', f'"{end}"') + '"a.b" = "workstation.c"\n'
    (tmp_path / "system.toml").write_text(text, encoding="utf-8")
    assert any(PARTIES[end] in one for one in answered(tmp_path))


def test_faults_are_told_as_text_and_as_json(
    repo: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = laid(repo, tmp_path)
    cell = tmp_path / "cell.toml"
    cell.write_text(cell.read_text(encoding="utf-8").replace("stock = 10", "stok = 10"), encoding="utf-8")
    assert commands.run(["db", "check", "--system", str(path)]) == 1
    said = capsys.readouterr().err
    assert said.count("error[RCS722]") == said.count("did you mean `stock`?") == 4
    written = cell.read_text(encoding="utf-8").splitlines()
    lines = [number for number, line in enumerate(written, 1) if line.startswith("stok = 10")]
    assert [int(number) for number in re.findall(rf"--> {re.escape(str(cell))}:(\d+):1", said)] == lines
    assert commands.run(["db", "check", "--system", str(path), "--json"]) == 1
    report = json.loads(capsys.readouterr().out)
    assert [one["primary"]["place"]["start"]["line"] for one in report["diagnostics"]] == lines
    assert report["ok"] is False


if __name__ == "__main__":
    import sys
    import tempfile

    REPO = Path(__file__).parents[2]
    with tempfile.TemporaryDirectory() as place:
        counts = [0, 0]
        for at, name in enumerate(SHIPPED):
            laid(REPO, Path(place))
            whole = tomllib.loads((Path(place) / Path(name).name).read_text(encoding="utf-8"))
            for what, one in changes(whole):
                found = answered(laid(REPO, Path(place), *((None, one) if at else (one, None))).parent)
                counts[bool(found)] += 1
                sys.stdout.write("" if found else f"taken: {name}, {what}\n")
        sys.stdout.write(f"{counts[0]} taken, {counts[1]} refused\n")


def test_the_guide_has_every_key_of_a_description(repo: Path) -> None:
    text = (repo / "tables" / "guide" / "system.md").read_text(encoding="utf-8")
    shown = {key for row in re.findall(r"(?m)^\| (`.*?) \|", text) for key in re.findall(r"`(\w+)`", row)}
    kinds = (
        SYSTEM,
        LEVEL,
        FEED,
        SENSOR,
        ACTUATOR,
        FAULT,
        Record(PYTHON),
        Record(MODEL),
        Record(dict.fromkeys(OWN, Text())),
    )
    known = {key for kind in kinds for key in (*kind.needed, *kind.others)}
    assert known <= shown, known - shown
    assert shown - known <= {"bool", "int", "real", "single"}


def test_the_example_of_the_guide_is_taken(repo: Path, tmp_path: Path) -> None:
    text = (repo / "tables" / "guide" / "system.md").read_text(encoding="utf-8")
    whole, readers, levels, model = re.findall(r"(?ms)^```toml\n(.*?)^```", text)
    axes = (repo / "tests/data/two_axes/system.toml").read_text(encoding="utf-8")
    assert {*levels.splitlines(), readers.splitlines()[0]} <= set(axes.splitlines())
    (tmp_path / "rcsc.toml").write_text("", encoding="utf-8")
    buffers = '"base.lateral" = "drive.lateral_mm"\n"base.contact" = "supervisor.contact"\n"base.beacon" = "supervisor.beacon_seen"\n'
    (tmp_path / "system.toml").write_text(
        whole.replace("[buffers]\n", f"[buffers]\n{buffers}") + model, encoding="utf-8"
    )
    assert [spec.name for spec in description(tmp_path / "system.toml").plants] == ["", "mujoco"]
