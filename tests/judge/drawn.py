"""Draws small levels: inputs that may be refused, timers, arrays, divisions, singles, restarts, and what is required and assumed of them.

In: a seed. Out: a text. Each part is there or not, so that most levels have few states and every two parts meet.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from random import Random

_TABLE = """\
table t {{
  | line | n | a | b || o | s | n |
  |------|---|---|---||---|---|---|
{lines}
}}
level solo {{ period 10 [ms] preprocess work table t }}
"""
_SCOPES = ("", "", "", "while {}, ", "unless {}, ", "before {}, ", "after {}, ", "from {} until {}, ", "between {} and {}, ",
           "only while {}, ", "only before {}, ", "only after {}, ")  # fmt: skip
_TRIGGERS = ("", "when {}, ", "when {}, ", "whenever {}, ", "whenever {}, ")
_TIMINGS = ("at once {}", "next {}", "always {}", "never {}", "eventually {}", "eventually {}", "at last {}", "within {t}, {}",
           "for {t}, {}", "exactly after {t}, {}", "until {}, {}", "before {}, ({})")  # fmt: skip
_COUNTS = (
    "at most {k} times in {t}, {}",
    "at least {t} apart, {}",
    "on for at least {t}, {}",
    "off for at least {t}, {}",
)
_ENDLESS = ("", "after", "only before")
_ASSUMED = (
    "at least {t} apart, {}", "at most {k} times in {t}, {}", "on for at least {t}, {}", "off for at least {t}, {}",
    "whenever {o}, within {t}, {}",
    "when {o}, within {t}, {}", "always {} or {o}", "never {} and {o}", "whenever was {}, at once not {}", "while {o}, never {}",
    "only after {}, {}", "when {}, for {t}, {}", "whenever {}, next {}", "after {o}, always {} or {}", "from {} until {}, within {t}, {}",
    "between {o} and {}, never {} and {}", "when {o}, exactly after {t}, {}", "unless {o}, always {} or {}", "when {}, until {o}, {}",
    "whenever {} for {t}, at once {}", "always {} since {} or not {}", "when {}, before {}, ({} or {o})",
)  # fmt: skip
_SUMS = (
    "min(k + 1, 3)",
    "max(k - 1, 0)",
    "(k + n) mod 4",
    "abs(k - n)",
    "(k * n + 1) mod 4",
    "min(k + int(a), 3)",
    "min(k * k, 3)",
    "count(a, b, s)",
    "n",
)
_DIVIDED = (
    "(k + 4) / (n + 2)",
    "n mod (k + 1)",
    "7 / (k + 2)",
    "abs((n - k) mod 3) + 1",
    "min((n * 5 - k) / 3 + 1, 3)",
    "9 mod (n + 1)",
)
_SINGLES = (
    "min(f + 0.5, 1.0)",
    "max(f - 0.25, 0.0)",
    "1.0 - f",
    "min(single(n) / 2.0, 1.0)",
    "f * 0.5",
    "min(f + 0.1, 1.0)",
)


@dataclass
class Drawn:
    """A level in the making.

    Attributes:
        parts: The kinds of its parts; `most`, how many.
        outside: Conditions on inputs; `inside`, on what it keeps.
    """

    random: Random
    most: int
    parts: set[str] = field(default_factory=set)
    declared: list[str] = field(default_factory=list)
    body: list[str] = field(default_factory=list)
    outside: list[str] = field(default_factory=lambda: ["a", "b", "not a", "a and not b", "a or b"])
    inside: list[str] = field(
        default_factory=lambda: [
            "s",
            "o",
            "n = 1",
            "n = 3",
            "n >= 2",
            "n = 0",
            "not s",
            "not o",
            "s and n > 0",
        ]
    )

    def has(self, part: str, chance: float) -> bool:
        """Draw whether it has a part."""
        there = len(self.parts) < self.most and self.random.random() < chance
        self.parts |= {part} if there else set()
        return there

    def begun(self, low: int, high: int) -> str:
        """Draw a first value, and one after a restart."""
        first = f" = {self.random.randint(low, high)}" if self.random.random() < 0.3 else ""
        return first + (f" restart {self.random.randint(low, high)}" if self.has("restart", 0.15) else "")

    def looked_at(self) -> str:
        """Draw a condition of the preprocess."""
        return self.random.choice(("a", "b", "s", "n > 0", "n = 2", "a and not s", "w", "true"))


def drawn(seed: int) -> str:
    """Draw a level."""
    return made(seed)[0]


def made(seed: int) -> tuple[str, frozenset[str]]:
    """Draw a level; return its text, and the kinds of its parts."""
    random = Random(seed)  # noqa: S311  # repeatable on purpose
    it = Drawn(random, random.choice((1, 2, 2, 3, 4)))
    it.has("assumed", 0.35)
    it.declared += [
        "input a : bool",
        "input b : bool",
        f"state n : int 0 .. 3{it.begun(0, 3)}",
        "state s : bool",
        f"output o : bool{_safe(it)}",
    ]
    reads, writes = _states(it)
    head = f"module work reads {', '.join(reads)} writes {', '.join(writes)} {{"
    module = "\n".join([head, *(f"  {line}" for line in it.body), "}"])
    said = list(_assumed(it)) + list(_required(it))
    text = "\n".join([*it.declared, *said, module, _TABLE.format(lines="\n".join(_lines(it)))])
    return text, frozenset(it.parts)


# --- states -----------------------------------------------------------------------------------


def _safe(it: Drawn) -> str:
    """Draw a value that the output shows where a cycle is refused."""
    return f" safe {it.random.choice(('true', 'false'))}" if it.has("safe", 0.15) else ""


def _states(it: Drawn) -> tuple[list[str], list[str]]:
    """Draw more states and inputs, and the statements of the preprocess; return what that reads and writes."""
    random = it.random
    reads, writes = ["a", "b", "n", "s"], ["w"]
    it.declared.append("state w : bool")
    it.body.append(
        f"w := {random.choice(('a', 's', 'a and b', 'not w', 'n > 1', 'was s', '@T(a)', 'b xor s'))}"
    )
    reads.append("w")
    it.inside += ["w", "not w"]
    if it.has("input", 0.25):
        admits = random.choice(("", " reject", " clamp"))
        it.declared.append(f"input c : int 0 .. 2{admits}")
        it.parts.add("clamped" if admits == " clamp" else "refused")
        it.outside += ["c = 1", "c > 1", "c /= 0", "c > was c", "c = n"]
        reads.append("c")
    if it.has("arithmetic", 0.3):
        it.declared.append(f"state k : int 0 .. 3{it.begun(0, 3)}")
        sums = _DIVIDED if it.has("division", 0.5) else _SUMS
        it.body.append(f"if {it.looked_at()} {{ k := {random.choice(sums)} }}")
        reads.append("k")
        writes.append("k")
        it.inside += ["k = n", "k > was k", "k /= 2", "k + n > 3", "n mod (k + 1) = 0"]
    if it.has("array", 0.2):
        it.declared.append("state v : array[2] of int 0 .. 2")
        it.body.append(
            f"v[n mod 2] := {random.choice(('min(v[0] + 1, 2)', 'v[1]', '2 - v[n / 2]', 'n mod 3'))}"
        )
        reads.append("v")
        writes.append("v")
        it.inside += ["v[0] = v[1]", "v[n mod 2] > 0", "v[0] + v[1] = 3"]
    if it.has("single", 0.12):
        it.declared.append("state f : single 0.0 .. 1.0")
        it.body.append(f"if {it.looked_at()} {{ f := {random.choice(_SINGLES)} }}")
        reads.append("f")
        writes.append("f")
        it.inside += ["f > 0.6", "f = 0.5", "f >= was f"]
    if it.has("enumeration", 0.2):
        it.declared = ["enum colour { red, green, blue }", *it.declared, "state m : colour"]
        it.body.append("case m { red { m := green } green { if b { m := blue } } blue { m := red } }")
        reads += ["m"]
        writes += ["m"]
        it.inside += ["m = blue", "m in {red, green}"]
    if it.has("timer", 0.25):
        held = f"{random.choice(('a', 'b', 's', '(n > 0)'))} for {random.choice(('2 cycles', '10 [ms]'))}"
        it.body.append(f"if {held} {{ w := {random.choice(('true', 'false'))} }}")
    if it.has("deferred", 0.08):
        it.declared.append("state d : bool deferred until a")
        it.body.append("next d := s")
        reads.append("d")
        writes.append("d")
        it.inside += ["d"]
    return reads, writes


def _lines(it: Drawn) -> Iterator[str]:
    """Draw the lines: of each number one or two, which may look at an input."""
    random = it.random
    for n in range(4):
        column = random.choice(("a", "b", "", "", ""))
        for cell in ("true", "false") if column else ("",):
            a, b = (cell if name == column else "" for name in "ab")
            to = random.choice((f"{(n + 1) % 4}",) * 4 + (f"{n}", f"{random.randrange(4)}"))
            s, o = (random.choice(("true", "false", "a", "b", "s", "w")) for _ in range(2))
            yield f"  | l{n}{cell} | {n} | {a} | {b} || {o} | {s} | {to} |"


# --- what is said of it -------------------------------------------------------------------------


def _required(it: Drawn) -> Iterator[str]:
    conditions = [*it.inside, *it.outside]
    conditions += [
        "once a",
        "a since b",
        "s for 2 cycles",
        "a for 10 [ms]",
        "was s",
        "n > was n",
        "@T(b)",
        "was (once s)",
        "o and was o",
    ]
    for at in range(3):
        yield f"requirement r{at} : {_filled(it, _says(it.random), lambda: it.random.choice(conditions))}"
    if it.has("property", 0.3):
        yield f"property p : {it.random.choice(('n < 3', 's implies was n < 3', 'o or n > 0 or s', 'w implies n < 3', 'not (s and o)'))}"


def _says(random: Random) -> str:
    if random.random() < 0.15:
        return random.choice([one for one in _SCOPES if "only" not in one]) + random.choice(_COUNTS)
    scope, timing = random.choice(_SCOPES), random.choice(_TIMINGS)
    if timing.startswith("at last") and scope.split("{")[0].strip() in _ENDLESS:
        timing = "always {}"
    if random.random() < 0.08 and "only" not in scope:
        return scope + "only after {}, ({})"
    return scope + random.choice(_TRIGGERS) + timing


def _assumed(it: Drawn) -> Iterator[str]:
    if "assumed" not in it.parts:
        return
    for at in range(it.random.choice((1, 1, 2))):
        says = it.random.choice(_ASSUMED)
        while "{o}" in says:
            says = says.replace("{o}", _closed(it.random.choice(it.inside)), 1)
        yield f"assume e{at} assumed : {_filled(it, says, lambda: it.random.choice(it.outside))}"


def _filled(it: Drawn, says: str, condition: Callable[[], str]) -> str:
    times = (f"{it.random.randint(1, 3)} cycles", f"{it.random.randint(1, 3)}0 [ms]")
    says = says.replace("{t}", it.random.choice(times)).replace("{k}", str(it.random.randint(1, 2)))
    while "{}" in says:
        says = says.replace("{}", _closed(condition()), 1)
    return says


def _closed(condition: str) -> str:
    """Return a condition in parentheses, where it needs some."""
    return condition if condition.isalpha() else f"({condition})"
