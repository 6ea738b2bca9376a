"""Validity of a fit in rate: the rates that were measured, or none where nothing of it depends on the rate."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from labctl.fitting.data.channels import BODY_AXES, Channels
from labctl.fitting.data.fit_data import FitData
from labctl.fitting.estimation.published.common import full_range_dps
from labctl.fitting.models.error_model import ErrorModel
from labctl.fitting.models.fitted_model import FittedModel

#: Data sets at which regressors are compared, and rates, as shares of the fastest measured one.
MOST_ROWS, SHARES = 64, (-1.0, -0.5, 0.0, 0.5, 1.0)
#: A pair of rates in JSON: null means that there is no limit.
RateLimits = tuple[float | None, float | None]


def valid_rates_dps(fitted: FittedModel, data: FitData) -> RateLimits:
    """Return the range of true rates over all recorded axes, deg/s; (None, None) for a model without a rate in it.

    Only what is exported counts: the rest of the model is not applied where the unit is used. Where all that depends on
    the rate is held, it is valid at the rates of the unit, as published coefficients are.
    """
    exported, _ = fitted.exported()
    if not depends_on_rate(exported.model, data):
        return None, None
    ranges = [data.covered.rate_dps[axis] for axis in data.outputs]
    if exported.model.held.axes and not depends_on_rate(exported.model, data, held=False):
        ranges.append(full_range_dps(data.info))
    return min(low for low, _ in ranges), max(high for _, high in ranges)


def depends_on_rate(model: ErrorModel, data: FitData, *, held: bool = True) -> bool:
    """Return whether a regressor of a model changes with the rate, on any recorded axis.

    Without `held`, the regressors of held coefficients do not count.
    """
    rows = np.unique(np.linspace(0, len(data) - 1, min(len(data), MOST_ROWS)).astype(np.int64))
    channels = data.channels.take(rows)
    fastest = max(1.0, *(abs(end) for axis in data.outputs for end in data.covered.rate_dps[axis]))
    seen = [_at_rate(channels, share * fastest) for share in SHARES]
    for axis in data.outputs:
        first, *others = [
            [c.values for owner, c in model.columns(each, axis) if held or model.held.of(axis, owner, c.name) is None]
            for each in seen
        ]
        for other in others:
            if len(other) != len(first) or not all(map(np.array_equal, first, other)):
                return True
    return False


def _at_rate(channels: Channels, rate_dps: float) -> Channels:
    """Return channels in which the table and every body axis turn at one rate."""
    rate = np.full(len(channels), rate_dps)
    columns = {**channels.columns, "table_rate_dps": rate}
    return replace(channels, columns=columns, rates=dict.fromkeys(BODY_AXES, rate))
