"""The protocol as a part of the language: what a level gets that declares whom it serves and commands.

The reference is written from sections 8.3 and 9 of Haynes et al. (1984), and knows nothing of the text that the compiler makes.
"""

from dataclasses import dataclass, field
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rcsc.lang.interpret import Fault, cycle, holds, initial
from rcsc.lang.model import AssumptionName, Program, Scalar, Standing, Value, spell, value_of_text
from rcsc.lang.resolve import compile_text
from rcsc.lang.restart import After, Fixed, SameAs, Stands

WORDS = """
enum job { rest, work, stow }
enum status { done, executing, failed }
enum why { none, broken, silent, begun_anew, slow }
link jobs {
  command : job rest rest
  status : status done done failed failed executing executing
  order { width_mm : int 0 .. 9 [mm]  stream seen_mm : int 0 .. 9 [mm] }
  report { reason why : why restart begun_anew  stream at_mm : int 0 .. 9 [mm] }
}
"""

LEVEL = (
    WORDS
    + """
enum choice { nothing, halt, begin, wider, put_away, let_rest }
enum phase { home, out }
serves boss : jobs
commands arm : jobs within 2 cycles else silent
commands hand : jobs
input choice : choice
state phase : phase restart out deferred
procedure widen { to_arm.width_mm := (to_arm.width_mm + 1) mod 10 }
procedure look { to_arm.seen_mm := (to_arm.seen_mm + 1) mod 10 }
procedure go { to_arm.input_command := work  next phase := out }
procedure put_away { to_hand.input_command := stow  next phase := home }
table work {
  | line  | choice   || procedures | status_out |
  |-------|----------||------------|------------|
  | none  | nothing  || look       | executing  |
  | halt  | halt     ||            | done       |
  | begin | begin    || go         | executing  |
  | wider | wider    || widen      | executing  |
  | away  | put_away || put_away   | failed     |
  | rest  | let_rest || settle     |            |
}
level cell { table work }
"""
)


def program(text: str) -> Program:
    """The program of a text that is in order."""
    made = compile_text(text)
    assert isinstance(made, Program), made
    return made


def member(kind: Scalar, word: str) -> Value:
    value = value_of_text(kind, word)
    assert value is not None
    return value


@dataclass
class Said:
    """What a subordinate was told, and what is known of it."""

    within: int | None
    answered: int | None = None
    number: int = 0
    command: str = "rest"
    width: int = 0
    numbered: tuple[str, int] = ("rest", 0)
    held: tuple[str, str, str] = ("rest", "done", "none")
    unechoed: int = 0
    late: bool = False
    resting: bool = False
    unanswered: int = 0
    why: str = "silent"

    def look(self, echo: int, status: str) -> bool:
        """Whether the last order is echoed, or given up."""
        if self.answered is not None:
            return self.look_for_answers(echo == self.number, status)
        if echo == self.number and (not self.late or self.command == "rest"):
            self.unechoed, self.late = 0, False
        else:
            self.unechoed += 1
            self.late = self.within is not None and self.unechoed > self.within
        return echo == self.number or self.late

    def look_for_answers(self, echoed: bool, status: str) -> bool:
        """The same where an order is to be answered in time, too; what is late and does not rest is left alone."""
        assert self.answered is not None
        rests = self.command == "rest"
        if self.late and not rests:
            return True
        if echoed and (status == "done" or (status == "failed" and not rests)):
            if rests:
                self.unanswered, self.late = 0, False
            return True
        most = self.answered if echoed or self.within is None else min(self.within, self.answered)
        self.late = self.unanswered >= most
        self.unanswered += not self.late
        if self.late:
            self.why = "slow" if self.unanswered >= self.answered else "silent"
        return echoed or self.late

    def hold(self, report: tuple[str, str, str]) -> None:
        """Take what is said of the last order."""
        self.held = (self.command, "failed", self.why) if self.late else report

    def give(self) -> None:
        """Number what is new."""
        if (self.command, self.width) != self.numbered:
            self.number, self.numbered = (self.number + 1) % 65536, (self.command, self.width)
            self.unechoed, self.unanswered, self.late = 0, 0, False


