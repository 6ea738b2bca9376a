"""Fits, calibration versions, certification, modelled errors and uncertainty."""

from __future__ import annotations

from datetime import datetime
from typing import Literal

from pydantic import Field

from labctl.json_types.effects import CataloguedEffect, PresetJson
from labctl.json_types.joint import JointJson
from labctl.json_types.models import (
    AxisCoefficients,
    AxisNoiseJson,
    FitEnvironment,
    LeftOut,
    ReferenceJson,
    TemperatureBasisJson,
    TermJson,
    UsualRange,
)
from labctl.json_types.poses import PosesJson
from labctl.services.schemas.base import Request, ResponseModel
from labctl.services.schemas.certification import CertificationResponse
from labctl.services.schemas.criticism import ResidualColumns
from labctl.services.schemas.warnings import WARNINGS, DataWarning

ACCEPT = "Fit also what is certainly wrong, or worse than no correction; the answer still holds the warnings."


SEVERAL = "Several recordings of the unit, fitted together; instead of `recording`."
FITTED_TO = "All recordings that it was fitted to; `recording` is the newest of them."


class FitRequest(Request):
    """Which model to fit to which recording."""

    recording: int | None = Field(default=None, description="Recording; default: the unit's newest.")
    recordings: list[int] = Field(default_factory=list, description=SEVERAL)
    model: str | None = Field(default=None, description="ojeda2000, yang2018, single_temperature, weiss1995 ...")
    effects: list[str] = Field(
        default_factory=list,
        description="Effect ids, `name:2` sets an order. Without `model` a complete model, with it added to it.",
    )
    accept_warnings: bool = Field(default=False, description=ACCEPT)


class ImproveRequest(Request):
    """How to change the effects of a version; the changed model is fitted again and becomes the next version."""

    add: list[str] = Field(default_factory=list, description="Effect ids; `name:2` sets an order.")
    remove: list[str] = Field(default_factory=list, description="Effect ids that are in the version.")
    formula: list[str] = Field(default_factory=list, description="Effects of your own: 'name: expression'.")
    version: int | None = Field(default=None, description="Version to change; default: the newest.")
    recording: int | None = Field(default=None, description="Recording; default: the unit's newest.")
    recordings: list[int] = Field(default_factory=list, description=f"{SEVERAL} Default: those of a joint version.")
    accept_warnings: bool = Field(default=False, description=ACCEPT)


class ModelResponse(ResponseModel):
    """Which effects a calibration is made of; null: made by an older labctl, which did not say."""

    name: str
    effects: list[str]
    argument: Literal["rate", "output"] = Field(
        description="Whether the regressors see the true rate (forward law) or the gyro's output (direct law)."
    )
    terms: list[TermJson] | None = Field(default=None, description="The effects with orders and nonlinear parameters.")
    temperature: TemperatureBasisJson | None = Field(default=None, description="How temperature enters.")
    reference: ReferenceJson | None = Field(default=None, description="What the terms are centred on.")


class LegError(ResponseModel):
    """How well data sets of one direction of the temperature are predicted by a fit to the others."""

    fitted: str = Field(description="heating, cooling, or all legs but one.")
    tested: str = Field(description="cooling, heating, or each leg in turn.")
    rms_dps: float | None = Field(description="Root mean square over the data sets tested; null: see `why`.")
    datasets: int
    why: str = Field(default="", description="Why there is no figure; empty where there is one.")


class ErrorFigures(ResponseModel):
    """Input-referred errors in deg/s, one value per data set and axis, root mean square over all."""

    raw_rms_dps: float | None = Field(description="Before any compensation.")
    rms_dps: float | None = Field(description="After compensation, on the data of the fit.")
    heldout_rms_dps: float | None = Field(description="Each temperature predicted by a fit without its data.")
    noise_floor_dps: float | None = Field(description="Root of the mean variance of a data-set mean: white and drift.")
    noise_floor_source: str = Field(default="none", description="How the noise floor was estimated.")
    heldout_by_leg: list[LegError] = Field(
        default_factory=list, description="Heating by a fit to cooling and so on; empty: the temperature goes one way."
    )


class Validity(ResponseModel):
    """Where the calibration was measured; outside it is extrapolation."""

    temperature_c: tuple[float | None, float | None] = Field(
        description="Lowest and highest of the readings, deg C; null: no thermometer, and no law of temperature."
    )
    rate_dps: tuple[float | None, float | None] = Field(
        description="Lowest and highest true rate, deg/s; null: no limit, nothing of the model depends on the rate."
    )


class FittedResponse(ResponseModel):
    """What a fit says of its model, whether it is kept as a version or not."""

    serial: str
    model: ModelResponse
    axes: dict[str, AxisCoefficients] = Field(
        description="axis -> coefficients with value, standard uncertainty u, and unit."
    )
    error: ErrorFigures
    validity: Validity
    warnings: list[DataWarning] = Field(default_factory=list, description=WARNINGS)
    noise: dict[str, AxisNoiseJson] = Field(
        default_factory=dict, description="axis -> white noise and drift that the data were weighted by, deg/s."
    )
    environment: FitEnvironment = Field(
        default_factory=FitEnvironment, description="Which thermometer was used, how the Earth's rate was treated."
    )
    reference_temperature_c: float | None = Field(default=None, description="Temperature terms are centred on it.")
    recording: int | None = Field(default=None, description="The recording that it was fitted to.")
    poses: PosesJson | None = Field(
        default=None, description="Of a calibration by hand: rests, the accelerometer, moves, held-out moves."
    )
    recordings: list[int] = Field(default_factory=list, description=FITTED_TO)
    joint: JointJson | None = Field(
        default=None, description="Of several recordings: repeatability, agreement, each predicted by the others."
    )


