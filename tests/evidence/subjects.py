"""What a kind of evidence is made of: the C of a small program that has an instance of everything."""

from dataclasses import replace

from rcsc.code.emit import emitted
from rcsc.driver.compile import planned
from rcsc.proof.solvers.options import Options
from rcsc.proof.table.program import prove_program
from rcsc.views.evidence.kind import Subject
from tests.support.programs.stages import BOXES, program_of

EVERYTHING = """
enum mode { idle, run, stop }
record pair {
  left : int 0 .. 9
  right : bool
}
input wanted : mode
input go : bool
input width : int 0 .. 100 clamp
input force : real 0.0 .. 500.0
state kept : array[4] of int -5 .. 300
state at : int 0 .. 3
state both : pair
state smooth : real 0.0 .. 500.0
state share : int 0 .. 100
output done : bool safe false

procedure keep(value : int 0 .. 100) {
  kept[at] := value * 3
  at := (at + 1) mod 4
  smooth := min(4.0 * smooth + force, 500.0)
  both.left := min(both.left + 1, 9)
  both.right := go
}

procedure part {
  share := 100 / width
}

table t {
  | line | wanted | width | go    || procedures  | done  |
  | 1    | = run  | > 10  |       || keep(width) | true  |
  | 2    | = run  | <= 10 |       || keep(0)     | false |
  | 3    | = stop | > 0   | true  || part        | false |
  | 4    | DEFAULT |       |       ||             | false |
}

level l {
  period 10 [ms]
  table t
}
"""


def subject_of(text: str, *edits: tuple[str, str]) -> Subject:
    """The subject of a text that is proved, its C edited: each edit is of one place at least."""
    proved = prove_program(program_of(text, "probe.rcs"), BOXES).proved
    assert proved is not None
    plan = planned(proved)
    subject = Subject(proved, plan, emitted(plan), Options())
    files = dict(subject.files)
    for before, after in edits:
        assert any(before in text for text in files.values()), before
        files = {path: text.replace(before, after) for path, text in files.items()}
    return replace(subject, files=files)
