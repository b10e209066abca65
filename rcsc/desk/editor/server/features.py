"""What is asked about names and layout: hover, definition, references, rename, symbols, completion, colours, formatting, keys in tables.

In: requests. Out: the protocol's answers; no proof is waited for but by hover, which says what is known already.
"""

import os
import re
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from lsprotocol import types
from pygls.exceptions import JsonRpcException
from pygls.lsp.server import LanguageServer

from rcsc.base.diagnostics.source import Source, Span
from rcsc.base.host.files.read import Malformed, content
from rcsc.desk.editor import keys
from rcsc.desk.editor.grid import grids
from rcsc.desk.editor.names.about import about
from rcsc.desk.editor.names.complete import Offer, offers
from rcsc.desk.editor.names.find import Names, Party
from rcsc.desk.editor.names.index import Occurrence, Space
from rcsc.desk.editor.names.rename import RefusedError, renamable, renamed
from rcsc.desk.editor.names.tokens import MODIFIERS, TYPES, tokens
from rcsc.desk.editor.places import Edit, Lines, difference
from rcsc.desk.editor.recovery import declarations
from rcsc.desk.editor.server.convert import Converter
from rcsc.desk.editor.server.session import Session, current
from rcsc.desk.editor.values import BEING_PROVED, Grid
from rcsc.lang.model import Program
from rcsc.lang.project import Loaded
from rcsc.lang.resolve import resolve
from rcsc.lang.resolve.program import closure
from rcsc.lang.syntax.rows import stub_of
from rcsc.lang.written.changes import formatted
from rcsc.lang.written.tables import joined_cells, table_of

MOST_SEARCHED = 1 << 20
"""Bytes of a file that is no table in which a name is looked for."""
REFUSED = -32803
"""The protocol's `RequestFailed`: the request was right, and is refused with a reason."""
_KINDS = {
    "member": types.CompletionItemKind.EnumMember, "variable": types.CompletionItemKind.Variable,
    "constant": types.CompletionItemKind.Constant, "procedure": types.CompletionItemKind.Function,
    "type": types.CompletionItemKind.Class, "field": types.CompletionItemKind.Field, "table": types.CompletionItemKind.Struct,
    "claim": types.CompletionItemKind.Event, "keyword": types.CompletionItemKind.Keyword, "value": types.CompletionItemKind.Value,
    "file": types.CompletionItemKind.File, "line": types.CompletionItemKind.Reference, "unit": types.CompletionItemKind.Unit,
}  # fmt: skip
_SYMBOLS = {
    "enum": types.SymbolKind.Enum, "type": types.SymbolKind.TypeParameter, "record": types.SymbolKind.Struct,
    "const": types.SymbolKind.Constant, "set": types.SymbolKind.Constant, "table": types.SymbolKind.Class,
    "level": types.SymbolKind.Module, "procedure": types.SymbolKind.Function, "module": types.SymbolKind.Function,
    "extern": types.SymbolKind.Function, "owner": types.SymbolKind.Object, "assume": types.SymbolKind.Event,
    "invariant": types.SymbolKind.Event, "property": types.SymbolKind.Event, "requirement": types.SymbolKind.Event,
    "link": types.SymbolKind.Interface,
}  # fmt: skip
_WORDS = re.compile(r"[A-Za-z_]\w*", re.ASCII)


class Failed(JsonRpcException):
    """A request that is refused with a reason."""

    CODE = REFUSED


def register(server: LanguageServer, session: Session) -> None:
    """Register the answers to these requests with the server."""
    _names(server, session)
    _writing(server, session)
    _layout(server, session)


# --- names -------------------------------------------------------------------------


