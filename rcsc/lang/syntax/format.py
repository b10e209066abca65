"""Tree to text in one layout; `parse(format_file(t)) == t`.

Comments stand above what they belong to, doc lines directly above the declaration; tables are aligned.
"""

from collections.abc import Iterator

from rcsc.lang.operator_table import SUM
from rcsc.lang.syntax import tree
from rcsc.lang.syntax.layout import WIDTH, table_rows
from rcsc.lang.syntax.spell import (
    spell_claimed,
    spell_expr,
    spell_field,
    spell_req,
    spell_required,
    spell_set,
    spell_statement,
    spell_turned,
    spell_type,
)

_LONE = (tree.Use, tree.UnitDecl, tree.ConstDecl, tree.SetDecl, tree.TypeDecl, tree.VariableDecl, tree.AssumeDecl, tree.InvariantDecl,
         tree.PropertyDecl, tree.RequirementDecl, tree.EnumDecl, tree.OwnerDecl, tree.ServesDecl, tree.CommandsDecl,
         tree.AdoptDecl)  # fmt: skip


def format_file(file: tree.File, width: int = WIDTH) -> str:
    """Return the file's text; tables are at most `width` characters wide where possible."""
    lines: list[str] = []
    before: tree.Declaration | None = None
    for declaration in file.declarations:
        if before is not None and not _together(before, declaration):
            lines.append("")
        lines.extend(_declaration(declaration, width))
        before = declaration
    if file.trailing:
        lines.extend([""] if lines else [])
        lines.extend(_above(file.trailing, ()))
    return "\n".join(lines) + "\n" if lines else ""


def _together(first: tree.Declaration, second: tree.Declaration) -> bool:
    """Return whether two declarations stand without a blank line between them."""
    if not isinstance(first, _LONE) or type(first) is not type(second) or second.comments:
        return False
    return (
        not isinstance(first, tree.VariableDecl)
        or not isinstance(second, tree.VariableDecl)
        or first.kind == second.kind
    )


def _above(comments: tuple[str, ...], doc: tuple[str, ...], pad: str = "") -> Iterator[str]:
    yield from ((f"{pad}# {text}").rstrip() for text in comments)
    yield from ((f"{pad}## {text}").rstrip() for text in doc)


def _declaration(declaration: tree.Declaration, width: int) -> Iterator[str]:
    yield from _above(declaration.comments, () if isinstance(declaration, tree.Use) else declaration.doc)
    match declaration:
        case tree.Use(path):
            yield f"use {path}"
        case tree.UnitDecl() | tree.ConstDecl() | tree.SetDecl() | tree.EnumDecl() | tree.TypeDecl():
            yield _type(declaration)
        case tree.RecordDecl():
            yield from _record(declaration)
        case tree.VariableDecl():
            yield _variable(declaration)
        case tree.AssumeDecl() | tree.InvariantDecl() | tree.PropertyDecl():
            yield _claim(declaration)
        case tree.RequirementDecl(name):
            word = "requirement" if declaration.standing is None else "assume"
            standing = " monitored" * declaration.monitored
            if declaration.standing is not None:
                standing = f" {declaration.standing}" if declaration.standing else ""
            yield f"{word} {name.text}{standing}{spell_req(declaration)} : {spell_required(declaration)}"
        case tree.ProcedureDecl():
            yield from _procedure(declaration)
        case tree.OwnerDecl(name, members):
            inside = f" {', '.join(m.text for m in members)} " if members else " "
            yield f"owner {name.text} {{{inside}}}"
        case tree.TableDecl():
            yield from _table(declaration, width)
        case tree.LinkDecl():
            yield from _link(declaration)
        case tree.ServesDecl() | tree.CommandsDecl() | tree.AdoptDecl():
            yield _role(declaration)
        case tree.LevelDecl():
            yield from _level(declaration)


