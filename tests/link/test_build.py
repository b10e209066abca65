"""A user builds the C of a system: by CMake, by pkg-config, as one unit, for a Cortex-M; what the guide shows does what it says."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from rcsc.code.testing.boards import BOARDS
from tests.support.programs.stages import STRICT

GUIDE = Path(__file__).parents[2] / "tables/guide/README.md"
PRINTED = "status 0 at 640 mm\n"


def shown(language: str) -> str:
    """The text in a language that the guide shows of a system's C."""
    page = GUIDE.read_text(encoding="utf-8").partition("## The C of a system\n")[2]
    [text] = re.findall(rf"^```{language}\n(.*?)^```", page, re.DOTALL | re.MULTILINE)
    return str(text)


@pytest.fixture
def robot(dock: Path) -> Path:
    """The docking robot with the guide's `main.c`."""
    (dock / "main.c").write_text(shown("c"), encoding="utf-8")
    return dock


def sh(folder: Path, script: str) -> str:
    """What a script prints, which must end well."""
    ran = subprocess.run(["sh", "-eu", "-c", script], cwd=folder, capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    return ran.stdout


def test_main_is_short() -> None:
    assert len(shown("c").splitlines()) <= 25
    assert f"prints `{PRINTED.strip()}`" in GUIDE.read_text(encoding="utf-8")


@pytest.mark.needs("cmake")
def test_by_cmake(robot: Path) -> None:
    """As shown; then with the levels included, too."""
    text = shown("cmake")
    (robot / "CMakeLists.txt").write_text(text, encoding="utf-8")
    assert sh(robot, "cmake -S . -B b > log && cmake --build b > log && b/robot") == PRINTED
    text = text.replace("include(", "include(generated/c/drive.cmake)\ninclude(")
    text = text.replace("add_exec", "include(generated/c/supervisor.cmake)\nadd_exec")
    (robot / "CMakeLists.txt").write_text(text.replace("robot dock", "robot drive dock"), encoding="utf-8")
    sh(robot, "cmake --build b > log && b/robot")


@pytest.mark.needs("pkg-config")
@pytest.mark.parametrize(
    "build",
    [
        "cc main.c $(pkg-config --cflags dock) $(pkg-config --variable=sources dock) -o robot",
        """cc $(pkg-config --cflags dock) -c $(pkg-config --variable=sources dock)
        ar rcs generated/c/libdock.a dock.o drive.o supervisor.o
        cc main.c $(pkg-config --cflags --libs dock) -o robot""",
    ],
    ids=["sources", "library"],
)
def test_by_pkg_config(build: str, robot: Path) -> None:
    compiler = f"cc {' '.join(STRICT)} "
    script = f"export PKG_CONFIG_PATH=generated/c\npkg-config --validate drive supervisor\n{build.replace('cc ', compiler)}\n./robot"
    assert sh(robot, script) == PRINTED


@pytest.mark.parametrize("cc", ["gcc", pytest.param("clang", marks=pytest.mark.needs("clang"))])
def test_as_one_unit_and_from_cpp(cc: str, robot: Path) -> None:
    sources = ("drive", "supervisor", "dock")
    (robot / "unit.c").write_text("".join(f'#include "{name}.c"\n' for name in sources) + shown("c"))
    sh(robot, f"{cc} {' '.join(STRICT)} -Igenerated/c unit.c -o unit && ./unit")
    (robot / "use.cpp").write_text(
        '#include "dock.h"\nint main() { dock_t s; dock_init(&s); return dock_step(&s); }\n'
    )
    sh(robot, f"{cc} -xc++ -std=c++17 -Wall -Wextra -Werror -Igenerated/c -fsyntax-only use.cpp")


START = """extern void _start(void);
__attribute__((section(".vectors"), used)) const void *const vectors[2] = {(const void *)0x20400000, (const void *)_start};
"""
"""The first two words of a Cortex-M's memory; the rest is newlib's."""


@pytest.mark.needs("arm-none-eabi-gcc", "qemu-system-arm")
def test_on_a_cortex_m(robot: Path) -> None:
    """With the same warnings; the emulator runs it to its end, with no other memory than the state."""
    board = next(board for board in BOARDS if board.name == "Cortex-M3")
    (robot / "start.c").write_text(START)
    (robot / "unit.c").write_text(
        "".join(f'#include "{name}.c"\n' for name in ("drive", "supervisor", "dock"))
    )
    arm = f"{' '.join(board.compiler)} -O2 -ffp-contract=off --specs=rdimon.specs"
    places = "-Wl,--section-start=.vectors=0,-Tdata=0x20000000,--no-warn-rwx-segments"
    built = f"{arm} {' '.join(STRICT)} -Igenerated/c -c unit.c main.c\n{arm} {places} -o robot.elf unit.o main.o start.c"
    assert sh(robot, f"{built}\n{' '.join(board.emulator)} -kernel robot.elf") == PRINTED
    used = set(re.findall(r"U (\w+)", sh(robot, "arm-none-eabi-nm unit.o")))
    assert used <= {"memcpy", "memset", "__aeabi_uldivmod"}


def test_the_shipped_system_is_one_unit_too(repo: Path, tmp_path: Path) -> None:
    """Its levels ask the database: functions that are declared, and that the user writes."""
    names = ("emove", "gripper", "primitive", "task", "vision", "nbs_robot")
    (tmp_path / "unit.c").write_text("".join(f'#include "{name}.c"\n' for name in names))
    cc = shutil.which("arm-none-eabi-gcc") or "cc"
    sh(tmp_path, f"{cc} {' '.join(STRICT)} -I{repo / 'generated/c'} -ffp-contract=off -c unit.c")
