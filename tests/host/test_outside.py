"""Data from others: nothing in it is believed, run, or followed out of the project, and none of it takes more than its size allows."""

import ast
import csv
import io
import json
import os
import re
import resource
import shutil
import struct
import subprocess
import sys
import zlib
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any, TypeGuard

import pytest
import zstandard
from mcap.writer import Writer

from rcsc.base.host.files import csv_text
from rcsc.base.host.files.names import BadName, identifier, inside, within
from rcsc.base.host.files.read import CheckedFields, Malformed, content, json_of, lines_of, toml_of, xml_of
from rcsc.code.emit.generated import write
from rcsc.compose.counterexample.frozen import BadCaseError, read_case
from rcsc.desk.shell.typed_names import kind_of
from rcsc.front.commands import run
from rcsc.run.description import BadDescription, description
from rcsc.run.log.read import UnreadableLog, read
from rcsc.run.log.recorder import Recorder
from rcsc.run.log.records import MOST_CHUNK, ChainCheck, Seal, records
from rcsc.run.signature import signature
from rcsc.run.system import System, assemble
from rcsc.views.diff import rows as forms
from rcsc.views.graph.drawing import svg
from rcsc.views.graph.formats.state_graph import Edge, StateGraph
from rcsc.views.pages.frame import quoted
from tests.support.programs.stages import emitted, shipped
from tests.support.programs.texts import system

REPO = Path(__file__).parents[2]


# --- one place that parses -------------------------------------------------------------------

PARSERS = {
    "json.load", "json.loads", "tomllib.load", "tomllib.loads", "csv.reader", "csv.DictReader", "ET.parse", "ET.fromstring",
    "ElementTree.parse", "ElementTree.fromstring", "pickle.load", "pickle.loads", "marshal.loads", "shelve.open", "eval", "exec",
    "np.load", "numpy.load", "ast.literal_eval", "zstandard.decompress", "zlib.decompress", "gzip.decompress", "lzma.decompress",
}  # fmt: skip
"""What makes values of text or bytes."""
FORMATS_OF_OURS = {
    "rcsc/lang/model.py", "rcsc/proof/solvers/smt.py", "rcsc/proof/solvers/smtlib.py", "rcsc/code/testing/executors/native.py",
    "rcsc/code/testing/executors/externs.py", "rcsc/code/testing/coverage/harness.py", "rcsc/lang/operator_table.py",  # reals as bits
    "rcsc/run/signature.py", "rcsc/run/executors.py", "rcsc/run/log/read.py", "rcsc/run/log/recorder.py",  # `FORMATS` by checked types
    "rcsc/run/log/records.py", "rcsc/run/log/replay.py", "rcsc/run/processes/memory.py", "rcsc/run/processes/block.py",
    "rcsc/run/processes/attach.py", "rcsc/run/processes/switches.py", "rcsc/run/log/schema.py",
    "rcsc/run/processes/serve.py", "rcsc/run/answers.py", "rcsc/run/levels.py", "rcsc/run/system.py", "rcsc/run/link/beside.py",
    "rcsc/run/orders/stopped.py", "rcsc/proof/certify", "rcsc/run/campaign/work.py",
}  # fmt: skip
"""Who may name `struct`: their formats are written in them, or taken from `FORMATS` for a type that was checked."""


Outward = ast.Call | ast.Import | ast.ImportFrom | ast.Attribute


@cache
def sources() -> tuple[tuple[str, tuple[Outward, ...]], ...]:
    """Return what each file calls and imports, and the streams that it names; the walk takes longer than parsing, so it is done once."""
    paths = sorted(path for folder in ("rcsc", "sim") for path in (REPO / folder).rglob("*.py"))
    return tuple((path.relative_to(REPO).as_posix(), tuple(_outside(path))) for path in paths)


def _outside(path: Path) -> Iterator[Outward]:
    for node in ast.walk(ast.parse(path.read_bytes())):
        if isinstance(node, ast.Call | ast.Import | ast.ImportFrom) or _is_stream(node):
            yield node


def _is_stream(node: ast.AST) -> TypeGuard[ast.Attribute]:
    return (
        isinstance(node, ast.Attribute) and node.attr in {"stdin", "__stdin__"} and _word(node.value) == "sys"
    )


READS = {"open", "fdopen", "read_text", "read_bytes", "memmap", "fromfile"}
READERS_OF_FILES: Mapping[str, str] = {
    "rcsc/base/host/files/": "reads within bounds",
    "rcsc/base/host/children.py": "a lock on what this process made",
    "rcsc/base/host/cache.py": "rcsc's own files, for their digest",
    "rcsc/base/host/keeper.py": "what its own parent says; imports nothing of rcsc",
    "rcsc/base/host/tools.py": "the pinned ESBMC, for its digest",
    "rcsc/run/processes/supervisor.py": "/proc",
    "rcsc/run/processes/block.py": "shared memory of its own",
    "rcsc/run/processes/attach.py": "shared memory of rcsc's, and `/proc`",
    "rcsc/run/campaign/journal.py": "is added to and read in one opening, regular and bounded by itself",
    "rcsc/front/commands/systems/shell.py": "is added to",
    "rcsc/run/log/recorder.py": "is written",
    "rcsc/lang/syntax/parse.py": "comes with the compiler",
    "rcsc/desk/studio/server.py": "comes with the compiler",
    "rcsc/desk/studio/share/document.py": "comes with the compiler",
    "rcsc/desk/studio/start.py": "comes with the compiler",
    "rcsc/front/commands/shared/scaffold.py": "comes with the compiler",
    "sim/rcsc_cell/cell/reach.py": "comes with the cell",
}
"""Who may open something, and what."""


def _reads(node: ast.AST) -> bool:
    """Whether it is a call that opens something for reading, or names the standard input."""
    if isinstance(node, ast.Attribute):
        return True
    if not isinstance(node, ast.Call):
        return False
    what = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
    if what == "open" and isinstance(node.func, ast.Attribute) and _word(node.func.value) in _NOT_FILES:
        return False
    return (what in READS and not _writes(node) and "os.devnull" not in ast.unparse(node)) or what == "input"