def _type(one: tree.UnitDecl | tree.ConstDecl | tree.SetDecl | tree.EnumDecl | tree.TypeDecl) -> str:
    match one:
        case tree.UnitDecl(name):
            return f"unit {name.text}"
        case tree.ConstDecl(name, value):
            return f"const {name.text} = {spell_expr(value)}"
        case tree.SetDecl(name, kind, members):
            return f"set {name.text} : {spell_type(kind)} = {spell_set(members)}"
        case tree.EnumDecl(name, members):
            return f"enum {name.text} {{ {', '.join(member.text for member in members)} }}"
        case tree.TypeDecl(name, kind):
            return f"type {name.text} = {spell_type(kind)}"


def _claim(claim: tree.AssumeDecl | tree.InvariantDecl | tree.PropertyDecl) -> str:
    spell = spell_claimed if isinstance(claim, tree.AssumeDecl) else spell_expr
    condition, req = spell(claim.condition), spell_req(claim)
    match claim:
        case tree.AssumeDecl(name, _, state):
            return f"assume {name.text}{f' {state}' if state else ''}{req} : {condition}"
        case tree.InvariantDecl(name):
            return f"invariant {name.text}{req} : {condition}"
        case tree.PropertyDecl(name, _, word, other):
            return f"property {name.text}{req} : {condition}" + (
                f" {word} {spell_expr(other)}" if other is not None else ""
            )


def _record(record: tree.RecordDecl) -> Iterator[str]:
    yield f"record {record.name.text} {{"
    for part in record.fields:
        yield from _above(part.comments, part.doc, "  ")
        yield f"  {spell_field(part)}"
    yield "}"


def _link(one: tree.LinkDecl) -> Iterator[str]:
    yield f"link {one.name.text} {{"
    yield f"  command : {one.command.text} rest {one.rest.text}"
    yield f"  status : {one.status.text} done {one.done.text} failed {one.failed.text} executing {one.executing.text}"
    for word, fields in (("order", one.order), ("report", one.report)):
        if fields:
            yield f"  {word} {{"
            for part in fields:
                yield from _above(part.comments, part.doc, "    ")
                adopted = f" restart {spell_expr(part.restart)}" if part.restart is not None else ""
                yield f"    {part.word}{' ' if part.word else ''}{spell_field(part)}{adopted}"
            yield "  }"
    yield "}"


def _role(one: tree.ServesDecl | tree.CommandsDecl | tree.AdoptDecl) -> str:
    if isinstance(one, tree.AdoptDecl):
        return f"adopt {spell_expr(one.place)} {'after' if one.after else ':='} {spell_expr(one.value)}"
    if isinstance(one, tree.ServesDecl):
        without = ", ".join(name.text for name in one.without)
        return f"serves {one.peer.text} : {one.link.text}" + (f" without {without}" if without else "")
    text = f"commands {one.peer.text} : {one.link.text}"
    for words, cycles, reason in (
        ("within", one.within, one.late),
        ("answered within", one.answered, one.unanswered),
    ):
        text += f" {words} {spell_expr(cycles)} cycles" if cycles is not None else ""
        text += f" else {reason.text}" if reason is not None else ""
    return text


def _variable(variable: tree.VariableDecl) -> str:
    text = f"{variable.kind} {variable.name.text} : {spell_type(variable.type)}"
    text += f" = {spell_expr(variable.initial)}" if variable.initial is not None else ""
    text += f" safe {spell_expr(variable.safe)}" if variable.safe is not None else ""
    text += f" restart {spell_expr(variable.restart)}" if variable.restart is not None else ""
    text += f" {variable.admit}" if variable.admit else ""
    if variable.deferred_until is not None:
        return f"{text} deferred until {spell_expr(variable.deferred_until)}"
    return f"{text} deferred" if variable.deferred else text


