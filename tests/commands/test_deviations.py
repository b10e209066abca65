"""The page of deviations: what it says of the programs is so, and its Fig. 11 is that of the paper and of the programs."""

import re
import struct
from collections.abc import Iterator
from pathlib import Path

import pytest

from rcsc.run.description import description
from rcsc.run.log.queries import normal
from rcsc.run.signature import FORMATS
from rcsc.run.system import signatures
from tests.support.shells import alone, do

REPO = Path(__file__).parents[2]
TABLES = REPO / "tables"
PAGE = TABLES / "deviations.md"
PLACE = re.compile(r"(section \d+(\.\d+)*|fig\. \d+|lines? \d+( to \d+)?)", re.IGNORECASE)
FIGURE_11 = """
task.workstation 70: cycle-cnt-in inc-command-in input-command obj-name-in source-locpt-name-in dest-locpt-name-in
    end-at-locpt-name-in sector-in
task.to_workstation 20: cycle-cnt-status-out cycle-cnt-echo-out inc-command-echo-out ref-command-echo
    elapsed-time-status-out status-report status-parameter-output failure
emove.task 20: cycle-cnt-out inc-command-out output-command obj-ptr-out locpt-ptr-out apoint-pos-flag
    gripped-obj-ptr-out-to-emove
emove.to_task 20: cycle-cnt-status-in cycle-cnt-status-echo-in inc-command-echo-in ref-command-in status-in
    status-parameter-in failure
primitive.emove 26: cycle-cnt-out inc-command-out output-command obj-ptr-out pose-ptr-out movtab-ptr-out traj-para-ptr-out
    end-effector-para-ptr-out gripper-obj-ptr-out
primitive.to_emove 20: cycle-cnt-status-in cycle-cnt-status-echo-in inc-command-echo-in ref-command-in status-in failure-in
"""
"""Of each buffer its bytes and its fields, in the paper's order. Source: Haynes et al. (1984), Fig. 11."""
BUFFERS = re.findall(r"^(\S+) (\d+): (.*(?:\n .*)*)", FIGURE_11, re.MULTILINE)
TYPED = ("TASK-LEVEL", "NAME ?", "NAME = VALUE")
"""What is typed in the shell."""
STRINGS = (
    "input-command",
    "obj-name-in",
    "source-locpt-name-in",
    "dest-locpt-name-in",
    "end-at-locpt-name-in",
)
"""Fields of 10 bytes: those of the workstation's command; all others have 2."""


def rows(page: str, columns: str) -> Iterator[list[str]]:
    """The rows of every table with these columns."""
    for table in re.findall(rf"^\| {re.escape(columns)} \|\n\|[-|]+\|\n((?:\|.*\n)+)", page, re.MULTILINE):
        for row in table.splitlines():
            yield [cell.strip() for cell in row.strip("|").split("|")]


@pytest.fixture(scope="module")
def page() -> str:
    return PAGE.read_text(encoding="utf-8")


def spoken() -> set[str]:
    """Every word of the tables, the data, the scripts, and the names of files that they compile to."""
    paths = [path for kind in ("rcs", "toml", "csv") for path in TABLES.rglob(f"*.{kind}")]
    texts = [path.read_text(encoding="utf-8") for path in paths]
    names = [path.stem for path in paths] + [path.name for path in (REPO / "generated").rglob("*.h")]
    words = [re.findall(word, "\n".join(texts)) for word in (r"[\w.]+", r"[A-Z-]+")]
    return set(names).union(*words)


def test_each_deviation_has_a_place_in_the_paper_and_a_reason(page: str) -> None:
    entries = list(rows(page, "where | the paper | here | why"))
    assert len(entries) > 25
    for entry in entries:
        assert len(entry) == 4, entry
        assert all(entry), entry
        assert all(PLACE.fullmatch(place) for place in entry[0].split(", ")), entry[0]


def test_each_name_on_the_page_stands_in_the_programs(page: str) -> None:
    known = spoken()
    for entry in rows(page, "where | the paper | here | why"):
        for name in re.findall(r"`([^`]+)`", " ".join(entry)):
            assert name.startswith("rcsc ") or name in TYPED or known.issuperset(name.split()), name


def test_what_the_page_says_to_type_is_understood(page: str) -> None:
    """At TASK: a variable, or a command; and it is called otherwise in the paper."""
    shell = alone(kind="python")
    named = list(rows(page, "there | here, at level TASK"))
    assert len(named) > 15
    for there, here in named:
        [typed] = re.findall(r"`([^`]+)`", here)
        assert normal(typed) not in map(normal, re.findall(r"\*([^*]+)\*", there))
        variable = typed in {leaf.name for leaf in shell.session.system.level("task").sign.leaves}
        assert do(shell, f"{typed} ?" if variable else typed), typed
    assert do(shell, "<CMD=>FAILURE>", "<to-workstation.failure ?>") == ["task.to_workstation.failure = cmd"]


def of_buffer(page: str, buffer: str) -> tuple[str, list[list[str]]]:
    section = page.partition(f": `{buffer}`\n")[2].partition("\n#")[0]
    return section, list(rows(section, "there | bytes | here | bytes"))


@pytest.mark.parametrize(("buffer", "size", "names"), BUFFERS)
def test_the_fields_of_figure_11(page: str, buffer: str, size: str, names: str) -> None:
    """In order, with their bytes, both in the paper and in the program."""
    section, fields = of_buffer(page, buffer)
    there = [(row[0].strip("*"), int(row[1])) for row in fields if row[0]]
    assert there == [(name, 10 if name in STRINGS else 2) for name in names.split()]
    level, _, record = buffer.partition(".")
    sign = signatures(description(TABLES / "system.toml"))[level]
    leaves = [sign.leaves[at] for at in sign.record(record)]
    sizes: dict[str, int] = {}
    for leaf in leaves:
        field = re.split(r"[.\[]", leaf.name.removeprefix(f"{record}."))[0]
        sizes[field] = sizes.get(field, 0) + struct.calcsize(f"<{FORMATS[leaf.c_type]}")
    here = [(row[2].strip("`"), int(row[3])) for row in fields if row[2]]
    assert here == list(sizes.items())
    assert f"{size} bytes there, {sum(sizes.values())} here" in section


def test_the_guides_lead_to_the_page() -> None:
    for guide in (TABLES / "README.md", REPO / "sim" / "README.md"):
        assert "deviations.md" in guide.read_text(encoding="utf-8"), guide
