"""What the inspection of readings shows: the course of each channel, and where something was found."""

from __future__ import annotations

from typing_extensions import TypedDict


class CourseJson(TypedDict):
    """One channel in bins in the order of time: begin of each, least and largest reading; all `readings` are in them.

    null: no number, or a data set ends there.
    """

    channel: str
    unit: str
    t_s: list[float | None]
    low: list[float | None]
    high: list[float | None]
    readings: int
    bins: int


class MarkJson(TypedDict):
    """Where one kind of finding is in a channel: the times of the longest of `places` stretches.

    `whole`: it is about all of the channel. An empty channel is every channel.
    """

    what: str
    channel: str
    from_s: list[float]
    until_s: list[float]
    places: int
    whole: bool
