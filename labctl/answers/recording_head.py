"""Parts of the head of a recording that requests and answers state too: axes, motion, outputs, readings left out."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

from labctl.answers.output_units import OutputUnitName, default_scale, require_usable

Axis = Literal["x", "y", "z"]
#: What moves the unit, and so what its true rate is known from: `rates` a table, at one rate in each data set; `rest`
#: nothing; `turns` a hand or a table, by a known angle in each data set; `profile` a table whose rate changes and is
#: known reading by reading; `poses` a hand, between rests that gravity distinguishes.
Motion = Literal["rates", "rest", "turns", "profile", "poses"]
#: What a recording holds: every reading, a mean of each data set, or a table of coefficients that was published.
RecordingKind = Literal["samples", "points", "coefficients"]


class OutputUnit(BaseModel):
    """How a gyro column becomes a rate: rate_dps = (column - offset) / scale.

    For deg/s, rad/s and deg/h both have defaults; for V, mV, count and arb the nominal scale must be given.
    """

    model_config = ConfigDict(defer_build=True, extra="forbid", frozen=True)

    unit: OutputUnitName = Field(default="deg/s", description="Unit of the gyro column.")
    offset: float = Field(default=0.0, description="Value of the column at rate 0, in `unit`.")
    scale: float = Field(
        default=1.0,
        description="Change of the column per deg/s, in `unit`, not 0; default for deg/s, rad/s and deg/h: that of "
        "the unit.",
    )

    @model_validator(mode="before")
    @classmethod
    def _default_scale(cls, document: Any) -> Any:
        if isinstance(document, dict) and "scale" not in document:
            return {**document, "scale": default_scale(document.get("unit", "deg/s"))}
        return document

    @model_validator(mode="after")
    def _usable(self) -> OutputUnit:
        require_usable(self.offset, self.scale)
        return self


class LeftOut(BaseModel):
    """Readings that were left out by choice when a recording was imported: they are marked with valid = 0."""

    model_config = ConfigDict(defer_build=True, extra="forbid", frozen=True)

    what: str = Field(description="Kind of the finding, as a fixed word for programs, such as spikes.")
    channel: str = Field(default="", description="Column whose readings were left out; empty: the whole rows.")
    n: int = Field(ge=0, description="Number of readings that were left out.")
    of: int = Field(ge=0, description="Number of readings of the recording.")
    why: str = Field(description="What was found, in words.")
