"""What every simulated chamber is, whatever its protocol: a set point that controls the world's air while it runs."""

from __future__ import annotations

from instruments.bench_config import ChamberSettings
from instruments.simulators.setup import InstrumentSetup

AMBIENT_C = 25.0


class ChamberState:
    """Set point, limits, whether it runs, program and alarms; the settings of a front panel are attributes."""

    def __init__(self, setup: InstrumentSetup) -> None:
        chamber = setup.instrument("chamber")
        assert isinstance(chamber, ChamberSettings)
        self._heat = setup.world.heat
        self.setpoint_c = AMBIENT_C
        self.min_c, self.max_c = chamber.min_c, chamber.max_c
        self.runs = False
        self.program = False
        self.alarms: list[int] = []
        self.writes: list[float] = []  #: every written set point

    def air_c(self, t_s: float) -> float:
        """Return the air temperature, deg C."""
        return self._heat.air_c(t_s)

    def set(self, temperature_c: float, t_s: float) -> bool:
        """Take a set point; returns whether it is within the limits."""
        if not self.min_c <= temperature_c <= self.max_c:
            return False
        self.writes.append(temperature_c)
        self.setpoint_c = temperature_c
        if self.runs:
            self._heat.set(t_s, temperature_c)
        return True

    def run(self, t_s: float, *, on: bool) -> None:
        """Start or stop control; the air of a chamber that is off goes to that of the room."""
        self.runs, self.program = on, False
        self._heat.set(t_s, self.setpoint_c if on else AMBIENT_C)
