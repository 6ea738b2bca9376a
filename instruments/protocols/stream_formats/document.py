"""A stream format as its TOML document says it: where the fields of a line or a frame are and what they mean.

A field with a unit becomes a channel of the readings. One without is read for the counter or for the flags alone.
"""

from __future__ import annotations

from importlib import resources
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, StringConstraints, field_validator, model_validator

from instruments.bench_config import Strict
from instruments.protocols.stream_formats.checksums import algorithm
from instruments.protocols.stream_formats.units import UNITS, unit_of_channel
from instruments.toml_documents import read_toml

FORMAT = "labctl-stream/1"
Name = Annotated[str, StringConstraints(pattern=r"^[a-z][a-z0-9_]{0,40}$")]
ByteOrder = Literal["big", "little"]
FieldType = Literal["u8", "i8", "u16", "i16", "u24", "i24", "u32", "i32", "u64", "f32", "f64"]
#: A decimal number is counted in steps of this, in the field's unit, unless the format gives another resolution.
DECIMAL_STEP = 1e-6
#: So is a binary floating-point number: a power of two, so that a float of 24 bits at or above 2**-17 stays exact.
BINARY_STEP = 2.0**-40
LONGEST_FRAME = 4096


def hex_bytes(text: str) -> bytes:
    """Return the bytes of pairs of hexadecimal digits; raises ValueError."""
    try:
        return bytes.fromhex(text)
    except ValueError:
        raise ValueError(f"{text!r} is not a series of hexadecimal bytes; write it like 'FE 81 FF 55'") from None


class StreamField(Strict):
    """One number of a line or frame."""

    name: Name
    unit: str | None = None  #: of the number times `scale`; None: no channel of the readings
    scale: float = 1.0
    resolution: float | None = Field(default=None, gt=0)  #: step of the stored whole numbers, of a number not whole
    all_set: int | None = None  #: bits that are set in a valid reading
    none_set: int | None = None  #: bits that are clear in a valid reading
    equals: int | None = None  #: another number: the message is no reading, and not damaged

    @model_validator(mode="after")
    def _unit_fits(self) -> StreamField:
        if self.unit is None:
            return self
        if self.unit not in UNITS:
            raise ValueError(f"field {self.name}: unit {self.unit!r} is not known; choose one of {_units()}")
        channel_unit = unit_of_channel(self.name)
        if channel_unit is not None and UNITS[self.unit].unit != channel_unit:
            fitting = [unit for unit, each in UNITS.items() if each.unit == channel_unit]
            raise ValueError(
                f"field {self.name}: unit {self.unit!r} does not belong to this quantity; choose "
                f"one of {', '.join(fitting)}"
            )
        return self


class ColumnField(StreamField):
    """A decimal number of a line."""

    column: int = Field(ge=0)  #: counted from 0; what `begins` says is column 0
    #: Text before the number in its column, which tells it from others; a line with another one is damaged.
    prefix: str = Field(default="", max_length=8)


class BytesField(StreamField):
    """A binary number of a frame, `at` bytes behind its beginning or that of its item."""

    at: int = Field(ge=0, default=0)
    type: FieldType
    item: int | None = None  #: identifier of the item that holds it, where the format has items
    byte_order: ByteOrder | None = None  #: where it differs from that of the frame
    hold: bool = False  #: an item that comes more rarely: its last value stands for the frames between

    @property
    def size(self) -> int:
        """Number of bytes."""
        return int(self.type[1:]) // 8

    @property
    def is_float(self) -> bool:
        """Whether it is a floating-point number."""
        return self.type.startswith("f")


class Checksum(Strict):
    """Checksum of the bytes or characters from `start` to where it stands."""

    algorithm: str
    start: int = Field(default=0, ge=0)
    byte_order: ByteOrder | None = None  #: of a frame's: where it differs from that of the frame
    mark: str = "*"  #: of a line's: it stands behind this, in hexadecimal digits

    @field_validator("algorithm")
    @classmethod
    def _known(cls, name: str) -> str:
        algorithm(name)
        return name


class LengthField(Strict):
    """Where a frame says how long it is: the number there, and `plus` bytes."""

    at: int = Field(ge=0)
    type: Literal["u8", "u16"] = "u8"
    plus: int = Field(default=0, ge=0)


class Items(Strict):
    """A frame whose data are items: identifier, number of bytes, bytes."""

    at: int = Field(ge=0)  #: where the first one begins
    id_type: Literal["u8", "u16"] = "u16"
    size_type: Literal["u8", "u16"] = "u8"


class Counter(Strict):
    """The field that counts the readings."""

    field: str
    step: int = Field(default=1, gt=0)  #: from reading to reading
    wrap: int = Field(gt=1)  #: it begins again at 0 after this minus 1


class TimeStamp(Strict):
    """The field that holds the time by the device's own clock."""

    field: str
    tick_s: float = Field(gt=0)  #: s of one unit of the number in the message
    wrap: int | None = Field(default=None, gt=1)  #: the number begins again at 0 after this minus 1


class Pulses(Strict):
    """The field by which the device's time follows the pulses that it is given, one each second from a GNSS receiver.

    Either the time since the last pulse, or a number that changes with each.
    """

    since: str | None = None
    tick_s: float | None = Field(default=None, gt=0)  #: s of one unit of the number in `since`
    count: str | None = None
    interval_s: float = Field(default=1.0, gt=0)  #: from pulse to pulse

    @model_validator(mode="after")
    def _is_one(self) -> Pulses:
        if (self.since is None) == (self.count is None):
            raise ValueError("give exactly one of since (time since the last pulse) and count (number of pulses)")
        if self.since is not None and self.tick_s is None:
            raise ValueError("tick_s is missing; give the time in s of one unit of the number in since")
        return self

    @property
    def field(self) -> str:
        """The field that it names."""
        return self.since or self.count or ""


