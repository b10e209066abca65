"""Types in C: declared once, by the header of the file that declares them, for all programs that use it."""

import subprocess
from pathlib import Path

import pytest

from rcsc.base.diagnostics.codes import Code
from rcsc.code.emit import TARGETS
from rcsc.driver.compile import compile_
from rcsc.driver.settings import Conclusion, Settings
from rcsc.proof.solvers.options import Options
from tests.support.programs.stages import STRICT, emitted, program_of

TABLE = "table t {\n| line | a     ||\n| x    | true  ||\n| y    | false ||\n}\n"
USER = f"use words\ninput a : bool\ninput o : order\noutput r : order\n{TABLE}level LEVEL {{ period 10 [ms] table t }}\n"
WORDS = "enum word {{ rest, go }}\nrecord order {{ what : word  many : array[3] of int 0 .. {most} }}\n"


def compiled(folder: Path, **texts: str) -> Conclusion:
    """The files of a project compiled, those of its top as programs but for `words`."""
    (folder / "rcsc.toml").write_text('name = "p"\n', encoding="utf-8")
    for name, text in texts.items():
        path = folder / f"{name.replace('__', '/')}.rcs"
        path.parent.mkdir(exist_ok=True)
        path.write_text(text, encoding="utf-8")
    roots = tuple(
        str(folder / f"{name.replace('__', '/')}.rcs") for name in texts if not name.endswith("words")
    )
    return compile_(Settings(roots, Options()), folder / "generated", tuple(TARGETS), only_check=False)


def test_programs_that_use_a_file_have_its_types_in_common(tmp_path: Path) -> None:
    made = compiled(
        tmp_path,
        words=WORDS.format(most=300),
        upper=USER.replace("LEVEL", "upper"),
        lower=USER.replace("LEVEL", "lower"),
    )
    assert not made.report.failed, made.report.diagnostics
    (tmp_path / "main.c").write_text(
        """#include "upper.h"
#include "lower.h"
int main(void)
{
    upper_t u; lower_t l;
    upper_init(&u); lower_init(&l);
    u.r.what = WORDS_WORD_GO; u.r.many[2] = 300;
    l.o = u.r; /* one type */
    words_order_t *here = &l.o;
    return (here->what == WORDS_WORD_GO && here->many[2] == 300 && sizeof here->what == 1) ? 0 : 1;
}
"""
    )
    sources = ["main.c", "generated/c/upper.c", "generated/c/lower.c"]
    subprocess.run(["cc", *STRICT, "-Igenerated/c", *sources, "-o", "main"], cwd=tmp_path, check=True)
    subprocess.run(["./main"], cwd=tmp_path, check=True)


def test_a_file_s_types_bear_its_place_in_the_project(tmp_path: Path) -> None:
    own = "use common\n" + USER.replace("use words\n", "").replace("LEVEL", "emove")
    common = "enum word { rest, go }\nrecord order { what : word }\n"
    made = compiled(tmp_path, emove__emove=own, emove__common_words="", task__words="")
    assert made.report.failed  # there is no such file yet
    (tmp_path / "emove/common.rcs").write_text(common, encoding="utf-8")
    made = compiled(tmp_path, emove__emove=own + "enum mine { one }\ninput m : mine\n")
    assert not made.report.failed, made.report.diagnostics
    here = tmp_path / "generated/c"
    assert {path.name for path in here.glob("*_types.h")} == {"emove_common_types.h", "emove_types.h"}
    assert "EMOVE_COMMON_WORD_GO = 1" in (here / "emove_common_types.h").read_text()
    assert "EMOVE_MINE_ONE = 0" in (here / "emove_types.h").read_text()
    assert "    emove_mine_t m; /* " in (here / "emove.h").read_text()


def test_types_that_would_differ_between_programs_are_an_error(tmp_path: Path) -> None:
    """The file does not say itself what its record is made of."""
    words = "record order { many : number }\n"
    upper, lower = (
        f"type number = int 0 .. {most}\n" + USER.replace("LEVEL", name)
        for name, most in (("upper", 9), ("lower", 900))
    )
    made = compiled(tmp_path, words=words, upper=upper, lower=lower)
    [found] = [one for one in made.report.diagnostics if one.code is Code.NAME_COLLISION]
    assert "other types of `c/words_types.h`" in found.message
    assert not (tmp_path / "generated").exists()
    lower = lower.replace("900", "9")
    assert not compiled(tmp_path, words=words, upper=upper, lower=lower).report.failed


