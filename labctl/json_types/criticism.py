"""Parts of a criticism: errors, noise, suspects, experiments, and where the model fails."""

from __future__ import annotations

from typing import Literal, NotRequired

from pydantic import JsonValue
from typing_extensions import TypedDict

from labctl.json_types.models import Coefficient, Origin
from labctl.json_types.noise import StaticRecordJson


class CriticisedErrors(TypedDict):
    """Errors of the model as it was refitted for the criticism, and how much of what is there it explains."""

    rms_dps: float | None
    """RMS residual of the data set means, deg/s; null: unknown."""
    heldout_rms_dps: float | None
    """RMS error on data sets that the model was not fitted to, deg/s; null: there are too few to leave any out."""
    noise_floor_dps: float | None
    """RMS residual that noise alone leaves, deg/s; null: unknown."""
    noise_floor_source: str
    """What the noise floor was computed from."""
    explained: float | None
    """Share of the chi2 of the raw error in excess of noise that the model explains, 0 to 1; null: there is none."""
    direct_form_rms_dps: float | None
    """RMS residual of the same model as a function of the output, deg/s; null: it is that form, or has none."""


class CriticisedNoise(TypedDict):
    """Noise of the recording; `vs_datasheet`: the drift divided by what the data sheet lets expect."""

    white_dps: float | None
    drift_dps: float | None
    drift_tau_s: float | None
    vs_datasheet: float | None
    static: StaticRecordJson | None


class LackOfFit(TypedDict):
    """Chi2 of the whitened residual over its degrees of freedom, and its p-value."""

    statistic: float | None
    p_value: float | None


#: A range of a channel in which the mean residual is far from 0.
FailingRange = TypedDict(
    "FailingRange", {"axis": str, "channel": str, "from": float, "to": float, "rms_dps": float, "z": float}
)


class Suspect(TypedDict):
    """An effect that may be missing: the evidence, its size, and the error with it."""

    effect: str
    probability: float
    p_value: float
    log_bayes_factor: float
    share_removed: float
    coefficients: dict[str, dict[str, Coefficient]]
    coefficients_from: Literal["fit", "comparison"]
    parameters: dict[str, float]
    physical: bool
    plausible: list[float] | None
    rms_after_dps: float | None
    heldout_rms_after_dps: float | None
    alias_group: list[str]
    origin: Origin
    explanation: str
    experiment: str


class Advice(TypedDict):
    """Whether to add a named effect, and why not; the errors, deg/s, are those of what would be exported.

    They are of parts of the data left out of the fits, without the effect and with it; null: no part can be left out.
    """

    effect: str
    add: bool
    why: str
    before_dps: float | None
    after_dps: float | None


class SlowProcess(TypedDict):
    """A slow process in the residual of a record at rest: its size by axis, time constant, and how much is common.

    `common` is the share of the axes' variance, each over its own size, that one common course explains.
    """

    rms_dps: dict[str, float]
    tau_s: float
    common: float | None


class OutputStep(TypedDict):
    """Step in which an output comes, and what it leaves in a mean, as a standard deviation, deg/s."""

    step_dps: float
    left_dps: float


class NotTestable(TypedDict):
    """An effect that the recording cannot show, because a channel is missing or the schedule hides it."""

    effect: str
    why: Literal["channel", "schedule"]
    needs: list[str]
    visible: NotRequired[float]


class Experiment(TypedDict):
    """A changed recipe that would separate effects which the recording cannot."""

    separates: list[str]
    do: str
    recipe: dict[str, JsonValue]
    toml: str
    power: float
    hours: float
    per_hour: float


class Remainder(TypedDict):
    """What remains beside all that was named: its share of the excess chi2, and what it follows."""

    share: float
    over_floor: float
    depends_on: list[str]


class WorstDataSet(TypedDict):
    """A data set far from the model."""

    axis: str
    dataset: int
    residual_dps: float
    over_floor: float


class ResidualMap(TypedDict):
    """Residual over floor in rate x temperature, one axis in one position: lists of equal length."""

    axis: str
    position: str
    dataset: list[int]
    table_rate_dps: list[float]
    temperature_c: list[float]
    rate_level_dps: list[float]
    temperature_level_c: list[float]
    level_width_c: float
    residual_dps: list[float]
    over_floor: list[float]