class LineLayout(Strict):
    """Lines of decimal numbers."""

    begins: str = ""  #: of a reading; other lines are other messages
    separator: str = ","  #: a space stands for any number of them
    columns: int | None = None  #: their exact number, that of `begins` included
    checksum: Checksum | None = None
    fields: tuple[ColumnField, ...] = Field(min_length=1)


class FrameLayout(Strict):
    """Binary frames."""

    sync: str  #: hexadecimal bytes at the beginning of each
    length: int | LengthField  #: bytes of a whole frame
    byte_order: ByteOrder
    trailer: str = ""  #: hexadecimal bytes at the end, behind the checksum
    checksum: Checksum | None = None  #: at the end of the frame
    items: Items | None = None
    fields: tuple[BytesField, ...] = Field(min_length=1)

    @field_validator("sync", "trailer")
    @classmethod
    def _hexadecimal(cls, text: str) -> str:
        hex_bytes(text)
        return text

    @model_validator(mode="after")
    def _fields_fit(self) -> FrameLayout:
        if not self.sync.strip():
            raise ValueError("sync is empty; give the bytes with which every frame begins")
        if isinstance(self.length, int) and not len(hex_bytes(self.sync)) < self.length <= LONGEST_FRAME:
            raise ValueError(
                f"length = {self.length} bytes; give more than the number of bytes of sync, and at "
                f"most {LONGEST_FRAME} bytes"
            )
        for field in self.fields:
            if field.item is not None and self.items is None:
                raise ValueError(
                    f"field {field.name} has the key `item`, but the format has no section "
                    "[frame.items]; leave the key out, or add the section"
                )
            if (
                isinstance(self.length, int)
                and field.item is None
                and field.at + field.size > (end := self.content_end(self.length))
            ):
                raise ValueError(
                    f"field {field.name} ends at byte {field.at + field.size}, but the data of a frame end at byte "
                    f"{end}; correct `at`, `type` or `length`"
                )
        return self

    def content_end(self, length: int) -> int:
        """Return where checksum and trailer of a frame of a length begin."""
        checksum = 0 if self.checksum is None else algorithm(self.checksum.algorithm).size
        return length - len(hex_bytes(self.trailer)) - checksum


class StreamFormat(Strict):
    """A whole document: a line or a frame, and what a port needs to receive it."""

    format: Literal["labctl-stream/1"]
    name: str
    description: str = ""
    technology: Literal["fog", "mems", "piezo", ""] = ""
    baudrate: int = Field(gt=0)
    rate_hz: float | None = Field(default=None, gt=0)  #: readings per second where the bench file says nothing
    limit_dps: float | None = Field(default=None, gt=0)  #: a reading beyond this rate is not valid
    start: tuple[str, ...] = ()  #: sent when the stream is started, with line ends
    line: LineLayout | None = None
    frame: FrameLayout | None = None
    counter: Counter | None = None
    time: TimeStamp | None = None
    pulses: Pulses | None = None

    @property
    def fields(self) -> tuple[StreamField, ...]:
        """Fields of the line or frame."""
        layout = self.line or self.frame
        assert layout is not None
        return layout.fields

    @property
    def axes(self) -> tuple[str, ...]:
        """Axes of the rates, in the order of the document."""
        return tuple(field.name.removeprefix("gyro_") for field in self.fields if field.name.startswith("gyro_"))

    @model_validator(mode="after")
    def _whole(self) -> StreamFormat:
        if (self.line is None) == (self.frame is None):
            raise ValueError("a stream format has one of the sections [line] and [frame]; give exactly one")
        names = [field.name for field in self.fields]
        if twice := next((name for name in names if names.count(name) > 1), None):
            raise ValueError(f"two fields have the name {twice!r}; rename one")
        if not self.axes or not set(self.axes) <= {"x", "y", "z"}:
            raise ValueError(
                f"no field is named gyro_x, gyro_y or gyro_z (the fields are {', '.join(names)}); "
                "give the rates of the gyro these names"
            )
        if silent := [field.name for field in self.fields if field.name.startswith("gyro_") and field.unit is None]:
            raise ValueError(f"field {silent[0]} has no unit; add one like unit = 'rad/s'")
        if self.counter is not None and self.counter.field not in names:
            raise ValueError(f"counter: no field is named {self.counter.field!r}; choose one of {', '.join(names)}")
        if self.time is not None and self.time.field not in names:
            raise ValueError(f"time: no field is named {self.time.field!r}; choose one of {', '.join(names)}")
        if self.pulses is not None:
            self._require_pulses(self.pulses, names)
        return self

    def _require_pulses(self, pulses: Pulses, names: list[str]) -> None:
        if pulses.field not in names:
            raise ValueError(f"pulses: no field is named {pulses.field!r}; choose one of {', '.join(names)}")
        if pulses.count is not None and self.time is None and self.counter is None:
            raise ValueError(
                "pulses: a number of pulses tells no time between them; add time or counter, or give since in its place"
            )


def shipped_formats() -> dict[str, Path]:
    """Return name -> path of the stream formats that are part of labctl."""
    folder = Path(str(resources.files("instruments"))) / "formats"
    return {path.stem: path for path in sorted(folder.glob("*.toml"))}


def read_format(source: str | Path) -> StreamFormat:
    """Read a format by path, or a shipped one by name.

    Raises FileNotFoundError, tomllib.TOMLDecodeError, pydantic.ValidationError.
    """
    return StreamFormat.model_validate(read_toml(shipped_formats().get(str(source), Path(source))))


def _units() -> str:
    return ", ".join(repr(unit) for unit in UNITS)