def test_types_of_files_that_need_each_other_stand_in_one_header(tmp_path: Path) -> None:
    """A use alone cannot make such a circle: the program that uses both does."""
    texts = {
        "a_words": "record first { w : word }\nrecord third { s : array[2] of second }\n",
        "b_words": "enum word { x, y }\nrecord second { f : first }\n",
        "user": "use a_words\nuse b_words\ninput a : bool\ninput o : third\n" + TABLE,
    }
    made = compiled(tmp_path, **texts)
    assert not made.report.failed, made.report.diagnostics
    headers = list((tmp_path / "generated/c").glob("*_types.h"))
    assert [path.name for path in headers] == ["a_words_types.h"]
    sources = ["generated/c/user.c"]
    subprocess.run(["cc", *STRICT, "-Igenerated/c", "-c", *sources, "-o", "m.o"], cwd=tmp_path, check=True)


def test_a_program_called_as_a_header_of_types_is_called_otherwise(tmp_path: Path) -> None:
    made = compiled(tmp_path, words=WORDS.format(most=3), words_types=USER.replace("LEVEL", "l"))
    assert not made.report.failed, made.report.diagnostics
    names = {path.name for path in (tmp_path / "generated/c").glob("*.h")}
    assert names == {"words_types.h", "words__types.h"}


@pytest.mark.parametrize(("members", "kind"), [(1, "uint8_t"), (256, "uint8_t"), (257, "uint16_t")])
def test_an_enumeration_is_as_wide_as_its_members_need(members: int, kind: str) -> None:
    text = (
        f"enum e {{ {', '.join(f'm{at}' for at in range(members))} }}\ninput a : bool\ninput e : e\n{TABLE}"
    )
    header = emitted(program_of(text, "plain.rcs"))["c/plain_types.h"]
    assert f"typedef {kind} plain_e_t;" in header
    assert f"PLAIN_E_M{members - 1} = {members - 1}" in header


NAMED = """
input a : bool
input n : int 0 .. 9 [mm]
state s : bool
assume calm monitored : n < 9
assume small monitored : n < 8
table Ta assuming calm {
  | line | a     | n  ||
  | 1    | true  |    ||
  | On   | false | >4 ||
  | on   | false | <5 ||
}
table tb assuming calm, small {
  | line    | a    ||
  | x       | true ||
  | DEFAULT |      ||
}
"""


def test_lines_assumptions_and_faults_have_names(tmp_path: Path) -> None:
    for path, text in emitted(program_of(NAMED, "plain.rcs")).items():
        (tmp_path / Path(path).name).write_text(text, encoding="utf-8")
    (tmp_path / "main.c").write_text(
        """#include "plain.h"
int main(void)
{
    plain_t s;
    plain_init(&s);
    s.n = 8;
    int32_t bad = plain_Ta_step(&s) != PLAIN_FAULT_NONE || s.line != PLAIN_LINE_TA_ON;
    s.n = 3;
    bad |= plain_Ta_step(&s) != PLAIN_FAULT_NONE || s.line != PLAIN_LINE_TA_ON_2;
    s.n = 8;
    bad |= plain_tb_step(&s) != 0 || s.line != PLAIN_LINE_TB_DEFAULT;
    bad |= s.assumptions_failed != UINT64_C(1) << PLAIN_ASSUMPTION_SMALL;
    s.n = 10;
    bad |= plain_tb_step(&s) != PLAIN_FAULT_ADMIT || s.fault_at != 1;
    return bad;
}
"""
    )
    subprocess.run(["cc", *STRICT, "main.c", "plain.c", "-o", "main"], cwd=tmp_path, check=True)
    subprocess.run(["./main"], cwd=tmp_path, check=True)
    header = (tmp_path / "plain.h").read_text(encoding="utf-8")
    assert "    uint8_t n; /* 1: input; 0 .. 9 mm */" in header
    assert "PLAIN_ASSUMPTION_SMALL = 1 /* small: only told in tb */" in header
