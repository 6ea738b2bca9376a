"""Units, benches and campaigns of the study of rate vectors: numpy alone, nothing of it is what the fit computes with.

A unit is y = w + E(T) w + b(T) + h(w, T) + noise, with a hidden effect h that no model of the study has. A bench turns
a mounting about a direction that is off by the fixture and the table top, by a clock that is off, beside a thermometer
that is off. All of it is drawn from what the standards state.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

AXES = ("x", "y", "z")
Array = NDArray[np.float64]


@dataclass(frozen=True)
class Plan:
    """What is measured: mountings with their upward axis, table rates and temperatures."""

    name: str
    positions: tuple[str, ...]
    rates_dps: tuple[float, ...]
    temperatures_c: tuple[float, ...]
    turned: tuple[str, ...] = ()  #: further mountings, at the two fastest rates and one temperature

    @property
    def mountings(self) -> tuple[str, ...]:
        """Every position."""
        return (*self.positions, *self.turned)

    @property
    def rows(self) -> list[tuple[str, float, tuple[float, ...]]]:
        """Mountings, temperatures and their rates, in order."""
        middle, ends = self.temperatures_c[len(self.temperatures_c) // 2], (-self.reach_dps, self.reach_dps)
        every = [(position, warm, self.rates_dps) for position in self.positions for warm in self.temperatures_c]
        return [*every, *((position, middle, ends) for position in self.turned)]

    @property
    def reach_dps(self) -> float:
        """The fastest rate."""
        return max(self.rates_dps)


THREE, SIX = ("x", "y", "z"), ("x", "-x", "y", "-y", "z", "-z")
PLANS = (
    Plan("three mountings, 100 deg/s", THREE, tuple(np.linspace(-100, 100, 9)), tuple(np.linspace(-20, 60, 6))),
    Plan("three mountings, 400 deg/s", THREE, tuple(np.linspace(-400, 400, 11)), (-10.0, 15.0, 40.0, 65.0)),
    Plan(
        "six faces, 250 deg/s", SIX, tuple(np.linspace(-250, 250, 7)),
        tuple(np.linspace(0, 50, 5)),
    ),
    Plan(
        "three mountings, each turned by 180 deg too, 400 deg/s", THREE, tuple(np.linspace(-400, 400, 11)),
        (-10.0, 15.0, 40.0, 65.0), ("x@180", "y@180", "z@180"),
    ),
)  # fmt: skip


@dataclass(frozen=True)
class Statement:
    """Standard uncertainties that the bench states; half widths of rectangular distributions where named so."""

    clock_ppm: float = 25.0
    thermometer_c: float = 0.25
    gradient_half_width_c: float = 0.5
    fixture_deg: float = 0.025
    tilt_half_width_deg: float = 0.02
    mounting_deg: float = 0.003
    turn_on_dps: float = 1e-3


@dataclass(frozen=True)
class Unit:
    """The law of one unit over u = (T - 20) / 40 and w over the fastest rate."""

    gain: Array  #: (3, 3), E at 20 deg C
    gain_warm: Array  #: (3, 3) per u
    bias: Array  #: (3, 3) of powers of u, deg/s
    hidden: Array  #: (3, 4) deg/s of: a cubic of the own rate, |own rate|, square of the next rate, cube of u

    @staticmethod
    def of(rng: np.random.Generator, hidden_dps: float) -> Unit:
        """Draw a unit whose hidden effects are about so large."""
        gain = rng.normal(0, 3e-3, (3, 3)) + np.diag(rng.normal(0, 5e-3, 3))
        warm = np.diag(rng.normal(0, 2e-3, 3))
        bias = rng.normal(0, 1, (3, 3)) * np.array([0.1, 0.03, 0.01])
        return Unit(gain, warm, bias, hidden_dps * rng.normal(0, 1, (3, 4)))

    def output(self, rates: Array, warm_c: Array, reach_dps: float) -> Array:
        """Return the outputs, (n, 3) deg/s, without noise, at rates (n, 3) and temperatures (n,)."""
        u, share = (warm_c - 20.0) / 40.0, rates / reach_dps
        linear = rates @ self.gain.T + u[:, None] * (rates @ self.gain_warm.T)
        offset = np.stack([np.ones_like(u), u, u**2], axis=1) @ self.bias.T
        h = self.hidden
        left = h[:, 0] * share**3 + h[:, 1] * np.abs(share) + h[:, 2] * np.roll(share, -1, axis=1) ** 2
        return np.asarray(rates + linear + offset + left + u[:, None] ** 3 * h[:, 3])


@dataclass(frozen=True)
class Bench:
    """Errors of one bench, true minus stated or indicated minus true as named."""

    clock: float  #: the table turns by 1 / (1 + clock) of what is indicated
    warm_c: float  #: indicated minus true
    lean: dict[str, Array]  #: position -> (3,) the axis of rotation in the frame of the case

    @staticmethod
    def of(rng: np.random.Generator, stated: Statement, positions: tuple[str, ...]) -> Bench:
        """Draw a bench by what it states; each face lies on the table top in one of four directions.

        `x@180` is the unit turned by 180 deg on the face that holds it with x up, `x@0/180` the fixture on the table.
        """
        warm = rng.normal(0, stated.thermometer_c) + rng.uniform(-1, 1) * stated.gradient_half_width_c
        top = np.radians(rng.uniform(-1, 1, 2) * stated.tilt_half_width_deg)
        lean = {}
        faces: dict[str, tuple[Array, Array]] = {}
        for position in positions:
            end, _, angles = position.partition("@")
            of_unit, _, of_fixture = angles.partition("/")
            number, sign = AXES.index(end[-1]), -1.0 if end.startswith("-") else 1.0
            if end not in faces:
                quarter = 90 * int(rng.integers(4))
                faces[end] = np.radians(rng.normal(0, stated.fixture_deg, 2)), _seen(top, quarter)
            face, below = faces[end]
            unit_deg = sign * float(of_unit or 0)
            two = _seen(face + _seen(below, sign * float(of_fixture or 0)), unit_deg)
            two = two + np.radians(rng.normal(0, stated.mounting_deg, 2))
            axis = np.zeros(3)
            axis[[(number + 1) % 3, (number + 2) % 3]] = two
            axis[number] = sign * np.sqrt(1 - two @ two)
            lean[position] = axis
        return Bench(1e-6 * float(rng.normal(0, stated.clock_ppm)), float(warm), lean)


def _seen(direction: Array, turned_deg: float) -> Array:
    """Return a level direction (2,) in a frame that is turned above it, counter-clockwise."""
    turned = np.radians(turned_deg)
    return np.array([[np.cos(turned), np.sin(turned)], [-np.sin(turned), np.cos(turned)]]) @ direction


@dataclass(frozen=True)
class Noise:
    """White noise of a mean and drift, deg/s, and the correlation time of the drift, s."""

    white_dps: float = 3e-4
    drift_dps: float = 6e-4
    tau_s: float = 1800.0

    def drift(self, t_s: Array, rng: np.random.Generator) -> Array:
        """Return an Ornstein-Uhlenbeck drift of three axes at rising times, (n, 3) deg/s."""
        found = np.empty((len(t_s), 3))
        value, before = rng.normal(size=3), t_s[0]
        for i, now in enumerate(t_s):
            kept = np.exp(-(now - before) / self.tau_s)
            value, before = kept * value + np.sqrt(1 - kept**2) * rng.normal(size=3), now
            found[i] = value * self.drift_dps
        return found


def campaign(
    unit: Unit, bench: Bench, plan: Plan, noise: Noise, turn_on_dps: float, rng: np.random.Generator,
    *, reach_dps: float | None = None,
) -> dict[str, NDArray[np.generic]]:  # fmt: skip
    """Return the columns of a recording of means over one minute, by what the bench indicates.

    The unit's law is over `reach_dps`; absent: the plan's fastest rate.
    """
    rows = [(position, warm, rate) for position, warm, rates in plan.rows for rate in rng.permutation(rates)]
    n = len(rows)
    t_s = 75.0 * np.arange(n) + 5400.0 * np.repeat(np.arange(len(plan.rows)), [len(rates) for *_, rates in plan.rows])
    warm = np.array([row[1] for row in rows]) + rng.normal(0, 0.02, n)
    rates = np.array([row[2] / (1 + bench.clock) * bench.lean[row[0]] for row in rows])
    output = unit.output(rates, warm, reach_dps or plan.reach_dps) + rng.normal(0, noise.white_dps, (n, 3))
    output += noise.drift(t_s, rng) + rng.normal(0, turn_on_dps, 3)
    columns: dict[str, NDArray[np.generic]] = {
        "dataset": np.arange(1, n + 1), "t_s": t_s, "run": np.ones(n, dtype=np.int64),
        "position": np.array([row[0] for row in rows]), "table_rate_dps": np.array([row[2] for row in rows]),
        "chamber_c": warm + bench.warm_c, "n": np.full(n, 100),
    }  # fmt: skip
    for number, axis in enumerate(AXES):
        columns |= {f"gyro_{axis}": output[:, number], f"gyro_{axis}_std": np.full(n, 10 * noise.white_dps)}
    return columns


def in_ball(rng: np.random.Generator, n: int, reach_dps: float) -> Array:
    """Return n rate vectors, (n, 3) deg/s, uniform in the ball up to a rate."""
    direction = rng.normal(size=(n, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    return np.asarray(direction * reach_dps * rng.uniform(0, 1, (n, 1)) ** (1 / 3))
