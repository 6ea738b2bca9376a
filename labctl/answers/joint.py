"""What a fit to several recordings says beside its coefficients."""

from __future__ import annotations

from typing import Literal

from typing_extensions import TypedDict


class ShiftJson(TypedDict):
    """Difference of one run, day or mounting from the common coefficient."""

    recording: int
    """Number of the recording."""
    number: int
    """Number of the run or mounting, counted through all recordings; of a day that of the recording."""
    along: str
    """Of a mounting, the body axis that the unit was turned about; else empty."""
    value: float
    """Difference, in the unit of the repeatability."""
    u: float
    """Standard uncertainty of the difference, in the same unit."""


class RepeatabilityJson(TypedDict):
    """Standard deviation of what differs after each power-on, day or mounting, on one output axis."""

    kind: Literal["turn_on", "day_to_day", "mounting"]
    """turn_on: bias from run to run; day_to_day: scale factor; mounting: misalignment."""
    term: str
    """Standard term of the repeatability."""
    unit: str
    """Unit of the numbers: deg/s of turn_on, 1 of day_to_day, rad of mounting."""
    value: float
    """Standard deviation, median of its posterior distribution, at least 0, in `unit`."""
    u: float
    """Half width of its central 68 % interval, in `unit`."""
    low: float
    """Lower limit of its 95 % interval, at least 0, in `unit`."""
    high: float
    """Upper limit of its 95 % interval, in `unit`."""
    freedom: int
    """Number of independent shifts behind the estimate, less those that the fit uses; 0: none is left."""
    p_value: float
    """Probability of shifts as large as these from noise alone, 0 to 1."""
    seen: bool
    """Whether the shifts are more than noise: `p_value` below 0.01."""
    shifts: list[ShiftJson]
    """Each shift."""


class EffectAgreement(TypedDict):
    """Whether recordings, each fitted alone, agree on an effect."""

    effect: str
    """Id of the effect."""
    chi2: float
    """Chi2 of the coefficients of the recordings about their weighted mean, at least 0."""
    freedom: int
    """Degrees of freedom of `chi2`; 0: not comparable."""
    p_value: float | None
    """Probability of a larger chi2 from noise alone, 0 to 1; null: no degree of freedom."""
    chi2_beside_shifts: float | None
    """The same beside a shift between recordings; null: no shift is estimated for the effect."""
    freedom_beside_shifts: int | None
    """Degrees of freedom of `chi2_beside_shifts`; null: no shift is estimated for the effect."""
    p_value_beside_shifts: float | None
    """Probability of a larger `chi2_beside_shifts` from noise alone, 0 to 1; null: no shift, or no freedom."""
    shift: str | None
    """Standard term under which a difference common to all temperatures is reported; null: none is."""
    agree: bool
    """Whether they agree, at a probability of 1 % over all effects."""


class HeldOutRecording(TypedDict):
    """Error on one recording of a fit to all others, without refitting."""

    recording: int
    """Number of the recording that was left out."""
    rms_dps: float | None
    """RMS error over data sets and axes, deg/s; null: see `why`."""
    why: str
    """Why there is no figure; empty where there is one."""


class JointJson(TypedDict):
    """What several recordings report together."""

    recordings: list[int]
    """Numbers of the recordings, in the order of time."""
    repeatability: dict[str, list[RepeatabilityJson]]
    """Output axis -> repeatability of each kind."""
    agreement: list[EffectAgreement]
    """Agreement of the recordings, effect by effect."""
    not_compared: str
    """Why the recordings could not be compared; empty where they were."""
    held_out: list[HeldOutRecording]
    """Error on each recording of a fit to the others."""
    heldout_rms_dps: float | None
    """RMS error over all recordings that were left out, deg/s; null: none could be."""
    text: list[str]
    """The same in sentences."""
