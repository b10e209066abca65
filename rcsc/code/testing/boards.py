"""Emulated processors: an image is built, run, and counts the instructions and the stack of each call that it makes.

In: the C of a program, and C that calls it. Out: what the image said. QEMU executes one instruction in each tick of its clock
(`-icount`), so that the processor's own timer counts instructions, exactly: SysTick of the boards MPS2 with 25 MHz, where an
instruction takes 1.024 us, and `minstret` of RISC-V. The stack of a call is found by a pattern below it. A Cortex-M0+ is its code
on a Cortex-M3, which has all its instructions. Nothing here is a time: QEMU knows no pipeline and no wait states.
"""

import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import MappingProxyType

from rcsc.base.host.tools import BuildFailed, run_command, write_c

OPTIMIZED = ("-std=c99", "-Os", "-ffreestanding", "-ffunction-sections", "-fdata-sections")
COMPILE_S, RUN_S = 60.0, 300.0
NOTHING: Mapping[str, Sequence[str]] = MappingProxyType({})


@dataclass(frozen=True, slots=True)
class Board:
    """A processor and its emulator.

    Attributes:
        compiler: The cross compiler, with the options for the processor.
        tools: The prefix of its binary utilities.
        emulator: The command that runs an image, but for its path.
        origins: Where code and where data lie.
    """

    name: str
    compiler: tuple[str, ...]
    tools: str
    emulator: tuple[str, ...]
    origins: tuple[str, str]

    def absent(self) -> str:
        """Return the commands that it needs and that are not installed; "" for none."""
        needed = (self.compiler[0], f"{self.tools}objdump", self.emulator[0])
        return ", ".join(command for command in needed if not _is_there(command))

    @property
    def version(self) -> str:
        """The compiler and its version, as it prints them."""
        return run_command([self.compiler[0], "--version"], Path(), COMPILE_S).out.partition("\n")[0]


@cache
def _is_there(command: str) -> bool:
    return shutil.which(command) is not None


