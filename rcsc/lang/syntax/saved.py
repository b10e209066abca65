"""Lark's parser as a text that is kept: Lark takes longer to make it than a small file takes to be proved.

In: a parser that Lark made of the grammar. Out: JSON with a line for each state, alike in every run, so that diffs show grammar changes;
and of that JSON, what `lark.Lark.load` takes. It is what Lark itself saves (`memo_serialize`), with states in the order of their first
visit and symbols in that of their names.

A process that reads one file of 2 KB takes 0.30 s of a processor with the saved parser (AMD EPYC, Python 3.11, Lark 1.3), and 0.25 s with
tables of our own and a loop that does nothing else than play them: not enough to keep such a loop.
"""

import json
from collections.abc import Iterator, Mapping
from typing import Any

Saved = dict[str, Any]
"""What Lark serializes: values of JSON, with numbers for keys and `@` for what is kept once in `memo`."""


def saved(parser: Any, of: str) -> str:
    """Return a parser as a text.

    Args:
        parser: A `lark.Lark` for LALR.
        of: The SHA-256 of the grammar's text.
    """
    data, memo = parser.memo_serialize([type(parser.terminals[0]), type(parser.rules[0])])
    table = data["parser"]["parser"]
    names, states = table.pop("tokens"), table.pop("states")
    met = list(_met(table, states, names))
    symbols = sorted(names.values())
    numbers, places = (
        {state: at for at, state in enumerate(met)},
        {name: at for at, name in enumerate(symbols)},
    )
    rows = [
        [n for name, to in _sorted(states[state], names) for n in (places[name], _number(to, numbers))]
        for state in met
    ]
    for which in ("start_states", "end_states"):
        table[which] = {start: numbers[state] for start, state in sorted(table[which].items())}
    parts = {"of": of, "data": data, "symbols": symbols}
    lines = [f"{_dense(name)}: {_dense(value)}" for name, value in parts.items()]
    listed: dict[str, list[Any]] = {"memo": [memo[at] for at in range(len(memo))], "states": rows}
    lines += [
        f"{_dense(name)}: [" + ",".join(f"\n{_dense(row)}" for row in part) + "\n]"
        for name, part in listed.items()
    ]
    return "{\n" + ",\n".join(lines) + "\n}\n"


def loadable(text: str, of: str) -> Saved | None:
    """Return what `lark.Lark.load` makes the parser of; None where the text is of another grammar."""
    read = json.loads(text)
    if read["of"] != of:
        return None
    states = {
        at: {
            symbol: (0, to) if to >= 0 else (1, {"@": -1 - to})
            for symbol, to in zip(row[::2], row[1::2], strict=True)
        }
        for at, row in enumerate(read["states"])
    }
    table = read["data"]["parser"]["parser"]
    table |= {"tokens": dict(enumerate(read["symbols"])), "states": states}
    return {"data": read["data"], "memo": dict(enumerate(read["memo"]))}


def _met(table: Saved, states: Mapping[int, Mapping[int, Any]], names: Mapping[int, str]) -> Iterator[int]:
    """Yield each state once, in the order of its first visit from the start rules."""
    waiting = [state for _, state in sorted(table["start_states"].items())]
    met = set(waiting)
    for state in waiting:
        yield state
        for _, (reduces, to) in _sorted(states[state], names):
            if not reduces and to not in met:
                met.add(to)
                waiting.append(to)


def _sorted(state: Mapping[int, Any], names: Mapping[int, str]) -> list[tuple[str, Any]]:
    return sorted(((names[symbol], to) for symbol, to in state.items()), key=lambda one: one[0])


def _number(to: tuple[int, Any], numbers: Mapping[int, int]) -> int:
    """Return the state that follows, or -1 - the number of the rule that is reduced."""
    reduces, which = to
    return -1 - which["@"] if reduces else numbers[which]


def _dense(value: object) -> str:
    return json.dumps(value, separators=(",", ":"))
