"""The response of an output to the rate: a delay and a first-order lag."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.numeric.arrays import Array

#: Names of the coefficients of a response.
DELAY, TIME_CONSTANT = "delay", "time_constant"
#: Length of the memory of a response, in time constants.
MEMORY_TAUS = 30.0


@dataclass(frozen=True)
class Response:
    """Frequency response of the output to the rate: a first-order lag and a delay, exp(-i w delay) / (1 + i w T)."""

    delay_s: float = 0.0
    time_constant_s: float = 0.0

    def gain(self, rad_s: Array) -> NDArray[np.complex128]:
        """Return the gain at angular frequencies (k,) rad/s."""
        return np.asarray(np.exp(-1j * rad_s * self.delay_s) / (1 + 1j * rad_s * self.time_constant_s))

    def slope(self, name: str, rad_s: Array) -> NDArray[np.complex128]:
        """Return the derivative of the gain by `DELAY` or `TIME_CONSTANT`, 1/s."""
        derivative = -1j * rad_s
        return np.asarray(
            derivative * self.gain(rad_s) / (1.0 if name == DELAY else 1 + 1j * rad_s * self.time_constant_s)
        )

    def value(self, name: str) -> float:
        """Return a coefficient of the response by its name, s."""
        return self.delay_s if name == DELAY else self.time_constant_s

    def with_value(self, name: str, value: float) -> Response:
        """Return the response with another delay or time constant, s."""
        return replace(self, **{"delay_s" if name == DELAY else "time_constant_s": value})

    @property
    def memory_s(self) -> float:
        """Duration after which the impulse response is negligible, s."""
        return 2 * abs(self.delay_s) + MEMORY_TAUS * abs(self.time_constant_s)
