"""Older forms rewritten: `rcsc fmt --upgrade`. What is rewritten means the same to every program that uses it.

In: loaded files. Out: `Upgraded`, with the trees of those that change, what became of them, and what was left.

Four forms are rewritten, each where nothing comes to mean something else:

| before | after |
|---|---|
| a state that takes a value after a restart because of its name | `restart VALUE` |
| `deferred until` the condition that every last order is echoed | `deferred` |
| a procedure that the protocol makes where none is declared | nothing |
| what started with the least of its type, and would start otherwise now | `= VALUE` (`starts`) |

A program means the same when it resolves to the same program, but for the order of its procedures and for who says what it adopts
after a restart: no solver is asked. A protocol that a level writes by hand is left as it is. Numbers, echoes and what is held are
there in the level's own words, under its own conditions, and no rewriting of them could be shown to change nothing: what `serves`
and `commands` make may answer a cycle earlier or later. For these, what would be declared is written out.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TypeAlias

from rcsc.base.diagnostics.diagnostic import Diagnostic
from rcsc.lang.model import Enum, Program, VariableName
from rcsc.lang.project import Loaded
from rcsc.lang.resolve import closure, resolve
from rcsc.lang.restart import COMMAND, ECHO, ECHOED, NUMBER, SEEN, STATUS, Fixed
from rcsc.lang.syntax import tree
from rcsc.lang.syntax.spell import spell_expr, spell_field, spell_type
from rcsc.lang.written.starts import started_otherwise, written_out

_BY_HAND = (SEEN, NUMBER, ECHO)
"""Leaves that a level with declared roles does not assign itself."""

Trees: TypeAlias = Mapping[str, tree.File]


@dataclass(frozen=True, slots=True)
class Upgraded:
    """The result of an upgrade.

    Attributes:
        files: The new trees of files that change.
        done: The rewritings, in words.
        left: The declarations that each level with a protocol by hand could have, as text.
        diagnostics: Why a program that uses the files could not be read; then nothing changes.
    """

    files: Trees
    done: tuple[str, ...] = ()
    left: tuple[str, ...] = ()
    diagnostics: tuple[Diagnostic, ...] = ()


@dataclass(frozen=True, slots=True)
class _Rewriting:
    """A possible rewriting of one declaration: its file, its place there, and the new declaration."""

    file: str
    place: int
    instead: tree.Declaration | None
    words: str


def upgrade(loaded: Loaded, names: Sequence[str]) -> Upgraded:
    """Rewrite older forms in the files `names`, as far as every program of `loaded` that uses them means the same."""
    roots = [
        root for root in dict.fromkeys((*loaded.roots, *names)) if set(closure(root, loaded)) & set(names)
    ]
    programs: dict[str, Program] = {}
    for root in roots:
        program = resolve(root, loaded, least_first=True)
        if not isinstance(program, Program):
            return Upgraded({}, diagnostics=tuple(program))
        programs[root] = program
    work = _Upgrade(loaded, programs)
    kept = work.kept([each for name in names for each in work.rewritings(name)])
    left = tuple(text for root in roots if (text := _draft(root, loaded, programs[root], names)))
    changed = {each.file for each in kept}
    rewritten = replace(loaded, files=work.files(kept))
    started, values = written_out(rewritten, names, programs)
    rewritten = replace(rewritten, files={**rewritten.files, **started})
    for root in roots:
        if not isinstance(unread := resolve(root, rewritten), Program):
            return Upgraded({}, diagnostics=tuple(unread))
    files = {name: rewritten.files[name] for name in (*changed, *started)}
    done = (*(f"{each.file}: {each.words}" for each in kept), *values)
    return Upgraded(files, done, (*left, *started_otherwise(rewritten, programs)))


@dataclass(slots=True)
class _Upgrade:
    """The programs as they are, and the possible rewritings in their files."""

    loaded: Loaded
    programs: Mapping[str, Program]
    meaning: dict[str, Program] = field(init=False)

    def __post_init__(self) -> None:
        self.meaning = {root: _meaning(program) for root, program in self.programs.items()}

    def rewritings(self, name: str) -> Iterator[_Rewriting]:
        """Yield the possible rewritings in a file."""
        users = [program for root, program in self.programs.items() if name in closure(root, self.loaded)]
        for place, declared in enumerate(self.loaded.files[name].declarations):
            match declared:
                case tree.VariableDecl(restart=None) if declared.kind != "input":
                    member = _adopts(declared.name.text, users)
                    if member is not None:
                        value = tree.Reference(tree.Name(member))
                        words = f"`{declared.name.text}` says `restart {member}`"
                        yield _Rewriting(name, place, replace(declared, restart=value), words)
                case tree.ProcedureDecl("procedure", params=(), doc=(), comments=(), body=(tree.Assign(),)):
                    yield _Rewriting(name, place, None, f"`{declared.name.text}` is made by the protocol")
                case _:
                    pass
            if isinstance(declared, tree.VariableDecl) and declared.deferred_until is not None:
                bare = replace(declared, deferred_until=None, deferred=True)
                words = f"`{declared.name.text}` is `deferred`, without a condition"
                if any(program.roles is not None for program in users):
                    yield _Rewriting(name, place, bare, words)

    def kept(self, all_: Sequence[_Rewriting]) -> list[_Rewriting]:
        """Return the rewritings that change no meaning: all together, else as many as possible, in order."""
        if len({(each.file, each.place) for each in all_}) == len(all_) and self._same(all_):
            return list(all_)
        kept: list[_Rewriting] = []
        for each in all_:
            if not any((each.file, each.place) == (other.file, other.place) for other in kept):
                kept += [each] if self._same([*kept, each]) else []
        return kept

    def _same(self, rewritings: Sequence[_Rewriting]) -> bool:
        """Return whether every program means the same with them."""
        loaded = replace(self.loaded, files=self.files(rewritings))
        for root, before in self.meaning.items():
            after = resolve(root, loaded, least_first=True)
            if not isinstance(after, Program) or _meaning(after) != before:
                return False
        return True

    def files(self, rewritings: Sequence[_Rewriting]) -> Trees:
        """Return all files, with those rewritten."""
        files = dict(self.loaded.files)
        for name in {each.file for each in rewritings}:
            instead = {each.place: each.instead for each in rewritings if each.file == name}
            declarations = [instead.get(at, old) for at, old in enumerate(files[name].declarations)]
            files[name] = replace(files[name], declarations=tuple(d for d in declarations if d is not None))
        return files


def _meaning(program: Program) -> Program:
    """Return the program in a normal form: procedures sorted, and what it adopts after a restart stated in one place."""
    return replace(
        program,
        variables=tuple(replace(variable, restart=None) for variable in program.variables),
        procedures=tuple(sorted(program.procedures, key=lambda procedure: procedure.name)),
        restart=tuple((VariableName(leaf), value) for leaf, value in sorted(program.adopted.items())),
    )


def _adopts(name: str, programs: Sequence[Program]) -> str | None:
    """Return the member that a state adopts after a restart because of its name, in all of the programs; else None."""
    members = set()
    for program in programs:
        adopted = program.adopted.get(name)
        leaf = next((variable for variable in program.variables if variable.name == name), None)
        if leaf is None or not isinstance(adopted, Fixed) or not isinstance(leaf.type, Enum):
            return None
        members.add(leaf.type.members[int(adopted.value)])
    return members.pop() if len(members) == 1 else None


# --- what would be declared ----------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Buffer:
    """A variable of a record's type."""

    declared: tree.VariableDecl
    record: tree.RecordDecl

    @property
    def name(self) -> str:
        """The name of the variable."""
        return self.declared.name.text

    def has(self, *fields: str) -> bool:
        """Return whether the record has the fields."""
        return set(fields) <= {part.name.text for part in self.record.fields}

    def type_of(self, name: str) -> str:
        """Return the type of a field, as it is written."""
        return next(spell_type(part.type) for part in self.record.fields if part.name.text == name)

    def rest(self, *without: str) -> list[tree.FieldDecl]:
        """Return the fields except those."""
        return [part for part in self.record.fields if part.name.text not in without]