class FitResponse(FittedResponse):
    """A calibration version, as `labctl fit --json` and `POST .../calibrations` give it."""

    version: int
    campaign: int | None = Field(default=None, description="The campaign of the recording; null: it was imported.")
    recipe: str | None = None
    bench: str | None = None
    hash: str = Field(description="SHA-256 of the calibration file.")


class ChangedModel(FittedResponse):
    """What a change of a version's effects brought."""

    improved_from: int = Field(description="The version that was changed.")
    before: ErrorFigures = Field(description="Errors of the version that was changed, fitted to the same recording.")
    plausible: dict[str, UsualRange] = Field(description="Effect -> the usual range, and whether it is inside.")
    left_out: list[LeftOut] = Field(description="Effects of the fit that are not exported with the calibration.")


class ImproveResponse(ChangedModel):
    """The version that a change of effects made, as `labctl improve --json` and `POST .../improve` give it."""

    version: int
    parent: int
    hash: str = Field(description="SHA-256 of the calibration file.")


class PreviewResponse(ChangedModel):
    """What a changed model would be; nothing was stored, so it has no version of its own."""

    residuals: ResidualColumns = Field(description="Residuals of the changed model, by data set.")


class LadderRow(ResponseModel):
    """One version of a unit's calibration, with its errors."""

    version: int
    parent: int | None
    recording: int | None = Field(description="The recording that the version was fitted to.")
    recordings: list[int] = Field(default_factory=list, description=FITTED_TO)
    model: str
    effects: list[str]
    applied_rms_dps: float | None = Field(
        default=None, description="Of a version of another recording: its error on this one, applied without refitting."
    )
    raw_rms_dps: float | None
    rms_dps: float | None
    heldout_rms_dps: float | None
    noise_floor_dps: float | None


class LadderResponse(ResponseModel):
    """The error of the versions fitted to one recording, each version after its parent."""

    serial: str
    recording: int | None = Field(default=None, description="The recording of all steps.")
    recordings: list[int] = Field(default_factory=list, description="All recordings of the steps.")
    steps: list[LadderRow]
    others: list[LadderRow] = Field(
        default_factory=list, description="Versions of other recordings, and their error on this one."
    )
    noise_floor_dps: float | None


class CalibrationRow(ResponseModel):
    """One line of a unit's list of calibrations."""

    serial: str
    version: int
    parent: int | None
    model: str
    created_at: datetime
    hash: str
    certified: bool
    rms_dps: float | None = None
    heldout_rms_dps: float | None = None


class Follower(ResponseModel):
    """An element that lags behind the temperature, or that is dragged along by it, and the error that it makes."""

    kind: Literal["lag", "play"]
    parameter: float = Field(description="Time constant of a lag, s; width of a play, K.")
    unit: Literal["s", "K"]
    size: dict[str, float] = Field(
        description="axis -> deg/s for each K that the lag is behind, or at an edge of the play."
    )


class VersionFacts(ResponseModel):
    """When a version was made, from what, and whether it is in force."""

    created_at: datetime
    in_force: bool
    due: datetime | None = Field(
        default=None, description="Date until which the certification is valid; null: no date."
    )
    certification: CertificationResponse | None = Field(
        description="The newest act on this version; null: there was none."
    )
    left_out: list[LeftOut] = Field(
        default_factory=list, description="Effects of the fit that are not exported, each with its RMS, deg/s."
    )
    remembers: list[Follower] = Field(
        default_factory=list, description="What follows the temperature from sample to sample in use: the state."
    )


class VersionResponse(VersionFacts, FitResponse):
    """A calibration version that a fit made, as it was made, and whether it is in force."""

    parent: int | None = None


class ImprovedVersionResponse(VersionFacts, ImproveResponse):
    """A calibration version that a change of effects made, and whether it is in force."""


class Surface(ResponseModel):
    """One axis, turned about itself, the others at rest."""

    rate_dps: list[float]
    temperature_c: list[float]
    error_dps: list[list[float]] = Field(
        description="Output minus true rate: a row per temperature, one per rate in it."
    )


class SurfaceResponse(ResponseModel):
    """The error that a calibration subtracts, within the calibrated range."""

    serial: str
    version: int
    validity: Validity
    held: dict[str, float] = Field(description="Channels that the model needs besides: their means in its recording.")
    left_out: list[LeftOut] = Field(description="Effects of the fit that are not exported with the calibration.")
    axes: dict[str, Surface]


class CatalogueResponse(ResponseModel):
    """Every effect that a model can be made of, and every model that a fit can be asked for by name."""

    effects: list[CataloguedEffect]
    models: list[PresetJson]


class CompensationResponse(ResponseModel):
    """How many rows were corrected, how many of them lay outside the calibration, and where they are."""

    rows: int
    outside: int = Field(description="Rows outside the calibrated rates or temperatures.")
    file: str
