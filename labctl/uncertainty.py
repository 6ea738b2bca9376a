"""How far a corrected rate may be off: GUM components at one rate and temperature, from a calibration alone."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from labctl.calibration import Calibration
from labctl.errors import BadInput, NotEnoughData
from labctl.fitting.data.channels import Channels
from labctl.fitting.models.fitted_model import FittedModel

#: Coverage factor of the expanded uncertainty: about 95 % for a normal distribution (GUM 6.2).
COVERAGE = 2.0
#: No gyro turns faster, in deg/s, or is warmer, in deg C.
MOST = 1e5
#: Step of the numerical derivative of the error along the rate.
STEP_DPS = 0.01


@dataclass(frozen=True)
class RateUncertainty:
    """Standard uncertainties of one axis' corrected rate, deg/s; the noise of the reading itself comes on top."""

    coefficients_dps: float  #: of the coefficients, propagated through the law that is inverted (GUM 5.2)
    model_dps: float | None  #: what held-out temperatures show beyond the noise floor; None where neither is known
    combined_dps: float
    expanded_dps: float  #: coverage factor 2


def rate_uncertainty(calibration: Calibration, rate_dps: float, temperature_c: float) -> dict[str, RateUncertainty]:
    """Return axis -> the uncertainty of a corrected rate of `rate_dps` about that axis, the other axes at rest.

    Raises BadInput for a number that no gyro sees, and where the model needs more than rate and temperature.
    """
    for name, value, unit in (("rate_dps", rate_dps, "deg/s"), ("temperature_c", temperature_c, "deg C")):
        if not abs(value) <= MOST:  # also what is not a number
            raise BadInput(f"{name} = {value} {unit}: must be a number between {-MOST:g} and {MOST:g} {unit}")
    fitted = calibration.fitted
    if fitted.model.needs:
        raise BadInput(
            f"{calibration.serial} version {calibration.version}: its model also needs {', '.join(fitted.model.needs)};"
            " an uncertainty at a rate and a temperature alone is not defined"
        )
    if any(np.isnan(fit.covariance).any() for fit in fitted.axes.values()):
        raise NotEnoughData(
            f"{calibration.serial} version {calibration.version} has as many coefficients as data sets: nothing is "
            "left to be uncertain by; measure more data sets"
        )
    beyond = _beyond_floor(calibration)
    return {axis: _of_axis(fitted, axis, rate_dps, temperature_c, beyond) for axis in calibration.axes}


def is_inside(calibration: Calibration, rate_dps: float, temperature_c: float) -> bool:
    """Return whether a rate and a temperature are within what was calibrated."""
    (cold, warm), (slow, fast) = calibration.temperature_c, calibration.rate_dps
    return cold <= temperature_c <= warm and slow <= rate_dps <= fast


def _beyond_floor(calibration: Calibration) -> float | None:
    error = calibration.document["error"]
    held_out, floor = error.get("heldout_rms_dps"), error.get("noise_floor_dps")
    if held_out is None or floor is None:
        return None
    return math.sqrt(max(held_out**2 - floor**2, 0.0))


def _of_axis(
    fitted: FittedModel, axis: str, rate_dps: float, temperature_c: float, beyond: float | None
) -> RateUncertainty:
    fit = fitted.axes[axis]
    basis = fitted.model.temperature.basis(np.array([temperature_c]))[0]
    here = _channels(axis, np.array([rate_dps, rate_dps + STEP_DPS]), temperature_c)
    slope = float(np.diff(fitted.error_dps(here, axis))[0] / STEP_DPS) if fitted.model.argument == "rate" else 0.0
    by_name = {column.name: float(column.values[0]) for _, column in fitted.model.columns(here, axis)}
    gradient = np.concatenate([by_name.get(name, 0.0) * basis for name in fit.names])
    coefficients = math.sqrt(max(float(gradient @ fit.covariance @ gradient), 0.0)) / abs(1.0 + slope)
    combined = math.hypot(coefficients, beyond or 0.0)
    return RateUncertainty(coefficients, beyond, combined, COVERAGE * combined)


def _channels(axis: str, rates_dps: np.ndarray, temperature_c: float) -> Channels:
    n = len(rates_dps)
    columns = {
        "temperature_c": np.full(n, temperature_c),
        "table_rate_dps": rates_dps,
        "position": np.full(n, axis),
    }
    return Channels(columns, {name: rates_dps if name == axis else np.zeros(n) for name in "xyz"})
