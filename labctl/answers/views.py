"""Views of a criticism: where and how a model fails, as numbers for plots, one or more records for each axis."""

from __future__ import annotations

from typing import NotRequired

from pydantic import Field, JsonValue
from typing_extensions import TypedDict

from labctl.answers.base import ResponseModel

Numbers = list[float | None]


class DataSetColumns(TypedDict):
    """The data sets one by one, as columns of equal length; empty without any axis."""

    of: NotRequired[int]
    """Number of data sets of the recording; of more than 3000, the columns have 3000 that are spread over them."""
    timed: NotRequired[bool]
    """Whether the time of the data sets is known; else the channel `order` counts them from 1 in place of `t_s`."""
    dataset: NotRequired[list[int]]
    """Numbers of the data sets; over several recordings they count through all."""
    recording: NotRequired[list[int]]
    """Number of the recording of each data set; only of several recordings."""
    own_dataset: NotRequired[list[int]]
    """Number of each data set in its own recording; only of several recordings."""
    position: NotRequired[list[str]]
    """Position of the unit: the body axis that points up, such as x, -x or x@180."""
    run: NotRequired[list[int]]
    """Number of the powered run; it changes with each power-on."""
    channels: NotRequired[dict[str, Numbers]]
    """Channel -> value at each data set, in the unit of the channel; null: unknown."""
    residual_dps: NotRequired[dict[str, Numbers]]
    """Output axis -> mean residual, measured minus modelled error, deg/s; null: unknown."""
    over_floor: NotRequired[dict[str, Numbers]]
    """Output axis -> residual divided by its noise floor, with the sign of the residual; null: unknown."""


class MeanLine(TypedDict):
    """The mean residual along a channel."""

    at: Numbers
    """Mean of the channel at each point, in its unit."""
    mean_dps: Numbers
    """Mean residual at each point, measured minus modelled error, deg/s."""
    low_dps: Numbers
    """Lower limit of the 95 % band of the mean by noise and drift, deg/s."""
    high_dps: Numbers
    """Upper limit of the 95 % band of the mean by noise and drift, deg/s."""
    z: float | None
    """Largest size of a mean over its standard uncertainty, at least 0; null: unknown."""


class ChannelLine(TypedDict):
    """The mean residual against one channel; against the rate of the table, for one position."""

    axis: str
    """Output axis, x, y or z."""
    channel: str
    """Channel along which the mean is computed."""
    position: NotRequired[str]
    """Position of the unit: the body axis that points up, such as -x; only where `channel` is table_rate_dps."""
    at: Numbers
    """Mean of the channel at each point, in its unit."""
    mean_dps: Numbers
    """Mean residual at each point, measured minus modelled error, deg/s."""
    low_dps: Numbers
    """Lower limit of the 95 % band of the mean by noise and drift, deg/s."""
    high_dps: Numbers
    """Upper limit of the 95 % band of the mean by noise and drift, deg/s."""
    z: float | None
    """Largest size of a mean over its standard uncertainty, at least 0; null: unknown."""


class PreviousRateLine(TypedDict):
    """The mean residual against the rate of the table before the data set."""

    axis: str
    """Output axis, x, y or z."""
    at: Numbers
    """Mean of the previous rate at each point, deg/s."""
    mean_dps: Numbers
    """Mean residual at each point, measured minus modelled error, deg/s."""
    low_dps: Numbers
    """Lower limit of the 95 % band of the mean by noise and drift, deg/s."""
    high_dps: Numbers
    """Upper limit of the 95 % band of the mean by noise and drift, deg/s."""
    z: float | None
    """Largest size of a mean over its standard uncertainty, at least 0; null: unknown."""


class TimeAxis(TypedDict, total=False):
    """Where a mean against time has its points and where power came: in time, else in the order of the data sets."""

    t_s: Numbers
    """Time of each point since the start of the recording, s; absent where no time is known."""
    power_on_t_s: Numbers
    """Time of the first data set of each powered run, s; absent where no time is known."""
    order: Numbers
    """Place of each point in the order of the data sets, from 1; only where no time is known."""
    power_on_order: Numbers
    """Place of the first data set of each powered run, from 1; only where no time is known."""


class TimeLine(TimeAxis):
    """The mean residual against time, or against the order of the data sets where no time is known."""

    axis: str
    """Output axis, x, y or z."""
    mean_dps: Numbers
    """Mean residual at each point, measured minus modelled error, deg/s."""
    low_dps: Numbers
    """Lower limit of the 95 % band of the mean by noise and drift, deg/s."""
    high_dps: Numbers
    """Upper limit of the 95 % band of the mean by noise and drift, deg/s."""
    z: float | None
    """Largest size of a mean over its standard uncertainty, at least 0; null: unknown."""
    lag1: float | None
    """Correlation of the residuals of neighbouring data sets of a powered run, -1 to 1; null: too few data sets."""
    lag1_whitened: float | None
    """The same of the residuals whitened by the noise and drift found, -1 to 1; null: too few data sets."""
    runs_z: float | None
    """z of the Wald-Wolfowitz runs test of the whitened residuals; negative: neighbours are alike; null: too few."""
    runs_p: float | None
    """Two-sided p-value of the runs test, 0 to 1; null: fewer than 12 data sets."""


class LegLine(TypedDict):
    """The residual where a temperature was reached from below, minus that where it was reached from above."""

    axis: str
    """Output axis, x, y or z."""
    channel: str
    """Channel along which the mean is computed: temperature_c or table_rate_dps."""
    pairs: int
    """Number of pairs of data sets at equal rate, temperature and position."""
    at: Numbers
    """Mean of the channel at each point, in its unit."""
    mean_dps: Numbers
    """Mean difference of the residuals at each point, from below minus from above, deg/s."""
    low_dps: Numbers
    """Lower limit of the 95 % band of the mean by noise and drift, deg/s."""
    high_dps: Numbers
    """Upper limit of the 95 % band of the mean by noise and drift, deg/s."""
    z: float | None
    """Largest size of a mean over its standard uncertainty, at least 0; null: unknown."""


