"""What a hidden effect sees, and what it does to a unit."""

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
    """The world as a unit feels it at n times."""

    t_s: Array
    on_s: Array
    table_dps: Array
    angle_deg: Array
    body_dps: Array  #: (n, 3)
    own_dps: Array  #: (n, axes)
    rows: list[int]  #: body axis of each recorded axis
    g: Array  #: (n, 3)
    sensor_c: Array
    start_c: float  #: what everything was at in the beginning
    deep_c: Array
    sensor_k_min: Array  #: how fast the sensor's temperature changes
    air_c: Array
    run: int
    mounting: int
    full_scale_dps: float
    north_deg: float
    supply_wander_v: Array
    humidity_pct: Array  #: relative humidity of the room
    own_at: Callable[[Array], Array]  #: times (k,) not long ago -> own rates then, (k, axes)


class HiddenEffect:
    """One hidden cause; it may keep a memory, since times only rise."""

    id: ClassVar[str]
    unit: ClassVar[str]  #: of its size, as in the catalogue
    default: ClassVar[float]  #: a size that a person would notice

    def __init__(self, size: float, seed: list[int]) -> None:
        self.size = size
        self.rng = np.random.default_rng([*seed, zlib.crc32(self.id.encode())])

    def error_dps(self, state: State, rate_dps: Array) -> Array:
        """Return what is added to the output, (n, axes) or something that fits it."""
        return np.zeros((len(state.t_s), 1))

    def thermometer_c(self, state: State) -> Array:
        """Return what is added to the thermometer, (n,)."""
        return np.zeros(len(state.t_s))