def _draft(root: str, loaded: Loaded, program: Program, names: Sequence[str]) -> str:
    """Return the declarations that a level with a protocol by hand could have instead; "" where there are none."""
    if program.roles is not None or not program.levels or not set(closure(root, loaded)) & set(names):
        return ""
    declarations = [d for file in closure(root, loaded) for d in loaded.files[file].declarations]
    buffers = list(_buffers(declarations))
    members = {enum.name: enum.members for enum in program.enums}
    lines = [*_superior(buffers, members), *_subordinates(buffers, members)]
    if not lines:
        return ""
    level = program.levels[0].name
    head = f"{root}: level `{level}` writes its protocol by hand, which stays as it is. It could declare"
    hand = ", ".join(f"`{name}`" for name in _written_by_hand(declarations))
    once = "A link stands once, in a file that both its levels use"
    tail = [f"in place of what {hand} do by hand. {once}" if hand else once]
    return "\n".join([head, "", *(f"  {line}" for line in lines), "", *tail])


def _buffers(declarations: Sequence[tree.Declaration]) -> Iterator[_Buffer]:
    records = {d.name.text: d for d in declarations if isinstance(d, tree.RecordDecl)}
    for declared in declarations:
        match declared:
            case tree.VariableDecl(kind="input" | "output", type=tree.NamedType(name)) if (
                name.text in records
            ):
                yield _Buffer(declared, records[name.text])
            case _:
                pass