def _names(server: LanguageServer, session: Session) -> None:
    for kind, answer in (
        (types.TEXT_DOCUMENT_HOVER, _hover), (types.TEXT_DOCUMENT_DEFINITION, _definition),
        (types.TEXT_DOCUMENT_REFERENCES, _references), (types.TEXT_DOCUMENT_DOCUMENT_HIGHLIGHT, _highlights),
        (types.TEXT_DOCUMENT_PREPARE_RENAME, _prepare), (types.TEXT_DOCUMENT_DOCUMENT_SYMBOL, _symbols),
        (types.WORKSPACE_SYMBOL, _everywhere),
    ):  # fmt: skip
        _read(server, session, kind, answer)

    @server.feature(types.TEXT_DOCUMENT_RENAME, types.RenameOptions(prepare_provider=True))
    @current
    async def renaming(params: types.RenameParams) -> types.WorkspaceEdit | None:
        edit, told = await session.editing(_rename, session, params)
        if told:
            server.window_show_message(types.ShowMessageParams(types.MessageType.Warning, told))
        return edit


def _read(
    server: LanguageServer,
    session: Session,
    kind: str,
    answer: Callable[[Session, Any], object],
    options: Any = None,
) -> None:
    """Register an answer that needs no proof."""

    @server.feature(kind, options)
    async def asked(params: Any) -> object:
        return await session.reading(answer, session, params)


def _here(
    session: Session, document: types.TextDocumentIdentifier, position: types.Position
) -> tuple[Names, Converter, str, int]:
    """Return the names of a file, its text by lines, its path, and the offset of a position."""
    path = session.path(document.uri)
    names = session.names(path)
    converter = session.converter({file: source.text for file, source in names.sources.items()})
    offset = converter.offset(path, position) if path in converter.lines else 0
    return names, converter, path, offset


def _hover(session: Session, params: types.HoverParams) -> types.Hover | None:
    names, converter, path, offset = _here(session, params.text_document, params.position)
    name = names.at(path, offset)
    if name is None:
        return None
    text = about(names, name, _known_grids(session, names, path))
    return types.Hover(
        types.MarkupContent(types.MarkupKind.Markdown, text),
        converter.between(path, name.span.start, name.span.end),
    )


def _known_grids(session: Session, names: Names, path: str) -> Mapping[str, Grid]:
    """Return the tables of a file: those of the last answer, if it matches the present text; else marked as being proved."""
    answer = session.workspace.answered(path)
    if answer is not None:
        return {grid.name: grid for grid in answer.tables}
    if path not in names.sources:
        return {}
    found = grids(path, Lines(names.sources[path].text), names.program, lambda _: BEING_PROVED)
    return {grid.name: grid for grid in found}


def _definition(session: Session, params: types.DefinitionParams) -> list[types.Location]:
    names, converter, path, offset = _here(session, params.text_document, params.position)
    name = names.at(path, offset)
    if name is None:
        return []
    if name.space is Space.FILE:
        file = names.file_used(name)
        return (
            []
            if file is None
            else [
                types.Location(converter.uri(file), types.Range(types.Position(0, 0), types.Position(0, 0)))
            ]
        )
    return [_location(converter, each.span) for each in names.declarations(name)]


def _location(converter: Converter, span: Span) -> types.Location:
    return types.Location(converter.uri(span.file), converter.between(span.file, span.start, span.end))


def _project(session: Session, path: str, name: Occurrence) -> Names:
    """Return the names of all project files that are in a program with the declaration of a name; of all files if it is not found.

    A program is one scope: what a file declares is seen in every file that one which uses it uses, too.
    """
    loaded = session.workspace.read_all(session.workspace.project(path))
    declared = {each.span.file for each in session.names(path).uses(name) if each.declares}
    related = set(loaded.sources)
    if declared:
        programs = [set(closure(root, loaded)) for root in loaded.given]
        related = {path}.union(*(program for program in programs if program & declared))
    stating = _stating(session, loaded, related)
    related |= stating.keys()
    files = {file: each for file, each in loaded.files.items() if file in related}
    for file in related & loaded.sources.keys() - files.keys():  # half written: what is left of them
        files |= {
            other: each for other, each in session.workspace.reading(file).files.items() if other == file
        }
    return Names(files, loaded.sources, session.workspace.reading(path).nearest, stating)


