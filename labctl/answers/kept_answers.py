"""Answers of a fit and of a change of effects, as they are stored with the version that each made."""

from __future__ import annotations

from labctl.answers.fitted_model import ErrorFiguresJson, FitResultJson, LeftOutEffect, ThermalHintJson, UsualRange
from labctl.answers.inspection import FindingJson


class ChangeFigures(FitResultJson):
    """What is reported of a change of effects, whether it is stored or not."""

    recording: int
    """Number of the newest recording of the fit."""
    recordings: list[int]
    """Numbers of all recordings of the fit."""
    improved_from: int
    """Number of the version that was changed."""
    before: ErrorFiguresJson
    """Errors of the model before the change, on the same recordings."""
    plausible: dict[str, UsualRange]
    """Effect -> usual range of its first coefficient; only where a range is known."""
    warnings: list[FindingJson]
    """What is certainly or probably wrong with the data or the fit."""
    thermal_hint: ThermalHintJson | None
    """Thermal lag that was added at rest and is not certain; null: none."""


class KeptFit(FitResultJson):
    """The answer of a fit, as it is stored with the version that it made."""

    serial: str
    """Serial number of the unit."""
    version: int
    """Number of the version of the unit, from 1."""
    recording: int
    """Number of the newest recording of the fit."""
    recordings: list[int]
    """Numbers of all recordings of the fit."""
    campaign: int | None
    """Number of the campaign that made the recording; null: it was imported."""
    recipe: str | None
    """Name of the recipe of the campaign; null: no campaign."""
    bench: str | None
    """Name of the bench of the campaign; null: no campaign."""
    hash: str
    """SHA-256 of the calibration file."""
    warnings: list[FindingJson]
    """What is certainly or probably wrong with the data or the fit."""


class KeptChange(ChangeFigures):
    """The answer of a change of effects, as it is stored with the version that it made."""

    serial: str
    """Serial number of the unit."""
    version: int
    """Number of the version of the unit, from 1."""
    parent: int
    """Number of the version that was changed."""
    left_out: list[LeftOutEffect]
    """Effects of the fit that the calibration does not contain."""
    hash: str
    """SHA-256 of the calibration file."""


#: Of a version that labctl 0.1 kept, keys may be missing that came later.
KeptAnswer = KeptFit | KeptChange
