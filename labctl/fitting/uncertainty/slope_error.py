"""Error of a slope of a model near one temperature: the variance that it leaves and that grows with the rate."""

from __future__ import annotations

import numpy as np

from labctl.fitting.uncertainty.local_model_error import (
    FARTHEST,
    LEAST_SHARE,
    NO_TURNED_AXES,
    NONE_LEFT_OUT,
    NONE_NEAR,
    LocalModelError,
    effective_number,
    near_weights,
)


def slope_error(left: LocalModelError, temperature_c: float, across: str | None = None) -> float | None:
    """Return the standard error of a slope over the rate at a temperature, deg/s per deg/s; None if unknown.

    The slope is that over the rate about the axis itself, or about another body axis (`across`). An error of a slope
    leaves a variance of its square times that of the rate: near the temperature, the variances that are left beyond the
    readings' noise are fitted by a constant and one such term for each body axis, none of them negative. It is no
    smaller than what could be seen.
    """
    if slope_unknown(left, temperature_c, across) is not None:
        return None
    from scipy.optimize import nnls

    known = np.isfinite(left.left_var)
    rates = [left.rate_dps, *(left.across_dps or {}).values()]
    squares = np.stack([np.ones(len(known)), *(each**2 for each in rates)], axis=1)[known]
    weight = near_weights(left.warmth_away(temperature_c)[known])
    root, size = np.sqrt(weight / weight.sum()), np.maximum(squares.max(axis=0), np.finfo(float).tiny)
    beyond = left.left_var[known] - left.white_var[known]
    found = nnls(root[:, None] * (squares / size), root * beyond)[0] / size
    column = 1 if across is None else 2 + list(left.across_dps or {}).index(across)
    turned = weight * (squares[:, column] > 0)
    noise = float(weight @ left.white_var[known] / weight.sum()) + found[0]
    unseen = LEAST_SHARE * np.sqrt(2 / effective_number(turned)) * noise * turned.sum() / (turned @ squares[:, column])
    return float(np.sqrt(max(found[column], unseen)))


def slope_unknown(left: LocalModelError, temperature_c: float, across: str | None = None) -> str | None:
    """Return why the error of a slope is unknown, in words; None where it is known."""
    known = np.isfinite(left.left_var)
    if not known.any():
        return NONE_LEFT_OUT
    if across is not None and left.across_dps is None:
        return NO_TURNED_AXES
    rates = left.rate_dps if across is None else (left.across_dps or {}).get(across, np.zeros(len(known)))
    turned = known & (rates != 0)
    if not turned.any():
        return f"no data set in which the unit turned about {across or 'its own axis'} could be left out of the fit"
    if left.warmth_away(temperature_c)[turned].min() > FARTHEST:
        return NONE_NEAR
    return None
