"""A column map: which column of a log is which of a recording, in which unit, and how rows divide into data sets."""

from __future__ import annotations

from typing import Annotated, Literal, get_args

from pydantic import (
    AfterValidator,
    AliasChoices,
    AwareDatetime,
    BaseModel,
    ConfigDict,
    Field,
    JsonValue,
    field_validator,
    model_validator,
)

from labctl.answers.recording_head import Axis, Motion
from labctl.recording.column_map.units import LSB, QUANTITIES, find_unit, is_lsb, names_of, unit_of_target
from labctl.recording.columns import BY_NAME
from labctl.recording.positions import Position

FORMAT: Literal["labctl-map/1"] = "labctl-map/1"
SERIAL = r"^[A-Za-z0-9][A-Za-z0-9._+# -]{0,63}$"
SEPARATORS = {",": ",", ";": ";", "tab": "\t", "space": " ", "|": "|"}
#: Columns that a map may not fill: the format makes them, or they belong to means.
_MADE = frozenset({"dataset", "axis", "scale_factor", "offset"})

#: What [units] is about -> how the names of its columns begin.
QUANTITY_COLUMNS = {
    "gyro": "gyro_", "accel": "accel_", "field": "field_", "temperature": "temperature_", "time": "t_s",
    "table_rate": "table_rate_dps", "table_angle": "table_angle_deg", "turn": "turn_deg", "chamber": "chamber_c",
}  # fmt: skip
Quantity = Literal["gyro", "accel", "field", "temperature", "time", "table_rate", "table_angle", "turn", "chamber"]
Bits = Annotated[int, Field(ge=8, le=64)]


class _Strict(BaseModel):
    model_config = ConfigDict(defer_build=True, extra="forbid", frozen=True, populate_by_name=True)


class FileKeys(_Strict):
    """How a text file is to be divided; what is left out is found from the file."""

    separator: Literal[",", ";", "tab", "space", "|"] | None = None
    decimal: Literal[".", ","] | None = None
    header: int | None = Field(default=None, ge=0, le=10_000)  #: line of the names, from 1; 0: there are none
    data: int | None = Field(default=None, ge=1, le=10_000)  #: line of row 1
    encoding: Literal["utf-8", "utf-16", "cp1252"] | None = None


class MappedColumn(_Strict):
    """Where a column of a recording comes from.

    For `unit = "LSB"` the value is at_zero + sign x (word - offset) / scale: `scale` in words per unit of the
    recording's column (deg/s, deg C, g), `offset` in words, `at_zero` in that unit.
    """

    #: Name in the file, or its number from 1.
    source: str | int = Field(validation_alias=AliasChoices("from", "source"), serialization_alias="from")
    unit: str = ""
    scale: float | None = None
    offset: float = 0.0
    at_zero: float = 0.0
    sign: Literal[1, -1] = 1
    signed_bits: Bits | None = None  #: words without sign stand for signed ones of so many bits
    wrap_bits: Bits | None = None  #: a counter that begins again at 0 after so many bits

    @classmethod
    def of(cls, source: str | int, unit: str = "", scale: float | None = None) -> MappedColumn:
        """Return a column by its name in the file. Raises ValidationError."""
        return cls.model_validate({"from": source, "unit": unit, "scale": scale})

    @model_validator(mode="after")
    def _scale_with_lsb(self) -> MappedColumn:
        if self.scale == 0:
            raise ValueError("scale is 0; write the number of converter counts per unit, such as 131 (LSB per deg/s)")
        if self.scale is not None and not is_lsb(self.unit):
            raise ValueError(f"scale is only for unit = {LSB!r}, but the unit is {self.unit!r}; leave scale out")
        return self


class UnitKeys(_Strict):
    """The unit of all columns of one quantity, with the meaning that these keys have for one column."""

    unit: str
    scale: float | None = None
    offset: float = 0.0
    at_zero: float = 0.0
    signed_bits: Bits | None = None
    wrap_bits: Bits | None = None


def _position(text: str) -> str:
    """Return the text of a position. Raises ValueError for one that is none."""
    return str(Position.of(text))


class Part(_Strict):
    """What holds for all readings of one data set, or of all of one name."""

    turn_deg: float | None = None
    turn_u_deg: float | None = Field(default=None, ge=0)
    table_rate_dps: float | None = None
    position: Annotated[str, AfterValidator(_position)] | None = None
    temperature_c: float | None = None
    rows: tuple[int, int] | None = None  #: first and last row, from 1 (by = "rows")
    skip: bool = False  #: its rows are left out

    def constants(self) -> dict[str, float | str]:
        """Return the columns that it fills, by name."""
        return self.model_dump(exclude_none=True, exclude={"rows", "skip"})


