"""Which lines of a table can match where a condition holds.

In: a program, one of its tables, a condition. Out: yes, no or unknown for each line, by Z3 under the table's assumptions and the declared
ranges. A line that nobody can tell of is never said to be out of reach.
"""

from dataclasses import dataclass

from rcsc.lang.meaning import relying
from rcsc.lang.model import Expr, Program, Table
from rcsc.proof.relation.effect import Meaning, Shared
from rcsc.proof.relation.questions import answer, stated
from rcsc.proof.solvers.options import Options
from rcsc.proof.solvers.smt import Answer, troubles
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.evaluation import TooLongError


@dataclass(frozen=True, slots=True)
class Under:
    """Lines by name, DEFAULT too, in the table's order.

    Attributes:
        can: Those that match for some input for which the condition holds.
        unknown: Those of which nobody could tell within the limits.
        every: Those that match for no other input.
    """

    can: tuple[str, ...]
    unknown: tuple[str, ...]
    every: tuple[str, ...]


def lines_under(program: Program, table: Table, condition: Expr, options: Options) -> Under:
    """Return the lines that can match where a condition holds."""
    program = relying(program)
    meant = program.table(table.name)
    meaning = Meaning(program, Shared(program.kinds, program))
    names = [str(line.name) for line in meant.every_line]
    try:
        lines, wanted = meaning.every_line(meant), meaning.condition(condition)
        solver = stated(meaning.assumed(meant), options, [*lines, wanted])
        inside = [answer(solver, wanted, line) for line in lines]
        outside = [answer(solver, values.negation(wanted), line) for line in lines]
    except (TooLongError, RecursionError):
        return Under((), tuple(names), ())
    except troubles():
        return Under((), tuple(names), ())
    told = list(zip(names, inside, outside, strict=True))
    return Under(
        tuple(name for name, now, _ in told if now is Answer.SATISFIABLE),
        tuple(name for name, now, _ in told if now is Answer.UNKNOWN),
        tuple(
            name for name, now, else_ in told if (now, else_) == (Answer.SATISFIABLE, Answer.UNSATISFIABLE)
        ),
    )