@dataclass
class Level:
    """The level of `LEVEL` by hand."""

    below: dict[str, Said]
    seen: int = 0
    new: bool = False
    answered: bool = False
    status: str = "done"
    why: str = "none"
    phase: str = "home"
    pending: str = "home"

    def cycle(
        self, order: tuple[int, str], reports: dict[str, tuple[int, str, str, str]], choice: str
    ) -> None:
        heard = [said.look(reports[name][0], reports[name][2]) for name, said in self.below.items()]
        echoed = all(heard)
        if echoed:
            self.phase = self.pending
        if order[0] != self.seen:
            self.seen, self.new, self.answered, self.status, self.why = (
                order[0],
                True,
                False,
                "executing",
                "none",
            )
        elif self.answered and echoed:
            self.new = False
        for name, said in self.below.items():
            if echoed:
                said.hold(reports[name][1:])
            said.resting = said.held[:2] == ("rest", "done") and (self.answered or echoed)
        arm, hand = self.below["arm"], self.below["hand"]
        match choice:
            case "begin":
                arm.command, self.pending = "work", "out"
            case "wider":
                arm.width = (arm.width + 1) % 10
            case "put_away":
                hand.command, self.pending = "stow", "home"
            case "let_rest":
                arm.command = hand.command = "rest"
        self.status = {"halt": "done", "put_away": "failed", "let_rest": self.status}.get(choice, "executing")
        self.answered = self.answered or (self.new and choice != "let_rest")
        for said in self.below.values():
            said.give()

    def shown(self) -> dict[str, Any]:
        """What the level's variables have."""
        values: dict[str, Any] = {
            "new_command": self.new, "answered": self.answered, "inc_command_seen": self.seen,
            "to_boss.status_report": self.status, "to_boss.why": self.why, "to_boss.inc_command_echo": self.seen,
            "phase": self.phase, "phase.next": self.pending,
        }  # fmt: skip
        for name, said in self.below.items():
            values |= dict(zip((f"{name}.command", f"{name}.status", f"{name}.why"), said.held, strict=True))
            values |= {
                f"to_{name}.inc_command": said.number, f"to_{name}.input_command": said.command, f"{name}.resting": said.resting,
            }  # fmt: skip
        return values | {"arm.late": self.below["arm"].late}


JOBS, STATUSES, WHY = (
    ("rest", "work", "stow"),
    ("done", "executing", "failed"),
    ("none", "broken", "silent", "begun_anew", "slow"),
)
CHOICES = ("nothing", "halt", "begin", "wider", "put_away", "let_rest")
echoes = st.sampled_from(["last", "last", "last", "before", "other"])
reported = st.tuples(echoes, st.sampled_from(JOBS), st.sampled_from(STATUSES), st.sampled_from(WHY))
a_cycle = st.tuples(st.booleans(), st.sampled_from(JOBS), reported, reported, st.sampled_from(CHOICES))
idle = st.tuples(st.just(False), st.just("rest"), reported, reported, st.sampled_from(["nothing", "halt"]))
runs = st.lists(st.tuples(a_cycle, idle, st.integers(0, 4)), min_size=4, max_size=12)
"""Cycles each of which is followed by some in which the level gives no new order, as what waits for an echo does."""


BOUNDS = {
    "within 2 cycles else silent": (2, None),
    "within 2 cycles else silent answered within 4 cycles else slow": (2, 4),
    "answered within 3 cycles else slow": (None, 3),
}
"""Cycles in which the arm has to echo, and to answer."""


@settings(max_examples=80)
@given(runs, st.sampled_from([0, 0, 65534]), st.sampled_from([*BOUNDS]))
def test_a_level_that_declares_its_neighbours_keeps_the_protocol_of_the_paper(
    drawn: list[tuple[Any, Any, int]], begun: int, bounds: str
) -> None:
    cycles = [one for first, then, often in drawn for one in (first, *[then] * often)]
    made = program(LEVEL.replace("within 2 cycles else silent", bounds))
    kinds = {str(v.name): v.type for v in made.variables}
    by_hand = Level({"arm": Said(*BOUNDS[bounds]), "hand": Said(None)})
    now, number = initial(made), 0
    for name, said in by_hand.below.items():  # numbers near the end wrap
        said.number = now[f"to_{name}.inc_command"] = now[f"from_{name}.inc_command_echo"] = begun
    for new, job, arm, hand, choice in cycles:
        number = (number + new) % 65536
        reports = {}
        for name, (echo, *told) in (("arm", arm), ("hand", hand)):
            last = by_hand.below[name].number
            echoed = {"last": last, "before": (last - 1) % 65536, "other": (last + 7) % 65536}[echo]
            reports[name] = (echoed, *told)
            now |= {f"from_{name}.inc_command_echo": echoed}
            for part, word in zip(("ref_command_echo", "status_report", "why"), told, strict=True):
                leaf = f"from_{name}.{part}"
                now[leaf] = member(kinds[leaf], word)
        now |= {
            "boss.inc_command": number,
            "boss.input_command": JOBS.index(job),
            "choice": CHOICES.index(choice),
        }
        outcome = cycle(made, made.levels[0], now)
        assert outcome.fault is Fault.OK
        now = dict(outcome.snapshot)
        by_hand.cycle((number, job), reports, choice)
        shown = by_hand.shown()
        assert {name: spell(kinds[name], now[name]) for name in shown} == {
            name: value if isinstance(value, str) else spell(kinds[name], value)
            for name, value in shown.items()
        }


