"""What the server tells unasked, to clients that work on several files, or count no versions."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tests.editor.client import PUSHED, Client


def _of(uri: str, version: int) -> Callable[[Any], bool]:
    """What is told of a version of a file."""
    return lambda each: (each["uri"], each["version"]) == (uri, version)


@pytest.mark.parametrize("leaves", ["closed", "without"])
def test_what_is_found_in_a_file_is_told_as_long_as_an_open_one_uses_it(leaves: str, tmp_path: Path) -> None:
    """Also where another open file used it, and is closed or does without it."""
    texts = {"used.rcs": "input x : int 0 ..\n", "one.rcs": "use used\n", "other.rcs": "use used\n"}
    for name, text in texts.items():
        (tmp_path / name).write_text(text)
    client = Client(tmp_path, PUSHED)
    told = "textDocument/publishDiagnostics"

    def found(uri: str) -> int:
        return len([each for each in client.told[told] if each["uri"] == uri][-1]["diagnostics"])

    for name in ("one.rcs", "other.rcs"):
        client.open(name, texts[name])
        client.heard_ever("rcsc/status", _of(client.uri(name), 1))
    if leaves == "closed":
        client.tell("textDocument/didClose", {"textDocument": {"uri": client.uri("one.rcs")}})
    else:
        client.change("one.rcs", "input y : bool\n")
        client.heard_ever("rcsc/status", _of(client.uri("one.rcs"), 2))
    client.run("rcsc.status", client.uri("other.rcs"))  # what was told before its answer has arrived
    assert found(client.uri("used.rcs")) == 1
    client.tell("textDocument/didClose", {"textDocument": {"uri": client.uri("other.rcs")}})
    client.run("rcsc.status", client.uri("one.rcs"))
    assert found(client.uri("used.rcs")) == 0
    client.stop()


@pytest.mark.parametrize("version", [{}, {"version": None}])
def test_a_client_that_counts_no_versions_is_heard(version: dict[str, None], tmp_path: Path) -> None:
    """The protocol once allowed it; its changes are looked at as all are, and told without a version."""
    client = Client(tmp_path, PUSHED)
    told, uri = "textDocument/publishDiagnostics", client.uri("a.rcs")
    item = {"uri": uri, "languageId": "rcs", "text": "input x : int 0 ..\n", **version}
    client.tell("textDocument/didOpen", {"textDocument": item})
    assert client.heard_that(told, lambda each: each["diagnostics"])["uri"] == uri
    changes = [{"text": "input x : int 0 .. 1\n"}]
    client.tell(
        "textDocument/didChange", {"textDocument": {"uri": uri, **version}, "contentChanges": changes}
    )
    mended = client.heard_that(told, lambda each: not each["diagnostics"])
    assert (mended["uri"], "version" in mended) == (uri, False)
    assert client.run("rcsc.status", uri)["version"] is None
    client.stop()
