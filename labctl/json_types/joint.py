"""What a fit to several recordings says beside its coefficients."""

from __future__ import annotations

from typing import Literal

from typing_extensions import TypedDict


class ShiftJson(TypedDict):
    """By how much one run, day or mounting is off the common coefficient."""

    recording: int
    number: int  #: of the run or mounting, counted through all recordings; of a day the recording
    along: str  #: of a mounting: the axis that the unit was turned about; else empty
    value: float
    u: float


class RepeatabilityJson(TypedDict):
    """Standard deviation of what is different after each power-on, day or mounting, on one axis."""

    kind: Literal["turn_on", "day_to_day", "mounting"]
    term: str
    unit: str
    value: float
    u: float
    low: float
    high: float
    freedom: int
    p_value: float
    seen: bool  #: whether the shifts are more than noise
    shifts: list[ShiftJson]


class EffectAgreement(TypedDict):
    """Whether recordings, each fitted alone, agree on an effect: chi2 of the differences; null: no freedom left."""

    effect: str
    chi2: float
    freedom: int
    p_value: float | None
    chi2_beside_shifts: float | None  #: beside what a shift between recordings explains; null: none does
    freedom_beside_shifts: int | None
    p_value_beside_shifts: float | None
    shift: str | None  #: what a difference common to all temperatures is reported as
    agree: bool


class HeldOutRecording(TypedDict):
    """Errors of a fit to all other recordings on this one, without refitting, deg/s."""

    recording: int
    rms_dps: float | None
    why: str  #: why there is no figure; empty where there is one


class JointJson(TypedDict):
    """What several recordings say together."""

    recordings: list[int]
    repeatability: dict[str, list[RepeatabilityJson]]  #: by axis
    agreement: list[EffectAgreement]
    not_compared: str  #: why recordings could not be compared; empty where they were
    held_out: list[HeldOutRecording]
    heldout_rms_dps: float | None  #: over all recordings that were left out
    text: list[str]