def test_streams_are_neither_numbered_nor_held() -> None:
    made = program(LEVEL)
    assert made.roles is not None
    arm, _ = made.roles.subordinates
    assert "to_arm.seen_mm" not in arm.numbered
    assert [*map(str, arm.numbered)] == ["to_arm.input_command", "to_arm.width_mm"]
    assert not [v.name for v in made.variables if v.name in {"arm.at_mm", "last_arm.seen_mm"}]


def test_what_a_level_adopts_that_starts_anew_is_declared() -> None:
    made = program(LEVEL)
    assert made.restart is not None
    assert dict(made.restart) == {
        "inc_command_seen": SameAs("boss.inc_command"),
        "to_boss.status_report": Fixed(2),
        **dict.fromkeys(("to_boss.inc_command_echo", "to_boss.ref_command_echo"), Stands()),
        "to_boss.why": Fixed(3),
        "to_arm.input_command": Fixed(0),
        "to_arm.inc_command": After("from_arm.inc_command_echo"),
        "to_hand.input_command": Fixed(0),
        "to_hand.inc_command": After("from_hand.inc_command_echo"),
        "phase": Fixed(1),
        "phase.next": Fixed(1),
    }


LEVEL_BY = "level cell {{ table by {} {{ rest : work  work : work  stow : work }} }}"


@pytest.mark.parametrize(
    ("was", "now", "code", "help_"),
    [
        ("commands arm : jobs", "commands arm : works", "RCS201", "links are `jobs`"),
        ("within 2 cycles", "within 2", "RCS101", "`within 25 cycles`"),
        ("within 2 cycles", "within 80 [ms]", "RCS101", "`within 25 cycles`"),
        ("within 2 cycles", "within 80 [ms] cycles", "RCS302", "write how many cycles"),
        ("cycles else silent", "cycles else none", "RCS301", "name another member of the reason"),
        (" within 2 cycles else silent", " else silent", "RCS101", "`within 25 cycles else REASON`"),
        (" within 2 cycles else silent", ", hand : jobs", "RCS101", "`commands NAME : LINK`"),
        ("command : job rest rest", "command : job pause rest", "RCS101", "`command : TYPE rest MEMBER`"),
        ("done done failed failed executing executing", "done done failed failed", "RCS101", "executing MEMBER"),
        ("  order { width_mm", "  width_mm", "RCS101", "stands in `order { NAME : TYPE }`"),
        ("commands hand : jobs\n", "", "RCS201", "`commands hand : LINK`, or `serves hand : LINK`, makes it"),
        ("  | none  | nothing  || look ", "  | none  | nothing  || work(3) ", "RCS201", "says to whom: `arm := work(FIELD := VALUE)`"),
        ("to_arm.seen_mm := ", "arm.seen_mm := ", "RCS201", "`arm := COMMAND(seen_mm := VALUE)`"),
        ("to_arm.seen_mm := ", "arm.status := ", "RCS206", "`arm := COMMAND` orders"),
        ("to_arm.seen_mm := ", "to_arm.inc_command := ", "RCS206", "numbers the same order anew"),
        ("to_arm.seen_mm := ", "to_boss.inc_command_echo := ", "RCS206", "follows from the commands"),
        ("level cell { table work }", LEVEL_BY.format("boss"), "RCS301", "write `boss.input_command`"),
        ("level cell { table work }", LEVEL_BY.format("boss.command"), "RCS201", "did you mean `input_command`?"),
        ("| line  | choice   |", "| line  | resting  |", "RCS201", "write `arm.resting`"),
        ("| line  | choice   |", "| line  | hand.late |", "RCS201", "`commands hand : LINK within 25 cycles` makes it"),
        ("| status_out |", "| elbow |", "RCS201", "`commands elbow : LINK` declares it"),
        ("serves boss : jobs", "serves boss : jobs serves chief : jobs", "RCS202", "one superior"),
    ],
)  # fmt: skip
def test_whoever_declares_it_for_the_first_time_is_told_what_to_write(
    was: str, now: str, code: str, help_: str
) -> None:
    text = LEVEL.replace(was, now, 1)
    assert text != LEVEL
    diagnostics = compile_text(text)
    assert isinstance(diagnostics, tuple)
    told = [" ".join(one.help) for one in diagnostics if one.code.value == code]
    assert any(help_ in text for text in told), diagnostics


