"""A criticism: the verdict, its evidence, and its pictures."""

from __future__ import annotations

from typing import Annotated, Literal, NotRequired

from pydantic import Field, JsonValue
from typing_extensions import Doc, TypedDict

from labctl.answers.base import ResponseModel
from labctl.answers.common_fields import (
    CriticismVerdict,
    RecordingNumber,
    Serial,
    VersionNumber,
)
from labctl.answers.effect_origin import Origin
from labctl.answers.fitted_model import Coefficient, CorrelationTimes, ThermalFamilyJson, ThermalHintJson
from labctl.answers.inspection import WARNINGS, DataWarning
from labctl.answers.joint import JointJson
from labctl.answers.laws import LawTest, ProposedLaw
from labctl.answers.noise import StaticRecordJson
from labctl.answers.verification import VerificationResponse
from labctl.answers.views import Views


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
    """Share of the raw chi2 that the model and the noise explain, 0 to 1; null: there was too little for a verdict."""
    direct_form_rms_dps: float | None
    """RMS residual of the model as it is applied to the output, deg/s; null: it is a function of the true rate."""


class CriticisedNoise(CorrelationTimes):
    """Noise of the data set means of the recording, and of its record at rest."""

    white_dps: float | None
    """Standard deviation of a data set mean by white noise, RMS over the axes, deg/s; null: unknown."""
    drift_dps: float | None
    """Standard deviation of the drift between data sets, of the axis where it is largest, deg/s; null: unknown."""
    vs_datasheet: float | None
    """Largest drift divided by half the bias stability of the data sheet, at least 0; null: unknown, or the drift is
    taken from the data sheet."""
    static: StaticRecordJson | None
    """Allan deviation of the longest stretch at rest; null: there is none with enough readings."""


class LackOfFit(TypedDict):
    """Chi-square test of the whitened residual, over all axes."""

    statistic: float | None
    """Chi2 divided by its degrees of freedom, at least 0; null: there was too little for a verdict."""
    p_value: float | None
    """Probability of a larger chi2 from noise alone, 0 to 1; null: there was too little for a verdict."""


#: A range of a channel in which the mean residual is far from 0.
FailingRange = TypedDict(
    "FailingRange",
    {
        "axis": Annotated[str, Doc("Output axis, x, y or z.")],
        "channel": Annotated[
            str, Doc("Channel by which the data sets are divided; table_rate_dps is the true rate along the axis.")
        ],
        "from": Annotated[float, Doc("Lowest value of the channel among the data sets, in the unit of the channel.")],
        "to": Annotated[float, Doc("Highest value of the channel among the data sets, in the unit of the channel.")],
        "rms_dps": Annotated[float, Doc("RMS residual of the data sets in the range, deg/s.")],
        "z": Annotated[
            float,
            Doc("Size of the mean of residual over noise floor, times the root of the number of data sets; >= 3."),
        ],
    },
)


class Suspect(TypedDict):
    """An effect that may be missing: the evidence, its size, and the error with it."""

    effect: str
    """Id of the effect."""
    probability: float
    """Probability that it is the one missing, 0 to 1; 0 where the technology of the unit cannot have its size."""
    p_value: float
    """Probability of such a gain in chi2 by chance, corrected for the number of shapes tried, 0 to 1."""
    log_bayes_factor: float
    """Natural logarithm of the Bayes factor of the model with the effect against the model."""
    share_removed: float
    """Share of the chi2 in excess of the noise that the effect removes, 0 to 1."""
    coefficients: dict[str, dict[str, Coefficient]]
    """Output axis -> name -> coefficient of the effect."""
    coefficients_from: Literal["fit", "comparison"]
    """fit: those of a fit of the model with the effect; comparison: estimated beside the model, without that fit."""
    parameters: dict[str, float]
    """Name -> nonlinear parameter that goes with the coefficients; the effect in the catalogue states its unit."""
    physical: bool
    """Whether the technology of the unit can have an effect of this size."""
    plausible: list[float] | None
    """Least and largest plausible first coefficient for the technology of the unit, in its unit; null: unknown."""
    usual_size: bool | None
    """Whether its first coefficients are inside `plausible`, to two standard uncertainties; null: unknown."""
    rms_after_dps: float | None
    """RMS residual of a fit of the model with the effect, deg/s; null: not fitted, or cannot be."""
    heldout_rms_after_dps: float | None
    """RMS error of that fit on data sets left out in turn, deg/s; null: not fitted, or none can be left out."""
    fit_refused: str | None
    """Why the model with the effect cannot be fitted, and so not be made; null: it is fitted, or was not tried."""
    alias_group: list[str]
    """Ids of the effects that the recording cannot distinguish from it, itself first."""
    origin: Origin
    """What the effect belongs to."""
    explanation: str
    """What the effect is, in one sentence."""
    experiment: str
    """What would distinguish it from similar effects."""


