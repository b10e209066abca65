"""Parse trees to syntax trees: one method a grammar rule, in grammar order."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Protocol

from rcsc.base.diagnostics.source import Span
from rcsc.lang.operator_table import LOGIC
from rcsc.lang.syntax import tree
from rcsc.lang.syntax.comments import Comments, split, words

_NUMBER_TYPES: dict[str, type[tree.IntType | tree.RealType | tree.SingleType]] = {
    "int_type": tree.IntType,
    "real_type": tree.RealType,
    "single_type": tree.SingleType,
}


class ParseNode(Protocol):
    """A rule's name, what it matched (nodes and tokens), and in `meta` where, if it matched anything."""

    data: str
    children: list[Any]

    @property
    def meta(self) -> Any: ...


class Rows(Protocol):
    """Parses the rows of a table, and of one that is turned: then also what stands, from start to end, after `by` and `giving`."""

    def table(
        self, rows: list[Any]
    ) -> tuple[tuple[tree.Heading, ...], tuple[tree.Heading, ...], tuple[tree.Row, ...], bool]: ...

    def turned(
        self, rows: list[Any], by: tuple[int, int] | None, giving: tuple[int, int]
    ) -> tuple[
        tuple[tree.Heading, ...], tuple[tree.Heading, ...], tuple[tree.Row, ...], bool, tree.Turned | None
    ]: ...


