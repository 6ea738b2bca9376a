"""Lines of a budget that are evaluated from the recording: coefficients, model and repeatability."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from labctl.fitting.models.fitted_model import FittedModel
from labctl.fitting.models.presets import POSES
from labctl.fitting.uncertainty.budget import BudgetLine
from labctl.fitting.uncertainty.local_model_error import (
    FARTHEST,
    MIN_SHARE,
    NO_TURNED_AXES,
    NONE_LEFT_OUT,
    NONE_NEAR,
    LocalModelError,
    effective_number,
    near_weights,
)
from labctl.fitting.uncertainty.sensitivity import CoefficientFunction, u_of_fit
from labctl.fitting.uncertainty.use import AxisEvidence


def slope_error(model_error: LocalModelError, temperature_c: float, across: str | None = None) -> float | None:
    """Return the standard error of a slope over the rate at a temperature, deg/s per deg/s; None if unknown.

    The slope is that over the rate about the axis itself, or about another body axis (`across`). An error of a slope
    leaves a variance of its square times that of the rate: near the temperature, the variances that are left beyond the
    readings' noise are fitted by a constant and one such term for each body axis, none of them negative. It is no
    smaller than what could be seen.
    """
    if slope_unknown(model_error, temperature_c, across) is not None:
        return None
    from scipy.optimize import nnls

    is_finite = np.isfinite(model_error.left_var)
    rates = [model_error.rate_dps, *(model_error.across_dps or {}).values()]
    squares = np.stack([np.ones(len(is_finite)), *(rate**2 for rate in rates)], axis=1)[is_finite]
    weight = near_weights(model_error.warmth_away(temperature_c)[is_finite])
    root, size = np.sqrt(weight / weight.sum()), np.maximum(squares.max(axis=0), np.finfo(float).tiny)
    beyond = model_error.left_var[is_finite] - model_error.white_var[is_finite]
    slope_variance = nnls(root[:, None] * (squares / size), root * beyond)[0] / size
    column = 1 if across is None else 2 + list(model_error.across_dps or {}).index(across)
    turning_weight = weight * (squares[:, column] > 0)
    noise = float(weight @ model_error.white_var[is_finite] / weight.sum()) + slope_variance[0]
    unseen = (
        MIN_SHARE
        * np.sqrt(2 / effective_number(turning_weight))
        * noise
        * turning_weight.sum()
        / (turning_weight @ squares[:, column])
    )
    return float(np.sqrt(max(slope_variance[column], unseen)))


def slope_unknown(model_error: LocalModelError, temperature_c: float, across: str | None = None) -> str | None:
    """Return why the error of a slope is unknown, in words; None where it is known."""
    is_finite = np.isfinite(model_error.left_var)
    if not is_finite.any():
        return NONE_LEFT_OUT
    if across is not None and model_error.across_dps is None:
        return NO_TURNED_AXES
    rates = (
        model_error.rate_dps if across is None else (model_error.across_dps or {}).get(across, np.zeros(len(is_finite)))
    )
    is_turning = is_finite & (rates != 0)
    if not is_turning.any():
        return f"no data set in which the unit turned about {across or 'its own axis'} could be left out of the fit"
    if model_error.warmth_away(temperature_c)[is_turning].min() > FARTHEST:
        return NONE_NEAR
    return None


#: Why a part is unknown.
PUBLISHED = "published coefficients come without uncertainties"
HELD_WITHOUT_U = "held coefficients come without uncertainties ({}): add u to each of them and fit again"
NO_DATA_SETS = "published coefficients have no data sets from which it could be estimated"
NOT_KEPT = "the version was made by an older version of labctl, which did not store it: fit it again"
BY_HAND = (
    "the rate during turns between rests is not known, so it cannot be estimated; measure the unit on a table as well"
)
NO_POWER_ON = "only one power-on was recorded, and neither a data sheet nor a static record gives the repeatability"
BY_COVARIANCE = "by the covariance matrix of the fit: correlations of the coefficients are included"
BY_HELD_OUT = "by temperatures and rates left out of the fit in turn; the drift of the campaign is included"
SLOPE_HELD_OUT = (
    "by what grows with the rate near this temperature, at temperatures and rates left out of the fit in turn"
)


def coefficient_line(
    fitted: FittedModel, law: CoefficientFunction, temperature_c: float, evidence: AxisEvidence | None, unit_symbol: str
) -> BudgetLine:
    """Return the line of the fitted coefficients: their uncertainty in the result of the law, in `unit_symbol`."""
    u = u_of_fit(law, fitted, temperature_c)
    held = fitted.model.held
    reason = PUBLISHED if u is None else BY_COVARIANCE
    if unstated := held.without_u(law.axis):
        reason = HELD_WITHOUT_U.format(", ".join(unstated))
    fit = fitted.axes[law.axis]
    estimated = [name for name, owner in zip(fit.names, fit.effects, strict=True) if not held.of(law.axis, owner, name)]
    count = len(estimated) * fit.values.shape[1]
    freedom = max(len(evidence.model_error.rate_dps) - count, 1) if evidence else None
    return BudgetLine("coefficients", "fit", "A", "normal", u, unit_symbol, 1.0, u, freedom, why=reason)


def model_line(
    fitted: FittedModel,
    axis: str,
    evidence: AxisEvidence | None,
    rates_dps: Mapping[str, float],
    temperature_c: float,
) -> BudgetLine:
    """Return the line of what the model leaves in one output near a rate vector, body axis -> deg/s, in deg/s.

    Its degrees of freedom are taken as infinite: the estimate has a floor that covers its own scatter.
    """
    rate_dps, across = rates_dps.get(axis, 0.0), {name: rate for name, rate in rates_dps.items() if name != axis}
    u, reason = (
        evidence.model_error.at_or_why(rate_dps, temperature_c, across) if evidence else (None, _lacking(fitted))
    )
    return BudgetLine("model", "held-out data sets", "A", "normal", u, "deg/s", 1.0, u, why=reason or BY_HELD_OUT)


def slope_line(
    fitted: FittedModel, evidence: AxisEvidence | None, temperature_c: float, across: str | None = None
) -> BudgetLine:
    """Return the line of what the model leaves in a slope of one output at a temperature, a share of the rate.

    The slope over the rate about its own axis, or about another body axis (`across`). An unknown one is said, and not
    in U: a slope is stated beside the uncertainty of the corrected rate, which has no value then.
    """
    error = evidence.model_error if evidence else None
    u = slope_error(error, temperature_c, across) if error else None
    reason = slope_unknown(error, temperature_c, across) if error else _lacking(fitted)
    return BudgetLine(
        "model",
        "held-out data sets",
        "A",
        "normal",
        u,
        "1",
        1.0,
        u,
        is_stated=u is not None,
        why=reason or SLOPE_HELD_OUT,
    )


def repeatability_line(fitted: FittedModel, evidence: AxisEvidence | None) -> BudgetLine:
    """Return the line of a later power-on, deg/s."""
    if evidence is None or evidence.repeatability is None:
        reason = NO_POWER_ON if evidence else _lacking(fitted)
        return BudgetLine("repeatability", "none", "A", "normal", None, "deg/s", 1.0, None, why=reason)
    repeatability = evidence.repeatability
    return BudgetLine(
        "repeatability", repeatability.name, "B" if repeatability.source == "data sheet" else "A",
        repeatability.distribution, repeatability.u_dps,
        "deg/s", 1.0, repeatability.u_dps, repeatability.freedom, why=repeatability.text,
    )  # fmt: skip


def _lacking(fitted: FittedModel) -> str:
    """Return why a version has no evidence."""
    if any(fit.covariance.any() for fit in fitted.axes.values()):
        return BY_HAND if fitted.model.name == POSES else NOT_KEPT
    return NO_DATA_SETS
