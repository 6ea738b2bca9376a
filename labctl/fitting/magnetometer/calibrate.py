"""Hard and soft iron of a magnetometer with their covariance, and whether the field was constant."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from labctl.errors import NotEnoughData
from labctl.fitting.magnetometer.ellipsoid import (
    PARAMETERS,
    PLACES,
    Ellipsoid,
    at,
    nearest_ellipsoid,
    quadric,
    unweighed,
)
from labctl.fitting.magnetometer.places import Places, Weights
from labctl.fitting.magnetometer.rest_scatter import RestScatter, scatter_of
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.degrees_of_freedom import combined_freedom, expanded_u

AXES = ("x", "y", "z")
MIN_READINGS = 60
#: An offset relative to the field, or an element of the matrix, that is less certain than this is not determined.
LARGEST_U = 0.02
#: A reading further from the ellipsoid than this many robust standard deviations is left out.
WRONG = 5.0
ROUNDS = 8
#: More than this share of readings left out is a disturbed field.
MAX_LEFT_OUT = 0.05
#: Left-out readings are predicted from the others in this many blocks of time.
BLOCKS = 10
#: Error of left-out readings over their noise from which on the model leaves more than noise.
UNEXPLAINED = 1.5
#: That is more than a filter in the sensor where the distances stay alike over this share of the record and more.
ALIKE_SHARE = 1 / 40
#: Directions of the sphere that are searched for the largest gap.
DIRECTIONS = 1000
Verdict = Literal["adequate", "unexplained"]


@dataclass(frozen=True)
class Magnetometer:
    """A calibrated magnetometer: field = soft iron (reading - hard iron), in the axes of the sensor."""

    hard_iron_ut: Array  #: (3,)
    soft_iron: NDArray[np.float64]  #: (3, 3), symmetric
    field_ut: (
        float  #: size of the field in the unit of the readings, where it was not given: soft iron of determinant 1
    )
    covariance: NDArray[np.float64]  #: (10, 10) of hard iron, soft iron in the order of PLACES, and field
    u_freedom: Array  #: (10,) degrees of freedom of the standard uncertainties
    used: NDArray[np.bool_]  #: (n,)
    noise_ut: float  #: of a reading from one to the next
    residual_ut: float  #: root mean square of the distances from the ellipsoid
    heldout_ut: float  #: the same of readings predicted from those of other times
    before_ut: float  #: root mean square by which the size of the raw readings scatters
    repetition: float  #: readings that tell as much as one independent one
    largest_gap_deg: float  #: from any direction to the next that was measured
    gap: Array  #: (3,) the middle of the largest gap

    @property
    def u(self) -> Array:
        """Standard uncertainties of hard iron, soft iron and field, (10,)."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))

    @property
    def expanded(self) -> Array:
        """U for 95.45 %, (10,)."""
        return expanded_u(self.u, self.u_freedom)

    @property
    def heading_error_deg(self) -> float:
        """Angle to which the held-out error turns a field that is square to it, deg."""
        return float(np.degrees(self.heldout_ut / self.field_ut))

    @property
    def left_out_share(self) -> float:
        return float(1 - self.used.mean())

    @property
    def verdict(self) -> Verdict:
        alike = self.repetition > ALIKE_SHARE * np.count_nonzero(self.used)
        more = alike and self.heldout_ut > UNEXPLAINED * self.noise_ut
        return "unexplained" if more or self.left_out_share > MAX_LEFT_OUT else "adequate"


