"""Whole answers as plots read them: a criticism, the ladder of a unit's versions, a version beside a recording."""

from __future__ import annotations

from typing import NotRequired

from typing_extensions import TypedDict

from labctl.json_types.criticism import (
    CriticisedErrors,
    CriticisedNoise,
    Experiment,
    NotTestable,
    ResidualMap,
    Suspect,
    WorstDataSet,
)
from labctl.json_types.views import Views


class CriticismJson(TypedDict):
    """What is drawn and reported of a criticism."""

    serial: str
    version: int
    recording: int
    text: list[str]
    error: CriticisedErrors
    noise: NotRequired[CriticisedNoise]
    suspects: list[Suspect]
    experiments: list[Experiment]
    not_testable: list[NotTestable]
    worst: NotRequired[list[WorstDataSet]]
    maps: NotRequired[list[ResidualMap]]
    views: NotRequired[Views]


class LadderStep(TypedDict):
    """One version with its errors, deg/s."""

    version: int
    model: str
    effects: list[str]
    rms_dps: float | None
    heldout_rms_dps: float | None


class LadderJson(TypedDict):
    """The versions of a unit, each after its parent."""

    steps: list[LadderStep]
    noise_floor_dps: float | None


class ModelLinesJson(TypedDict):
    """The model's error of one output in one position: a row for each level, a number for each `at` in it."""

    axis: str
    position: str
    level: list[float]
    at: list[float]
    error_dps: list[list[float]]


class ComparisonColumnsJson(TypedDict):
    """Rows of data sets and output axes, as lists of equal length."""

    dataset: list[int]
    axis: list[str]
    position: list[str]
    table_rate_dps: list[float]
    own_rate_dps: list[float]
    temperature_c: list[float]
    measured_error_dps: list[float]
    turn_before_deg: list[float | None]
    turn_after_deg: list[float | None]


class ComparisonJson(TypedDict):
    """A version without refitting, beside a recording."""

    columns: ComparisonColumnsJson
    over_rate: list[ModelLinesJson]
