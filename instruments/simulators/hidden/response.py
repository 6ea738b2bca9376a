"""Hidden responses of a unit: it feels the motion of a moment ago, or a running mean of what was before.

Each is a row of moments in the past with weights, so that several act one after the other and before anything else.
"""

from __future__ import annotations

import numpy as np

from instruments.simulators.hidden.base import Array, HiddenEffect


class TimeDelay(HiddenEffect):
    """The unit feels the motion of a moment ago."""

    id, unit, default = "time_delay", "s", 0.005

    def memory(self) -> tuple[Array, Array]:
        return np.array([self.size]), np.ones(1)


class Bandwidth(HiddenEffect):
    """The unit feels a mean of the motion before, older motion exponentially less; size is the time constant.

    The mean is a Gauss-Laguerre quadrature: exact to many digits for motions up to some times the bandwidth.
    """

    id, unit, default = "bandwidth", "s", 0.004
    NODES = 48

    def memory(self) -> tuple[Array, Array]:
        nodes, weights = np.polynomial.laguerre.laggauss(self.NODES)
        heavy = weights > 1e-18
        return self.size * nodes[heavy], weights[heavy] / weights[heavy].sum()
