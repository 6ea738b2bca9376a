"""What recording.toml says: who was measured, where, when and in which units."""

from __future__ import annotations

import math
from typing import Any, Literal

from pydantic import AwareDatetime, BaseModel, ConfigDict, Field, model_validator

from instruments.datasheet import Convention, DatasheetFigure, datasheet_figure, undeclared
from instruments.standards import Standard

Axis = Literal["x", "y", "z"]
#: What moves the unit, and so what its true rate is known from: `rates` a table, at one rate in each data set; `rest`
#: nothing; `turns` a hand or a table, by a known angle in each data set; `profile` a table whose rate changes and is
#: known reading by reading; `poses` a hand, between rests that gravity distinguishes.
Motion = Literal["rates", "rest", "turns", "profile", "poses"]

#: What the rate of the table is known from, as a table says it, and in words.
RateReference = Literal["computed", "demanded", "measured"]
REFERENCES: dict[RateReference, str] = {
    "computed": "computed from the step clock",
    "demanded": "the demanded rate, not measured",
    "measured": "measured by the encoder",
}

#: Units that are rates already: what one deg/s is in them.
RATE_UNITS = {"deg/s": 1.0, "rad/s": math.pi / 180.0, "deg/h": 3600.0}


class OutputUnit(BaseModel):
    """How a gyro column becomes a rate: rate_dps = (column - offset) / scale.

    For deg/s, rad/s and deg/h both have defaults; for V, mV, count and arb the nominal scale must be given.
    """

    model_config = ConfigDict(defer_build=True, extra="forbid", frozen=True)

    unit: Literal["deg/s", "rad/s", "deg/h", "V", "mV", "count", "arb"] = "deg/s"
    offset: float = 0.0
    scale: float = 1.0

    @model_validator(mode="before")
    @classmethod
    def _default_scale(cls, given: Any) -> Any:
        if isinstance(given, dict) and "scale" not in given:
            unit = given.get("unit", "deg/s")
            if unit in RATE_UNITS:
                return {**given, "scale": RATE_UNITS[unit]}
            raise ValueError(f"unit {unit!r} needs a scale: the output's change, in that unit, per deg/s")
        return given

    @model_validator(mode="after")
    def _usable(self) -> OutputUnit:
        if self.scale == 0 or not math.isfinite(self.scale) or not math.isfinite(self.offset):
            raise ValueError(
                f"scale = {self.scale} and offset must be finite numbers, and scale must not be 0; correct them"
            )
        return self


class RecordingInfo(BaseModel):
    """The head of a recording (recording.toml, format version 1)."""

    model_config = ConfigDict(defer_build=True, extra="forbid", frozen=True)

    format: Literal["labctl-recording/1"] = "labctl-recording/1"
    serial: str = Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9._+# -]{0,63}$")
    model: str = ""
    axes: tuple[Axis, ...] = Field(min_length=1, max_length=3)
    kind: Literal["samples", "points", "coefficients"]
    motion: Motion = "rates"
    started_at: AwareDatetime
    power_on_s: float | None = None
    latitude_deg: float | None = Field(default=None, ge=-90, le=90)
    table_axis: Literal["up"] = "up"
    #: Of turns: standard uncertainty, as a share of the angle, that all of them have in common, such as a fixture's.
    turn_common_u: float | None = Field(default=None, ge=0, lt=0.5)
    #: What `table_rate_dps` is known from: see `REFERENCES`.
    rate_reference: RateReference | None = None
    tilt_deg: float | None = None
    tilt_azimuth_deg: float | None = None
    sample_rate_hz: float | None = Field(default=None, gt=0, allow_inf_nan=False)
    max_rate_dps: float | None = Field(default=None, gt=0)
    active_calibration: str = ""
    notes: str = ""
    technology: Literal["fog", "mems", "piezo"] | None = None
    datasheet: dict[str, float] = Field(default_factory=dict)
    #: What the figures of `datasheet` are; a figure without an entry is what the maker's own sheet states.
    datasheet_conventions: dict[str, Convention] = Field(default_factory=dict)
    output: dict[Axis, OutputUnit] = Field(default_factory=dict)
    #: Reference standards of the bench, as they were when the readings were taken.
    standards: tuple[Standard, ...] = ()
    thermometer: str = ""  #: the instrument that `temperature_c` is by; empty: the unit's own, or the chamber's

    def datasheet_figure(self, name: str) -> DatasheetFigure | None:
        """Return a figure of the data sheet with its convention; None where there is none."""
        return datasheet_figure(name, self.datasheet, self.datasheet_conventions, self.model)

    @property
    def stability_dps(self) -> float | None:
        """The bias stability by the data sheet as a standard deviation, deg/s; None where it is not known."""
        figure = self.datasheet_figure("bias_stability_dps")
        return None if figure is None else figure.u

    @model_validator(mode="after")
    def _conventions_of_figures(self) -> RecordingInfo:
        if text := undeclared(self.datasheet, self.datasheet_conventions):
            raise ValueError(f"datasheet_conventions: {text}")
        return self

    @model_validator(mode="after")
    def _axes_once(self) -> RecordingInfo:
        if len(set(self.axes)) != len(self.axes):
            raise ValueError(f"an axis is repeated in axes = {list(self.axes)}; name each axis once")
        return self
