"""What data sets at rest say: repeatability from one switching-on to the next, and the sensitivity to gravity."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.characteristics.estimate import Estimate
from labctl.fitting.numeric.arrays import Array
from labctl.recording.positions import up_in

AXES = ("x", "y", "z")


def repeatability(groups: Iterable[Mapping[int, float]]) -> tuple[Estimate, int] | None:
    """Return the standard deviation of a figure from run to run and how many runs; None where no group has two.

    Each group has run -> figure, at one temperature and position. The standard uncertainty of a standard deviation s
    from f degrees of freedom is s / sqrt(2 f) (GUM, E.4.3).
    """
    squares, freedom = 0.0, 0
    runs: set[int] = set()
    for group in groups:
        if len(group) < 2:
            continue
        values = np.array(list(group.values()))
        squares += float(np.sum((values - values.mean()) ** 2))
        freedom += len(values) - 1
        runs |= set(group)
    if not freedom:
        return None
    size = float(np.sqrt(squares / freedom))
    return Estimate(size, size / float(np.sqrt(2 * freedom))), len(runs)


def g_sensitivity(position: NDArray[np.str_], error_dps: Array) -> tuple[Estimate, Estimate, Estimate] | None:
    """Return the change of the output per g of specific force along x, y and z, deg/s/g, of one output axis.

    At rest with a body axis up the specific force is 1 g along it. `error_dps`, (m,), is the output without the
    Earth's rate. None unless each axis has pointed up and down: only then gravity differs from bias.
    """
    up = np.column_stack([up_in(position, axis) for axis in AXES])
    if not all(np.any(up[:, i] == end) for i in range(len(AXES)) for end in (1.0, -1.0)):
        return None
    columns = np.column_stack([np.ones(len(position)), up])
    coefficients, *_ = np.linalg.lstsq(columns, error_dps, rcond=None)
    residual = error_dps - columns @ coefficients
    freedom = len(error_dps) - 4
    variance = float(residual @ residual) / freedom
    u = np.sqrt(np.diag(np.linalg.inv(columns.T @ columns)) * variance)
    x, y, z = (Estimate(float(value), float(one)) for value, one in zip(coefficients[1:], u[1:], strict=True))
    return x, y, z
