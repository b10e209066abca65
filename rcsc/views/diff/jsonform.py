"""A difference as JSON, for programs.

In: a `Difference`. Out: a JSON value with all of it; the same difference gives the same value on every machine.
"""

from typing import Any

from rcsc import __version__
from rcsc.views.diff.changes.difference import (
    Change,
    ComparedPart,
    Difference,
    Follows,
    ProgramDifference,
    Transition,
)

FORM = 1
"""Version of the JSON form; it rises when a member changes its meaning or goes away."""
Json = dict[str, Any]


def to_json(difference: Difference) -> Json:
    """Return the difference as a JSON value."""
    return {
        "form": FORM,
        "tool": {"name": "rcsc", "version": __version__},
        "command": "diff",
        "before": difference.before,
        "after": difference.after,
        "changed": difference.changed,
        "decided": not difference.undecided,
        "said": list(difference.notes),
        "programs": [_program_json(program) for program in difference.programs],
    }


def _program_json(program: ProgramDifference) -> Json:
    return {
        "program": program.name,
        "changed": program.changed,
        "undecided": list(program.undecided),
        "declarations": [
            {"what": d.what, "before": d.before, "after": d.after} for d in program.declarations
        ],
        "parts": [_part_json(part) for part in program.parts],
        "traces": [
            {"level": t.level, "new": [_step_json(s) for s in t.new], "gone": [_step_json(s) for s in t.gone]}
            for t in program.traces
        ],
        "follows": [_follows_json(follow) for follow in program.follows],
        "requirements": list(program.requirements),
    }


def _follows_json(follows: Follows) -> Json:
    return {
        "level": follows.level,
        "table": follows.table,
        "decided": follows.decided,
        "new": [list(pair) for pair in follows.new],
        "gone": [list(pair) for pair in follows.gone],
    }


def _part_json(part: ComparedPart) -> Json:
    return {
        "what": part.what,
        "name": part.name,
        "changed": part.changed,
        "said": list(part.notes),
        "basis": None if part.basis is None else part.basis.value,
        "questions": part.queries,
        "changes": [_change_json(change) for change in part.changes],
        "moved": [_change_json(change) for change in part.moved],
    }


def _change_json(change: Change) -> Json:
    where = change.where
    return {
        "sort": change.sort.value,
        "before": change.before,
        "after": change.after,
        "relied_on": change.relied_on,
        "where": {
            "boxes": [list(words) for words in where.words],
            "exact": where.exact,
            "also": where.also,
            "inputs": None if where.inputs is None else {"in": where.inputs[0], "of": where.inputs[1]},
        },
        "input": dict(change.witness),
        "least": change.least,
        "values": [
            {
                "leaf": value.leaf,
                "headings": list(value.headings),
                "before": value.before,
                "after": value.after,
                "at_input": list(value.at),
            }
            for value in change.values
        ],
    }


def _step_json(step: Transition) -> Json:
    return {
        "variable": step.variable,
        "from": step.before,
        "to": step.after,
        "by": list(step.by),
        "trace": [{"state": state, "line": line} for state, line in step.trace],
        "input": dict(step.witness),
    }
