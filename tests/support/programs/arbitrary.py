"""Arbitrary programs as trees: every kind of node, in the form that the parser gives."""

from dataclasses import replace
from functools import cache

from hypothesis import assume
from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy

from rcsc.lang.syntax import tree
from rcsc.lang.syntax.rows import Cell
from rcsc.lang.syntax.spell import spell_across, spell_condition
from rcsc.lang.syntax.tree import Name
from rcsc.lang.syntax.turned import NAMELESS_DEFAULT, NOTHING, crossed, name_of

NAMES = st.sampled_from(
    "a b long_name x1 status Z DEFAULT unreachable when line procedures status_out".split()
).map(Name)
WORDS = st.lists(st.sampled_from(["why", "a note", "  indented", "x := 3", "|"]), max_size=2).map(tuple)
DOCS = st.lists(st.sampled_from(["what it is", "in mm"]), max_size=2).map(tuple)
FACTORS = st.builds(
    tree.UnitFactor, st.sampled_from(["mm", "s", "N"]).map(Name), st.sampled_from([1, 1, 2, -1, -2])
)


def _sorted(factors: list[tree.UnitFactor]) -> tree.Unit:
    """Numerator first, as it is written."""
    return tree.Unit(tuple(sorted(factors, key=lambda factor: factor.power < 0)))


UNITS = st.lists(FACTORS, min_size=1, max_size=3).map(_sorted)
LITERALS: SearchStrategy[tree.Expr] = st.one_of(
    st.builds(tree.BoolLiteral, st.booleans()),
    st.builds(
        tree.IntLiteral,
        st.sampled_from(["0", "7", "1_000", "0x2F", "0b1_01", "18446744073709551615"]),
        st.none() | UNITS,
    ),
    st.builds(tree.Mask, st.sampled_from(["x", "x0xx", "0x01_1010", "1_x", "11_0X".lower()])),
    st.builds(tree.RealLiteral, st.sampled_from(["0.5", "1e-3", "2.5E7"]), st.none() | UNITS),
)
REFERENCES: SearchStrategy[tree.Expr] = NAMES.map(tree.Reference)
# Without `|`, which ends a cell of a table.
BINARY = st.sampled_from("implies and or xor = /= < <= > >= + - * / mod & << >>".split())


def _members(inner: SearchStrategy[tree.Expr]) -> SearchStrategy[tuple[tree.Member, ...]]:
    """Members of a set in braces, or the name of a set alone."""
    some = st.lists(inner | st.builds(tree.Range, inner, inner), min_size=1, max_size=3).map(tuple)
    return some | NAMES.map(lambda name: (tree.NamedSet(name),))


def _deeper(inner: SearchStrategy[tree.Expr]) -> SearchStrategy[tree.Expr]:
    two = st.tuples(inner, inner)
    return st.one_of(
        st.builds(tree.Unary, st.sampled_from(["not", "-"]), inner),
        st.builds(tree.Was, inner),
        st.builds(tree.Once, inner),
        st.builds(tree.Since, inner, inner),
        st.builds(tree.Lasts, inner, st.builds(tree.Time, inner, st.booleans())),
        st.builds(tree.Binary, BINARY, inner, inner),
        st.builds(tree.InSet, inner, _members(inner), negated=st.booleans()),
        st.builds(tree.InRange, inner, inner, inner, negated=st.booleans()),
        st.builds(
            tree.Apply,
            st.sampled_from(["abs", "int", "real", "single"]).map(Name),
            inner.map(lambda one: (one,)),
        ),
        st.builds(tree.Apply, st.sampled_from(["min", "max"]).map(Name), two),
        st.builds(tree.Apply, st.just(Name("count")), st.lists(inner, min_size=1, max_size=3).map(tuple)),
        st.builds(tree.FieldOf, REFERENCES, NAMES),
        st.builds(tree.IndexOf, REFERENCES, inner),
        st.builds(tree.BitsOf, REFERENCES, inner, inner),
        st.builds(
            tree.Order,
            NAMES,
            st.lists(st.builds(tree.OrderField, NAMES, inner), min_size=1, max_size=2).map(tuple),
            st.booleans(),
        ),
        st.builds(tree.Order, NAMES, st.just(()), st.just(True)),
    )


@cache  # Hypothesis examines a strategy at its first draw: one that is built again costs more than its draws
def expressions() -> SearchStrategy[tree.Expr]:
    return st.recursive(st.one_of(LITERALS, REFERENCES), _deeper, max_leaves=8)


