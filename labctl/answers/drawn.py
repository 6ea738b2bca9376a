"""Whole answers as plots read them: a criticism, the ladder of a unit's versions, a version beside a recording."""

from __future__ import annotations

from typing import NotRequired

from typing_extensions import TypedDict

from labctl.answers.criticism import (
    CriticisedErrors,
    CriticisedNoise,
    Experiment,
    NotTestable,
    ResidualMap,
    Suspect,
    WorstDataSet,
)
from labctl.answers.views import Views


class CriticismJson(TypedDict):
    """What is drawn and reported of a criticism."""

    serial: str
    """Serial number of the unit."""
    version: int
    """Number of the version."""
    recording: int
    """Number of the newest recording that the version is compared with."""
    text: list[str]
    """The verdict in sentences, the conclusion first."""
    error: CriticisedErrors
    """Errors of the model refitted to the recording."""
    noise: NotRequired[CriticisedNoise]
    """Noise of the data set means and of the record at rest."""
    suspects: list[Suspect]
    """Effects that may be missing, best first; last those of an impossible size."""
    experiments: list[Experiment]
    """Changed recipes that would separate effects, best first."""
    not_testable: list[NotTestable]
    """Effects that the recording cannot show."""
    worst: NotRequired[list[WorstDataSet]]
    """Data sets furthest from the model, at most 10."""
    maps: NotRequired[list[ResidualMap]]
    """Residual over rate and temperature, by axis and position."""
    views: NotRequired[Views]
    """Numbers of the other pictures."""


class LadderStep(TypedDict):
    """One version with its errors."""

    version: int
    """Number of the version."""
    model: str
    """Name of its model."""
    effects: list[str]
    """Ids of its effects, in order."""
    rms_dps: float | None
    """RMS error on the data that were fitted, deg/s; null: unknown."""
    heldout_rms_dps: float | None
    """RMS error on data left out of the fit, deg/s; null: none can be left out."""


class LadderJson(TypedDict):
    """The versions of a unit, each after its parent."""

    steps: list[LadderStep]
    """The versions, depth first."""
    noise_floor_dps: float | None
    """Noise floor of the newest version, deg/s; null: unknown."""


class ModelLinesJson(TypedDict):
    """The model's error of one output in one position: a line for each level."""

    axis: str
    """Output axis, x, y or z."""
    position: str
    """Position of the unit: the body axis that points up, such as x, -x or x@180."""
    level: list[float]
    """Temperature of each line over the rate, deg C, or table rate of each line over the temperature, deg/s."""
    at: list[float]
    """Points of the lines: table rate, deg/s, or temperature, deg C."""
    error_dps: list[list[float]]
    """Error, output minus true rate, deg/s: a row for each level, a number for each of `at` in it."""


class ComparisonColumnsJson(TypedDict):
    """Rows of data sets and output axes, as lists of equal length."""

    dataset: list[int]
    """Number of the data set in its recording."""
    axis: list[str]
    """Output axis, x, y or z."""
    position: list[str]
    """Position of the unit: the body axis that points up, such as x, -x or x@180."""
    table_rate_dps: list[float]
    """Rate of the table, deg/s."""
    own_rate_dps: list[float]
    """True rate along the output axis, deg/s."""
    temperature_c: list[float]
    """Temperature by the thermometer of the axis, deg C."""
    measured_error_dps: list[float]
    """Output minus true rate, deg/s."""
    turn_before_deg: list[float | None]
    """Error of the angle of a full turn with the static bias subtracted, deg; null: too slow, or another axis."""
    turn_after_deg: list[float | None]
    """Error of the angle of a full turn after correction, deg; null: too slow, or another axis."""


class ComparisonJson(TypedDict):
    """A version without refitting, beside a recording."""

    columns: ComparisonColumnsJson
    """Measured errors, by data set and axis."""
    over_rate: list[ModelLinesJson]
    """A line over the table rate for each temperature level."""
