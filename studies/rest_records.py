"""Records of units that never move, hours long, with thermometer and accelerometer: what may be said of them?

Written with numpy alone, apart from labctl's effects. Each unit has its own law of temperature; a record of it adds, by
cell: a tilt of some milli-g, a random walk of the bias, a temperature inside the unit that is not logged, or a thermal
hysteresis, which is a state that follows the direction of the temperature and not the catalogue's play.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime

import numpy as np
from numpy.typing import NDArray

from labctl.recording import Recording, RecordingInfo

Array = NDArray[np.float64]
AXES = ("x", "y", "z")
HOURS, RATE_HZ = 2.8, 2.0


@dataclass(frozen=True)
class MemsType:
    """A type of unit: noise, and how far its bias goes with temperature."""

    white: float  #: deg/s/sqrt(Hz)
    flicker_dps: float  #: standard deviation of a drift of 20 min
    bias_dps: float
    per_k: float  #: deg/s/K
    step_dps: float = 0.0  #: of the output; 0: none


TYPES: dict[str, MemsType] = {
    "consumer": MemsType(0.010, 0.0040, 0.50, 0.020, 1 / 131.0),
    "industrial": MemsType(0.005, 0.0010, 0.20, 0.008),
    "tactical": MemsType(0.0025, 0.0002, 0.05, 0.002),
}


@dataclass(frozen=True)
class Disturbance:
    """What a record has beside the law of the logged temperature and the noise of its type.

    Sizes in deg/s are multiples of the drift of the type.
    """

    tilt_g: float = 0.002  #: how far the plate under the unit leans during a record
    walk_dps: float = 0.0  #: random walk of the bias, deg/s after an hour
    unlogged_dps: float = 0.0  #: answer to a temperature that no thermometer sees
    hysteresis_dps: float = 0.0
    warms_k: float = 6.0  #: by its own heat, after power-on
    room_k: float = 3.0  #: swing of the room

    def of_type(self, kind: MemsType) -> Disturbance:
        """Return this, whose sizes in deg/s are multiples of the drift of a type, in deg/s."""
        size = kind.flicker_dps
        return Disturbance(
            self.tilt_g, self.walk_dps * size, self.unlogged_dps * size, self.hysteresis_dps * size,
            self.warms_k, self.room_k,
        )  # fmt: skip


#: Sizes in multiples of the drift of the type.
CELLS: Mapping[str, Disturbance] = {
    "plain": Disturbance(tilt_g=0.0),
    "tilt": Disturbance(tilt_g=0.003),
    "walk": Disturbance(walk_dps=3.0),
    "unlogged temperature": Disturbance(unlogged_dps=30.0),
    "hysteresis": Disturbance(hysteresis_dps=15.0, room_k=8.0),
}


@dataclass(frozen=True)
class Unit:
    """One unit: its type, and the law of each axis in the logged temperature, deg/s, deg/s/K and deg/s/K^2."""

    serial: str
    kind: MemsType
    law: NDArray[np.float64]  #: (3, 3), axis by axis
    answer: Array  #: (3,) of each axis to what is not logged

    @staticmethod
    def made(seed: int, name: str) -> Unit:
        """Return a unit of a type."""
        rng, kind = np.random.default_rng([31, seed]), TYPES[name]
        law = rng.normal(size=(3, 3)) * np.array([kind.bias_dps, kind.per_k, kind.per_k / 60.0])
        return Unit(f"{name}-{seed}", kind, law, rng.choice([-1.0, 1.0], size=3) * rng.uniform(0.4, 1.0, size=3))


def _drift(rng: np.random.Generator, n: int, keep: float) -> Array:
    """Return a first-order process of standard deviation 1, (n,)."""
    found, kicks = np.empty(n), rng.normal(size=n) * np.sqrt(1 - keep**2)
    state = rng.normal()
    for k, kick in enumerate(kicks.tolist()):
        state = keep * state + kick
        found[k] = state
    return found


def _behind(values: Array, tau_s: float) -> Array:
    """Return what follows values, second by second, with a time constant."""
    found, state = np.empty(len(values)), float(values[0])
    for k, value in enumerate(values.tolist()):
        state += (value - state) / tau_s
        found[k] = state
    return found


def _direction(warm: Array, width_k: float) -> Array:
    """Return a state in -1 to 1 that approaches the direction of the temperature over `width_k`."""
    state, found = 0.0, np.zeros(len(warm))
    for k, step in enumerate(np.diff(warm).tolist(), start=1):
        state += (np.sign(step) - state) * -np.expm1(-abs(step) / width_k)
        found[k] = state
    return found


def record(unit: Unit, what: Disturbance, number: int, *, seed: int, hours: float = HOURS) -> Recording:
    """Return record `number` of a unit, as one data set at rest; `t_s` counts from 1970, as loggers write it.

    The plate under the unit leans with the heat around it, so that the accelerometer follows what is not logged.
    """
    rng, sized = np.random.default_rng([32, seed, number]), what.of_type(unit.kind)
    seconds = np.arange(hours * 3600.0)
    n, hour = len(seconds), seconds / 3600.0
    room = 24.0 + rng.normal() + what.room_k / 2 * np.sin(2 * np.pi * (hour / rng.uniform(1.8, 3.0) + rng.uniform()))
    warm = _behind(room, 600.0) + what.warms_k * -np.expm1(-seconds / 900.0)
    inside = _drift(rng, n, float(np.exp(-1 / 1500.0)))
    inside = _behind(inside, 300.0)
    state = _direction(warm, 1.0)
    began = datetime(2026, 3, 1 + number, 8, tzinfo=UTC)
    at = np.arange(0.0, seconds[-1], 1 / RATE_HZ)
    columns: dict[str, Array] = {
        "t_s": began.timestamp() + at,
        "temperature_c": np.round((np.interp(at, seconds, warm) + rng.normal(size=len(at)) * 0.02) * 340) / 340,
    }
    lean = 0.5 * (room - 24.0) / max(what.room_k / 2, 0.5) + 0.8 * inside
    for k, (axis, force) in enumerate(zip(AXES, (sized.tilt_g, -0.7 * sized.tilt_g, 0.0), strict=True)):
        gravity = (1.0 if axis == "z" else 0.01) + force * np.interp(at, seconds, lean)
        columns[f"accel_{axis}_g"] = gravity + rng.normal(size=len(at)) * 2e-3
        u = warm - 25.0
        slow = unit.law[k, 0] + unit.law[k, 1] * u + unit.law[k, 2] * u**2
        slow = slow + unit.kind.flicker_dps * _drift(rng, n, float(np.exp(-1 / 1200.0)))
        slow = slow + sized.walk_dps / 60.0 * np.cumsum(rng.normal(size=n))
        slow = slow + unit.answer[k] * (sized.unlogged_dps * inside + sized.hysteresis_dps * state)
        slow = slow + 0.3 * sized.walk_dps * rng.normal()  # it went on while the unit was off
        reading = np.interp(at, seconds, slow) + rng.normal(size=len(at)) * unit.kind.white * np.sqrt(RATE_HZ)
        step = unit.kind.step_dps
        columns[f"gyro_{axis}"] = np.round(reading / step) * step if step else reading
    info = RecordingInfo(
        serial=unit.serial, axes=AXES, kind="samples", motion="rest", technology="mems",
        started_at=began, sample_rate_hz=RATE_HZ,
    )  # fmt: skip
    one = np.ones(len(at), dtype=np.int64)
    whole = {"dataset": one, **columns, "run": one, "mounting": one, "position": np.full(len(at), "z")}
    return Recording(info, {**whole, "table_rate_dps": np.zeros(len(at))})