_NOT_FILES = {"session", "workspace", "_workspace", "trial"}
"""Whose `open` is about an editor's text."""


def test_files_are_read_by_the_one_reader() -> None:
    wrong = [
        f"{name}:{node.lineno}: {ast.unparse(node)}"
        for name, nodes in sources()
        if not name.startswith(tuple(READERS_OF_FILES))
        for node in nodes
        if _reads(node)
    ]
    assert wrong == []


def calls() -> Iterator[tuple[str, str]]:
    """Every call that is written anywhere: its place, and what is called, `a.b` at the most."""
    for name, nodes in sources():
        for node in nodes:
            if isinstance(node, ast.Call):
                what = node.func
                if isinstance(what, ast.Name):
                    yield f"{name}:{node.lineno}", what.id
                elif isinstance(what, ast.Attribute):
                    yield f"{name}:{node.lineno}", f"{_word(what.value)}.{what.attr}"


def _word(node: ast.expr) -> str:
    return node.id if isinstance(node, ast.Name) else node.attr if isinstance(node, ast.Attribute) else ""


READERS = (
    "rcsc/base/host/files/read.py:",
    "rcsc/code/emit/rendering.py:",
    "rcsc/code/testing/executors/python.py:",
    "rcsc/code/testing/executors/externs.py:",
    "rcsc/lang/syntax/saved.py:",
)
"""Who parses; a tested executor, and what stands in for its externs, are texts that were generated just now, marks
were written by who reads them, and the parser of the grammar comes with the compiler."""


def test_only_the_bounded_readers_parse_text_from_outside() -> None:
    wrong = [
        f"{place}: {call}" for place, call in calls() if call in PARSERS and not place.startswith(READERS)
    ]
    modules = {"tomllib", "csv", "pickle", "marshal", "shelve", "yaml", "gzip", "bz2", "lzma"}
    imported = [
        f"{name}:{node.lineno}: {one}"
        for name, nodes in sources()
        if not name.startswith("rcsc/base/host/files/")
        for node in nodes
        if isinstance(node, ast.Import | ast.ImportFrom)
        for one in _imported(node)
        if one.partition(".")[0] in modules
    ]
    assert wrong + imported == []


def _imported(node: ast.Import | ast.ImportFrom) -> list[str]:
    if isinstance(node, ast.Import):
        return [name.name for name in node.names]
    return [f"{node.module}.{name.name}" for name in node.names]


BEGIN = {"subprocess", "tempfile", "pty", "multiprocessing", "concurrent.futures"}
"""Modules by which processes begin and temporary things are made."""
BEGINS = "rcsc/base/host/children.py"
BEGUN = (
    "os.fork",
    "os.spawn",
    "os.posix_spawn",
    "os.system",
    "os.popen",
    "ProcessPoolExecutor",
    "futures.ProcessPoolExecutor",
)
NO_PROCESS = {
    ("rcsc/run/processes/block.py", "multiprocessing"),  # shared memory, no process
    ("rcsc/run/processes/supervisor.py", "multiprocessing"),  # a type
    ("rcsc/run/processes/diagnose.py", "multiprocessing"),  # likewise
    ("rcsc/code/testing/apart.py", "multiprocessing"),  # likewise
    ("rcsc/run/processes/serve.py", "multiprocessing"),  # likewise
    (
        "rcsc/run/campaign/worker_pool.py",
        "concurrent.futures",
    ),  # the classes of executors and what they raise
    ("rcsc/run/campaign/runner.py", "concurrent.futures"),
    ("rcsc/run/campaign/counterexamples.py", "concurrent.futures"),
    ("rcsc/desk/studio/build.py", "concurrent.futures"),  # what it raises
    ("rcsc/desk/editor/server/session.py", "concurrent.futures"),  # threads
}


def test_processes_and_temporary_folders_begin_in_one_place() -> None:
    imports = {
        (name, begin)
        for name, nodes in sources()
        for node in nodes
        if isinstance(node, ast.Import | ast.ImportFrom)
        for one in _imported(node)
        for begin in BEGIN
        if f"{one}.".startswith(f"{begin}.")
    }
    assert {one for one in imports if one[0] != BEGINS} <= NO_PROCESS
    assert [place for place, call in calls() if call.startswith(BEGUN) and not place.startswith(BEGINS)] == []


def test_formats_of_bytes_are_named_where_they_are_known() -> None:
    naming = {
        name
        for name, nodes in sources()
        for node in nodes
        if isinstance(node, ast.Import) and any(alias.name == "struct" for alias in node.names)
    }
    assert {name for name in naming if not name.startswith(tuple(FORMATS_OF_OURS))} == set()


# --- bounded ---------------------------------------------------------------------------------

HOSTILE: Mapping[str, tuple[Callable[[str], object], str]] = {
    "brackets": (json_of, "[" * 2_000_000),
    "objects": (json_of, '{"a":' * 300_000),
    "brackets, closed": (json_of, "[" * 100_000 + "]" * 100_000),
    "a text without an end": (json_of, '"' + '\\"' * 500_000),
    "a number of a million digits": (json_of, "1" * 1_000_000),
    "a terminal's language": (json_of, r'["\u001b[2J"]'),
    "an override of direction": (json_of, '{"\u202e": 1}'),
    "half a character": (json_of, r'"\ud800"'),
    "arrays": (toml_of, "a = " + "[" * 300_000),
    "tables in a line": (toml_of, "a = " + "{b = " * 100_000),
    "a dotted key": (toml_of, "a" + ".a" * 300_000 + " = 1"),
    "a dotted, quoted key": (toml_of, "a" + ' . "a"' * 100_000 + " = 1"),
    "a dotted heading": (toml_of, "[a" + ".a" * 300_000 + "]"),
    "quotes": (toml_of, '"""' * 300_000),
    "apostrophes": (toml_of, "'" * 900_001),
    "escapes": (toml_of, '"' + "\\" * 900_001),
    "a bell": (toml_of, 'a = "\\u0007"'),
    "five MiB": (toml_of, "#" * (5 << 20)),
    "elements": (xml_of, "<a>" * 300_000),
    "elements, closed": (xml_of, "<a>" * 65 + "</a>" * 65),
    "entities": (xml_of, '<!DOCTYPE a [<!ENTITY b "cc"><!ENTITY c "&b;&b;">]><a>&c;</a>'),
    "a document type": (xml_of, "<!DOCTYPE a SYSTEM 'file:///etc/passwd'><a/>"),
    "nothing": (xml_of, ""),
}


