"""Settings of a gyro whose stream a format describes, as a bench file gives them."""

from __future__ import annotations

import difflib
from typing import Any

from pydantic import Field, field_validator, model_validator

from instruments.bench_config import GyroSettings
from instruments.protocols.serial_options import SerialOptions
from instruments.protocols.stream_formats.document import StreamFormat, shipped_formats
from instruments.toml_documents import read_toml


class StreamOptions(SerialOptions):
    """Deviations of a unit from its format."""

    baudrate: int | None = Field(default=None, gt=0)


class StreamSettings(GyroSettings):
    """A gyro and the format of its stream: the name of a shipped one, a file beside the bench file, or a table.

    Axes, sample rate and technology are those of the format where the bench file says nothing of them.
    """

    format: StreamFormat
    options: StreamOptions = Field(default_factory=StreamOptions)

    @model_validator(mode="before")
    @classmethod
    def _of_the_format(cls, document: Any) -> Any:
        if not isinstance(document, dict):
            return document
        format_ = document.get("format")
        if isinstance(format_, str) and format_ in shipped_formats():
            format_ = read_toml(shipped_formats()[format_])
        if not isinstance(format_, dict):
            return document
        usual = {"axes": _axes(format_), "sample_rate_hz": format_.get("rate_hz")}
        usual |= {"technology": format_.get("technology"), "model": format_.get("name")}
        stated = {name: value for name, value in document.items() if value is not None}
        return {name: value for name, value in usual.items() if value} | stated | {"format": format_}

    @field_validator("format", mode="before")
    @classmethod
    def _found(cls, document: Any) -> Any:
        if isinstance(document, str):
            if document.endswith(".toml"):
                raise ValueError(
                    f"the folder of the bench file has no file {document!r}; correct the name, or put the file there"
                )
            near = difflib.get_close_matches(document, shipped_formats(), n=1)
            hint = f"did you mean {near[0]!r}? If not, " if near else ""
            raise ValueError(
                f"no stream format {document!r} comes with labctl (those that do: {', '.join(shipped_formats())}); "
                f"{hint}name one of these, or a .toml file in the folder of the bench file"
            )
        return document

    @model_validator(mode="after")
    def _usable(self) -> StreamSettings:
        if not set(self.axes) <= set(self.format.axes):
            raise ValueError(
                f"axes = {list(self.axes)}, but the stream format has the axes "
                f"{list(self.format.axes)}; correct axes or format"
            )
        if self.port is None:
            raise ValueError("port is missing; add the serial port, best by its path in /dev/serial/by-id")
        if self.sample_rate_hz is None:
            raise ValueError(
                "neither the stream format nor the bench file states the number of readings per "
                "second; add sample_rate_hz"
            )
        return self


def _axes(document: dict[Any, Any]) -> list[str]:
    """Return the axes of a format that was not checked yet: empty for one that will be refused."""
    layout = document.get("line") or document.get("frame")
    fields = layout.get("fields") if isinstance(layout, dict) else None
    names = [each.get("name") for each in fields or () if isinstance(each, dict)]
    return [name.removeprefix("gyro_") for name in names if isinstance(name, str) and name.startswith("gyro_")]
