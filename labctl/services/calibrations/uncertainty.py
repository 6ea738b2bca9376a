"""Uncertainty of a corrected rate of a calibration version, at one rate and temperature."""

from __future__ import annotations

from dataclasses import asdict

from labctl.calibration import Calibration, read_calibration
from labctl.fitting.uncertainty import COVERAGE, RateUncertainty, rate_uncertainty
from labctl.services.schemas.calibrations import AxisUncertainty, UncertaintyResponse
from labctl.store import Store


def uncertainty_at(
    store: Store, serial: str, version: int, rate_dps: float, temperature_c: float
) -> UncertaintyResponse:
    """Return the uncertainty about each axis. Raises NotFound, BadInput."""
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
        axes={axis: AxisUncertainty(**asdict(one)) for axis, one in found.items()},
    )


def uncertainty_of(calibration: Calibration, rate_dps: float, temperature_c: float) -> dict[str, RateUncertainty]:
    """Return axis -> the uncertainty of a calibration's corrected rate. Raises BadInput, NotEnoughData."""
    error = calibration.document["error"]
    return rate_uncertainty(
        calibration.fitted,
        rate_dps,
        temperature_c,
        heldout_rms_dps=error.get("heldout_rms_dps"),
        noise_floor_dps=error.get("noise_floor_dps"),
        name=f"{calibration.serial} version {calibration.version}",
    )


def is_inside(calibration: Calibration, rate_dps: float, temperature_c: float) -> bool:
    """Return whether a rate and a temperature are within the calibrated ranges."""
    (cold, warm), (slow, fast) = calibration.temperature_c, calibration.rate_dps
    return cold <= temperature_c <= warm and slow <= rate_dps <= fast
