"""What the inspection of readings shows: the course of each channel, and where something was found."""

from __future__ import annotations

from typing_extensions import TypedDict


class CourseJson(TypedDict):
    """The course of one channel, in bins in the order of time; null ends a data set."""

    channel: str
    """Name of the channel."""
    unit: str
    """Unit of the channel."""
    t_s: list[float | None]
    """Time of the first reading of each bin, s; null: a data set ends there."""
    low: list[float | None]
    """Least reading of each bin, in `unit`; null: no number, or a data set ends there."""
    high: list[float | None]
    """Largest reading of each bin, in `unit`; null: no number, or a data set ends there."""
    readings: int
    """Number of readings that are finite numbers; all of them are in the bins."""
    bins: int
    """Number of bins."""


class MarkJson(TypedDict):
    """Where one kind of finding is in a channel."""

    what: str
    """Kind of the finding."""
    channel: str
    """Name of the channel; empty: every channel."""
    from_s: list[float]
    """Time of the last reading before each of the longest stretches, at most 60, s."""
    until_s: list[float]
    """Time of the first reading after each of these stretches, s."""
    places: int
    """Number of all stretches; 0 where `whole` is true."""
    whole: bool
    """Whether it concerns all of the channel."""
