"""Command language of the ACUTROL 3000 motion controller (ACL): commands, replies and status bits.

Sources: TM-8004-C (commands), TM-9374A page 34 (error word and length before a reply), TM-9411 and TM-9384C (RS-232,
TCP port 9878). A command is a path of mnemonics and its arguments; several are separated by semicolons, and one without
a leading colon stays at the subsystem of the one before it.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

LINE_END = b"\r\n"
IDENTIFY = "*IDN?"
#: Word that the reply to IDENTIFY holds, in any case; a BD125 answers "ACT3000".
IDENTITY = ("acutrol3000", "acutrol 3000", "act3000", "act 3000")
#: Words before a reply: an error code and the number of characters that follow, 32 bits each (TM-9374A page 34).
WORD_BYTES, HEAD_BYTES = 4, 8
#: Longest message in either direction, characters (TM-8004 page 5).
LONGEST = 32_768
#: What a command without data is answered with.
DONE = "OK"
#: Letters of the profiler modes (TM-8004 page 137).
OFF, RATE, POSITION, SYNTHESIS = "O", "R", "P", "S"
#: Lowest frequency of the oscillator where it changes by the same factor in equal times, Hz (TM-8004 page 82).
MIN_HZ = 0.001
#: First letters of the states of an interlock (TM-8004 page 133).
CLOSED, OPEN, FAULT = "C", "O", "F"
#: Bits of the register A(n)DYN (TM-8004 page 214).
POSITION_COMPLETE, RATE_COMPLETE = 8, 9
#: Bits of the registers A(n)INTLK and A(n)SWFLT (TM-8004 pages 213 and 214).
INTERLOCKS = (
    *(f"discrete input {bit}" for bit in range(6)), "power amplifier acknowledge", "interlock 1", "interlock 2",
    "master interlock", "DMA synchronisation", "software watchdog", "10 kHz clock watchdog", "serial data link",
    "servo interlock link of another axis", "10 kHz phase lock",
)  # fmt: skip
SOFTWARE_FAULTS = (
    "software abort", "rate trip", "position tracking error", "frame time", "program error", "miscorrelation",
    "checksum of the calibration constants", "loss of the fine transducer", "loss of the coarse transducer",
    "self-test",
)  # fmt: skip
#: Angles and rates are sent with so many decimals: the resolution of the examples of TM-8004.
DECIMALS = 5


@dataclass(frozen=True)
class Head:
    """What precedes a reply: its error code, 0 for none, and how many characters follow."""

    error: int
    length: int


def is_headed(first: bytes) -> bool:
    """Return whether a reply begins with the two words, by its first four bytes: no line of text holds a zero byte.

    TM-8004 page 2 has the words for every interface but IEEE-488; release notes and some adapters have plain lines.
    """
    return 0 in first[:WORD_BYTES]


def head_of(data: bytes) -> Head:
    """Return the two words before a reply, (8,) bytes; raises ValueError for a length that no reply has.

    Their byte order is not published. A length of at most 32768 has only one order that gives no larger number.
    """
    both = (Head(*struct.unpack(f"{order}II", data)) for order in "<>")
    small = [head for head in both if head.length <= LONGEST]
    if not small:
        raise ValueError(f"the reply begins with {data.hex(' ')}, which is no error code and length")
    return min(small, key=lambda head: head.error)


def packed(error: int, text: str) -> bytes:
    """Return a reply with its two words, low byte first."""
    data = text.encode("ascii")
    return struct.pack("<II", error, len(data)) + data


def number(value: float) -> str:
    """Return an angle in degrees, a rate or an acceleration as the controller takes it."""
    return f"{value:.{DECIMALS}f}"


def demand_rate(axis: int, rate_dps: float) -> str:
    """Return the command that demands a rate, deg/s, and changes to rate mode in the same frame."""
    return f":Demand:Rate {axis},{number(rate_dps)};:Mode:Rate {axis}"


def demand_position(axis: int, angle_deg: float) -> str:
    """Return the command that demands an angle, degrees, and changes to position mode in the same frame."""
    return f":Demand:Position {axis},{number(angle_deg)};:Mode:Position {axis}"


def configure_oscillator(axis: int, slew_dps2: float, decades_per_s: float) -> str:
    """Return the command that lets the oscillator keep the size of the rate while its frequency changes.

    The size then changes evenly, the frequency by the same factor in equal times (TM-8004 page 82).
    """
    slews = f"{number(slew_dps2)},{decades_per_s:.9f}"
    return f":Configure:Oscillator {axis},Enable,{slews},Rate,Log"


def demand_oscillator(axis: int, size_dps: float, frequency_hz: float, phase_deg: float) -> str:
    """Return the command that demands a sine of the rate: its peak, deg/s, and its frequency (TM-8004 page 110)."""
    return f":Demand:Oscillator {axis},{number(size_dps)},{frequency_hz:.9g},{phase_deg:g}"


def synthesis(axis: int) -> str:
    """Return the command that changes to the mode of the oscillator (TM-8004 page 153)."""
    return f":Mode:Synthesis {axis}"


def ramp(axis: int, to_dps: float, slope_dps2: float) -> str:
    """Return the command that demands a rate, to be reached with a slope; in rate mode it is obeyed at once."""
    limit = f":Limit:Acceleration {RATE},{axis},{slope_dps2:.9g};" if slope_dps2 else ""
    return f"{limit}:Demand:Rate {axis},{number(to_dps)}"


def off(axis: int) -> str:
    """Return the command that brings an axis to a controlled stop, and holds it at rest (TM-8004 page 150)."""
    return f":Mode:Off {axis}"


def limit_rate(mode: str, axis: int, rate_dps: float) -> str:
    """Return the command that limits the rate in one mode, deg/s."""
    return f":Limit:Rate {mode},{axis},{number(rate_dps)}"


def limit_acceleration(mode: str, axis: int, acceleration_dps2: float) -> str:
    """Return the command that limits the acceleration in one mode, deg/s^2."""
    return f":Limit:Acceleration {mode},{axis},{number(acceleration_dps2)}"


def register(name: str) -> str:
    """Return the query of a condition register, such as A1DYN."""
    return f":Status:CSR? {name}"


def named_bits(value: int, names: tuple[str, ...]) -> list[str]:
    """Return the names of the bits that are set."""
    return [name for bit, name in enumerate(names) if value >> bit & 1]
