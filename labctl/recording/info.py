"""What recording.toml says: who was measured, where, when and in which units."""

from __future__ import annotations

from datetime import datetime
from typing import Literal

from pydantic import AwareDatetime, BaseModel, ConfigDict, Field

Axis = Literal["x", "y", "z"]


class OutputUnit(BaseModel):
    """How a gyro column becomes a rate: rate_dps = (column - offset) / scale."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    unit: Literal["deg/s", "rad/s", "deg/h", "V", "mV", "count", "arb"] = "deg/s"
    offset: float = 0.0
    scale: float = 1.0


class RecordingInfo(BaseModel):
    """The head of a recording (recording.toml, format version 1)."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    format: Literal["labctl-recording/1"] = "labctl-recording/1"
    serial: str = Field(min_length=1)
    model: str = ""
    axes: tuple[Axis, ...] = Field(min_length=1, max_length=3)
    kind: Literal["samples", "points", "coefficients"]
    started_at: AwareDatetime | datetime
    power_on_s: float | None = None
    latitude_deg: float | None = Field(default=None, ge=-90, le=90)
    table_axis: Literal["up"] = "up"
    tilt_deg: float | None = None
    tilt_azimuth_deg: float | None = None
    sample_rate_hz: float | None = None
    max_rate_dps: float | None = None
    active_calibration: str = ""
    notes: str = ""
    technology: Literal["fog", "mems", "piezo"] | None = None
    datasheet: dict[str, float] = Field(default_factory=dict)
    output: dict[Axis, OutputUnit] = Field(default_factory=dict)
