"""What those who integrate the C do with it: sections, prefixes, several instances and versions in one image, C++, an RTOS, bare metal."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from rcsc.front.commands import run
from tests.emit.c.test_layout import BELT, OTHER, edited

STRICT = ("-Wall", "-Wextra", "-Wconversion", "-Wsign-conversion", "-Wshadow", "-Wpedantic", "-Werror")


def project(folder: Path, prefix: str, text: str = BELT) -> Path:
    """A project of the belt's table, compiled: its folder of C."""
    folder.mkdir()
    (folder / "rcsc.toml").write_text(f'name = "belts"\nprefix = "{prefix}"\n', encoding="utf-8")
    (folder / "belt.rcs").write_text(text, encoding="utf-8")
    assert run(["compile", "-q", str(folder), "--out", str(folder / "generated")]) == 0
    return folder / "generated/c"


def sections(object_file: Path) -> set[str]:
    shown = subprocess.run(
        ["objdump", "-h", str(object_file)], capture_output=True, text=True, check=True
    ).stdout
    return set(re.findall(r"^ +\d+ (\S+) ", shown, re.MULTILINE))


def test_constant_tables_go_where_a_macro_says(repo: Path, tmp_path: Path) -> None:
    config = tmp_path / "placed.h"
    config.write_text('#define RCSC_CONST_SECTION __attribute__((section(".tables")))\n')
    ways = {
        "plain": (),
        "macro": ('-DRCSC_CONST_SECTION=__attribute__((section(".tables")))',),
        "header": (f'-DRCSC_CONFIG="{config}"',),
    }
    seen = {}
    for way, flags in ways.items():
        words = [
            "cc",
            "-std=c99",
            *STRICT,
            "-Os",
            "-fno-jump-tables",
            *flags,
            "-c",
            str(repo / "generated/c/task.c"),
            "-o",
            f"{way}.o",
        ]
        subprocess.run(words, cwd=tmp_path, check=True)
        seen[way] = sections(tmp_path / f"{way}.o")
    assert ".tables" in seen["macro"] & seen["header"] - seen["plain"]
    assert not any(name.startswith(".rodata") for name in seen["macro"] | seen["header"])


def test_two_versions_and_several_instances_in_one_image_of_cpp(tmp_path: Path) -> None:
    old, new = project(tmp_path / "old", "v1_"), project(tmp_path / "new", "v2_", edited(OTHER["a cell"]))
    assert {path.stem for path in old.glob("*.[ch]")} == {"v1_belt", "v1_belt_types"}
    (tmp_path / "main.cpp").write_text("""#include "v1_belt.h"
#include "v2_belt.h"
#include <cstring>
int main()
{
    v1_belt_t left, right;
    v2_belt_t update;
    v1_belt_init(&left);
    v1_belt_init(&right);
    v2_belt_init(&update);
    left.go = right.go = update.go = true;
    left.load = 245;
    right.load = 251;
    update.load = 245;
    bool right_so = v1_belt_drive_cycle(&left) == V1_BELT_FAULT_NONE && v1_belt_drive_cycle(&right) == V1_BELT_FAULT_NONE &&
        v2_belt_drive_cycle(&update) == V2_BELT_FAULT_NONE;
    right_so = right_so && left.line == V1_BELT_LINE_BELT_RUN && right.line == V1_BELT_LINE_BELT_FULL;
    right_so = right_so && update.line == V2_BELT_LINE_BELT_FULL && sizeof left == sizeof update;
    std::memcpy(&update, &left, sizeof update); /* a snapshot of the version before */
    return right_so && v2_belt_check(&update) == V2_BELT_CHECK_FOREIGN && v1_belt_check(&left) == V1_BELT_CHECK_OK ? 0 : 1;
}
""")
    for folder, name in ((old, "v1_belt"), (new, "v2_belt")):
        words = ["cc", "-std=c99", *STRICT, "-c", f"{folder / name}.c", "-o", f"{name}.o"]
        subprocess.run(words, cwd=tmp_path, check=True)
    words = [
        "c++", "-std=c++11", *STRICT, f"-I{old}", f"-I{new}", "main.cpp", "v1_belt.o", "v2_belt.o", "-o",
        "main",
    ]  # fmt: skip
    subprocess.run(words, cwd=tmp_path, check=True)
    subprocess.run(["./main"], cwd=tmp_path, check=True)


