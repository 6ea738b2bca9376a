"""Uncertainty of a corrected rate."""

from __future__ import annotations

from pydantic import Field

from labctl.services.schemas.base import ResponseModel


class AxisUncertainty(ResponseModel):
    """One axis, deg/s."""

    coefficients_dps: float | None = Field(
        description="Standard uncertainty from the coefficients' covariance; null: they state none."
    )
    model_dps: float | None = Field(
        description="Error of the model and drift near this rate and temperature, by held-out data sets; null: unknown."
    )
    repeatability_dps: float | None = Field(description="From one power-on to the next; null: unknown.")
    repeatability_source: str = Field(description="Between runs, data sheet, static record, or none.")
    same_run_dps: float | None = Field(
        description="Coefficients and model combined: without another power-on; null where one is unknown."
    )
    combined_dps: float | None = Field(description="All three combined; null where one of them is unknown.")
    expanded_dps: float | None = Field(description="Combined, times the coverage factor.")
    unknown: dict[str, str] = Field(
        description="Of coefficients, model and repeatability those that are unknown, and why, in words."
    )


class UncertaintyGrid(ResponseModel):
    """The same over what was calibrated."""

    rate_dps: list[float] = Field(description="Zero, the limits and half of them, as far as they are calibrated.")
    temperature_c: list[float] = Field(description="Lowest, middle and highest.")
    axes: dict[str, list[list[AxisUncertainty]]] = Field(
        description="Axis -> a row for each temperature, in it one for each rate."
    )


class UncertaintyResponse(ResponseModel):
    """The uncertainty of a corrected rate on later days; the noise of a single reading comes on top."""

    serial: str
    version: int
    rate_dps: float
    temperature_c: float
    coverage_factor: float
    inside: bool = Field(description="Whether rate and temperature are within what was calibrated.")
    axes: dict[str, AxisUncertainty]
    grid: UncertaintyGrid | None = Field(default=None, description="Present where `grid` was requested.")
