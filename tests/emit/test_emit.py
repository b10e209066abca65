"""What is generated: names that clash with words of C and Python, texts that try to become code, the same bytes every time."""

import ast
import builtins
import json
import keyword
import os
import platform
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from enum import EnumType, IntEnum
from itertools import product
from pathlib import Path
from random import Random
from types import ModuleType

import jinja2
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rcsc.base.diagnostics.codes import Code
from rcsc.base.host.files.read import CheckedFields, json_of
from rcsc.base.host.tools import Absent
from rcsc.code.emit.generated import write
from rcsc.code.emit.identifiers import C_WORDS, PYTHON_WORDS, comment
from rcsc.code.emit.rendering import environment
from rcsc.code.testing.cortex import CortexRun, run_cortex
from rcsc.code.testing.executors.externs import python_stand_ins
from rcsc.code.testing.executors.symbols import symbols_of
from rcsc.lang import reserved
from rcsc.lang.interpret import Fault, initial, run_table
from rcsc.lang.operator_table import single
from rcsc.lang.resolve import compile_text
from rcsc.run.signature import generated_files, signature_of
from tests.support.programs.examples import EXTERN, RICH
from tests.support.programs.stages import emitted, program_of
from tests.support.programs.texts import edited, table

STRICT = ("-std=c99", "-Wall", "-Wextra", "-Wconversion", "-Wpedantic", "-Wtrigraphs", "-Wshadow", "-Werror")
KEYWORDS = frozenset("""input state output table level procedure module owner extern enum record type unit const use assume
    invariant property was then reads writes python c bool int real true false and or xor not implies in mod abs min max if else case for
    next local call array of period preprocess postprocess by reject clamp deferred until assumed monitored proved
    assuming""".split())  # fmt: skip


COMPILERS = ["gcc", pytest.param("clang", marks=pytest.mark.needs("clang"))]


def compiled(
    files: dict[str, str], folder: Path, *more: str, flags: tuple[str, ...] = STRICT, cc: str = "cc"
) -> Path:
    """The object of the emitted C."""
    for name, text in files.items():
        (folder / Path(name).name).write_text(text, encoding="utf-8")
    [source] = folder.glob("*.c")
    compiler = shutil.which(cc)
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


def one_table(done: str = "") -> str:
    """Two lines, of which the first does something."""
    return table("t", "line | a || procedures", f"x | true || {done}", "y | false || ")


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
    return (
        A + "output o : int 0 .. 9\n" + text + one_table("; ".join(f"p{at}(2)" for at, _ in enumerate(pairs)))
    )


def with_levels(words: list[str]) -> str:
    text = several("table @ {\n| line | a ||\n| x | ||\n}\n", words[::2])
    pairs = zip(words[1::2], words[::2], strict=False)
    return A + text + "".join(f"level {x} {{ period 10 [ms] table {t} }}\n" for x, t in pairs)