def _superior(buffers: Sequence[_Buffer], members: Mapping[str, tuple[str, ...]]) -> Iterator[str]:
    orders = [b for b in buffers if b.declared.kind == "input" and b.has(NUMBER, COMMAND)]
    reports = [b for b in buffers if b.declared.kind == "output" and b.has(ECHO, ECHOED, STATUS)]
    if len(orders) == len(reports) == 1:
        yield from _link("superior", orders[0], reports[0], members)
        yield "serves superior : superior_link"


def _subordinates(buffers: Sequence[_Buffer], members: Mapping[str, tuple[str, ...]]) -> Iterator[str]:
    reports = {b.name: b for b in buffers if b.declared.kind == "input" and b.has(ECHO, ECHOED, STATUS)}
    for order in buffers:
        peer = order.name.removeprefix("to_")
        if (
            order.declared.kind == "output"
            and order.has(NUMBER, COMMAND)
            and peer in reports
            and peer != order.name
        ):
            yield from _link(peer, order, reports[peer], members)
            yield f"commands {peer} : {peer}_link"


def _link(
    peer: str, order: _Buffer, report: _Buffer, members: Mapping[str, tuple[str, ...]]
) -> Iterator[str]:
    command, status = order.type_of(COMMAND), report.type_of(STATUS)
    said = " ".join(
        f"{word} {_member(word, members.get(status, ()))}" for word in ("done", "failed", "executing")
    )
    yield f"link {peer}_link {{"
    yield f"  command : {command} rest {next(iter(members.get(command, ())), '?')}"
    yield f"  status : {status} {said}"
    for word, fields in (
        ("order", order.rest(NUMBER, COMMAND)),
        ("report", report.rest(ECHO, ECHOED, STATUS)),
    ):
        if fields:
            yield f"  {word} {{"
            yield from (f"    {_field(word, part, members)}" for part in fields)
            yield "  }"
    yield "}"


def _field(side: str, part: tree.FieldDecl, members: Mapping[str, tuple[str, ...]]) -> str:
    """Return a field of a link; an enumeration with `restart`, or with `none` first, becomes the reason of failures."""
    kind = spell_type(part.type)
    own = members.get(kind, ())
    if side == "report" and ("restart" in own or own[:1] == ("none",)):
        return f"reason {spell_field(part)}" + (" restart restart" if "restart" in own else "")
    return spell_field(part)


def _member(word: str, members: tuple[str, ...]) -> str:
    """Return the member of that name; else `?`, for the author to replace."""
    return word if word in members else "?"


def _written_by_hand(declarations: Sequence[tree.Declaration]) -> Iterator[str]:
    """Yield modules and procedures that number orders, echo them, or tell that one is new."""
    for declared in declarations:
        if isinstance(declared, tree.ProcedureDecl) and any(
            spell_expr(place).rpartition(".")[2] in _BY_HAND for place in _assigned(declared.body)
        ):
            yield declared.name.text


def _assigned(body: Sequence[tree.Statement]) -> Iterator[tree.Expr]:
    for statement in body:
        match statement:
            case tree.Assign(place):
                yield place
            case tree.If(_, then, orelse):
                yield from _assigned((*then, *orelse))
            case tree.Case(_, arms, orelse):
                yield from _assigned([inner for arm in arms for inner in arm.body])
                yield from _assigned(orelse or ())
            case tree.For(body=inner):
                yield from _assigned(inner)
            case _:
                pass
