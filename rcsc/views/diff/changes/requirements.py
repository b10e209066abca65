"""Requirements that are named otherwise than before; they mean nothing to a proof, so that no meaning changes with them."""

from collections.abc import Iterator

from rcsc.lang.model import Program


def named_otherwise(before: Program, after: Program) -> Iterator[str]:
    """Say of each place that names other requirements than before which are new and which are gone.

    A line that was renamed is another place.
    """
    old, new = dict(places(before)), dict(places(after))
    for place in dict.fromkeys((*old, *new)):
        gone = [name for name in old.get(place, ()) if name not in new.get(place, ())]
        more = [name for name in new.get(place, ()) if name not in old.get(place, ())]
        told = [f"{word} {', '.join(names)}" for word, names in (("new", more), ("gone", gone)) if names]
        if told:
            yield f"{place}: {'; '.join(told)}"


def places(program: Program) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Give each place of a program that can name requirements, in words, and those that it names."""
    for table in program.tables:
        yield f"table `{table.name}`", table.requirements
        for line in (*table.lines, table.default):
            if line is not None:
                yield f"table `{table.name}`, line {line.name}", line.requirements
    yield from ((f"procedure `{one.name}`", one.requirements) for one in program.procedures)
    yield from ((f"assumption `{one.name}`", one.requirements) for one in program.assumptions)
    yield from ((f"invariant `{one.name}`", one.requirements) for one in program.invariants)
    yield from ((f"property `{one.name}`", one.requirements) for one in program.properties)