class Advice(TypedDict):
    """Whether to add a named effect, by the errors of what would be exported on parts of the data left out."""

    effect: str
    """Id of the effect."""
    add: bool
    """Whether the exported calibration becomes better with the effect."""
    checked: bool
    """Whether that is known; false: no part of the data can be left out."""
    why: str
    """Why not to add it, or why that is not known; empty where `add` is true."""
    before_dps: float | None
    """RMS error on the parts left out without the effect, deg/s; null: no part can be left out."""
    after_dps: float | None
    """RMS error on the parts left out with the effect, deg/s; null: no part can be left out."""


class SlowProcess(TypedDict):
    """A slow process in the residual of a record at rest."""

    rms_dps: dict[str, float]
    """Output axis -> RMS of the residual about its mean, deg/s; only the axes with a slow process."""
    tau_s: float
    """Time in which the autocorrelation falls to 1/e, median of the axes, s."""
    common: float | None
    """Share of the axes' variance, each normalised, that one common course explains, 0 to 1; null: one axis only."""


class OutputStep(TypedDict):
    """Quantization step of an output, and what it leaves in a mean."""

    step_dps: float
    """Step of the output, deg/s."""
    left_dps: float
    """Standard deviation of a data set mean by the steps, RMS over the data sets, deg/s."""


class NotTestable(TypedDict):
    """An effect that the recording cannot show."""

    effect: str
    """Id of the effect."""
    why: Literal["channel", "schedule"]
    """channel: a channel that it needs was not logged; schedule: the model absorbs it in this schedule."""
    needs: list[str]
    """Channels that it needs and that were not logged; empty where `why` is schedule."""
    visible: NotRequired[float]
    """Share of the effect that the model does not absorb, 0 to 1; only where `why` is schedule."""


class Experiment(TypedDict):
    """A changed recipe that is expected to say which effect is missing, where the recordings cannot."""

    separates: list[str]
    """Ids of the effects that it separates: the likeliest one, then those that it is distinguished from if it is it."""
    do: str
    """The change of the recipe in words."""
    why: str
    """Why it was chosen, in one sentence."""
    block: str
    """Id of the building block that it is made of."""
    needs: list[str]
    """What the bench needs for it besides table and chamber, in words."""
    recipe: dict[str, JsonValue]
    """The changed recipe."""
    toml: str
    """The changed recipe as a TOML file."""
    power: float
    """Probability that the verdict on all recordings then names one cause alone (exact aliases are one), 0 to 1."""
    names_wrong: float
    """Probability that it then names one cause alone that is not the true one, 0 to 1."""
    information_bit: float
    """Expected information in the identity of the cause, bit; at most `open_bit`, up to the error of the forecast."""
    open_bit: float
    """Entropy of the probabilities of the effects in question now, bit: what remains to be learned."""
    hours: float
    """Expected duration, h; soaks, ramps of the chamber and mountings by a person are in it."""
    person_h: float
    """Time of a person at the bench, h; 0 where the bench turns and switches the units."""
    mountings: int
    """How often a unit is mounted anew, after the first mounting."""
    per_hour: float
    """Expected information per hour, bit/h; set-up and a person's time are added to the hours. Experiments are ordered
    by the probability per hour that the cause is named alone and rightly, where that is at least 5 %, then by this."""


