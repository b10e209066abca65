"""What is generated: names that clash with words of C and Python, texts that try to become code, the same bytes every time."""

import ast
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

import jinja2
import pytest

from rcsc.emit.environment import environment
from rcsc.emit.names import C_WORDS, PYTHON_WORDS
from rcsc.resolve import compile_text
from tests.emitted import EXTERN, RICH, emitted, program_of

STRICT = ("-std=c99", "-Wall", "-Wextra", "-Wconversion", "-Wpedantic", "-Wtrigraphs", "-Wshadow", "-Werror")
KEYWORDS = frozenset("""input state output table level procedure module owner extern enum record type unit const use assume
    invariant property was then reads writes python c bool int real true false and or not implies in mod abs min max if else case for next
    local call array of period preprocess postprocess by reject clamp deferred until assumed monitored proved
    assuming""".split())  # fmt: skip


def compiled(files: dict[str, str], folder: Path, *more: str, flags: tuple[str, ...] = STRICT) -> Path:
    """The object of the emitted C."""
    for name, text in files.items():
        (folder / Path(name).name).write_text(text, encoding="utf-8")
    [source] = folder.glob("*.c")
    compiler = shutil.which("cc")
    assert compiler is not None
    made = subprocess.run(
        [compiler, *flags, *more, "-c", source.name, "-o", "made.o"],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    assert made.returncode == 0, made.stderr
    return folder / "made.o"


def imported(files: dict[str, str]) -> ModuleType:
    """The emitted Python as a module."""
    [text] = [text for name, text in files.items() if name.endswith(".py")]
    module = ModuleType("emitted")
    exec(compile(text, "emitted.py", "exec"), module.__dict__)  # noqa: S102  # generated here
    return module


def all_named(name: str) -> str:
    """A program with one of each of what is emitted, whose names begin with `name`."""
    return f"""
input {name} : bool
state {name}_next : {name}_kind = {name}_a deferred until {name}
output {name}_2 : int 0 .. 9
enum {name}_kind {{ {name}_a, {name}_b }}
procedure {name}_p {{ {name}_2 := 3; next {name}_next := {name}_b }}
table {name}_t {{
  | line   | {name} || procedures |
  | {name} | true   || {name}_p   |
  | b      | false  ||            |
}}
level {name}_l {{ period 10 [ms] table {name}_t }}
"""


WORDS = sorted(
    word
    for word in (C_WORDS | PYTHON_WORDS) - KEYWORDS
    if word.isidentifier() and not (word.startswith("__") and word.endswith("__"))
)
TABLE = "{head}table t {{\n| line | a || procedures |\n| x | true || {done} |\n| y | false || |\n}}\n"
A = "input a : bool\n"


def table(done: str = "") -> str:
    """Two lines, of which the first does something."""
    return f"table t {{\n| line | a || procedures |\n| x | true || {done} |\n| y | false || |\n}}\n"


def several(form: str, words: list[str]) -> str:
    """The form once for each word, in place of `@`."""
    return "".join(form.replace("@", word) for word in words)


def with_parameters(words: list[str]) -> str:
    """Procedures with a parameter and a local."""
    pairs = list(zip(words, words[1:] + words[:1], strict=True))
    text = "".join(
        f"procedure p{at}({x} : int 0 .. 3) {{ local {y} : int 0 .. 6 := {x} + 1; o := {y} }}\n"
        for at, (x, y) in enumerate(pairs)
    )
    return A + "output o : int 0 .. 9\n" + text + table("; ".join(f"p{at}(2)" for at, _ in enumerate(pairs)))


def with_levels(words: list[str]) -> str:
    """Tables, and levels for them."""
    text = several("table @ {\n| line | a ||\n| x | ||\n}\n", words[::2])
    pairs = zip(words[1::2], words[::2], strict=False)
    return A + text + "".join(f"level {x} {{ period 10 [ms] table {t} }}\n" for x, t in pairs)


ROLES: dict[str, Callable[[list[str]], str]] = {
    "input": lambda w: A + several("input @ : int 0 .. 9\n", w) + table(),
    "deferred state": lambda w: (
        A + several("state @ : int 0 .. 9 deferred until a\n", w) + table(several("next @ := 3; ", w)[:-2])
    ),
    "enumeration": lambda w: A + several("enum @ { m_@ }\ninput v_@ : @\n", w) + table(),
    "member": lambda w: (
        f"enum e {{ {', '.join(w)} }}\ninput v : e\noutput o : e\n" + A + table(f"o := {w[-1]}")
    ),
    "record": lambda w: A + several("record @ { f : bool }\ninput v_@ : @\n", w) + table(),
    "field": lambda w: (
        A
        + f"record r {{ {several('@ : int 0 .. 9 ', w)} }}\noutput o : r\n"
        + table(several("o.@ := 3; ", w)[:-2])
    ),
    "procedure": lambda w: (
        A + "output o : int 0 .. 9\n" + several("procedure @ { o := 3 }\n", w) + table("; ".join(w))
    ),
    "parameter and local": with_parameters,
    "table and level": with_levels,
    "line": lambda w: (
        f"input a : int 0 .. {len(w) - 1}\ntable t {{\n| line | a ||\n"
        + "".join(f"| {x} | {at} ||\n" for at, x in enumerate(w))
        + "}\n"
    ),
}


@pytest.mark.parametrize("role", list(ROLES))
def test_words_of_either_language_may_be_names(role: str, tmp_path: Path) -> None:
    program = program_of(ROLES[role](WORDS))
    files = emitted(program)
    compiled(files, tmp_path, "-Wno-unused-parameter")
    module = imported(files)
    state = module.State()
    if hasattr(state, "a"):
        state.a = type(state.a)(1)
    for step in [value for key, value in vars(module).items() if key.endswith("_step")]:
        assert step(state) == 0
    assert len(WORDS) > 150


HOSTILE = [
    "*/ int evil(void) { return 1; } /*",
    '""" + __import__("os").system("true") + """',
    "''' evil ''' \\",
    "ends in a backslash \\",
    "trigraphs ??/ ??' ??( ??=",
    "a comment // /* \\u002a/ \\n",
    "{{ 7 * 7 }} {% for a in b %} {# c #}",
    "\u202e\u2066 right to left \u2028 separator \x85 next line",
    "sm\u043ell cyrillic, \u0130 and \u212a",
    "%s %d %n \x1b[31m",
]


@pytest.mark.parametrize("text", HOSTILE)
def test_texts_never_become_code(text: str, tmp_path: Path) -> None:
    plain = all_named("a")
    declares = ("input", "state", "output", "procedure", "table", "level")
    lines = plain.splitlines()
    said = "\n".join(f"## {text}\n{line}" if line.startswith(declares) else line for line in lines)
    program, bare = compile_text(said, f"{text}.rcs"), compile_text(plain, "case.rcs")
    if isinstance(program, tuple):
        assert all(d.code.value.startswith("RCS1") for d in program), program
        return
    files, without = emitted(program), emitted(bare) if not isinstance(bare, tuple) else {}
    for name, made in files.items():
        if name.endswith((".c", ".h", ".py")):
            assert made.isascii(), name
            assert "??" not in made
            assert not any(line.rstrip().endswith("\\") for line in made.splitlines())
    object_file = compiled(files, tmp_path)
    symbols = subprocess.run(
        ["nm", "--defined-only", str(object_file)], capture_output=True, text=True, check=True
    )
    assert not any(word.lstrip("_") == "evil" for word in symbols.stdout.split())
    tree, right = (
        ast.parse(next(t for n, t in some.items() if n.endswith(".py"))) for some in (files, without)
    )
    assert [type(node) for node in tree.body] == [type(node) for node in right.body]


def test_names_may_be_very_long(tmp_path: Path) -> None:
    name = "a" * 5000
    files = emitted(program_of(all_named(name)))
    compiled(files, tmp_path)
    for path in ("c/case_.h", "c/case_.c"):
        code = re.sub(r"/\*.*?\*/", "", files[path], flags=re.DOTALL)
        assert max(len(word) for word in re.findall(r"\w+", code)) < 256, path
    assert imported(files).State()


def test_names_that_differ_in_case_or_underscores_stay_apart(tmp_path: Path) -> None:
    text = """
input a : bool
input A : bool
input a_ : bool
input a__b : bool
record r { b : bool  b_ : bool }
input a_b : r
output int_ : int 0 .. 9
procedure p { int_ := 1 }
procedure P { int_ := 2 }
table t {
  | line | a || procedures |
  | 1 | true || p |
  | 2 | false || P |
}
table T {
  | line | A || procedures |
  | 1 | true || P |
  | 2 | false || p |
}
"""
    files = emitted(program_of(text))
    compiled(files, tmp_path)
    state = imported(files).State()
    assert len(set(state.__slots__)) == len(state.__slots__) == 7 + 4


USE = '#include "case_.h"\nint main() { case__t s; case__init(&s); return s.fault; }\n'


@pytest.mark.parametrize("text", [RICH, EXTERN], ids=["rich", "extern"])
@pytest.mark.parametrize(
    "flags", [("-O0",), ("-O2", "-fno-builtin"), ("-O3", "-ffreestanding")], ids=" ".join
)
def test_the_c_compiles_without_a_warning(text: str, flags: tuple[str, ...], tmp_path: Path) -> None:
    compiled(emitted(program_of(text)), tmp_path, *flags)


def test_the_header_is_one_for_cpp_too(tmp_path: Path) -> None:
    files = {n: USE if n.endswith(".c") else t for n, t in emitted(program_of(RICH)).items()}
    strict = tuple(flag for flag in STRICT if flag != "-std=c99")
    compiled(files, tmp_path, "-xc++", "-std=c++17", flags=strict)


def test_the_bytes_do_not_hang_on_the_hash_seed(repo: Path) -> None:
    script = (
        "import sys; from tests.emitted import *\n"
        "for text in (RICH, EXTERN):\n"
        "    for name, made in sorted(emitted(program_of(text)).items()): print(name, made)"
    )
    outs = {
        subprocess.run(
            [sys.executable, "-c", script],
            cwd=repo,
            env={**os.environ, "PYTHONHASHSEED": seed},
            capture_output=True,
            check=True,
        ).stdout
        for seed in ("0", "1", "1984")
    }
    assert len(outs) == 1
    assert len(outs.pop()) > 10_000


def test_a_template_that_misspells_an_attribute_fails() -> None:
    @dataclass(frozen=True)
    class View:
        program: str = "p"

    template = environment().from_string("{{ plan.program }} {{ plan.progam }}")
    with pytest.raises(jinja2.UndefinedError):
        template.render(plan=View())


MAIN = """#include "task.h"
int main(void) { task_t s; task_init(&s); return (int)task_task_cycle(&s); }
"""
CMAKE = """cmake_minimum_required(VERSION 3.13)
project(app C)
include({here}/task.cmake)
add_executable(app app.c)
target_link_libraries(app task)
"""


@pytest.mark.needs("pkg-config")
def test_a_user_links_it_by_pkg_config(repo: Path, tmp_path: Path) -> None:
    shutil.copytree(repo / "generated/c", tmp_path / "c")
    (tmp_path / "app.c").write_text(MAIN)
    script = (
        "export PKG_CONFIG_PATH=c\n"
        "cc -O2 -c c/task.c -o task.o && ar rcs c/libtask.a task.o\n"
        "cc app.c $(pkg-config --cflags --libs task) -o app\n"
        "./app"
    )
    subprocess.run(["sh", "-eu", "-c", script], cwd=tmp_path, check=True)


@pytest.mark.needs("cmake")
def test_a_user_links_it_by_cmake(repo: Path, tmp_path: Path) -> None:
    (tmp_path / "app.c").write_text(MAIN)
    (tmp_path / "CMakeLists.txt").write_text(CMAKE.format(here=repo / "generated/c"))
    subprocess.run(["cmake", "-S", ".", "-B", "b"], cwd=tmp_path, check=True, capture_output=True)
    subprocess.run(["cmake", "--build", "b"], cwd=tmp_path, check=True, capture_output=True)
    subprocess.run(["b/app"], cwd=tmp_path, check=True)