def _stating(session: Session, loaded: Loaded, files: Collection[str]) -> dict[str, Mapping[str, Party]]:
    """Return the files that state requirements across levels of which one is made of these files, with their parties."""
    real = set(map(os.path.realpath, files))
    return {
        file: parties
        for root in loaded.given
        for file, parties in session.workspace.reading(root).names.across.items()
        if os.path.realpath(file) in real or any(real & party.files for party in parties.values())
    }


def _references(session: Session, params: types.ReferenceParams) -> list[types.Location]:
    names, _, path, offset = _here(session, params.text_document, params.position)
    name = names.at(path, offset)
    if name is None:
        return []
    project = _project(session, path, name)
    converter = session.converter({file: source.text for file, source in project.sources.items()})
    uses = (each for each in project.uses(name) if params.context.include_declaration or not each.declares)
    return [_location(converter, each.span) for each in uses]


def _highlights(session: Session, params: types.DocumentHighlightParams) -> list[types.DocumentHighlight]:
    names, converter, path, offset = _here(session, params.text_document, params.position)
    name = names.at(path, offset)
    uses = () if name is None else names.uses(name)
    return [
        types.DocumentHighlight(
            converter.between(path, each.span.start, each.span.end),
            types.DocumentHighlightKind.Write if each.declares else types.DocumentHighlightKind.Read,
        )
        for each in uses
        if each.span.file == path
    ]


def _prepare(session: Session, params: types.PrepareRenameParams) -> types.PrepareRenamePlaceholder | None:
    names, converter, path, offset = _here(session, params.text_document, params.position)
    name = names.at(path, offset)
    if name is None:
        return None
    try:
        renamable(_project(session, path, name), name)
    except RefusedError as refused:
        raise Failed(str(refused)) from refused
    return types.PrepareRenamePlaceholder(converter.between(path, name.span.start, name.span.end), name.text)


def _rename(session: Session, params: types.RenameParams) -> tuple[types.WorkspaceEdit | None, str]:
    names, _, path, offset = _here(session, params.text_document, params.position)
    name = names.at(path, offset)
    if name is None:
        return None, ""
    project = _project(session, path, name)
    try:
        done = renamed(
            project, name, params.new_name, lambda texts: _wrong_with(session, path, project, name, texts)
        )
    except RefusedError as refused:
        raise Failed(str(refused)) from refused
    converter = session.converter({file: source.text for file, source in project.sources.items()})
    edits = [edit for file, text in done.texts.items() for edit in _edits(project.sources[file], text)]
    return converter.edits(edits), _elsewhere(path, name)


def _edits(source: Source, text: str) -> Sequence[Edit]:
    return difference(source.name, Lines(source.text), text)


def _wrong_with(session: Session, path: str, names: Names, name: Occurrence, texts: Mapping[str, str]) -> str:
    """Return the first error that these texts bring into a program of the project that is in order without them; empty for none."""
    files = session.workspace.project(path)
    before, after = session.workspace.read_all(files), session.workspace.read_all(files, texts)
    for file, source in names.sources.items():
        if file not in before.files and name.text in _WORDS.findall(source.text):
            return f"`{os.path.basename(file)}` is not in order, and has the word, too"
    for root in before.roots:
        if isinstance(resolve(root, before), Program):
            resolved = resolve(root, after) if root in after.files else after.diagnostics
            if not isinstance(resolved, Program):
                return (
                    f"{resolved[0].message} ({os.path.basename(root)})"
                    if resolved
                    else f"{root} does not parse"
                )
    return _wrong_across(session, names, texts)


def _wrong_across(session: Session, names: Names, texts: Mapping[str, str]) -> str:
    """Return the first error that these texts bring into requirements across levels that are in order without them."""
    trial = session.workspace.trial(texts)
    for file in names.across:
        before, after = session.workspace.reading(file), trial.reading(file)
        if before.program is not None and after.program is None:
            why = after.wrong[0].message if after.wrong else "a level is not in order"
            return f"{why} ({os.path.basename(file)})"
    return ""


