"""Over rate and temperature: the error that a calibration subtracts, and the uncertainty of a corrected rate."""

from __future__ import annotations

from pydantic import Field

from labctl.json_types.models import LeftOut
from labctl.services.schemas.base import ResponseModel
from labctl.services.schemas.calibrations import Validity


class AxisUncertainty(ResponseModel):
    """One axis, deg/s."""

    coefficients_dps: float | None = Field(
        description="Standard uncertainty from the covariance of the coefficients, deg/s; null: the coefficients "
        "have no uncertainties."
    )
    model_dps: float | None = Field(
        description="Standard uncertainty from errors of the model and drift near this rate and temperature, "
        "estimated from held-out data sets, deg/s; null: unknown."
    )
    repeatability_dps: float | None = Field(
        description="Standard uncertainty from changes between power-ons, deg/s; null: unknown."
    )
    repeatability_source: str = Field(
        description="What `repeatability_dps` was computed from: differences between "
        "runs, the data sheet, a static record, or none of these."
    )
    same_run_dps: float | None = Field(
        description="Coefficients and model combined, for use in the same power-on as the calibration, deg/s; null "
        "if one of the two is unknown."
    )
    combined_dps: float | None = Field(
        description="Coefficients, model and repeatability combined, deg/s; null if one of the three is unknown."
    )
    expanded_dps: float | None = Field(description="`combined_dps` times the coverage factor, deg/s.")
    unknown: dict[str, str] = Field(
        description="Which of coefficients, model and repeatability are unknown, each with the reason."
    )


class UncertaintyGrid(ResponseModel):
    """The same over what was calibrated."""

    rate_dps: list[float] = Field(
        description="Rates of the grid, deg/s: zero, the limits of the calibrated range, "
        "and half of each limit, if calibrated."
    )
    temperature_c: list[float] = Field(description="Lowest, middle and highest calibrated temperature, deg C.")
    axes: dict[str, list[list[AxisUncertainty]]] = Field(
        description="For each axis: one row per temperature, one entry per rate in each row."
    )


class UncertaintyResponse(ResponseModel):
    """The uncertainty of a corrected rate on later days; the noise of a single reading comes on top."""

    serial: str
    version: int
    rate_dps: float
    temperature_c: float
    coverage_factor: float
    inside: bool = Field(description="Whether rate and temperature are within the calibrated range.")
    axes: dict[str, AxisUncertainty]
    grid: UncertaintyGrid | None = Field(
        default=None, description="The uncertainty over the calibrated range; null unless `grid` was requested."
    )


class Surface(ResponseModel):
    """One axis, turned about itself, the others at rest."""

    rate_dps: list[float]
    temperature_c: list[float]
    error_dps: list[list[float]] = Field(
        description="Output minus true rate, deg/s: one row per temperature, one value per rate in each row."
    )


class SurfaceResponse(ResponseModel):
    """The error that a calibration subtracts, within the calibrated range."""

    serial: str
    version: int
    validity: Validity
    held: dict[str, float] = Field(description="Other channels that the model needs, held at their mean in the fit.")
    left_out: list[LeftOut] = Field(description="Effects of the fit that are not exported with the calibration.")
    axes: dict[str, Surface]
