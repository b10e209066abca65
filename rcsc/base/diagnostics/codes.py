"""Every code in one catalogue: a code's title, why it is reported, and an example with its message and its mend."""

import re
from dataclasses import dataclass
from enum import StrEnum
from inspect import cleandoc
from textwrap import dedent
from typing import Self

FAMILIES = {
    "1": "syntax and files",
    "2": "names and writers",
    "3": "kinds, units and ranges",
    "4": "proof",
    "5": "generated files",
    "6": "tests of what is generated",
    "7": "running systems and recorded runs",
    "9": "bugs in rcsc",
}
"""The subject of the codes with this first digit."""

_REPORT = re.compile(r"(?:error|warning|note): ")


@dataclass(frozen=True, slots=True)
class CodeText:
    """One entry of the catalogue, taken apart.

    Attributes:
        title: What it is, in a few words, in lower case.
        text: Why it is reported, what to do, and how it arises where there is no example; code is indented by four.
        wrong: A whole source text that is reported with this code and no other; may be empty.
        report: How: its severity and message, as `error: the divisor can be zero`; empty where `wrong` is.
        right: The same text, mended; may be empty.
    """

    title: str
    text: str
    wrong: str
    report: str
    right: str


class Code(StrEnum):
    """Stable identity of a diagnostic, never renumbered and never reused; the value is what users see and search for.

    An entry is code and title, paragraphs, and perhaps an example: a text, how it is reported, the text mended.
    """

    entry: str

    def __new__(cls, entry: str) -> Self:
        """Return a member with its entry; its value is the code that the entry begins with."""
        code = entry.partition(":")[0]
        member = str.__new__(cls, code)
        member._value_ = code
        member.entry = entry
        return member

    @property
    def explanation(self) -> CodeText:
        """Return the text of `rcsc explain`."""
        title, *blocks = cleandoc(self.entry.partition(": ")[2]).split("\n\n")
        at = next((at for at, block in enumerate(blocks) if _REPORT.match(block)), None)
        if at is None:
            return CodeText(title, "\n\n".join(blocks), "", "", "")
        wrong, report, *right = blocks[at - 1 :]
        return CodeText(
            title, "\n\n".join(blocks[: at - 1]), _unindented(wrong), report, "".join(map(_unindented, right))
        )

    SYNTAX = """RCS101: the text is not in the language

    The parser met something that cannot stand there; the message says what could. Newlines mean nothing outside tables, so the mistake
    may be at the end of the line before. One message is given for the first mistake of a declaration; reading goes on with the next
    declaration.

        input ready bool

    error: expected `:`, found `bool`

        input ready : bool
    """
    RAGGED_ROW = """RCS102: a row has another number of cells than the heading

    Every row of a table has a cell for each heading, with one `||` between conditions and actions. Leave a cell blank rather than out:
    a blank condition is don't care, a blank action does nothing. A row ends with `|`: one that is cut short is refused, as nobody knows
    what it was to say.

        input ready : bool
        output go : bool
        table start {
          | line | ready || go   |
          | yes  | true  ||
          | no   | false || false |
        }

    error: this row has 0 cells of actions, the heading 1

        input ready : bool
        output go : bool
        table start {
          | line | ready || go    |
          | yes  | true  ||       |
          | no   | false || false |
        }
    """
    TOO_DEEP = """RCS103: nested too deeply

    Expressions, blocks and types nest at most 100 deep, so that no stage can run out of stack. Name the parts: a procedure for
    an inner block, a local for a part of an expression.

    It arises for example from one hundred and one opening parentheses.
    """
    TOO_LARGE = """RCS104: the file is too large

    A source file has at most 16 MiB, which is some 100 000 lines of a table. Split it, and let a file `use` the others.
    """
    BAD_ENCODING = """RCS105: the file is not UTF-8

    Source files are UTF-8 (a byte order mark at the start is tolerated). The message names the first byte that is not. Save the file
    again in that encoding.
    """
    NUL_BYTE = """RCS106: the file contains a NUL byte

    A source file is text. A NUL byte mostly means that the file is binary or in UTF-16; save it as UTF-8.
    """
    UNREADABLE = """RCS107: the file cannot be read

    The operating system refused: the message gives its reason. Look at the name, and at the permissions of the file and of its folders.
    """
    DEFAULT_WITH_CONDITIONS = """RCS108: a DEFAULT line with conditions

    The DEFAULT line runs where no other line matches; it has no conditions of its own. All its other condition cells are blank.
    Make it an ordinary line, or empty its cells.

        input ready : bool
        input warm : bool
        output go : bool
        table start {
          | line | ready   | warm || go    |
          | yes  | true    |      || true  |
          | no   | DEFAULT | true || false |
        }

    error: a DEFAULT line has no conditions

        input ready : bool
        input warm : bool
        output go : bool
        table start {
          | line | ready   | warm || go    |
          | yes  | true    |      || true  |
          | no   | DEFAULT |      || false |
        }
    """
    NON_ASCII_NAME = """RCS109: a name with letters other than ASCII

    Names go unchanged into C and Python, logs and messages, so they are `A` to `Z`, `a` to `z`, `0` to `9` and `_`. That also keeps two
    names that look alike (a Latin and a Cyrillic `a`) apart. Comments and documentation may use any letters.

        input größe : int 0 .. 9

    error: `ö` is not allowed here: names are made of ASCII letters, digits and `_`

        input groesse : int 0 .. 9
    """
    PROJECT_FILE = """RCS110: the project file is not right

    `rcsc.toml` marks the root of a project. It may say `name`, `exclude`, `published`, `prefix` and `starts_at_zero`, and nothing else: the
    manual has a row for each. The message says what is wrong with it; a text stands in quotes, a list of texts in `[]`.
    """
    NO_TABLES = """RCS111: there is nothing to check

    The folder given has no `*.rcs` file in it, or everything in it is excluded by `rcsc.toml`. A check that checks nothing must not
    look like one that passed.
    """
    NOT_FORMATTED = """RCS112: the file is not formatted

    `rcsc fmt --check` found a file that `rcsc fmt` would change. Run `rcsc fmt` on it; `rcsc fmt --diff` shows what it would do.
    """
    DEFAULT_ELSEWHERE = """RCS113: DEFAULT in another column

    `DEFAULT` (or `DEFAULT unreachable`) makes a line the DEFAULT line, and stands in the first column of conditions. In another column
    it could be taken for a condition: move it to the first column. A value that is called `DEFAULT` is written `= DEFAULT`, under
    `when` `(DEFAULT)`.

        input ready : bool
        input warm : bool
        output go : bool
        table start {
          | line | ready   | warm    || go    |
          | yes  | true    |         || true  |
          | no   |         | DEFAULT || false |
        }

    error: DEFAULT stands in the first column of conditions, or nowhere

        input ready : bool
        input warm : bool
        output go : bool
        table start {
          | line | ready   | warm || go    |
          | yes  | true    |      || true  |
          | no   | DEFAULT |      || false |
        }
    """
    UNPRINTED = r"""RCS114: a character that does not print

    The text, perhaps a comment, contains a control character or a mark of writing direction (U+061C, U+200E, U+200F, U+202A to U+202E,
    U+2066 to U+2069). An editor may then show other text than the one that is compiled, and what is said of a variable goes into symbol
    files, logs and terminals. Delete the character; `\u{202e}` in the message shows where it stands. Letters of all scripts may stand
    in comments without such marks.
    """
    LONG_NAME = """RCS115: a name that is too long

    A name has at most 1,000 characters, and so has a part of a record or an array, written out as `robot.plate[1]`: they go into symbol
    files and logs, whose readers bound what they take. Shorten the name, or nest records less deep.
    """
    GOES_ON = """RCS116: a row or a part of a table that does not go on with anything

    A row whose first cell is empty goes on with the row above it: each of its cells with the cell directly above, which has to say
    something. A heading that comes again, with `|---|` below it, begins another part: further columns of the same lines, each named
    again, in the same order. `rcsc fmt` writes both where a table is wider than its limit.

        input ready : bool
        output go : bool
        table start {
          | line | ready || go    |
          | yes  | true  ||       |
          |      |       || true  |
          | no   | false || false |
        }

    error: `true` goes on with an empty cell

        input ready : bool
        output go : bool
        table start {
          | line | ready ||
          |------|-------||
          | yes  | true  ||
          | no   | false ||
          | line || go    |
          |------||-------|
          | yes  || true  |
          | no   || false |
        }
    """
    UNKNOWN_NAME = """RCS201: an unknown name

    Nothing of this name is declared in this file or in the files it uses. Where a declared name is much alike, the message's help names it.
    Where another file of the project declares it, and `use` would find that file, the help is the line to write; what follows from the same
    missing line is not told again. What several levels do together is claimed in a file of the system, not of one level.

        input ready : bool
        output go : bool
        table start {
          | line | raedy || go    |
          | yes  | true  || true  |
          | no   | false || false |
        }

    error: no variable, constant or member is called `raedy`

        input ready : bool
        output go : bool
        table start {
          | line | ready || go    |
          | yes  | true  || true  |
          | no   | false || false |
        }
    """
    DUPLICATE_NAME = """RCS202: a name declared twice

    A name means one thing in a program, all files that it uses included. The other declaration is shown, too. Rename one, or delete it.

        input ready : bool
        output ready : bool

    error: `ready` is declared twice

        input ready : bool
        output ready_out : bool
    """
    CALL_CYCLE = """RCS203: procedures that call each other in a circle

    Procedures do not recurse, directly or by way of others: so each ends, needs a known stack, and can be proved. Use a bounded loop.

        state n : int 0 .. 9
        procedure count { n := 0; again }
        procedure again { count }

    error: procedures call each other in a circle: count -> again -> count

        state n : int 0 .. 9
        procedure count { n := 0; again }
        procedure again { n := 1 }
    """
    FILE_CYCLE = """RCS204: files that use each other in a circle

    A file cannot use a file that uses it, directly or by way of others. Move what both need to a third file.

    It arises from two files at least: `a.rcs` with `use b`, and `b.rcs` with `use a`.
    """
    FILE_NOT_FOUND = """RCS205: a used file is not found

    `use NAME` looks for `NAME.rcs` beside the file, then from the root of the project (the folder with `rcsc.toml`).

        use no_such_file

    error: no file `no_such_file.rcs` is found
    """
    NOT_WRITABLE = """RCS206: something that cannot be written

    A procedure or an action assigns to what is not its to write: an input (the world writes it), a constant, a parameter, a loop
    variable. Use a state or an output variable.

        input width_mm : int 0 .. 110
        procedure reset { width_mm := 0 }

    error: `width_mm` is an input; only the world writes it

        state width_mm : int 0 .. 110
        procedure reset { width_mm := 0 }
    """
    DUPLICATE_LINE = """RCS207: two lines of one name

    The name of a line is what the log, the message and the executor's trace show. It is unique within its table.

        input ready : bool
        output go : bool
        table start {
          | line | ready || go    |
          | 1    | true  || true  |
          | 1    | false || false |
        }

    error: two lines are called `1`

        input ready : bool
        output go : bool
        table start {
          | line | ready || go    |
          | 1    | true  || true  |
          | 2    | false || false |
        }
    """
    UNDECLARED_ACCESS = """RCS208: a module reads or writes more than it declares

    A functionally bounded module says what it reads and what it writes, and does no more. Declare the variable, or leave it alone.

        input a : int 0 .. 9
        output c : int 0 .. 9
        output d : int 0 .. 9
        module update reads a writes c { d := a }

    error: the module writes `d`, which it does not name

        input a : int 0 .. 9
        output c : int 0 .. 9
        output d : int 0 .. 9
        module update reads a writes d { d := a }
    """
    WRONG_ARGUMENTS = """RCS209: wrong arguments

    A call gives one argument for each parameter, in order.

        state n : int 0 .. 9
        procedure set_to(by : int 0 .. 9) { n := by }
        procedure go { set_to(1, 2) }

    error: `set_to` takes 1 argument, not 2

        state n : int 0 .. 9
        procedure set_to(by : int 0 .. 9) { n := by }
        procedure go { set_to(1) }
    """
    NOT_DEFERRED = """RCS210: `next` of a variable that is not deferred

    `next x := e` sets the value that `x` takes when its condition `deferred until ...` holds. Only a variable declared so has one.

        state cur : int 0 .. 9
        procedure go { next cur := 3 }

    error: `cur` has no deferred next value

        input echoed : bool
        state cur : int 0 .. 9 deferred until echoed
        procedure go { next cur := 3 }
    """
    MISSING_TABLE = """RCS211: a value of the command without a table

    A level with `table by` runs one table a command, so each value the selector can have has a table, once.

        enum command { work, rest }
        input order : command
        output go : bool
        table working {
          | line | order   || go   |
          | all  | DEFAULT || true |
        }
        level task {
          period 40 [ms]
          table by order { work : working }
        }

    error: `rest` has no table

        enum command { work, rest }
        input order : command
        output go : bool
        table working {
          | line | order   || go   |
          | all  | DEFAULT || true |
        }
        level task {
          period 40 [ms]
          table by order { work : working  rest : working }
        }
    """
    SEVERAL_DEFAULTS = """RCS212: more than one DEFAULT line

    A table has at most one DEFAULT line: where no other line matches there must be no choice.

        input ready : bool
        output go : bool
        table start {
          | line | ready   || go    |
          | yes  | true    || true  |
          | no   | DEFAULT || false |
          | too  | DEFAULT || true  |
        }

    error: a table has at most one DEFAULT line

        input ready : bool
        output go : bool
        table start {
          | line | ready   || go    |
          | yes  | true    || true  |
          | no   | DEFAULT || false |
        }
    """
    OWNER_CYCLE = """RCS213: executing owners that contain each other

    An executing owner lists modules and other owners, run in order. It cannot contain itself, directly or by way of others.

        owner sense { act }
        owner act { sense }
        output go : bool
        table t {
          | line | when || go   |
          | all  |      || true |
        }
        level task { period 40 [ms] preprocess sense table t }

    error: owners contain each other in a circle: sense -> act -> sense

        state n : int 0 .. 9
        procedure clear { n := 0 }
        owner sense { act }
        owner act { clear }
        output go : bool
        table t {
          | line | when || go   |
          | all  |      || true |
        }
        level task { period 40 [ms] preprocess sense table t }
    """
    UNSTEADY_SELECTOR = """RCS214: the variable that chooses the table may change later in the cycle

    The variable after `table by` chooses the table after the preprocess. A line, the postprocess or a safe value that changed it would
    leave a state that shows another table than the one that ran: logs, runs that `rcsc prove` finds and the shell could not say which
    line it was. So an input chooses, or a state that only the preprocess writes. A state machine over tables gives its state the next
    value with `next`, which is taken at the start of the next cycle.

        enum step { first, second }
        input ready : bool
        state now : step
        table begin {
          | line | ready || now    |
          | go   | true  || second |
          | wait | false ||        |
        }
        table end {
          | line | when || now   |
          | back |      || first |
        }
        level task {
          period 40 [ms]
          table by now { first : begin  second : end }
        }

    error: `now` chooses the table, and line `back` of table `end` may change it after that

        enum step { first, second }
        input ready : bool
        state now : step deferred until true
        procedure move(to : step) { next now := to }
        table begin {
          | line | ready || procedures   |
          | go   | true  || move(second) |
          | wait | false ||              |
        }
        table end {
          | line | when || procedures  |
          | back |      || move(first) |
        }
        level task {
          period 40 [ms]
          table by now { first : begin  second : end }
        }
    """
    TABLE_CYCLE = """RCS215: tables of one cycle that wait for each other

    Several tables of a level run in one cycle, each after those that write what it reads: in its conditions, its actions, what these
    call, and its assumptions. Their order in the text means nothing. Where each waits for another there is no such order. One of them
    then reads what the cycle before left, `was x`; or what only passes between the two is one table.

        input pulse : bool
        state a : bool
        state b : bool
        table one {
          | line | b     || a     |
          | on   | true  || pulse |
          | off  | false || false |
        }
        table two {
          | line | a     || b     |
          | on   | true  || true  |
          | off  | false || pulse |
        }
        level task { table one table two }

    error: the tables of level `task` wait for each other: `one` reads `b`, which `two` writes; `two` reads `a`, which `one` writes

        input pulse : bool
        state a : bool
        state b : bool
        table one {
          | line | was b || a     |
          | on   | true  || pulse |
          | off  | false || false |
        }
        table two {
          | line | a     || b     |
          | on   | true  || true  |
          | off  | false || pulse |
        }
        level task { table one table two }
    """
    TWO_TABLES_WRITE = """RCS216: two tables of one cycle that write one variable

    Of several tables that run in one cycle each variable has one writer: what it holds after the cycle does not hang on which of them
    came last. Let one table write it, or choose between the two by a value, `table by SELECTOR { ... }`: then one of them runs.

        input pulse : bool
        output lamp : bool
        table first {
          | line | pulse || lamp  |
          | on   | true  || true  |
          | off  | false || false |
        }
        table second {
          | line | pulse || lamp  |
          | on   | true  || false |
          | off  | false || true  |
        }
        level task { table first table second }

    error: tables `first` and `second` both write `lamp` in one cycle of level `task`

        input pulse : bool
        output lamp : bool
        output dark : bool
        table first {
          | line | pulse || lamp  |
          | on   | true  || true  |
          | off  | false || false |
        }
        table second {
          | line | pulse || dark  |
          | on   | true  || false |
          | off  | false || true  |
        }
        level task { table first table second }
    """
    LINE_ORDER = """RCS217: lines whose order cannot be

    `above` says which line runs where two match, and is an order: no line stands above itself, directly or through others. Every line
    stands above the DEFAULT line, which needs no word for it; and nothing could run below a line without conditions. `above all` means
    every line but those that stand above this one, or above all, too.

        input stop : bool
        input ended : bool
        output go : bool
        table t {
          | line             | stop  | ended || go    |
          | stops above ends | true  |       || false |
          | ends above stops |       | true  || false |
          | runs             | false | false || true  |
        }

    error: lines stand above each other in a circle: `stops` above `ends` above `stops`

        input stop : bool
        input ended : bool
        output go : bool
        table t {
          | line             | stop  | ended || go    |
          | stops above ends | true  |       || false |
          | ends             |       | true  || false |
          | runs             | false | false || true  |
        }
    """
    REQUIREMENT_NAME = """RCS218: a requirement whose name cannot be

    The name of a requirement stands in quotes after `req`, or under the heading `req` of a table. It has 1 to 80 characters that print;
    `|`, `#` and `\\` are not among them, for a row of a table could not hold them. One place names a requirement once.

        input ready : bool
        output go : bool
        invariant off req "SR-12", "SR-12" : go in {true, false}

    error: requirement `SR-12` is named twice

        input ready : bool
        output go : bool
        invariant off req "SR-12", "SR-13" : go in {true, false}
    """
    READ_AFTER_WRITE = """RCS219: a cell that reads what an earlier cell of its line wrote

    The actions of a line run from left to right, so that the cell means the new value; people mean the one before the line. For that
    one let the column stand further to the left; to mean the new one, write both in one cell, one after the other. What a procedure
    reads that a cell calls is what stands when it runs, and no error.

        enum mode { manual, circle }
        input radio : bool
        state mode : mode
        state saved : mode
        table short {
          | line | radio || mode   | saved |
          |------|-------||--------|-------|
          | lost | false || circle | mode  |
          | back | true  || saved  |       |
        }

    error: `mode` under `saved` reads `mode`, which `circle` under `mode` has written

        enum mode { manual, circle }
        input radio : bool
        state mode : mode
        state saved : mode
        table short {
          | line | radio || saved | mode   |
          |------|-------||-------|--------|
          | lost | false || mode  | circle |
          | back | true  ||       | saved  |
        }
    """
    KIND = """RCS301: the wrong kind of value

    A bool, a number, a member of an enumeration stands where another kind is wanted. Nothing converts by itself: compare (`n > 0`) to
    get a bool, and use `int(...)`, `real(...)` and `single(...)` between whole numbers, doubles and singles.

        input n : int 0 .. 9
        output go : bool
        procedure start { go := n }

    error: `go` is bool, this is `n`, which is int

        input n : int 0 .. 9
        output go : bool
        procedure start { go := n > 0 }
    """
    UNIT = """RCS302: units that do not fit

    Millimetres are not added to seconds, nor compared with metres: units never convert by themselves. A literal without a unit takes
    the unit it meets.

        input width : int 0 .. 110 [mm]
        input held : int 0 .. 60 [s]
        output go : bool
        procedure start { go := width > held }

    error: the units differ: mm and s

        input width : int 0 .. 110 [mm]
        input held : int 0 .. 60 [mm]
        output go : bool
        procedure start { go := width > held }
    """
    EMPTY_RANGE = """RCS303: a range upside down

    The low bound is above the high one, so that no value would fit.

        input n : int 9 .. 0

    error: the range 9 .. 0 is empty

        input n : int 0 .. 9
    """
    TOO_WIDE = """RCS304: a range too wide for C

    An integer fits in 64 bits, signed (from -2^63) or unsigned (to 2^64 - 1).

        input n : int 0 .. 18446744073709551616

    error: no 64-bit integer holds this number

        input n : int 0 .. 18446744073709551615
    """
    NOT_CONSTANT = """RCS305: not a constant

    Bounds, lengths, initial values and the values of `in {...}` arms are constant: literals, constants, and arithmetic on them.

        input limit : int 0 .. 9
        input n : int 0 .. limit

    error: this must be a constant

        const limit = 9
        input n : int 0 .. limit
    """
    OUT_OF_RANGE_CONSTANT = """RCS306: a constant outside the range

    A value outside its type's declared range can never be had there: an initial value that does not fit, a comparison that is always or
    never true.

        state n : int 0 .. 9 = 10

    error: 10 is not in 0 .. 9

        state n : int 0 .. 9 = 9
    """
    SAME_DOUBLE = """RCS307: two constants that are the same double, or the same single

    Two different decimal texts denote one IEEE double, or meet variables that are `single` and denote one single. They look like two
    cases and are one; nothing is merged silently.

        input x : real 0.0 .. 1.0
        output y : int 0 .. 2
        table t {
          | line | x                             || y |
          | low  | < 0.1                         || 0 |
          | high | >= 0.10000000000000000555     || 1 |
        }

    error: `0.10000000000000000555` and `0.1` are different numbers but the same double, 0.1

        input x : real 0.0 .. 1.0
        output y : int 0 .. 2
        table t {
          | line | x      || y |
          | low  | < 0.1  || 0 |
          | high | >= 0.1 || 1 |
        }
    """
    BAD_LENGTH = """RCS308: the length of an array

    An array has 1 to 4096 elements.

        state counts : array[0] of int 0 .. 9

    error: an array has 1 to 4096 elements

        state counts : array[4] of int 0 .. 9
    """
    NOT_FINITE = """RCS309: not a finite double or single

    The literal is too large for an IEEE double, or for the single that it meets, or constant arithmetic gives infinity or no number.
    Ranges of `real` and `single` are finite.

        input x : real 0.0 .. 1e999

    error: `1e999` is larger than every double

        input x : real 0.0 .. 1e99
    """
    DUPLICATE_ARM = """RCS310: a value in two arms of a case

    The arms of a `case` are disjoint, so that their order does not matter.

        input n : int 0 .. 9
        state m : int 0 .. 9
        procedure go {
          case n { 1, 2 { m := 1 } 2 { m := 2 } else { m := 0 } }
        }

    error: an arm above already takes this value

        input n : int 0 .. 9
        state m : int 0 .. 9
        procedure go {
          case n { 1 { m := 1 } 2 { m := 2 } else { m := 0 } }
        }
    """
    MIXED_SIGN = """RCS311: signed and unsigned 64-bit numbers together

    Some values of one operand are negative, some of the other above 2^63 - 1: no C type holds both, and C would convert one silently.
    Narrow one of the ranges.

        input a : int -1 .. 9
        input b : int 0 .. 18446744073709551615
        output go : bool
        procedure start { go := a < b }

    error: no 64-bit integer type holds both sides

        input a : int -1 .. 9
        input b : int 0 .. 9223372036854775807
        output go : bool
        procedure start { go := a < b }
    """
    TOO_MANY_LEAVES = """RCS312: too many variables

    Arrays and records taken apart, a program has at most 10 000 scalar variables.

        state grid : array[200] of array[200] of bool

    error: a type has at most 10000 scalar parts

        state grid : array[20] of array[20] of bool
    """
    LOOP_TOO_LONG = """RCS313: a loop that is too long

    A loop runs at most 4096 times, and all loops of a procedure together at most 1 000 000 statements: a cycle has a few milliseconds.

        state n : int 0 .. 9
        procedure go { for i in 0 .. 4096 { n := 0 } }

    error: a loop has at most 4096 rounds

        state n : int 0 .. 9
        procedure go { for i in 0 .. 4095 { n := 0 } }
    """
    EMPTY_CONDITION = """RCS314: a condition that never holds

    The condition is empty: no value of the column fits it, so that its line can never match.

        input n : int 0 .. 9
        output go : bool
        table t {
          | line | n       || go    |
          | a    | < 0     || true  |
          | b    | DEFAULT || false |
        }

    error: no value satisfies `< 0`

        input n : int 0 .. 9
        output go : bool
        table t {
          | line | n       || go    |
          | a    | < 1     || true  |
          | b    | DEFAULT || false |
        }
    """
    NO_CYCLE_BEFORE = """RCS315: there is no cycle before to speak of

    `was x` is the value that `x` had after the cycle before, and an event, `@T(c)`, is of that cycle and this one. An invariant is about
    one state, and a constant about none: they cannot look back. `was` is about variables, not about locals or constants alone. What has
    to hold for a time, `c for 2 [s]`, is counted where each cycle ends: no local or parameter is known there, and neither the condition
    nor the heading above it has `was`, an event or another `for`. Neither `was` nor events nest, and neither what stands before `then`
    nor either side of `until` or `upon` can have them: these are each about one cycle.

        state n : int 0 .. 9
        invariant grows : n >= was n

    error: `was` is of two cycles, an invariant of one: write it as a property

        state n : int 0 .. 9
        property grows : n >= was n
    """
    NO_PROPERTY = """RCS316: a property about nothing

    No variable stands in the condition, so that it is always true, or never.

        state n : int 0 .. 9
        property fine : 1 < 2

    error: this is about no variable: it is always so, or never

        state n : int 0 .. 9
        property fine : n < 2
    """
    NO_CYCLES = """RCS317: a time that is no number of cycles

    `c for 2 [s]` counts cycles of the level that runs the table, so that a time is a whole number of them, 1 or more: with a period of
    40 ms 2 s are 50 cycles, and 50 ms are none. A table that no level runs has no cycles to count, and levels of several periods in
    one program have different ones. `c for 2 cycles` says it in cycles.

        input pressed : bool
        state held : bool
        table watches {
          | line | pressed            || held  |
          |------|--------------------||-------|
          | long | true for 50 [ms]   || true  |
          | else | DEFAULT            || false |
        }
        level watch { period 40 [ms] table watches }

    error: `50 [ms]` is no whole number of cycles of 40 ms, 1 or more

        input pressed : bool
        state held : bool
        table watches {
          | line | pressed            || held  |
          |------|--------------------||-------|
          | long | true for 80 [ms]   || true  |
          | else | DEFAULT            || false |
        }
        level watch { period 40 [ms] table watches }
    """
    NO_START = """RCS318: a number without a declared start value

    A number starts at 0, an output with a safe value at that. Where 0 is not in its range it starts with the value nearest to 0, which
    nobody may have meant. A warning: declare a start value, after the type of the variable, or of the field of its record or link.

        record gains { p : real 0.1 .. 9.0 }
        state speed : int 1 .. 9 = 3
        state gain : gains

    warning: `gain.p` has no declared start value: 0 is not in 0.1 .. 9.0, so it starts with 0.1

        record gains { p : real 0.1 .. 9.0 = 1.0 }
        state speed : int 1 .. 9 = 3
        state gain : gains
    """
    UNREAD = """RCS319: nobody reads a variable

    Nothing asks for any part of this state or input: no line, selector, procedure, assumption, invariant or property. Assignments of a
    state to itself do not count. A warning: it may be left over, or the line that was to ask for it is missing. What somebody is to see
    is an output. Judged are variables of the file that was checked, if no other file of the project uses it; those that the
    system's description names are read.

        input pressed : bool
        input held : bool
        output lamp : bool
        table light {
          | line | pressed || lamp  |
          | on   | true    || true  |
          | off  | false   || false |
        }

    warning: nothing reads input `held`

        input pressed : bool
        output lamp : bool
        table light {
          | line | pressed || lamp  |
          | on   | true    || true  |
          | off  | false   || false |
        }
    """
    UNUSED_CONSTANT = """RCS320: nobody uses a constant

    The number stands nowhere else, so that to change it changes nothing: where it is meant another number may be written. A warning.

        const most = 40
        input width : int 0 .. 110
        output held : bool
        table grip {
          | line | width || held  |
          | held | <= 40 || true  |
          | wide | > 40  || false |
        }

    warning: nothing uses constant `most`

        const most = 40
        input width : int 0 .. 110
        output held : bool
        table grip {
          | line | width   || held  |
          | held | <= most || true  |
          | wide | > most  || false |
        }
    """
    UNUSED_MEMBER = """RCS321: nothing gives or asks for a member

    No variable ever has this member: it is neither assigned nor asked for, it is not the first, with which variables start, and no
    variable of its type comes from outside: no input, link or extern procedure has it. Members of outputs are not judged: the
    level that takes them has the same. A warning.

        enum step { rest, work, broken }
        input go : bool
        state now : step
        table steps {
          | line  | go    | now     || now  |
          | start | true  |         || work |
          | stay  | false | /= work || rest |
          | end   | false | work    || rest |
        }

    warning: nothing gives or asks for member `broken` of `step`

        enum step { rest, work }
        input go : bool
        state now : step
        table steps {
          | line  | go    | now  || now  |
          | start | true  |      || work |
          | stay  | false | rest || rest |
          | end   | false | work || rest |
        }
    """
    STAYS_AFTER_FAULT = """RCS322: an output that stays as it was after a fault

    A cycle that refuses a reading from outside runs no line: time-outs do not count, an order to pause is not taken, and an output
    without a safe value goes on showing what the cycle before it wrote, for as long as the reading is refused. A warning about outputs that
    a system's description leads to somebody outside its levels, such as a drive. The value after `safe` is shown instead. A field of
    a record has its own; where one has one, the others stay on purpose.

        input force_n : real 0.0 .. 500.0 [N]
        output drive : bool
        table close {
          | line | force_n         || drive |
          | on   | < 40.0 [N]      || true  |
          | off  | >= 40.0 [N]     || false |
        }
        level gripper { period 40 [ms] table close }

    warning: output `drive` stays as it was while a reading of `force_n` is refused

        input force_n : real 0.0 .. 500.0 [N]
        output drive : bool safe false
        table close {
          | line | force_n         || drive |
          | on   | < 40.0 [N]      || true  |
          | off  | >= 40.0 [N]     || false |
        }
        level gripper { period 40 [ms] table close }
    """
    NO_BOUND = """RCS323: a requirement about a last cycle that never comes

    `at last` looks at the last cycle of an interval. Without a scope, in `after` and in `only before` an interval goes on to the end of
    the run, and a run need not end: no cycle is the last one, and nothing would break the requirement. Say where the interval ends.

        input mode : bool
        output given : bool
        requirement given_at_last : after mode, at last given

    error: `at last` in `after` asks for nothing: its interval goes on to the end of the run, and a run need not end

        input mode : bool
        output given : bool
        requirement given_at_last : while mode, at last given
    """
    NOT_OF_OUTSIDE = """RCS324: an assumption over time that is not about what comes from outside

    `rcsc prove` trusts an assumption over time, and so it may only restrict what no level writes: inputs from outside. What it reads of the
    level's own variables is what the cycle before left. So its response is about an input, it comes too late in some cycle, and it is
    `assumed`, or `assumed monitored`, which runs watch, too. It is of the whole level, and no table names it under `assuming`. Orders,
    reports, answers of the database and what other levels write follow the protocol or are proved of their writers: it reads none of these.

        input rolls : bool
        output speed : int 0 .. 100
        assume stops : when speed = 0, within 10 cycles, speed = 0

    error: `speed = 0` is about no input: nothing from outside can keep it

        input rolls : bool
        output speed : int 0 .. 100
        assume stops : when speed = 0, within 10 cycles, not rolls
    """
    NOT_ACROSS = """RCS325: a declaration that a file of requirements across levels cannot have

    The file that a system names as `requirements` speaks of the variables of all levels, `LEVEL.VARIABLE`, and of what comes from
    outside, `PARTY.VARIABLE`. It states properties, requirements and assumptions over time, and may name constants, sets and types for
    them; variables, tables, modules and levels are declared in the tables of a level.
    """
    GAP = """RCS401: an input that no line matches

    Exactly one line matches in every cycle; here is an input that none matches: on the robot this is a STATE-TABLE error. The least
    such input is shown, and the largest region found around it. Widen a line, add one (the help proposes one, proved to close this
    gap), or give the table a DEFAULT line.

        input width_mm : int 0 .. 110
        output held : bool
        table grip {
          | line  | width_mm || held  |
          | small | < 20     || false |
          | held  | 20 .. 40 || true  |
        }

    error: no line of table `grip` matches 70 of 111 (63.1 %) of the inputs

        input width_mm : int 0 .. 110
        output held : bool
        table grip {
          | line  | width_mm || held  |
          | small | < 20     || false |
          | held  | 20 .. 40 || true  |
          | wide  | > 40     || false |
        }
    """
    OVERLAP = """RCS402: an input that two lines match

    Exactly one line matches in every cycle; here is an input that two match, shown beside the cells of both. A note says what the two
    lines leave different where both match, or that both do the same: that is decided, whatever their text. The help proposes the
    smallest change of a cell that parts them. If the input cannot occur, say why in an assumption. If a source says which of the two
    goes before, write that after its name: `open above held`; if both do the same, `held same open`, which is proved.

        input width_mm : int 0 .. 110
        output held : bool
        table grip {
          | line | width_mm || held  |
          | open | > 40     || false |
          | held | <= 41    || true  |
        }

    error: lines `open` and `held` of table `grip` both match some input

        input width_mm : int 0 .. 110
        output held : bool
        table grip {
          | line | width_mm || held  |
          | open | > 40     || false |
          | held | <= 40    || true  |
        }
    """
    DEAD_LINE = """RCS403: a line that never matches

    Under the declared ranges and the invariants no input matches this line. It is not wrong by itself, but it is not what its author
    meant. Where only an assumption excludes the line this is a warning: the line is what runs when the assumption fails.

        input a : int 0 .. 9
        output go : bool
        table t {
          | line | a    | when  || go    |
          | one  | <= 4 |       || true  |
          | two  | > 4  |       || false |
          | dead | > 4  | a < 3 || true  |
        }

    error: line `dead` of table `t` can never match

        input a : int 0 .. 9
        output go : bool
        table t {
          | line | a    || go    |
          | one  | <= 4 || true  |
          | two  | > 4  || false |
        }
    """
    DEFAULT_REACHED = """RCS404: a DEFAULT line declared unreachable is reached

    `DEFAULT unreachable` claims that the other lines cover every input; here is one that they do not.

        input n : int 0 .. 9
        output go : bool
        table t {
          | line | n                   || go    |
          | low  | < 5                 || true  |
          | high | > 5                 || true  |
          | none | DEFAULT unreachable || false |
        }

    error: the DEFAULT line of table `t` is declared unreachable, but 1 of 10 (10 %) of the inputs fall to it

        input n : int 0 .. 9
        output go : bool
        table t {
          | line | n                   || go    |
          | low  | < 5                 || true  |
          | high | >= 5                || true  |
          | none | DEFAULT unreachable || false |
        }
    """
    CONTRADICTORY_ASSUMPTIONS = """RCS405: assumptions that contradict each other

    No values satisfy all the assumptions of the table and the invariants. Everything would be proved of it, and nothing would be worth
    anything. The same is told of two tables that a level runs in one cycle, where what they assume of its inputs cannot hold together.

        input n : int 0 .. 9
        output go : bool
        assume low : n < 3
        assume high : n > 6
        table t assuming low, high {
          | line | n   || go    |
          | low  | < 5 || true  |
          | high | > 5 || false |
        }

    error: the assumptions of table `t` contradict each other, an invariant or the declared ranges

        input n : int 0 .. 9
        output go : bool
        assume off_five : n /= 5
        table t assuming off_five {
          | line | n   || go    |
          | low  | < 5 || true  |
          | high | > 5 || false |
        }
    """
    ASSUMPTION_NOT_PROVED = """RCS406: an assumption declared proved that nothing proves

    `proved` says that declared ranges and invariants ensure the assumption, and they do not. Write `assumed` or, better, `monitored`:
    then the executors check it in every cycle; and where `rcsc prove` shows that the levels put together ensure it, `rcsc check` says
    that it is proved.

        input n : int 0 .. 9
        output go : bool
        assume off_five proved : n /= 5
        table t assuming off_five {
          | line | n   || go    |
          | low  | < 5 || true  |
          | high | > 5 || false |
        }

    error: assumption `off_five` does not follow from the declared ranges and the invariants

        input n : int 0 .. 9
        output go : bool
        assume off_five monitored : n /= 5
        table t assuming off_five {
          | line | n   || go    |
          | low  | < 5 || true  |
          | high | > 5 || false |
        }
    """
    DEFAULT_COVERS = """RCS407: inputs that fall to the DEFAULT line

    A note, not an error: DEFAULT hides gaps, so rcsc says which inputs fall to it and, where that can be counted, what share of
    all they are. Declare the line `DEFAULT unreachable` where nothing should.

        input n : int 0 .. 9
        output go : bool
        table t {
          | line | n       || go    |
          | low  | < 5     || true  |
          | rest | DEFAULT || false |
        }

    note: 5 of 10 (50 %) of the inputs fall to the DEFAULT line of table `t`
    """
    DEFAULT_DEAD = """RCS408: a DEFAULT line that nothing falls to

    The other lines already cover every input. Declare it `DEFAULT unreachable`, which is then proved, or leave it out.

        input n : int 0 .. 9
        output go : bool
        table t {
          | line | n       || go    |
          | low  | < 5     || true  |
          | high | >= 5    || false |
          | rest | DEFAULT || false |
        }

    warning: the DEFAULT line of table `t` is never reached

        input n : int 0 .. 9
        output go : bool
        table t {
          | line | n                   || go    |
          | low  | < 5                 || true  |
          | high | >= 5                || false |
          | rest | DEFAULT unreachable || false |
        }
    """
    UNDECIDED = """RCS409: could not be decided

    The solver gave up: it said *unknown*, or its budget of steps or its memory ran out, for one question or for all about a table or a
    procedure together. That is never counted as proved. Give it more (`--steps MILLIONS`), or make the condition simpler: products of
    variables and doubles are hard.

    It arises from hard arithmetic. Steps are the same on every machine, so that a verdict does not depend on how busy it is.
    """
    OVERFLOW = """RCS410: arithmetic that overflows

    A value in the middle of an expression can leave 64 bits. The executor's integers would wrap; the proof's do not; so it is an error.
    Narrow the ranges, or test before.

        input a : int 0 .. 9223372036854775807
        state s : int 0 .. 9223372036854775807
        procedure double { s := a * 4 / 8 }

    error: the product can leave 64 bits

        input a : int 0 .. 1000000
        state s : int 0 .. 9223372036854775807
        procedure double { s := a * 4 / 8 }
    """
    DIVISION_BY_ZERO = """RCS411: division by zero

    The divisor of `/` or `mod` can be zero. Test it before: `n /= 0 and x / n > 2` is safe.

        input n : int 0 .. 9
        state s : int 0 .. 100
        procedure share { s := 100 / n }

    error: the divisor can be zero

        input n : int 0 .. 9
        state s : int 0 .. 100
        procedure share { if n > 0 { s := 100 / n } }
    """
    INDEX = """RCS412: an index outside the array

    An array of length n has the elements 0 to n - 1.

        input n : int 0 .. 9
        state counts : array[4] of int 0 .. 9
        procedure clear { counts[n] := 0 }

    error: the index can lie outside 0 .. 3

        input n : int 0 .. 9
        state counts : array[4] of int 0 .. 9
        procedure clear { if n < 4 { counts[n] := 0 } }
    """
    ASSIGNED_RANGE = """RCS413: a value assigned outside the range

    The value can leave the declared range of what it is assigned to. Test before, use `min` and `max`, or widen the range.

        state n : int 0 .. 9
        procedure bump { n := n + 1 }

    error: the value can lie outside 0 .. 9, the range of `n`

        state n : int 0 .. 9
        procedure bump { n := min(n + 1, 9) }
    """
    USE_BEFORE_ASSIGNMENT = """RCS414: a local read before it is assigned

    A local declared without a value has none until it is assigned, on every way that leads to the reading.

        input a : bool
        state n : int 0 .. 9
        procedure go { local k : int 0 .. 9 if a { k := 1 } n := k }

    error: `k` can be read before it is assigned

        input a : bool
        state n : int 0 .. 9
        procedure go { local k : int 0 .. 9 := 0 if a { k := 1 } n := k }
    """
    TWO_WRITERS = """RCS415: one variable written twice in a line

    Two actions of one line, or what they call, write the same output or state: which of them counts would hang on their order, and
    what the first decided would be gone. A procedure that does both says which goes first.

        input ready : bool
        output go : bool
        procedure stop { go := false }
        table start {
          | line | ready || procedures | go    |
          | yes  | true  || stop       | true  |
          | no   | false ||            | false |
        }

    error: `stop` and `true` can write different values to `go`

        input ready : bool
        output go : bool
        procedure stop { go := false }
        table start {
          | line | ready || procedures | go   |
          | yes  | true  ||            | true |
          | no   | false || stop       |      |
        }
    """
    INVARIANT_INITIAL = """RCS416: an invariant false at first

    An invariant holds of the initial values, before the first cycle, and of those after a restart: a level may begin anew at any moment.

        state n : int 0 .. 9
        invariant some : n > 0

    error: the initial values do not satisfy invariant `some`

        state n : int 0 .. 9 = 1
        invariant some : n > 0
    """
    INVARIANT_BROKEN = """RCS417: an invariant that a line breaks

    Every line, and every preprocess and postprocess procedure of a level, keeps each invariant: where it holds before, it holds after. The
    state shown is one from which this line breaks it. Mend the line, or strengthen the invariant if that state cannot occur.

        input up : bool
        state n : int 0 .. 9 = 1
        invariant some : n > 0
        table t {
          | line | up    || n |
          | one  | true  || 1 |
          | two  | false || 0 |
        }

    error: line `two` of table `t` can break invariant `some`

        input up : bool
        state n : int 0 .. 9 = 1
        invariant some : n > 0
        table t {
          | line | up    || n |
          | one  | true  || 1 |
          | two  | false || 2 |
        }
    """
    CERTIFICATE = """RCS418: a certificate that does not show what it claims

    `rcsc certify` re-checks a program's certificate with a small checker that shares no code with the prover; it was refused. If the
    certificate came from a file, it belongs to another text or was changed; make it anew. If rcsc has just made it, that is a bug in
    rcsc: please report it.
    """
    ASSUMPTION_INITIAL = """RCS419: an assumption false at first

    A warning: with the initial values, an assumption about states and outputs is false already. Unless a preprocess procedure mends
    that, the first cycle does not run under it.

        state n : int 0 .. 9
        output go : bool
        assume some : n > 0
        table t assuming some {
          | line | n   || go    |
          | low  | < 5 || true  |
          | high | >= 5 || false |
        }

    warning: assumption `some` does not hold of the initial values

        state n : int 0 .. 9 = 1
        output go : bool
        assume some : n > 0
        table t assuming some {
          | line | n    || go    |
          | low  | < 5  || true  |
          | high | >= 5 || false |
        }
    """
    PROPERTY_ELSEWHERE = """RCS420: properties are proved elsewhere

    A note, not an error. A property is about what a level does cycle after cycle in its environment, which a table proved alone does
    not show: `rcsc check` and `rcsc compile` make sure that it can be read, no more. `rcsc prove` proves it, or shows the shortest run
    that breaks it; as long as nothing changes after that, the note of `rcsc check` says that it is proved. Properties that come with
    `serves` are proved in the same way, and no note repeats it.

        state n : int 0 .. 9
        property some : n < 9

    note: property `some` is not proved here

        state n : int 0 .. 8
    """
    NOT_CHECKED = """RCS421: an obligation that `rcsc certify` did not check

    The checker of certificates settles what a program owes by spans, and by trying every case where there are few. Of what is left,
    such as differences of variables with large ranges or arithmetic on doubles, there is only the prover's word, which is Z3's.
    `--certify` puts it to cvc5, which has no part in the proof; `--questions DIR` writes it as SMT-LIB for any other solver. It is a
    note where the program was proved in the same run, and an error with `--strict` and for a certificate from a file (`--against`).
    """
    NOT_THE_SAME = """RCS422: lines that are said to do the same, and do not

    Two lines of which one says that it does the `same` as the other may match together: the first of the table runs, and what they do is
    proved equal for every such input. Here is one for which it is not, with what each of them leaves. Correct one of the
    lines, part them, or say which one goes before (`above`).

        input low : bool
        input reset : bool
        output speed : int 0 .. 9
        table t {
          | line             | low   | reset || speed |
          | slow             | true  |       || 2     |
          | resets same slow |       | true  || 0     |
          | runs             | false | false || 9     |
        }

    error: lines `slow` and `resets` of table `t` are said to do the same, and do not

        input low : bool
        input reset : bool
        output speed : int 0 .. 9
        table t {
          | line             | low   | reset || speed |
          | slow             | true  |       || 0     |
          | resets same slow |       | true  || 0     |
          | runs             | false | false || 9     |
        }
    """
    NEVER_MEET = """RCS423: `above` or `same` between lines that never match together

    `above` says which line runs, and `same` that it does not matter which, where two lines match together. These never do, under the
    declared ranges, the invariants and what the table assumes: what their author meant is not what their conditions say. Where they do
    so if an assumption fails, the word counts there, and the message says it.

        input stop : bool
        output go : bool
        table t {
          | line             | stop  || go    |
          | stops above runs | true  || false |
          | runs             | false || true  |
        }

    warning: lines `stops` and `runs` of table `t` are ordered, and never match together

        input stop : bool
        output go : bool
        table t {
          | line  | stop  || go    |
          | stops | true  || false |
          | runs  | false || true  |
        }
    """
    GIVES_WAY = """RCS424: lines that give way to others

    A line below others (`above`) runs where it matches and none of them does, one that does the `same` as others where no earlier one of
    them runs. The proof and the executors see that as one condition more of the line; the note shows it, and `rcsc fmt --expanded`
    prints the table with it. It says no more than it has to: what the line's own cells exclude is left out.

        input stop : bool
        input ended : bool
        output go : bool
        table t {
          | line             | stop  | ended || go    |
          | stops above ends | true  |       || false |
          | ends             |       | true  || false |
          | runs             | false | false || true  |
        }

    note: 1 line of table `t` gives way to others

        input stop : bool
        input ended : bool
        output go : bool
        table t {
          | line  | stop  | ended || go    |
          | stops | true  |       || false |
          | ends  | false | true  || false |
          | runs  | false | false || true  |
        }
    """
    STALE = """RCS501: the generated files are not fresh

    `rcsc compile --check`, `rcsc test` or `rcsc evidence` found that `generated/` is not what the tables now give: a file differs or is
    missing. What is proved speaks of the files that the tables give, and not of it. Run `rcsc compile` and commit the result. Generated
    files are never edited by hand. `rcsc test --anew` tests what the tables give, whatever lies there.
    """
    NOT_WRITTEN = """RCS502: a file could not be written

    The operating system refused: the message gives its reason (no permission, no space). Nothing is left half written: the files are as
    they were before.
    """
    NAME_COLLISION = """RCS503: two things of one name in the generated code

    What is compiled together can be linked together and stands in one folder. So two programs may not give one name in C to two things
    (table `b_c` of `a.rcs` and table `c` of `a_b.rcs` both make `a_b_c_step`), nor be compiled to one file (`a-b.rcs` and `a_b.rcs`),
    and functions of yours that have one name in C take the same types. Rename one of them.

    A file that stands in the folder already is overwritten only if a program of the same name was compiled to it: not what another
    program left there, and nothing that was not made by rcsc. Choose another folder with `--out`, or delete what nothing needs.
    """
    EXTERN_NAME = """RCS504: an extern procedure's name does not fit

    The name given for Python is `package.module:function`; the name for C is a C identifier, and no word of the language or of
    its library.

        input a : int 0 .. 9
        output c : int 0 .. 9
        extern procedure lookup reads a writes c python "pkg.mod:function" c "while"

    error: `while` does not name a C function

        input a : int 0 .. 9
        output c : int 0 .. 9
        extern procedure lookup reads a writes c python "pkg.mod:function" c "lookup_in_table"
    """
    EXECUTORS_DISAGREE = """RCS601: the executors disagree

    On the same input the interpreter, the Python executor and the C executor gave different lines, states or faults, or one of them
    ended its process. Where a generated file was edited, which is told as RCS501, that is why; else it is a bug in rcsc.

    It arises in `rcsc test`, which shows the simplest input that it finds.
    """
    LINE_NOT_REACHED = """RCS602: a line was never reached

    `rcsc test` knows an input that makes this line match, and yet no step of the executors took it: the test is not complete.
    """
    NO_C_COMPILER = """RCS603: the C compiler is missing or refuses

    `rcsc test` builds and runs the generated C. Install a C compiler (`cc` or the one `CC` names); where it refuses the code, its words
    are shown, and that is a bug in rcsc or in the C of an extern procedure. `rcsc compile` has it look at the C, where there is one, and
    writes nothing that it refuses.
    """
    MATCHER_DIFFERS = """RCS604: the C matcher is not shown equal to the table

    The check of the emitted masks against the table, for every value of every variable, found a difference, or a model checker refuted
    that a C function does what the tables say. What a tool could not decide is a figure of `rcsc test`, and no finding. Where no
    generated file was edited, which is told as RCS501, this is a bug in rcsc: please report it.
    """
    EVIDENCE_LACKS = """RCS605: evidence is not whole

    `rcsc evidence` makes what a safety case asks of the generated C. Each note names what a kind of evidence does not show, with its
    place and its reason; the files that were made say the same. Where a tool is not installed, the kind shows nothing: install it, or
    leave the kind out with `--only`, and the index does not list it.
    """
    NOT_TRACED = """RCS606: generated code that comes from nothing in the tables

    `rcsc trace` reads the generated files back: each function, case, constant and member has the name of a line, a procedure or a
    declaration, or a comment that says what it serves. A line of code that has neither is named here. In code that rcsc wrote this is a
    bug in rcsc: please report it.
    """
    REQUIREMENT_OPEN = """RCS607: requirements and tables do not fit

    `rcsc trace --requirements FILE` holds the names that the tables give after `req` against the list. A listed requirement that nothing
    names, and a name that is not in the list, are errors; lines that name none, and whose table names none, and parts of the code that
    carry none, are a warning. Name the requirement where it is answered, or mend the list. Without a list, too, a requirement of a
    property that `rcsc prove` refuted is an error.
    """
    MATRIX_OLD = """RCS608: a matrix of another version

    `rcsc trace --against FILE` holds a kept matrix against these tables and the code that is made of them now. It is of another
    version where anything that it says differs: the meaning of a program, a byte of a generated file, a requirement, a verdict, a
    vector. The notes name the first places. Make it anew, and review what changed with `rcsc diff`.
    """
    DOSSIER_OLD = """RCS609: a dossier of other files

    `rcsc evidence --check FOLDER` holds the digests of a dossier against the files of this checkout: the tables, the generated C, and the
    dossier's own vectors and reports. A file that differs, is missing, or is new is named. Make the dossier anew, or fetch the version
    that it is of; its `index.json` says when and by whom it was made.
    """
    LOG_UNREADABLE = """RCS701: a log cannot be read

    The file is not there, is no MCAP file, or holds no run that rcsc recorded: a name in it is none, or it unpacks to more than a log
    of its size can hold. A log that was cut off is no such thing: it is read as far as it goes, and what is lost is at most the last
    second.
    """
    REPLAY_DIFFERS = """RCS702: a replay differs from the run

    Each cycle was run again from the recorded state with the recorded inputs, by executors of the very tables that the run had, and
    left something else than it left then. The same executor always does the same, and so do those in C and in Python: it is a bug in
    rcsc, in the compiler that built the C, or in an extern procedure that keeps something to itself. `--executor python` shows whether
    it is the C.
    """
    TABLES_DECIDE_OTHERWISE = """RCS703: other tables decide otherwise

    `rcsc replay --generated FOLDER` ran the run again with other tables than it was recorded with. The cycle that is shown is the first
    in which they leave something else; up to there the run would have been the same. The notes show the line that matched then and the
    one that matches now.
    """
    NOT_REPLAYED = """RCS704: a log cannot be replayed

    The generated programs do not fit the log, are not there, or the C could not be built. Run `rcsc compile` first, name the folder
    with `--generated`, or take `--executor python`.
    """
    EXTRA_MISSING = """RCS705: a package is missing

    `pip install rcsc` brings what checking, compiling, proving and the hooks need. The rest comes with extras, which the help names:
    `log` for logs and so for `rcsc run` and `rcsc campaign`, `cell` for the paper's cell and models for MuJoCo, `plot` for pictures of
    logs, `parquet` for Parquet files, `live` for the page that follows a run, `certify` for cvc5, `graph` for drawings of tables,
    `cluster` for a campaign on a cluster. In a checkout: `pip install -e '.[cell]'`.
    """
    NO_CYCLE = """RCS706: a log holds no cycle

    `rcsc log FILE --report PAGE` draws a recorded run, and of a finding, which `rcsc prove --log DIR` keeps, each cycle whole. The log has
    what the levels started from, and nothing more: the run was cut off before its first cycle was kept.
    """
    LOG_NOT_WHOLE = """RCS707: a log is not whole

    Every byte of a log is in a chain of digests, which a seal ends. The log ends before its seal (a kill or a full disk cut it off),
    has no chain (an older version of rcsc or another program wrote it), or is from some byte on not what was recorded. It was read and
    replayed as far as the chain holds, and nothing is said about the rest. The chain has no key: it shows that a log was damaged, and
    not that nobody made another.
    """
    NO_FILM = """RCS708: no film can be made

    `rcsc run --video` films what stands outside the levels in space: a plant in Python has a method `space` for it, a model for MuJoCo has
    it by itself. MuJoCo draws the pictures without a screen, by the OpenGL of the machine: on Debian and Ubuntu `libegl1` and
    `libgl1-mesa-dri` bring one that needs no graphics card.
    """
    BAD_SYSTEM = """RCS721: the system cannot be put together

    The description (`system.toml`) cannot be read, has a key that means nothing or lacks one, names a buffer, a party, a level or a
    feed that is not there, has a `tick_ms` that does not divide the period of every level, or the generated executors are not there or
    do not build. Every fault is named with its line. Nothing has moved. Run `rcsc compile`, or mend what the message names. A party
    that is no level is taken for something outside; with `outside = ["robot", ...]` in the description any other name is a fault.
    """
    BAD_DATA = """RCS722: the data is not in order

    The cell's data names something that does not exist, has a value that is no number or not within what it may be, puts a point where
    the robot does not reach, says more than the level that asks can hold (`primitive.goal.speed_mm_s` would be 9000, and holds 1 ..
    2000), or the database made of it is missing or broken. Nothing has moved. `rcsc db check` names every problem with its line.
    """
    BAD_SCRIPT = """RCS723: the script cannot be run

    A script has a row an order, in CSV or TOML: `command` and other fields of the order, ends of buffers from outside (`base.bumper`),
    and `level`, `cycles`, `within`, `expect`; the paper's cell reads rows of its own. A column or a value is none of these, the file
    cannot be read, or the script has no such row as `--from-row` names. Every row that is wrong is told, and nothing has moved. Mend
    the script and run it; one that was stopped and is changed since is begun anew with `--from-row`, for `--resume` goes on with the
    same script only.
    """
    SCRIPT_STOPPED = """RCS724: the script was stopped

    A row failed, with what the level reported, or did not end within the cycles that it may take. The level was told to rest, and all is
    kept as it stands: mend the cause, and the same command with `--resume` tries the row again. `--from-row N` besides goes on at
    another row, as if those between were done; without `--resume` it begins anew. A plant that holds what no file does, a generator of
    random numbers for instance, is kept if its class has `state` and `restore`. In the paper's cell an interlock may refuse a row before
    it begins, for it would machine a loose part, put a second part into the fixture, or let go of a part; and what has been done of
    a row is not done again.

    Ctrl-C or SIGTERM interrupt a run (status 130), in a plant, a database or an extern procedure that does not come back, too: `rcsc run`
    waits for these as long as they take, as how long is right differs by machine. The log holds all whole cycles. What holds on even
    then is ended, and `rcsc` with it, by a second one.
    """
    STATE_TABLE_ERROR = """RCS725: STATE-TABLE error

    No line of a table matched, or several did, or an input lay outside its declared range and was refused, or an assumption failed on
    which the safety of the table's lines rests, or a state from outside (after a restart, or set by hand) is none that the tables are
    proved for. The proofs exclude the first two for what they assume: look at the assumptions that failed, and at the executors'
    source.
    """
    NOT_RESUMED = """RCS726: there is nothing to go on from

    `rcsc run SYSTEM --resume` goes on where a script was stopped. No run of this system was stopped, or what was kept of it is damaged
    or of another version of rcsc, or the script is another one than was stopped, or has changed since. Nothing has moved. `--from-row
    N` without `--resume` begins anew at a row, as if those before it were done.
    """
    EXECUTORS_NOT_PROVED = """RCS727: executors of tables that are not proved

    `rcsc prove --log` runs a finding on executors that it makes by force where the tables do not prove, or where it looks at them under
    another rule. They say so in every file, and no cell runs them: nothing has moved. Mend the tables and run `rcsc compile`.
    """
    PROCESS_LOST = """RCS728: a process of the running system is lost

    `rcsc run --processes` runs each level in a process of its own. A level that is killed, or that has begun and commits nothing for 25
    of its periods because it was stopped by a signal, loops or waits, is started again and goes on from its last cycle. Too many of
    them were, or the process of workstation and plant was, which cannot be taken up again; or one ended by an exception,
    which stands on the standard error stream. The message names the process. Everything was ended, and nothing is left of it.

    Likewise where `--attach` finds no such system, one that has ended, one to which somebody else is attached, or one that runs other
    tables than those that are compiled; nothing was changed.
    """
    BAD_PLANT = """RCS729: the plant does not fit

    What stands outside the levels, a class in Python or a model for MuJoCo, cannot be loaded, or is not what the buffers of
    `system.toml` say: a field is missing, or has another type, range, unit or member than the variable at the other end. Every fault is
    named at the buffer's line, and nothing has moved. Likewise where a plant raises while it runs, or gives what no buffer holds: a
    number that is none, or outside what the variable holds and not declared `clamp`; the cycle is named.

        class Base:
            speed: int = 0                                      # "drive.speed_mm_s" = "base.speed"
            travelled: Annotated[float, Range(0, 20, "m")] = 0  # "base.travelled" = "drive.travelled_mm"

            def step(self, seconds: float) -> None:
                self.travelled += self.speed / 1000 * seconds
    """
    LINKS_DIFFER = """RCS730: two levels declare the link between them differently

    A superior and its subordinate each declare the link between them, in files of their own, and the two declarations differ: in a
    command, a status, which status says *done*, *failed* or *executing*, a field of the order or the report, its type, its range, its
    unit, or what it has after a restart. What the one says would mean something else to the other. Both declarations are shown where they
    differ first. Declare the link, and the types that it names, once, in a file that both levels `use`.
    """
    SHELL_NAME = """RCS731: the shell knows no such name

    `rcsc shell` was given a name that is no variable, level, line, module, procedure, owner or table of the level that is meant. Names
    without a level are those of the level chosen (`level task`); `task.cur_state` names one of another. Case does not matter, and
    hyphens are underscores: `STATE-TABLE` is `state_table`.
    """
    SHELL_VALUE = """RCS732: a value that is none of the variable's

    A variable takes members of its enumeration, `false` or `true`, or numbers within its declared range: the proofs assume that it
    holds nothing else. Nothing was set.
    """
    SHELL_RELOAD = """RCS733: a level keeps its tables

    `reload` compiles a level's tables as they are now, and takes them only if they are proved and the present state lies in what was
    proved: each variable, by name, is of the same kind and within its new range; invariants hold, and so do the assumptions of the
    table that runs next, of what it will see; and that table has a line for the states that it tests, as they are and as they are to be
    when the echo comes. Otherwise the old ones run on, and the message says what was against it, with the values. Parts of a level
    cannot be run by name while the sources that the session began with are not those of its executors, either: reload it. What the
    level and its neighbours do together is looked up, not proved (RCS738).
    """
    SHELL_COMMAND = """RCS734: the shell does not understand a command

    A word, a number or a condition is not as `help` in the shell shows it, or there is nothing to undo, to stop at or to come to.
    """
    SHELL_PART = """RCS735: a part cannot be run here

    A module, procedure or table that is run by itself met what the proofs exclude within a cycle: a division by zero, an index outside
    an array, a value out of its variable's range. Nothing was changed. Set what it reads first, or run the whole level.
    """
    SHELL_EXPECTED = """RCS736: an expected condition is false

    `expect CONDITION` in a script of the shell: the condition is false now. The message shows the variables that it is about. The
    script was stopped here.
    """
    SHELL_OTHERWISE = """RCS737: the next cycle would do otherwise

    `reload` found the new tables proved, and the present state among those that they were proved for; but it is a state in which they
    do otherwise than the ones that run, at once. The message shows the line of either version, what the next cycle would leave
    otherwise, and, as `rcsc diff` does, everything else that changed. It is also said where the two cannot be compared: the solver gave
    up, or the sources had been edited before the session began. Nothing was taken. `reload LEVEL anyway` takes it; or run on until the
    level has left that state, and reload there. `diff LEVEL` shows the same without taking anything.
    """
    SHELL_NOT_COMPOSED = """RCS738: new tables that are not proved together with their neighbours

    `reload` found the new tables proved by themselves, but an earlier `rcsc prove` looked at the level with exactly these tables in its
    environment and could not show what it is to keep: an assumption, an echo, an order of numbers. The message names what is open.
    Nothing was taken, and `anyway` does not change that; tables that nobody has looked at so are taken, and it is said. `reload LEVEL
    proved` looks at them first, as `rcsc prove` does, and refuses likewise what then is not proved. `rcsc prove --level LEVEL` looks
    for the shortest run that shows it.
    """
    STUDIO = """RCS739: the studio does not do that

    A page of `rcsc studio` asked what no part of the studio answers, or with something missing, or more than may be asked at once; or
    it asked for what is not there now: a moment that is not kept, a line of another table, a run where none is open. The message says
    which. Nothing was changed. Where the studio itself is refused, the port that `--port` names is taken by another program, or may not
    be used.
    """
    BAD_JOURNAL = """RCS741: a journal is not this campaign's

    `rcsc campaign` goes on from its journal only if that has the same seed, plant and executors, and was written with the same tables,
    data and programs: what it holds would not be what the episodes do now. The same is said of a file that is no journal or is damaged
    before its last line, and of one that another campaign is writing. The file was not changed. Name another one with `--journal`, or
    leave the option out: then each state of the tables has a journal of its own.
    """
    BAD_EPISODE = """RCS742: an episode cannot be read

    `rcsc campaign --again FILE` runs an episode that a campaign saved: `episode.json`, or the folder that has it. This file is none, or
    names a level, a buffer, a field, a command, a fault or a plant that the system has not.
    """
    PROPERTY_BROKEN = """RCS743: a property does not hold

    In an episode of `rcsc campaign` or `rcsc test` something happened that must not: a state-table error, an assumption that failed, an
    order taken twice, an answer that changed, a command that did not end, or one of your own properties. Or a run of `rcsc run` broke a
    requirement that is `monitored`: `rcsc replay LOG --find "not LEVEL.REQUIREMENT"` shows the cycle. The message names the property,
    the cycle and what was seen; the folder that is named has the episode as small as it could be made, which `rcsc campaign SYSTEM
    --again FOLDER` runs again, its script, and of a campaign its log for `rcsc replay`. What a fault explains that breaks the
    contract between levels, an older value that comes again, is no such finding.
    """
    WORKERS_GONE = """RCS744: no worker is left to play episodes

    The workers of a campaign are gone and cannot be had again: the scheduler does not answer, or it lost them, or they have other
    tables or programs than the campaign. What was done is kept in the journal; the same command goes on from there.
    """
    NOT_COMPOSED = """RCS751: a level is not proved in its environment

    `rcsc prove` looks at a level with every command at every moment, and with every delay, repetition and loss in its buffers. Something
    that should hold in each cycle could not be proved: an assumption of a table, that one line matches, or what a neighbour relies on.
    Where a run from the first cycle shows it, the shortest is printed, cycle by cycle, as the interpreter ran it: repair the table. Where
    none is found, it is said which runs were looked at: a longer one may break it, or no invariant that rcsc looks for says why it holds.
    Then two cycles are shown at which the proof stops, from a state that nobody has seen reached: they tell which line and which values
    to look at. The helps say what to type: `--trace N` looks at longer runs, `--where "variable = value"` plays on from that state, and
    if it cannot be, an `invariant` that says so is proved and used. In a run, cycles that are alike take one row. *then* says what
    follows, each with its run: what the superior takes, up to `--follow N` cycles later. A *help* was tried in short runs, and says what
    else it breaks; that no run shows more is no proof: prove the changed table. A table's assumption that is not proved stays monitored.
    What *rests on* it is found so only if it holds; what is *not looked at* could not be stated, and is never proved: the manual has
    every verdict under "What a verdict says". `--log DIR` keeps each trace as a log for `rcsc replay`, `--freeze DIR` as a case that
    `--case FILE` runs again. `rcsc check` repeats it as a warning, as long as nothing that was looked at has changed: the tables by
    themselves may well be proved.
    """
    NOT_AGREED = """RCS752: a level assumes more than its neighbour keeps

    What a level assumes of the level above or below is matched with what was proved of that level: that a report echoes the command it
    answers, that an order changes only together with its number, and that both begin in agreement. Here it was not proved of the
    neighbour, so that the proofs of the levels do not make a proof of the system. `rcsc check` repeats it as a warning, and calls no
    assumption proved then.
    """
    FOUND_AGAIN = """RCS753: a frozen finding breaks again

    A finding that `rcsc prove --freeze` kept was run on the tables as they are now, with the inputs that it was found with. It should
    not break what it broke then, and does; or, where the case says that it is to break it, no longer does. Mend the tables; a case that
    is to show a hazard (`"expect": "broken"`) and no longer does is out of date.
    """
    BAD_CASE = """RCS754: a frozen finding cannot be run

    The case cannot be read, or names a system, a level, a variable or a value that the tables do not have any more. Find it anew with
    `rcsc prove --freeze`, or remove it.
    """
    ENDLESS = """RCS756: a command is not shown to end

    Every command is to end if every order that is not replaced is answered. For this table that is not shown: the lines named may run for
    ever, or a loop of states may never answer it. The run, where there is one, ends as it was before the cycle named, with every order
    answered or followed by another, so that it may go on for ever; the loop is told by its lines and the states in which they run. Where
    no run comes to one, a loop from a state that the proof does not exclude is shown. It is a warning: a line may wait for what nobody in
    the system brings about, and be right. Where it is not, count the cycles and fail, or give the state in which the command is done; a
    number that rises with the line, and that no other line sets back, shows that it ends.
    """
    BAD_START = """RCS757: runs cannot begin so

    `rcsc prove --where "variable = value, ..."` searches the runs of what is not proved from these values in place of the declared
    initial ones. The text is not of this form, names a variable that no level has, or that several have (write `level.variable`), a
    value outside its range, or values that an invariant excludes. No verdict depends on it.
    """
    LINE_NEVER_REACHED = """RCS758: a line is never reached in its system

    `rcsc prove` shows of the level in its environment, whatever comes, that no cycle runs the line: the cells that are marked never hold
    where the table runs, or never together. Where that is about a value of the level's own, the lines that would bring it about are named.
    Often a line that should lead there was forgotten. A line that is there in case of a fault may stay; `--strict` counts it. Where no line
    of a table runs, nothing selects the table.

        enum mode { waiting, levelling }
        input call : bool
        state now : mode = waiting
        table lift {
          | line  | now       | call  || now     |
          | idle  | waiting   | false ||         |
          | goes  | waiting   | true  || waiting |
          | level | levelling |       || waiting |
        }
    """
    NEVER_LEFT = """RCS759: a state that nothing leaves

    An enumeration that the level keeps, and that its lines test, can come to the values that are named, from the lines that are marked,
    and then has one of them for ever, whatever comes: no line that matches there writes another one, or those that would are never reached
    there. Only a restart leaves it. A state that waits for an order is none, as the next one leaves it. Where it is meant to be final, say
    so in a property over two cycles, which is proved with the others: `property broken_stays : now = broken then now = broken`. Without
    that `--strict` counts it.
    """
    VACUOUS = """RCS760: a requirement that never asks

    `rcsc prove` shows of the level in its environment that the condition of the requirement, or its scope, never comes: it is proved, and
    says nothing. Often the condition is not what was meant, or a line is missing that would bring it about. Where it is never to come, say
    just that: `requirement never_hot : never heat_C > 90`. `--strict` counts it.

        input asked : bool
        state waited : int 0 .. 3
        output given : bool
        requirement late : when waited = 3, within 1 cycles, given
        table t {
          | line | asked | waited || waited     | given |
          | wait | true  | < 2    || waited + 1 | false |
          | give | true  | >= 2   || 0          | true  |
          | rest | false |        || 0          | false |
        }
        level l { table t }
    """
    CANNOT_BE_KEPT = """RCS761: an assumption over time that cannot always be kept

    What is assumed over time of what comes from outside restricts inputs, and never what the level does: after whatever that has done,
    some inputs must keep the assumption, together with all others that are about the same inputs. After the run that is shown, none were
    found that do: every value of truth values and members was tried, and of numbers those by the constants that conditions compare them
    with, the ends of their range, and the value that they had. Nothing is proved of the level, since all would be proved of runs that come
    to such an end. Have it restrict less, or name the case in which it does not apply.

        input rolls : bool
        output speed : int 0 .. 100
        assume stops : always not rolls
        assume tested : at least 10 cycles apart, rolls
        assume starts : when speed = 0, within 2 cycles, rolls
        table t {
          | line | rolls || speed |
          | stop | true  || 0     |
          | rest | false || 0     |
        }
        level l { period 10 [ms] table t }
    """
    GRAPH_NO_STATE = """RCS771: a table has no state to draw

    `rcsc graph` draws the values of one variable as states: `cur_state`, else the only enumeration that the table tests and keeps as
    state; of several the only one that its lines write. It has to be a `state` of few values: an enumeration, a boolean or up to 64
    integers. Name it with `--state`, or draw which line can match after which: `--lines`.
    """
    GRAPH_UNREADABLE = """RCS772: a graph cannot be read

    `rcsc table` reads DOT, Mermaid (`stateDiagram-v2`) and SCXML as `rcsc graph` writes them. The text is not in its form, does not
    name its table, or a guard or an effect on an arrow is not in the language: a guard is a condition, terms joined by `and`; an effect
    is what the line does, each column's actions in parentheses after its heading.

        stateDiagram-v2
          %% table: door
          shut --> open : 1 [button] command_out(lift)
          open --> shut : 2 [not button and clear] command_out(drop)
    """
    GRAPH_DIFFERS = """RCS773: a graph and its table differ in meaning

    The table made of the graph does not do what the present one does: for the input shown another line's worth of actions runs, or none
    does, or two lines match. If the graph was changed on purpose, that is the change; `rcsc diff` shows all of it. A graph that `rcsc
    graph` wrote and nobody changed always says its table where nothing is reported.
    """
    GRAPH_LOSES = """RCS774: a graph does not hold this

    What a graph cannot say is named when it is written: comments, lines that match nothing under the assumptions, and conditions on the
    state that come back narrower, as the states from which the arrows come. What is proved of the table that comes back holds all the
    same. When a table is made of a graph, lines that were named or split are told in the same way.

    DOT, Mermaid and SCXML hold the same. But Mermaid draws several loops of one state on top of each other, and SCXML's guards are in
    the table's words: its processors cannot run them.
    """
    NOT_COMPARED = """RCS781: two versions cannot be compared

    `rcsc diff` was given a file, a folder or a revision that is not there, or neither side has a table. Revisions are those of the git
    repository that one stands in; `REV:path` counts from its top, `REV:./path` from this folder. Nothing was compared.
    """
    SOLVERS_DISAGREE = """RCS901: two deciders disagree

    The fast decision by boxes or regions and the solver gave different answers on the same question; or, with `--solver z3`, the
    interpreter did not see what Z3 said of an input; or cvc5 did not confirm what `rcsc prove --certify` put to it. One of them is wrong,
    or gave up, so nothing is proved, and it is a bug in rcsc. Please report it with the table.
    """
    INTERNAL = """RCS902: a bug in rcsc

    Something happened in rcsc that should not be possible. Nothing was proved and nothing written. Please report it with the text that
    `RCSC_DEBUG=1` prints and, if you can, the tables.
    """
    NOT_REPRODUCED = """RCS903: a trace does not run

    The solver found a run that should break something, and the interpreter, run on the same inputs, did not break it; or the
    interpreter did, and the generated Python or C, run on them, left something else. One of them is wrong about the language. The first
    cycle in which they part is shown, both side by side. Nothing is claimed of the goal. Please report it with the tables.
    """
    WORKER_ENDED = """RCS904: a worker process ended without an answer

    With `--jobs` above 1 each table or level is proved in a process of its own. One of them was killed, ran out of memory, or crashed
    before it answered, so nothing is known of what it was to decide, and the command ends with status 3: nothing is proved, and nothing
    is refuted. Look at the system's log for a process that was killed for its memory; `--jobs 1` takes the least.
    """


def _unindented(block: str) -> str:
    return dedent(block) + "\n"