@pytest.mark.parametrize("case", HOSTILE)
def test_hostile_text_is_refused(case: str) -> None:
    reader, text = HOSTILE[case]
    with pytest.raises(Malformed) as refused:
        reader(text)
    assert str(refused.value.args[0]).isprintable()
    assert len(str(refused.value.args[0])) < 200


def test_texts_with_brackets_are_not_taken_for_nesting() -> None:
    assert json_of(json.dumps(["[" * 500, '"{' * 500, "\\"])) == ["[" * 500, '"{' * 500, "\\"]
    said = (
        "# [[[[\na = '''[[[['{{{'''\nb = \"\"\"[\\\"\"[\"\"\"\nc = '[[['  # {{{{\n[d.e]\n'f.g' = [1.5, 2.5]\n"
    )
    assert toml_of(said.replace("[[[[", "[" * 99)) == {
        "a": "[" * 99 + "'{{{", "b": '[""[', "c": "[[[", "d": {"e": {"f.g": [1.5, 2.5]}},
    }  # fmt: skip
    assert toml_of("x = [" + "1.5, " * 5000 + "]")["x"] == [1.5] * 5000


def test_what_is_no_regular_file_is_not_read(tmp_path: Path) -> None:
    (tmp_path / "large").write_bytes(b"x" * 11)
    os.mkfifo(tmp_path / "pipe")
    for path in (Path("/dev/zero"), tmp_path / "large", tmp_path / "pipe"):
        with pytest.raises(Malformed):
            content(path, 10)
    with pytest.raises(OSError, match="directory"):
        content(tmp_path)


def test_lines_are_bounded_and_come_when_they_are_there() -> None:
    endless = lines_of(io.BytesIO(b"\xef\xbb\xbfstep 1\r\n" * 3 + b"\xff\n"))
    assert [next(endless), next(endless)] == ["step 1", "\ufeffstep 1"]
    for said, why in (
        (b"a\n\xff\n", "is not UTF-8 in line 2"),
        (b"x" * 11, "has a line 1 of more than 10 bytes"),
    ):
        with pytest.raises(Malformed, match=why):
            list(lines_of(io.BytesIO(said), 10))


GRAPHS = {
    "subgraphs": ("dot", "digraph t {" + "{" * 20_000),
    "named subgraphs": ("dot", "digraph t {" + "subgraph a {" * 10_000),
    "a string": ("dot", 'digraph t { "' + "\\n" * 1_000_000),
    "arrows": ("dot", "digraph t {" + "a -> b;" * 5_000 + "}"),
    "a chain": ("dot", "digraph t {a" + " -> a" * 5_000 + "}"),
    "states": (
        "mermaid",
        "stateDiagram-v2\n%% table: t\n" + "".join(f"s{at} --> s{at + 1}\n" for at in range(5_000)),
    ),
    "guards": ("mermaid", "stateDiagram-v2\n%% table: t\na --> b : [" + "[" * 200_000),
    "elements": ("scxml", "<scxml>" + "<state>" * 200_000),
    "entities": ("scxml", "<!DOCTYPE scxml [<!ENTITY a 'b'>]><scxml/>"),
    "a terminal's language": ("dot", 'digraph t { a -> b [when="\x1b[2J"] }'),
}


@pytest.mark.parametrize("case", GRAPHS)
def test_a_hostile_graph_is_a_coded_error(
    tmp_path: Path, case: str, capsys: pytest.CaptureFixture[str]
) -> None:
    form, text = GRAPHS[case]
    (tmp_path / "graph").write_text(text, encoding="utf-8")
    assert run(["table", str(tmp_path / "graph"), "--form", form]) == 1
    said = capsys.readouterr()
    assert "RCS772" in said.out + said.err
    assert "\x1b" not in said.out + said.err


# --- names -----------------------------------------------------------------------------------

EVIL = [
    "../x", "..", ".", "", "/etc/x", "a/b", "a\\b", "a\0b", "a\nb", "a b", "1a", "a-b", 'a"b', "a;b", "a{}", "é", "\uff41", "a.b",
    "a" * 5000, "$(x)", "%s", "a\u202eb", "__import__('os')", 5, None, ["a"], True,
]  # fmt: skip


@pytest.mark.parametrize("text", EVIL, ids=lambda text: repr(text)[:20])
def test_no_other_name_is_an_identifier(text: object) -> None:
    with pytest.raises(BadName) as refused:
        identifier(text)
    assert str(refused.value).isprintable()
    assert len(str(refused.value)) < 200


def test_a_place_is_in_its_folder_or_nowhere(tmp_path: Path) -> None:
    folder, other = tmp_path / "generated", tmp_path / "other"
    (folder / "c").mkdir(parents=True)
    other.mkdir()
    (other / "a.c").touch()
    (folder / "c" / "a.c").symlink_to(other / "a.c")
    (folder / "python").symlink_to(other)
    (folder / "c" / "b.c").symlink_to(folder / "c" / "c.c")
    for parts in (
        ("c", "a.c"),
        ("python", "a.c"),
        ("..", "other"),
        ("c", "../../other/a.c"),
        ("/etc",),
        (".hidden",),
    ):
        with pytest.raises(BadName):
            inside(folder, *parts)
    assert inside(folder, "c", "b.c") == folder / "c" / "b.c"
    (tmp_path / "link").symlink_to(folder)
    assert inside(tmp_path / "link", "c", "b.c").name == "b.c"  # the user's own link to the folder


