"""The error of a fitted model at given true rates, for laws of the true rate and for laws of the output alike."""

from __future__ import annotations

import numpy as np

from labctl.fitting.data.channels import Channels
from labctl.fitting.models.fitted_model import FittedModel
from labctl.fitting.models.inversion import NotConverged
from labctl.fitting.numeric.arrays import Array

#: Rounds in which a law of the output is solved for the output; each shrinks the rest a hundredfold or so.
ROUNDS, CLOSE_DPS = 100, 1e-12


def errors_at_true_rates(fitted: FittedModel, channels: Channels) -> dict[str, Array]:
    """Return the modelled error of every axis, axis -> (n,) deg/s, where `channels` has the true rates.

    For a law of the output these are the outputs that it corrects to the true rates, minus those. Raises NotConverged
    where there are none.
    """
    if fitted.model.argument == "rate":
        return {axis: fitted.error_dps(channels, axis) for axis in fitted.axes}
    errors: dict[str, Array] = {axis: np.zeros(len(channels)) for axis in fitted.axes}
    fastest = max(float(np.max(np.abs(rate), initial=0.0)) for rate in channels.rates.values())
    for _ in range(ROUNDS):
        with_errors = channels.with_rates(
            {**channels.rates, **{axis: channels.rates[axis] + errors[axis] for axis in errors}}
        )
        error_at_rate = {axis: fitted.error_dps(with_errors, axis) for axis in errors}
        change = max(float(np.max(np.abs(error_at_rate[axis] - errors[axis]), initial=0.0)) for axis in errors)
        errors = error_at_rate
        if change < CLOSE_DPS * max(1.0, fastest):
            return errors
    raise NotConverged(
        f"model {fitted.model.name!r} gives no output for some true rates within its calibrated range: the last "
        f"iteration still changed the output by {change:.3g} deg/s; fit the model as a function of the true "
        "rate (`labctl improve`)"
    )