class Undistinguished(TypedDict):
    """An effect of the model that the data could not tell from others."""

    effect: str
    """Id of an effect that the version has, and one of the five versions before it has not."""
    others: list[str]
    """Ids of the effects that would explain the data as well in its place."""
    version: int
    """Number of the version before it of which the data showed that, and whose next experiments distinguish them."""


class Remainder(TypedDict):
    """What remains beside all effects that were named."""

    share: float
    """Share of the chi2 in excess of the noise that remains, 0 to 1."""
    over_floor: float
    """Root of the chi2 that remains over its degrees of freedom, at least 1."""
    depends_on: list[str]
    """Channels that the remainder depends on, strongest first."""


class WorstDataSet(TypedDict):
    """A data set far from the model."""

    axis: str
    """Output axis, x, y or z."""
    dataset: int
    """Number of the data set in the recording."""
    residual_dps: float
    """Mean residual of the data set, measured minus modelled error, deg/s."""
    over_floor: float
    """Residual divided by its noise floor, with the sign of the residual."""


class ResidualMap(TypedDict):
    """Residual over rate and temperature, of one output axis in one position: lists with one entry per data set."""

    axis: str
    """Output axis, x, y or z."""
    position: str
    """Position of the unit: the body axis that points up, such as x, -x or x@180."""
    dataset: list[int]
    """Numbers of the data sets."""
    table_rate_dps: list[float]
    """Rate of the table, deg/s."""
    temperature_c: list[float]
    """Temperature by the thermometer of the axis, deg C."""
    rate_level_dps: list[float]
    """Centre of the rate level that the data set belongs to, deg/s; the same levels in all maps of an axis."""
    temperature_level_c: list[float]
    """Centre of the temperature level that the data set belongs to, deg C; the same in all maps of an axis."""
    level_width_c: float
    """Largest difference of the temperatures in one level, deg C."""
    residual_dps: list[float]
    """Mean residual, measured minus modelled error, deg/s."""
    over_floor: list[float]
    """Residual divided by its noise floor, with the sign of the residual."""