class Build:
    """Builds the nodes of one file, or of one table cell (then `file` is "" and `rows` None)."""

    def __init__(self, file: str, comments: Comments, rows: Rows | None) -> None:
        self.file = file
        self.comments = comments
        self.rows = rows

    # --- pieces ---

    def _span(self, node: ParseNode) -> Span:
        at: Any = getattr(node, "meta", node)  # a token stands somewhere itself
        return (
            Span(self.file, 0, 0)
            if getattr(at, "empty", False)
            else Span(self.file, at.start_pos, at.end_pos)
        )

    def _name(self, token: Any) -> tree.Name:
        return tree.Name(str(token), Span(self.file, token.start_pos, token.end_pos))

    def _names(self, node: ParseNode | None) -> tuple[tree.Name, ...]:
        return tuple(self._name(token) for token in node.children) if node is not None else ()

    def _head(self, node: ParseNode) -> dict[str, Any]:
        """Return span, comments and doc lines of a declaration."""
        plain, doc = split(self.comments.take(node.meta.start_pos))
        return {"span": self._span(node), "comments": plain, "doc": doc}

    def _quoted(self, node: ParseNode | None) -> tuple[tree.Name, ...]:
        """Return the names in quotes, without the quotes."""
        strings = [] if node is None else [item for item in node.children if item.type == "STRING"]
        return tuple(
            tree.Name(str(token)[1:-1], Span(self.file, token.start_pos + 1, token.end_pos - 1))
            for token in strings
        )

    def _required(self, node: ParseNode) -> dict[str, Any]:
        """Return span, comments, doc lines and requirements of a declaration."""
        return {**self._head(node), "requirements": self._quoted(self._find(node.children, "req"))}

    def _above(self, node: ParseNode) -> dict[str, Any]:
        """Return span and comments of a statement or an arm."""
        comments = self.comments.take(node.meta.start_pos)
        return {"span": self._span(node), "comments": tuple(words(text) for text in comments)}

    @staticmethod
    def _rule(item: Any) -> str:
        return str(getattr(item, "data", ""))  # a token has none

    def _find(self, items: list[Any], rule: str) -> Any:
        return next((item for item in items if self._rule(item) == rule), None)

    def _kind(self, items: list[Any], terminal: str) -> Any:
        return next((item for item in items if getattr(item, "type", None) == terminal), None)

    # --- declarations ---

    def declaration(self, node: ParseNode) -> tree.Declaration:
        """Build any declaration."""
        built: tree.Declaration = getattr(self, f"_{node.data}")(node)
        return built

    def _use(self, node: ParseNode) -> tree.Use:
        head = self._head(node)
        head.pop("doc")
        return tree.Use("/".join(str(token) for token in node.children[0].children if token != "/"), **head)

    def _const_decl(self, node: ParseNode) -> tree.ConstDecl:
        head = self._head(node)
        return tree.ConstDecl(self._name(node.children[0]), self.expr(node.children[2]), **head)

    def _set_decl(self, node: ParseNode) -> tree.SetDecl:
        head = self._head(node)
        name, kind, _, members = node.children
        return tree.SetDecl(self._name(name), self.type(kind), self._members(members.children), **head)

    def _enum_decl(self, node: ParseNode) -> tree.EnumDecl:
        head = self._head(node)
        name, *members = node.children
        return tree.EnumDecl(self._name(name), tuple(self._name(member) for member in members), **head)

    def _type_decl(self, node: ParseNode) -> tree.TypeDecl:
        head = self._head(node)
        return tree.TypeDecl(self._name(node.children[0]), self.type(node.children[2]), **head)

    def _record_decl(self, node: ParseNode) -> tree.RecordDecl:
        head = self._head(node)
        name, *fields = node.children
        return tree.RecordDecl(self._name(name), tuple(self._field(field) for field in fields), **head)

    def _field(self, node: ParseNode) -> tree.FieldDecl:
        head = self._head(node)
        name, kind, *values = node.children
        given = self._values(values)
        return tree.FieldDecl(
            self._name(name), self.type(kind), given.get("EQUAL"), given.get("SAFE"), **head
        )

    def _values(self, written: Sequence[Any]) -> dict[str, tree.Expr]:
        """Return the values of a field by the words before them."""
        return {
            str(getattr(mark, "type", "")): self.expr(value)
            for mark, value in zip(written[::2], written[1::2], strict=True)
        }

    def _unit_decl(self, node: ParseNode) -> tree.UnitDecl:
        return tree.UnitDecl(self._name(node.children[0]), **self._head(node))

    def _variable_decl(self, node: ParseNode) -> tree.VariableDecl:
        head = self._head(node)
        kind, name, declared, *rest = node.children
        admit, equal, safe, again = (self._kind(rest, word) for word in ("ADMIT", "EQUAL", "SAFE", "RESTART"))
        deferred = self._find(rest, "deferred")
        words = {id(word) for word in (admit, equal, safe, again, deferred)}
        exprs = [item for item in rest if id(item) not in words]
        initial = self.expr(exprs.pop(0)) if equal is not None else None
        shown = self.expr(exprs.pop(0)) if safe is not None else None
        adopted = self.expr(exprs.pop(0)) if again is not None else None
        until = self.expr(deferred.children[0]) if deferred is not None and deferred.children else None
        return tree.VariableDecl(
            str(kind),
            self._name(name),
            self.type(declared),
            initial,
            str(admit or ""),
            until,
            shown,
            deferred is not None and not deferred.children,
            adopted,
            **head,
        )

    def _assume_decl(self, node: ParseNode) -> tree.AssumeDecl:
        head = self._required(node)
        standing = self._kind(node.children, "STANDING")
        return tree.AssumeDecl(
            self._name(node.children[0]),
            self.expr(node.children[-1]),
            " ".join((standing or "").split()),
            **head,
        )

    def _invariant_decl(self, node: ParseNode) -> tree.InvariantDecl:
        head = self._required(node)
        return tree.InvariantDecl(self._name(node.children[0]), self.expr(node.children[-1]), **head)

    def _property_decl(self, node: ParseNode) -> tree.PropertyDecl:
        head = self._required(node)
        name, condition, *last = (part for part in node.children if self._rule(part) != "req")
        word = self._rule(last[0]) if last else ""  # the rule is called as the word is
        other = self.expr(last[0].children[0]) if last else None
        return tree.PropertyDecl(self._name(name), self.expr(condition), word, other, **head)

    def _requirement_decl(self, node: ParseNode) -> tree.RequirementDecl:
        return self._over_time(node, self._kind(node.children, "WATCHED") is not None, None)

    def _assume_over_time(self, node: ParseNode) -> tree.RequirementDecl:
        standing = " ".join((self._kind(node.children, "STANDING") or "").split())
        return self._over_time(node, standing.endswith("monitored"), standing)

    def _over_time(self, node: ParseNode, monitored: bool, standing: str | None) -> tree.RequirementDecl:
        head = self._required(node)
        kept = [part for part in node.children if getattr(part, "type", "") not in {"WATCHED", "STANDING"}]
        name, *parts, response = (part for part in kept if self._rule(part) != "req")
        scope, asks, takes = (self._worded(parts, before) for before in ("in_", "asks_", "takes_"))
        mode, *end = scope[1]
        *other, last = takes[1]
        time = last if isinstance(last, tree.Time) else None
        return tree.RequirementDecl(
            self._name(name),
            scope[0],
            mode,
            asks[0],
            asks[1][0],
            takes[0],
            self.expr(response),
            time,
            None if time is not None else last,
            end[0] if end else None,
            other[0] if other else None,
            monitored,
            standing,
            **head,
        )

    def _worded(self, parts: Sequence[Any], before: str) -> tuple[str, list[Any]]:
        """Return the words of a part of a requirement, after which its rule is called, and what stands after them; None for nothing."""
        part = next((part for part in parts if self._rule(part).startswith(before)), None)
        if part is None:
            return "", [None]
        inside = [child for child in part.children if not hasattr(child, "type")]
        times = ("lasting_time", "cycles_time")
        stands = [self._time(child) if self._rule(child) in times else self.expr(child) for child in inside]
        return self._rule(part).removeprefix(before).replace("_", " "), stands or [None]

    def _time(self, node: ParseNode) -> tree.Time:
        return tree.Time(self.expr(node.children[0]), self._rule(node) == "cycles_time", self._span(node))

    def _procedure_decl(self, node: ParseNode) -> tree.ProcedureDecl:
        return self._procedure(node, "procedure")

    def _module_decl(self, node: ParseNode) -> tree.ProcedureDecl:
        return self._procedure(node, "module")

    def _extern_decl(self, node: ParseNode) -> tree.ProcedureDecl:
        return self._procedure(node, "extern")

    def _procedure(self, node: ParseNode, kind: str) -> tree.ProcedureDecl:
        head = self._required(node)
        parts = node.children[1:]
        params, body = self._find(parts, "parameters"), self._find(parts, "block")
        reads, writes = self._find(parts, "reads"), self._find(parts, "writes")
        python, c = self._find(parts, "python"), self._find(parts, "c_function")
        return tree.ProcedureDecl(
            kind,
            self._name(node.children[0]),
            tuple(
                tree.Parameter(self._name(p.children[0]), self.type(p.children[1]), self._span(p))
                for p in (params.children if params else ())
            ),
            tuple(self.expr(place) for place in (reads.children if reads else ())),
            tuple(self.expr(place) for place in (writes.children if writes else ())),
            str(python.children[0])[1:-1] if python else "",
            str(c.children[0])[1:-1] if c else "",
            self.block(body) if body else (),
            **head,
        )

    def _owner_decl(self, node: ParseNode) -> tree.OwnerDecl:
        head = self._head(node)
        return tree.OwnerDecl(
            self._name(node.children[0]), self._names(self._find(node.children, "names")), **head
        )

    def _table_decl(self, node: ParseNode) -> tree.TableDecl:
        head = self._required(node)
        assuming = self._names(self._find(node.children, "names"))
        assert self.rows is not None
        rows = [item for item in node.children if getattr(item, "type", None) == "ROW"]
        by, giving = (self._find(node.children, rule) for rule in ("columns_by", "giving"))
        name = self._name(node.children[0])
        if giving is None:
            return tree.TableDecl(name, assuming, *self.rows.table(rows), **head)
        subject = None if by is None else (by.meta.start_pos + len("by"), by.meta.end_pos)
        given = giving.meta.start_pos + len("giving"), giving.meta.end_pos
        return tree.TableDecl(name, assuming, *self.rows.turned(rows, subject, given), **head)

    def _link_decl(self, node: ParseNode) -> tree.LinkDecl:
        head = self._head(node)
        name, said, status, *parts = node.children
        command, rest = map(self._name, said.children)
        kind, done, failed, executing = map(self._name, status.children)
        order, report = (
            self._link_fields(self._find(parts, rule)) for rule in ("order_fields", "report_fields")
        )
        return tree.LinkDecl(
            self._name(name), command, rest, kind, done, failed, executing, order, report, **head
        )

    def _link_fields(self, node: ParseNode | None) -> tuple[tree.LinkField, ...]:
        return () if node is None else tuple(self._link_field(part) for part in node.children)

    def _link_field(self, node: ParseNode) -> tree.LinkField:
        head = self._head(node)
        word = next(
            (str(self._kind(node.children, w)) for w in ("STREAM", "REASON") if self._kind(node.children, w)),
            "",
        )
        name, kind, *values = node.children[bool(word) :]
        given = self._values(values)
        return tree.LinkField(
            self._name(name),
            self.type(kind),
            given.get("EQUAL"),
            given.get("SAFE"),
            word,
            given.get("RESTART"),
            **head,
        )

    def _serves_decl(self, node: ParseNode) -> tree.ServesDecl:
        peer, link, *without = node.children
        names = self._names(without[0]) if without else ()
        return tree.ServesDecl(self._name(peer), self._name(link), names, **self._head(node))

    def _commands_decl(self, node: ParseNode) -> tree.CommandsDecl:
        head = self._head(node)
        peer, link, *bounds = node.children
        within, answered = (self._bound(self._find(bounds, rule)) for rule in ("within", "answered"))
        return tree.CommandsDecl(self._name(peer), self._name(link), *within, *answered, **head)

    def _bound(self, node: ParseNode | None) -> tuple[tree.Expr | None, tree.Name | None]:
        """Return a number of cycles, and the reason to report when it is exceeded."""
        if node is None:
            return None, None
        cycles, *reason = node.children
        return self.expr(cycles), self._name(reason[0]) if reason else None

    def _adopt_value(self, node: ParseNode) -> tree.AdoptDecl:
        place, value = map(self.expr, node.children)
        return tree.AdoptDecl(place, value, **self._head(node))

    def _adopt_after(self, node: ParseNode) -> tree.AdoptDecl:
        return replace(self._adopt_value(node), after=True)

    def _level_decl(self, node: ParseNode) -> tree.LevelDecl:
        head = self._head(node)
        parts = node.children[1:]
        period, before = self._find(parts, "period"), self._find(parts, "preprocess")
        after = self._find(parts, "postprocess")
        clauses = (part for part in parts if self._rule(part) in {"one_table", "by_command"})
        return tree.LevelDecl(
            self._name(node.children[0]),
            self.expr(period.children[0]) if period else None,
            self._names(before.children[0]) if before else (),
            tuple(map(self._table_clause, clauses)),
            self._names(after.children[0]) if after else (),
            **head,
        )

    def _table_clause(self, node: ParseNode) -> tree.TableClause:
        above = self._above(node)
        first, *rest = node.children
        if node.data == "one_table":
            return tree.TableClause(self._name(first), None, (), **above)
        arms = (
            tree.Dispatch(self.expr(d.children[0]), self._name(d.children[1]), self._span(d)) for d in rest
        )
        return tree.TableClause(None, self.expr(first), tuple(arms), **above)

    # --- types and units ---

    def type(self, node: ParseNode) -> tree.TypeExpr:
        """Build any type."""
        span = self._span(node)
        match node.data:
            case "bool_type":
                return tree.BoolType(span)
            case "named_type":
                return tree.NamedType(self._name(node.children[0]), span)
            case "array_type":
                return tree.ArrayType(self.expr(node.children[0]), self.type(node.children[1]), span)
            case rule:
                low, high, *unit = node.children
                built = _NUMBER_TYPES[rule]
                most, own = self.expr(high), self._unit(unit)
                if (
                    own is None
                    and isinstance(most, tree.IntLiteral | tree.RealLiteral)
                    and most.unit is not None
                ):
                    # the parser reads `0 .. 9 [mm]` with the unit at the 9; it is the type's
                    most, own = replace(most, unit=None), most.unit
                return built(self.expr(low), most, own, span)

    def _unit(self, items: list[Any]) -> tree.Unit | None:
        if not items:
            return None
        node = self._find(items, "unit")
        if node is None:
            return None
        product, *divisors = [item for item in node.children if self._rule(item)]
        factors = [self._factor(f, 1) for f in product.children if self._rule(f)]
        factors += [self._factor(f, -1) for f in divisors]
        return tree.Unit(tuple(factor for factor in factors if factor is not None), self._span(node))

    def _factor(self, node: ParseNode, sign: int) -> tree.UnitFactor | None:
        if node.data == "unit_one":
            return None
        names = [item for item in node.children if item.type in ("NAME", "INT")]
        power = int(names[1]) if len(names) > 1 else 1
        return tree.UnitFactor(self._name(names[0]), sign * power)

    # --- expressions ---

    def expr(self, node: ParseNode) -> tree.Expr:
        """Build any expression."""
        rule, span, parts = node.data, self._span(node), node.children
        if rule in LOGIC:  # the rule is called as the word is
            return tree.Binary(rule, self.expr(parts[0]), self.expr(parts[1]), span)
        if rule in ("compare", "arithmetic"):
            return tree.Binary(str(parts[1]), self.expr(parts[0]), self.expr(parts[2]), span)
        if rule in ("negate", "minus"):
            return tree.Unary("not" if rule == "negate" else "-", self.expr(parts[-1]), span)
        built: tree.Expr = getattr(self, f"_{rule}")(parts, span)
        return built

    def _was(self, parts: list[Any], span: Span) -> tree.Expr:
        return tree.Was(self.expr(parts[0]), span)

    def _once(self, parts: list[Any], span: Span) -> tree.Expr:
        return tree.Once(self.expr(parts[-1]), span)

    def _since(self, parts: list[Any], span: Span) -> tree.Expr:
        return tree.Since(self.expr(parts[0]), self.expr(parts[-1]), span)

    def _event(self, parts: list[Any], span: Span) -> tree.Expr:
        return tree.Event(self._name(parts[0]), self.expr(parts[1]), None, span)

    def _event_when(self, parts: list[Any], span: Span) -> tree.Expr:
        word, condition = parts[0].children
        return tree.Event(self._name(word), self.expr(condition), self.expr(parts[-1]), span)

    def _lasts(self, parts: list[Any], span: Span) -> tree.Expr:
        return tree.Lasts(self.expr(parts[0]), self._time(parts[-1]), span)

    def _in_set(self, parts: list[Any], span: Span) -> tree.Expr:
        return tree.InSet(self.expr(parts[0]), self._members(parts[-1].children), span, len(parts) > 2)

    def _in_named(self, parts: list[Any], span: Span) -> tree.Expr:
        return tree.InSet(self.expr(parts[0]), (self._named_set(parts[-1]),), span, len(parts) > 2)

    def _in_range(self, parts: list[Any], span: Span) -> tree.Expr:
        low, high = parts[-1].children
        return tree.InRange(self.expr(parts[0]), self.expr(low), self.expr(high), span, len(parts) > 2)

    def _members(self, parts: list[Any]) -> tuple[tree.Member, ...]:
        return tuple(self._member(part) for part in parts)

    @staticmethod
    def _groups(token: Any, span: Span) -> tree.Expr:
        return tree.Mask("_".join(token.lower().split()), span)

    def _member(self, node: Any) -> tree.Member:
        if not self._rule(node):
            return self._groups(node, self._span(node))
        if node.data != "range":
            return self.expr(node)
        low, high = node.children
        return tree.Range(self.expr(low), self.expr(high), self._span(node))

    def _named_set(self, token: Any) -> tree.NamedSet:
        name = self._name(token)
        return tree.NamedSet(name, name.span)

    def _field_of(self, parts: list[Any], span: Span) -> tree.Expr:
        return tree.FieldOf(self.expr(parts[0]), self._name(parts[-1]), span)

    def _index_of(self, parts: list[Any], span: Span) -> tree.Expr:
        return tree.IndexOf(self.expr(parts[0]), self.expr(parts[1]), span)

    def _bits_of(self, parts: list[Any], span: Span) -> tree.Expr:
        return tree.BitsOf(self.expr(parts[0]), self.expr(parts[1]), self.expr(parts[2]), span)

    def _true(self, _: list[Any], span: Span) -> tree.Expr:
        return tree.BoolLiteral(True, span)

    def _false(self, _: list[Any], span: Span) -> tree.Expr:
        return tree.BoolLiteral(False, span)

    def _integer(self, parts: list[Any], span: Span) -> tree.Expr:
        return tree.IntLiteral(str(parts[0]), self._unit(parts[1:]), span)

    def _mask(self, parts: list[Any], span: Span) -> tree.Expr:
        return tree.Mask("_".join(parts[0][2:].lower().replace("_", " ").split()), span)

    def _real_number(self, parts: list[Any], span: Span) -> tree.Expr:
        return tree.RealLiteral(str(parts[0]), self._unit(parts[1:]), span)

    def _reference(self, parts: list[Any], span: Span) -> tree.Expr:
        return tree.Reference(self._name(parts[0]), span)

    def _order(self, parts: list[Any], span: Span) -> tree.Expr:
        command, *given = parts
        fields = [part.children for part in given if len(part.children) > 1]
        named = tuple(tree.OrderField(self._name(name), self.expr(value)) for name, value in fields)
        return tree.Order(self._name(command), named, len(fields) < len(given), span)

    def _apply(self, parts: list[Any], span: Span) -> tree.Expr:
        return tree.Apply(self._name(parts[0]), tuple(self.expr(part) for part in parts[1:]), span)

    def _to_int(self, parts: list[Any], span: Span) -> tree.Expr:
        return tree.Apply(tree.Name("int", span), (self.expr(parts[0]),), span)

    def _to_real(self, parts: list[Any], span: Span) -> tree.Expr:
        return tree.Apply(tree.Name("real", span), (self.expr(parts[0]),), span)

    # --- cells ---

    def cell(self, node: ParseNode) -> Any:
        """Build a condition, an expression, requirements or a list of actions, by the start rule that parsed it."""
        part = node.children[0]
        match node.data:
            case "cell":
                return self._condition(part)
            case "requirements":
                return self._quoted(node)
            case "actions":
                return tuple(self.statement(item) for item in node.children if self._rule(item))
            case _:
                return self.expr(part)

    def _condition(self, node: ParseNode) -> tree.Condition:
        """Build a condition cell; `x for 2 [s]` states that the heading has been x for 2 s, `@T(x)` that it came to be x."""
        span, parts = self._span(node), node.children
        happening = self._happening(node)
        if happening is not None:
            return happening
        if node.data == "lasts":
            return tree.Lasting(self._untimed(parts[0]), self._time(parts[-1]), span)
        if node.data == "equals" and parts[0].data == "lasts":
            value, *_, time = parts[0].children
            within = self._span(value)
            return tree.Lasting(tree.Comparison("=", self.expr(value), within), self._time(time), span)
        last = parts[-1] if node.data == "listed" else None
        if last is not None and self._rule(last) == "lasts":  # of the whole list
            value, *_, time = last.children
            members = self._members([*parts[:-1], value])
            return tree.Lasting(tree.OneOf(members, span), self._time(time), span)
        return self._untimed(node)

    def _happening(self, node: ParseNode) -> tree.Happens | None:
        """Build an event of the heading; None of any other cell."""
        whole = node.children[0] if node.data == "equals" else node
        if self._rule(whole) not in ("event", "event_when", "negate", "happens"):
            return None
        negated, guarded = (self._kind(whole.children, word) is not None for word in ("NOT", "WHEN"))
        inner = whole if whole.data == "event" else whole.children[negated]
        if self._rule(inner) not in ("event", "happening"):
            return None
        word, *said = inner.children
        operand: tree.Comparison | tree.OneOf | tree.Between | None = None
        if said and inner.data == "event":
            operand = tree.Comparison("=", self.expr(said[0]), self._span(said[0]))
        elif said:
            operand = self._untimed(said[0])
        guard = self.expr(whole.children[-1]) if guarded else None
        return tree.Happens(self._name(word), operand, guard, self._span(node), negated)

    def _untimed(self, node: ParseNode) -> tree.Comparison | tree.OneOf | tree.Between:
        span, parts = self._span(node), node.children
        match node.data:
            case "equals":
                return tree.Comparison("=", self.expr(parts[0]), span)
            case "groups":
                return tree.Comparison("=", self._groups(parts[0], span), span)
            case "comparison":
                return tree.Comparison(str(parts[0]), self.expr(parts[1]), span)
            case "one_of":
                return tree.OneOf(self._members(parts[-1].children), span, len(parts) > 1)
            case "listed":
                return tree.OneOf(self._members(parts), span)
            case "of_set":
                return tree.OneOf((self._named_set(parts[-1]),), span, len(parts) > 1)
            case _:
                low, high = parts[-1].children
                return tree.Between(self.expr(low), self.expr(high), span, len(parts) > 1)

    # --- statements ---

    def block(self, node: ParseNode) -> tuple[tree.Statement, ...]:
        """Build the statements between braces."""
        return tuple(self.statement(item) for item in node.children if self._rule(item))

    def statement(self, node: ParseNode) -> tree.Statement:
        """Build any statement."""
        built: tree.Statement = getattr(self, f"_{node.data}_statement")(node.children, self._above(node))
        return built

    def _assign_statement(self, parts: list[Any], above: dict[str, Any]) -> tree.Statement:
        return tree.Assign(self.expr(parts[0]), self.expr(parts[1]), False, **above)

    def _defer_statement(self, parts: list[Any], above: dict[str, Any]) -> tree.Statement:
        return tree.Assign(self.expr(parts[0]), self.expr(parts[1]), True, **above)

    def _local_statement(self, parts: list[Any], above: dict[str, Any]) -> tree.Statement:
        value = self.expr(parts[2]) if len(parts) > 2 else None
        return tree.Local(self._name(parts[0]), self.type(parts[1]), value, **above)

    def _if_statement(self, parts: list[Any], above: dict[str, Any]) -> tree.Statement:
        condition, then = self.expr(parts[0]), self.block(parts[1])
        orelse: tuple[tree.Statement, ...] = ()
        if len(parts) > 2:
            other = parts[2]
            orelse = self.block(other) if other.data == "block" else (self.statement(other),)
        return tree.If(condition, then, orelse, **above)

    def _case_statement(self, parts: list[Any], above: dict[str, Any]) -> tree.Statement:
        arms = tuple(self._arm(part) for part in parts[1:] if part.data == "arm")
        last = self._find(parts[1:], "block")
        return tree.Case(self.expr(parts[0]), arms, None if last is None else self.block(last), **above)

    def _arm(self, node: ParseNode) -> tree.Arm:
        above = self._above(node)
        values = tuple(self.expr(part) for part in node.children[:-1])
        return tree.Arm(values, self.block(node.children[-1]), **above)

    def _for_statement(self, parts: list[Any], above: dict[str, Any]) -> tree.Statement:
        name, low, high, body = parts
        return tree.For(self._name(name), self.expr(low), self.expr(high), self.block(body), **above)

    def _call_statement(self, parts: list[Any], above: dict[str, Any]) -> tree.Statement:
        return tree.Call(self._name(parts[0]), tuple(self.expr(part) for part in parts[1:]), **above)
