"""The axis of a simulated servo table, as its controller moves and measures it."""

from __future__ import annotations

import numpy as np

from instruments.bench_config import part_of
from instruments.protocols.request_reply.settings import DescribedTableSettings
from instruments.simulators.physics.servo_motion import ServoMotion
from instruments.simulators.physics.world import number
from instruments.simulators.setup import InstrumentSetup

#: Noise of the measured rate, deg/s.
RATE_NOISE_DPS = 1e-4


class ServoAxis:
    """One axis; `[simulation] table` sets its rate error and its encoder's noise."""

    def __init__(self, setup: InstrumentSetup, seed: int) -> None:
        settings = part_of(setup.instrument("table"), DescribedTableSettings)
        table_section = setup.world.settings.table
        self.sign = settings.direction
        self.parameters = {**settings.format.parameters, **settings.parameters}
        self.motion = setup.world.servo = setup.world.servo or ServoMotion()
        self._ratio = number(table_section, "rate_ratio", 1.0)
        self._noise_deg = number(table_section, "encoder_noise_deg", 0.0)
        self.reply_s = number(table_section, "reply_s", 0.002)
        self.home_s = number(table_section, "home_s", 8.0)  #: how long a home search takes at least
        self._zero_deg = number(
            table_section, "off_home_deg", 25.0
        )  #: its encoder counts from where it was switched on
        self._rng = np.random.default_rng([setup.world.settings.seed, setup.world.settings.noise_seed, seed])

    def run(self, t_s: float, rate_dps: float, acceleration_dps2: float) -> float:
        """Change to a rate; returns when it is reached."""
        return self.motion.set_rate(t_s, self.sign * self._ratio * rate_dps, acceleration_dps2)

    def search_home(self, t_s: float, acceleration_dps2: float) -> float:
        """Turn to the home mark, where the encoder counts from 0 again; returns when that is done."""
        done_s = max(self.motion.move_to(t_s, 0.0, 20.0, acceleration_dps2), t_s + self.home_s)
        self._zero_deg = float(self.motion.angle_deg(np.array([done_s]))[0])
        return done_s

    def position_deg(self, t_s: float) -> float:
        """Return the position by the encoder, unwrapped."""
        angle = float(self.motion.angle_deg(np.array([t_s]))[0]) - self._zero_deg
        return self.sign * angle + self._noise_deg * float(self._rng.standard_normal())

    def rate_dps(self, t_s: float) -> float:
        """Return the rate by the encoder."""
        return self.sign * self.motion.rate_dps(t_s) + RATE_NOISE_DPS * float(self._rng.standard_normal())