def test_a_path_of_a_description_stays_in_its_project(tmp_path: Path) -> None:
    root, base = tmp_path / "p", tmp_path / "p" / "deep"
    base.mkdir(parents=True)
    (root / "out").symlink_to(tmp_path)
    for text in ("/etc", "../..", "../../x", "../../generated/x", "../out/x", "a\x1b", "../../generated2", 5):
        with pytest.raises(BadName):
            within(root, base, text)
    assert within(root, base, "../x") == root / "x"
    assert within(root, base, "../../generated") == tmp_path / "generated"
    (tmp_path / "generated").symlink_to("/etc")
    with pytest.raises(BadName):
        within(root, base, "../../generated")


DESCRIPTION = {
    "name": "small",
    "generated": "generated",
    "data": "cell.toml",
    "tick_ms": 40,
    "level": [{"name": "one", "program": "one", "feed": [{"into": "a", "query": "place", "keys": ["b.c"]}]}],
    "buffers": {"outside.go": "one.go"},
    "displays": {"some": ["one.go"]},
}


def _toml(value: object) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(key)} = {_toml(one)}" for key, one in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_toml, value)) + "]"
    return json.dumps(value)


def _with(value: Any, path: tuple[object, ...], new: object) -> Any:
    if not path:
        return new
    at, *rest = path
    if isinstance(value, list):
        return [_with(one, tuple(rest), new) if number == at else one for number, one in enumerate(value)]
    return {key: _with(one, tuple(rest), new) if key == at else one for key, one in value.items()}


PLACES = [
    ("name",), ("generated",), ("data",), ("level", 0, "name"), ("level", 0, "program"), ("level", 0, "feed", 0, "into"),
    ("level", 0, "feed", 0, "query"), ("level", 0, "feed", 0, "keys", 0), ("buffers", "outside.go"), ("displays", "some", 0),
]  # fmt: skip


@pytest.mark.parametrize("place", PLACES, ids=str)
def test_nothing_in_a_description_leads_elsewhere(tmp_path: Path, place: tuple[object, ...]) -> None:
    path = tmp_path / "system.toml"
    for text in ("../../x", "/etc/x", "a\x1b[2J", "a\u202eb", 7, None, ["x"], "a\0b", "x" * 5000):
        if (place, text) == (("data",), None):
            continue  # a system may have none
        said = _with(DESCRIPTION, place, text)
        rows = (f"{key} = {_toml(one)}\n" for key, one in said.items() if one is not None)
        path.write_text("".join(rows), encoding="utf-8")
        with pytest.raises(BadDescription) as refused:
            description(path)
        assert str(refused.value).replace("\n", "").isprintable()


def test_the_description_that_these_are_made_of_is_right(tmp_path: Path) -> None:
    path = tmp_path / "system.toml"
    path.write_text("".join(f"{key} = {_toml(one)}\n" for key, one in DESCRIPTION.items()), encoding="utf-8")
    assert description(path).levels[0].feeds[0].keys == ("b.c",)


# --- a small system, and its log ---------------------------------------------------------------

WALKER = """
## What the level is told.
input go : int 0 .. 3
input far : real 0.0 .. 10.0 [m]
state at : int 0 .. 9
output sent : bool
procedure on { at := min(at + go, 9) }
table walk {
  | line | go   || procedures | sent |
  | rest | 0    ||            | false |
  | move | /= 0 || on         | true  |
}
level walker { period 40 [ms]  table walk }
"""


class Outside:
    def step(self, tick: int, latest: object) -> Mapping[str, tuple[int | float, ...]]:  # noqa: ARG002  # as it is called
        return {"outside.go": (tick % 3,), "outside.far": (tick % 40 * 0.25,)}


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("walker")
    buffers = {"outside.go": "walker.go", "outside.far": "walker.far", "walker.sent": "outside.sent"}
    (folder / "system.toml").write_text(system(["walker"], buffers), encoding="utf-8")
    (folder / "walker.rcs").write_text(WALKER, encoding="utf-8")
    assert write(emitted(shipped("walker.rcs", folder)), str(folder / "generated")) == ()
    return folder


def running(project: Path) -> System:
    return assemble(description(project / "system.toml"), "python", {}, (Outside(),))


def record(project: Path, path: Path, ticks: int) -> Path:
    system = running(project)
    with Recorder(system, path) as recorder:
        system.watch.append(recorder)
        for _ in range(ticks):
            system.step()
    return path


@pytest.fixture(scope="module")
def log(project: Path) -> Path:
    return record(project, project / "run.mcap", 30)


# --- logs: whole, and as they were recorded ----------------------------------------------------


def checked(path: Path) -> ChainCheck:
    found = ChainCheck()
    for _ in records(path, found):
        pass
    return found


def test_a_log_is_sealed(log: Path, capsys: pytest.CaptureFixture[str], project: Path) -> None:
    found = checked(log)
    assert (found.seal, found.good, found.size) == (Seal.WHOLE, log.stat().st_size, log.stat().st_size)
    args = ["replay", str(log), "--generated", str(project / "generated"), "--executor", "python"]
    assert run(args) == 0
    assert "30 ticks replayed: nothing differs; sealed: all" in capsys.readouterr().out


def places(whole: bytes) -> list[int]:
    """All bytes near where a record begins or ends, which mean something by themselves, and every seventh of what records hold."""
    begins, at = [], 8
    while at + 9 < len(whole):
        begins.append(at)
        at += 9 + int.from_bytes(whole[at + 1 : at + 9], "little")
    assert at == len(whole) - 8
    near = {place for one in (*begins, at) for place in range(one - 16, one + 16)}
    return sorted(near & set(range(len(whole))) | set(range(0, len(whole), 7)) | set(range(8)))


