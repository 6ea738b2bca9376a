"""Description of a chamber: how it is asked for its temperatures and alarms, and how a set point is written."""

from __future__ import annotations

from functools import cached_property
from typing import Literal

from pydantic import Field, model_validator

from instruments.protocols.request_reply.parts import AskAlarms, AskNumber, AskState, AskText, Commands, Description
from instruments.protocols.request_reply.templates import places
from instruments.protocols.request_reply.units import Unit, temperature_unit

SETPOINT = "setpoint"


class ChamberDescription(Description):
    """A chamber. Its set point is read back, so both directions have to be described."""

    kind: Literal["chamber"]
    unit: str = "deg C"  #: of every temperature on the wire
    min_c: float  #: limits of a set point, of the instrument, deg C; the bench file's may be narrower
    max_c: float
    resolution: float = Field(default=0.1, gt=0)  #: step of a set point, in `unit`
    start: Commands = ()  #: sent once after the link was opened, before the first set point: remote operation ...
    end: Commands = ()  #: sent whenever the safe state was sought: operation at the panel again ...
    identity: AskText
    air: AskNumber
    setpoint: AskNumber
    set: Commands = Field(min_length=1)  #: writes `{setpoint:.1f}`
    low: AskNumber | None = None  #: limits that the controller states itself
    high: AskNumber | None = None
    alarms: AskAlarms | None = None
    program: AskState | None = None  #: yes: a program runs or is held, and a set point would have no effect
    end_program: Commands = ()
    running: AskState | None = None  #: yes: heating and cooling are on
    switch_on: Commands = ()
    switch_off: Commands = ()

    @model_validator(mode="after")
    def _is_whole(self) -> ChamberDescription:
        temperature_unit(self.unit)
        if not self.min_c < self.max_c:
            raise ValueError(
                f"min_c = {self.min_c:g} deg C must be below max_c = {self.max_c:g} deg C, the limits of the "
                "instrument; correct one of the two"
            )
        self.require_requests({"set": [SETPOINT]})
        if not any(name == SETPOINT for line in self.set for name, _ in places(line)):
            raise ValueError("set: no line holds the set point; write it like {setpoint:.1f}")
        for key, question in (("end_program", "program"), ("switch_on", "running"), ("switch_off", "running")):
            if getattr(self, key) and getattr(self, question) is None:
                raise ValueError(
                    f"{key} is there, but not how its effect is confirmed; add [{question}] with a request"
                )
        return self

    @cached_property
    def temperature(self) -> Unit:
        """The unit of temperatures."""
        return temperature_unit(self.unit)
