"""Findings, repairs, lenses and shares: what waits for a check of the text as it is.

In: requests. Out: the protocol's answers. One that is outdated is told so, and asked again by the client.
"""

from lsprotocol import types
from pygls.exceptions import JsonRpcException
from pygls.lsp.server import LanguageServer

from rcsc.desk.editor.lenses import Shown, drawn, mended, proved_anew, witness_run
from rcsc.desk.editor.memo import OutdatedError
from rcsc.desk.editor.names.about import share_text
from rcsc.desk.editor.places import Lines, difference
from rcsc.desk.editor.server.convert import Converter
from rcsc.desk.editor.server.session import Session, current
from rcsc.desk.editor.values import Answer, Finding, Grid

MOST_ACTIONS = 12
"""Repairs offered at one place: each is checked first."""
FIX_ALL = "source.fixAll.rcsc"


class CancelledError(JsonRpcException):
    """The server gives an answer up that is outdated; the client asks again."""

    CODE = -32802


def register(server: LanguageServer, session: Session) -> None:
    """Register the answers to these requests with the server."""
    _pulled(server, session)
    _actions(server, session)
    _lenses(server, session)


def by_file(answer: Answer) -> dict[str, list[Finding]]:
    """Return the findings of each file; the file itself is there even without any."""
    found: dict[str, list[Finding]] = {answer.file: []}
    for finding in answer.findings:
        found.setdefault(finding.area.file, []).append(finding)
    return found


# --- findings ----------------------------------------------------------------------


def _pulled(server: LanguageServer, session: Session) -> None:
    options = types.DiagnosticOptions(
        inter_file_dependencies=True, workspace_diagnostics=False, identifier="rcsc"
    )

    @server.feature(types.TEXT_DOCUMENT_DIAGNOSTIC, options)
    async def pulled(
        params: types.DocumentDiagnosticParams,
    ) -> types.RelatedFullDocumentDiagnosticReport | types.RelatedUnchangedDocumentDiagnosticReport:
        path = session.path(params.text_document.uri)
        try:
            answer = await session.answer(path)
        except OutdatedError as outdated:
            data = types.DiagnosticServerCancellationData(retrigger_request=True)
            raise CancelledError("the text has changed meanwhile", data=data) from outdated
        known = session.result_of(answer)
        if params.previous_result_id == known:
            return types.RelatedUnchangedDocumentDiagnosticReport(known)
        converter = session.converter(answer.texts)
        found = by_file(answer)
        items = [converter.diagnostic(each) for each in found.pop(path)]
        related = {
            converter.uri(file): types.FullDocumentDiagnosticReport(
                [converter.diagnostic(each) for each in findings]
            )
            for file, findings in found.items()
            if file not in session.uris
        }
        return types.RelatedFullDocumentDiagnosticReport(
            items, related_documents=dict(related) or None, result_id=known
        )


# --- repairs -----------------------------------------------------------------------


def _actions(server: LanguageServer, session: Session) -> None:
    kinds: list[types.CodeActionKind | str] = [types.CodeActionKind.QuickFix, FIX_ALL]

    @server.feature(types.TEXT_DOCUMENT_CODE_ACTION, types.CodeActionOptions(code_action_kinds=kinds))
    @current
    async def actions(params: types.CodeActionParams) -> list[types.CodeAction]:
        path = session.path(params.text_document.uri)
        answer = await session.final(path)
        converter = session.converter(answer.texts)
        only = params.context.only
        found: list[types.CodeAction] = []
        if only is None or any(
            "quickfix".startswith(str(kind)) or str(kind).startswith("quickfix") for kind in only
        ):
            found += await session.proving(_quick, session, converter, answer, params.range)
        if only is not None and any(FIX_ALL.startswith(str(kind)) for kind in only):
            found += await session.proving(_every, session, converter, path)
        return found


def _quick(
    session: Session, converter: Converter, answer: Answer, within: types.Range
) -> list[types.CodeAction]:
    """Return the repairs of the findings that touch a range."""
    found: list[types.CodeAction] = []
    for finding in answer.findings:
        if len(found) >= MOST_ACTIONS:
            break
        if finding.mendable and finding.area.file == answer.file and _touches(converter, finding, within):
            told = converter.diagnostic(finding)
            for repair in session.workspace.repairs(finding):
                title = f"{repair.title}: proved, {repair.proved}" if repair.certain else repair.title
                found.append(
                    types.CodeAction(
                        title,
                        types.CodeActionKind.QuickFix,
                        [told],
                        is_preferred=repair.certain and repair.clears,
                        edit=converter.edits(repair.edits),
                    )
                )
    return found


