"""Fits, calibration versions, certification, modelled errors and uncertainty."""

from __future__ import annotations

from datetime import datetime
from typing import Any, Literal

from pydantic import Field

from labctl.services.schemas.base import Request, ResponseModel
from labctl.services.schemas.certification import CertificationResponse
from labctl.services.schemas.criticism import ResidualColumns
from labctl.services.schemas.warnings import WARNINGS, DataWarning

ACCEPT = "Fit also what is certainly wrong, or worse than no correction; the answer still holds the warnings."


class FitRequest(Request):
    """Which model to fit to which recording."""

    recording: int | None = Field(default=None, description="Recording; default: the unit's newest.")
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
    accept_warnings: bool = Field(default=False, description=ACCEPT)


class ModelResponse(ResponseModel):
    """Which effects a calibration is made of."""

    name: str
    effects: list[str]
    argument: Literal["rate", "output"] = Field(
        description="Whether the regressors see the true rate (forward law) or the gyro's output (direct law)."
    )


class ErrorFigures(ResponseModel):
    """Input-referred errors in deg/s, one value per data set and axis, root mean square over all."""

    raw_rms_dps: float | None = Field(description="Before any compensation.")
    rms_dps: float | None = Field(description="After compensation, on the data of the fit.")
    heldout_rms_dps: float | None = Field(description="Each temperature predicted by a fit that has not seen it.")
    noise_floor_dps: float | None = Field(description="Root of the mean variance of a data-set mean: white and drift.")


class Validity(ResponseModel):
    """Where the calibration was measured; outside it is extrapolation."""

    temperature_c: tuple[float, float] = Field(description="Lowest and highest of the readings, deg C.")
    rate_dps: tuple[float | None, float | None] = Field(
        description="Lowest and highest true rate, deg/s; null: no limit, nothing of the model depends on the rate."
    )


class FitResponse(ResponseModel):
    """A calibration version, as `labctl fit --json` and `POST .../calibrations` give it."""

    serial: str
    version: int
    model: ModelResponse
    axes: dict[str, Any] = Field(description="axis -> coefficients with value, standard uncertainty u, and unit.")
    error: ErrorFigures
    validity: Validity
    warnings: list[DataWarning] = Field(default_factory=list, description=WARNINGS)


class PreviewResponse(ResponseModel):
    """What a changed model would be; nothing was kept, so it has no version of its own."""

    serial: str
    improved_from: int
    recording: int
    model: ModelResponse
    axes: dict[str, Any] = Field(description="axis -> coefficients with value, standard uncertainty u, and unit.")
    error: ErrorFigures
    before: ErrorFigures
    validity: Validity
    warnings: list[DataWarning] = Field(default_factory=list, description=WARNINGS)
    plausible: dict[str, dict[str, Any]] = Field(description="Effect -> the usual range, and whether it is inside.")
    left_out: list[dict[str, Any]] = Field(description="Effects that a calibration would not export.")
    residuals: ResidualColumns = Field(description="What the changed model leaves, data set by data set.")


class LadderRow(ResponseModel):
    """One version of a unit's calibration, with its errors."""

    version: int
    parent: int | None
    recording: int | None = Field(description="The recording that the version was fitted to.")
    model: str
    effects: list[str]
    applied_rms_dps: float | None = Field(
        default=None, description="Of a version of another recording: its error on this one, applied as it is."
    )
    raw_rms_dps: float | None
    rms_dps: float | None
    heldout_rms_dps: float | None
    noise_floor_dps: float | None


class LadderResponse(ResponseModel):
    """The error of the versions fitted to one recording, each version after its parent."""

    serial: str
    recording: int | None = Field(default=None, description="The recording of all steps.")
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


class VersionResponse(FitResponse):
    """A calibration version as it was made, and whether it is in force."""

    parent: int | None = None
    recording: int | None = None
    created_at: datetime
    hash: str
    in_force: bool
    due: datetime | None = Field(default=None, description="Until when it is in force as certified; null: no date.")
    certification: CertificationResponse | None = Field(
        description="The newest act on this version; null: there was none."
    )


class Surface(ResponseModel):
    """One axis, turned about itself, the others at rest."""

    rate_dps: list[float]
    temperature_c: list[float]
    error_dps: list[list[float]] = Field(
        description="Output minus true rate: a row per temperature, one per rate in it."
    )


class SurfaceResponse(ResponseModel):
    """What a calibration takes off, within what was calibrated."""

    serial: str
    version: int
    validity: Validity
    held: dict[str, float] = Field(description="Channels that the model needs besides: their means in its recording.")
    left_out: list[dict[str, Any]] = Field(description="Effects of the fit that do not leave with the calibration.")
    axes: dict[str, Surface]