@cache
def places() -> SearchStrategy[tree.Expr]:
    fields = st.builds(tree.FieldOf, REFERENCES, NAMES)
    return st.one_of(REFERENCES, fields, st.builds(tree.IndexOf, fields, expressions()))


BARE: SearchStrategy[tree.Expr] = st.one_of(
    st.builds(tree.IntLiteral, st.sampled_from(["0", "9"]), st.none()), REFERENCES
)


@cache
def types() -> SearchStrategy[tree.TypeExpr]:
    """Any type; a bound does not carry the unit, which is the type's."""
    simple: SearchStrategy[tree.TypeExpr] = st.one_of(
        st.just(tree.BoolType()),
        NAMES.map(tree.NamedType),
        st.builds(tree.IntType, BARE, BARE, st.none()),
        st.builds(tree.IntType, BARE, st.builds(tree.IntLiteral, st.just("5"), st.none()), UNITS),
        st.builds(tree.RealType, BARE, st.builds(tree.RealLiteral, st.just("5.0"), st.none()), UNITS),
        st.builds(tree.SingleType, BARE, st.builds(tree.RealLiteral, st.just("5.0"), st.none()), UNITS),
    )
    return st.recursive(simple, lambda inner: st.builds(tree.ArrayType, BARE, inner), max_leaves=2)


@cache
def calls() -> SearchStrategy[tree.Statement]:
    return st.builds(tree.Call, NAMES, st.lists(expressions(), max_size=2).map(tuple), comments=WORDS)


@cache
def assignments() -> SearchStrategy[tree.Statement]:
    return st.builds(tree.Assign, places(), expressions(), st.booleans(), comments=WORDS)


def _blocks(inner: SearchStrategy[tree.Statement]) -> SearchStrategy[tree.Statement]:
    body = st.lists(inner, max_size=2).map(tuple)
    some = st.lists(inner, min_size=1, max_size=2).map(tuple)
    values = st.lists(expressions(), min_size=1, max_size=2).map(tuple)
    arms = st.lists(st.builds(tree.Arm, values, some, comments=WORDS), min_size=1, max_size=2).map(tuple)
    return st.one_of(
        st.builds(tree.If, expressions(), body, some | st.just(()), comments=WORDS),
        st.builds(tree.Case, expressions(), arms, st.none() | some, comments=WORDS),
        st.builds(tree.For, NAMES, expressions(), expressions(), body, comments=WORDS),
    )


@cache
def statements() -> SearchStrategy[tree.Statement]:
    local = st.builds(tree.Local, NAMES, types(), st.none() | expressions(), comments=WORDS)
    return st.recursive(st.one_of(calls(), assignments(), local), _blocks, max_leaves=4)


COMPARISONS = st.sampled_from(["=", "/=", "<", "<=", ">", ">="])


@cache
def conditions() -> SearchStrategy[tree.Condition]:
    return st.one_of(
        st.builds(tree.Comparison, COMPARISONS, expressions()),
        st.builds(tree.OneOf, _members(expressions()), negated=st.booleans()),
        st.builds(tree.Between, expressions(), expressions(), negated=st.booleans()),
    )


@cache
def _columns() -> SearchStrategy[list[tree.Expr | None]]:
    return st.lists(st.one_of(st.just(None), expressions()), min_size=1, max_size=3)


@cache
def _cells() -> SearchStrategy[tuple[tree.Statement, ...]]:
    return st.lists(calls() | assignments(), max_size=2).map(
        lambda found: tuple(_bare(statement) for statement in found)
    )


ACTIONS = st.lists(st.sampled_from(["procedures", "command_out", "status_out", "place"]), max_size=3)
FEW = st.lists(NAMES, max_size=2).map(tuple)
REQUIREMENTS = st.lists(
    st.sampled_from(["SR-12", "req", "the door, shut", "§ 7.4 */"]).map(tree.Name), max_size=2
).map(tuple)


