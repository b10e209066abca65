"""Two effects in one region: where they differ, in which leaves, and how that is said.

In: what the two versions do in a region. Out: `Change`s. Each leaf is a question of its own, so that a hard one (doubles) does not
make the others hard; a leaf that is not decided raises, and nothing is called proved.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from rcsc.lang.interpret import UNDEFINED, ExternError
from rcsc.lang.model import Program
from rcsc.lang.model import Value as Scalars
from rcsc.proof.relation.effect import CALLS, RUN, differences, value_after
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.values import TRUE, Node
from rcsc.views.diff.changes.difference import Change, PartSort, Value, Where
from rcsc.views.diff.changes.value_text import in_words, number
from rcsc.views.diff.changes.versions import (
    MOST_BOXES,
    MOST_BOXES_ACROSS,
    Doing,
    Hit,
    Versions,
    is_across,
    is_hard,
)

_NAMES = {RUN: "the end of the run", CALLS: "extern calls"}
"""What is no leaf."""


@dataclass(frozen=True, slots=True)
class Contrast:
    """Two effects in a region.

    Attributes:
        region: Where both versions do what `pair` says.
        differ: By leaf (`RUN`: whether it comes to its end; `CALLS`: of extern procedures) where they differ; only what
            differs somewhere in the region.
    """

    versions: Versions
    region: Node
    pair: tuple[Doing, Doing]
    differ: Mapping[str, Node]

    @property
    def node(self) -> Node:
        """Where the effects differ, within the region."""
        return self.versions.shared.canonical(values.any_of(self.differ.values()))

    def everywhere(self) -> bool:
        """Return whether some leaf differs all over the region.

        Raises:
            UndecidedError: The solver gave up.
        """
        versions, whole = self.versions, self.node
        if not is_hard(whole):
            return not versions.possible(self.region, values.negation(whole))
        easy = [node for node in self.differ.values() if not is_hard(node)]
        return any(not versions.possible(self.region, values.negation(node)) for node in easy)

    def where(self, wanted: Node) -> Where:
        """Return the part of the region in which they differ and that holds all of `wanted`.

        Boxes of that part where they end soon; else boxes of the region, and what must hold there besides.

        Raises:
            UndecidedError: The solver gave up.
        """
        versions, whole = self.versions, self.node
        if self.everywhere():
            return versions.where(wanted, self.region)
        canonical = versions.shared.canonical
        inner = canonical(values.both(self.region, whole))
        if not is_hard(whole):
            most = MOST_BOXES_ACROSS if is_across(whole) else MOST_BOXES
            where = versions.where(canonical(values.both(wanted, whole)), inner, most)
            if where.exact:
                return where
        around = versions.where(wanted, self.region)
        besides = self._besides()
        also = f"{around.also} and ({besides})" if around.also else besides
        return replace(around, also=also, inputs=None)

    def _besides(self) -> str:
        """Return where they differ, as a condition in words; the leaves' names where that would be too long."""
        parts: list[str] = []
        long: list[str] = []
        for leaf, node in self.differ.items():
            text = in_words(self._unequal(leaf)) if leaf not in (RUN, CALLS) else in_words(node)
            (parts if text else long).append(text or f"{_NAMES.get(leaf, leaf)} differs")
        return " or ".join((*parts, *long))

    def _unequal(self, leaf: str) -> Node:
        pair = [value_after(doing.effect, leaf, self.versions.shared) for doing in self.pair]
        return self.versions.shared.canonical(values.negation(self.versions.shared.equal(*pair)))

    # --- what is left otherwise ---

    def left(self, wanted: Node, hit: Hit) -> tuple[Value, ...]:
        """Return the leaves that differ somewhere in `wanted`, in declared order.

        Raises:
            UndecidedError: The solver gave up.
        """
        ends = [
            _ended(self.versions, program, doing, hit.point)
            for program, doing in zip((self.versions.before, self.versions.after), self.pair, strict=True)
        ]
        return tuple(
            self._value(leaf, ends) for leaf, node in self.differ.items() if self.versions.meet(wanted, node)
        )

    def _value(self, leaf: str, ends: list[dict[str, Scalars] | None]) -> Value:
        if leaf == RUN:
            came = ["goes wrong" if end is None else "comes to its end" for end in ends]
            return Value("the run", (), "", "", (came[0], came[1]))
        effects = [doing.effect for doing in self.pair]
        if leaf == CALLS:
            names = [
                ", ".join(call.spelled.split()[0] for call in effect.calls) or "none" for effect in effects
            ]
            return Value(
                _NAMES[CALLS],
                (),
                names[0],
                names[1] if names[0] != names[1] else "with other values",
                ("", ""),
            )
        kind = self.versions.types[leaf]
        nodes = [value_after(effect, leaf, self.versions.shared) for effect in effects]
        words = [
            (in_words(node, kind) or "") if leaf in effect.leaves else "unchanged"
            for effect, node in zip(effects, nodes, strict=True)
        ]
        at = ["" if end is None else number(kind, end[leaf]) for end in ends]
        headings = dict.fromkeys(name for doing in self.pair for name in doing.headings.get(leaf, ()))
        return Value(leaf, tuple(headings), words[0], words[1], (at[0], at[1]))


def _ended(
    versions: Versions, program: Program, doing: Doing, point: Mapping[str, Scalars]
) -> dict[str, Scalars] | None:
    """Return the state after a run by the reference meaning; None where it goes wrong, or would run the user's code."""
    if doing.effect.calls:
        return None
    now = versions.snapshot(program, point)
    try:
        doing.run(program, now)
    except (*UNDEFINED, KeyError, ExternError):
        return None
    return now


def contrast(versions: Versions, region: Node, pair: tuple[Doing, Doing]) -> Contrast:
    """Return the places within a region where the two effects differ.

    Raises:
        UndecidedError: The solver gave up.
    """
    shared, (before, after) = versions.shared, (doing.effect for doing in pair)
    asked = {
        leaf: shared.canonical(node) for leaf, node in differences(before, after, versions.leaves, shared)
    }
    differ = {leaf: node for leaf, node in asked.items() if versions.meet(region, node)}
    return Contrast(versions, region, pair, differ)


def changes(
    versions: Versions, sort: PartSort, labels: tuple[str, str], region: Node, relied: Node = TRUE,
    against: Contrast | None = None,
) -> list[Change]:  # fmt: skip
    """Return a region as changes: where some version's assumptions hold, and the rest apart.

    Args:
        versions: Of what.
        sort: Of what sort.
        labels: What matches there, before and after.
        region: All of it; with `against`, only where the effects differ.
        relied: Where the assumptions of one version at least hold.
        against: The effects.

    Raises:
        UndecidedError: The solver gave up.
    """
    canonical, changed = versions.shared.canonical, []
    rest = region
    for relied_on, standing in ((True, relied), (False, values.negation(relied))):
        part = canonical(values.both(rest, standing))
        hit = versions.hit(part, TRUE if against is None else against.node)
        if hit is None:
            continue
        where = (
            versions.where(part, region if relied_on else part) if against is None else against.where(part)
        )
        left = () if against is None else against.left(part, hit)
        point = tuple(hit.point.items())
        changed.append(
            Change(sort, *labels, where, versions.spelled(hit.point), point, hit.least, left, relied_on)
        )
        rest = values.both(rest, values.negation(versions.inside(where.boxes)))
    return changed