def test_a_level_with_the_name_of_its_table_is_told_who_shares_names() -> None:
    """What one writes first, and again."""
    diagnostics = compile_text(
        "input a : bool\ntable t {\n | line | a ||\n | x | ||\n}\nlevel t { table t }\n"
    )
    assert isinstance(diagnostics, tuple)
    [found] = [one for one in diagnostics if one.code.value == "RCS202"]
    assert found.help == ("give one of them another name: no two have the same among tables and levels",)


@pytest.mark.parametrize("name", ["arm", "boss"])
def test_a_neighbour_is_declared_once(name: str) -> None:
    diagnostics = compile_text(LEVEL.replace("commands hand", f"commands {name}"))
    assert isinstance(diagnostics, tuple)
    assert [(one.code.value, one.message) for one in diagnostics] == [
        ("RCS202", f"`{name}` is declared twice")
    ]


def test_what_is_done_has_not_failed() -> None:
    diagnostics = compile_text(LEVEL.replace("failed failed", "failed done"))
    assert isinstance(diagnostics, tuple)
    assert "cannot mean two things" in diagnostics[0].message


def test_a_bound_is_a_number_as_any_other() -> None:
    padded = program(LEVEL.replace("within 2 cycles", "within 0_2 cycles"))
    assert [(v.name, v.type) for v in padded.variables] == [
        (v.name, v.type) for v in program(LEVEL).variables
    ]
    assert isinstance(compile_text(LEVEL.replace("within 2 cycles", f"within {'9' * 5000} cycles")), tuple)


def test_the_echo_may_be_bounded_after_the_answer() -> None:
    swapped = LEVEL.replace(
        "within 2 cycles else silent", "answered within 9 cycles else slow within 2 cycles else silent"
    )
    plain = LEVEL.replace(
        "within 2 cycles else silent", "within 2 cycles else silent answered within 9 cycles else slow"
    )
    assert program(swapped).procedures == program(plain).procedures


# --- orders with fields ---

ORDERS = (
    WORDS
    + """
enum choice { wait, cell, action, called, once, several }
commands arm : jobs
commands hand : jobs
input choice : choice
input wanted : int 0 .. 9 [mm]
procedure far(arm : int 0 .. 9 [mm]) { hand := work(width_mm := arm) }
procedure anew { if choice = called { arm := work(again) } }
table t {
  | line | choice  || procedures                                       | arm                                        |
  |------|---------||--------------------------------------------------|--------------------------------------------|
  | 1    | wait    ||                                                  | rest                                       |
  | 2    | cell    ||                                                  | work(width_mm := wanted, seen_mm := 3) |
  | 3    | action  || arm := stow; hand := rest                        |                                            |
  | 4    | called  || far(4 [mm]); anew                                     |                                            |
  | 5    | once    ||                                                  | stow(again)                                |
  | 6    | several || hand := work; hand := stow(width_mm := 2, again) | stow(again)                                |
}
level l { table t }
"""
)
"""`far` has a parameter that is called as a subordinate is."""


@dataclass
class Ordering:
    """The level of `ORDERS`, cycle by cycle."""

    made: Program = field(default_factory=lambda: program(ORDERS))
    now: dict[str, Any] = field(default_factory=dict)

    def cycle(self, choice: str, *, echoes: str = "arm hand", wanted: int = 7) -> "Ordering":
        """One more; those that echo do so of their last order."""
        self.now = self.now or dict(initial(self.made))
        for name in echoes.split():
            self.now[f"from_{name}.inc_command_echo"] = self.now[f"to_{name}.inc_command"]
        words = "wait cell action called once several".split()
        given = {"choice": words.index(choice), "wanted": wanted}
        outcome = cycle(self.made, self.made.levels[0], self.now | given)
        assert outcome.fault is Fault.OK
        self.now = dict(outcome.snapshot)
        return self

    def order(self, name: str) -> tuple[int, str, int]:
        number, command, width = (
            self.now[f"to_{name}.{part}"] for part in ("inc_command", "input_command", "width_mm")
        )
        return number, JOBS[command], width