def calibrate_magnetometer(
    subject: str, readings_ut: NDArray[np.float64], field_ut: float | None = None, rest: NDArray[np.int64] | None = None
) -> Magnetometer:
    """Fit hard and soft iron to readings (n, 3), uT, in order of time, of turns in a constant field.

    `field_ut` is its size; without it the matrix has the determinant 1. `rest` (n,) numbers the rests from 1, 0 between
    them, where they are known: the field of a place is one error of all readings of a rest, and changes on the way to
    the next (`Places`). Raises NotEnoughData, naming what to do.
    """
    if len(readings_ut) < MIN_READINGS:
        raise NotEnoughData(
            f"{subject}: {len(readings_ut)} readings of a magnetometer; nine parameters need {MIN_READINGS} and "
            "more: "
            "turn it slowly through all directions"
        )
    ellipsoid, used = _robust(subject, readings_ut)
    places, scatter = None, None
    if rest is not None and np.any(rest[used]):
        places = Places.of(rest[used])
        ellipsoid, scatter = _weighed(subject, readings_ut[used], ellipsoid, places)
    repetition = _repetition(ellipsoid.distance)
    values, by_parameter = _values(ellipsoid.parameters, field_ut)
    normal = by_parameter @ np.linalg.inv(ellipsoid.jacobian.T @ ellipsoid.jacobian) @ by_parameter.T
    if scatter is None:
        total, freedom = _by_repetition(ellipsoid, repetition, normal)
    else:
        total, freedom = scatter.covariance(by_parameter), scatter.freedom(by_parameter)
    soft = np.zeros((3, 3))
    for value, (i, j) in zip(values[3:9], PLACES, strict=True):
        soft[i, j] = soft[j, i] = value
    field = (readings_ut[used] - ellipsoid.centre) @ ellipsoid.matrix
    gap, angle = largest_gap(field)
    size = np.linalg.norm(readings_ut[used], axis=1)
    result = Magnetometer(
        values[:3], soft, float(values[9]), total, freedom, used,
        float(np.sqrt(np.mean(np.diff(ellipsoid.distance) ** 2) / 2)), float(np.sqrt(np.mean(ellipsoid.distance**2))),
        _held_out(readings_ut[used], ellipsoid, places, scatter), float(size.std()), repetition, angle, gap,
    )  # fmt: skip
    _require_determined(subject, result, np.sqrt(np.maximum(np.diag(normal), 0.0)))
    return result


def _by_repetition(
    ellipsoid: Ellipsoid, repetition: float, normal: NDArray[np.float64]
) -> tuple[NDArray[np.float64], Array]:
    """Return the covariance (10, 10) by as many independent readings as the autocorrelation leaves, and its freedom."""
    n = len(ellipsoid.distance)
    # as few independent readings as there are have given nine of them to the parameters, and so look quieter
    fewer = max(n - PARAMETERS, 1) / max(n - PARAMETERS * repetition, n / 10)
    total = ellipsoid.noise**2 * repetition * fewer * normal
    variance = np.diag(total)
    return total, combined_freedom(variance, [(variance, max(n / repetition - PARAMETERS, 1.0))])


def _robust(subject: str, readings: NDArray[np.float64]) -> tuple[Ellipsoid, NDArray[np.bool_]]:
    is_used = np.ones(len(readings), dtype=np.bool_)
    ellipsoid: Ellipsoid | None = None
    for _ in range(ROUNDS):
        start = quadric(readings[is_used]) if ellipsoid is None else (ellipsoid.centre, ellipsoid.matrix)
        ellipsoid = None if start is None else nearest_ellipsoid(readings[is_used], *start)
        if ellipsoid is None:
            raise _undetermined(subject)
        every = at(readings, ellipsoid.centre, ellipsoid.matrix, ellipsoid.noise).distance
        usual = 1.4826 * float(np.median(np.abs(every[is_used])))
        right = np.abs(every) <= WRONG * max(usual, 1e-12)
        if np.array_equal(right, is_used) or np.count_nonzero(right) < MIN_READINGS:
            break
        is_used = right
    assert ellipsoid is not None
    last = nearest_ellipsoid(readings[is_used], ellipsoid.centre, ellipsoid.matrix)
    return (ellipsoid if last is None else last), is_used


def _undetermined(subject: str) -> NotEnoughData:
    return NotEnoughData(
        f"{subject}: the readings lie on no ellipsoid that they determine; turn the unit slowly through all "
        "directions (each axis up and down, and turned in each), away from iron and currents"
    )


def _weighed(
    subject: str, readings: NDArray[np.float64], ellipsoid: Ellipsoid, places: Places
) -> tuple[Ellipsoid, RestScatter]:
    """Return the ellipsoid by generalised least squares, readings weighed by what their places share, and the scatter.

    An error that a variance is estimated from is then none of the parameters': U is not large where they are wrong.
    Raises NotEnoughData where there is none: the scatter says nothing of an ellipsoid by equal weights.
    """
    scatter = scatter_of(ellipsoid.jacobian, ellipsoid.distance, places)
    product = Weights.of(places, scatter.ratios).product
    weighed = nearest_ellipsoid(readings, ellipsoid.centre, ellipsoid.matrix, product)
    if weighed is None:
        raise _undetermined(subject)
    # once is enough: a second round changes the variances by less than a thousandth
    return weighed, scatter_of(weighed.jacobian, weighed.distance, places)