ROLES: dict[str, Callable[[list[str]], str]] = {
    "input": lambda w: A + several("input @ : int 0 .. 9\n", w) + one_table(),
    "deferred state": lambda w: (
        A
        + several("state @ : int 0 .. 9 deferred until a\n", w)
        + one_table(several("next @ := 3; ", w)[:-2])
    ),
    "enumeration": lambda w: A + several("enum @ { m_@ }\ninput v_@ : @\n", w) + one_table(),
    "member": lambda w: (
        f"enum e {{ {', '.join(w)} }}\ninput v : e\noutput o : e\n" + A + one_table(f"o := {w[-1]}")
    ),
    "record": lambda w: A + several("record @ { f : bool }\ninput v_@ : @\n", w) + one_table(),
    "field": lambda w: (
        A
        + f"record r {{ {several('@ : int 0 .. 9 ', w)} }}\noutput o : r\n"
        + one_table(several("o.@ := 3; ", w)[:-2])
    ),
    "procedure": lambda w: (
        A + "output o : int 0 .. 9\n" + several("procedure @ { o := 3 }\n", w) + one_table("; ".join(w))
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
    compiled(files, tmp_path)
    module = imported(files)
    state = module.State()
    if hasattr(state, "a"):
        state.a = type(state.a)(1)
    for step in [value for key, value in vars(module).items() if key.endswith("_step")]:
        assert step(state) == 0
    assert len(WORDS) > 150


CLASHES = """
enum a { b_c, B_C, mro, name, value, _x, x_x, __class__, _missing_, print, print_, None, real, E, e }
enum a_b { c, C }
enum State { one }
enum IntEnum { s1 }
enum tuple { t }
enum do_x { z }
enum check { ok, foreign }
enum DIGEST { DIGEST }
enum _do_x { z }
record init { int : bool  int_ : bool  errno : bool  EOF : int 0 .. 3  EOF_ : int 0 .. 3  x : bool  X : bool }
record x_line { f : array[2] of array[3] of init }
input line_ : bool
input line : bool
input fault : int 0 .. 3
input digest : bool
input assumptions_failed : bool
input copy_in : a
input copy_out : a_b
input of_state : State
input of_enum : IntEnum
input of_tuple : tuple
input of_do : do_x
input of_do_2 : _do_x
input big_f : x_line
input big : array[2] of array[2] of bool
input big_0_1 : bool
state late : bool deferred until line
state late_next : bool
input self : bool
input i0 : bool
input INT_MAX : bool
input linux : bool
input __slots__ : bool
procedure x_t { late_next := true }
procedure cycle { late_next := late_next }
procedure never_run(errno : bool) { late_next := max(1, 2) = 2 }
{tables}
level m { period 10 table x }
level init { period 10 table by copy_out { c : do  C : run_x } }
"""
CLASHING_TABLES = tuple("do run_x x_1 x X line run bit32 x_line step _x x_ K0_1 k0_1".split())


def clashes() -> str:
    """Names that are made the same by a prefix, a suffix, a case, an index, or what the executors call their own."""
    rows = "| line | line || procedures |\n| 0 | true || cycle |\n| x | false || x_t |\n"
    tables = "".join(f"table {name} {{\n{rows}}}\n" for name in CLASHING_TABLES)
    return edited(CLASHES, ("{tables}", tables))


@pytest.mark.parametrize("cc", COMPILERS)
def test_names_that_would_be_spelled_alike_stay_apart(cc: str, tmp_path: Path) -> None:
    program = program_of(clashes())
    files = emitted(program)
    compiled(files, tmp_path, cc=cc)
    module = imported(files)
    state = module.State()
    assert len(set(state.__slots__)) == len(state.__slots__) == len(program.variables) + 5
    for enum in program.enums:
        members = [value.__members__ for value in vars(module).values() if made_of(value, len(enum.members))]
        assert any(list(map(int, found.values())) == list(range(len(enum.members))) for found in members)
    symbols = json.loads(files["c/case.json"])
    ours = [table["step"] for table in symbols["tables"]] + [level["cycle"] for level in symbols["levels"]]
    assert len(set(ours)) == len(CLASHING_TABLES) + 2
    for name in ours:
        state = module.State()
        assert getattr(module, name.removeprefix("case__"))(state) == 0
        assert state.line == 1


def made_of(value: object, members: int) -> bool:
    """Whether it is a class of an enumeration with so many members."""
    return isinstance(value, EnumType) and len(value.__members__) == members


LONE = """
input a : bool
enum err { except, file_no }
input e : err
enum all { except }
input f : all
table t {
  | line | a     ||
  | x    | true  ||
  | y    | false ||
}
level l { period 10 table t }
"""
KEPT = ("div", "time", "sem", "stdint", "enum", "bisect", "signal", "pthread", "mtx", "c", "test", "case", "Time", "fe", "sig",
        "posix", "abs", "linux", "errno", "I", "class", "match", "atomic", "int", "size", "clean", "std", "stdbool")  # fmt: skip
HEADERS = "".join(f"#include <{name}.h>\n" for name in
                  ("errno fenv float inttypes limits math pthread semaphore signal stdatomic stdio stdlib string threads time unistd "
                   "complex setjmp sys/types sys/socket").split())  # fmt: skip


def test_a_program_may_be_called_as_a_library_s_part_is(tmp_path: Path) -> None:
    includes, inits, sources, modules = HEADERS, "", [], []
    for name in KEPT:
        program = program_of(LONE, f"{name}.rcs")
        files = emitted(program)
        said = json.loads(files[f"c/{name}.json"])
        assert said["header"].removesuffix(".h").lower() not in reserved.C_HEADERS | reserved.PYTHON_MODULES
        for path, text in files.items():
            (tmp_path / Path(path).name).write_text(text, encoding="utf-8")
        includes += f'#include "{said["header"]}"\n'
        inits += f"{{ {said['struct']} s; {said['init']}(&s); if (s.fault != 0) return 1; }}\n"
        sources.append(said["source"])
        modules.append(said["python"]["module"].removesuffix(".py"))
    (tmp_path / "run.c").write_text(f"{includes}int main(void) {{ {inits} return 0; }}\n")
    flags = ("-std=gnu11", "-O0", "-Wall", "-Werror", "-I.")
    subprocess.run(["cc", *flags, "run.c", *sources, "-o", "run"], cwd=tmp_path, check=True)
    assert subprocess.run([tmp_path / "run"], check=False).returncode == 0
    script = "".join(f"import {module} as m; assert m.l_cycle(m.State()) == 0\n" for module in modules)
    subprocess.run([sys.executable, "-c", script], cwd=tmp_path, check=True)


def test_reserved_words_are_at_least_those_of_the_tools_here() -> None:
    plain = {name for name in dir(builtins) if not name.startswith("_")}
    assert plain <= reserved.PYTHON_BUILTINS
    assert {*keyword.kwlist, *keyword.softkwlist} - {"_"} <= reserved.PYTHON_KEYWORDS
    assert {name for name in sys.stdlib_module_names if not name.startswith("_")} <= reserved.PYTHON_MODULES
    assert {name for name in dir(IntEnum) if not name.startswith("_")} <= reserved.PYTHON_MEMBERS
    ran = subprocess.run(
        ["cc", "-E", "-dM", "-std=gnu11", "-"], input=HEADERS, capture_output=True, text=True, check=True
    )
    macros = re.findall(r"^#define ([A-Za-z]\w*) ", ran.stdout, flags=re.MULTILINE)
    assert len(macros) > 500
    for (
        name
    ) in macros:  # a word in capitals never stands alone, and a word after a capital family ends in `_`
        kept = name in reserved.C_MACROS | reserved.C_KEYWORDS or name.isupper()
        assert (
            kept or name.split("_")[0].upper() in reserved.C_FAMILIES or re.match("PRI|SCN|atomic_", name)
        ), name
        assert name.isupper() is False or name.count("_") < 2 or name.split("_")[0] in reserved.C_FAMILIES, (
            name
        )


@given(st.text(st.sampled_from("*/\\?\"'$%{}#:= \n\r\x1bcodinguprs-é\u2028"), max_size=30))
def test_what_stands_in_a_comment_means_nothing(text: str) -> None:
    said = comment(text)
    assert said.isascii()
    assert said.isprintable()
    assert not re.search(r'\*/|/\*|//|\\|\?\?|"|\$\{|coding[:=]|-suppress', said)


CONSTANTS = (0, 1, -1, 5, 127, 128, -128, -129, 255, 256, 32768, 65535, 2**31, 2**32, 2**63 - 1, 2**63, 2**64 - 1,
             -(2**63))  # fmt: skip
RANGES = ("0 .. 255", "3 .. 140", "-5 .. 95", "-128 .. 127", "0 .. 65535", "-70000 .. 9", "0 .. 4294967295",
          "-9223372036854775808 .. 9223372036854775807", "0 .. 18446744073709551615", "7 .. 7")  # fmt: skip


def one_type_holds(values: str, constant: int) -> bool:
    """Whether one type of 64 bits holds the range and the constant."""
    low, high = (int(end) for end in values.split(" .. "))
    return min(low, constant) >= 0 or max(high, constant) < 2**63


def compared() -> str:
    """Every kind of integer against every constant that its C type can and cannot hold, and against itself."""
    kinds = [f"x{at} : int {one}" for at, one in enumerate(RANGES)] + ["b : bool", "e : only"]
    body = [f"o := x{at} {op} {constant}" for at, one in enumerate(RANGES) for constant in CONSTANTS
            for op in ("<", "<=", "=", ">", ">=", "/=") if one_type_holds(one, constant)]  # fmt: skip
    body += [f"o := x{at} {divided} {op} {constant}" for at, one in enumerate(RANGES) for constant in (-129, -8, 0, 200, 70000)
             for divided in ("/ 2", "/ 300", "mod 7", "/ -3") for op in ("<", "<=", "=", ">", ">=", "/=")
             if one_type_holds(one, min(constant, -3 if "-" in divided else 0))]  # fmt: skip
    body += [f"o := {x} {op} {x}" for x in ("x1", "x8", "b", "e") for op in ("=", "/=")]
    body += [f"o := x{at} in {{3, 300, 70000}} o := x{at} in 2 .. 300" for at, _ in enumerate(RANGES)]
    body += ["b2 := b2", "e2 := e2", "if x8 + 1 >= 0 { o := true }"]
    body += ["for i in 9223372036854775809 .. 9223372036854775810 { o := i >= 0 }"]
    text = "enum only { one }\n" + "".join(f"input {kind}\n" for kind in kinds)
    text += "output o : bool\nstate b2 : bool\nstate e2 : only\n"
    text += "".join(f"procedure p{at} {{ {one} }}\n" for at, one in enumerate(body))
    calls = "; ".join(f"p{at}" for at, _ in enumerate(body))
    return text + f"table t {{\n| line | b || procedures |\n| x | x0 >= 0 || {calls} |\n}}\n".replace(
        "| b ||", "| when ||"
    )


@pytest.mark.parametrize("cc", COMPILERS)
def test_no_comparison_is_what_a_compiler_finds_idle(cc: str, tmp_path: Path) -> None:
    compiled(emitted(program_of(compared())), tmp_path, cc=cc)


GIVEN = [None, 3, 12, True, "3", 3.0, 3.5, (), (3,), (3, 4), (3, 12), (3, 4, 5), (None, 4), [3], {"n": 3}, ((3,),)]  # fmt: skip


@pytest.mark.parametrize("writes", ["", "writes n", "writes n, k"])
def test_whatever_an_extern_gives_the_executor_does_as_the_interpreter(
    writes: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    program = program_of(
        "input x : int 0 .. 9\nstate n : int 0 .. 9\nstate k : int 0 .. 9\noutput o : bool\n"
        f'extern procedure p reads x {writes} python "some_users:p" c "some_users_p"\n'
        "table t {\n| line | x || procedures | o |\n| a | || p | true |\n}\n"
    )
    users = ModuleType("some_users")
    monkeypatch.setitem(sys.modules, "some_users", users)
    made = imported(emitted(program))
    for one in GIVEN:
        users.__dict__["p"] = lambda *_, one=one: one
        state = made.State()
        fault = made.t_step(state)
        outcome = run_table(program, program.tables[0], initial(program))
        shown = {name: getattr(state, name) for name in ("n", "k", "o")}
        assert (fault, shown) == (outcome.fault, {name: outcome.snapshot[name] for name in shown}), one
        assert fault in ((Fault.OK,) if not writes else (Fault.OK, Fault.EXTERN))


@pytest.mark.parametrize(
    "about", list(product(("", "(k : int 0 .. 9)"), ("", "reads x"), ("", "writes n"))), ids=" ".join
)
def test_an_extern_uses_all_that_its_function_has_or_discards_it(
    about: tuple[str, ...], tmp_path: Path
) -> None:
    params, reads, writes = about
    call = "p(3)" if params else "p"
    text = (
        "input x : int 0 .. 9\nstate n : int 0 .. 9\n"
        f'extern procedure p{params} {reads} {writes} python "users:p" c "users_p"\n'
        f"table t {{\n| line | x || procedures |\n| a | > n || {call} |\n| b | <= n || |\n}}\n"
    )
    compiled(emitted(program_of(text)), tmp_path)


def test_what_externs_are_called_meets_nothing_of_ours(tmp_path: Path) -> None:
    text = """
record r { a_b : int 0 .. 9 }
input errno : int 0 .. 9
input a : r
output a_a_b : int 0 .. 9
output int : int 0 .. 9
"""
    modules = ("s", "given", "w0", "State", "IntEnum", "case_1", "time", "a.s")
    for at, module in enumerate(modules):
        text += f"""extern procedure p{at}(errno : int 0 .. 9, a_a_b : int 0 .. 9) reads a.a_b, errno, a_a_b writes a_a_b, int
          python "{module}:s" c "case__do_p{at}"\n"""
    calls = "; ".join(f"p{at}(1, 2)" for at, _ in enumerate(modules))
    text += f"table t {{\n| line | errno || procedures |\n| x | || {calls} |\n}}\n"
    program = program_of(text)
    files = emitted(program)
    compiled(files, tmp_path)
    with python_stand_ins(program) as stand_ins:
        made = stand_ins.load(files["python/case_.py"], "case_")
    assert made.t_step(made.State()) in (0, Fault.EXTERN)


def test_files_of_a_program_are_found_by_its_own_name(tmp_path: Path) -> None:
    for name in ("time", "plain"):
        program = program_of(LONE, f"{name}.rcs")
        files = emitted(program)
        write(files, str(tmp_path))
        found = generated_files(tmp_path, name)
        assert {path.read_text() for path in found} == {
            text for path, text in files.items() if not path.endswith((".cmake", ".pc", "_types.h"))
        }
    names = ["none.json", "none.c", "none.h", "none.py"]
    assert [path.name for path in generated_files(tmp_path, "none")] == names


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


@given(
    st.text(st.characters(codec="utf-8"), max_size=8),
    st.sampled_from([0, 1, 980, 999, 1000, 5000, 70_000]),
    st.sampled_from([0, 1, 990, 1200, 5000]),
)
def test_a_symbol_file_is_read_back_or_none_is_made(said: str, more: int, long: int) -> None:
    name = "n" * long
    text = f"record r{name} {{ f{name} : int 0 .. 9 }}\n## {said}{'word ' * more}\nstate s : array[2] of r{name}\n"
    program = compile_text(text + all_named(f"a{name}"), "case.rcs")
    if isinstance(program, tuple):
        assert {finding.code for finding in program} <= {
            Code.UNPRINTED,
            Code.NUL_BYTE,
            Code.LONG_NAME,
            Code.SYNTAX,
        }
        assert long >= 990 or not said.isprintable()
        return
    [made] = [text for name, text in emitted(program).items() if name.endswith(".json")]
    read = signature_of(CheckedFields(json_of(made)))
    assert [leaf.name for leaf in read.leaves] == [str(variable.name) for variable in program.variables]


def test_names_may_be_very_long(tmp_path: Path) -> None:
    name = "a" * 990
    files = emitted(program_of(all_named(name)))
    compiled(files, tmp_path)
    for path in ("c/case_.h", "c/case_.c"):
        code = re.sub(r"/\*.*?\*/", "", files[path], flags=re.DOTALL)
        assert max(len(word) for word in re.findall(r"\w+", code)) < 256, path
    assert imported(files).State()


USE = '#include "case_.h"\nint main() { case__t s; case__init(&s); return s.fault; }\n'


@pytest.mark.parametrize("text", [RICH, EXTERN], ids=["rich", "extern"])
@pytest.mark.parametrize("flags", [("-O2", "-fno-builtin"), ("-O3", "-ffreestanding")], ids=" ".join)
@pytest.mark.parametrize("cc", COMPILERS)
def test_the_c_compiles_without_a_warning(text: str, flags: tuple[str, ...], cc: str, tmp_path: Path) -> None:
    compiled(emitted(program_of(text)), tmp_path, *flags, cc=cc)


def test_the_header_is_one_for_cpp_too(tmp_path: Path) -> None:
    files = {n: USE if n.endswith(".c") else t for n, t in emitted(program_of(RICH)).items()}
    strict = tuple(flag for flag in STRICT if flag != "-std=c99")
    compiled(files, tmp_path, "-xc++", "-std=c++17", flags=strict)


def test_the_bytes_do_not_hang_on_the_hash_seed(repo: Path) -> None:
    script = (
        "from tests.support.programs.examples import EXTERN, RICH\n"
        "from tests.support.programs.stages import emitted, program_of\n"
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
        for seed in ("0", "1984")
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


SUMS = """
input x : real -10.0 .. 10.0
input y : real -10.0 .. 10.0
input z : real -100.0 .. 100.0
input tiny : real 0.0 .. 1.0
output o : bool
output r : array[6] of real -10000.0 .. 10000.0
procedure p {
  o := x * y + z = 0.0
  r[0] := x * y + z
  r[1] := x * y - z
  r[2] := z - x * y
  r[3] := (x + z) - x + z / 10.0
  r[4] := tiny * 0.5
  r[5] := 0.0
  for i in 0 .. 4 { r[5] := r[5] * x * 0.01 + y }
}
table t {
  | line | o || procedures |
  | a    |   || p          |
}
"""
DRIVER = """
#include <fenv.h>
#include <stdio.h>
#include "case_.h"
#if defined(__SSE2__)
#include <xmmintrin.h>
#define CHOOSE(how) ((how) < 4 ? (void)fesetround(modes[how]) : _mm_setcsr(_mm_getcsr() | ((how) == 4 ? 0x8000u : 0x0040u)))
#define WAYS 6
#else
#define CHOOSE(how) (void)fesetround(modes[how])
#define WAYS 4
#endif
static const int modes[4] = { FE_TONEAREST, FE_UPWARD, FE_DOWNWARD, FE_TOWARDZERO };
static const double given[][4] = { @VALUES@ };
int main(int argc, char **argv) {
  int how, at, n; (void)argv;
  for (how = 0; how < (argc > 1 ? WAYS : 1); how++) {
    for (at = 0; at < (int)(sizeof given / sizeof given[0]); at++) {
      case__t s; case__init(&s);
      s.x = given[at][0]; s.y = given[at][1]; s.z = given[at][2]; s.tiny = given[at][3];
      fesetround(FE_TONEAREST); CHOOSE(how);
      case__t_step(&s);
      fesetround(FE_TONEAREST);
#if defined(__SSE2__)
      _mm_setcsr(_mm_getcsr() & ~0x8040u);
#endif
      printf("%d %d %d", how, (int)s.fault, (int)s.o);
      for (n = 0; n < 6; n++) { printf(" %a", s.r[n]); }
      printf("\\n");
    }
  }
  return 0;
}
"""


def sums_of(word: str) -> str:
    """The sums with numbers of this type."""
    return SUMS.replace("real", word)


def drawn_reals(word: str) -> list[tuple[float, ...]]:
    """Products that cancel against a sum up to one rounding, and subnormal values."""
    if word == "single":
        doubles = drawn_reals("real")
        tiny = {5e-324: 2.0**-149, 3e-320: 1e-42, 1e-300: 1e-30}
        return [(*(single(value) for value in row[:3]), single(tiny[row[3]])) for row in doubles]
    rng = Random(7)  # noqa: S311  # repeatable on purpose
    found: list[tuple[float, ...]] = []
    for _ in range(60):
        x, y = rng.uniform(-10, 10), rng.uniform(-10, 10)
        found.append(
            (x, y, rng.choice((-x * y, x * y, rng.uniform(-100, 100))), rng.choice((5e-324, 3e-320, 1e-300)))
        )
    return found


def as_python_computes(values: list[tuple[float, ...]], files: dict[str, str]) -> list[list[str]]:
    """What the Python executor gives, as the driver prints it."""
    module, found = imported(files), []
    for x, y, z, tiny in values:
        state = module.State()
        state.x, state.y, state.z, state.tiny = x, y, z, tiny
        assert module.t_step(state) == 0
        reals = [getattr(state, f"r_{at}") for at in range(6)]
        found.append([str(int(state.o)), *(float(real).hex() for real in reals)])
    return found


OFTEN = ("-O0", "-O2", "-O3 -march=native", "-O3 -march=native -ffp-contract=fast")
OTHERWISE = ("-O2 -ffast-math", "-O1 -mfpmath=387", "-O2 -funsafe-math-optimizations -march=native")


@pytest.mark.parametrize("word", ["real", "single"])
@pytest.mark.parametrize("cc", COMPILERS)
def test_c_computes_reals_as_python_does_or_says_that_it_does_not(cc: str, word: str, tmp_path: Path) -> None:
    files = emitted(program_of(sums_of(word)))
    values = drawn_reals(word)
    compiled(files, tmp_path, "-march=native" if platform.machine() == "x86_64" else "-O2", cc=cc)
    rows = ", ".join("{ " + ", ".join(one.hex() for one in row) + " }" for row in values)
    (tmp_path / "main.c").write_text(edited(DRIVER, ("@VALUES@", rows)))
    right = as_python_computes(values, files)
    stopped = dict[str, set[int]]()
    for flags in (*OFTEN, *(OTHERWISE if platform.machine() == "x86_64" else ())):
        made = subprocess.run(
            [cc, "-std=gnu99", *flags.split(), "main.c", "case_.c", "-o", "run", "-lm"],
            cwd=tmp_path, capture_output=True, text=True, check=False,
        )  # fmt: skip
        if "387" in flags and made.returncode != 0:
            continue  # clang has no such option
        assert made.returncode == 0, made.stderr
        ran = subprocess.run([tmp_path / "run", "all"], capture_output=True, text=True, check=True)
        for number, line in enumerate(ran.stdout.splitlines()):
            way, fault, *found = line.split()
            stopped.setdefault(f"{flags} {way}", set()).add(int(fault))
            if int(fault) == 0:
                assert [found[0], *(float.fromhex(one).hex() for one in found[1:])] == right[
                    number % len(values)
                ], (flags, way)
    assert all(faults == {Fault.ARITHMETIC} for way, faults in stopped.items() if not way.endswith(" 0"))
    assert all(stopped[f"{flags} 0"] == {0} for flags in OFTEN[:3])
    if cc == "gcc":
        assert stopped[f"{OFTEN[3]} 0"] == {0}
    assert all(
        stopped.get(f"{flags} 0", {7}) == {7} for flags in OTHERWISE[:2] if f"{OTHERWISE[0]} 0" in stopped
    )


@pytest.mark.needs("arm-none-eabi-gcc", "qemu-system-arm")
@pytest.mark.parametrize("word", ["real", "single"])
def test_reals_are_the_same_on_a_processor_without_them(word: str) -> None:
    text = edited(sums_of(word), ("| o ||", "| n ||"), ("|   || p", "| < 90 || p"))
    text = "input n : int 0 .. 255\n" + edited(
        text, ("| p          |\n", "| p          |\n| b | >= 90 || p |\n")
    )
    program = program_of(text)
    files = emitted(program)
    ran = run_cortex(program, symbols_of(program, files), files, 0)
    assert isinstance(ran, CortexRun), ran
    assert (ran.differ, ran.steps) == (0, 256)


@pytest.mark.needs("arm-none-eabi-gcc", "qemu-system-arm")
def test_the_emulated_target_is_not_asked_what_its_reference_cannot_compute() -> None:
    """Its reference has no integers of more than 64 bits, and would call right C wrong."""
    rows = "| line | n || o |\n| a | < 5 || true |\n| b | >= 5 || false |"
    program = program_of(f"input n : int 0 .. {2**64 - 1}\noutput o : bool\ntable t {{\n{rows}\n}}\n")
    files = emitted(program)
    assert isinstance(run_cortex(program, symbols_of(program, files), files, 0), Absent)


def test_only_programs_with_reals_test_the_arithmetic() -> None:
    assert "case__exact" in emitted(program_of(SUMS))["c/case_.c"]
    assert "case__exact" not in emitted(program_of(all_named("a")))["c/case_.c"]
    divided = "input n : int 0 .. 9\ninput m : int 0 .. 9\ntable t {\n| line | when ||\n| a | real(n) / 3.0 < real(m) ||\n}\n"
    assert "case__exact" in emitted(program_of(divided))["c/case_.c"]
