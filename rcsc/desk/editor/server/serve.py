"""The server put together: what is open, what changes, what is told without being asked.

In: a client on standard input and output. Out: nothing; it ends with the client.
"""

import contextlib
import os
import sys
from typing import BinaryIO

from lsprotocol import types
from pygls import uris
from pygls.lsp.server import LanguageServer

from rcsc import __version__
from rcsc.base.host.memory import settled
from rcsc.desk.editor.places import Units
from rcsc.desk.editor.server import features, findings
from rcsc.desk.editor.server.convert import reads_messages
from rcsc.desk.editor.server.findings import by_file, status_of
from rcsc.desk.editor.server.session import Session
from rcsc.desk.editor.values import Answer
from rcsc.lang.syntax.parse import ready
from rcsc.proof.solvers.options import Options

STATUS = "rcsc/status"
"""The notification that says the standing of each table of a file, after each check."""
_WATCHED = "**/{*.rcs,rcsc.toml}"


def at_rest() -> None:
    """Do, while nobody types, the work that would keep a key waiting."""
    ready()
    settled()


class Server(LanguageServer):
    """A language server for one client.

    Attributes:
        session: What the client has open.
    """

    def __init__(self, options: Options) -> None:
        super().__init__(
            "rcsc", __version__, types.TextDocumentSyncKind.Full, converter_factory=reads_messages
        )
        self.session = Session(self.told, options, rests=at_rest)
        self._shown: dict[str, set[str]] = {}
        _lifecycle(self)
        _texts(self)
        features.register(self, self.session)
        findings.register(self, self.session)

    async def told(self, answer: Answer) -> None:
        """Send what is new: findings to clients that do not ask for them, the standings, and that lenses may differ."""
        if self.session.is_told(answer):
            return
        if not self._pulls:
            self._push(answer)
        self.protocol.notify(STATUS, status_of(self.session, answer))
        self._refresh()

    @property
    def _pulls(self) -> bool:
        """True if the client asks for findings itself."""
        document = self.client_capabilities.text_document
        return document is not None and document.diagnostic is not None

    def _push(self, answer: Answer) -> None:
        """Send the findings of a file and of those that it uses; clear those of files that have none any more."""
        converter = self.session.converter(answer.texts)
        found = {
            file: each
            for file, each in by_file(answer).items()
            if file == answer.file or file not in self.session.uris
        }
        for file in self._shown.pop(answer.file, set()) - found.keys() - self._held():
            found[file] = []
        self._shown[answer.file] = {file for file, each in found.items() if each}
        for file, each in found.items():
            self.text_document_publish_diagnostics(
                types.PublishDiagnosticsParams(
                    converter.uri(file),
                    [converter.diagnostic(one) for one in each],
                    self.session.versions.get(file),
                )
            )

    def clear(self, path: str) -> None:
        """Take back the findings of a file that is closed."""
        for file in {path, *self._shown.pop(path, set())} - self._held():
            uri = uris.from_fs_path(file)
            if uri is not None and not self._pulls:
                self.text_document_publish_diagnostics(types.PublishDiagnosticsParams(uri, []))

    def _held(self) -> set[str]:
        """Return the files whose findings stay: those that are open, and those in which another open file has some."""
        return self.session.uris.keys() | set[str]().union(*self._shown.values())

    def _refresh(self) -> None:
        """Ask the client to ask again for answers that may differ, if it can."""
        workspace = self.client_capabilities.workspace
        if workspace is None:
            return
        if self._pulls and workspace.diagnostics and workspace.diagnostics.refresh_support:
            self.workspace_diagnostic_refresh(None)
        if workspace.code_lens and workspace.code_lens.refresh_support:
            self.workspace_code_lens_refresh(None)
        if workspace.inlay_hint and workspace.inlay_hint.refresh_support:
            self.workspace_inlay_hint_refresh(None)


def _lifecycle(server: Server) -> None:
    session = server.session

    @server.feature(types.INITIALIZE)
    def initialize(params: types.InitializeParams) -> None:
        folders = [folder.uri for folder in params.workspace_folders or ()] or [params.root_uri or ""]
        session.folders = (
            [path for uri in folders if (path := uris.to_fs_path(uri)) is not None] if any(folders) else []
        )
        session.units = Units(server.workspace.position_encoding or Units.UTF_16)
        options = params.initialization_options
        session.shows = not (isinstance(options, dict) and options.get("silent") is True)

    @server.feature(types.INITIALIZED)
    async def initialized(_params: types.InitializedParams) -> None:
        workspace = server.client_capabilities.workspace
        watches = workspace.did_change_watched_files if workspace is not None else None
        if watches is not None and watches.dynamic_registration:
            options = types.DidChangeWatchedFilesRegistrationOptions([types.FileSystemWatcher(_WATCHED)])
            registration = types.Registration("watched", types.WORKSPACE_DID_CHANGE_WATCHED_FILES, options)
            with contextlib.suppress(Exception):  # a client that refuses it is asked less often
                await server.client_register_capability_async(types.RegistrationParams([registration]))

    @server.feature(types.SHUTDOWN)
    def shutdown(_params: None) -> None:
        session.stop()


def _texts(server: Server) -> None:
    session = server.session

    @server.feature(types.TEXT_DOCUMENT_DID_OPEN)
    async def opened(params: types.DidOpenTextDocumentParams) -> None:
        document = params.text_document
        session.open(document.uri, document.text, document.version)

    @server.feature(types.TEXT_DOCUMENT_DID_CHANGE)
    async def changed(params: types.DidChangeTextDocumentParams) -> None:
        if params.content_changes:
            document = params.text_document
            session.open(document.uri, params.content_changes[-1].text, document.version)

    @server.feature(types.TEXT_DOCUMENT_DID_CLOSE)
    async def closed(params: types.DidCloseTextDocumentParams) -> None:
        path = session.path(params.text_document.uri)
        session.close(params.text_document.uri)
        server.clear(path)

    @server.feature(types.TEXT_DOCUMENT_DID_SAVE)
    async def saved(params: types.DidSaveTextDocumentParams) -> None:
        session.changed(session.path(params.text_document.uri))

    @server.feature(types.WORKSPACE_DID_CHANGE_WATCHED_FILES)
    async def watched(_params: types.DidChangeWatchedFilesParams) -> None:
        session.changed("")


def serve(options: Options, stdin: BinaryIO, stdout: BinaryIO) -> None:
    """Serve one client until it ends; other output goes to standard error."""
    with contextlib.redirect_stdout(sys.stderr):
        server = Server(options)
        try:
            server.start_io(stdin, stdout)
        finally:
            server.session.stop()
            sys.stderr.flush()
            os._exit(0)  # a proof that runs cannot be stopped, and nobody waits for it
