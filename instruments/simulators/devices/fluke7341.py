"""A simulated thermometer with the replies of a Fluke 7341, in the chamber's air (its manual, p. 81)."""

from __future__ import annotations

from instruments.protocols.text_lines.line_syntax import LineSyntax
from instruments.simulators.links.line_device import LineDevice
from instruments.simulators.setup import InstrumentSetup


class SimulatedFluke7341(LineDevice):
    """Answers `t` with the temperature, `u` with the unit, `*ver` with the version."""

    def __init__(self, setup: InstrumentSetup) -> None:
        super().__init__(LineSyntax(), setup.faults)
        self._heat = setup.world.heat

    def answer(self, request: str, t_s: float) -> str | None:
        """Return the reply to a request; None for one that the instrument does not know."""
        replies = {"u": "u: C", "*ver": "ver.7341,1.00"}
        return f"t: {self._heat.air_c(t_s):.4f} C" if request == "t" else replies.get(request)
