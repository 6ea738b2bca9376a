"""The tables of a recipe: how to soak, acquire, mount, guard and resume, each with its defaults and limits."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import Annotated, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, Strict, field_validator, model_validator

from instruments import positions

Number = Annotated[float, Strict()]  #: a number written as a number: "20" in quotes is refused
Whole = Annotated[int, Strict()]
Yes = Annotated[bool, Strict()]
Turned = Annotated[int, Strict(), Field(ge=1, le=359)]  #: deg, counter-clockwise seen from above


def _position(text: str) -> str:
    """Return the text of a position whose turns about the table axis are those of [indexing]."""
    position = positions.Position.of(text)
    if position.turned_deg:
        raise ValueError("a recipe states turns about the table axis in its table [indexing]; write the position alone")
    if position.radius_mm is not None:
        raise ValueError(
            "the bench file states the distance from the table's axis, and a recipe another one in its table "
            "[another_radius]; write the position alone"
        )
    return str(position)


Position = Annotated[str, Strict(), AfterValidator(_position)]  #: what points up: an end of a body axis, or x+y+z
Action = Literal["warn", "take_back", "suspend", "fail"]
GuardKind = Literal[
    "chamber_limits",  # air against the chamber's limits
    "unit_air",  # air against a unit's limits
    "unit_temperature",  # a unit's own thermometer against its limits
    "chamber_deviation",  # air off its set point while readings are taken
    "chamber_alarm",  # the controller itself says so
    "foreign_change",  # others have changed the set point or the mode of the chamber
    "stale",  # a chamber or a unit has said nothing for too long
    "damaged_readings",
    "invalid_readings",
    "rate",  # really run against asked
    "unit_off_air",  # a unit's own thermometer against the air, while readings are taken
    "soak",  # a temperature that a unit does not take in time
]


class Table(BaseModel):
    """A table of a recipe; an unknown key is an error with a name."""

    model_config = ConfigDict(defer_build=True, extra="forbid", frozen=True, allow_inf_nan=False)


class SoakRules(Table):
    """When a unit counts as having taken a temperature."""

    hold_s: Number = Field(default=3600.0, ge=0, le=7 * 86_400)  #: time inside the band before anything is measured
    band_c: Number = Field(default=0.5, gt=0)  #: chamber air within +- this of the set point
    max_drift_c: Number = Field(default=0.2, gt=0)  #: of each unit's own thermometer over the window below
    drift_window_s: Number = Field(default=600.0, gt=0)
    timeout_s: Number = Field(default=10_800.0, gt=0)  #: a soak that takes longer is a failure
    move_timeout_s: Number = Field(default=10_800.0, gt=0)  #: and so is a chamber that does not arrive


class AcquireRules(Table):
    """How one data set is taken."""

    duration_s: Number = Field(default=60.0, ge=1)
    settle_s: Number = Field(default=5.0, ge=0)  #: at the steady rate, before the first reading that counts
    #: From this rate up a data set lasts whole turns, so that what depends on the table's angle averages out.
    whole_turns_above_dps: Number | None = Field(default=None, gt=0)
    max_duration_s: Number = Field(default=180.0, gt=0)  #: unless the whole turns would take longer than this


class Replicates(Table):
    """What is measured more than once, so that the scatter between data sets can be seen."""

    zero_rate: tuple[Literal["start", "middle", "end"], ...] = ()  #: where in a level the table also stands still
    repeated_rates: Whole = Field(default=0, ge=0)  #: rates of each level, drawn at random, that are run a second time
    first_temperature_again: Yes = False  #: each mounting ends with the temperature it began with


class Inverted(Table):
    """Each position once more upside down, in the same powered session."""

    temperatures_c: tuple[Number, ...] = Field(min_length=1)
    rates_dps: tuple[Number, ...] = Field(min_length=1)


class AnotherRadius(Table):
    """Each position once more at another distance from the table's axis, in the same powered session.

    The centripetal acceleration is in proportion to that distance, an error of the scale factor does not depend on it.
    """

    radius_m: Number | None = Field(default=None, ge=0)  #: absent: the one of the bench that differs most
    temperatures_c: tuple[Number, ...] = Field(min_length=1)
    rates_dps: tuple[Number, ...] = Field(min_length=1)


class Indexing(Table):
    """Each position once more turned about the table axis, in the same powered session, the same end of the axis up.

    What is below the turned part does not turn with it: where the unit is turned on its fixture, the error of the
    fixture's face and of the table top change their direction in the frame of the unit; where the fixture is turned on
    the table, only that of the table top does.
    """

    unit_deg: tuple[Turned, ...] = ()  #: the unit on its fixture, against the first mounting
    fixture_deg: tuple[Turned, ...] = ()  #: the fixture on the table, with the unit
    temperatures_c: tuple[Number, ...] = Field(min_length=1)
    rates_dps: tuple[Number, ...] = Field(min_length=1)
    #: Time inside the band before anything is measured; absent: that of [soak]. What is looked for differs between the
    #: two directions of turning, so that a bias which still moves with the temperature does not matter.
    hold_s: Number | None = Field(default=None, ge=0, le=7 * 86_400)

    @model_validator(mode="after")
    def _turns_something(self) -> Indexing:
        angles = (*self.unit_deg, *self.fixture_deg)
        if not angles:
            raise ValueError("nothing is turned; give unit_deg or fixture_deg, such as unit_deg = [180]")
        if len(set(self.unit_deg)) + len(set(self.fixture_deg)) < len(angles):
            raise ValueError("an angle is given twice; give each angle once")
        return self


class Ramp(Table):
    """Each position once more while the temperature moves, after its levels, in the same powered session.

    The chamber is soaked at `from_c` and then goes to `to_c`; data sets are taken one after the other on the way, their
    rates in the listed order again and again. Slower than the chamber can, it goes in small steps, one before each data
    set. A whole cycle goes on from there to each temperature of `then_c`.
    """

    from_c: Number
    to_c: Number
    then_c: tuple[Number, ...] = Field(default=(), max_length=20)  #: further ends, one after the other
    dwell_s: Number = Field(default=0.0, ge=0, le=86_400)  #: data sets go on for so long between two legs
    #: The same in the first mounting, which may come nearer to the ends of the range; absent: `dwell_s`.
    first_dwell_s: Number | None = Field(default=None, ge=0, le=86_400)
    rates_dps: tuple[Number, ...] = Field(min_length=1)
    c_per_min: Number | None = Field(default=None, gt=0)  #: absent: as fast as the chamber can
    back: Yes = False  #: and back to `from_c` in the same way
    positions: tuple[Position, ...] = ()  #: mountings in which the temperature moves; absent: all of the recipe

    def moves_in(self, position: str) -> bool:
        """Return whether the temperature moves in a mounting of the recipe."""
        return not self.positions or position in self.positions

    @property
    def ends_c(self) -> tuple[float, ...]:
        """Where each leg ends, in order."""
        return (self.to_c, *self.then_c, *((self.from_c,) if self.back else ()))

    @property
    def way_c(self) -> float:
        """How far the temperature moves on all legs together, K."""
        return sum(abs(end - begin) for begin, end in pairwise((self.from_c, *self.ends_c)))

    @model_validator(mode="after")
    def _goes_somewhere(self) -> Ramp:
        if self.from_c == self.to_c:
            raise ValueError("from_c and to_c are the same, so that nothing moves; give two temperatures")
        if any(begin == end for begin, end in pairwise((self.from_c, *self.ends_c))):
            raise ValueError(
                "then_c: a leg begins and ends at the same temperature, so that nothing moves; leave one of them out"
            )
        return self


class PowerCycle(Table):
    """The unit switched off and on again at the temperature of the last level, and measured again."""

    count: Whole = Field(default=1, ge=1)
    off_s: Number = Field(default=600.0, ge=0)
    rates_dps: tuple[Number, ...] = Field(min_length=1)


class SupplySteps(Table):
    """Rates at several voltages of the units' supply, after the levels of the last mounting and at their last
    temperature. The voltages are gone through as often as the rates of a level, in turn forwards and backwards.
    """

    deviations_pct: tuple[Number, ...] = Field(min_length=1, max_length=50)  #: from the nominal voltage of the bench
    rates_dps: tuple[Number, ...] = Field(min_length=1)
    settle_s: Number = Field(default=30.0, ge=0, le=3600)  #: after the voltage has arrived: the unit's heat changes

    @field_validator("deviations_pct")
    @classmethod
    def _more_than_nothing(cls, deviations_pct: tuple[float, ...]) -> tuple[float, ...]:
        """Refuse a voltage of 0 or less."""
        if min(deviations_pct) <= -100:
            raise ValueError(f"{min(deviations_pct):g} % leaves no voltage; give deviations of a few per cent")
        return deviations_pct


class Verification(Table):
    """Points that are measured after all others, and never fitted: what a calibration promises is judged there.

    Each position is mounted anew, in a new powered session. Temperatures and rates are drawn from the seed, one in
    each of as many equal parts of the recipe's ranges: the temperatures of all mountings together, the rates of each
    temperature.
    """

    temperatures: Whole = Field(default=1, ge=1, le=50)  #: in each mounting
    rates: Whole = Field(default=5, ge=3, le=200)  #: at each temperature: one at least near either end
    positions: tuple[Position, ...] = ()  #: absent: those of the recipe
    seed: Whole = Field(default=1, ge=0)


class Mounting(Table):
    """How a unit is turned."""

    #: The chamber goes here before a person opens it; absent: the unit is turned at the temperature of the level.
    handling_c: Number | None = 25.0
    repower_each: Yes = False  #: the units are switched off whenever one is turned: a new powered session


#: Actions after which a step is begun again once the limits hold.
WAITED_FOR: frozenset[Action] = frozenset({"suspend", "take_back"})
TAKEN_BACK: GuardKind = "foreign_change"
#: A person who changes something at the chamber has a reason: the campaign waits until it is as it was.
DEFAULT_ACTIONS: Mapping[GuardKind, Action] = {"foreign_change": "suspend"}


class GuardRules(Table):
    """Limits that are watched while anything runs."""

    chamber_margin_c: Number = Field(default=2.0, ge=0)  #: air beyond the limits of chamber or unit by more
    chamber_deviation_c: Number = Field(default=2.0, gt=0)  #: air off its set point while readings are taken
    gyro_margin_c: Number = Field(default=15.0, ge=0)  #: a unit's own thermometer beyond the unit's limits by more
    stale_s: Number = Field(default=30.0, gt=0)  #: no fresh reading of a chamber or a unit for longer
    max_damaged_fraction: Number = Field(default=0.02, gt=0, le=1)  #: of a data set's readings lost or damaged
    max_invalid_fraction: Number = Field(default=0.5, gt=0, le=1)  #: of them marked bad by the instrument itself
    max_rate_error_fraction: Number = Field(default=0.01, gt=0)  #: the rate really run against the one asked for
    #: What a trip does; a guard that is not named fails the campaign, but for those of `DEFAULT_ACTIONS`.
    actions: dict[GuardKind, Action] = {"invalid_readings": "warn"}
    max_gyro_off_air_c: Number = Field(default=20.0, gt=0)  #: of a unit that has been soaked; more is no self-heating
    release_s: Number = Field(default=60.0, ge=0)  #: a suspended campaign goes on after the limits held for this long
    suspend_timeout_s: Number = Field(default=7200.0, gt=0)  #: and fails when they did not within this
    max_suspensions: Whole = Field(default=10, ge=0)  #: of one step; once more fails
    #: What a campaign of a service does when the supervisor is gone, which would end a bench process that hangs: go on
    #: to its end, or go to the safe state, to be resumed by the next service.
    unsupervised: Literal["continue", "stop"] = "continue"

    def action_of(self, kind: GuardKind) -> Action:
        """Return what a trip of a guard does."""
        return self.actions.get(kind) or DEFAULT_ACTIONS.get(kind, "fail")

    @model_validator(mode="after")
    def _taken_back_where_it_can_be(self) -> GuardRules:
        if wrong := [kind for kind, action in self.actions.items() if action == "take_back" and kind != TAKEN_BACK]:
            raise ValueError(
                f'actions: {wrong[0]} = "take_back": only {TAKEN_BACK} can be taken back; give warn, suspend or fail'
            )
        return self


class OnFailure(Table):
    """What is tried before a campaign gives up."""

    acquire_attempts: Whole = Field(default=2, ge=1)  #: a data set whose readings failed is taken again
    link_attempts: Whole = Field(default=3, ge=1)  #: a step whose instrument fell silent is begun so often
    operator_timeout_s: Number | None = Field(default=None, gt=0)  #: absent: a question waits without limit
    operator_remind_s: Number | None = Field(default=None, gt=0)  #: an open question is put again this often
    #: What an unanswered mounting leads to: the end, or its data sets left out and the next mounting asked for.
    operator_timeout: Literal["fail", "skip"] = "fail"


class ResumeRules(Table):
    """What is done before an interrupted campaign goes on."""

    #: Unwatched for longer, a temperature is soaked again. Absent: for as long as the air takes to leave its band and
    #: come back unseen, twice the band over the chamber's ramp.
    soak_again_after_s: Number | None = Field(default=None, ge=0)
    instruments_within_s: Number = Field(default=120.0, ge=0)  #: they may still be starting up after a power cut
