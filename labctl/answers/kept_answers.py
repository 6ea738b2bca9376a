"""Answers of a fit and of a change of effects, as they are stored with the version that each made."""

from __future__ import annotations

from typing import NotRequired

from typing_extensions import TypedDict

from labctl.answers.fitted_model import (
    ErrorFiguresJson,
    FitResultJson,
    LeftOutEffect,
    ThermalHintJson,
    TypePriorJson,
    UsualRange,
)
from labctl.answers.json_object import JsonObject


class FitFigures(FitResultJson):
    """What is reported of a fit to the recordings of a unit, whether it is stored or not."""

    recording: int
    """Number of the newest recording of the fit."""
    recordings: list[int]
    """Numbers of all recordings of the fit."""
    warnings: list[JsonObject]
    """What is certainly or probably wrong with the data or the fit: the fields of a `DataWarning`."""


class ChangeFigures(FitFigures):
    """What is reported of a change of effects, whether it is stored or not."""

    improved_from: int
    """Number of the version that was changed."""
    before: ErrorFiguresJson
    """Errors of the model before the change, on the same recordings."""
    plausible: dict[str, UsualRange]
    """Effect -> usual range of its first coefficient; only where a range is known."""
    thermal_hint: ThermalHintJson | None
    """Thermal lag that was added at rest and is not certain; null: none."""


class KeptVersion(TypedDict):
    """Which version an answer is of."""

    serial: str
    """Serial number of the unit."""
    version: int
    """Number of the version of the unit, from 1."""
    hash: str
    """SHA-256 of the calibration file."""


class KeptFit(FitFigures, KeptVersion):
    """The answer of a fit, as it is stored with the version that it made."""

    campaign: int | None
    """Number of the campaign that made the recording; null: it was imported."""
    recipe: str | None
    """Name of the recipe of the campaign; null: no campaign."""
    bench: str | None
    """Name of the bench of the campaign; null: no campaign."""
    type_prior: NotRequired[TypePriorJson]
    """What other units of the type contributed; absent: the unit was fitted alone."""


class KeptChange(ChangeFigures, KeptVersion):
    """The answer of a change of effects, as it is stored with the version that it made."""

    parent: int
    """Number of the version that was changed."""
    left_out: list[LeftOutEffect]
    """Effects of the fit that the calibration does not contain."""


#: Of a version that labctl 0.1 kept, keys may be missing that came later.
KeptAnswer = KeptFit | KeptChange
