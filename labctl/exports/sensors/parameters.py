"""What an export needs of a sensor: the parameters of corrected = matrix (reading - offset)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.numeric.arrays import Array
from labctl.fitting.poses.at_rest.gravity import STANDARD_GRAVITY
from labctl.fitting.poses.at_rest.temperature import powers_of


class ForceParameters(Protocol):
    """Bias (3,), g, errors (3, 3) of scale factors and alignment, and local gravity, g, of an accelerometer."""

    @property
    def bias_g(self) -> Array: ...
    @property
    def errors(self) -> NDArray[np.float64]: ...
    @property
    def gravity_g(self) -> float: ...
    @property
    def temperature(self) -> TemperatureParameters | None: ...


class FieldParameters(Protocol):
    """Hard iron (3,), uT, and soft iron (3, 3) of a magnetometer."""

    @property
    def hard_iron_ut(self) -> Array: ...
    @property
    def soft_iron(self) -> NDArray[np.float64]: ...
    @property
    def turned_rad(self) -> Array | None: ...


@dataclass(frozen=True)
class TemperatureParameters:
    """Bias (n, 3) g/K^k and scale factor (m, 3) 1/K^k by powers of the temperature from a reference, k from 1."""

    reference_c: float
    range_c: tuple[float, float]
    bias_g: NDArray[np.float64]
    scale_factor: NDArray[np.float64]

    def grid(self) -> Array:
        """Temperatures of the range, deg C, close enough to find the largest value of a cubic."""
        return np.linspace(*self.range_c, 101)

    def bias_change_g(self, temperature_c: Array) -> NDArray[np.float64]:
        """Return what the bias differs by from that at the reference, (k, 3) g, at temperatures (k,) deg C."""
        return powers_of(temperature_c - self.reference_c, len(self.bias_g)) @ self.bias_g

    def scale_change(self, temperature_c: Array) -> NDArray[np.float64]:
        """Return the same of the scale factors, (k, 3)."""
        return powers_of(temperature_c - self.reference_c, len(self.scale_factor)) @ self.scale_factor

    def lost(self, gravity_g: float, *, bias: bool) -> str:
        """Return the line that says what a format without scale factors over temperature loses, and the `bias` too."""
        low, high = self.range_c
        temperatures_c = self.grid()
        scale = gravity_g * float(np.abs(self.scale_change(temperatures_c)).max())
        of_bias = f"the bias by up to {float(np.abs(self.bias_change_g(temperatures_c)).max()):.2g} g and " * bias
        return (
            f"LOST temperature: over {low:.1f} to {high:.1f} deg C {of_bias}the scale factors by up to {scale:.2g} g "
            f"of 1 g differ from those here, of {self.reference_c:g} deg C."
        )


@dataclass(frozen=True)
class AccelerometerParameters:
    """An accelerometer: reading = bias + (1 + errors) force."""

    bias_g: Array
    errors: NDArray[np.float64]
    gravity_g: float
    covariance: NDArray[np.float64]  #: (9, 9) of the parameters in the order of `labels`
    noise_density_m_s2: float  #: the largest of the axes, m/s2/sqrt(Hz)
    temperature: TemperatureParameters | None = None  #: None: the parameters are constants
    gyro_turned_rad: Array | None = None  #: (3,) rotation vector of the gyro triad; None: unknown

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
    turned_rad: Array | None = None  #: (3,) rotation vector of its axes from the accelerometer's; None: unknown

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

    @property
    def alignment(self) -> NDArray[np.float64] | None:
        """What turns a corrected field into the accelerometer's axes, (3, 3); None: unknown."""
        if self.turned_rad is None:
            return None
        from scipy.spatial.transform import Rotation

        return np.asarray(Rotation.from_rotvec(self.turned_rad).as_matrix(), dtype=np.float64)


Parameters = AccelerometerParameters | MagnetometerParameters