SEMIHOSTING = ("-nographic", "-monitor", "none", "-semihosting-config", "enable=on,target=native")
ARM = ("arm-none-eabi-gcc", "-mthumb")
MPS2 = ("qemu-system-arm", *SEMIHOSTING, "-icount", "shift=10", "-M")
BOARDS = (
    Board(
        "Cortex-M0+",
        (*ARM, "-mcpu=cortex-m0plus"),
        "arm-none-eabi-",
        (*MPS2, "mps2-an385"),
        ("0x0", "0x20000000"),
    ),
    Board(
        "Cortex-M3", (*ARM, "-mcpu=cortex-m3"), "arm-none-eabi-", (*MPS2, "mps2-an385"), ("0x0", "0x20000000")
    ),
    Board(
        "Cortex-M4F",
        (*ARM, "-mcpu=cortex-m4", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16"),
        "arm-none-eabi-",
        (*MPS2, "mps2-an386"),
        ("0x0", "0x20000000"),
    ),
    Board(
        "RV32IMAC",
        ("riscv64-unknown-elf-gcc", "-march=rv32imac", "-mabi=ilp32"),
        "riscv64-unknown-elf-",
        ("qemu-system-riscv32", *SEMIHOSTING, "-icount", "shift=0", "-bios", "none", "-M", "virt"),
        ("0x80000000", "0x80400000"),
    ),
)
"""Small processors with and without an instruction for each operation that the C needs, of both families."""

LINKER = """
MEMORY {{ CODE (rx) : ORIGIN = {}, LENGTH = 4M
         DATA (rwx) : ORIGIN = {}, LENGTH = 4M }}
ENTRY(reset)
SECTIONS {{
  .text : {{ KEEP(*(.vectors)) KEEP(*(.reset)) *(.text*) *(.rodata*) *(.srodata*) . = ALIGN(8); }} > CODE
  .gcov_info : {{ __gcov_info_start = .; KEEP(*(.gcov_info)) __gcov_info_end = .; }} > CODE
  .ARM.exidx : {{ *(.ARM.exidx*) }} > CODE
  .data : {{ *(.data*) *(.sdata*) . = ALIGN(8); }} > DATA
  .bss : {{ *(.bss*) *(.sbss*) *(COMMON) . = ALIGN(8); }} > DATA
}}
"""
STRING_H = """
#include <stddef.h>
void *memcpy(void *to, const void *from, size_t n);
void *memset(void *to, int byte, size_t n);
int memcmp(const void *one, const void *other, size_t n);
"""
HARNESS = """
#include <stdbool.h>
#include <stdint.h>
#include <string.h>
#define PAINTED 1024u /* words below a call in which its stack is looked for */
typedef void (*call_t)(void *state);
int main(void);
static uint32_t stack[8192] __attribute__((aligned(16), used));
#if defined(__riscv)
__attribute__((naked, section(".reset"), used)) void reset(void)
{
    __asm volatile("la sp, stack + 32768\\n\\tj start");
}
static uint32_t now(void)
{
    uint32_t n;
    __asm volatile(".option push\\n\\t.option arch, +zicsr\\n\\tcsrr %0, minstret\\n\\t.option pop" : "=r"(n));
    return n;
}
static uint32_t passed(uint32_t from, uint32_t to) { return to - from; }
static void begin(void) { }
static uint32_t lost(void) { return 0u; }
#define STACK_POINTER "sp"
static void ask(uintptr_t what, uintptr_t with)
{
    register uintptr_t a0 __asm("a0") = what;
    register uintptr_t a1 __asm("a1") = with;
    __asm volatile(".balign 16\\n\\t.option push\\n\\t.option norvc\\n\\t"
                   "slli x0, x0, 0x1f\\n\\tebreak\\n\\tsrai x0, x0, 7\\n\\t.option pop"
                   : "+r"(a0) : "r"(a1) : "memory");
}
#else
#define SYSTICK ((volatile uint32_t *)0xE000E010u)
void reset(void);
static void fault(void);
__attribute__((section(".vectors"), used)) static const void *const vectors[16] = {
    &stack[8192], (const void *)reset, (const void *)fault, (const void *)fault};
static uint32_t now(void) { return SYSTICK[2]; }
static uint32_t passed(uint32_t from, uint32_t to) { return ((((from - to) & 0xFFFFFFu) * 10u) + 128u) / 256u; }
static void begin(void) { SYSTICK[2] = 0u; } /* which makes it begin anew, and forget that it ended */
static uint32_t lost(void) { return (SYSTICK[0] >> 16) & 1u; }
#define STACK_POINTER "sp"
static void ask(uintptr_t what, uintptr_t with)
{
    register uintptr_t r0 __asm("r0") = what;
    register uintptr_t r1 __asm("r1") = with;
    __asm volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
}
static void fault(void) { ask(0x18u, 0x20023u); } /* which ends the emulator with a status that is not 0 */
#endif
__attribute__((noinline)) void *memcpy(void *to, const void *from, size_t n)
{
    for (size_t i = 0; i < n; i++) { ((volatile uint8_t *)to)[i] = ((const uint8_t *)from)[i]; }
    return to;
}
__attribute__((noinline)) void *memset(void *to, int byte, size_t n)
{
    for (size_t i = 0; i < n; i++) { ((volatile uint8_t *)to)[i] = (uint8_t)byte; }
    return to;
}
__attribute__((noinline)) int memcmp(const void *one, const void *other, size_t n)
{
    size_t i = 0;
    while ((i < n) && (((volatile const uint8_t *)one)[i] == ((volatile const uint8_t *)other)[i])) { i++; }
    return (int)(i < n);
}
static void say(const char *text) { ask(4u, (uintptr_t)text); }
static void say_number(uint32_t n)
{
    char text[12];
    char *at = &text[11];
    *at = 0;
    do { at--; *at = (char)('0' + (n % 10u)); n /= 10u; } while (n != 0u);
    say(at);
}
__attribute__((noinline)) static void nothing(void *state) { __asm volatile("" : : "r"(state)); }
typedef struct { uint32_t calls, most, deepest; } seen_t;
__attribute__((noinline)) static void measure(call_t call, void *state, seen_t *seen)
{
    register uint32_t *sp __asm(STACK_POINTER);
    volatile uint32_t *low = sp - PAINTED;
    for (uint32_t i = 0u; i < PAINTED; i++) { low[i] = 0x5AA5C33Cu; }
    begin();
    const uint32_t from = now();
    call(state);
    const uint32_t to = now();
    const bool overrun = lost() != 0u; /* more than the counter holds */
    const uint32_t count = passed(from, to);
    uint32_t deep = 0u;
    while ((deep < PAINTED) && (low[deep] == 0x5AA5C33Cu)) { deep++; }
    deep = (PAINTED - deep) * 4u;
    seen->calls++;
    if (overrun) { seen->most = 0xFFFFFFFFu; }
    if (count > seen->most) { seen->most = count; }
    if (deep > seen->deepest) { seen->deepest = deep; }
}
static void tell(const char *name, const seen_t *seen, const seen_t *none)
{
    const bool whole = (seen->most != 0xFFFFFFFFu);
    say("rcsc "); say(name); say(" "); say_number(seen->calls); say(" ");
    say_number(whole ? ((seen->most - none->most) + 1u) : 0xFFFFFFFFu); say(" "); say_number(seen->deepest); say("\\n");
}
#if defined(__riscv)
__attribute__((used)) void start(void)
{
    (void)main();
    ask(0x18u, 0x20026u);
}
#else
void reset(void)
{
    *(volatile uint32_t *)0xE000ED88u |= 0xF00000u; /* the unit for reals, where there is one */
    SYSTICK[1] = 0xFFFFFFu;
    SYSTICK[0] = 5u;
    (void)main();
    ask(0x18u, 0x20026u);
}
#endif
"""
"""The C that an image begins with: `measure(call, state, seen)` calls and counts, `tell(name, seen, none)` prints."""


def run_image(
    board: Board,
    place: Path,
    files: Mapping[str, str],
    image: str,
    counted: Mapping[str, Sequence[str]] = NOTHING,
) -> str | BuildFailed:
    """Build the files and the image with it in a folder, as `image.elf`, and run it.

    Args:
        board: The processor.
        place: The folder.
        files: C and headers, text by path.
        image: The C with `main`.
        counted: More options for some files, by name, whose counters gcc keeps in the image.

    Returns:
        What it said.
    """
    (place / "board.ld").write_text(LINKER.format(*board.origins), "utf-8")
    (place / "string.h").write_text(STRING_H, "utf-8")
    (place / "image.c").write_text(image, "utf-8")
    objects = []
    for source in (*write_c(files, place), "image.c"):
        objects.append(f"{Path(source).stem}.o")
        flags = ("-std=gnu11", "-O1", "-w", "-ffreestanding", "-I.") if source == "image.c" else OPTIMIZED
        options = (*flags, *counted.get(source, ()), "-I.", "-c", source, "-o", objects[-1])
        built = compiled(board, place, options)
        if isinstance(built, BuildFailed):
            return built
    linked = link(board, place, [*objects, *(["-lgcov"] if counted else [])], "image.elf")
    if isinstance(linked, BuildFailed):
        return linked
    ran = run_command([*board.emulator, "-kernel", "image.elf"], place, RUN_S)
    if ran.status != 0:
        return BuildFailed(f"the image stopped with status {ran.status}: {(ran.out + ran.err).strip()[:400]}")
    return ran.out + ran.err  # where semihosting writes to depends on the emulator's version


def compiled(board: Board, place: Path, arguments: Sequence[str]) -> BuildFailed | None:
    """Run a board's compiler."""
    ran = run_command([*board.compiler, *arguments], place, COMPILE_S)
    return None if ran.status == 0 else BuildFailed(ran.err.strip()[:400] or "the compiler ran out of time")


def link(board: Board, place: Path, objects: Sequence[str], target: str, *more: str) -> BuildFailed | None:
    """Link objects with the compiler's own library and nothing else."""
    script = ("-nostdlib", "-Wl,-T,board.ld", "-Wl,--no-warn-rwx-segments", *more)
    return compiled(board, place, (*script, "-o", target, *objects, "-lgcc"))
