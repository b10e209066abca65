"""Everything that has a name before procedures and tables: units, enumerations, constants, types, variables.

Constants and types may be declared in any order: one that is asked for before its turn is resolved then.
"""

from collections.abc import Iterable

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Label
from rcsc.lang.expressions.scope import Scope
from rcsc.lang.model import Enum
from rcsc.lang.resolve import variables
from rcsc.lang.syntax import tree

MOST_LINKS = 100
MOST_REQUIREMENT = 80
"""Characters of the name of a requirement."""
_NOT_IN_REQUIREMENT = frozenset("|#\\")


def requirements(scope: Scope, written: Iterable[tree.Name]) -> tuple[str, ...]:
    """Return the names of requirements, each once; report an invalid name."""
    known: dict[str, tree.Name] = {}
    for name in written:
        wrong = _wrong(name.text)
        if wrong:
            scope.report(Code.REQUIREMENT_NAME, f"the name of a requirement {wrong}", name.span)
        elif name.text in known:
            message = f"requirement `{name.text}` is named twice"
            first = Label(known[name.text].span, "the first")
            scope.report(Code.REQUIREMENT_NAME, message, name.span, related=(first,))
        known.setdefault(name.text, name)
    return tuple(known)


def _wrong(name: str) -> str:
    """Return what is wrong with the name of a requirement; "" for nothing."""
    if not name or name != name.strip() or "  " in name:
        return "is empty, or has blanks around it or two together"
    if len(name) > MOST_REQUIREMENT:
        return f"has {len(name)} characters, more than {MOST_REQUIREMENT}"
    if not name.isprintable() or _NOT_IN_REQUIREMENT & set(name):
        return "has a character that does not print, or one of `|`, `#` and `\\`"
    return ""


class Names:
    """The declarations of one program that others refer to.

    Attributes:
        waiting: Constants and types not yet resolved, by `SPACE NAME`.
        path: Those being resolved now, each asked for by the one before.
    """

    def __init__(self, scope: Scope, all_: list[tree.Declaration]) -> None:
        self.scope = scope
        self.all = all_
        self.waiting: dict[str, tree.ConstDecl | tree.SetDecl | tree.TypeDecl | tree.RecordDecl] = {}
        self.path: list[str] = []

    def declare(self) -> tuple[Enum, ...]:
        """Declare everything, and return the enumerations in text order."""
        scope = self.scope
        for unit in (d for d in self.all if isinstance(d, tree.UnitDecl)):
            if scope.claim(unit.name, "unit"):
                scope.units.add(unit.name.text)
        enums = tuple(variables.declare_enum(scope, d) for d in self.all if isinstance(d, tree.EnumDecl))
        for const in self.all:
            match const:
                case tree.ConstDecl(name=name) if scope.claim(name, "value"):
                    self.waiting[f"value {name.text}"] = const
                case tree.SetDecl(name=name) if scope.claim(name, "value"):
                    scope.set_names.add(name.text)
                    self.waiting[f"value {name.text}"] = const
                case tree.TypeDecl(name=name) | tree.RecordDecl(name=name) if scope.claim(name, "type"):
                    self.waiting[f"type {name.text}"] = const
                case _:
                    pass
        declared = [d for d in self.all if isinstance(d, tree.VariableDecl)]
        mine = [variable for variable in declared if scope.claim(variable.name, "value")]
        scope.variables.update(variable.name.text for variable in mine)
        scope.demand = self._demand
        for key in list(self.waiting):
            if key in self.waiting:
                self._resolve(key)
        for variable in mine:
            variables.declare_variable(scope, variable)
        for variable in mine:
            variables.settle_deferred(scope, variable)
        return enums

    def _demand(self, space: str, name: tree.Name) -> bool:
        """Resolve a name that is asked for before its turn; return False (reported) where it depends on itself."""
        key = f"{space} {name.text}"
        if key in self.path:
            names = [link.partition(" ")[2] for link in (*self.path[self.path.index(key) :], key)]
            message = f"`{name.text}` is declared by means of itself: {' -> '.join(names)}"
            code = Code.KIND if space == "type" else Code.NOT_CONSTANT
            self.scope.report(code, message, name.span)
            return False
        if key in self.waiting:
            if len(self.path) == MOST_LINKS:
                message = f"declarations refer to each other more than {MOST_LINKS} deep"
                self.scope.report(Code.TOO_DEEP, message, name.span, "declare what is used before its use")
                return False
            self._resolve(key)
        return True

    def _resolve(self, key: str) -> None:
        scope, declaration = self.scope, self.waiting.pop(key)
        self.path.append(key)
        depth, scope.depth = scope.depth, 0
        match declaration:
            case tree.ConstDecl():
                variables.declare_constant(scope, declaration)
            case tree.SetDecl():
                variables.declare_set_of(scope, declaration)
            case tree.TypeDecl():
                variables.declare_type(scope, declaration)
            case tree.RecordDecl():
                variables.declare_record(scope, declaration)
        scope.depth = depth
        self.path.pop()
