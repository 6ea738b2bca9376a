"""What a version promises of each axis, and how far an axis may be from it before it is said to be off.

The expected error of a version is one figure over all axes. Of one axis it is that figure times the share of the axis
in what the version leaves of its own data. An axis is off where the ratio of its RMS error to that is beyond a quantile
of F, at a level shared by the axes (Sidak): of versions that hold, at most FALSE_ALARM have any axis that is off.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri, fdtri

from labctl.json_types.models import AxisCoefficients
from labctl.recording import Recording
from labctl.services.schemas.criticism import AxisVerification

Array = NDArray[np.float64]
#: Largest share of recordings of versions that hold in which any axis is said to be off.
FALSE_ALARM = 0.05
#: Least limit of the error found over the error expected: coverage factor of 95 %.
LARGEST_RATIO = 2.0
#: Temperatures within this range are one level: the errors of their data sets are taken as one, K.
LEVEL_K = 5.0


@dataclass(frozen=True)
class OwnError:
    """What a version leaves of one axis of its own data: `rms_dps`, and its degrees of freedom."""

    rms_dps: float
    freedom: int


def own_errors(
    errors: Mapping[str, Sequence[Array]], coefficients: Mapping[str, AxisCoefficients]
) -> dict[str, OwnError]:
    """Return axis -> what a version leaves of its own data sets, (m,) deg/s of each of its recordings.

    It is {} where an axis has no more data sets than coefficients, or no error: one expectation then serves all axes.
    """
    found = {}
    for axis, parts in errors.items():
        values = np.concatenate(list(parts))
        freedom = len(values) - _number(coefficients.get(axis))
        found[axis] = OwnError(rms(values), freedom)
    return found if all(each.freedom > 0 and each.rms_dps > 0 for each in found.values()) else {}


def _number(axis: AxisCoefficients | None) -> int:
    """Return the number of coefficients of an axis; a table over the temperature has one at each of its nodes."""
    n = 0
    for name, entry in (axis["coefficients"] if axis is not None else {}).items():
        if name != "temperature_c" and isinstance(entry, dict):
            n += len(entry["value"]) if isinstance(entry["value"], list) else 1
    return n


def judged(
    errors: Mapping[str, Array],
    expected_dps: float | None,
    own: Mapping[str, OwnError],
    groups: int,
    mounted_dps: Mapping[str, float] | None = None,
) -> dict[str, AxisVerification]:
    """Return the figures of each axis, (m,) deg/s, beside what is expected of it: `expected_dps` over all axes.

    `groups` is the number of parts of the recording whose errors are independent of each other; `mounted_dps`, by axis,
    what its mountings add, which are not those of the fit.
    """
    pooled = math.sqrt(sum(own[axis].rms_dps ** 2 for axis in errors) / len(errors)) if own else 0.0
    found = {}
    for axis, values in errors.items():
        size, expected, limit = rms(values), None, None
        if expected_dps is not None:
            expected = expected_dps * own[axis].rms_dps / pooled if own else expected_dps
            expected = math.hypot(expected, (mounted_dps or {}).get(axis, 0.0))
            limit = expected * largest_ratio(len(errors), groups, own[axis].freedom if own else None)
        found[axis] = AxisVerification(
            rms_dps=size, max_dps=float(np.max(np.abs(values))), bias_dps=float(np.mean(values)),
            expected_dps=expected, limit_dps=limit, ok=None if limit is None else size <= limit,
        )  # fmt: skip
    return found


def largest_ratio(axes: int, groups: int, freedom: int | None) -> float:
    """Return the largest ratio of the error found to the error expected of an axis that holds, one of `axes`.

    `groups` as in `judged`; `freedom`: degrees of freedom of the expected error, None where it is taken as exact.
    """
    level = 1 - (1 - FALSE_ALARM) ** (1 / axes)
    square = chdtri(groups, level) / groups if freedom is None else fdtri(groups, freedom, 1 - level)
    return max(LARGEST_RATIO, math.sqrt(float(square)))


def independent_groups(points: Recording) -> int:
    """Return the number of powered sessions times temperature levels of a recording, at least 1."""
    n = len(points)
    runs = np.asarray(points.columns.get("run", np.ones(n)))
    warm = np.asarray(points.columns.get("temperature_c", np.zeros(n)), dtype=np.float64)
    found = 0
    for run in np.unique(runs):
        reached = -np.inf
        for each in np.sort(warm[runs == run]).tolist():
            if each > reached:
                found, reached = found + 1, each + LEVEL_K
    return max(found, 1)


def rms(values: Array) -> float:
    """Return the root mean square."""
    return math.sqrt(float(np.mean(values**2)))