def test_every_byte_that_changes_is_noticed(project: Path, tmp_path: Path) -> None:
    path = record(project, tmp_path / "short.mcap", 3)
    whole, missed = path.read_bytes(), []
    for at in places(whole):
        path.write_bytes(whole[:at] + bytes([whole[at] ^ (1 << at % 8)]) + whole[at + 1 :])
        if checked(path).seal is Seal.WHOLE:
            missed.append(at)
    assert missed == []
    path.write_bytes(whole)
    assert checked(path).seal is Seal.WHOLE


def test_every_log_that_is_cut_or_longer_is_noticed(project: Path, tmp_path: Path) -> None:
    path = record(project, tmp_path / "short.mcap", 3)
    whole = path.read_bytes()
    for size in places(whole):
        path.write_bytes(whole[:size])
        assert checked(path).seal is not Seal.WHOLE
    for more in (b"\0", whole[-8:], whole):
        path.write_bytes(whole + more)
        assert checked(path).seal is not Seal.WHOLE


def test_what_is_read_of_a_damaged_log_is_what_was_recorded(log: Path, tmp_path: Path) -> None:
    whole, wanted = log.read_bytes(), read(log)
    path = tmp_path / "damaged.mcap"
    read_some = 0
    for at in range(8, len(whole), 97):
        path.write_bytes(whole[:at] + bytes([whole[at] ^ 0x40]) + whole[at + 1 :])
        try:
            found = read(path)
        except UnreadableLog:
            continue
        read_some += found.last > 0
        for level, then in zip(found.levels, wanted.levels, strict=True):
            assert level.track.packed == then.track.packed[: len(level.track.packed)]
            assert level.sign == then.sign
        for name, track in found.buffers.items():
            assert track.packed == wanted.buffers[name].packed[: len(track.packed)]
    assert read_some


