"""What of a difference a system meets that stands in some state: for whoever is about to take the new tables.

In: a difference and a state. Out: its changes that some input leads to from there.
"""

from rcsc.diff.difference import Change, Part, ProgramDifference, holds_in
from rcsc.model import Kind, Program, Snapshot, key_of


def within_reach(found: ProgramDifference, after: Program, now: Snapshot) -> tuple[tuple[Part, Change], ...]:
    """The changes whose region the next cycle can meet if it begins in this state; inputs are free.

    A region that its boxes do not say exactly counts as met: in doubt a change is shown. What `preprocess` makes of
    the state is not followed; a state that it writes is to be left out of `now`.

    Args:
        found: The difference.
        after: The version to be taken.
        now: Values of states and outputs, by leaf; others may be left out.
    """
    kinds = {str(v.name): v.type for v in after.variables if v.kind is not Kind.INPUT and v.name in now}
    keys = {name: key_of(kind, now[name]) for name, kind in kinds.items()}
    return tuple(
        (part, change)
        for part in found.parts
        for change in part.changes
        if not change.where.exact
        or any(
            holds_in({name: part_ for name, part_ in box.items() if name in keys}, keys)
            for box in change.where.boxes
        )
    )