def _touches(converter: Converter, finding: Finding, within: types.Range) -> bool:
    """Tell whether a finding, or a line that it is about, has a line of text in common with a range."""
    areas = [finding.area, *(area for area, _ in finding.related)]
    areas += [line.area for each in finding.witnesses for line in each.lines if line.area is not None]
    places = [converter.range(area) for area in areas if area.file == finding.area.file]
    return any(each.start.line <= within.end.line and within.start.line <= each.end.line for each in places)


def _every(session: Session, converter: Converter, path: str) -> list[types.CodeAction]:
    text = session.workspace.text(path)
    new, count = mended(session.workspace, path)
    if not count:
        return []
    edits = converter.edits(difference(path, Lines(text), new))
    return [types.CodeAction(f"apply {count} proved repairs", FIX_ALL, edit=edits)]


# --- lenses and shares -------------------------------------------------------------


def _lenses(server: LanguageServer, session: Session) -> None:
    @server.feature(types.TEXT_DOCUMENT_CODE_LENS)
    @current
    async def lenses(params: types.CodeLensParams) -> list[types.CodeLens]:
        uri = params.text_document.uri
        answer = await session.answer(session.path(uri))
        converter = session.converter(answer.texts)
        return [lens for grid in answer.tables for lens in _of_table(converter, answer, grid, uri)]

    @server.feature(types.TEXT_DOCUMENT_INLAY_HINT)
    @current
    async def hints(params: types.InlayHintParams) -> list[types.InlayHint]:
        answer = await session.answer(session.path(params.text_document.uri))
        return list(_shares(session.converter(answer.texts), answer, params.range))

    @server.command("rcsc.prove")
    @current
    async def prove(uri: str, table: str) -> dict[str, object]:
        reading = session.workspace.reading(session.path(uri))
        return _show(server, session, await session.proving(proved_anew, reading, table, session.options))

    @server.command("rcsc.graph")
    @current
    async def graph(uri: str, table: str, *more: str) -> dict[str, object]:
        form = more[0] if more else ""
        reading = session.workspace.reading(session.path(uri))
        return _show(server, session, await session.proving(drawn, reading, table, session.options, form))

    @server.command("rcsc.witness")
    @current
    async def witness(uri: str, table: str, *more: int) -> dict[str, object]:
        which = int(more[0]) if more else 0
        path = session.path(uri)
        return _show(server, session, await session.proving(_witness, session, path, table, which))

    @server.command("rcsc.status")
    @current
    async def status(uri: str) -> dict[str, object]:
        return status_of(session, await session.final(session.path(uri)))


def _witness(session: Session, path: str, table: str, which: int) -> Shown:
    session.workspace.check(path)
    return witness_run(session.workspace.checked(path), table, which)


def _of_table(converter: Converter, answer: Answer, grid: Grid, uri: str) -> list[types.CodeLens]:
    """Return the lenses of a table: its standing, which proves it anew; its graph; its witness, if a finding has one."""
    place = converter.range(grid.area)
    commands = [types.Command(str(grid.standing), "rcsc.prove", arguments=[uri, grid.name])]
    commands.append(types.Command("graph", "rcsc.graph", arguments=[uri, grid.name]))
    if any(each.witnesses and each.table == grid.name for each in answer.findings if not each.meanwhile):
        commands.append(types.Command("run the witness", "rcsc.witness", arguments=[uri, grid.name]))
    return [types.CodeLens(place, command) for command in commands]


def _shares(converter: Converter, answer: Answer, within: types.Range) -> "list[types.InlayHint]":
    """Return the share of the inputs of each line, at the end of its first row."""
    found = []
    for grid in answer.tables:
        for row in grid.rows:
            line = row.area.start.line
            if row.share is not None and within.start.line <= line <= within.end.line:
                lines = converter.lines[answer.file]
                end = lines.place(lines.starts[line] + len(lines.line(line)), converter.units)
                count, whole = row.share
                found.append(
                    types.InlayHint(
                        types.Position(end.line, end.column),
                        share_text(count, whole),
                        tooltip=f"line {row.name} matches {count:,} of {whole:,} inputs in the declared ranges",
                        padding_left=True,
                    )
                )
    return found


def _show(server: LanguageServer, session: Session, shown: Shown) -> dict[str, object]:
    """Return the result of a lens, and show its text to a client that has asked for that."""
    if session.shows and shown.form == "text":
        server.window_show_message(types.ShowMessageParams(types.MessageType.Info, shown.text))
    return {"title": shown.title, "form": shown.form, "text": shown.text}


def status_of(session: Session, answer: Answer) -> dict[str, object]:
    """Return the standing of each table of a file, as lenses and hovers show it."""
    converter = session.converter(answer.texts)
    return {
        "uri": converter.uri(answer.file),
        "version": session.versions.get(answer.file),
        "whole": answer.whole,
        "tables": [
            {
                "name": grid.name,
                "range": converter.range(grid.area),
                "state": grid.standing.state.value,
                "why": grid.standing.why,
                "text": str(grid.standing),
            }
            for grid in answer.tables
        ],
    }
