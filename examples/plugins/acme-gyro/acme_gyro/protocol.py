"""Lines of the Acme G1, from its manual: counter, rate in mdeg/s, temperature in 0.01 deg C, checksum."""

from __future__ import annotations

import re
from functools import reduce

DPS_PER_COUNT = 1e-3
C_PER_COUNT = 1e-2
#: The counter begins again at 0 after this many lines.
COUNTER_WRAP = 65536
LINE = re.compile(rb"((\d+),(-?\d+),(-?\d+))\*([0-9A-F]{2})\r?")


def checksum(body: bytes) -> int:
    """Return the exclusive or of all characters."""
    return reduce(lambda total, byte: total ^ byte, body, 0)


def encode(counter: int, rate: int, temperature: int) -> bytes:
    """Return one line with its end, from whole counts."""
    body = f"{counter % COUNTER_WRAP},{rate},{temperature}".encode("ascii")
    return body + f"*{checksum(body):02X}\r\n".encode("ascii")


def decode(line: bytes) -> tuple[int, int, int] | None:
    """Return counter, rate and temperature of a line without its line feed; None for a damaged one."""
    match = LINE.fullmatch(line)
    if match is None or checksum(match[1]) != int(match[5], 16):
        return None
    return int(match[2]), int(match[3]), int(match[4])
