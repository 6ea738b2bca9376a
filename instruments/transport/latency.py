"""Latency of USB adapters: FTDI chips hold received bytes until a timer expires, 16 ms by default.

Linux sets that timer to 1 ms for a port in its low-latency mode, which pyserial asks for (TIOCSSERIAL).
"""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

import serial

SYS_TTY = Path("/sys/class/tty")
#: Latency of a port that does not report its own: the default of FTDI adapters, s.
USUAL_S = 0.016


def lower_latency(port: object) -> None:
    """Ask the system to pass received bytes on at once; a port that cannot is left as it is."""
    ask = getattr(port, "set_low_latency_mode", None)  # pyserial has it on Linux only
    if ask is not None:
        with suppress(OSError, ValueError, NotImplementedError, serial.SerialException):
            ask(True)


def latency_timer_ms(name: str) -> int | None:
    """Return the latency timer of the FTDI adapter of a port, ms, by the name of its device; None for another port."""
    try:
        return int((SYS_TTY / name / "device" / "latency_timer").read_text(encoding="ascii"))
    except (OSError, ValueError):
        return None


def latency_s(url: str) -> float:
    """Return the largest delay of replies by the adapter of a port, s: its timer, or the default one."""
    found_ms = latency_timer_ms(Path(url).resolve().name)
    return USUAL_S if found_ms is None else 1e-3 * found_ms
