"""Plays vectors on C with slips, and judges the slips that no vector notices.

In: the C, its slips, a C file of vectors. Out: which slips are noticed; of the others, which are shown to change nothing. All slips
are compiled at once: each place is chosen by a number when it runs, and each slip runs in a process of its own.
"""

import subprocess
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from rcsc.base.host.tools import write_c
from rcsc.code.testing.coverage.harness import word_of
from rcsc.code.testing.executors.edges import leaf_edges
from rcsc.code.testing.executors.symbols import Symbols
from rcsc.lang.model import Program, value_of_key
from tests.slips.drawn import Slip
from tests.slips.text import HEAD, as_gcc_sees_it

FLAGS = ("-std=gnu11", "-w", "-O1", "-fwrapv", "-ffp-contract=off", "-DVECTORS_NO_MAIN")
LONGEST_S = 3
MAIN = """
#include <stdio.h>
#include <stdlib.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>
int main(int argc, char **argv)
{{
    /* one line for each slip: 0 where every vector passes, else the number of the first that does not; -1 where it stops */
    for (int at = 1; at < argc || at <= {count}; at++) {{
        const int number = (argc > 1) ? ((at < argc) ? atoi(argv[at]) : 0) : at;
        if (number == 0) {{ break; }}
        int ends[2];
        if (pipe(ends) != 0) {{ return 2; }}
        const pid_t child = fork();
        if (child == 0) {{
            int first = 0;
            const struct itimerval most = {{{{0, 0}}, {{{longest}, 0}}}}; /* of processor time: a busy machine ends nothing */
            setitimer(ITIMER_PROF, &most, NULL);
            rcsc_slip = number;
            for (uint32_t n = 0u; (n < vectors_count()) && (first == 0); n++) {{
                first = (vectors_play(n) != 0) ? (int)n + 1 : 0;
            }}
            if (write(ends[1], &first, sizeof first) < 0) {{ _exit(3); }}
            _exit(0);
        }}
        int first = -1;
        close(ends[1]);
        if (read(ends[0], &first, sizeof first) != (ssize_t)sizeof first) {{ first = -1; }}
        close(ends[0]);
        waitpid(child, NULL, 0);
        printf("%d\\n", first);
        fflush(stdout);
    }}
    return 0;
}}
"""
SEARCH = """
#include <stdio.h>
#include <stdlib.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>
typedef struct {{ uint16_t leaf; uint16_t count; const uint64_t *words; }} edge_t;
{edges}
static uint64_t seed = 1u;
static uint32_t any(uint32_t n) {{ seed = seed * UINT64_C(6364136223846793005) + 1442695040888963407u; return (uint32_t)(seed >> 33) % n; }}
static int differs(const {struct} *from, uint16_t function, int number)
{{
    static {struct} one, other;
    int32_t told, other_told;
    memcpy(&one, from, sizeof one);
    memcpy(&other, from, sizeof other);
    rcsc_slip = 0;
    told = call(&one, function);
    rcsc_slip = number;
    other_told = call(&other, function);
    rcsc_slip = 0;
    if (told != other_told) {{ return 1; }}
    if (traced(function) && !{trace}) {{ return 1; }}
    for (uint16_t leaf = 0u; leaf < LEAVES; leaf++) {{
        if (get(&one, leaf) != get(&other, leaf)) {{ return 1; }}
    }}
    return 0;
}}
int main(int argc, char **argv)
{{
    const long tries = atol(argv[1]);
    for (int at = 2; at < argc; at++) {{
        const int number = atoi(argv[at]);
        const pid_t child = fork();
        if (child == 0) {{
            static {struct} s;
            const struct itimerval most = {{{{0, 0}}, {{60, 0}}}};
            setitimer(ITIMER_PROF, &most, NULL);
            for (long n = 0; n < tries; n++) {{
                const vector_t *const v = &vectors[any(vectors_count())];
                const change_t *const change = &changes[v->first];
                if (v->answers != 0u) {{ continue; }}
                memset(&s, 0, sizeof s);
                for (uint16_t leaf = 0u; leaf < LEAVES; leaf++) {{ put(&s, leaf, initial[leaf]); }}
                put(&s, LEAVES, {digest}u);
                for (uint16_t i = 0u; i < v->sets; i++) {{ if (change[i].leaf < LEAVES) {{ put(&s, change[i].leaf, change[i].word); }} }}
                for (uint32_t i = any(6u); i > 0u; i--) {{
                    const edge_t *const e = &edges[any(LEAVES)];
                    put(&s, e->leaf, e->words[any(e->count)]);
                }}
                if ({check}(&s) != -1) {{ continue; }}
                if (differs(&s, v->function, number)) {{ _exit(1); }}
                if (differs(&s, (uint16_t)({first_run}u + any({runs}u)), number)) {{ _exit(1); }}
            }}
            _exit(0);
        }}
        int status = 0;
        waitpid(child, &status, 0);
        printf("%d\\n", WIFEXITED(status) ? WEXITSTATUS(status) : 1);
        fflush(stdout);
    }}
    return 0;
}}
"""


