"""What an export needs of a sensor: the parameters of corrected = matrix (reading - offset)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.numeric.arrays import Array
from labctl.fitting.poses.at_rest.gravity import STANDARD_GRAVITY


class ForceParameters(Protocol):
    """Bias (3,), g, errors (3, 3) of scale factors and alignment, and local gravity, g, of an accelerometer."""

    @property
    def bias_g(self) -> Array: ...
    @property
    def errors(self) -> NDArray[np.float64]: ...
    @property
    def gravity_g(self) -> float: ...


class FieldParameters(Protocol):
    """Hard iron (3,), uT, and soft iron (3, 3) of a magnetometer."""

    @property
    def hard_iron_ut(self) -> Array: ...
    @property
    def soft_iron(self) -> NDArray[np.float64]: ...


@dataclass(frozen=True)
class AccelerometerParameters:
    """An accelerometer: reading = bias + (1 + errors) force."""

    bias_g: Array
    errors: NDArray[np.float64]
    gravity_g: float
    covariance: NDArray[np.float64]  #: (9, 9) of the parameters in the order of `labels`
    noise_density_m_s2: float  #: the largest of the axes, m/s2/sqrt(Hz)

    sensor = "accelerometer"
    unit = "m/s2"
    labels = ("bias x, g", "bias y, g", "bias z, g", "scale factor x", "scale factor y", "scale factor z",
              "misalignment xy", "misalignment xz", "misalignment yz")  # fmt: skip

    @property
    def offset(self) -> Array:
        """Offset (3,), m/s2."""
        return self.bias_g * STANDARD_GRAVITY

    @property
    def matrix(self) -> NDArray[np.float64]:
        """What corrects a reading without its offset, (3, 3)."""
        return np.asarray(np.linalg.inv(np.eye(3) + self.errors), dtype=np.float64)


@dataclass(frozen=True)
class MagnetometerParameters:
    """A magnetometer: field = soft iron (reading - hard iron)."""

    hard_iron_ut: Array
    soft_iron: NDArray[np.float64]
    covariance: NDArray[np.float64]  #: (10, 10) of the parameters in the order of `labels`

    sensor = "magnetometer"
    unit = "uT"
    labels = ("hard iron x, uT", "hard iron y, uT", "hard iron z, uT", "soft iron xx", "soft iron yy", "soft iron zz",
              "soft iron xy", "soft iron xz", "soft iron yz", "field, uT")  # fmt: skip

    @property
    def offset(self) -> Array:
        """Offset (3,), uT."""
        return self.hard_iron_ut

    @property
    def matrix(self) -> NDArray[np.float64]:
        """What corrects a reading without its offset, (3, 3)."""
        return self.soft_iron


Parameters = AccelerometerParameters | MagnetometerParameters
