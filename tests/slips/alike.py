"""Why slips that no vector notices change nothing: forms of the emitted C, each with the reason.

In: a slip and its place. Out: the reason, or none. A reason holds for what stands at the place and what comes there instead; states that
are drawn must not tell such a slip apart, either.
"""

import re
from collections.abc import Collection
from dataclasses import dataclass

from tests.slips.drawn import Slip

ONE_LINE = "proved by `rcsc check`: exactly one line matches"
ANY = ""
"""A pattern that is found everywhere."""


@dataclass(frozen=True, slots=True)
class Reason:
    """What a slip must look like for a reason to hold, by patterns that are searched.

    Attributes:
        function: Of the name of its function.
        old: Of what stands there, with the rest of its line.
        new: Of the slip.
        operator: Of its operator.
    """

    why: str
    function: str
    old: str = ANY
    new: str = ANY
    operator: str = ANY


REASONS = (
    Reason("guards against machines that compute otherwise than this one", r"_exact$"),
    Reason("at the bound itself both give the bound", r"_admit$", r"if \(s->[\w.]+ [<>] ", r" [<>]= "),
    Reason(
        "an admitted real is never -0.0, of which alone 0.0 makes another value",
        r"_do_|_admit$",
        r" \+ 0\.0",
        operator="lost|another operator",
    ),
    Reason(
        "the other comparison holds where this one newly does",
        r"_number_f\d+$",
        new=r">=|a > -|a <= [^-]|^\([1-9-]",
    ),
    Reason(ONE_LINE, r"_match_", r"m == |several|seen|-[12]\b"),
    Reason(ONE_LINE, r"_match_", r"_bit\d+\(m \|", r"^\(\d+u?\)|^\(m\)"),
    Reason(
        "the line that calls it orders the same once more",
        r"_do_set_source$",
        r"s->to_emove\.(?:obj_ptr|grasp) = ",
    ),
    Reason(
        "the line that calls it orders the same once more", r"_do_settle$", r"s->to_\w+\.input_command = "
    ),
    Reason("of two that are equal either will do", r"_(?:min|max)_\w+$", r" [<>] ", r" [<>]= "),
    Reason("the value was proved to lie there", r"_(?:atleast|atmost|within)_\w+$"),
    Reason("both order the same", r"_run_", r"_do_settle\(s\);", operator="order"),
    Reason("it was made of it a line before", r"_do_test_variables$", r"dest\.known", r"dest_spec"),
    Reason(ONE_LINE, r"_run_", r"_FAULT_NO_LINE|_FAULT_SEVERAL_LINES|s->line = -1"),
    Reason(
        "every value of the selector has a table",
        r"_cycle$",
        r"chosen == \w+\)",
        operator="held true|another comparison",
    ),
    Reason("every value of the selector has a table", r"_cycle$", r"proved impossible|_FAULT_NO_LINE"),
    Reason(
        "no table of this cycle leaves a fault",
        r"_cycle$",
        r"if \(s->fault == \w+_FAULT_NONE\)",
        operator="held true|comparison",
    ),
    Reason(
        "a fault that this program never has",
        r"_(?:step|cycle)$",
        r"_FAULT_NONE",
        r"_FAULT_(?:STATE|EXTERN|ASSUMPTION|SEVERAL_LINES|NO_LINE|ARITHMETIC)",
    ),
    Reason(
        "what is taken of it is compared with a number far from 0",
        r"_abs_f\d+$",
        r"a <= 0\.0",
        r"a < |e-09|^\(1\.0\)",
    ),
    Reason(
        "the one line that calls it matches where the count is less than that",
        r"_do_wait$",
        r"if \(s->waited < \d+u\)",
    ),
    Reason(
        "the cycle writes it again: it answers each new order", r"_do_take_orders$", r"s->answered = false;"
    ),
    Reason(
        "the cycle writes it again: every line says what it reports",
        r"_do_take_orders$",
        r"status_report = ",
    ),
    Reason(
        "no line settles: an order that is new and answered is answered again",
        r"_do_give_orders$",
        r"if \(s->new_command && \(!s->settling\)\)",
        r"^\(s->answered\)",
    ),
    Reason(
        "`take_orders` has just made the two equal",
        r"_do_give_orders$",
        r"_echo = s->inc_command_seen;",
        r"inc_command",
    ),
)


def reason_of(text: str, slip: Slip, greatest: Collection[str] = ()) -> str:
    """Return why a slip changes nothing; empty where no reason is known.

    Args:
        text: The C.
        slip: The slip.
        greatest: Constants of which there is no greater one in their enumeration.
    """
    if (met := re.search(r" >= (\w+)\)$", slip.new)) and met[1] in greatest:
        return "there is no greater member"
    first, last = text.rfind("\n", 0, slip.start) + 1, text.find("\n", slip.end)
    line = text[first:last]
    for reason in REASONS:
        asked = (
            (reason.function, slip.function),
            (reason.old, line),
            (reason.new, slip.new),
            (reason.operator, slip.operator),
        )
        if all(re.search(pattern, given) for pattern, given in asked):
            return reason.why
    return ""