@st.composite
def tables(draw: st.DrawFn) -> tree.TableDecl:
    columns = draw(_columns())
    words = draw(ACTIONS)
    headings = tuple(tree.Heading(column, "when" if column is None else "") for column in columns)
    actions = tuple(
        tree.Heading(draw(places()), "") if w == "place" else tree.Heading(None, w) for w in words
    )
    rows = []
    for number in range(draw(st.integers(0, 3))):
        default = number == 2 and draw(st.booleans())
        conditions_ = tuple(
            None if default or draw(st.booleans()) else _condition(draw, heading) for heading in headings
        )
        done = tuple(draw(_cells()) if h.subject is None else _value(draw) for h in actions)
        unreachable = default and draw(st.booleans())
        row = tree.Row(f"l{number}", conditions_, done, default, unreachable, comments=draw(WORDS))
        rows.append(replace(row, above=draw(FEW), same=draw(FEW)))
    if traced := draw(st.booleans()):
        rows = [replace(row, requirements=draw(REQUIREMENTS)) for row in rows]
    return tree.TableDecl(
        draw(NAMES),
        draw(FEW),
        headings,
        actions,
        tuple(rows),
        traced,
        comments=draw(WORDS),
        doc=draw(DOCS),
        requirements=draw(REQUIREMENTS),
    )


@st.composite
def turned_tables(draw: st.DrawFn) -> tree.TableDecl:
    """A table printed the other way round: a matrix, or one with a column for each result."""
    matrix, named = draw(st.booleans()), draw(st.booleans())
    subjects = draw(_columns())
    headings = tuple(tree.Heading(column, "when" if column is None else "") for column in subjects)
    by = draw(st.sampled_from([tree.Heading(None, "when"), None])) if matrix else None
    by = tree.Heading(draw(expressions())) if matrix and by is None else by
    giving = draw(st.sampled_from([tree.Heading(None, "procedures"), None])) or tree.Heading(draw(places()))
    actions: SearchStrategy[tuple[tree.Statement, ...] | tree.Comparison]
    actions = _cells() if giving.subject is None else st.builds(tree.Comparison, st.just("="), expressions())
    across = []
    for number in range(draw(st.integers(1, 3))):
        whole = by is not None and by.subject is not None and draw(st.booleans())
        of = tree.Heading(None, "when") if whole or by is None else by
        said = draw(actions) if by is None else _condition(draw, of)
        column = tree.Across(f"c{number}", said, given=True, whole=whole, above=draw(FEW), same=draw(FEW))
        if draw(st.booleans()):
            shape = tree.Turned(by, giving, named, (), (), ())
            bare = replace(column, given=False, above=(), same=())
            text = spell_across(bare, shape).removeprefix("when " if whole else "")
            column = replace(bare, name=NOTHING if text == "-" else name_of([text]))
        across.append(column)
    rows = []
    traced = draw(st.booleans())
    for number in range(draw(st.integers(0, 3))):
        default = number == 2 and draw(st.booleans())
        conditions_ = tuple(
            None if default or ((named or at) and draw(st.booleans())) else _condition(draw, heading)
            for at, heading in enumerate(headings)
        )
        cells = [
            draw(actions if matrix or default else st.builds(tree.Comparison, st.just("="), expressions()))
            if draw(st.booleans())
            else ()
            for _ in range(1 if default else len(across))
        ]
        row = tree.Row(f"l{number}", conditions_, tuple(cells), default, default and draw(st.booleans()))
        row = replace(row, comments=draw(WORDS), requirements=draw(REQUIREMENTS) if traced else ())
        said_ = [
            "" if each is None else spell_condition(each, heading.subject is None)
            for each, heading in zip(conditions_, headings, strict=True)
        ]
        nameless = NAMELESS_DEFAULT if default else name_of(said_)
        row = replace(row, above=draw(FEW), same=draw(FEW)) if named else replace(row, name=nameless)
        rows.append(replace(row, cells=(Cell("", "", 0),) * (1 + len(conditions_) + len(cells))))
    shape = tree.Turned(by, giving, named, headings, tuple(across), tuple(rows))
    # before a condition, and after `once`, that is no name
    assume("'when'" not in repr(shape).replace("word='when'", ""))
    lines = crossed(shape)
    assume(all(len({each.name for each in of}) == len(of) for of in (across, rows, lines[2])))
    return tree.TableDecl(draw(NAMES), draw(FEW), *lines, traced, shape, comments=draw(WORDS))


def _bare(statement: tree.Statement) -> tree.Statement:
    """Without comments: a cell has none."""
    if isinstance(statement, tree.Call):
        return tree.Call(statement.name, statement.args)
    assert isinstance(statement, tree.Assign)
    return tree.Assign(statement.place, statement.value, statement.deferred)


def _condition(draw: st.DrawFn, heading: tree.Heading) -> tree.Condition:
    if heading.subject is None:
        return tree.Comparison("=", draw(expressions()))
    return draw(conditions())


