"""The calibration file, and what was known of a version when it was certified."""

from __future__ import annotations

from typing import NotRequired

from typing_extensions import TypedDict

from instruments.datasheet import Convention
from labctl.answers.budget import BenchConditionsJson, BudgetJson, UncertaintyJson
from labctl.answers.fitted_model import (
    AxisNoiseJson,
    Coefficients,
    ErrorFiguresJson,
    FitEnvironment,
    FittedModelJson,
    LeftOutEffect,
    SpecificForceJson,
    StateJson,
    ValidityJson,
)
from labctl.answers.poses import PosesJson


class UnitJson(TypedDict):
    """What a unit is."""

    model: str
    """Model of the unit, as its maker names it."""
    technology: str | None
    """Technology: fog, mems or piezo; null: not stated."""


class SoftwareJson(TypedDict):
    """What made a file."""

    name: str
    """Name of the program."""
    version: str
    """Version of the program."""


class OutputUnitJson(TypedDict):
    """How an axis's output becomes a rate: (output - offset) / scale."""

    scale: float
    """Output per deg/s, in `unit` per deg/s."""
    offset: float
    """Output at zero rate, in `unit`."""
    unit: str
    """Unit of the output."""


class AxisEvidenceJson(TypedDict):
    """What the uncertainty of one axis in use is computed from; lists over data sets."""

    rate_dps: list[float]
    """True rate along the axis, deg/s."""
    temperature_c: list[float]
    """Temperature, deg C."""
    left_var: list[float | None]
    """Variance of the error of the model on data sets left out, (deg/s)^2; null: unknown."""
    white_var: list[float]
    """Variance of the data set mean by white noise, (deg/s)^2; 0: unknown."""
    repeatability_dps: float | None
    """Standard uncertainty of the change to a later power-on, deg/s; null: unknown."""
    repeatability_freedom: int | None
    """Degrees of freedom of that uncertainty; null: it is stated and not estimated, or unknown."""
    repeatability_source: str
    """Where that uncertainty is from; none: it is unknown."""
    repeatability_convention: NotRequired[Convention]
    """Convention of a data sheet's figure; absent: not from a data sheet."""
    repeatability_text: NotRequired[str]
    """Figure of a data sheet, its convention, and what follows from it; absent: not from a data sheet."""
    across_dps: NotRequired[dict[str, list[float]]]
    """Body axis -> rate about the other axes about which the unit was turned, deg/s; absent: not stored."""
    correlation: NotRequired[dict[str, float]]
    """Other output axis -> correlation of the residuals of both, -1 to 1; absent: a single output."""


class CertificationJson(TypedDict):
    """The newest certification or revocation of a version."""

    state: str
    """in-force, superseded or revoked."""
    by: str
    """Name of the person who certified or revoked it."""
    reason: str
    """Reason that the person gave."""
    at: str
    """Date and time of the act, ISO 8601, UTC."""
    due: str | None
    """Date until which the certification is valid, ISO 8601; null: no date."""
    calibration_hash: str
    """SHA-256 of the calibration without its certification."""
    cause_not_known: NotRequired[list[str]]
    """Of which parts of the model the cause is not known though the error is corrected, in sentences; absent: none."""


class CalibrationJson(TypedDict):
    """A calibration file. A file that was read counts as one only once its hash and its parts were checked."""

    schema: str
    """Name and version of the format."""
    serial: str
    """Serial number of the unit."""
    version: int
    """Number of the version of the unit, from 1."""
    parent: int | None
    """Number of the version that it was changed from; null: none."""
    issued_at: str
    """Date and time at which it was made, ISO 8601."""
    unit: UnitJson
    """What the unit is."""
    software: SoftwareJson
    """What made the file."""
    axes: list[str]
    """Output axes that are corrected, in order."""
    certification: NotRequired[CertificationJson]
    """Newest certification or revocation; absent: never certified."""
    output: dict[str, OutputUnitJson]
    """Output axis -> how the output becomes a rate."""
    model: FittedModelJson
    """Model with its coefficients: effects of the sensor and its package only."""
    coefficients: dict[str, Coefficients]
    """Output axis -> name -> coefficient."""
    papers: dict[str, object]
    """Coefficients in the units and names of the paper of the model; empty: a model of no paper."""
    left_out: list[LeftOutEffect]
    """Effects of the fit that the model does not contain."""
    specific_force: NotRequired[SpecificForceJson]
    """Sensitivity to specific force; absent: the fit has no such effect."""
    state: NotRequired[StateJson]
    """What a correction keeps from sample to sample; absent: nothing."""
    error: ErrorFiguresJson
    """Errors of the fit."""
    noise: dict[str, AxisNoiseJson]
    """Output axis -> noise that weighted the fit."""
    environment: FitEnvironment
    """Thermometer, and treatment of the Earth's rate."""
    validity: ValidityJson
    """Range in which it was measured."""
    use: NotRequired[dict[str, AxisEvidenceJson]]
    """Output axis -> what the uncertainty in use is computed from; absent: made by an older version of labctl."""
    standards: NotRequired[BenchConditionsJson]
    """Reference standards of the bench; absent: made by an older version of labctl."""
    uncertainty: NotRequired[UncertaintyJson | None]
    """Uncertainty of a corrected rate; null: none is defined; absent: made by an older version of labctl."""
    response: NotRequired[dict[str, dict[str, BudgetJson]]]
    """Output axis -> budgets of delay and time constant, s; absent: none was fitted."""
    poses: NotRequired[PosesJson]
    """Rests, accelerometer and moves of a calibration in poses; absent: another motion."""
    configuration: NotRequired[dict[str, str]]
    """Setting -> value, as the unit reported them; absent: it reports none."""
    provenance: dict[str, object]
    """Recordings, campaign, recipe and bench that the file is from."""
    how_to_use: str
    """How to apply the model, in words."""
    hash: str
    """SHA-256 of the canonical file without this field."""
