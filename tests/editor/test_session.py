"""What a client has open, asked without a process: no answer is of another text than the client has, and a bug ends no talk."""

import asyncio
import os
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest
from lsprotocol import types
from pygls.exceptions import JsonRpcContentModified

from rcsc.desk.editor.memo import OutdatedError
from rcsc.desk.editor.server.serve import Server
from rcsc.desk.editor.server.session import Session
from rcsc.desk.editor.values import Answer, State
from rcsc.proof.solvers.options import Options

TABLE = """input now : bool
input w : int 0 .. 9
output out : int 0 .. 3
table t {
  | line | now   | w    || out |
  |------|-------|------||-----|
  | a    | true  | <= 4 || 1   |
  | b    | false |  || 2   |
}
"""
START, END = types.Position(0, 0), types.Position(8, 0)
EDITING: list[tuple[str, Callable[[types.TextDocumentIdentifier], Any]]] = [
    (
        types.TEXT_DOCUMENT_CODE_ACTION,
        lambda each: types.CodeActionParams(each, types.Range(START, END), types.CodeActionContext([])),
    ),
    (
        types.TEXT_DOCUMENT_FORMATTING,
        lambda each: types.DocumentFormattingParams(each, types.FormattingOptions(2, insert_spaces=True)),
    ),
    (
        types.TEXT_DOCUMENT_RANGE_FORMATTING,
        lambda each: types.DocumentRangeFormattingParams(
            each, types.Range(START, END), types.FormattingOptions(2, insert_spaces=True)
        ),
    ),
    (
        types.TEXT_DOCUMENT_ON_TYPE_FORMATTING,
        lambda each: types.DocumentOnTypeFormattingParams(
            each, types.Position(7, 12), "|", types.FormattingOptions(2, insert_spaces=True)
        ),
    ),
    (types.TEXT_DOCUMENT_RENAME, lambda each: types.RenameParams(each, types.Position(1, 6), "width")),
]
"""Requests whose answer is edits that a client makes in the text that it has."""
KEYS = ["rcsc.nextCell", "rcsc.previousCell", "rcsc.addRow", "rcsc.insertColumn"]


class Late(ThreadPoolExecutor):
    """A worker that ends just as the client types on, after it has looked whether it does for the last time."""

    def __init__(self, typed: Callable[[], None]) -> None:
        super().__init__(1)
        self.typed = typed

    def submit(self, fn: Callable[..., Any], /, *given: Any, **named: Any) -> Future[Any]:
        def late() -> Any:
            answer = fn(*given, **named)
            self.typed()
            return answer

        return super().submit(late)


async def opened(folder: Path, *, late: bool) -> tuple[Server, str]:
    """A server with a file open that can be mended, laid out and renamed in."""
    server = Server(Options())
    session, uri = server.session, (folder / "t.rcs").as_uri()
    (folder / "t.rcs").write_text(TABLE)
    session.open(uri, TABLE, 1)
    if session._waiting is not None:
        session._waiting.cancel()

    def typed() -> None:
        session.turn += 1

    if late:
        session._reads, session._proves = Late(typed), Late(typed)
    return server, uri


@pytest.mark.parametrize("late", [False, True])
@pytest.mark.parametrize(("method", "params"), EDITING, ids=[each for each, _ in EDITING])
def test_edits_of_a_text_that_was_typed_on_are_not_answered(
    method: str, params: Callable[[types.TextDocumentIdentifier], Any], late: bool, tmp_path: Path
) -> None:
    async def ask() -> Any:
        server, uri = await opened(tmp_path, late=late)
        return await server.protocol.fm.features[method](params(types.TextDocumentIdentifier(uri)))

    if late:
        with pytest.raises(JsonRpcContentModified):
            asyncio.run(ask())
    else:
        assert asyncio.run(ask())


@pytest.mark.parametrize("late", [False, True])
@pytest.mark.parametrize("command", KEYS)
def test_keys_in_a_text_that_was_typed_on_do_nothing(command: str, late: bool, tmp_path: Path) -> None:
    async def ask() -> Any:
        server, uri = await opened(tmp_path, late=late)
        return await server.protocol.fm.commands[command](uri, types.Position(6, 5))

    if late:
        with pytest.raises(JsonRpcContentModified):
            asyncio.run(ask())
    else:
        assert asyncio.run(ask())


@pytest.mark.parametrize("method", ["reading", "editing", "proving"])
def test_whatever_a_worker_raises_is_the_answer(method: str) -> None:
    """A future would hear nothing of `StopIteration`, and who asks would wait for ever."""

    async def listens(_: Answer) -> None:
        pass

    def fails() -> None:
        next(iter(()))

    async def ask() -> None:
        session = Session(listens)
        await asyncio.wait_for(getattr(session, method)(fails), 60)

    with pytest.raises(RuntimeError):
        asyncio.run(ask())


