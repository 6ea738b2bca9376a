"""What is expected to be uncertain in a data-set mean before it is measured: noise, drift, and unsettled heat."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.drift_noise import Drift

#: Correlation times of the drift, s, over which a prediction is averaged where none is known.
USUAL_TAUS_S = (120.0, 700.0, 3600.0)
#: Standard uncertainty of the time, s, by which the sensing element follows the thermometer, where nothing says it: by
#: technology; a thermometer in the package of the element is seconds away, one on a case with a coil minutes.
USUAL_ELEMENT_U_S = {"mems": 10.0, "fog": 120.0, "piezo": 60.0}
OTHER_ELEMENT_U_S = 60.0
#: How much the bias, deg/s, and the scale factor, 1, change with a kelvin, where no calibration says it.
USUAL_BIAS_PER_K, USUAL_SCALE_PER_K = 1e-3, 1e-4


@dataclass(frozen=True)
class AxisNoiseFigures:
    """Noise of one output."""

    white_dps_rthz: float  #: root of the power density of white noise, deg/s/rtHz
    drift_dps: float  #: standard deviation of the drift between data sets, deg/s
    tau_s: float | None = None  #: its correlation time; None: not known
    per_rate: float = 0.0  #: standard deviation of the table's rate in a data set, over the rate

    def white_var(self, duration_s: Array) -> Array:
        """Return the variance of means over durations (m,) s by white noise, (m,) (deg/s)^2."""
        return np.asarray(self.white_dps_rthz**2 / duration_s)

    @property
    def drifts(self) -> tuple[Drift, ...]:
        """The drifts that a prediction is averaged over."""
        taus = USUAL_TAUS_S if self.tau_s is None else (self.tau_s,)
        return tuple(Drift(self.drift_dps, tau, self.per_rate) for tau in taus)


@dataclass(frozen=True)
class UnsettledHeat:
    """An element that is not as warm as the thermometer says while the temperature changes.

    It follows the thermometer by a time that is uncertain about 0 and common to all data sets, so that heating and
    cooling show opposite errors.
    """

    element_u_s: float = OTHER_ELEMENT_U_S  #: standard uncertainty of that time
    bias_per_k: float = USUAL_BIAS_PER_K
    scale_per_k: float = USUAL_SCALE_PER_K


@dataclass(frozen=True)
class NoiseFigures:
    """Noise by output, and the heat of all of them."""

    axes: Mapping[str, AxisNoiseFigures]
    heat: UnsettledHeat = field(default_factory=UnsettledHeat)

    def of(self, axis: str) -> AxisNoiseFigures:
        """Return the noise of one output."""
        return self.axes[axis]