def _elsewhere(path: str, name: Occurrence) -> str:
    """Return a warning where files other than tables have the word, too: descriptions, scripts and plants are not changed."""
    root = os.path.dirname(path)
    found = [
        each
        for each in sorted(os.listdir(root) if os.path.isdir(root) else ())
        if each.endswith((".toml", ".csv", ".py")) and name.text in _words_in(os.path.join(root, each))
    ]
    return f"`{name.text}` stands in {', '.join(found)}, too, which is not changed" if found else ""


def _words_in(path: str) -> set[str]:
    try:
        return set(_WORDS.findall(content(Path(path), MOST_SEARCHED).decode("utf-8", "replace")))
    except (OSError, Malformed):
        return set()


# --- symbols -----------------------------------------------------------------------


def _symbols(session: Session, params: types.DocumentSymbolParams) -> list[types.DocumentSymbol]:
    path = session.path(params.text_document.uri)
    text = session.workspace.text(path)
    converter = session.converter({path: text})
    return list(_declared(converter, Source(path, text)))


def _declared(converter: Converter, source: Source) -> Iterator[types.DocumentSymbol]:
    """Yield the declarations of a text, whether it parses or not."""
    for word, name, whole, named in declarations(source):
        children = []
        table = table_of(source.text[: whole.end], name) if word == "table" else None
        for line in table.parts[0].lines if table is not None and table.parts else ():
            stub = joined_cells(line).conditions[:1]
            if stub and stub[0].text:
                place = converter.between(
                    source.name, stub[0].start, stub[0].start + len(stub_of(stub[0]).name.text)
                )
                row = converter.between(source.name, line[0].start, line[-1].past)
                children.append(
                    types.DocumentSymbol(stub_of(stub[0]).name.text, types.SymbolKind.EnumMember, row, place)
                )
        yield types.DocumentSymbol(
            name,
            _SYMBOLS.get(word, types.SymbolKind.Variable),
            converter.between(source.name, whole.start, whole.end),
            converter.between(source.name, named.start, named.end),
            detail=word,
            children=children,
        )


def _everywhere(session: Session, params: types.WorkspaceSymbolParams) -> list[types.WorkspaceSymbol]:
    """Return symbols of the open projects whose names hold the letters of the query in order."""
    files = {file for path in session.uris for file in session.workspace.project(path)}
    found = []
    for file in sorted(files):
        source = Source(file, session.workspace.text(file))
        converter = session.converter({file: source.text})
        for word, name, _, named in declarations(source):
            letters = iter(name.lower())
            if all(letter in letters for letter in params.query.lower()):
                kind = _SYMBOLS.get(word, types.SymbolKind.Variable)
                found.append(
                    types.WorkspaceSymbol(
                        _location(converter, named), name, kind, container_name=os.path.basename(file)
                    )
                )
    return found


# --- writing -----------------------------------------------------------------------


def _writing(server: LanguageServer, session: Session) -> None:
    triggers = types.CompletionOptions(trigger_characters=[".", "|", ":", "="])
    _read(server, session, types.TEXT_DOCUMENT_COMPLETION, _completion, triggers)
    legend = types.SemanticTokensLegend(list(TYPES), list(MODIFIERS))
    _read(server, session, types.TEXT_DOCUMENT_SEMANTIC_TOKENS_FULL, _colours, legend)


def _completion(session: Session, params: types.CompletionParams) -> types.CompletionList:
    names, _, path, offset = _here(session, params.text_document, params.position)
    if path not in names.sources:
        return types.CompletionList(is_incomplete=False, items=[])
    found = offers(names, _known_grids(session, names, path), path, offset)
    items = [_item(number, offer) for number, offer in enumerate(found)]
    return types.CompletionList(is_incomplete=False, items=items)


def _item(number: int, offer: Offer) -> types.CompletionItem:
    return types.CompletionItem(
        offer.label,
        kind=_KINDS[offer.kind],
        detail=offer.detail or None,
        documentation=offer.doc or None,
        sort_text=f"{number:04}",
    )