def test_an_order_gives_the_command_and_the_fields_that_it_names_and_keeps_the_others() -> None:
    level = Ordering()
    assert level.cycle("cell").order("arm") == (1, "work", 7)
    assert level.now["to_arm.seen_mm"] == 3
    assert level.cycle("action").order("arm") == (2, "stow", 7)
    assert level.cycle("called").order("hand") == (1, "work", 4)
    assert level.order("arm") == (3, "work", 7)
    assert level.now["to_arm.seen_mm"] == 3
    assert level.cycle("wait").order("arm") == (4, "rest", 7)


def test_on_one_path_the_last_order_counts() -> None:
    assert Ordering().cycle("several").order("hand") == (1, "stow", 2)


def test_the_same_order_comes_once_more_when_every_last_order_is_echoed() -> None:
    level = Ordering().cycle("once").cycle("once")
    assert level.order("arm") == (2, "stow", 0)
    assert level.cycle("once", echoes="").order("arm") == (2, "stow", 0)
    assert level.cycle("action").order("arm") == (2, "stow", 0)  # what did not count is not made up for
    assert level.cycle("several").order("arm") == (3, "stow", 0)
    assert level.cycle("several", echoes="arm").order("arm") == (3, "stow", 0)  # the hand has not echoed
    assert level.cycle("several").order("arm") == (4, "stow", 0)


@pytest.mark.parametrize(
    ("was", "now", "code", "message"),
    [
        ("stow(again) ", "stw(again) ", "RCS201", "called `stw`"),
        ("width_mm := 2", "width := 2", "RCS201", "no field is called `width`"),
        ("width_mm := 2", "inc_command := 2", "RCS206", "the protocol writes `inc_command`"),
        ("width_mm := 2", "width_mm := 2, width_mm := 3", "RCS202", "`width_mm` is given twice"),
        ("width_mm := 2", "width_mm := true", "RCS301", "`true`, which is bool"),
        ("hand := work;", "hnad := work(again);", "RCS201", "no variable is called `hnad`"),
        ("choice = called", "choice = called(again)", "RCS301", "is an order, not a value"),
        ("hand := work;", "next hand := work;", "RCS", ""),
        ("commands hand : jobs", "state hand : job", "RCS301", "is an order, not a value"),
        ("if choice", "local hand : job := work(again) if choice", "RCS301", "is an order, not a value"),
    ],
)
def test_what_is_wrong_with_an_order_is_said_where_it_stands(
    was: str, now: str, code: str, message: str
) -> None:
    text = ORDERS.replace(was, now, 1)
    assert text != ORDERS
    diagnostics = compile_text(text)
    assert isinstance(diagnostics, tuple)
    assert any(one.code.value.startswith(code) and message in one.message for one in diagnostics), diagnostics
    assert all(one.primary.span.file == "case.rcs" and one.primary.span.end > 0 for one in diagnostics)


@pytest.mark.parametrize("cell", ["work(3)", "work()", "work(width_mm = 3)"])
def test_an_order_whose_fields_have_no_names_is_told_how_they_are_written(cell: str) -> None:
    diagnostics = compile_text(ORDERS.replace("stow(again)  ", cell, 1))
    assert isinstance(diagnostics, tuple)
    assert any("names its fields: `work(FIELD := VALUE)`" in one.help[0] for one in diagnostics)


# --- which state goes with which orders ---

STEPS = (
    WORDS
    + """
serves boss : jobs
commands arm : jobs
enum phase { home, reaching, lost }
state phase : phase = home restart lost deferred
procedure phase(p : phase) { next phase := p }
procedure may_break(hard : bool) {
  if hard {
    to_arm.input_command := stow
    phase(lost)
  }
}
table reach {
  | line   | new_command | arm.resting | phase    | arm.command | arm.status || procedures      | arm  | status_out |
  |--------|-------------|-------------|----------|-------------|------------||-----------------|------|------------|
  | settle | true        | false       |          |             |            || settle          |      |            |
  | begin  | true        | true        |          |             |            || phase(reaching) | work | executing  |
LINES
}
level cell { table reach }
"""
)

