"""What recording.toml says: who was measured, where, when and in which units."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import UTC, datetime
from typing import Literal

from pydantic import AwareDatetime, BaseModel, ConfigDict, Field, model_validator

from instruments.datasheet import Convention, DatasheetFigure, datasheet_figure, undeclared
from instruments.standards import Standard
from labctl.answers.recording_head import Axis, LeftOut, Motion, OutputUnit, RecordingKind

#: Serial number of a unit.
SERIAL_PATTERN = r"^[A-Za-z0-9][A-Za-z0-9._+# -]{0,63}$"
SERIAL_RULE = "1 to 64 characters: a letter A to Z or digit, then also . _ + # - and spaces"
#: What the rate of the table is known from, as a table says it, and in words.
RateReference = Literal["computed", "demanded", "measured"]
REFERENCES: dict[RateReference, str] = {
    "computed": "computed from the step clock",
    "demanded": "the demanded rate, not measured",
    "measured": "measured by the encoder",
}

#: `started_at` of a recording without a date that is not in a store yet: the store puts the time of the import there.
NO_DATE = datetime(1970, 1, 1, tzinfo=UTC)
#: What the notes of a recording say that an earlier version of labctl gave the date of its file.
DATE_OF_FILE = "the time at which the file was last written is used as started_at"
#: What to do about a date that is not known.
GIVE_DATE = "import it again with `--option started_at=2026-01-05T08:00:00Z`, or with started_at in the column map"


class RecordingInfo(BaseModel):
    """The head of a recording (recording.toml, format version 1)."""

    model_config = ConfigDict(defer_build=True, extra="forbid", frozen=True)

    format: Literal["labctl-recording/1"] = "labctl-recording/1"
    serial: str = Field(pattern=SERIAL_PATTERN)
    model: str = ""
    axes: tuple[Axis, ...] = Field(min_length=1, max_length=3)
    kind: RecordingKind
    motion: Motion = "rates"
    started_at: AwareDatetime
    #: Whether `started_at` is the date of the measurement; false: that is unknown, and it is the time of the import.
    date_known: bool = True
    #: What of the file that it was read from could not be read, in words, and its share, 0 to 1.
    unread: str = ""
    unread_share: float | None = Field(default=None, ge=0, le=1)
    #: Readings that were left out by choice.
    left_out: tuple[LeftOut, ...] = ()
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
    #: How the unit was set, as it said itself: filter, range, firmware; empty where it says nothing.
    configuration: dict[str, str] = Field(default_factory=dict)
    thermometer: str = ""  #: the instrument that `temperature_c` is by; empty: the unit's own, or the chamber's

    def datasheet_figure(self, name: str) -> DatasheetFigure | None:
        """Return a figure of the data sheet with its convention; None where there is none."""
        return datasheet_figure(name, self.datasheet, self.datasheet_conventions, self.model)

    @property
    def measured_at(self) -> datetime | None:
        """The instant of `t_s` = 0; None where the date of the measurement is not known."""
        return self.started_at if self.date_known and DATE_OF_FILE not in self.notes else None

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


def measured_at(info: Mapping[str, object]) -> datetime | None:
    """Return the instant of `t_s` = 0 of a stored head; None where the date of the measurement is not known."""
    if not info.get("date_known", True) or DATE_OF_FILE in str(info.get("notes") or ""):
        return None
    return datetime.fromisoformat(str(info["started_at"]))


def ordered_at(info: Mapping[str, object]) -> datetime:
    """Return the instant that orders recordings: of the measurement, else of the import; no date to compute by."""
    return datetime.fromisoformat(str(info["started_at"]))