def _procedure(procedure: tree.ProcedureDecl) -> Iterator[str]:
    word = {"procedure": "procedure", "module": "module", "extern": "extern procedure"}[procedure.kind]
    params = ", ".join(f"{p.name.text} : {spell_type(p.type)}" for p in procedure.params)
    head = f"{word} {procedure.name.text}" + (f"({params})" if params else "")
    head += f" reads {', '.join(spell_expr(r) for r in procedure.reads)}" if procedure.reads else ""
    head += f" writes {', '.join(spell_expr(w) for w in procedure.writes)}" if procedure.writes else ""
    head += spell_req(procedure)
    if procedure.kind == "extern":
        head += f' python "{procedure.python}"' if procedure.python else ""
        yield head + (f' c "{procedure.c}"' if procedure.c else "")
        return
    yield f"{head} {{"
    yield from _block(procedure.body, 1)
    yield "}"


def _block(body: tuple[tree.Statement, ...], depth: int) -> Iterator[str]:
    for statement in body:
        yield from _above(statement.comments, (), "  " * depth)
        yield from _statement(statement, depth)


def _statement(statement: tree.Statement, depth: int) -> Iterator[str]:
    pad = "  " * depth
    match statement:
        case tree.Assign() | tree.Call():
            yield pad + spell_statement(statement)
        case tree.Local(name, kind, value):
            yield f"{pad}local {name.text} : {spell_type(kind)}" + (
                f" := {spell_expr(value)}" if value else ""
            )
        case tree.If():
            yield from _if(statement, depth, pad)
        case tree.Case(subject, arms, orelse):
            yield f"{pad}case {spell_expr(subject)} {{"
            for arm in arms:
                yield from _above(arm.comments, (), f"{pad}  ")
                yield f"{pad}  {', '.join(spell_expr(v) for v in arm.values)} {{"
                yield from _block(arm.body, depth + 2)
                yield f"{pad}  }}"
            if orelse is not None:
                yield f"{pad}  else {{"
                yield from _block(orelse, depth + 2)
                yield f"{pad}  }}"
            yield f"{pad}}}"
        case tree.For(name, low, high, body):
            yield f"{pad}for {name.text} in {spell_expr(low, SUM)} .. {spell_expr(high, SUM)} {{"
            yield from _block(body, depth + 1)
            yield f"{pad}}}"


def _if(branch: tree.If, depth: int, lead: str) -> Iterator[str]:
    """Yield the lines of an `if`; one alone in an `else`, without comments, goes on as `else if`."""
    pad = "  " * depth
    yield f"{lead}if {spell_expr(branch.condition)} {{"
    yield from _block(branch.then, depth + 1)
    if not branch.orelse:
        yield f"{pad}}}"
    elif len(branch.orelse) == 1 and isinstance(branch.orelse[0], tree.If) and not branch.orelse[0].comments:
        yield from _if(branch.orelse[0], depth, f"{pad}}} else ")
    else:
        yield f"{pad}}} else {{"
        yield from _block(branch.orelse, depth + 1)
        yield f"{pad}}}"


# --- tables and levels ---------------------------------------------------------------


def _table(table: tree.TableDecl, width: int) -> Iterator[str]:
    assuming = f" assuming {', '.join(name.text for name in table.assuming)}" if table.assuming else ""
    turned = "" if table.turned is None else spell_turned(table.turned)
    yield f"table {table.name.text}{turned}{assuming}{spell_req(table)} {{"
    for row, text in table_rows(table, width):
        if row is not None:
            yield from _above(row.comments, (), "  ")
        yield f"  {text}" if text else ""
    yield "}"


def _level(level: tree.LevelDecl) -> Iterator[str]:
    yield f"level {level.name.text} {{"
    if level.period is not None:
        yield f"  period {spell_expr(level.period)}"
    if level.preprocess:
        yield f"  preprocess {', '.join(name.text for name in level.preprocess)}"
    for clause in level.tables:
        yield from _above(clause.comments, (), "  ")
        if clause.table is not None:
            yield f"  table {clause.table.text}"
        elif clause.selector is not None:
            yield f"  table by {spell_expr(clause.selector)} {{"
            for dispatch in clause.dispatch:
                yield f"    {spell_expr(dispatch.value)} : {dispatch.table.text}"
            yield "  }"
    if level.postprocess:
        yield f"  postprocess {', '.join(name.text for name in level.postprocess)}"
    yield "}"
