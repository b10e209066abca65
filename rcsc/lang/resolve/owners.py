"""Executing owners: what they run, in order."""

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Label
from rcsc.lang.expressions.scope import Scope
from rcsc.lang.model import Owner
from rcsc.lang.syntax import tree

MOST_MEMBERS = 10_000


class Owners:
    """The owners of a program.

    Attributes:
        runs: The procedures that each owner comes to, in order; owners inside it laid out.
    """

    def __init__(self, scope: Scope, written: list[tree.OwnerDecl]) -> None:
        self.scope = scope
        self.written = {owner.name.text: owner for owner in written}
        self.runs: dict[str, tuple[str, ...]] = {}
        for name in self.written:
            if name not in self.runs:
                self._lay_out(name)

    def all(self) -> tuple[Owner, ...]:
        """Return the owners as declared."""
        return tuple(
            Owner(name, tuple(m.text for m in owner.members), " ".join(owner.doc), owner.name.span)
            for name, owner in self.written.items()
        )

    def laid_out(self, names: tuple[tree.Name, ...]) -> tuple[str, ...]:
        """Return the procedures of the named owners and procedures, in order."""
        return tuple(procedure for name in names for procedure in self._runs_of(name))

    def _runs_of(self, member: tree.Name) -> tuple[str, ...]:
        """Return the procedures that a member runs; report one that is no owner and no procedure without parameters."""
        if member.text in self.runs:
            return self.runs[member.text]
        procedure = self.scope.procedures.get(member.text)
        if procedure is None:
            known = [*self.scope.procedures, *self.written]
            self.scope.unknown("module, procedure or owner", member, known)
            return ()
        if procedure.params:
            message = f"`{member.text}` takes arguments, and none are given here"
            self.scope.report(Code.WRONG_ARGUMENTS, message, member.span)
            return ()
        return (member.text,)

    def _lay_out(self, start: str) -> None:
        """Fill `runs` for `start` and all owners inside it; report a circle with its path."""
        path = {start: iter(self.written[start].members)}
        while path:
            name = next(reversed(path))
            member = next(path[name], None)
            if member is None:
                del path[name]
                self._finish(self.written[name])
            elif member.text in path:
                names = list(path)
                cycle = " -> ".join((*names[names.index(member.text) :], member.text))
                first = Label(self.written[member.text].name.span, "this owner")
                message = f"owners contain each other in a circle: {cycle}"
                self.scope.report(Code.OWNER_CYCLE, message, member.span, related=(first,))
                self.runs[member.text] = ()
            elif member.text in self.written and member.text not in self.runs:
                path[member.text] = iter(self.written[member.text].members)

    def _finish(self, owner: tree.OwnerDecl) -> None:
        runs: list[str] = []
        for member in owner.members:
            runs.extend(self._runs_of(member))
            if len(runs) > MOST_MEMBERS:
                message = f"`{owner.name.text}` runs more than {MOST_MEMBERS} procedures"
                self.scope.report(Code.LOOP_TOO_LONG, message, member.span)
                runs.clear()
                break
        self.runs[owner.name.text] = tuple(runs)
