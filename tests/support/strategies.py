"""Texts of typed expressions over a few declared variables, and snapshots of any program, leaning on edges."""

from dataclasses import dataclass
from functools import cache
from random import Random

from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy

from rcsc.code.testing.inputs.sampling import declarations, snapshot
from rcsc.lang.model import Program, Snapshot

__all__ = ["INTS", "REALS", "conditions", "integers_over", "reals_over", "snapshots_of"]


@dataclass(frozen=True, slots=True)
class Names:
    """Variables of one kind that expressions may read, and the constants they meet."""

    declared: str
    variables: tuple[str, ...]
    constants: tuple[str, ...]


INTS = Names(
    "input a : int -7 .. 9\ninput b : int 0 .. 3\ninput c : int -9223372036854775808 .. 9223372036854775807\n",
    ("a", "b", "c"),
    ("0", "1", "2", "-1", "-3", "5", "7", "9223372036854775807"),
)
REALS = Names(
    "input x : real -1.5 .. 2.5\ninput y : real 0.0 .. 1e300\ninput z : real 1e-310 .. 3.0\n",
    ("x", "y", "z"),
    ("0.0", "1.0", "-1.0", "0.1", "3.5", "1e-300", "1e300"),
)


def _over(names: Names, operators: tuple[str, ...]) -> SearchStrategy[str]:
    leaves = st.sampled_from(names.variables + names.constants)

    def grown(inner: SearchStrategy[str]) -> SearchStrategy[str]:
        return st.one_of(
            st.builds("({} {} {})".format, inner, st.sampled_from(operators), inner),
            st.builds("{}({}, {})".format, st.sampled_from(("min", "max")), inner, inner),
            st.builds("abs({})".format, inner),
            st.builds("(-{})".format, inner),
        )

    return st.recursive(leaves, grown, max_leaves=6)


@cache  # Hypothesis examines a recursive strategy at its first draw: one that is built again costs more than its draws
def integers_over(names: Names = INTS) -> SearchStrategy[str]:
    return _over(names, ("+", "-", "*", "/", "mod"))


@cache
def reals_over(names: Names = REALS) -> SearchStrategy[str]:
    return _over(names, ("+", "-", "*", "/"))


EQUAL = ("=", "/=")
ORDERED = (*EQUAL, "<", "<=", ">", ">=")


def _compared(
    subject: str, constants: SearchStrategy[str], sets: bool, operators: tuple[str, ...]
) -> SearchStrategy[str]:
    operator = st.sampled_from(operators)
    comparison = st.builds("{} {} {}".format, st.just(subject), operator, constants)
    turned = st.builds("{} {} {}".format, constants, operator, st.just(subject))
    if not sets:
        return st.one_of(comparison, turned)
    among = st.builds("{} in {{{}, {}}}".format, st.just(subject), constants, constants)
    return st.one_of(comparison, turned, among)


def conditions(
    subjects: tuple[str, ...],
    constants: SearchStrategy[str],
    sets: bool = True,
    operators: tuple[str, ...] = ORDERED,
) -> SearchStrategy[str]:
    """A boolean combination of conditions of subjects against constants."""
    leaf = st.one_of([_compared(subject, constants, sets, operators) for subject in subjects])
    return st.recursive(
        leaf,
        lambda inner: st.one_of(
            st.builds("({} {} {})".format, inner, st.sampled_from(("and", "or", "xor", "implies")), inner),
            st.builds("not ({})".format, inner),
        ),
        max_leaves=5,
    )


def snapshots_of(program: Program) -> SearchStrategy[Snapshot]:
    """A value for every leaf: bounds, constants it meets and their neighbours, or any value of its range."""
    known = declarations(program)
    return st.integers(0, 2**64 - 1).map(
        lambda seed: snapshot(known, None, Random(seed))  # noqa: S311  # drawn, so repeatable
    )