@pytest.mark.parametrize("method", ["answer", "final"])
def test_an_answer_that_a_key_overtakes_is_outdated(method: str, tmp_path: Path) -> None:
    async def ask() -> None:
        server, _ = await opened(tmp_path, late=True)
        await getattr(server.session, method)(str(tmp_path / "t.rcs"))

    with pytest.raises(OutdatedError):
        asyncio.run(ask())


def test_an_answer_points_into_the_text_that_it_is_of(tmp_path: Path) -> None:
    """Whatever has been typed since."""

    async def ask() -> Answer:
        server, uri = await opened(tmp_path, late=False)
        answer = await server.session.final(str(tmp_path / "t.rcs"))
        server.session.open(uri, "", 2)
        return answer

    answer = asyncio.run(ask())
    assert answer.texts == {str(tmp_path / "t.rcs"): TABLE}


def test_a_bug_in_the_way_of_one_file_is_told_and_the_others_are_looked_at(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """And the next text of it, too."""
    told: list[Answer] = []
    bad, good = str(tmp_path / "bad.rcs"), str(tmp_path / "good.rcs")

    async def listens(answer: Answer) -> None:
        told.append(answer)

    async def type_in_both() -> None:
        session = Session(listens)
        read = session.workspace.reading

        def fails(path: str) -> Any:
            if "bug" in session.workspace.overlay[os.path.realpath(path)]:
                raise RecursionError
            return read(path)

        monkeypatch.setattr(type(session.workspace), "reading", lambda _, path: fails(path))
        session.open(Path(good).as_uri(), TABLE, 1)
        for version, text in ((1, TABLE + "# bug\n"), (2, TABLE)):
            session.open(Path(bad).as_uri(), text, version)
            assert session._waiting is not None
            await session._waiting
        session.stop()

    asyncio.run(type_in_both())
    of_bad = [answer for answer in told if answer.file == bad]
    assert [each.code for each in of_bad[0].findings] == ["RCS902"]
    assert not of_bad[0].whole
    assert [str(each.standing.state) for each in of_bad[0].tables] == [State.UNDECIDED]
    assert [each.code for each in of_bad[-1].findings] == ["RCS401"]
    assert [each.code for each in next(one for one in told if one.file == good).findings] == ["RCS401"]
    assert "RecursionError" in capsys.readouterr().err


def test_a_key_is_looked_at_at_once_and_keys_that_come_faster_when_they_rest(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With a rest of an hour the first answer comes all the same; what is typed meanwhile has the last text alone looked at."""
    path = tmp_path / "t.rcs"
    monkeypatch.setattr("rcsc.desk.editor.server.session.RESTS_S", 3600.0)
    heard: asyncio.Queue[Answer] = asyncio.Queue()
    glanced: list[str] = []

    async def typed() -> list[str]:
        session = Session(heard.put)
        glance = session.workspace.glance

        def counted(file: str, go_on: Callable[[], bool], since_s: float) -> Answer:
            glanced.append(session.workspace.overlay[os.path.realpath(file)])
            return glance(file, go_on, since_s)

        monkeypatch.setattr(type(session.workspace), "glance", lambda _, *asked: counted(*asked))
        for version in (1, 2, 3):
            session.open(path.as_uri(), f"{TABLE}# {version}\n", version)
            answer = await asyncio.wait_for(heard.get(), 60)
            assert answer.texts == {str(path): f"{TABLE}# {version}\n"}
        monkeypatch.setattr("rcsc.desk.editor.server.session.RESTS_S", 0.2)
        for version in range(4, 40):
            session.open(path.as_uri(), f"{TABLE}# {version}\n", version)
        assert session._waiting is not None
        await session._waiting
        session.stop()
        return glanced

    assert [text.removeprefix(TABLE) for text in asyncio.run(typed())] == [
        "# 1\n",
        "# 2\n",
        "# 3\n",
        "# 39\n",
    ]


def test_what_would_keep_a_key_waiting_is_done_once_all_is_answered(tmp_path: Path) -> None:
    """And not while somebody types."""
    path = tmp_path / "t.rcs"
    done: list[str] = []

    async def listens(answer: Answer) -> None:
        done.append("final" if answer.final else "glance")

    async def typed() -> None:
        session = Session(listens, rests=lambda: done.append("rests"))
        for version in range(5):
            session.open(path.as_uri(), f"{TABLE}# {version}\n", version)
        assert session._waiting is not None
        await session._waiting
        session.stop()

    asyncio.run(typed())
    assert done[-2:] == ["final", "rests"]
    assert done.count("rests") == 1
