"""C on a Cortex-M4: built by gcc for ARM, run by qemu's MPS2 board, its output read over semihosting."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

from tests.helpers.patience import WAIT_S

COMPILER, EMULATOR, BOARD = "arm-none-eabi-gcc", "qemu-system-arm", "mps2-an386"
INSTALL_CORTEX_M = "on Debian: apt-get install gcc-arm-none-eabi libnewlib-arm-none-eabi qemu-system-arm"
#: The vector table: a stack below the end of the board's RAM, and a reset that switches the floating-point unit on.
START = """
#include <stdint.h>
extern void _start(void);
static void reset(void) {
    *(volatile uint32_t *)0xE000ED88u |= 0xFu << 20;
    __asm volatile("dsb\\n isb");
    _start();
}
__attribute__((section(".vectors"), used)) void *const vectors[16] = {(void *)0x20300000u, (void *)reset};
"""
#: `-icount shift=0` makes an instruction last 1 ns, and SysTick counts at 25 MHz: one tick is 40 instructions.
INSTRUCTIONS_PER_TICK = 40
TICKS = """
#include <stdint.h>
static void ticks_begin(void) {
    *(volatile uint32_t *)0xE000E014u = 0xFFFFFFu;
    *(volatile uint32_t *)0xE000E018u = 0;
    *(volatile uint32_t *)0xE000E010u = 5;
    while (*(volatile uint32_t *)0xE000E018u == 0) { }
}
static uint32_t ticks(void) { return 0xFFFFFFu - *(volatile uint32_t *)0xE000E018u; }
"""


def has_cortex_m() -> bool:
    """Return whether compiler and emulator are installed."""
    return all(shutil.which(name) for name in (COMPILER, EMULATOR))


def on_cortex_m(folder: Path, *flags: str) -> str:
    """Compile `main.c` of a folder, run it, and return what it printed."""
    (folder / "start.c").write_text(START)
    build = [COMPILER, "-mcpu=cortex-m4", "-mthumb", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard", "-std=gnu99", "-O2",
             "-Wall", "-Wextra", "-Wconversion", "-Werror", "--specs=rdimon.specs", *flags, "main.c", "start.c",
             "-Wl,--section-start=.vectors=0x0", "-Wl,-Ttext=0x10000", "-Wl,-Tdata=0x20000000", "-o", "main.elf",
             "-lm"]  # fmt: skip
    subprocess.run(build, cwd=folder, check=True, capture_output=True, text=True)
    run = [EMULATOR, "-M", BOARD, "-nographic", "-monitor", "none", "-serial", "none", "-icount", "shift=0",
           "-semihosting-config", "enable=on,target=native", "-kernel", "main.elf"]  # fmt: skip
    done = subprocess.run(run, cwd=folder, check=True, capture_output=True, text=True, timeout=WAIT_S)
    return done.stdout or done.stderr


def bytes_of(folder: Path, symbols: tuple[str, ...]) -> int:
    """Return the size of those symbols in the program, bytes; what was inlined has none."""
    said = subprocess.run(
        ["arm-none-eabi-nm", "-S", "main.elf"], cwd=folder, check=True, capture_output=True, text=True
    )
    rows = [line.split() for line in said.stdout.splitlines()]
    return sum(int(row[1], 16) for row in rows if len(row) == 4 and row[3].startswith(symbols))
