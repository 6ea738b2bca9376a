"""Fits, calibration versions, certification, modelled errors and uncertainty."""

from __future__ import annotations

from datetime import datetime
from typing import Literal

from pydantic import Field

from labctl.answers.base import Request, ResponseModel
from labctl.answers.certification import CertificationResponse
from labctl.answers.common_fields import (
    CalibrationHash,
    EffectIds,
    FileName,
    FittedRms,
    HeldoutRms,
    InForce,
    ModelName,
    NoiseFloor,
    ParentVersion,
    RawRms,
    Serial,
    VersionNumber,
    VersionTime,
)
from labctl.answers.effects import CataloguedEffect, PresetJson
from labctl.answers.fitted_model import (
    AxisCoefficients,
    AxisNoiseJson,
    Coefficient,
    FitEnvironment,
    HeldJson,
    LeftOutEffect,
    ReferenceJson,
    TemperatureBasisJson,
    TermJson,
    ThermalHintJson,
    TypePriorJson,
    UsualRange,
)
from labctl.answers.fixed_coefficients import FixedCoefficients
from labctl.answers.inspection import WARNINGS, DataWarning
from labctl.answers.joint import JointJson
from labctl.answers.poses import PosesJson
from labctl.answers.recording_head import OutputUnit
from labctl.answers.residuals import ResidualColumns

ACCEPT = (
    "Fit the data although labctl found errors in them, and keep the fit even if it is worse than no "
    "correction; the response still lists the warnings."
)


SEVERAL = "Several recordings of the unit, fitted together; instead of `recording`."
NOTICES = "Reference standards that were found bad on the days of the measurements behind the version; no certificate."
FITTED_TO = "All recordings that the model was fitted to; `recording` is the newest of these."


class FitRequest(Request):
    """Which model to fit to which recording."""

    recording: int | None = Field(
        default=None,
        description="Number of the recording; default: the unit's newest recording that can be fitted, together with "
        "the others of its diagnosis, if it belongs to one.",
    )
    recordings: list[int] = Field(default_factory=list, description=SEVERAL)
    model: str | None = Field(
        default=None, description="Name of a model, such as yang2018; default: no named model, only `effects`."
    )
    effects: list[str] = Field(
        default_factory=list,
        description="Effect ids; `name:2` sets the polynomial order to 2. Without `model`, these effects are the "
        "whole model; with `model`, they are added to that model.",
    )
    fixed: FixedCoefficients | None = Field(
        default=None,
        description="Published or measured coefficients that are held at their values; the other coefficients of the "
        "model are fitted. Default: all are fitted.",
    )
    type_prior: bool = Field(
        default=False,
        description="Add what the other calibrated units of the unit's type say of its coefficients; the version "
        "states it. At least 10 units of the type with this model are needed.",
    )
    accept_warnings: bool = Field(default=False, description=ACCEPT)


class ImproveRequest(Request):
    """How to change the effects of a version; the changed model is fitted again and becomes the next version."""

    add: list[str] = Field(
        default_factory=list,
        description="Ids of effects to add; `name:2` sets polynomial order 2, "
        "`name@parameter=value` its shape, which is otherwise found from the data.",
    )
    remove: list[str] = Field(default_factory=list, description="Ids of the version's effects to remove.")
    formula: list[str] = Field(default_factory=list, description="Your own effects to add, each as 'name: expression'.")
    version: int | None = Field(
        default=None, description="Number of the version to change; default: the unit's newest version."
    )
    recording: int | None = Field(
        default=None,
        description="Number of the recording; default: the unit's newest recording that can be fitted, together with "
        "the others of its diagnosis, if it belongs to one.",
    )
    recordings: list[int] = Field(
        default_factory=list,
        description=f"{SEVERAL} Default: the recordings of the version, if it was fitted to several.",
    )
    accept_warnings: bool = Field(default=False, description=ACCEPT)
    as_version: int | None = Field(
        default=None,
        ge=1,
        description="Number that the new version is expected to have. Where another one has it already, nothing is "
        "made (409): two requests of the same page make one version. Default: the next number.",
    )


class ModelResponse(ResponseModel):
    """Which effects a calibration is made of; null: made by an older version of labctl, which did not say."""

    name: ModelName
    effects: EffectIds
    argument: Literal["rate", "output"] = Field(
        description="What the regressors are computed from: `rate`, the true rate (forward law), or `output`, the "
        "gyro's output (direct law)."
    )
    terms: list[TermJson] | None = Field(default=None, description="Effects, with orders and parameters.")
    temperature: TemperatureBasisJson | None = Field(
        default=None, description="Polynomial or interpolation by which the model depends on the temperature."
    )
    reference: ReferenceJson | None = Field(default=None, description="Zero point of the temperature terms.")
    held: HeldJson | None = Field(
        default=None,
        description="Coefficients that were held at known values and not fitted, and their source; null: none.",
    )


