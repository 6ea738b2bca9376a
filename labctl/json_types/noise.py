"""Noise at rest: the Allan deviation of a stretch of readings, axis by axis."""

from __future__ import annotations

from typing import NotRequired

from typing_extensions import TypedDict


class NoiseFigure(TypedDict):
    """One figure of IEEE Std 952 with its standard uncertainty; without one `at_most` may bound it, `why` says why."""

    value: float | None
    u: float | None
    unit: str
    at_most: float | None
    why: str


class AllanJson(TypedDict):
    """The overlapping Allan deviation of an axis with its 95 % interval, the sum of the terms, and the figures.

    `model_dps` is null at averaging times below `from_s`, which the figures do not rest on.
    """

    tau_s: list[float | None]
    deviation_dps: list[float | None]
    low_dps: list[float | None]
    high_dps: list[float | None]
    model_dps: list[float | None]
    N: NoiseFigure
    B: NoiseFigure
    K: NoiseFigure
    trend_dps: float | None
    replaces_datasheet: bool
    from_s: NotRequired[float]  #: shortest averaging time that the figures rest on, where it is not the first
    smoothing_s: NotRequired[float]  #: mean distance of two instants that the output filter weighs, where it smooths
    step_dps: NotRequired[float]  #: step of the output, where it hides the noise


class StaticRecordJson(TypedDict):
    """One stretch at rest: its first and last data set, its temperature and duration, and the noise by axis."""

    datasets: list[int]
    temperature_c: float | None
    duration_s: float | None
    axes: dict[str, AllanJson]
