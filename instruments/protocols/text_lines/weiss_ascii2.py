"""Weiss and Votsch, protocol ASCII-2: one line holds every set point, every actual value and 32 digital channels.

From the description that the controller of a VC3 7060 itself sends (reply to `$01?`, in a public simulation of it), and
from public drivers of the VT 4002 and of SimPac controllers. The protocol tells neither limits nor whether a program
runs.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from instruments.protocols.text_lines.line_syntax import LineSyntax

SYNTAX = LineSyntax(end="\r", refusal=r"(?P<why>[1-9]\d*|.*unknown command.*)")
#: Pairs of nominal and actual values, then the digital channels.
STATUS = r"(?P<values>(?:-?\d+\.\d+\s+)+)(?P<channels>[01]{2,32})"
ACKNOWLEDGED = r"0"
RESOLUTION_C = 0.1


@dataclass(frozen=True)
class Status:
    """What one line of a chamber says; the first controlled value is the temperature."""

    nominal: tuple[float, ...]
    actual: tuple[float, ...]
    channels: str

    def is_on(self, channel: int) -> bool:
        """Return whether a digital channel, from 0, is on."""
        return self.channels[channel : channel + 1] == "1"

    def commanded(self, temperature_c: float, channel: int, *, on: bool) -> str:
        """Return the arguments of a command: this temperature, this channel on or off, all else as it is."""
        values = (temperature_c, *self.nominal[1:])
        channels = self.channels[:channel] + ("1" if on else "0") + self.channels[channel + 1 :]
        return " ".join([*(number(value) for value in values), channels])


def number(value: float) -> str:
    """Return a value in six characters: 0050.0, -040.0."""
    return f"{value + 0.0:06.1f}"


def parse(match: re.Match[str]) -> Status:
    """Return what a line says that matches STATUS."""
    values = [float(text) for text in match["values"].split()]
    return Status(tuple(values[0::2]), tuple(values[1::2]), match["channels"])
