"""Scripts of orders: rows of a CSV or TOML file, checked whole against the levels that can be ordered.

In: a file, and a system. Out: rows, or all that is wrong with them. A column is a field of the order by its name (`command` is
the field that has the command), the end of a buffer from outside (`base.bumper`), or one of these:

- `level`: which level is ordered, where several can be;
- `cycles`: how long the row takes, whatever is reported; without it an order takes until it is done or failed;
- `within`: how many cycles it may take at most;
- `expect`: how it is to end where that is not `done`;
- `fault`: the plant's faults that are on while the row is under way, parted by spaces;
- `req`: the requirements that the row tests, parted by spaces; `rcsc trace` has them, and a run looks at none.

    command,target_mm,expect
    goto,500,
    goto,20000,failed
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from rcsc.base.diagnostics.coded import CodedError
from rcsc.base.diagnostics.codes import Code
from rcsc.base.host.described import nearest
from rcsc.base.host.files.read import MIB, Malformed, table_of, text, toml_of
from rcsc.lang.restart import PROTOCOL
from rcsc.run.description import Description
from rcsc.run.faults import UnknownFault
from rcsc.run.orders.roles import DONE, Served, field_of, served
from rcsc.run.signature import Leaf, Signature, Value

COMMAND, LEVEL, CYCLES, WITHIN, EXPECT, FAULT = "command", "level", "cycles", "within", "expect", "fault"
REQ = "req"
OWN = (COMMAND, LEVEL, CYCLES, WITHIN, EXPECT, FAULT, REQ)
"""Columns that are no field of an order."""
MOST_ROWS, MOST_CYCLES = 100_000, 10_000_000


class BadScript(CodedError):  # noqa: N818  # what happened, not an error of ours
    """A script that cannot be read; lists every wrong row."""

    code = Code.BAD_SCRIPT


@dataclass(frozen=True, slots=True)
class OrderRow:
    """One row.

    Attributes:
        number: As the file counts, from 1.
        text: As it is shown.
        served: Who is ordered; None for a row without a command.
        order: The fields of the order but its number, in the buffer's order.
        set: What buffers from outside hold while the row is under way: by the buffer, values by the place in it.
        cycles: How long it takes; None until it is answered.
        within: How many cycles it may take; None for any number.
        expect: The status that it is to end with.
        faults: The plant's faults that are on meanwhile.
    """

    number: int
    text: str
    served: Served | None = None
    order: tuple[Value, ...] = ()
    set: Mapping[str, Mapping[int, Value]] = field(default_factory=dict)
    cycles: int | None = None
    within: int | None = None
    expect: str = DONE
    faults: tuple[str, ...] = ()

    @property
    def timed(self) -> bool:
        """True for a row that takes a fixed number of cycles, whatever is reported."""
        return self.cycles is not None


@dataclass(frozen=True, slots=True)
class OutsideBuffer:
    """A buffer that no level fills, and its leaves as the level that takes it has them."""

    name: str
    leaves: tuple[Leaf, ...]

    def place(self, column: str) -> int | None:
        """Return the position of the leaf that a column names; None for none."""
        inner = column.removeprefix(self.name)
        names = [self._part(leaf) for leaf in self.leaves]
        return names.index(inner) if column.startswith(self.name) and inner in names else None

    @property
    def columns(self) -> list[str]:
        """The names of its leaves in a script."""
        return [f"{self.name}{self._part(leaf)}" for leaf in self.leaves]

    def _part(self, leaf: Leaf) -> str:
        return leaf.name.removeprefix(self._variable)

    @property
    def _variable(self) -> str:
        if len(self.leaves) == 1:
            return self.leaves[0].name
        return self.leaves[0].name.partition(".")[0].partition("[")[0]


def outside_buffers(system: Description, signs: Mapping[str, Signature]) -> tuple[OutsideBuffer, ...]:
    """Return the buffers from outside to a level; of several readers the first has the say, for they are declared alike."""
    buffers: dict[str, OutsideBuffer] = {}
    for wire in system.wires:
        level, _, variable = wire.target.partition(".")
        if level in signs and wire.source.partition(".")[0] not in signs and wire.source not in buffers:
            buffers[wire.source] = OutsideBuffer(wire.source, signs[level].leaves_of(variable))
    return tuple(buffers.values())


def script_path(name: str, folder: Path) -> Path:
    """Find the file that a name means: itself, or one beside the description or in `scripts` there."""
    path = Path(name)
    if path.suffix in {".csv", ".toml"} or path.is_file():
        return path if path.is_file() or not (folder / path).is_file() else folder / path
    places = [folder / place / f"{name}{end}" for place in ("scripts", ".") for end in (".csv", ".toml")]
    return next((place for place in places if place.is_file()), places[0])


def read_script(
    path: Path, system: Description, signs: Mapping[str, Signature], faults: Sequence[str] = ()
) -> tuple[OrderRow, ...]:
    """Read the rows of a script.

    Args:
        path: The file.
        system: The description.
        signs: The signatures of its levels, by name.
        faults: The names of the plant's faults.

    Raises:
        BadScript: The file cannot be read, or a row says what cannot be; all that is wrong is told.
    """
    lines = _lines(path)
    reader = _Reader(served(system, signs), outside_buffers(system, signs), tuple(faults))
    wrong = [f"{path}: {message}" for message in reader.check_columns(lines)]
    rows = []
    for number, line in enumerate(lines, 1) if not wrong else ():
        try:
            rows.append(reader.row(number, line))
        except ValueError as error:
            wrong.append(f"{path}, row {number}: {error}")
    if wrong:
        raise BadScript("\n".join(wrong))
    return tuple(rows)


def tested_by(path: Path) -> Iterator[tuple[int, str, tuple[str, ...]]]:
    """Yield the rows of a script that say which requirements they test: number, text and names.

    Raises:
        BadScript: The file cannot be read.
    """
    for number, line in enumerate(_lines(path), 1):
        if names := tuple(line.get(REQ, "").split()):
            yield number, _shown(line), names


def _lines(path: Path) -> list[dict[str, str]]:
    try:
        content = text(path, MIB)
        lines = _toml_rows(content) if path.suffix == ".toml" else table_of(content)
    except OSError as error:
        raise BadScript(f"{path} cannot be read: {error.strerror}") from error
    except Malformed as error:
        raise BadScript(f"{path}: {error}") from error
    if len(lines) > MOST_ROWS:
        raise BadScript(f"{path} has {len(lines)} rows, more than {MOST_ROWS}")
    return lines


def _shown(line: Mapping[str, str]) -> str:
    """Return the text of a row, without what it tests."""
    cells = ((name, cell) for name, cell in line.items() if name != REQ)
    return " ".join(cell if name in (COMMAND, LEVEL) else f"{name}={cell}" for name, cell in cells)


def _toml_rows(content: str) -> list[dict[str, str]]:
    rows = toml_of(content).get("row")
    if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
        raise Malformed("is no script: write each row under `[[row]]`")
    return [{name: _cell(name, value) for name, value in row.items()} for row in rows]


def _cell(name: str, value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str | int | float):
        return str(value).strip()
    raise Malformed(
        f'`{name}` is no text, number or bool; a name with a dot is written in quotes: "base.bumper"'
    )


def faults_in(cell: str, known: Sequence[str]) -> tuple[str, ...]:
    """Return the faults that a cell under `fault` names.

    Raises:
        ValueError: One is none of these.
    """
    names = tuple(cell.split())
    for name in names:
        if name not in known:
            error = UnknownFault(name, known)
            raise ValueError("; ".join((str(error), *error.helps)))
    return names


@dataclass(frozen=True, slots=True)
class _Reader:
    """Reads rows for the levels that can be ordered, and the buffers that can be set."""

    levels: tuple[Served, ...]
    buffers: tuple[OutsideBuffer, ...]
    faults: tuple[str, ...]

    def check_columns(self, lines: Sequence[Mapping[str, str]]) -> Iterator[str]:
        """Yield the errors in the names of columns."""
        fields = [field_of(leaf) for level in self.levels for leaf in level.order_leaves]
        known = {*OWN, *(name for name in fields if name not in PROTOCOL)}
        known |= {column for buffer in self.buffers for column in buffer.columns}
        for name in dict.fromkeys(name for line in lines for name in line):
            if name not in known:
                near = "".join(f"; {help_}" for help_ in nearest(name, sorted(known)))
                yield f"no order has a field `{name}`, and no buffer from outside is called so{near}"

    def row(self, number: int, line: Mapping[str, str]) -> OrderRow:
        """Read a row. Raises ValueError: the row has an error."""
        level = self._level(line) if COMMAND in line else None
        order = () if level is None else _order(level, line)
        fields = set() if level is None else {field_of(leaf) for leaf in level.order_leaves}
        stray = next((name for name in line if "." not in name and name not in (*OWN, *fields)), None)
        if stray is not None:
            raise ValueError(
                f"`{stray}` is no field of {'an order, for there is no `command`' if level is None else f'`{level.order}`'}"
            )
        expect = line.get(EXPECT, DONE if level is None else level.done)
        if level is not None:
            _read(level.report_leaves[level.status], expect, EXPECT)
        cycles, within = (_whole(line, name) for name in (CYCLES, WITHIN))
        return OrderRow(
            number,
            _shown(line),
            level,
            order,
            self._set(line),
            1 if level is None and cycles is None else cycles,
            within,
            expect,
            faults_in(line.get(FAULT, ""), self.faults),
        )

    def _level(self, line: Mapping[str, str]) -> Served:
        if not self.levels:
            raise ValueError(
                "no level is ordered from outside: a numbered order from outside, and a report back, are no buffers here"
            )
        names = [level.level for level in self.levels]
        if LEVEL not in line and len(names) > 1:
            raise ValueError(f"several levels can be ordered: name one under `level`: {', '.join(names)}")
        name = line.get(LEVEL, names[0])
        if name not in names:
            raise ValueError(
                f"no level `{name}` is ordered from outside{''.join(f'; {h}' for h in nearest(name, names))}"
            )
        return self.levels[names.index(name)]

    def _set(self, line: Mapping[str, str]) -> dict[str, dict[int, Value]]:
        values: dict[str, dict[int, Value]] = {}
        for name, cell in line.items():
            for buffer in self.buffers if "." in name else ():
                place = buffer.place(name)
                if place is not None:
                    values.setdefault(buffer.name, {})[place] = _read(buffer.leaves[place], cell, name)
        return values


def _order(level: Served, line: Mapping[str, str]) -> tuple[Value, ...]:
    """Return the fields of an order but its number, with the values that the row gives."""
    command = level.order_leaves[level.command]
    columns = {name: COMMAND if leaf is command else name for name, leaf in level.fields.items()}
    return level.order_with(
        {name: _read(level.fields[name], line[at], at) for name, at in columns.items() if at in line}
    )


def _read(leaf: Leaf, cell: str, column: str) -> Value:
    """Read the value of a cell. Raises ValueError: the cell is no value of the leaf."""
    try:
        value = leaf.read(cell)
    except ValueError:
        known = leaf.members or (("false", "true") if leaf.c_type == "bool" else ())
        near = "".join(
            f"; {help_}" for help_ in nearest(cell, known)
        ) or f"; known are {', '.join(known)}" * bool(known)
        limits = f", which holds {leaf.low} .. {leaf.high}" if leaf.low is not None else ""
        raise ValueError(f"`{cell}` under `{column}` is no value of `{leaf.name}`{limits}{near}") from None
    if isinstance(value, float) and not math.isfinite(value):
        raise ValueError(f"`{cell}` under `{column}` is no number")
    return value


def _whole(line: Mapping[str, str], name: str) -> int | None:
    cell = line.get(name)
    if cell is None:
        return None
    if not cell.isdecimal() or not 1 <= int(cell) <= MOST_CYCLES:
        raise ValueError(f"`{cell}` under `{name}` is no number of cycles")
    return int(cell)
