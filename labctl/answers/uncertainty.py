"""Over rate and temperature: the error that a calibration subtracts, and the uncertainty of a corrected rate."""

from __future__ import annotations

from pydantic import Field

from labctl.answers.base import ResponseModel
from labctl.answers.budget import BudgetJson, ContributionsOverJson
from labctl.answers.calibrations import Validity
from labctl.answers.certification import AnyAxisUncertainty
from labctl.answers.common_fields import Serial, VersionNumber
from labctl.answers.fitted_model import LeftOutEffect


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
    standards_dps: float | None = Field(
        description="Standard uncertainty from all stated reference standards of the bench, deg/s; null: none is "
        "stated."
    )
    same_run_dps: float | None = Field(
        description="Coefficients, model and standards combined, for use in the same power-on as the calibration, "
        "deg/s; null if coefficients or model are unknown."
    )
    combined_dps: float | None = Field(
        description="`expanded_dps` divided by `coverage_factor`, deg/s; null if coefficients, model or "
        "repeatability are "
        "unknown."
    )
    expanded_dps: float | None = Field(
        description="Expanded uncertainty U of the budget, deg/s; it covers with a probability of 95.45 %."
    )
    unknown: dict[str, str] = Field(
        description="Contributions to the uncertainty (coefficients, model, repeatability) that could not be "
        "determined, each with the reason."
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
    contributions: dict[str, ContributionsOverJson] = Field(
        default_factory=dict, description="For each axis: the lines of the budget over rate and over temperature."
    )


class VectorUncertainty(ResponseModel):
    """Uncertainty of the corrected rates at one rate vector; matrices have one row and column for each output."""

    rates_dps: dict[str, float] = Field(description="True rate about each body axis, deg/s.")
    outputs: list[str] = Field(description="Outputs in the order of the rows and columns.")
    covariance_dps2: list[list[float | None]] = Field(
        description="Covariance of the corrected rates in the frame of the case, (deg/s)^2; null: a contribution is "
        "unknown."
    )
    expanded_dps: dict[str, float | None] = Field(
        description="For each output: expanded uncertainty U in the frame of the case, deg/s; null: unknown."
    )
    aligned_covariance_dps2: list[list[float | None]] = Field(
        description="Covariance up to a rotation of the frame, (deg/s)^2: for a unit whose axes are aligned in use, so "
        "that the common angle of the mountings does not count."
    )
    aligned_expanded_dps: dict[str, float | None] = Field(
        description="For each output: U up to a rotation of the frame, deg/s; null: unknown."
    )


class UncertaintyResponse(ResponseModel):
    """The uncertainty of a corrected rate on later days; the noise of a single reading is not included."""

    serial: Serial
    version: VersionNumber
    rate_dps: float = Field(description="The rate, deg/s; of a rate vector its magnitude.")
    temperature_c: float = Field(description="Temperature for which the uncertainty holds, deg C.")
    coverage_factor: float = Field(description="`expanded_dps` over `combined_dps`.")
    coverage: float = Field(description="Probability that the interval contains the true value.")
    inside: bool = Field(description="Whether rate and temperature are within the calibrated range.")
    axes: dict[str, AxisUncertainty] = Field(description="For each axis: the uncertainty of its corrected rate.")
    budget: dict[str, BudgetJson] = Field(description="For each axis: the budget of the corrected rate, deg/s.")
    coefficients: dict[str, dict[str, BudgetJson]] = Field(
        description="For each axis: the budgets of bias, scale factor and misalignments at this temperature."
    )
    vector: VectorUncertainty | None = Field(
        default=None, description="null where one rate was given: about one axis after the other, the others at rest."
    )
    any_axis: dict[str, AnyAxisUncertainty] = Field(
        default_factory=dict,
        description="For each output: its largest U where the unit turns about any axis. Empty where the version does "
        "not state it: fit it again.",
    )
    not_stated: list[str] = Field(
        description="Reference standards whose uncertainty is not stated; U does not contain their contributions."
    )
    not_stated_remedy: str = Field(
        default="",
        description="What brings them into U, by where the measurements came from: their place in the bench file, or "
        "in the files of the import. Empty: all are stated.",
    )
    overdue: bool = Field(description="Whether a standard was past its due date when it was used.")
    grid: UncertaintyGrid | None = Field(
        default=None, description="The uncertainty over the calibrated range; null unless `grid` was requested."
    )


class Surface(ResponseModel):
    """One axis, turned about itself, the others at rest."""

    rate_dps: list[float] = Field(description="Rates of the grid, deg/s.")
    temperature_c: list[float] = Field(description="Temperatures of the grid, deg C.")
    error_dps: list[list[float]] = Field(
        description="Output minus true rate, deg/s: one row per temperature, one value per rate in each row."
    )


class SurfaceResponse(ResponseModel):
    """The error that a calibration subtracts, within the calibrated range."""

    serial: Serial
    version: VersionNumber
    validity: Validity = Field(description="Rates and temperatures over which the model was calibrated.")
    held: dict[str, float] = Field(description="Other channels that the model needs, held at their mean in the fit.")
    left_out: list[LeftOutEffect] = Field(
        description="Effects in the fitted model that the exported calibration leaves out."
    )
    axes: dict[str, Surface] = Field(description="For each axis: the error over rate and temperature.")
