"""C that plays drawn sessions of a whole system, for sanitizers and for counting what was reached.

In: a linked system. Out: text of a C file with `main`. It defines the functions that the system asks: they answer anything of their types.
"""

from collections.abc import Iterator

from rcsc.lang.model import Array
from rcsc.run.link import Linked
from rcsc.run.link.wiring import End, LinkedLevel, Question
from rcsc.views.evidence.analysers import drawn_value, player

SESSION = 400
"""Steps after which the system begins anew."""


def drawn_system(system: Linked, calls: int) -> str:
    """Return the file.

    Args:
        system: The system.
        calls: The number of steps.
    """
    p = system.word
    lines = [f"static {p}_t s, copy;"]
    for question in {
        question.function: question for level in system.levels for question in level.questions
    }.values():
        lines += _answer(question)
    lines += ["static void outside(void) {"]
    for buffer in system.buffers:
        if buffer.source is None and buffer.target is not None:
            lines += ["    if (next() % 2u == 0u) {"]
            lines += (f"        {each}" for each in _values(buffer.target, f"s.{buffer.place}"))
            lines += ["    }"]
    lines += [
        "}",
        "static void fail(void) { /* memory that fails: what one level gives another is anything */",
    ]
    for buffer in system.buffers:
        if buffer.source is not None and buffer.target is not None:
            lines += ["    if (next() % 16u == 0u) {"]
            lines += (f"        {each}" for each in _values(buffer.target, f"s.{buffer.place}"))
            lines += ["    }"]
    lines += ["}", "static void spoil(uint64_t level) {", "    switch (level) {"]
    lines += (f"    case {at}: {_spoilt(level)} break;" for at, level in enumerate(system.levels, 1))
    lines += ["    default: break;", "    }", "}"]
    level = f"({p}_level_t)(next() % {len(system.levels) + 2}u)"
    body = [
        f"        if (n % {SESSION}u == 0u) {{ {p}_init(&s); copy = s; }}",
        "        outside();",
        "        if (next() % 16u == 0u) { fail(); }",
        f"        if (next() % 8u == 0u) {{ (void){p}_restart(&s, {level}); }}",
        "        if (next() % 8u == 0u) {",
        f"            const {p}_level_t level = {level};",
        "            if (next() % 4u == 0u) { spoil(level); }",
        f"            (void){p}_resume(&s, level, &copy);",
        "        }",
        "        if (next() % 16u == 0u) { copy = s; }",
        f"        (void){p}_step(&s);",
    ]
    return player(f"{p}.h", lines, body, calls)


def _values(end: End, place: str) -> Iterator[str]:
    """Yield statements that draw each leaf of a place; one in sixteen from its whole type."""
    for at in end.run:
        leaf, kind = end.program.sign.leaves[at], end.program.plan.program.variables[at].type
        inside, any_ = (drawn_value(leaf.c_type, kind, whole) for whole in (False, True))
        yield f"{place}{end.part(at)} = (next() % 16u == 0u) ? ({any_}) : ({inside});"


def _answer(question: Question) -> Iterator[str]:
    """Yield a function in place of the user's, which the system asks."""
    yield f"{question.head} {{"
    yield from (f"    (void)key_{at};" for at, _ in enumerate(question.keys))
    place = "answer" if isinstance(question.into.kind, Array) else "(*answer)"
    yield from (f"    {each}" for each in _values(question.into, place))
    yield "}"


def _spoilt(level: LinkedLevel) -> str:
    """Return a statement that spoils the copy's state of a level, so that nothing can go on from it."""
    return f"copy.{level.member}.digest ^= 1u;"