def _colours(session: Session, params: types.SemanticTokensParams) -> types.SemanticTokens:
    path = session.path(params.text_document.uri)
    names = session.names(path)
    if path not in names.sources:
        return types.SemanticTokens([])
    lines = Lines(names.sources[path].text)
    numbers: list[int] = []
    line = column = 0
    for token in tokens(names, path):
        at = lines.place(token.start, session.units)
        length = session.units.of(lines.text[token.start : token.start + token.length])
        modifiers = sum(1 << MODIFIERS.index(word) for word in token.modifiers)
        numbers += [
            at.line - line,
            at.column - (column if at.line == line else 0),
            length,
            TYPES.index(token.type),
            modifiers,
        ]
        line, column = at.line, at.column
    return types.SemanticTokens(numbers)


# --- layout ------------------------------------------------------------------------


def _layout(server: LanguageServer, session: Session) -> None:
    @server.feature(types.TEXT_DOCUMENT_FORMATTING)
    @current
    async def whole(params: types.DocumentFormattingParams) -> list[types.TextEdit]:
        return await session.editing(_formatting, session, params.text_document)

    @server.feature(types.TEXT_DOCUMENT_RANGE_FORMATTING)
    @current
    async def part(params: types.DocumentRangeFormattingParams) -> list[types.TextEdit]:
        return await session.editing(_formatting, session, params.text_document, params.range)

    @server.feature(
        types.TEXT_DOCUMENT_ON_TYPE_FORMATTING, types.DocumentOnTypeFormattingOptions("|", ["\n"])
    )
    @current
    async def typed(params: types.DocumentOnTypeFormattingParams) -> list[types.TextEdit]:
        return await session.editing(_on_type, session, params)

    for command, act in (
        ("rcsc.nextCell", keys.next_cell), ("rcsc.previousCell", keys.previous_cell), ("rcsc.addRow", keys.add_row),
        ("rcsc.insertColumn", keys.insert_column),
    ):  # fmt: skip
        _key(server, session, command, act)


def _formatting(
    session: Session, document: types.TextDocumentIdentifier, within: types.Range | None = None
) -> list[types.TextEdit]:
    """Return the edits that lay a text out as `rcsc fmt` does; none where it does not parse.

    Lines that stay are left alone, so that the cursor stays, too.
    """
    path = session.path(document.uri)
    source = Source(path, session.workspace.text(path))
    text = formatted(source)
    if text is None:
        return []
    converter = session.converter({path: source.text})
    edits = [converter.edit(edit) for edit in _edits(source, text)]
    if within is None:
        return edits
    return [
        edit
        for edit in edits
        if edit.range.start.line <= within.end.line and edit.range.end.line >= within.start.line
    ]


def _on_type(session: Session, params: types.DocumentOnTypeFormattingParams) -> list[types.TextEdit]:
    path = session.path(params.text_document.uri)
    text = session.workspace.text(path)
    converter = session.converter({path: text})
    offset = converter.offset(path, params.position)
    if params.ch == "\n":
        offset = max(0, offset - 1)
    return [
        types.TextEdit(converter.between(path, start, end), new)
        for start, end, new in keys.align(text, offset)
    ]


def _key(server: LanguageServer, session: Session, command: str, act: "keys.Act") -> None:
    """Register a command that changes a table around a place; it answers with edits and the new cursor, or null outside tables."""

    @server.command(command)
    @current
    async def pressed(uri: str, position: types.Position) -> dict[str, object] | None:
        return await session.editing(_pressed, session, uri, position, act)


def _pressed(
    session: Session, uri: str, position: types.Position, act: "keys.Act"
) -> dict[str, object] | None:
    path = session.path(uri)
    text = session.workspace.text(path)
    converter = session.converter({path: text})
    moved = act(text, converter.offset(path, position))
    if moved is None:
        return None
    place = Lines(moved.text).place(moved.offset, session.units)
    return {
        "edits": [converter.edit(edit) for edit in difference(path, converter.lines[path], moved.text)],
        "cursor": types.Position(place.line, place.column),
        "version": session.versions.get(path),
    }
