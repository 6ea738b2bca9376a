"""Views of a criticism: where and how a model fails, as numbers for plots, one or more records for each axis."""

from __future__ import annotations

from typing import NotRequired

from typing_extensions import TypedDict

Numbers = list[float | None]


class DataSetColumns(TypedDict):
    """The data sets one by one, as columns of equal length; `of`: how many the recording has.

    Where no time is known (`timed`), the channel `order` counts the data sets from 1. Empty without any axis.
    """

    of: NotRequired[int]
    timed: NotRequired[bool]
    dataset: NotRequired[list[int]]
    recording: NotRequired[list[int]]  #: of several recordings, the number of the data set's
    own_dataset: NotRequired[list[int]]  #: and the number that the data set has there
    position: NotRequired[list[str]]
    run: NotRequired[list[int]]
    channels: NotRequired[dict[str, Numbers]]
    residual_dps: NotRequired[dict[str, Numbers]]
    over_floor: NotRequired[dict[str, Numbers]]


class MeanLine(TypedDict):
    """The mean residual with its 95 % band, deg/s, along a channel; z of its largest deviation."""

    at: Numbers
    mean_dps: Numbers
    low_dps: Numbers
    high_dps: Numbers
    z: float | None


class ChannelLine(TypedDict):
    """The same against one channel; against the table's rate, for one position."""

    axis: str
    channel: str
    position: NotRequired[str]
    at: Numbers
    mean_dps: Numbers
    low_dps: Numbers
    high_dps: Numbers
    z: float | None


class PreviousRateLine(TypedDict):
    """The same against the rate before."""

    axis: str
    at: Numbers
    mean_dps: Numbers
    low_dps: Numbers
    high_dps: Numbers
    z: float | None


class TimeAxis(TypedDict, total=False):
    """Where a mean against time has its points and where power came: in time, else in the order of the data sets."""

    t_s: Numbers
    power_on_t_s: Numbers
    order: Numbers
    power_on_order: Numbers


class TimeLine(TimeAxis):
    """The same against time, or against the order of the data sets where no time is known, with where power came.

    `lag1`: correlation of neighbours; `runs_z`, `runs_p`: the runs test; both null for too few data sets.
    """

    axis: str
    mean_dps: Numbers
    low_dps: Numbers
    high_dps: Numbers
    z: float | None
    lag1: float | None
    lag1_whitened: float | None
    runs_z: float | None
    runs_p: float | None


class LegLine(TypedDict):
    """The residual reached from a lower temperature minus that from a higher, deg/s, along a channel."""

    axis: str
    channel: str
    pairs: int
    at: Numbers
    mean_dps: Numbers
    low_dps: Numbers
    high_dps: Numbers
    z: float | None


class Repeats(TypedDict):
    """How far data sets at one rate, temperature and position scatter, deg/s; `apart_s` only where times are known."""

    axis: str
    pairs: int
    scatter_dps: float | None
    floor_dps: float | None
    over_floor: float | None
    datasets: list[list[int]]
    apart_sets: list[int]
    apart_s: NotRequired[Numbers]
    difference_dps: Numbers


class BetweenSets(TypedDict):
    """The amplitude of waves in the mean residuals by cycles per hour, and what noise alone gives, deg/s."""

    axis: str
    per_hour: Numbers
    amplitude_dps: Numbers
    noise_dps: Numbers


class AngleLine(TypedDict):
    """A wave in the table angle: whole cycles per turn, and its amplitude."""

    cycles_per_turn: int
    amplitude_dps: float | None


class AngleSpectrum(TypedDict):
    """Power of waves in the table angle over white noise, the limit of chance, and the lines above it."""

    axis: str
    datasets: int
    cycles_per_turn: list[int]
    over_white: Numbers
    limit: Numbers
    lines: list[AngleLine]
    stepper_lines: list[AngleLine]


class FrequencySpectrum(TypedDict):
    """Power of waves in time within data sets over white noise, by frequency in Hz, and the limit of chance."""

    axis: str
    datasets: int
    hz: Numbers
    over_white: Numbers
    limit: Numbers


class StartProfile(TypedDict):
    """The mean course within data sets, deg/s, and the same per deg/s of the step in rate before it."""

    axis: str
    datasets: int
    since_s: Numbers
    mean_dps: Numbers
    band_dps: Numbers
    per_step: NotRequired[Numbers]
    per_step_band: NotRequired[Numbers]


class Views(TypedDict, total=False):
    """All views of a criticism; empty where there was too little for a verdict."""

    sets: DataSetColumns
    channels: list[ChannelLine]
    time: list[TimeLine]
    frequency: list[BetweenSets]
    legs: list[LegLine]
    previous_rate: list[PreviousRateLine]
    repeats: list[Repeats]
    angle: list[AngleSpectrum]
    frequency_within: list[FrequencySpectrum]
    time_in_set: list[StartProfile]
    draws: dict[str, list[str]]