def with_slips(text: str, slips: Sequence[Slip]) -> str:
    """Return the C with every slip in it; `rcsc_slip` chooses by the number of a slip, from 1."""
    values: dict[tuple[int, int], list[int]] = {}
    statements: dict[tuple[int, int], list[int]] = {}
    for at, slip in enumerate(slips):
        (values if slip.of_value else statements).setdefault(slip.whole, []).append(at)
        if slip.lost is not None:
            statements.setdefault(slip.lost, []).append(at)
    before: dict[int, list[tuple[int, str]]] = {}
    after: dict[int, list[tuple[int, str]]] = {}

    def around(start: int, end: int, head: str, tail: str) -> None:
        before.setdefault(start, []).append((-end, head))
        after.setdefault(end, []).append((-start, tail))

    for (start, end), numbers in values.items():
        ways = [f"(rcsc_slip == {at + 1}) ? ({_edited(text, slips[at], start, end)}) : " for at in numbers]
        around(start, end, f"({''.join(ways)}(", "))")
    for (start, end), numbers in statements.items():
        ways = [
            f"if (rcsc_slip == {at + 1}) {{ {slips[at].new if slips[at].start == start else ';'} }} else "
            for at in numbers
        ]
        around(start, end, f"{''.join(ways)}{{ ", " }")
    first = HEAD.search(text)
    assert first is not None
    before.setdefault(first.start(), []).append((0, declarations(text)))
    parts, last = ["int rcsc_slip = 0;\n"], 0
    for at in sorted({*before, *after}):
        parts.append(text[last:at])
        parts += [tail for _, tail in sorted(after.get(at, ()))]
        parts += [head for _, head in sorted(before.get(at, ()))]
        last = at
    return "".join([*parts, text[last:]])


def declarations(text: str) -> str:
    """Return a declaration of each function, so that each may be called anywhere."""
    heads = (
        head[0].replace("RCSC_INLINE ", "").replace("inline ", "")
        for head in HEAD.finditer(as_gcc_sees_it(text))
    )
    return "".join(f"{head.rpartition(chr(10))[0]};\n" for head in heads)


def _edited(text: str, slip: Slip, start: int, end: int) -> str:
    return f"{text[start : slip.start]}{slip.new}{text[slip.end : end]}"


def mutant(text: str, slip: Slip) -> str:
    """Return the C with one slip."""
    return f"{text[: slip.start]}{slip.new}{text[slip.end :]}"


@dataclass(frozen=True, slots=True)
class Bench:
    """The C of a program with its slips, and its vectors, in a folder."""

    program: Program
    symbols: Symbols
    files: Mapping[str, str]
    slips: Sequence[Slip]
    vectors: str
    place: Path

    @property
    def text(self) -> str:
        """The C as it is."""
        return next(text for path, text in self.files.items() if path.endswith(f"/{self.symbols.source}"))

    def build(self, main: str, name: str) -> Path:
        """Compile the C with all slips, and a `main`."""
        write_c(self.files, self.place)
        (self.place / self.symbols.source).write_text(with_slips(self.text, self.slips), "utf-8")
        whole = f"{self.vectors}\nextern int rcsc_slip;\n{main}"
        (self.place / f"{name}.c").write_text(whole, "utf-8")
        command = ["gcc", *FLAGS, "-o", name, f"{name}.c", self.symbols.source]
        built = subprocess.run(command, cwd=self.place, capture_output=True, text=True, check=False)
        assert built.returncode == 0, built.stderr[:2000]
        return self.place / name

    def first_failing(self) -> list[int]:
        """Return for each slip the number of the first vector that notices it; 0 for none, -1 where it stops or does not end."""
        main = MAIN.format(count=len(self.slips), longest=LONGEST_S)
        ran = subprocess.run(
            [self.build(main, "play")], cwd=self.place, capture_output=True, text=True, check=True
        )
        return [int(line) for line in ran.stdout.split()]

    def told_apart(self, numbers: Sequence[int], tries: int) -> list[bool]:
        """Return of each of these slips whether some state that `check` accepts tells it apart, of so many that are drawn."""
        if not numbers:
            return []
        program = self.build(self._search(), "search")
        command = [str(program), str(tries), *map(str, numbers)]
        ran = subprocess.run(command, cwd=self.place, capture_output=True, text=True, check=True)
        return [line != "0" for line in ran.stdout.split()]

    def _search(self) -> str:
        program, symbols = self.program, self.symbols
        edges = leaf_edges(program)
        rows, table = [], []
        for at, variable in enumerate(program.variables):
            kind = variable.type
            words = {word_of(kind, value_of_key(kind, key)) for key in edges[variable.name]}
            values = ", ".join(f"UINT64_C({word:#x})" for word in sorted(words))
            rows.append(f"static const uint64_t e{at}[] = {{{values}}};")
            table.append(f"{{{at}u, {len(words)}u, e{at}}}")
        own = [f"(one.{path} == other.{path})" for path in symbols.failed]
        trace = " && ".join(
            [
                "((one.fault == other.fault) && (one.line == other.line) && (one.fault_at == other.fault_at)",
                *own,
            ]
        )
        tables, levels = len(program.tables), len(program.levels)
        return SEARCH.format(
            edges="\n".join([*rows, f"static const edge_t edges[] = {{{', '.join(table)}}};"]),
            struct=symbols.struct,
            trace=f"{trace})",
            digest=symbols.digest,
            check=symbols.check,
            first_run=2 + 2 * tables,
            runs=tables + levels,
        )

    def same_code(self, numbers: Sequence[int]) -> Iterator[int]:
        """Yield those of these slips of which the compiler makes the same code."""
        right = self._code(self.text)
        yield from (
            number for number in numbers if self._code(mutant(self.text, self.slips[number - 1])) == right
        )

    def _code(self, text: str) -> bytes:
        first = HEAD.search(text)
        assert first is not None
        whole = f"{text[: first.start()]}{declarations(text)}{text[first.start() :]}"
        (self.place / self.symbols.source).write_text(whole, "utf-8")
        command = ["gcc", "-std=c99", "-w", "-O2", "-S", "-o", "-", self.symbols.source]
        return subprocess.run(command, cwd=self.place, capture_output=True, check=False).stdout