class DataSets(_Strict):
    """How rows divide into data sets."""

    by: Literal["whole", "column", "gaps", "rests", "rows"] = "whole"
    column: str | int | None = None  #: by = "column": a new value begins a data set
    gap_s: float | None = Field(default=None, gt=0)  #: by = "gaps"; default: ten usual steps of time

    @model_validator(mode="after")
    def _column_named(self) -> DataSets:
        if (self.by == "column") != (self.column is not None):
            raise ValueError(
                f'by = "column" and column = NAME go together; give both (by = {self.by!r}, column = {self.column!r})'
            )
        return self


class ColumnMap(_Strict):
    """Everything that makes a recording of a log; the keys of a MAP.toml."""

    format: Literal["labctl-map/1"] = FORMAT
    serial: str | None = Field(default=None, pattern=SERIAL)  #: None: the file's own, or its name
    kind: Literal["samples", "points"] = "samples"
    motion: Motion | None = None  #: None: what the columns and the readings show
    started_at: AwareDatetime | None = None
    sample_rate_hz: float | None = Field(default=None, gt=0, allow_inf_nan=False)
    file: FileKeys = FileKeys()
    columns: dict[str, MappedColumn] = Field(default_factory=dict)  #: none: as proposed from the file
    units: dict[Quantity, UnitKeys] = Field(default_factory=dict)
    constants: Part = Part()
    datasets: DataSets = DataSets()
    parts: dict[str, Part] = Field(default_factory=dict)
    info: dict[str, JsonValue] = Field(default_factory=dict)  #: further keys of recording.toml

    @field_validator("columns", mode="after")
    @classmethod
    def _targets(cls, columns: dict[str, MappedColumn]) -> dict[str, MappedColumn]:
        for target, column in columns.items():
            if target in _MADE:
                raise ValueError(
                    f"{target}: a map cannot fill this column (labctl makes it from [datasets], or "
                    "it belongs to a table of coefficients); leave it out"
                )
            if not _usable_name(target):
                raise ValueError(
                    f"{target[:80]}: not a name for a column; use letters, digits and _ (at most 60), and end "
                    "with the unit of measurement, such as humidity_pct"
                )
            _check_unit(target, column)
        return columns

    @model_validator(mode="after")
    def _units_known(self) -> ColumnMap:
        for quantity, keys in self.units.items():
            example = QUANTITY_COLUMNS[quantity] + {
                "gyro": "x",
                "accel": "x_g",
                "field": "x_ut",
                "temperature": "c",
            }.get(quantity, "")
            MappedColumn.model_validate({"from": 1, **keys.model_dump(exclude_unset=True)})
            _check_unit(example, MappedColumn.of(1, keys.unit, keys.scale))
        return self

    @model_validator(mode="after")
    def _parts_fit(self) -> ColumnMap:
        if self.parts and "datasets" in self.model_fields_set and self.datasets.by not in {"column", "rows"}:
            raise ValueError('parts: [parts.NAME] needs [datasets] by = "column" or by = "rows"')
        if self.datasets.by == "rows" and not all(part.rows for part in self.parts.values()):
            raise ValueError('parts: by = "rows" needs rows = [first, last] in each [parts.NAME]')
        if self.datasets.by == "rows" and not self.parts:
            raise ValueError('parts: by = "rows" needs a [parts.NAME] for each data set')
        return self

    @property
    def axes(self) -> tuple[Axis, ...]:
        """The axes that have an output."""
        return tuple(axis for axis in get_args(Axis) if f"gyro_{axis}" in self.columns)


def _usable_name(target: str) -> bool:
    return target in BY_NAME or (target.isidentifier() and target.isascii() and len(target) <= 60)


def _check_unit(target: str, column: MappedColumn) -> None:
    quantity = unit_of_target(target)
    if not quantity or not column.unit:
        return
    if is_lsb(column.unit):
        if column.scale is None:
            raise ValueError(
                f"{target}: unit = {LSB!r} also needs scale, the number of LSB for 1 {quantity}; the gyro's data sheet "
                "states it"
            )
        return
    if quantity in QUANTITIES and find_unit(quantity, column.unit) is None:
        raise ValueError(f"{target}: {column.unit[:40]!r} is not a known unit of measurement; use {names_of(quantity)}")
