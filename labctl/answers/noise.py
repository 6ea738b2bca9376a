"""Noise at rest: the Allan deviation of a stretch of readings, axis by axis."""

from __future__ import annotations

from typing import NotRequired

from typing_extensions import TypedDict


class NoiseFigure(TypedDict):
    """One figure of IEEE Std 952."""

    value: float | None
    """Value, in `unit`; null: the record does not show it."""
    u: float | None
    """Standard uncertainty, in `unit`; null: there is no value."""
    unit: str
    """Unit of the numbers."""
    at_most: float | None
    """95 % upper bound, in `unit`; null: there is a value, or no bound is known."""
    why: str
    """Why there is no value; empty where there is one."""


class AllanJson(TypedDict):
    """The overlapping Allan deviation of one axis, and the figures that it shows; lists over the averaging times."""

    tau_s: list[float | None]
    """Averaging times, s."""
    deviation_dps: list[float | None]
    """Overlapping Allan deviation, deg/s."""
    low_dps: list[float | None]
    """Lower limit of the 95 % interval of the deviation, deg/s."""
    high_dps: list[float | None]
    """Upper limit of the 95 % interval of the deviation, deg/s."""
    model_dps: list[float | None]
    """Allan deviation of the sum of the terms that were fitted, deg/s; null: below `from_s`."""
    N: NoiseFigure
    """Angle random walk."""
    B: NoiseFigure
    """Bias instability."""
    K: NoiseFigure
    """Rate random walk."""
    trend_dps: float | None
    """Range of the slow trend that was subtracted before the terms were fitted, deg/s; 0: none was."""
    replaces_datasheet: bool
    """Whether the bias instability is used in place of that of the data sheet."""
    from_s: NotRequired[float]
    """Shortest averaging time that the figures rest on, s; absent: the first."""
    smoothing_s: NotRequired[float]
    """Mean distance of two instants that the output filter weighs together, s; absent: it does not smooth."""
    step_dps: NotRequired[float]
    """Quantization step of the output, deg/s; absent: it does not hide the noise."""


class StaticRecordJson(TypedDict):
    """The longest stretch at rest and at one temperature."""

    datasets: list[int]
    """Numbers of its first and its last data set."""
    temperature_c: float | None
    """Mean temperature, deg C; null: no thermometer."""
    duration_s: float | None
    """Duration, s."""
    axes: dict[str, AllanJson]
    """Output axis -> noise; axes with too few readings are absent."""
