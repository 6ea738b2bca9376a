"""A simulated reference thermometer in the chamber's air, with a hygrometer where its model has one."""

from __future__ import annotations

import numpy as np

from instruments.bench_config import part_of
from instruments.protocols.text_lines.line_syntax import LineSyntax
from instruments.protocols.text_lines.quantity import CELSIUS
from instruments.protocols.text_lines.reference_lines import HUMIDITY, LineReferenceSettings
from instruments.simulators.links.line_device import LineDevice
from instruments.simulators.setup import InstrumentSetup


class SimulatedReference(LineDevice):
    """Reads the air; `error_c` is what its certificate would correct."""

    def __init__(self, setup: InstrumentSetup) -> None:
        super().__init__(LineSyntax(), setup.faults)
        settings = part_of(setup.reference, LineReferenceSettings)
        self._known, self._input = settings.known, settings.input
        self._world = setup.world
        self.identity = f"FLUKE,{settings.model},{settings.serial or 'A12345'},1.00"
        self.error_c = 0.0
        self.unit = "C"

    def answer(self, request: str, t_s: float) -> str | None:
        """Return the reply to a request; None for one that the instrument does not know."""
        if request == self._known.identity:
            return self.identity
        for column, quantity in self._known.quantities.items():
            if request == quantity.ask.replace("{input}", str(self._input)):
                if column == HUMIDITY:
                    return f"{float(self._world.humidity_pct(np.array([t_s]))[0]):.1f}"
                air_c = self._world.heat.air_c(t_s) + self.error_c
                return f"t: {air_c:9.3f} {self.unit}" if quantity.pattern == CELSIUS else f"{air_c:.4f}"
        return None
