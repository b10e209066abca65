"""What is asked of the model checker: steps part by part, cycles case by case; and what it says of a planted fault."""

import pytest

from rcsc.code.testing.esbmc import EsbmcAnswer, EsbmcVerdict, case_harness, prove_function, step_parts
from rcsc.code.testing.executors.symbols import symbols_of
from rcsc.code.testing.executors.targets import ComparedFunction, targets
from rcsc.views.evidence import model_check
from rcsc.views.evidence.kind import Subject
from tests.evidence.subjects import EVERYTHING, subject_of

COUNTS = """
enum wish { up, down }
input wanted : wish
state n : int 0 .. 9
output done : bool
procedure count { n := min(n + 1, 9) }
table rises {
  | line | n   || procedures | done  |
  | a    | < 9 || count      | false |
  | b    | 9   ||            | true  |
}
table sinks {
  | line | n   || n     | done  |
  | a    | > 0 || n - 1 | false |
  | b    | 0   ||       | true  |
}
level l {
  period 10 [ms]
  table by wanted {
    up : rises
    down : sinks
  }
}
"""


def target_of(subject: Subject, kind: str) -> ComparedFunction:
    """The first function of a kind."""
    symbols = symbols_of(subject.program, subject.files)
    return next(target for target in targets(subject.program, symbols) if target.kind == kind)


def verdict(*edits: tuple[str, str]) -> EsbmcVerdict:
    """What ESBMC says of the cycle, its C edited."""
    subject = subject_of(COUNTS, *edits)
    symbols = symbols_of(subject.program, subject.files)
    return prove_function(subject.program, symbols, subject.files, target_of(subject, "cycle"), 60.0)


def test_the_parts_of_a_step_are_those_of_its_text() -> None:
    for text, parts in ((COUNTS, {"admit", "run"}), (EVERYTHING, {"admit", "run", "safe"})):
        subject = subject_of(text)
        symbols = symbols_of(subject.program, subject.files)
        found = step_parts(symbols, subject.files, target_of(subject, "step"))
        assert found is not None
        assert set(found) == parts


def test_a_cycle_is_asked_about_for_each_command_and_where_inputs_are_refused() -> None:
    subject = subject_of(COUNTS)
    symbols = symbols_of(subject.program, subject.files)
    cycle = target_of(subject, "cycle")
    for value, stated in ((None, "refused != REF_NONE);"), (1, "refused == REF_NONE && c.wanted == 1);")):
        assert stated in case_harness(subject.program, symbols, cycle, value)


@pytest.mark.parametrize(
    ("kept", "lost", "part"),
    [
        ("probe_min_u32((uint32_t)s->n + 1u, 9u)", "probe_min_u32((uint32_t)s->n + 1u, 8u)", "wanted = up"),
        ("s->wanted > PROBE_WISH_DOWN", "s->wanted > 2u", "refused inputs"),
    ],
)  # fmt: skip
def test_a_fault_in_a_procedure_or_in_admission_is_refuted_in_its_part(
    kept: str, lost: str, part: str
) -> None:
    said = verdict((kept, lost))
    assert said.answer is EsbmcAnswer.REFUTED
    assert part in said.detail


def test_the_evidence_lists_every_function_and_tells_of_a_difference() -> None:
    whole = model_check.collect(subject_of(COUNTS))
    assert not whole.shortfalls
    assert whole.figures == ("ESBMC: 8 of 8 functions proved equal to the tables, whole",)
    planted = model_check.collect(subject_of(COUNTS, ("s->wanted > PROBE_WISH_DOWN", "s->wanted > 2u")))
    assert "probe_l_cycle" in {short.where for short in planted.shortfalls}
