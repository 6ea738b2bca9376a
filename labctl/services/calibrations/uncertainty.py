"""Uncertainty of a corrected rate of a calibration version: at one place, and over what was calibrated."""

from __future__ import annotations

import math
from dataclasses import asdict

import numpy as np

from labctl.calibration import Calibration, read_calibration
from labctl.fitting.data.temperature.channel import STAND_IN_C
from labctl.fitting.numeric.blas_threads import single_threaded
from labctl.fitting.uncertainty import COVERAGE, AxisEvidence, RateUncertainty, rate_uncertainty
from labctl.services.schemas.uncertainty import AxisUncertainty, UncertaintyGrid, UncertaintyResponse
from labctl.store import Store

#: Rates of a grid are at least this share of the fastest apart.
RATES_APART = 0.02
#: A calibration over less is one temperature, K.
LEAST_SPAN_K = 1.0


def uncertainty_at(
    store: Store, serial: str, version: int, rate_dps: float, temperature_c: float, *, grid: bool = False
) -> UncertaintyResponse:
    """Return the uncertainty about each axis, with `grid` also over the validity. Raises NotFound, BadInput."""
    document, _ = store.calibrations.document(serial, version)
    calibration = read_calibration(document)
    found = uncertainty_of(calibration, rate_dps, temperature_c)
    return UncertaintyResponse(
        serial=serial,
        version=version,
        rate_dps=rate_dps,
        temperature_c=temperature_c,
        coverage_factor=COVERAGE,
        inside=is_inside(calibration, rate_dps, temperature_c),
        axes={axis: _response(one) for axis, one in found.items()},
        grid=uncertainty_grid(calibration) if grid else None,
    )


@single_threaded
def uncertainty_grid(calibration: Calibration) -> UncertaintyGrid:
    """Return the uncertainty about each axis on a small grid over the validity. Raises BadInput, NotEnoughData."""
    rates, temperatures = grid_rates(*_rate_span(calibration)), grid_temperatures(*calibration.temperature_c)
    found = [[uncertainty_of(calibration, rate, warm) for rate in rates] for warm in temperatures]
    axes = {axis: [[_response(place[axis]) for place in row] for row in found] for axis in found[0][0]}
    return UncertaintyGrid(rate_dps=rates, temperature_c=temperatures, axes=axes)


def grid_rates(low_dps: float, high_dps: float) -> list[float]:
    """Return zero, both limits and half of each, deg/s, as far as they are within the limits and apart, rising."""
    apart = RATES_APART * max(abs(low_dps), abs(high_dps))
    found: list[float] = []
    for rate in (0.0, low_dps, high_dps, low_dps / 2, high_dps / 2):
        if low_dps <= rate <= high_dps and all(abs(rate - other) > apart for other in found):
            found.append(rate)
    return sorted(found)


def grid_temperatures(low_c: float, high_c: float) -> list[float]:
    """Return the lowest, the middle and the highest temperature, deg C, or the middle of a calibration at one.

    Without limits, of a calibration made without a thermometer, any one stands for all.
    """
    if not math.isfinite(high_c - low_c):
        return [STAND_IN_C]
    middle = (low_c + high_c) / 2
    return [low_c, middle, high_c] if high_c - low_c >= LEAST_SPAN_K else [middle]


def uncertainty_of(calibration: Calibration, rate_dps: float, temperature_c: float) -> dict[str, RateUncertainty]:
    """Return axis -> the uncertainty of a calibration's corrected rate. Raises BadInput, NotEnoughData."""
    return rate_uncertainty(
        calibration.fitted,
        rate_dps,
        temperature_c,
        evidence=_evidence(calibration),
        name=f"{calibration.serial} version {calibration.version}",
    )


def is_inside(calibration: Calibration, rate_dps: float, temperature_c: float) -> bool:
    """Return whether a rate and a temperature are within the calibrated ranges."""
    (cold, warm), (slow, fast) = calibration.temperature_c, calibration.rate_dps
    return cold <= temperature_c <= warm and slow <= rate_dps <= fast


def _evidence(calibration: Calibration) -> dict[str, AxisEvidence]:
    return {axis: AxisEvidence.from_json(one) for axis, one in calibration.document.get("use", {}).items()}


def _rate_span(calibration: Calibration) -> tuple[float, float]:
    """Return the calibrated rates, deg/s; of a model without a limit those that were measured, else 0."""
    low, high = calibration.rate_dps
    if np.isfinite(low) and np.isfinite(high):
        return low, high
    measured = [rate for one in _evidence(calibration).values() for rate in one.model_error.rate_dps.tolist()]
    return min(measured, default=0.0), max(measured, default=0.0)


def _response(found: RateUncertainty) -> AxisUncertainty:
    return AxisUncertainty.model_validate(asdict(found))
