"""The calibration file, and what was known of a version when it was certified."""

from __future__ import annotations

from typing import NotRequired

from typing_extensions import TypedDict

from instruments.datasheet import Convention
from labctl.json_types.budget import BenchConditionsJson, BudgetJson, UncertaintyJson
from labctl.json_types.models import (
    AxisNoiseJson,
    Coefficients,
    ErrorFiguresJson,
    FitEnvironment,
    FittedModelJson,
    LeftOut,
    SpecificForceJson,
    StateJson,
    ValidityJson,
)
from labctl.json_types.poses import PosesJson


class UnitJson(TypedDict):
    """What a unit is."""

    model: str
    technology: str | None


class SoftwareJson(TypedDict):
    """What made a file."""

    name: str
    version: str


class OutputUnitJson(TypedDict):
    """How an axis's output becomes a rate in deg/s: (output - offset) / scale."""

    scale: float
    offset: float
    unit: str


class AxisEvidenceJson(TypedDict):
    """What the uncertainty of one axis in use is computed from; the variances in (deg/s)^2."""

    rate_dps: list[float]
    temperature_c: list[float]
    left_var: list[float | None]
    white_var: list[float]
    repeatability_dps: float | None
    repeatability_freedom: int | None
    repeatability_source: str
    repeatability_convention: NotRequired[Convention]  #: of the figure of a data sheet
    repeatability_text: NotRequired[str]  #: of a data sheet: its figure, the convention, and what follows from it
    across_dps: NotRequired[dict[str, list[float]]]  #: rates about the other body axes about which the unit was turned
    correlation: NotRequired[dict[str, float]]  #: of its residuals with those of the other outputs


class CertificationJson(TypedDict):
    """The newest act on a version: in-force, superseded or revoked; the hash of the calibration without it."""

    state: str
    by: str
    reason: str
    at: str
    due: str | None
    calibration_hash: str


class CalibrationJson(TypedDict):
    """A calibration file. A file that was read counts as one only once its hash and its parts were checked."""

    schema: str
    serial: str
    version: int
    parent: int | None
    issued_at: str
    unit: UnitJson
    software: SoftwareJson
    axes: list[str]
    certification: NotRequired[CertificationJson]
    output: dict[str, OutputUnitJson]
    model: FittedModelJson
    coefficients: dict[str, Coefficients]
    papers: dict[str, object]
    left_out: list[LeftOut]
    specific_force: NotRequired[SpecificForceJson]
    state: NotRequired[StateJson]  #: what a correction keeps from sample to sample; absent where it keeps nothing
    error: ErrorFiguresJson
    noise: dict[str, AxisNoiseJson]
    environment: FitEnvironment
    validity: ValidityJson
    use: NotRequired[dict[str, AxisEvidenceJson]]
    standards: NotRequired[BenchConditionsJson]
    uncertainty: NotRequired[UncertaintyJson | None]
    response: NotRequired[dict[str, dict[str, BudgetJson]]]  #: axis -> budgets of delay and time constant, s
    poses: NotRequired[PosesJson]
    configuration: NotRequired[dict[str, str]]  #: how the unit was set, as it said itself; absent where it says nothing
    provenance: dict[str, object]
    how_to_use: str
    hash: str


class ObjectionJson(TypedDict):
    """One objection to certifying a version."""

    what: str
    text: str
    do: str


class JudgementDetail(TypedDict, total=False):
    """Beside a verdict: why there is none, its text, the version's errors, what was overridden, and where
    the due date is from."""

    verdict_reason: str
    verdict_text: str
    error: dict[str, float | None]
    objections: list[ObjectionJson]
    due_from: str | None
