"""A simulated Temptronic ATS-545 ThermoStream: the requests of PyMeasure's class `ATS545`, on the world's chamber.

Written from the commands in PyMeasure's `temptronic_base.py` and `temptronic_ats545.py`, which follow the maker's
Interface & Applications Manual, revision B (November 2015).
"""

from __future__ import annotations

import re
from collections.abc import Callable

from instruments.protocols.text_lines.line_syntax import LineSyntax
from instruments.simulators.chamber_state import ChamberState
from instruments.simulators.links.line_device import LineDevice
from instruments.simulators.setup import InstrumentSetup

#: Replies to WHAT?.
MANUAL, PROGRAM = 10, 0
NUMBER = r"-?\d+(?:\.\d+)?"


class SimulatedAts545(LineDevice):
    """Answers requests that end with a question mark; a command gets no reply, also where it is refused."""

    def __init__(self, setup: InstrumentSetup) -> None:
        super().__init__(LineSyntax(), setup.faults)
        self.chamber = ChamberState(setup)

    def answer(self, request: str, t_s: float) -> str | None:
        """Return the reply to a request; None for a command."""
        chamber = self.chamber
        values: dict[str, Callable[[], str]] = {
            "*IDN?": lambda: "TEMPTRONIC, ATS-545-M, 00001, V1.0",
            "TEMP?": lambda: f"{chamber.air_c(t_s):.1f}",
            "SETP?": lambda: f"{chamber.setpoint_c:.1f}",
            "WHAT?": lambda: str(PROGRAM if chamber.program else MANUAL),
            "EROR?": lambda: str(chamber.alarms[0] if chamber.alarms else 0),
        }
        if request in values:
            return values[request]()
        if (match := re.fullmatch(rf"SETP ({NUMBER})", request)) is not None:
            chamber.set(float(match[1]), t_s)
        elif (match := re.fullmatch(r"FLOW ([01])", request)) is not None:
            chamber.run(t_s, on=match[1] == "1")
        return None