END = """  | there  | false       |             | reaching | work        | done       || phase(home)     | rest | done       |
  | on     | false       |             | reaching | work        | executing  ||                 |      | executing  |
  | broken | false       |             | reaching | work        | failed     || phase(lost)     | rest | failed     |
  | home   | false       |             | home     |             |            ||                 |      | done       |
  | lost   | false       |             | lost     |             |            ||                 |      | failed     |"""


def sees(lines: str) -> set[tuple[str, str]]:
    """The phases and commands that the table is offered to see, once a command is answered."""
    made = program(STEPS.replace("LINES", lines))
    offered = {one.name: one for one in made.assumptions}[AssumptionName("reach_in_step")]
    assert offered.standing is Standing.MONITORED
    assert offered.name in made.tables[0].assumptions
    now = initial(made) | {"new_command": False}
    return {
        (phase, job)
        for at, phase in enumerate(("home", "reaching", "lost"))
        for number, job in enumerate(JOBS)
        if holds(offered.condition, now | {"phase": at, "arm.command": number})
    }


BEGINS = {("home", "rest"), ("lost", "rest")}
"""With which the level begins, first or anew."""


@pytest.mark.parametrize(
    ("lines", "seen"),
    [
        (END, {*BEGINS, ("reaching", "work")}),
        (END.replace("phase(lost)     | rest", "may_break(true) |     "), {*BEGINS, ("reaching", "work"), ("lost", "stow")}),
        (END.replace("phase(lost)     | rest", "may_break(false)| rest"), {*BEGINS, ("reaching", "work"), ("reaching", "rest")}),
        (END.replace("                 | rest |", "                 |      |"), {*BEGINS, ("reaching", "work")}),
        # a line that answers and leaves the state: whatever is pending then comes
        (END + "\n  | again | true | true | lost | | ||  | stow | executing |", {
            *BEGINS, ("reaching", "work"), ("home", "stow"), ("reaching", "stow"), ("lost", "stow")}),
    ],
)  # fmt: skip
def test_a_table_is_offered_which_state_goes_with_which_order(lines: str, seen: set[tuple[str, str]]) -> None:
    assert sees(lines) == seen


def test_a_line_that_waits_for_its_echo_leaves_what_the_answer_set() -> None:
    """It looks at `answered`: what the table sees is what it is without the line."""
    before = STEPS.replace("new_command | arm.resting", "new_command | answered | arm.resting")
    before = before.replace("|-------------|-------------|", "|-------------|----------|-------------|", 1)
    before = before.replace("| true        | false       |", "| true        | false    | false       |")
    before = before.replace("| true        | true        |", "| true        | false    | true        |")
    wait = "  | wait | true | true | | | | || | | |\n"
    made = program(
        before.replace("LINES", wait + END.replace("| false       |", "| false       |          |"))
    )
    offered = {one.name: one for one in made.assumptions}[AssumptionName("reach_in_step")]
    now = initial(made) | {"new_command": False}
    seen = {
        (phase, job)
        for at, phase in enumerate(("home", "reaching", "lost"))
        for number, job in enumerate(JOBS)
        if holds(offered.condition, now | {"phase": at, "arm.command": number})
    }
    assert seen == {*BEGINS, ("reaching", "work")}


def test_an_assumption_of_ones_own_takes_the_place_of_the_one_offered() -> None:
    own = "assume reach_in_step monitored : new_command or phase /= lost\n"
    made = program(own + STEPS.replace("LINES", END))
    assert [*map(str, made.tables[0].assumptions)] == ["reach_resting"]


def test_standard_properties_are_switched_off_by_name_or_by_ones_own() -> None:
    plain = {one.name for one in program(LEVEL).properties}
    assert plain == {"done_stays", "failed_stays", "done_without_reason", "rests_when_told"}
    without = LEVEL.replace("serves boss : jobs", "serves boss : jobs without done_stays, rests_when_told")
    assert {one.name for one in program(without).properties} == plain - {"done_stays", "rests_when_told"}
    own = program("property done_stays : not new_command or true\n" + LEVEL).properties
    assert [one.text for one in own if one.name == "done_stays"] == ["not new_command or true"]


