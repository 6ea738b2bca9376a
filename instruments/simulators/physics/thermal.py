"""Heat: chamber air that ramps and settles, and units that follow the air and heat themselves.

All temperatures are integrated on one grid of whole seconds, each step exact for a constant input, so the result does
not depend on the times of sampling.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
GRID_S = 1.0


@dataclass
class Body:
    """Temperatures of a unit, deg C: its sensor follows the air, and a deeper part follows the sensor."""

    sensor_tau_s: float
    self_heating_c: float
    heating_tau_s: float
    deep_tau_s: float
    sensor_c: float
    deep_c: float
    heated_c: float = 0.0
    powered: bool = False

    def follow(self, airs_c: list[float], sensor: list[float], deep: list[float]) -> None:
        """Advance by one second for each air temperature, and append where both thermometers are then, deg C.

        Plain numbers in one loop: a simulated campaign takes 10^5 of these steps.
        """
        heating_c = self.self_heating_c if self.powered else 0.0
        of_heating, of_sensor, of_deep = _share(self.heating_tau_s), _share(self.sensor_tau_s), _share(self.deep_tau_s)
        heated_c, sensor_c, deep_c = self.heated_c, self.sensor_c, self.deep_c
        for air_c in airs_c:
            heated_c += (heating_c - heated_c) * of_heating
            sensor_c += (air_c - sensor_c) * of_sensor
            shown_c = sensor_c + heated_c
            deep_c += (shown_c - deep_c) * of_deep
            sensor.append(shown_c)
            deep.append(deep_c)
        self.heated_c, self.sensor_c, self.deep_c = heated_c, sensor_c, deep_c


@cache
def _share(tau_s: float) -> float:
    return 1.0 - math.exp(-GRID_S / tau_s)


class Heat:
    """The chamber's air and the units in it, with their history."""

    def __init__(
        self,
        start_c: float,
        ramp_c_per_min: float,
        air_tau_s: float,
        bodies: dict[str, Body],
        noise_c: float,
        seed: int,
        indicated_too_much_c: float = 0.0,
    ) -> None:
        self._off_c = indicated_too_much_c  #: by which the chamber's thermometer is above the air at the units
        self._ramp_per_s = ramp_c_per_min / 60.0
        self._air_share = _share(air_tau_s)
        self._target_c = self._ramped_c = self._air_c = start_c
        self._bodies = bodies
        self._noise_c = noise_c
        self._air_noise_c = 0.0
        self._rng = np.random.default_rng([seed, 11])
        self._draws: list[float] = []
        self._air = [start_c]
        self._sensor = {name: [body.sensor_c + body.heated_c] for name, body in bodies.items()}
        self._deep = {name: [body.deep_c] for name, body in bodies.items()}

    def set(self, t_s: float, temperature_c: float) -> None:
        """Change the set point of the chamber, deg C."""
        self._advance(t_s)
        self._target_c = temperature_c

    def power(self, t_s: float, *, on: bool) -> None:
        """Switch the power of every unit."""
        self._advance(t_s)
        for body in self._bodies.values():
            body.powered = on

    def air_c(self, t_s: float) -> float:
        """Return the air temperature that the chamber indicates at one time, deg C."""
        return float(self._at(self._air, np.array([t_s]))[0])

    def airs_c(self, t_s: Array) -> Array:
        """Return the air temperature that the chamber indicates, (n,) deg C, at rising times (n,) s."""
        return self._at(self._air, t_s)

    def sensor_c(self, name: str, t_s: Array) -> Array:
        """Return the sensor temperature of a unit, (n,) deg C, at rising times (n,) s."""
        return self._at(self._sensor[name], t_s)

    def deep_c(self, name: str, t_s: Array) -> Array:
        """Return the temperature of the part away from the thermometer, (n,) deg C, at rising times (n,) s."""
        return self._at(self._deep[name], t_s)

    def _at(self, series: list[float], t_s: Array) -> Array:
        if len(t_s) == 0:
            return np.zeros(0)
        self._advance(float(t_s[-1]) + GRID_S)
        first = max(int(t_s[0] / GRID_S), 0)
        last = int(t_s[-1] / GRID_S) + 2
        piece = np.asarray(series[first:last])
        return np.interp(t_s, (first + np.arange(len(piece))) * GRID_S, piece)

    def _advance(self, t_s: float) -> None:
        seconds = int(t_s / GRID_S) - len(self._air) + 1
        if seconds <= 0:
            return
        airs_c = self._airs_after(seconds)
        self._air += airs_c
        felt_c = [air_c - self._off_c for air_c in airs_c] if self._off_c else airs_c
        for name, body in self._bodies.items():
            body.follow(felt_c, self._sensor[name], self._deep[name])

    def _airs_after(self, seconds: int) -> list[float]:
        """Return the air temperature after each of the next seconds, deg C."""
        target_c, ramped_c, air_c, noise_c = self._target_c, self._ramped_c, self._air_c, self._air_noise_c
        step_c, scatter_c, share = self._ramp_per_s * GRID_S, self._noise_c * 0.31, self._air_share
        airs_c = []
        for draw in self._draws_of(seconds):
            distance = target_c - ramped_c
            ramped_c += math.copysign(step_c, distance) if abs(distance) > step_c else distance
            air_c += (ramped_c - air_c) * share
            noise_c += -noise_c * 0.05 + scatter_c * draw
            airs_c.append(air_c + noise_c)
        self._ramped_c, self._air_c, self._air_noise_c = ramped_c, air_c, noise_c
        return airs_c

    def _draws_of(self, number: int) -> Iterator[float]:
        for _ in range(number):
            if not self._draws:
                self._draws = self._rng.standard_normal(4096).tolist()
            yield self._draws.pop()
