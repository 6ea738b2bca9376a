"""How far a corrected rate of a version may be off, at one rate and temperature."""

from __future__ import annotations

from dataclasses import asdict

from pydantic import Field

from labctl.calibration import read_calibration
from labctl.services.schemas.answers import ResponseModel
from labctl.store import Store
from labctl.uncertainty import COVERAGE, is_inside, rate_uncertainty


class AxisUncertainty(ResponseModel):
    """One axis, deg/s."""

    coefficients_dps: float = Field(description="Standard uncertainty from the coefficients' covariance.")
    model_dps: float | None = Field(
        description="What held-out temperatures show beyond the noise floor; null: unknown."
    )
    combined_dps: float
    expanded_dps: float = Field(description="Combined, times the coverage factor.")


class UncertaintyResponse(ResponseModel):
    """The uncertainty of a corrected rate; the noise of a single reading comes on top."""

    serial: str
    version: int
    rate_dps: float
    temperature_c: float
    coverage_factor: float
    inside: bool = Field(description="Whether rate and temperature are within what was calibrated.")
    axes: dict[str, AxisUncertainty]


def uncertainty_at(
    store: Store, serial: str, version: int, rate_dps: float, temperature_c: float
) -> UncertaintyResponse:
    """Return the uncertainty about each axis. Raises NotFound, BadInput."""
    document, _ = store.calibrations.document(serial, version)
    calibration = read_calibration(document)
    found = rate_uncertainty(calibration, rate_dps, temperature_c)
    return UncertaintyResponse(
        serial=serial,
        version=version,
        rate_dps=rate_dps,
        temperature_c=temperature_c,
        coverage_factor=COVERAGE,
        inside=is_inside(calibration, rate_dps, temperature_c),
        axes={axis: AxisUncertainty(**asdict(one)) for axis, one in found.items()},
    )
