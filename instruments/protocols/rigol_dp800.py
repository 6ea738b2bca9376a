"""Commands of a Rigol DP800 power supply, from its Programming Guide (PGH03108-1110, December 2015).

Pages: `:APPLy` and the ranges of each channel, 2-8 and 2-9 (Table 2-1); the summary register of a channel, 1-10 (Table
1-3); `:OUTPut:OVP:VALue` and `:OUTPut[:STATe]`, 2-35 of the edition before it. `*IDN?` is of IEEE Std 488.2, 10.14,
`:MEASure:VOLTage?` and `:SYSTem:ERRor?` are of SCPI 1999.0, volume 2, chapters 3 and 21. A command has no reply.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

from pydantic import Field

from instruments.bench_config import SupplySettings
from instruments.protocols.port_or_host import PortOrHostSettings
from instruments.protocols.serial_options import SerialOptions
from instruments.protocols.text_lines.line_syntax import LineSyntax

#: Commands come no faster than this, s: the supply has no handshake.
PAUSE_S = 0.02
SYNTAX = LineSyntax(end="\n", pause_s=PAUSE_S)
NUMBER = r"[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?"
IDENTITY, IDENTITY_REPLY = "*IDN?", re.compile(r"\s*RIGOL TECHNOLOGIES,\s*(?P<model>DP8\w+),.*")
ERROR, ERROR_REPLY = ":SYST:ERR?", rf"\s*(?P<code>{NUMBER}),\s*\"?(?P<why>[^\"]*)\"?\s*"
#: Errors that the queue holds at most.
MAX_ERRORS = 20
#: The overvoltage protection trips at so much of the largest voltage that the bench file allows.
OVP_SHARE = 1.05
#: Bits of the summary register of a channel.
CURRENT_LIMITED, VOLTAGE_CONTROLLED, OVER_VOLTAGE, OVER_CURRENT = 1, 2, 4, 8


@dataclass(frozen=True)
class ChannelRange:
    """What one channel can be set to."""

    max_v: float
    max_a: float


_30V3A, _8V5A, _30V2A = ChannelRange(32.0, 3.2), ChannelRange(8.4, 5.3), ChannelRange(32.0, 2.1)
_831, _832 = {1: _8V5A, 2: _30V2A}, {1: _30V3A, 2: _30V3A, 3: ChannelRange(5.3, 3.2)}
_821 = {1: ChannelRange(63.0, 1.05), 2: ChannelRange(8.4, 10.5)}
#: Model -> channel -> its range. A DP811 has one channel and other status commands; channel 3 of a DP831 is negative.
MODELS: Mapping[str, Mapping[int, ChannelRange]] = {
    "DP831": _831, "DP831A": _831, "DP832": _832, "DP832A": _832, "DP821": _821, "DP821A": _821,
}  # fmt: skip


class Dp800Settings(PortOrHostSettings, SupplySettings):
    """A Rigol DP800 on its LAN interface or its RS-232 port."""

    tcp_port: int = 5555
    baudrate: int = Field(default=9600, gt=0)
    options: SerialOptions = Field(default_factory=SerialOptions)
    channel: int = Field(default=1, ge=1, le=3)
    serial: str = ""  #: of the supply; compared with what it says of itself


def model_in(reply: str) -> str:
    """Return the model in a reply to `*IDN?`; empty where it is no DP800."""
    match = IDENTITY_REPLY.fullmatch(reply)
    return "" if match is None else match["model"]


def resolution_v(model: str) -> float:
    """Return the step of a set point, V: that of the models with an A is 1 mV, that of the others 10 mV."""
    return 0.001 if model.endswith("A") else 0.01


def apply(channel: int, voltage_v: float, current_a: float) -> str:
    """Return the command that sets voltage and current limit together."""
    return f":APPL CH{channel},{voltage_v:.3f},{current_a:.3f}"


def setting_reply(channel: int) -> str:
    """Return the pattern of the reply to `:APPL? CHn`: the channel, with its range where it has that, V and A."""
    return rf"\s*CH{channel}(?::[^,]*)?,\s*(?P<v>{NUMBER}),\s*(?P<a>{NUMBER})\s*"


def why_off(register: int) -> str:
    """Return what the summary register of a channel says of an output that is not at its voltage."""
    if register & OVER_VOLTAGE:
        return "its overvoltage protection has tripped"
    if register & OVER_CURRENT:
        return "its overcurrent protection has tripped"
    if register & (CURRENT_LIMITED | VOLTAGE_CONTROLLED) == CURRENT_LIMITED:
        return "it limits the current"
    if register & (CURRENT_LIMITED | VOLTAGE_CONTROLLED) == VOLTAGE_CONTROLLED:
        return "it controls the voltage, so that another set point was given"
    return "its output is off or unregulated"