@pytest.mark.parametrize("prefix", ["9_", "a-b", "far_too_long_", "ä"])
def test_a_prefix_that_is_none_is_told(
    prefix: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "rcsc.toml").write_text(f'prefix = "{prefix}"\n', encoding="utf-8")
    (tmp_path / "belt.rcs").write_text(BELT, encoding="utf-8")
    assert run(["compile", str(tmp_path), "--out", str(tmp_path / "generated")]) == 1
    assert "`prefix` is a letter, and at most seven" in capsys.readouterr().out
    assert not (tmp_path / "generated").exists()


def test_a_system_with_a_prefix_runs(dock: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (dock / "rcsc.toml").write_text('prefix = "acme_"\n', encoding="utf-8")
    generated = dock / "generated"
    shutil.rmtree(generated)
    assert run(["compile", "-q", str(dock), "--out", str(generated)]) == 0
    names = {path.name for path in generated.rglob("*.[ch]")}
    assert names
    assert all(name.startswith("acme_") for name in names)
    for source in generated.glob("c/*.c"):
        subprocess.run(["cc", "-std=c99", *STRICT, "-c", source.name], cwd=generated / "c", check=True)
    monkeypatch.chdir(dock)
    assert run(["trace", "-q", "drive.rcs"]) == 0  # each line of the C comes from something in the tables
    for executor in ("c", "python"):
        assert run(["run", str(dock / "system.toml"), "--executor", executor]) == 0


PAGE = "tables/guide/integration.md"


def shown(repo: Path) -> list[tuple[str, str]]:
    """What the page has one run, and what it prints then."""
    text = (repo / PAGE).read_text(encoding="utf-8")
    return re.findall(r"^```sh\n(.*?)^```\n\n```text\n(.*?)^```", text, re.DOTALL | re.MULTILINE)


def played(repo: Path, folder: Path, *, cross: bool) -> list[str]:
    """The commands of the page that need a cross compiler, or those that do not, each in the repository's tables and C."""
    (folder / "build").mkdir()
    for name in ("tables", "generated"):
        (folder / name).symlink_to(repo / name)
    ran = []
    for commands, printed in shown(repo):
        if ("arm-none-eabi" in commands) is cross:
            made = subprocess.run(
                ["bash", "-e", "-c", commands], cwd=folder, capture_output=True, text=True, check=False
            )
            assert (made.returncode, made.stdout) == (0, printed), made.stderr
            ran.append(commands)
    return ran


def test_what_the_page_shows_is_so(repo: Path, tmp_path: Path) -> None:
    text = (repo / PAGE).read_text(encoding="utf-8")
    assert text.count("```sh\n") == len(shown(repo))
    assert len(played(repo, tmp_path, cross=False)) == 3
    for link in re.findall(r"\]\((?!#)([^)]+)\)", text):
        assert (repo / PAGE).parent.joinpath(link).exists(), link


@pytest.mark.needs("arm-none-eabi-gcc")
@pytest.mark.needs("qemu-system-arm")
def test_the_bare_metal_example_runs(repo: Path, tmp_path: Path) -> None:
    assert len(played(repo, tmp_path, cross=True)) == 1


@pytest.mark.needs("arm-none-eabi-gcc")
def test_an_image_carries_the_tables_that_it_steps(repo: Path, tmp_path: Path) -> None:
    main = '#include "task.h"\ntask_t s;\nint main(void) { task_init(&s); for (;;) { (void)task_acquire_step(&s); } }\n'
    (tmp_path / "main.c").write_text(main)
    bytes_ = []
    for flags in ((), ("-ffunction-sections", "-fdata-sections", "-Wl,--gc-sections")):
        words = [
            "arm-none-eabi-gcc", "-std=c99", "-Os", "-mcpu=cortex-m3", "-mthumb", "-ffreestanding", *flags,
        ]  # fmt: skip
        words += [f"-I{repo / 'generated/c'}", "main.c", str(repo / "generated/c/task.c")]
        subprocess.run([*words, "-nostdlib", "-lgcc", "-Wl,-e,main", "-o", "image"], cwd=tmp_path, check=True)
        size = subprocess.run(
            ["arm-none-eabi-size", "image"], cwd=tmp_path, capture_output=True, text=True, check=True
        )
        bytes_.append(int(size.stdout.splitlines()[1].split()[0]))
    assert 3 * bytes_[1] < bytes_[0], bytes_
