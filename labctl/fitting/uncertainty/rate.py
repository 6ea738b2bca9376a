"""Uncertainty of a corrected rate at one rate and temperature, from a fitted model and its error figures alone."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from labctl.errors import BadInput, NotEnoughData
from labctl.fitting.data.channels import BODY_AXES, Channels
from labctl.fitting.models.fitted_model import FittedModel
from labctl.fitting.models.presets import POSES
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.uncertainty.use import AxisEvidence, combined_dps

#: Coverage factor of the expanded uncertainty: about 95 % for a normal distribution (GUM 6.2).
COVERAGE = 2.0
#: Largest rate, deg/s, and temperature, deg C, that are taken for a gyro's.
LARGEST = 1e5
#: Why a part is unknown.
PUBLISHED = "published coefficients come without uncertainties"
NO_DATA_SETS = "published coefficients have no data sets from which it could be estimated"
NOT_KEPT = "the version was made by an older labctl, which did not store it: fit it again"
BY_HAND = (
    "the rate during turns between rests is not known, so it cannot be estimated; measure the unit on a table as well"
)
NO_POWER_ON = "only one power-on was recorded, and neither a data sheet nor a static record gives the repeatability"
#: Step of the numerical derivative of the error along the rate, deg/s.
STEP_DPS = 0.01


@dataclass(frozen=True)
class RateUncertainty:
    """Uncertainties of one axis' corrected rate, deg/s; the noise of a single reading is not included."""

    coefficients_dps: float | None  #: standard, of the coefficients, through the inverted law (GUM 5.2); None: unknown
    model_dps: float | None  #: standard, error of the model and drift near there, by held-out data sets; None: unknown
    repeatability_dps: float | None  #: standard, from one power-on to the next; None: unknown
    repeatability_source: str  #: "between runs", "data sheet", "static record" or "none"
    same_run_dps: float | None  #: of coefficients and model alone: without another power-on
    combined_dps: float | None  #: root of the sum of squares, wider where few runs say it; None where one is unknown
    expanded_dps: float | None  #: combined, times the coverage factor
    unknown: Mapping[str, str]  #: "coefficients", "model" and "repeatability", those that are unknown -> why


def rate_uncertainty(
    fitted: FittedModel,
    rate_dps: float,
    temperature_c: float,
    *,
    evidence: Mapping[str, AxisEvidence],
    name: str,
) -> dict[str, RateUncertainty]:
    """Return axis -> the uncertainty of a corrected rate of `rate_dps` about that axis, the other axes at rest.

    It holds for use on later days. `evidence` is what the calibration's recording shows by axis (`use_evidence`); an
    axis without it is uncertain by an unknown amount. `name` identifies the calibration in messages.
    Raises BadInput for a number that no gyro measures, and where the model needs more than rate and temperature;
    NotEnoughData where the coefficients have no uncertainty.
    """
    for what, value, unit in (("rate_dps", rate_dps, "deg/s"), ("temperature_c", temperature_c, "deg C")):
        if not abs(value) <= LARGEST:  # also false for NaN
            raise BadInput(f"{what} = {value} {unit}: give a number between {-LARGEST:g} and {LARGEST:g} {unit}")
    if fitted.model.needs:
        raise BadInput(
            f"{name}: its model also needs {', '.join(fitted.model.needs)};"
            " an uncertainty at a rate and a temperature alone is not defined; use a version without these"
        )
    if any(np.isnan(fit.covariance).any() for fit in fitted.axes.values()):
        raise NotEnoughData(
            f"{name} has as many coefficients as data sets: no residual is left to estimate the uncertainty from; "
            "measure more data sets"
        )
    return {axis: _of_axis(fitted, axis, rate_dps, temperature_c, evidence.get(axis)) for axis in fitted.axes}


def _of_axis(
    fitted: FittedModel, axis: str, rate_dps: float, temperature_c: float, evidence: AxisEvidence | None
) -> RateUncertainty:
    coefficients = _of_coefficients(fitted, axis, rate_dps, temperature_c)
    beyond = evidence.model_error.at(rate_dps, temperature_c) if evidence else None
    repeatability = evidence.repeatability if evidence else None
    model = fitted.model.name
    later = repeatability.u_dps if repeatability else None
    same_run, combined = combined_dps(coefficients, beyond), combined_dps(coefficients, beyond, later)
    if combined is not None and repeatability is not None:
        combined *= repeatability.widening(same_run or 0.0)
    return RateUncertainty(
        coefficients,
        beyond,
        later,
        repeatability.source if repeatability else "none",
        same_run,
        combined,
        None if combined is None else COVERAGE * combined,
        {part: why for part, why in _unknown(coefficients, evidence, model, rate_dps, temperature_c).items() if why},
    )


def _unknown(
    coefficients_dps: float | None, evidence: AxisEvidence | None, model: str, rate_dps: float, temperature_c: float
) -> dict[str, str | None]:
    """Return part -> why it is unknown, in words; None for a part that is known."""
    published = coefficients_dps is None
    if evidence is None:
        lacking = NO_DATA_SETS if published else BY_HAND if model == POSES else NOT_KEPT
        return {"coefficients": PUBLISHED if published else None, "model": lacking, "repeatability": lacking}
    return {
        "coefficients": PUBLISHED if published else None,
        "model": evidence.model_error.unknown_at(rate_dps, temperature_c),
        "repeatability": None if evidence.repeatability else NO_POWER_ON,
    }


def _of_coefficients(fitted: FittedModel, axis: str, rate_dps: float, temperature_c: float) -> float | None:
    """Return the standard uncertainty from the coefficients, deg/s; None for published ones, which state none."""
    fit = fitted.axes[axis]
    if not np.any(fit.covariance):
        return None
    basis = fitted.model.temperature.basis(np.array([temperature_c]))[0]
    here = _channels(axis, np.array([rate_dps, rate_dps + STEP_DPS]), temperature_c)
    slope = float(np.diff(fitted.error_dps(here, axis))[0] / STEP_DPS) if fitted.model.argument == "rate" else 0.0
    columns = {column.name: column for _, column in fitted.model.columns(here, axis)}
    gradient = np.concatenate(
        [
            (float(columns[name].slope(np.full(2, at @ basis))[0]) if name in columns else 0.0) * basis
            for name, at in zip(fit.names, fit.values, strict=True)
        ]
    )
    return math.sqrt(max(float(gradient @ fit.covariance @ gradient), 0.0)) / abs(1.0 + slope)


def _channels(axis: str, rates_dps: Array, temperature_c: float) -> Channels:
    n = len(rates_dps)
    columns = {
        "temperature_c": np.full(n, temperature_c),
        "table_rate_dps": rates_dps,
        "position": np.full(n, axis),
    }
    return Channels(columns, {name: rates_dps if name == axis else np.zeros(n) for name in BODY_AXES})