def _repetition(distance: Array) -> float:
    """Return the sum of the autocorrelation of distances (n,), 1 and more: pairs of lags as long as they add something.

    Geyer 1992, initial positive sequence.
    """
    n = len(distance)
    padded = np.fft.rfft(distance - distance.mean(), 2 * n)
    correlation = np.fft.irfft(np.abs(padded) ** 2)[: n // 2]
    if not correlation[0] > 0:
        return 1.0
    correlation = correlation / correlation[0]
    pairs = correlation[1 : len(correlation) // 2 * 2 - 1].reshape(-1, 2).sum(axis=1)
    ends = np.flatnonzero(pairs <= 0)
    return float(max(1 + 2 * pairs[: ends[0] if len(ends) else len(pairs)].sum(), 1.0))


def _values(parameters: Array, field_ut: float | None) -> tuple[Array, NDArray[np.float64]]:
    """Return hard iron, soft iron and field, (10,), of centre and matrix, and their derivative (10, 9)."""

    def of(values: Array) -> Array:
        a, b, c, d, e, f = values[3:]
        determinant = a * (b * c - f * f) - d * (d * c - f * e) + e * (d * f - b * e)
        field = float(np.cbrt(1 / determinant)) if field_ut is None else field_ut
        return np.concatenate([values[:3], values[3:] * field, [field]])

    return of(parameters), _derivative(of, parameters)


def _derivative(of: Callable[[Array], Array], at_parameters: Array) -> NDArray[np.float64]:
    columns = []
    for k, value in enumerate(at_parameters):
        step = np.zeros(len(at_parameters))
        step[k] = 1e-6 * max(abs(float(value)), float(np.abs(at_parameters[3:6]).max()) if k >= 3 else 1.0)
        columns.append((of(at_parameters + step) - of(at_parameters - step)) / (2 * step[k]))
    return np.column_stack(columns)


def _held_out(
    readings: NDArray[np.float64], ellipsoid: Ellipsoid, places: Places | None, scatter: RestScatter | None
) -> float:
    """Return the root mean square distance of each block of time from the ellipsoid of all others, uT."""
    squares = []
    for block in np.array_split(np.arange(len(readings)), BLOCKS):
        others = np.delete(np.arange(len(readings)), block)
        weighed = unweighed
        if places is not None and scatter is not None:
            weighed = Weights.of(places.kept(others), scatter.ratios).product
        without = nearest_ellipsoid(readings[others], ellipsoid.centre, ellipsoid.matrix, weighed)
        if without is None:  # what only this block shows is not held out
            without = ellipsoid
        squares.append(at(readings[block], without.centre, without.matrix, without.noise).distance ** 2)
    return float(np.sqrt(np.mean(np.concatenate(squares))))


def largest_gap(field: NDArray[np.float64]) -> tuple[Array, float]:
    """Return the direction (3,) furthest from all of fields (n, 3), and how far the nearest is from it, deg."""
    k = np.arange(DIRECTIONS) + 0.5
    z, turn = 1 - 2 * k / DIRECTIONS, np.pi * (1 + np.sqrt(5)) * k
    wide = np.sqrt(1 - z**2)
    sphere = np.column_stack([wide * np.cos(turn), wide * np.sin(turn), z])
    directions = field / np.linalg.norm(field, axis=1)[:, None]
    nearest = np.full(DIRECTIONS, -1.0)
    for part in np.array_split(directions, max(len(directions) // 2000, 1)):
        nearest = np.maximum(nearest, (sphere @ part.T).max(axis=1))
    worst = int(np.argmin(nearest))
    return sphere[worst], float(np.degrees(np.arccos(np.clip(nearest[worst], -1, 1))))


def in_words(direction: Array) -> str:
    """Return the axes of the sensor that a direction is along, such as '+x -z'."""
    named = [f"{'+' if value > 0 else '-'}{axis}" for axis, value in zip(AXES, direction, strict=True)
             if abs(value) > 0.4]  # fmt: skip
    return " ".join(named)


def _require_determined(subject: str, result: Magnetometer, by_noise: Array) -> None:
    """Raise NotEnoughData where a parameter is uncertain; `by_noise` (10,) is u by a noise of 1 uT."""
    # by the noise alone: what a disturbed field makes uncertain is no want of directions
    alone = min(result.noise_ut, result.residual_ut) * by_noise
    u = np.concatenate([alone[:3] / result.field_ut, alone[3:9]])
    worst = int(np.argmax(u))
    if np.isfinite(u[worst]) and u[worst] <= LARGEST_U:
        return
    names = [f"hard iron {axis} (over the field)" for axis in AXES]
    names += [f"soft iron {AXES[i]}{AXES[j]}" for i, j in PLACES]
    raise NotEnoughData(
        f"{subject}: the readings do not determine {names[worst]} (u = {u[worst]:.2g}, limit {LARGEST_U:g}); the field "
        f"was never nearer than {result.largest_gap_deg:.0f} deg to {in_words(result.gap)} of the sensor: turn that "
        "side "
        "into the field too"
    )