class LegError(ResponseModel):
    """How well one leg, a stretch of heating or of cooling, is predicted by a fit to the others."""

    fitted: str = Field(
        description="Data sets that the model was fitted to: those measured while heating, while cooling, or those of "
        "all legs (stretches of heating or cooling) but the one that is predicted."
    )
    tested: str = Field(
        description="Data sets that this fit predicted: those measured while cooling, while "
        "heating, or each leg in turn."
    )
    rms_dps: float | None = Field(description="RMS prediction error of the data sets tested, deg/s; null: see `why`.")
    datasets: int = Field(description="Number of data sets that were predicted.")
    why: str = Field(default="", description="Why `rms_dps` is null; else empty.")


class ErrorFigures(ResponseModel):
    """Input-referred errors in deg/s, one value per data set and axis, root mean square over all."""

    raw_rms_dps: RawRms
    rms_dps: FittedRms
    heldout_rms_dps: HeldoutRms
    noise_floor_dps: NoiseFloor
    noise_floor_source: str = Field(default="none", description="How the noise floor was estimated.")
    heldout_by_leg: list[LegError] = Field(
        default_factory=list,
        description="Error in the heating leg of a model fitted to the cooling leg, and the reverse; empty: "
        "only one leg was measured.",
    )


class Validity(ResponseModel):
    """Where the calibration was measured; outside it is extrapolation."""

    temperature_c: tuple[float | None, float | None] = Field(
        description="Lowest and highest measured temperature, deg C; null: not measured, and no term depends on it."
    )
    rate_dps: tuple[float | None, float | None] = Field(
        description="Lowest and highest true rate, deg/s; null: no limit, no term of the model depends on the rate."
    )


class FittedResponse(ResponseModel):
    """What a fit says of its model, whether it is kept as a version or not."""

    serial: Serial
    model: ModelResponse = Field(description="The effects of the fitted model.")
    axes: dict[str, AxisCoefficients] = Field(
        description="For each axis: the coefficients with value, standard uncertainty u, and unit."
    )
    output: dict[str, OutputUnit] = Field(
        default_factory=dict,
        description="For each axis: its nominal output, rate_dps = (output - offset) / scale. Coefficients of the "
        "scale factor are relative to `scale`.",
    )
    error: ErrorFigures = Field(description="Errors of the model before and after compensation, deg/s.")
    validity: Validity = Field(description="Rates and temperatures over which the model was calibrated.")
    warnings: list[DataWarning] = Field(default_factory=list, description=WARNINGS)
    noise: dict[str, AxisNoiseJson] = Field(
        default_factory=dict,
        description="For each axis: white noise of the mean of a data set and drift of the bias between data sets, "
        "deg/s (standard deviations); the weights of the fit follow from them.",
    )
    environment: FitEnvironment = Field(
        default_factory=FitEnvironment,
        description="Which thermometer was used; whether the Earth's rate was subtracted.",
    )
    reference_temperature_c: float | None = Field(default=None, description="Zero point of temperature terms, deg C.")
    shapes: dict[str, dict[str, Coefficient]] = Field(
        default_factory=dict,
        description="For each effect that remembers temperatures: its time constants, s, and widths, K, with standard "
        "uncertainty u (null where the data do not determine it); `tau_x_s` is that of axis x, `tau_s` that of all.",
    )
    recording: int | None = Field(default=None, description="The recording that the model was fitted to.")
    poses: PosesJson | None = Field(
        default=None,
        description="Only for a recording of poses (turned by hand): results for rests, "
        "accelerometer, moves and held-out moves.",
    )
    recordings: list[int] = Field(default_factory=list, description=FITTED_TO)
    joint: JointJson | None = Field(
        default=None,
        description="Only for several recordings: repeatability, agreement between the recordings, and the error "
        "when each recording is predicted by a fit to the others.",
    )


class FitResponse(FittedResponse):
    """A calibration version, as `labctl fit --json` and `POST .../calibrations` give it."""

    version: VersionNumber
    campaign: int | None = Field(default=None, description="Campaign that made the recording; null: imported.")
    recipe: str | None = Field(
        default=None,
        description="Name of the recipe of the campaign that made the recording; null: the recording was imported.",
    )
    bench: str | None = Field(
        default=None, description="Name of the bench of that campaign; null: the recording was imported."
    )
    type_prior: TypePriorJson | None = Field(
        default=None,
        description="What other calibrated units of the type contributed to the coefficients; null: nothing, the unit "
        "was fitted alone.",
    )
    hash: CalibrationHash


