"""The symbol file: what everything is called in C and in Python, and what a log or a shell shows of it."""

import json
from collections.abc import Iterator, Mapping
from itertools import chain

from rcsc.code.emit.c.ctext import c_type
from rcsc.code.emit.c.layout import Digest
from rcsc.code.emit.identifiers import Names
from rcsc.code.emit.plan import Plan
from rcsc.lang.leaves import may_write
from rcsc.lang.model import (
    Admit,
    Bool,
    Enum,
    Int,
    Kind,
    OneTable,
    Program,
    Read,
    Real,
    Role,
    Roles,
    TableChoice,
    Variable,
    VariableName,
    pending,
    unit_text,
)
from rcsc.lang.restart import Adopted, After, Fixed, SameAs, Stands


def symbols(plan: Plan, names: Names, digest: Digest) -> str:
    """Write the symbol file: every name, for tools."""
    p = names.program
    safe = {v.name for v in plan.program.variables if v.safe is not None}  # not what it was after a fault
    document = {
        **({"unproved": plan.mark} if plan.mark else {}),
        "program": p,
        "struct": f"{p}_t",
        "digest": {"meaning": digest.meaning, "layout": digest.layout, "state": digest.state},
        "header": f"{p}.h",
        "source": f"{p}.c",
        "init": f"{p}_init",
        "check": f"{p}_check",
        **({"defensive": True} if plan.defensive else {}),
        **({"roles": _roles(plan.program.roles)} if plan.program.roles is not None else {}),
        **({"restart": [*_adopted(plan.program.restart)]} if plan.program.restart is not None else {}),
        **({"unset": groups} if (groups := _unset(plan.program)) else {}),
        "invariants": [invariant.name for invariant in plan.program.invariants],
        "python": {"module": f"{p}.py", "class": "State"},
        **({"failed": names.failed} if len(names.failed) > 1 else {}),
        "leaves": [
            {
                "name": v.name,
                "kind": v.kind.value,
                "path": "".join(names.paths[v.name]),
                "c_type": c_type(v.type),
                "attribute": names.attributes[v.name],
                **_described(v),
            }
            for v in plan.program.variables
        ],
        "monitored": [plan.program.assumptions[at].name for at in plan.monitored],
        "tables": [
            {
                "name": t.table.name,
                "line": f"{p}_{names.tables[t.table.name]}_line",
                "lines_of_many": f"{p}_{names.tables[t.table.name]}_lines",
                "step": f"{p}_{names.tables[t.table.name]}_step",
                "lines": [line.name for line in t.lines],
                "sees": [name for name in t.table.variables if name not in safe],
                **({"stops": list(t.table.stops)} if t.table.stops else {}),
            }
            for t in plan.tables
        ],
        "levels": [
            {
                "name": level.name,
                "cycle": f"{p}_{names.levels[level.name]}_cycle",
                "period_ms": level.period_ms,
                **_dispatched(level.tables),
                **(
                    {"stages": [_stage(plan.program, stage) for stage in level.stages]}
                    if level.stages
                    else {}
                ),
            }
            for level in plan.program.levels
        ],
    }
    return json.dumps(document, indent=1) + "\n"


def _roles(roles: Roles) -> dict[str, object]:
    """Return whom the levels serve and command: the peer, the records of orders and reports, and the meaning of their members."""

    def said(role: Role) -> dict[str, str | None]:
        words = {"rest": role.rest, "done": role.done, "failed": role.failed, "reason": role.reason}
        return {"peer": role.peer, "order": role.order, "report": role.report, **words}

    superior = {"serves": said(roles.superior)} if roles.superior is not None else {}
    return {**superior, "commands": [said(role) for role in roles.subordinates]}


def _adopted(restart: tuple[tuple[VariableName, Adopted], ...]) -> Iterator[dict[str, object]]:
    """Yield an entry for each leaf that a restart gives another value than the initial one."""
    for leaf, adopted in restart:
        match adopted:
            case Fixed(value):
                yield {"leaf": leaf, "value": value}
            case SameAs(other):
                yield {"leaf": leaf, "same_as": other}
            case After(other):
                yield {"leaf": leaf, "after": other}
            case Stands():
                yield {"leaf": leaf, "stands": True}