@pytest.mark.parametrize("where", ["cut", "changed", "without a chain"])
def test_replay_of_a_log_that_is_not_whole_says_so(
    where: str, log: Path, project: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    whole, path = log.read_bytes(), tmp_path / "run.mcap"
    if where == "without a chain":
        rewritten(log, path)
    else:
        path.write_bytes(whole[:-9] if where == "cut" else whole[:-40] + b"x" + whole[-39:])
    generated = ["--generated", str(project / "generated"), "--executor", "python"]
    for args in ([], ["--at", "3"], ["--find", "walker.at > 2"]):
        assert run(["replay", str(path), *generated, *args]) == 1
        said = capsys.readouterr()
        assert "RCS707" in said.out + said.err
    assert run(["log", str(path)]) == (1 if where == "changed" else 0)
    shown = capsys.readouterr().out
    assert {"cut": "cut off", "changed": "changed since", "without a chain": "not sealed"}[where] in shown


def rewritten(  # what a forger may change
    source: Path,
    target: Path,
    *,
    chain: bool = False,
    metadata: Callable[[str, dict[str, str]], dict[str, str]] = lambda _, said: said,
    topic: Callable[[str], str] = lambda said: said,
    channel_data: Callable[[dict[str, str]], dict[str, str]] = lambda said: said,
    message: Callable[[int, bytes], tuple[int, bytes] | None] = lambda tick, data: (tick, data),
) -> Path:
    """The log as another program writes it, every CRC right."""
    from mcap.reader import make_reader

    out = Writer(str(target))
    out.start(profile="rcsc", library="rcsc")
    with source.open("rb") as file:
        reader = make_reader(file)
        several = list(reader.iter_metadata())
        for one in several:
            if not one.name.startswith(("rcsc.chain", "rcsc.seal")):
                out.add_metadata(one.name, metadata(one.name, dict(one.metadata)))
        channels: dict[str, int] = {}
        for schema, channel, said in reader.iter_messages(log_time_order=False):
            assert schema is not None
            if channel.topic not in channels:
                number = out.register_schema(schema.name, schema.encoding, schema.data)
                channels[channel.topic] = out.register_channel(
                    topic(channel.topic),
                    channel.message_encoding,
                    number,
                    channel_data(dict(channel.metadata)),
                )
            kept = message(said.sequence, said.data)
            if kept is not None:
                out.add_message(channels[channel.topic], said.log_time, kept[1], said.log_time, kept[0])
        for one in several if chain else ():
            if one.name.startswith(("rcsc.chain", "rcsc.seal")):
                out.add_metadata(one.name, dict(one.metadata))
    out.finish()  # type: ignore[no-untyped-call]  # mcap leaves it untyped
    return target


def test_a_changed_buffer_under_a_kept_chain_is_noticed(log: Path, tmp_path: Path) -> None:
    """Buffers from outside are not replayed: the chain alone shows that one changed."""

    def changed(tick: int, data: bytes) -> tuple[int, bytes]:
        return tick, bytes([data[0] ^ 1]) + data[1:] if len(data) == 1 else data

    path = rewritten(log, tmp_path / "changed.mcap", chain=True, message=changed)
    with pytest.raises(UnreadableLog, match="chain"):
        read(path)


# --- logs: nothing in them is followed, and nothing unpacks to more than their size allows -------


def _facts(key: str, change: Callable[[Any], object]) -> Callable[[str, dict[str, str]], dict[str, str]]:
    def changed(name: str, said: dict[str, str]) -> dict[str, str]:
        if name == "rcsc.system":
            said[key] = (
                json.dumps(change(json.loads(said[key])))
                if key in {"levels", "wires"}
                else str(change(said[key]))
            )
        return said

    return changed


def _sign(change: Callable[[Any], object]) -> Callable[[dict[str, str]], dict[str, str]]:
    def changed(said: dict[str, str]) -> dict[str, str]:
        return {
            key: json.dumps(change(json.loads(text))) if key == "rcsc.signature" else text
            for key, text in said.items()
        }

    return changed


def _set(path: tuple[object, ...], new: object) -> Callable[[Any], object]:
    return lambda said: _with(said, path, new)


FORGED: Mapping[str, Mapping[str, Any]] = {
    "program elsewhere": {"metadata": _facts("levels", _set((0, "program"), "../../evil/evil"))},
    "program, absolute": {"metadata": _facts("levels", _set((0, "program"), "/opt/evil"))},
    "level elsewhere": {"metadata": _facts("levels", _set((0, "name"), "../walker"))},
    "system elsewhere": {"metadata": _facts("name", lambda _: "../../x")},
    "wire": {"metadata": _facts("wires", _set((0, 0), "a\x1b[2J"))},
    "tick": {"metadata": _facts("tick_ms", lambda _: "-1")},
    "tick, endless": {"metadata": _facts("tick_ms", lambda _: "9" * 5000)},
    "nested": {"metadata": lambda name, said: said | {"levels": "[" * 100_000} if name == "rcsc.system" else said},
    "struct": {"channel_data": _sign(_set(("struct_name",), "int x; } evil_t; //"))},
    "init": {"channel_data": _sign(_set(("init",), "system"))},
    "cycle": {"channel_data": _sign(_set(("levels", 0, "cycle"), "system"))},
    "place": {"channel_data": _sign(_set(("leaves", 0, "place"), 'go); __asm__(""'))},
    "attribute": {"channel_data": _sign(_set(("leaves", 0, "attribute"), "__class__.x"))},
    "type": {"channel_data": _sign(_set(("leaves", 0, "c_type"), "9999999s"))},
    "initial": {"channel_data": _sign(_set(("leaves", 0, "initial"), 10**30))},
    "member": {"channel_data": _sign(_set(("leaves", 0, "members"), ["\x1b[2J"]))},
    "period": {"channel_data": _sign(_set(("levels", 0, "period_ms"), 0))},
    "line": {"channel_data": _sign(_set(("tables", "walk"), ["<script>"]))},
    "doc": {"channel_data": _sign(_set(("leaves", 0, "doc"), "\x1b]0;x\x07"))},
    "topic": {"topic": lambda said: said.replace("/levels/walker", "/levels/../walker")},
    "buffer": {"topic": lambda said: said.replace("/buffers/outside.go", "/buffers/../x")},
    "a tick far away": {"message": lambda tick, data: (2**32 - 1 if tick == 30 else tick, data)},
    "a tick before": {"message": lambda tick, data: (29 if tick == 30 else tick, data)},
    "a longer record": {"message": lambda tick, data: (tick, data + b"x")},
    "a cycle left out": {"message": lambda tick, data: None if tick == 20 else (tick, data)},
    "ticks of another length": {"metadata": _facts("tick_ms", lambda said: str(int(said) // 2))},
    "ticks that no period has": {"metadata": _facts("tick_ms", lambda said: str(int(said) - 1))},
    "a level twice": {"metadata": _facts("levels", lambda said: said * 2)},
}  # fmt: skip


@pytest.mark.parametrize("case", FORGED)
def test_a_forged_log_is_refused(
    case: str, log: Path, project: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for folder in ("python", "c"):
        (tmp_path / "evil" / folder).mkdir(parents=True)
        (tmp_path / "evil" / folder / "evil.py").write_text(
            f"open({str(tmp_path / 'ran')!r}, 'w')", encoding="utf-8"
        )
    path = rewritten(log, tmp_path / "forged.mcap", **FORGED[case])
    with pytest.raises(UnreadableLog):
        read(path)
    for kind in ("python", "c"):
        assert run(["replay", str(path), "--generated", str(project / "generated"), "--executor", kind]) == 1
        said = capsys.readouterr()
        assert "RCS701" in said.out + said.err
        assert "\x1b" not in said.out + said.err
    assert not (tmp_path / "ran").exists()


def test_the_forger_changes_nothing_else(log: Path, tmp_path: Path) -> None:
    found = read(rewritten(log, tmp_path / "same.mcap"))
    assert found.level("walker").track.packed == read(log).level("walker").track.packed


def mcap(*several: tuple[int, bytes]) -> bytes:
    frames = b"".join(struct.pack("<BQ", kind, len(body)) + body for kind, body in several)
    return b"\x89MCAP0\r\n" + frames


def chunk(data: bytes, size: int, packed: str, crc: int) -> tuple[int, bytes]:
    name = packed.encode()
    return 6, struct.pack("<QQQII", 0, 0, size, crc, len(name)) + name + struct.pack("<Q", len(data)) + data


MESSAGES = (struct.pack("<BQ", 5, 22) + bytes(22)) * 400_000


BOMBS: Mapping[str, Callable[[], bytes]] = {
    "a size that is not there": lambda: mcap(chunk(b"", 1 << 60, "", 0)),
    "a record longer than the file": lambda: mcap((6, b"")).replace(b"\x06\0", b"\x06\xff", 1),
    "a chunk that unpacks to more": lambda: mcap(
        chunk(zstandard.compress(bytes(1 << 27)), 1 << 27, "zstd", 0)
    ),
    "a chunk that says less": lambda: mcap(chunk(zstandard.compress(bytes(1 << 27)), 100, "zstd", 0)),
    "a chunk that does not say": lambda: mcap(
        chunk(zstandard.ZstdCompressor(write_content_size=False).compress(bytes(1 << 27)), 100, "zstd", 0)
    ),
    "many chunks": lambda: mcap(*[chunk(zstandard.compress(bytes(MOST_CHUNK)), MOST_CHUNK, "zstd", 0)] * 40),
    "many messages": lambda: mcap(
        many := chunk(zstandard.compress(MESSAGES), len(MESSAGES), "zstd", 0), many
    ),
    "another packing": lambda: mcap(chunk(b"x", 1, "lz4", 0)),
    "another content": lambda: mcap(chunk(b"x", 1, "", zlib.crc32(b"y"))),
    "a record longer than its chunk": lambda: mcap(chunk(b"\x05" + b"\xff" * 8, 9, "", 0)),
}


@pytest.mark.parametrize("case", BOMBS)
def test_no_log_unpacks_to_more_than_its_size_allows(
    case: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "bomb.mcap"
    path.write_bytes(BOMBS[case]())
    found = ChainCheck()
    assert sum(1 for _ in records(path, found)) <= 2000 + path.stat().st_size // 16
    assert found.seal is not Seal.WHOLE
    assert run(["log", str(path)]) == 1
    assert "RCS701" in "".join(capsys.readouterr())


CASE = {
    "format": 1, "system": "system.toml", "variants": [], "expect": "kept",
    "goal": {"level": "walker", "what": "gap", "table": "walk", "name": "", "lines": []}, "start": {}, "ticks": [],
}  # fmt: skip


@pytest.mark.parametrize(
    "system", ["/etc/passwd", "../../../../etc/system.toml", "a\x1b[2J", 5, None, ["x"], "out/system.toml"]
)
def test_a_frozen_case_stays_in_its_project(
    system: object, project: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "out").symlink_to(project)
    (tmp_path / "case.json").write_text(json.dumps(CASE | {"system": system}), encoding="utf-8")
    with pytest.raises(BadCaseError):
        read_case(tmp_path / "case.json")


# --- symbol files ------------------------------------------------------------------------------

SYMBOLS = [
    ("program",), ("struct",), ("init",), ("leaves", 0, "name"), ("leaves", 0, "path"), ("leaves", 0, "attribute"),
    ("leaves", 0, "c_type"), ("leaves", 0, "kind"), ("leaves", 0, "initial"), ("leaves", 0, "doc"), ("leaves", 0, "low"),
    ("levels", 0, "name"), ("levels", 0, "cycle"), ("levels", 0, "period_ms"), ("tables", 0, "name"), ("tables", 0, "lines", 0),
    ("levels",), ("leaves",), ("tables",), ("monitored",),
]  # fmt: skip


TEXTS: list[object] = ["../x", "a\x1b[2J", 'x; system("id")', {"a": 1}, [], None]
MAY_BE = [
    ("low", None), ("doc", "../x"), ("doc", TEXTS[2]), ("monitored", []), ("levels", []), ("leaves", []),
]  # fmt: skip


@pytest.mark.parametrize("place", SYMBOLS, ids=str)
def test_nothing_in_a_symbol_file_becomes_code(
    project: Path, tmp_path: Path, place: tuple[object, ...]
) -> None:
    said = json.loads((project / "generated" / "c" / "walker.json").read_text(encoding="utf-8"))
    path = tmp_path / "walker.json"
    for text in TEXTS:
        if (place[-1], text) not in MAY_BE:
            path.write_text(json.dumps(_with(said, place, text)), encoding="utf-8")
            with pytest.raises(ValueError, match="no symbol file"):
                signature(path)


def test_an_enumeration_has_no_more_members_than_its_type_tells_apart(project: Path, tmp_path: Path) -> None:
    said = json.loads((project / "generated" / "c" / "walker.json").read_text(encoding="utf-8"))
    path = tmp_path / "walker.json"
    for c_type, most in (("uint8_t", 2**8), ("uint16_t", 2**16), ("uint64_t", 0)):
        said["leaves"][0] |= {"c_type": c_type, "initial": 0}
        for count in {most, most + 1} - {0}:
            said["leaves"][0]["members"] = [f"m{number}" for number in range(count)]
            path.write_text(json.dumps(said), encoding="utf-8")
            if count == most:
                leaf = signature(path).leaves[0]
                assert len(kind_of(leaf)) < 400
                assert kind_of(leaf).endswith(f" and {most - 40} more")
            else:
                with pytest.raises(
                    ValueError, match=f"has {count} members, more than a `{c_type}` can tell apart"
                ):
                    signature(path)


def test_a_field_is_matched_to_its_end() -> None:
    for text in ("b\n", "\nb", "b "):
        with pytest.raises(Malformed):
            CheckedFields({"a": text}).name("a")


# --- written whole or not at all -----------------------------------------------------------------

SCRATCH = (
    "rcsc/compose/counterexample/rerun.py", "rcsc/desk/shell/reload/reload.py", "rcsc/run/executors.py",
    "rcsc/views/diff/revision.py", "rcsc/code/testing/executors/native.py", "rcsc/code/testing/esbmc.py",
    "rcsc/code/testing/matcher.py", "rcsc/base/host/tools.py", "rcsc/code/testing/code_mutants.py", "rcsc/run/orders/together.py",
    "rcsc/run/link/beside.py", "rcsc/views/evidence/analysers.py", "rcsc/views/evidence/llvm.py", "rcsc/views/evidence/runtime.py",
    "rcsc/code/testing/boards.py", "rcsc/code/testing/target_coverage.py",
)  # fmt: skip
"""Who writes into temporary folders that end with the process."""
STREAMS = (
    "rcsc/base/host/files/write.py",
    "rcsc/run/log/recorder.py",
    "rcsc/run/campaign/journal.py",
    "rcsc/front/commands/systems/shell.py",
    "rcsc/run/processes/block.py",
    "rcsc/views/pages/video.py",
)
"""The writer itself, what is added to at its end and read as far as it goes, and what is no file of the disk's."""


def _writes(node: ast.Call) -> bool:
    what = (
        node.func.attr
        if isinstance(node.func, ast.Attribute)
        else node.func.id
        if isinstance(node.func, ast.Name)
        else ""
    )
    said = [
        one.value
        for one in (*node.args, *(word.value for word in node.keywords))
        if isinstance(one, ast.Constant)
    ]
    modes = [one for one in said if isinstance(one, str) and re.fullmatch(r"[rwaxbt+]{1,4}", one)]
    if what in {"open", "fdopen", "NamedTemporaryFile"}:
        return any(set(mode) & set("wax+") for mode in modes) and "os.devnull" not in ast.unparse(node)
    return what in {"write_text", "write_bytes", "mkstemp", "copyfile", "copytree", "savetxt", "rename"}


def test_files_are_written_by_the_one_writer() -> None:
    wrong = [
        f"{name}:{node.lineno}"
        for name, nodes in sources()
        if name not in SCRATCH + STREAMS
        for node in nodes
        if isinstance(node, ast.Call) and _writes(node)
    ]
    assert wrong == []


FULL = """
import resource, sys
from rcsc.front.commands import main
resource.setrlimit(resource.RLIMIT_FSIZE, ({most}, {most}))
sys.argv = ["rcsc", *sys.argv[1:]]
main()
"""


def limited(most: int, *args: object, cwd: Path) -> subprocess.CompletedProcess[str]:
    """`rcsc` where no file grows beyond `most` bytes, as on a full disk."""
    said = [sys.executable, "-c", FULL.format(most=most), *map(str, args)]
    return subprocess.run(
        said, cwd=cwd, capture_output=True, text=True, check=False, env=os.environ | {"PYTHONPATH": str(REPO)}
    )


WHOLE: Mapping[str, tuple[str, ...]] = {
    "generated files": ("compile", "walker.rcs", "-o", "out"),
    "a report": ("check", "walker.rcs", "--format", "json", "-o", "out.json"),
    "a graph": ("graph", "walker.rcs:walk", "--form", "dot", "--state", "at", "-o", "out.dot"),
    "a table of a log": ("log", "run.mcap", "--csv", "out.csv"),
    "all of a log": ("log", "run.mcap", "--json", "out.json"),
}


@pytest.mark.parametrize("case", WHOLE)
def test_on_a_full_disk_a_file_stays_as_it_was(
    case: str, project: Path, log: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(project, tmp_path, dirs_exist_ok=True)
    assert log.name == "run.mcap"
    args = WHOLE[case]
    monkeypatch.chdir(tmp_path)
    assert run([*args]) == 0
    target = tmp_path / args[-1]
    files = sorted(path for path in target.rglob("*") if path.is_file()) if target.is_dir() else [target]
    before = dict.fromkeys(files, b"before")
    for path in files:
        path.write_bytes(b"before")
    ended = limited(64, *args, cwd=tmp_path)
    assert ended.returncode == 1
    assert "RCS502" in ended.stderr + ended.stdout
    assert "RCS902" not in ended.stderr
    assert {path: path.read_bytes() for path in files} == before
    assert [path for path in tmp_path.rglob(".*") if path.is_file() and ".rcsc-cache" not in path.parts] == []


def stepped(system: System, ticks: int) -> None:
    for _ in range(ticks):
        system.step()


def test_on_a_full_disk_a_log_is_kept_as_far_as_it_goes(project: Path, tmp_path: Path) -> None:
    system = running(project)
    was = resource.getrlimit(resource.RLIMIT_FSIZE)
    path = tmp_path / "run.mcap"
    recorder = Recorder(system, path)
    system.watch.append(recorder)
    resource.setrlimit(resource.RLIMIT_FSIZE, (path.stat().st_size + 5000, was[1]))
    try:
        with pytest.raises(OSError, match="kept up to cycle") as full:
            stepped(system, 1000)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, was)
    recorder.close()
    kept = read(path)
    assert kept.checked.seal is Seal.CUT
    assert f"kept up to cycle {kept.last}:" in f"{full.value.strerror}:"
    assert kept.last >= 50


@pytest.mark.parametrize("closed", [">&-", "2>&-", "<&-", ">&- 2>&- <&-", "<&- | head -c 1"])
def test_streams_that_are_closed_are_no_bug(closed: str, project: Path) -> None:
    command = f"{sys.executable} -c 'from rcsc.front.commands import main; main()' explain RCS401 {closed}"
    ended = subprocess.run(["sh", "-c", command], cwd=project, capture_output=True, text=True, check=False,
                           env=os.environ | {"PYTHONPATH": str(REPO)})  # fmt: skip
    assert (ended.returncode, ended.stderr) == (0, "")


# --- what other programs make of what is written -------------------------------------------------

FORMULAS = [
    "=1+1", "+1", "-1", "@SUM(A1)", "\t=1", "\r=1", " =1", "\n=1", "\uff1d1", '=HYPERLINK("http://x")',
    "=cmd|' /C x'!A0",
]  # fmt: skip


def test_no_text_of_a_csv_file_is_a_formula() -> None:
    rows = list(
        csv.reader(io.StringIO(csv_text([FORMULAS, ["a,b", 'c"d', "e\nf", -1, -1.5, "", "a=1"]]), newline=""))
    )
    assert [cell[:1] for cell in rows[0]] == ["'"] * len(FORMULAS)
    assert rows[1] == ["a,b", 'c"d', "e\nf", "-1", "-1.5", "", "a=1"]


HOSTILE_TEXTS = ["a|b", "<script>alert(1)</script>", "<img src=x onerror=y>", "[a](javascript:b)", "![a](http://b)", "a\nb|c", "`a|b`",
                 "``", "`", "&lt;", "\x1b[2J", "a\u202eb", "</details>", "\\", "\\|", "a\r\n# b", "{{ x }}",
                 "]]>", "'\"><svg onload=x>"]  # fmt: skip


@pytest.mark.parametrize("text", HOSTILE_TEXTS, ids=repr)
def test_no_text_ends_a_cell_of_markdown_or_marks_anything_up(text: str) -> None:
    for said in (forms._cell(text), forms._code(text)):
        assert "\n" not in said
        assert said.isprintable()
        assert re.search(r"(?<!\\)(?:\\\\)*\|", said) is None
        assert said.count("`") % 2 == 0
    assert "<" not in forms._cell(text)
    assert "](" not in forms._cell(text)


@pytest.mark.parametrize("text", HOSTILE_TEXTS, ids=repr)
def test_no_text_becomes_markup_in_a_page_or_a_drawing(text: str) -> None:
    shown = str(quoted(text))
    assert re.sub(r"</?code>", "", shown).count("<") == 0
    edge = Edge(text, text, text, text, "procedures(a)", text, shown=text)
    graph = StateGraph(text, text, (edge,), initial=text, states=(text, "b"))
    plain = re.sub(r"[\x00-\x08\x0b-\x1f]", "", svg(graph))
    root = xml_of(plain)
    known = {*"svg style text g path title rect circle line tspan polygon ellipse marker defs".split()}
    assert {element.tag.rpartition("}")[2] for element in root.iter()} <= known