def _value(draw: st.DrawFn) -> tuple[tree.Statement, ...] | tree.Comparison:
    return tree.Comparison("=", draw(expressions())) if draw(st.booleans()) else ()


@cache
def _dispatches() -> SearchStrategy[tuple[tree.Dispatch, ...]]:
    return st.lists(st.builds(tree.Dispatch, expressions(), NAMES), min_size=1, max_size=2).map(tuple)


@st.composite
def _clauses(draw: st.DrawFn) -> tree.TableClause:
    """A table of a level, or a choice."""
    if draw(st.booleans()):
        return tree.TableClause(None, draw(places()), draw(_dispatches()), comments=draw(WORDS))
    return tree.TableClause(draw(NAMES), None, (), comments=draw(WORDS))


@st.composite
def levels(draw: st.DrawFn) -> tree.LevelDecl:
    """A level of one table or several, of either kind."""
    return tree.LevelDecl(
        draw(NAMES),
        draw(st.none() | LITERALS),
        draw(FEW),
        tuple(draw(st.lists(_clauses(), min_size=1, max_size=3))),
        draw(FEW),
        comments=draw(WORDS),
        doc=draw(DOCS),
    )


_HEAD: dict[str, SearchStrategy[tuple[str, ...]]] = {"comments": WORDS, "doc": DOCS}
_REQUIRED: dict[str, SearchStrategy[tuple[object, ...]]] = {**_HEAD, "requirements": REQUIREMENTS}


def _names_of_things() -> SearchStrategy[tree.Declaration]:
    """What says a name of a file, a unit, a constant, a type or an owner."""
    some_names = st.lists(NAMES, min_size=1, max_size=3).map(tuple)
    fields = st.lists(
        st.builds(
            tree.FieldDecl, NAMES, types(), st.none() | expressions(), st.none() | expressions(), **_HEAD
        ),
        min_size=1,
        max_size=2,
    )
    return st.one_of(
        st.builds(tree.Use, st.sampled_from(["types", "task/vars"]), comments=WORDS),
        st.builds(tree.UnitDecl, NAMES, **_HEAD),
        st.builds(tree.ConstDecl, NAMES, expressions(), **_HEAD),
        st.builds(
            tree.SetDecl,
            NAMES,
            types(),
            _members(expressions()).filter(lambda those: not isinstance(those[0], tree.NamedSet)),
            **_HEAD,
        ),
        st.builds(tree.EnumDecl, NAMES, some_names, **_HEAD),
        st.builds(tree.TypeDecl, NAMES, types(), **_HEAD),
        st.builds(tree.RecordDecl, NAMES, fields.map(tuple), **_HEAD),
        st.builds(tree.OwnerDecl, NAMES, some_names | st.just(()), **_HEAD),
    )


def _variables_and_claims() -> SearchStrategy[tree.Declaration]:
    """Variables, and what is assumed of them or stated."""
    kinds, refusals = st.sampled_from(["input", "state", "output"]), st.sampled_from(["", "clamp", "reject"])
    may_be, standings = st.none() | expressions(), st.sampled_from(["", "assumed", "monitored", "proved"])
    words = st.sampled_from(["then", "until"])
    return st.one_of(
        st.builds(
            tree.VariableDecl,
            kinds,
            NAMES,
            types(),
            may_be,
            refusals,
            may_be,
            may_be,
            restart=may_be,
            **_HEAD,
        ),
        st.builds(
            tree.VariableDecl,
            kinds,
            NAMES,
            types(),
            may_be,
            refusals,
            deferred=st.just(True),
            restart=may_be,
            **_HEAD,
        ),
        st.builds(tree.AssumeDecl, NAMES, expressions(), standings, **_REQUIRED),
        st.builds(tree.InvariantDecl, NAMES, expressions(), **_REQUIRED),
        st.builds(tree.PropertyDecl, NAMES, expressions(), **_REQUIRED),
        st.builds(tree.PropertyDecl, NAMES, expressions(), words, expressions(), **_REQUIRED),
        _requirements(),
        _counted(),
    )


