"""Inputs and outputs of a hidden effect."""

from __future__ import annotations

import zlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class State:
    """Quantities that act on a unit at n times."""

    t_s: Array
    on_s: Array
    table_dps: Array
    angle_deg: Array
    body_dps: Array  #: (n, 3)
    own_dps: Array  #: (n, axes)
    rows: list[int]  #: body axis of each recorded axis
    g: Array  #: (n, 3): one g up
    force_g: Array  #: (n, 3): the same, and the pull towards the axis of the table
    radius_m: float | None  #: distance from the axis of the table, where the bench states one
    sensor_c: Array
    start_c: float  #: temperature of the whole bench at the start
    deep_c: Array
    sensor_k_min: Array  #: rate of change of the sensor temperature, K/min
    air_c: Array
    run: int
    mounting: int
    session: int  #: another one measures the same units on another day
    full_scale_dps: float
    north_deg: float
    supply_wander_v: Array
    humidity_pct: Array  #: relative humidity around the bench
    own_at: Callable[[Array], Array]  #: recent times (k,) s -> rates along the recorded axes, (k, axes) deg/s


class HiddenEffect:
    """One hidden physical effect; it may keep state, since times only rise."""

    id: ClassVar[str]
    unit: ClassVar[str]  #: unit of its size, as in the catalogue
    default: ClassVar[float]  #: a noticeable size

    def __init__(self, size: float, seed: list[int]) -> None:
        self.size = size
        self.rng = np.random.default_rng([*seed, zlib.crc32(self.id.encode())])

    def error_dps(self, state: State, rate_dps: Array) -> Array:
        """Return the addition to the output, deg/s, in a shape that broadcasts to (n, axes)."""
        return np.zeros((len(state.t_s), 1))

    def memory(self) -> tuple[Array, Array] | None:
        """Return the moments before now, (k,) s, of whose motion the unit feels a mean, and their weights, (k,).

        None where it feels the motion of now. The weights have the sum 1.
        """
        return None

    def thermometer_c(self, state: State) -> Array:
        """Return the addition to the thermometer, (n,) K."""
        return np.zeros(len(state.t_s))
