"""Description of a rate table: how it turns, how it is stopped, and how it is confirmed that it stands."""

from __future__ import annotations

from functools import cached_property
from typing import Any, Literal

from pydantic import Field, model_validator

from instruments.protocols.request_reply.parts import AskNumber, AskState, AskText, Commands, Description
from instruments.protocols.request_reply.templates import places
from instruments.protocols.request_reply.units import ACCELERATIONS, ANGLES, RATES, Unit, turning_unit

#: Without these no table is turned: key -> why.
SAFETY = {
    "stop": "how it is stopped: add stop = [...], the commands that bring it to rest from any motion",
    "standing": "how its standing is confirmed: add [standing] with a request, and yes and no (or below)",
    "position": "how its angle is read: add [position] with a request",
}
#: Values of a motion: signed rate, its magnitude, its sign, the whole angle of a finite move, the acceleration.
MOTION = ("rate", "speed", "angle", "acceleration")
SIGN = "sign"


class TableDescription(Description):
    """A table. A motion either lasts until it is stopped (`run`), or is a finite move by an angle (`move`)."""

    kind: Literal["table"]
    angle_unit: str = "deg"
    rate_unit: str = "deg/s"
    acceleration_unit: str = "deg/s2"
    counts_per_turn: float | None = Field(default=None, gt=0)  #: of an angle in counts
    max_rate_dps: float = Field(gt=0)  #: limits of the instrument; the bench file's may be lower
    max_acceleration_dps2: float = Field(gt=0)
    rate_u_ppm: float = Field(ge=0)  #: standard uncertainty of a rate that was asked for
    angle_u_deg: float = Field(gt=0)  #: standard uncertainty of a position against another one
    time_u_s: float = Field(default=5e-3, gt=0)  #: standard uncertainty of a position's time, without what is common
    encoder: bool = False  #: whether the position is measured, and not counted from what was commanded
    identity: AskText
    start: Commands = ()  #: sent once after the link was opened: units, acceleration, power of the motor ...
    ready: AskState | None = None  #: yes: it can turn; awaited after `start`
    ready_s: float = Field(default=10.0, gt=0, le=600)
    home: Commands = Field(min_length=1)
    home_s: float = Field(default=120.0, gt=0, le=3600)  #: longest time of a homing
    home_within_deg: float = Field(default=0.05, gt=0)  #: the position after homing is this near to 0
    run: Commands = ()
    move: Commands = ()
    positive: str = "+"  #: `{sign}` of a positive rate
    negative: str = "-"
    stop: Commands = Field(min_length=1)
    stop_slow: Commands = ()  #: in place of `stop`, over a new link, while a slow command is not answered yet
    homing: AskState | None = None  #: yes: it homes, by whichever process, and only `stop_slow` ends that
    standing: AskState
    position: AskNumber
    rate: AskNumber | None = None
    settle_s: float = Field(default=0.5, ge=0, le=60)  #: from the end of the computed ramp to a steady rate
    rate_within: float = Field(default=0.02, gt=0, le=0.2)  #: a rate is reached when it is within this share

    @model_validator(mode="before")
    @classmethod
    def _is_safe(cls, document: Any) -> Any:
        if isinstance(document, dict):
            missing = [why for key, why in SAFETY.items() if not document.get(key)]
            if missing:
                raise ValueError(f"a table must say {'; '.join(missing)}; labctl turns no table without")
        return document

    @model_validator(mode="after")
    def _is_whole(self) -> TableDescription:
        _ = self.angle, self.turning, self.accelerating
        if self.homing is not None and not self.stop_slow:
            raise ValueError("homing is asked in order to end a home search; add stop_slow, the commands that end it")
        if bool(self.run) == bool(self.move):
            raise ValueError(
                "give either run (commands after which the table turns until it is stopped) or move (commands of a "
                "finite move by {angle}), not both"
            )
        # the sign is a parameter that the description itself fills in
        signed = self.model_copy(update={"parameters": {**self.parameters, SIGN: self.positive}})
        signed.require_requests({"run": MOTION, "move": MOTION, "start": ["acceleration"], "home": ["acceleration"]})
        names = {name for line in self.motion for name, _ in places(line)}
        if not names & {"rate", "speed"}:
            raise ValueError(f"{self.motion_key}: no line holds the rate; write it like {{rate:.4f}} or {{speed:.4f}}")
        if self.move and "angle" not in names:
            raise ValueError("move: no line holds the angle; write it like {angle:.3f}")
        if self.run and not names & {"rate", SIGN}:
            raise ValueError("run: no line holds the direction; write {rate:.4f}, which has a sign, or {sign}")
        if self.positive == self.negative:
            raise ValueError(f"positive and negative are both {self.positive!r}; give each direction its own text")
        return self

    @property
    def motion(self) -> tuple[str, ...]:
        """The commands of a motion."""
        return self.run or self.move

    @property
    def motion_key(self) -> str:
        """The key of `motion`."""
        return "run" if self.run else "move"

    @cached_property
    def angle(self) -> Unit:
        """The unit of angles."""
        return turning_unit("angle", self.angle_unit, ANGLES, "", self.counts_per_turn)

    @cached_property
    def turning(self) -> Unit:
        """The unit of rates."""
        return turning_unit("rate", self.rate_unit, RATES, "/s", self.counts_per_turn)

    @cached_property
    def accelerating(self) -> Unit:
        """The unit of accelerations."""
        return turning_unit("acceleration", self.acceleration_unit, ACCELERATIONS, "/s2", self.counts_per_turn)