MOST_DOC = 1000
"""Characters of what is said of a leaf; an array says it of each of its elements."""


def shortened(text: str) -> str:
    """Return a text as the symbol file has it, cut where it is long."""
    return text if len(text) <= MOST_DOC else f"{text[:MOST_DOC]}..."


def _described(variable: Variable) -> dict[str, object]:
    """Describe a leaf for a log or a shell: its range, unit or members, initial value and doc."""
    kind = variable.type
    entry: dict[str, object] = {"initial": variable.initial, "doc": shortened(variable.doc)}
    if variable.safe is not None:
        entry["safe"] = variable.safe
    if variable.admit is Admit.CLAMP:
        entry["clamp"] = True
    match kind:
        case Enum(members=members):
            entry["members"] = list(members)
        case Int(low, high, unit) | Real(low, high, unit):
            entry |= {"low": low, "high": high, "unit": unit_text(unit)}
        case Bool():
            pass
    return entry


def _stage(program: Program, stage: TableChoice) -> dict[str, object]:
    """Return the tables that run before the last one, and the leaf that holds the line of each."""
    leaves = program.line_leaves
    return {**_dispatched(stage), "kept": {name: leaves[name] for name in stage.names}}


def _dispatched(choice: TableChoice) -> dict[str, object]:
    """Return which table runs: one, or by the value of a leaf."""
    if isinstance(choice, OneTable):
        return {"table": choice.table}
    by = choice.selector.name if isinstance(choice.selector, Read) else ""
    return {"by": by, "tables": {str(int(value)): table for value, table in choice.tables}}


_Writers = tuple[tuple[tuple[str, tuple[str, ...]], ...], tuple[str, ...]]


def _unset(program: Program) -> list[dict[str, object]]:
    """Return the numbers that nobody has set when the program starts, grouped by their writers.

    They have no initial value of their own, but 0, which means nothing until a line, a procedure of the cycle
    or a buffer writes it. Members of enumerations and bools mean something from the start.

    Returns:
        Of each group `leaves`; `tables`: by table the lines that may write them; `levels`: those that may write them whichever line runs.
        Inputs are written by neither.
    """
    lines, levels = _by_line(program), _by_level(program)
    groups: dict[_Writers, list[VariableName]] = {}
    for variable in program.variables:
        if _meant_by_nobody(variable):
            names = {variable.name, pending(variable.name)}
            writers = (
                tuple(
                    (table, ran)
                    for table, own in lines.items()
                    if (ran := tuple(name for name, writes in own.items() if writes & names))
                ),
                tuple(name for name, writes in levels.items() if writes & names),
            )
            groups.setdefault(writers, []).append(variable.name)
    return [
        {
            "leaves": leaves,
            **({"tables": {table: list(ran) for table, ran in tables}} if tables else {}),
            **({"levels": list(whole)} if whole else {}),
        }
        for (tables, whole), leaves in groups.items()
    ]


def _meant_by_nobody(variable: Variable) -> bool:
    hidden = (variable.previous_of, variable.line_of)
    return (
        not variable.given
        and isinstance(variable.type, Int | Real)
        and hidden == (None, None)
        and not (variable.kind is Kind.STATE and variable.name.endswith(pending("")))
    )


def _by_line(program: Program) -> Mapping[str, Mapping[str, frozenset[VariableName]]]:
    """Return the variables that each line of each table may write."""
    procedures = {str(procedure.name): procedure for procedure in program.procedures}
    return {
        table.name: {
            line.name: may_write((action.statement for action in line.actions), procedures)
            for line in table.every_line
        }
        for table in program.tables
    }


def _by_level(program: Program) -> Mapping[str, frozenset[VariableName]]:
    """Return the variables that each level may write before its tables and after them."""
    writes = {str(procedure.name): procedure.writes for procedure in program.procedures}
    return {
        level.name: frozenset(
            chain.from_iterable(writes[name] for name in (*level.preprocess, *level.postprocess))
        )
        for level in program.levels
    }