TOP = """
commands arm : jobs
table t {
  | line | when || arm  |
  |------|------||------|
  | all  | true || work |
}
level l { table t }
"""


def test_levels_without_a_superior_and_without_subordinates_are_levels() -> None:
    made = program(WORDS + TOP)
    assert made.roles is not None
    assert made.roles.superior is None
    assert "new_command" not in {str(v.name) for v in made.variables}
    alone = (
        WORDS
        + "serves boss : jobs\ntable t {\n| line | when || status_out |\n|--|--||--|\n| all | true || done |\n}\nlevel l { table t }"
    )
    now = initial(program(alone)) | {"boss.inc_command": 7, "boss.input_command": 1}
    first = cycle(program(alone), program(alone).levels[0], now).snapshot
    assert (first["new_command"], first["to_boss.inc_command_echo"], first["to_boss.ref_command_echo"]) == (
        True,
        7,
        1,
    )
    assert not cycle(program(alone), program(alone).levels[0], first).snapshot["new_command"]


@pytest.mark.parametrize(
    ("was", "now", "code", "message"),
    [
        ("serves boss : jobs", "serves boss : job", "RCS201", "no link is called `job`"),
        ("rest rest", "rest done", "RCS201", "no member of `job` is called `done`"),
        ("command : job rest rest", "command : job rest work", "RCS301", "not the first member"),
        ("done done failed", "done executing failed", "RCS301", "not the first member"),
        ("command : job rest", "command : jobb rest", "RCS201", "no enumeration is called `jobb`"),
        ("else silent", "else silence", "RCS201", "no reason is called `silence`"),
        ("  report { reason why", "  report { why", "RCS301", "no `reason`"),
        ("reason why : why restart begun_anew", "reason why : bool", "RCS301", "needs an enumeration"),
        (
            "order { width_mm",
            "order { input_command : bool  width_mm",
            "RCS301",
            "makes `input_command` itself",
        ),
        (
            "serves boss : jobs",
            "serves boss : jobs without done_stay",
            "RCS201",
            "no standard property is called `done_stay`",
        ),
        ("serves boss : jobs", "serves boss : jobs\nserves other : jobs", "RCS202", "one superior"),
        ("serves boss : jobs", "serves boss : jobs\nstate new_command : bool", "RCS202", "`new_command`"),
        ("within 2 cycles", "within 0 cycles", "RCS301", "at least one cycle"),
        ("else silent", "answered within 0 cycles", "RCS301", "an answer takes at least one cycle"),
        (
            "else silent",
            "answered within 2 cycles",
            "RCS301",
            "answered within 2 cycles, and echoed within 2",
        ),
        (
            "else silent",
            "else silent answered within 9 cycles else slower",
            "RCS201",
            "no reason is called `slower`",
        ),
        ("phase : phase restart out", "phase : phase restart elsewhere", "RCS201", "elsewhere"),
        ("input choice : choice", "input choice : choice restart halt", "RCS301", "is an input"),
        ("reason why : why restart begun_anew", "reason why : why restart rest", "RCS301", "expected `why`"),
        ("level cell", "adopt choice := halt\nlevel cell", "RCS301", "adopts nothing"),
        ("level cell", "adopt to_arm := 1\nlevel cell", "RCS301", "record"),
        ("level cell", "adopt phase := halt\nlevel cell", "RCS301", "expected `phase`"),
        (
            "level cell",
            "adopt to_arm.width_mm after boss.inc_command\nlevel cell",
            "RCS301",
            "of its own type",
        ),
        (
            "level cell",
            "adopt to_arm.width_mm after last_arm.width_mm\nlevel cell",
            "RCS301",
            "of its own type",
        ),
        (
            "level cell",
            "input taken : int 0 .. 9\noutput shot : int 0 .. 9\nadopt shot after taken\nlevel cell",
            "RCS301",
            "`shot` is no `int 0 .. 65535`",
        ),
    ],
)
def test_what_is_wrong_with_a_declaration_is_said_where_it_stands(
    was: str, now: str, code: str, message: str
) -> None:
    text = LEVEL.replace(was, now, 1)
    assert text != LEVEL
    diagnostics = compile_text(text)
    assert isinstance(diagnostics, tuple)
    assert any(one.code.value == code and message in one.message for one in diagnostics), diagnostics
    assert all(one.primary.span.file == "case.rcs" for one in diagnostics)