class CriticismResponse(ResponseModel):
    """A model compared with a recording: the verdict in one of five forms, and its evidence."""

    serial: Serial
    version: VersionNumber
    recording: RecordingNumber
    recordings: list[int] = Field(
        default_factory=list, description="All recordings that the model is compared with; `recording` is the newest."
    )
    joint: JointJson | None = Field(
        default=None,
        description="Only for several recordings: repeatability, agreement between the recordings, and the error "
        "when each recording is predicted by a fit to the others.",
    )
    verdict: CriticismVerdict = Field(
        description="adequate: the residual is explained by noise; missing: the named effects are missing in the "
        "model; ambiguous: one of the named effects is missing, and the data do not distinguish them; unexplained: "
        "no effect of the catalogue explains the residual; insufficient_data: too little was measured for a "
        "verdict."
    )
    text: list[str] = Field(description="The verdict in sentences, the conclusion first.")
    error: CriticisedErrors = Field(
        description="Errors of the model as refitted for this comparison, and the noise floor, deg/s."
    )
    noise: CriticisedNoise = Field(description="The noise by which the residual is judged.")
    lack_of_fit: LackOfFit = Field(description="Test of whether the residual is larger than the noise explains.")
    where: list[FailingRange] = Field(description="Ranges of channels in which the residual is far from 0.")
    suspects: list[Suspect] = Field(
        description="Effects that may be missing in the model, each with its evidence and size."
    )
    named: list[str] = Field(description="The effects that the verdict is based on.")
    depends_on: list[str] = Field(description="Channels that the residual depends on, strongest first.")
    confounded_with: list[str] = Field(
        default_factory=list,
        description="Channels that changed together with the first of `depends_on`, so that "
        "this schedule cannot distinguish them.",
    )
    remainder: Remainder | None = Field(
        default=None, description="Share (0 to 1) of the residual above the noise floor that no named effect explains."
    )
    thermal_response: ThermalFamilyJson | None = Field(
        default=None, description="At rest, over several legs: the thermal response that predicts the legs left out."
    )
    thermal_hint: ThermalHintJson | None = Field(
        default=None, description="One that predicts them better than the model, but too little to be named, and why."
    )
    not_physical: list[str] = Field(
        default_factory=list,
        description="Effects that explain these data equally well, but at a size that the unit cannot have.",
    )
    named_axes: dict[str, list[str]] = Field(
        default_factory=dict, description="For each effect: the axes on which the effect was found."
    )
    further: list[list[str]] = Field(
        default_factory=list,
        description="Effects that could be tried although the model is adequate; equivalent effects are in one group.",
    )
    why_not_named: str = Field(
        default="",
        description="Why the effects of `further` are not named, with the odds for each, and by how much the error "
        "falls at best; also in `text`. Empty: there are none.",
    )
    undistinguished: list[Undistinguished] = Field(
        default_factory=list,
        description="Effects of an adequate model that these data could not tell from others when they were added: the "
        "error is corrected, the cause is not known.",
    )
    cause_not_known: list[str] = Field(
        default_factory=list,
        description="The same in sentences, and one for each formula that the model contains, which is a description "
        "and no cause; also in `text`, behind the verdict.",
    )
    laws: list[ProposedLaw] = Field(
        default_factory=list,
        description="Only for unexplained: at most five formulas that describe the residual and predict what is left "
        "out of the fit better than the model, the likeliest first. A law is a description, and no cause.",
    )
    law_test: LawTest | None = Field(
        default=None, description="Where the two likeliest laws differ most, or one and the model; null: there is none."
    )
    hypothesis: Literal["temperature_not_logged"] | None = Field(
        default=None,
        description="temperature_not_logged: the residual of a record at rest wanders slowly, in a way that the logged "
        "thermometer does not explain.",
    )
    slow_process: SlowProcess | None = Field(
        default=None, description="Slow process in the residual of a record at rest; null: none, or not at rest."
    )
    output_steps: dict[str, OutputStep] = Field(
        default_factory=dict,
        description="Axis -> step of an output whose steps the noise does not average out, read from its lattice.",
    )
    advice: list[Advice] = Field(
        default_factory=list,
        description="For each effect that the verdict is based on: whether to add it, by what would be exported.",
    )
    next_effect: str | None = Field(
        default=None,
        description="Of the effects that the verdict is based on, the one to add next: one whose addition is advised, "
        "else one that was fitted to these data; null: the verdict names none.",
    )
    not_testable: list[NotTestable] = Field(description="Effects that this recording cannot show, and why.")
    experiments: list[Experiment] = Field(
        description="Measurements that would distinguish the effects in question, or show effects that cannot be "
        "seen here."
    )
    worst: list[WorstDataSet] = Field(default_factory=list, description="Data sets furthest from the model.")
    maps: list[ResidualMap] = Field(
        default_factory=list, description="Maps of the residual divided by the noise floor, over rate and temperature."
    )
    readings_left_out: int = Field(
        default=0, description="Number of readings left out because they are far from the others of their data set."
    )
    warnings: list[DataWarning] = Field(default_factory=list, description=WARNINGS)
    applied: VerificationResponse | None = Field(
        default=None,
        description="Result of the version applied to this recording without refitting; all other figures are from a "
        "refit to this recording.",
    )
    views: Views = Field(
        default_factory=Views, description="The data of each picture of where and how the model fails."
    )


class StageResponse(ResponseModel):
    """The stage of a followed criticism that begins now."""

    stage: str = Field(description="The stage in words, such as `inspecting the recording`.")
