"""Delay and bandwidth while a model is fitted: where to begin, how far to step, and what was found."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.data.fit_data import FitData
from labctl.fitting.data.response import DELAY, TIME_CONSTANT, Response
from labctl.fitting.effects.response import Bandwidth, TimeDelay
from labctl.fitting.models.error_model import ErrorModel
from labctl.fitting.models.fitted_model import AxisFit, FittedModel, without
from labctl.fitting.numeric.arrays import Array

#: Delays and time constants, s, from which the steps begin: the nearest to the output.
DELAYS_S = tuple(float(at) for at in np.arange(-0.05, 0.2001, 0.005))
TIME_CONSTANTS_S = tuple(float(at) for at in np.geomspace(1e-4, 0.3, 15))
#: A time constant beside a delay: a step leaves at least this share of it.
MIN_REMAINING = 0.25
#: No step goes farther than this, s: data that do not tell a delay from a bias would send it anywhere.
LONGEST_S = 1.0


def response_at(coefficients: Mapping[str, NDArray[np.float64]]) -> Response:
    """Return the response of coefficients, name -> (nodes,); a delay and a time constant are the same at each node."""
    return Response(*(float(coefficients[name][0]) if name in coefficients else 0.0 for name in (DELAY, TIME_CONSTANT)))


def response_of(fit: AxisFit) -> Response:
    """Return the response of a fitted axis: without delay and of any bandwidth where the model has none."""
    return response_at(dict(zip(fit.names, fit.values, strict=True)))


def without_response(fitted: FittedModel) -> FittedModel:
    """Return a fitted model without its delay and bandwidth."""
    for effect_id in (TimeDelay.id, Bandwidth.id):
        if effect_id in fitted.model.effect_ids:
            fitted = without(fitted, effect_id)
    return fitted


def first_response(data: FitData, model: ErrorModel, axis: str) -> Response:
    """Return the response at which the Gauss-Newton steps start: the one of a grid that fits the output best."""
    delayed, limited = TimeDelay.id in model.effect_ids, Bandwidth.id in model.effect_ids
    if data.channels.profile is None or not (delayed or limited) or not np.any(data.channels.up(axis)):
        return Response()
    best = Response()
    if delayed:
        best = _nearest(data, axis, [Response(delay) for delay in DELAYS_S])
    if limited:
        taus = (tau for tau in TIME_CONSTANTS_S)
        best = _nearest(data, axis, [Response(best.delay_s - tau if delayed else 0.0, tau) for tau in taus])
    return best


def next_response(before: Response, target: Response, model: ErrorModel, u_s: float) -> Response:
    """Return the response of the next step, at most 1 s; `u_s` is the time constant's standard uncertainty before, s.

    Beside a delay only the square of a time constant T is seen near 0, where a change of T acts like a change of the
    delay. T times u(T) is half the uncertainty of that square, so the root of it is the least T that differs visibly
    from 0: nearer to 0 a step does not go, and T comes out as half of that with all of it as its u.
    """
    if TimeDelay.id not in model.effect_ids or Bandwidth.id not in model.effect_ids:
        return _within_reach(target)
    seen_s = float(np.sqrt(before.time_constant_s * u_s)) if np.isfinite(u_s) else before.time_constant_s
    least = max(MIN_REMAINING * before.time_constant_s, seen_s)
    if target.time_constant_s >= least:
        return _within_reach(target)
    lag_s = target.delay_s + target.time_constant_s
    return _within_reach(Response(lag_s - least, least))


def _within_reach(response: Response) -> Response:
    return Response(*(float(np.clip(at, -LONGEST_S, LONGEST_S)) for at in (response.delay_s, response.time_constant_s)))


def _nearest(data: FitData, axis: str, responses: list[Response]) -> Response:
    """Return the response at which a straight line through the output leaves the smallest residuals."""

    def left(response: Response) -> float:
        delayed = data.through(response).true_rate_dps(axis)
        delayed, output = delayed - delayed.mean(), data.outputs[axis] - data.outputs[axis].mean()
        along = float(delayed @ output)
        return float(output @ output) - along**2 / max(float(delayed @ delayed), 1e-300)

    return min(responses, key=left)


def with_response(coefficients: dict[str, Array], response: Response) -> dict[str, Array]:
    """Return coefficients, name -> (nodes,), with those of a response in the place of theirs."""
    fitted_s = {DELAY: response.delay_s, TIME_CONSTANT: response.time_constant_s}
    return {name: np.full_like(at, fitted_s[name]) if name in fitted_s else at for name, at in coefficients.items()}