def _counted() -> SearchStrategy[tree.Declaration]:
    """Draw a requirement that counts, or says for how long."""
    time = st.builds(tree.Time, expressions(), st.booleans())

    def built(timing: str) -> SearchStrategy[tree.Declaration]:
        times = expressions() if timing == "at most" else st.none()
        none, mode = st.none(), expressions()
        scoped = st.builds(
            tree.RequirementDecl, NAMES, st.just("while"), mode, st.just(""), none, st.just(timing), expressions(), time,
            times=times, **_REQUIRED,
        )  # fmt: skip
        bare = st.builds(
            tree.RequirementDecl, NAMES, st.just(""), none, st.just(""), none, st.just(timing), expressions(), time,
            times=times, **_REQUIRED,
        )  # fmt: skip
        return scoped | bare

    return st.sampled_from(("at most", "at least", "on", "off")).flatmap(built)


def _requirements() -> SearchStrategy[tree.Declaration]:
    """Draw a requirement: what stands after each word is there where the word takes it."""
    one, of_two = (
        ("while", "unless", "before", "after", "only while", "only before", "only after"),
        ("between", "from"),
    )
    plain = ("at once", "next", "always", "never", "eventually", "at last")
    timed, stopped = ("within", "for", "exactly after"), ("until", "before", "only after")
    none, times = st.none(), st.builds(tree.Time, expressions(), st.booleans())

    def built(scope: str, trigger: str, timing: str) -> SearchStrategy[tree.Declaration]:
        return st.builds(
            tree.RequirementDecl,
            NAMES,
            st.just(scope),
            expressions() if scope else none,
            st.just(trigger),
            expressions() if trigger else none,
            st.just(timing),
            expressions(),
            times if timing in timed else none,
            expressions() if timing in stopped else none,
            expressions() if scope in of_two else none,
            monitored=st.booleans(),
            **_REQUIRED,
        )

    words = (("", *one, *of_two), ("", "when", "whenever"), (*plain, *timed, *stopped))
    return st.tuples(*map(st.sampled_from, words)).flatmap(lambda drawn: built(*drawn))


def _procedures() -> SearchStrategy[tree.Declaration]:
    params = st.lists(st.builds(tree.Parameter, NAMES, types()), max_size=2).map(tuple)
    body = st.lists(statements(), max_size=3).map(tuple)
    touched = st.lists(places(), max_size=2).map(tuple)
    module = {"reads": touched, "writes": touched, "body": body}
    code = st.sampled_from(["", "pkg.mod:fn"]), st.sampled_from(["", "c_fn"])
    return st.one_of(
        st.builds(tree.ProcedureDecl, st.just("procedure"), NAMES, params, body=body, **_REQUIRED),
        st.builds(tree.ProcedureDecl, st.just("module"), NAMES, **module, **_REQUIRED),
        st.builds(tree.ProcedureDecl, st.just("extern"), NAMES, params, touched, touched, *code, **_REQUIRED),
    )


@cache
def _roles() -> SearchStrategy[tree.Declaration]:
    fields = st.lists(
        st.builds(
            tree.LinkField,
            NAMES,
            types(),
            st.none() | expressions(),
            st.none() | expressions(),
            st.sampled_from(["", "stream", "reason"]),
            st.none() | expressions(),
            **_HEAD,
        ),
        max_size=2,
    ).map(tuple)
    names = st.lists(NAMES, max_size=2).map(tuple)
    bound = expressions(), st.none() | NAMES
    return st.one_of(
        st.builds(tree.LinkDecl, NAMES, *(NAMES for _ in range(6)), fields, fields, **_HEAD),
        st.builds(tree.ServesDecl, NAMES, NAMES, names, **_HEAD),
        st.builds(tree.CommandsDecl, NAMES, NAMES, **_HEAD),
        st.builds(tree.AdoptDecl, places(), expressions(), **_HEAD),
        st.builds(tree.AdoptDecl, places(), places(), st.just(True), **_HEAD),
        st.builds(tree.CommandsDecl, NAMES, NAMES, *bound, *bound, **_HEAD),
        st.builds(
            tree.CommandsDecl, NAMES, NAMES, st.none(), st.none(), expressions(), st.none() | NAMES, **_HEAD
        ),
    )


@cache
def declarations() -> SearchStrategy[tree.Declaration]:
    """Any declaration."""
    return st.one_of(
        _names_of_things(),
        _variables_and_claims(),
        _procedures(),
        tables(),
        turned_tables(),
        _roles(),
        levels(),
    )


@cache
def files() -> SearchStrategy[tree.File]:
    """A file of a few declarations."""
    return st.builds(tree.File, st.lists(declarations(), max_size=3).map(tuple), WORDS)