class Repeats(TypedDict):
    """How far the residuals of data sets at one rate, temperature and position scatter."""

    axis: str
    """Output axis, x, y or z."""
    pairs: int
    """Number of pairs of data sets at one rate, temperature and position."""
    scatter_dps: float | None
    """Standard deviation of one residual, from the differences of the pairs, deg/s."""
    floor_dps: float | None
    """Standard deviation that noise and drift give at the distances in time of the pairs, deg/s."""
    over_floor: float | None
    """Scatter divided by its floor, at least 0; null: the floor is 0."""
    datasets: list[list[int]]
    """The numbers of the two data sets of each pair; of more than 3000 pairs, 3000 of every size of difference."""
    apart_sets: list[int]
    """Distance of the two data sets of each pair of `datasets`, as a number of data sets."""
    apart_s: NotRequired[Numbers]
    """Distance of the two data sets of each pair of `datasets` in time, s; absent where no time is known."""
    difference_dps: Numbers
    """Difference of the residuals of each pair of `datasets`, second minus first, deg/s."""


class BetweenSets(TypedDict):
    """Periodogram of the mean residuals over time (Lomb-Scargle)."""

    axis: str
    """Output axis, x, y or z."""
    per_hour: Numbers
    """Frequency of each point, cycles per hour, 1/h."""
    amplitude_dps: Numbers
    """Amplitude of a sine wave of that frequency in the mean residuals, deg/s."""
    noise_dps: Numbers
    """Amplitude that noise and drift alone give on average, deg/s."""


class AngleLine(TypedDict):
    """A sine wave in the angle of the table."""

    cycles_per_turn: int
    """Cycles per turn of the table, at least 1."""
    amplitude_dps: float | None
    """Amplitude, deg/s; null: unknown."""


class AngleSpectrum(TypedDict):
    """Spectrum of the readings over the angle of the table, mean over the data sets that turn at least twice."""

    axis: str
    """Output axis, x, y or z."""
    datasets: int
    """Number of data sets."""
    cycles_per_turn: list[int]
    """Cycles per turn of each point, at least 1."""
    over_white: Numbers
    """Power divided by that of white noise, 1."""
    limit: Numbers
    """Limit of `over_white` that noise alone exceeds at any of the points in 5 % of recordings, 1."""
    lines: list[AngleLine]
    """The highest points above the limit, at most 8, highest first."""
    stepper_lines: list[AngleLine]
    """Lines of the stepper motor, which are subtracted before the spectrum."""


class FrequencySpectrum(TypedDict):
    """Spectrum of the readings over time within data sets, mean over the data sets."""

    axis: str
    """Output axis, x, y or z."""
    datasets: int
    """Number of data sets."""
    hz: Numbers
    """Frequency of each point, Hz."""
    over_white: Numbers
    """Power divided by that of white noise, 1."""
    limit: Numbers
    """Limit of `over_white` that noise alone exceeds at any of the points in 5 % of recordings, 1."""


class StartProfile(TypedDict):
    """The mean course of the residual within data sets, each without its own mean."""

    axis: str
    """Output axis, x, y or z."""
    datasets: int
    """Number of data sets."""
    since_s: Numbers
    """Time of each point since the first reading of the data set, s."""
    mean_dps: Numbers
    """Mean over the data sets, deg/s."""
    band_dps: Numbers
    """Half width of the 95 % band of the mean, deg/s."""
    per_step: NotRequired[Numbers]
    """The part proportional to the step in rate before the data set, per deg/s of it, 1; absent without steps."""
    per_step_band: NotRequired[Numbers]
    """Half width of the 95 % band of `per_step`, 1; absent without steps."""


class Views(TypedDict, total=False):
    """All views of a criticism; empty where there was too little for a verdict."""

    sets: DataSetColumns
    """The data sets one by one."""
    channels: list[ChannelLine]
    """Mean residual against each channel that varies, by axis."""
    time: list[TimeLine]
    """Mean residual against time, by axis."""
    frequency: list[BetweenSets]
    """Periodogram of the mean residuals, by axis; only where times are known, of 16 data sets and more."""
    legs: list[LegLine]
    """Hysteresis: difference of the residuals between rising and falling temperature, by axis and channel."""
    previous_rate: list[PreviousRateLine]
    """Mean residual against the rate before, by axis; only where it is known and varies."""
    repeats: list[Repeats]
    """Scatter of repeated data sets, by axis; only where there are any."""
    angle: list[AngleSpectrum]
    """Spectrum over the angle of the table, by axis; only of readings with angles."""
    frequency_within: list[FrequencySpectrum]
    """Spectrum over time within data sets, by axis; only of readings."""
    time_in_set: list[StartProfile]
    """Mean course within data sets, by axis; only of readings."""
    draws: dict[str, list[str]]
    """View or channel -> ids of the effects of which the signature would appear there."""


class PictureResponse(ResponseModel):
    """One picture."""

    id: str = Field(description="Identifier of the picture, for programs.")
    title: str = Field(description="Title of the picture.")
    how_to_read: str = Field(description="What the picture shows and how it is read, in words.")
    effects: list[str] = Field(description="Effects that would be visible in this picture.")
    figure: dict[str, JsonValue] = Field(description="A figure as Plotly describes it: data and layout.")


class PicturesResponse(ResponseModel):
    """All pictures, cached: drawing them takes a second."""

    pictures: list[PictureResponse] = Field(description="All pictures of a criticism.")