class ChangedModel(FittedResponse):
    """What a change of a version's effects brought."""

    improved_from: int = Field(description="The version that was changed.")
    before: ErrorFigures = Field(description="Errors of the model before the change, on the same recording, deg/s.")
    plausible: dict[str, UsualRange] = Field(
        description="For each effect: the usual range of its size, and whether the fitted size is inside."
    )
    left_out: list[LeftOutEffect] = Field(
        description="Effects in the fitted model that the exported calibration leaves out."
    )
    thermal_hint: ThermalHintJson | None = Field(
        default=None, description="Of a thermal lag that was added at rest and is not certain: what it leaves of "
        "stretches left out, and why it is not certain; else null.",
    )  # fmt: skip


class ImproveResponse(ChangedModel):
    """The version that a change of effects made, as `labctl improve --json` and `POST .../improve` give it."""

    version: VersionNumber
    parent: int = Field(description="Version that was changed, as `improved_from`.")
    hash: CalibrationHash


class PreviewResponse(ChangedModel):
    """What a changed model would be; nothing was stored, so it has no version of its own."""

    residuals: ResidualColumns = Field(description="Residuals of the changed model, by data set.")


class CalibrationRow(ResponseModel):
    """One line of a unit's list of calibrations."""

    serial: Serial
    version: VersionNumber
    parent: ParentVersion
    model: ModelName
    created_at: VersionTime
    hash: CalibrationHash
    certified: InForce
    rms_dps: FittedRms = None
    heldout_rms_dps: HeldoutRms = None
    notices: list[str] = Field(default_factory=list, description=NOTICES)


class Follower(ResponseModel):
    """An element that lags behind the temperature, or that is dragged along by it, and the error that it makes."""

    kind: Literal["lag", "play"] = Field(
        description="lag: the element follows the temperature with a time constant; play: it follows with a "
        "hysteresis of constant width."
    )
    parameter: float = Field(description="Time constant of a thermal lag, s, or width of a hysteresis (play), K.")
    unit: Literal["s", "K"] = Field(description="Unit of `parameter`: s for a lag, K for a play.")
    cooling_s: float | None = Field(
        default=None, description="Of a lag: time constant while the element is warmer than the thermometer, s; null: "
        "the same.",
    )  # fmt: skip
    is_curved: bool = Field(
        default=False,
        description="Whether the error follows the difference of the squares of the temperatures about reference_c; "
        "the sizes are then in (deg/s)/K2.",
    )
    reference_c: float | None = Field(default=None, description="Only for a curved lag, deg C.")
    size: dict[str, float] = Field(
        description="For each axis: error per K of temperature lag, (deg/s)/K, or error at an edge of the "
        "hysteresis, deg/s."
    )
    scale: dict[str, float] | None = Field(
        default=None, description="Of a lag of the scale factor, for each axis: error of the scale factor per K of "
        "temperature lag, 1/K (1/K2 where is_curved); null: the scale factor does not lag.",
    )  # fmt: skip


class VersionFacts(ResponseModel):
    """When a version was made, from what, and whether it is in force."""

    created_at: VersionTime
    in_force: InForce
    notices: list[str] = Field(default_factory=list, description=NOTICES)
    due: datetime | None = Field(
        default=None, description="Date until which the certification is valid; null: no date."
    )
    certification: CertificationResponse | None = Field(
        description="The newest certification or revocation of this version; null: there was none."
    )
    rate_reference: str = Field(
        default="", description="How the table rates of the version's recordings were determined; empty: not known."
    )
    left_out: list[LeftOutEffect] = Field(
        default_factory=list,
        description="Effects in the fitted model that an export leaves out, each with the RMS of its contribution to "
        "the rate, deg/s.",
    )
    remembers: list[Follower] = Field(
        default_factory=list,
        description="Temperature states (thermal lag or hysteresis) that must be updated "
        "with the temperature of every sample.",
    )


class VersionResponse(VersionFacts, FitResponse):
    """A calibration version that a fit made, as it was made, and whether it is in force."""

    parent: ParentVersion = None


class ImprovedVersionResponse(VersionFacts, ImproveResponse):
    """A calibration version that a change of effects made, and whether it is in force."""


class CatalogueResponse(ResponseModel):
    """Every effect that a model can be made of, and every model that a fit can be asked for by name."""

    effects: list[CataloguedEffect] = Field(description="Every effect that a model can be made of.")
    models: list[PresetJson] = Field(description="Every model that a fit can be asked for by name.")


class CompensationResponse(ResponseModel):
    """How many rows were corrected, how many of them lay outside the calibration, and where they are."""

    rows: int = Field(description="Number of rows that were corrected.")
    outside: int = Field(description="Number of rows outside the calibrated rates or temperatures.")
    file: FileName
    warning: str = Field(
        default="", description="Warning that the calibration is overdue or was revoked; empty: neither."
    )
    left_out: str = Field(
        default="",
        description="Effects that were not corrected because the file has no columns of specific force, with their "
        "size in deg/s; empty: none.",
    )
