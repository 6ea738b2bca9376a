"""Settings of a gyro on a CAN bus, as a bench file gives them: a DBC file, and which signal is which channel."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BeforeValidator, Field, model_validator

from instruments.bench_config import GyroSettings, Strict, is_simulated_address
from instruments.protocols.can.address import parsed
from instruments.protocols.can.frames import frame_of_text
from instruments.protocols.can.signals import CanLayout
from instruments.protocols.stream_formats.document import Name


def _several(value: Any) -> Any:
    return (value,) if isinstance(value, str | int) else value


class CanCounter(Strict):
    """The signal that counts the cycles; of a unit whose every message has one, the signals of all."""

    signals: Annotated[tuple[str, ...], BeforeValidator(_several), Field(min_length=1)]
    step: int = Field(default=1, gt=0)  #: from cycle to cycle
    wrap: int | None = Field(default=None, gt=1)  #: it begins again at 0 after this minus 1; None: after all its bits


def _counter(value: Any) -> Any:
    return {"signals": value} if isinstance(value, str | list | tuple) else value


class CanSettings(GyroSettings):
    """A gyro on a CAN bus. Signals are named Message.Signal, as the DBC file spells both."""

    dbc: str  #: the text of the DBC file; a bench file names a .dbc file beside it
    signals: dict[Name, str] = Field(min_length=1)  #: channel -> signal
    units: dict[Name, str] = Field(default_factory=dict)  #: channel -> unit, where the DBC file does not say it
    hold: tuple[Name, ...] = ()  #: channels that come more rarely: the last value stands for the cycles between
    counter: Annotated[CanCounter | None, BeforeValidator(_counter)] = None
    #: Signal -> the raw values, or the texts of the DBC file, that it has in a valid reading.
    status: dict[str, Annotated[tuple[int | str, ...], BeforeValidator(_several)]] = Field(default_factory=dict)
    first: str = ""  #: a signal of the message with which each cycle begins
    start: tuple[str, ...] = ()  #: frames that are sent when the stream is started, such as 000#0100

    @model_validator(mode="before")
    @classmethod
    def _usual(cls, document: Any) -> Any:
        if (
            not isinstance(document, dict)
            or document.get("axes") is not None
            or not isinstance(document.get("signals"), dict)
        ):
            return document
        axes = [axis for axis in "xyz" if f"gyro_{axis}" in document["signals"]]
        return {**document, "axes": axes or ["z"]}

    @model_validator(mode="after")
    def _usable(self) -> CanSettings:
        if self.port is None:
            raise ValueError("port is missing; add the bus, such as can://socketcan/can0")
        if not is_simulated_address(self.port):
            parsed(self.port)
        if self.sample_rate_hz is None:
            raise ValueError("sample_rate_hz is missing; add the number of cycles per second that the unit sends")
        if self.dbc.endswith(".dbc") and "\n" not in self.dbc:
            raise ValueError(
                f"the folder of the bench file has no file {self.dbc!r}; correct the name, or put the file there"
            )
        for text in self.start:
            frame_of_text(text)
        self.layout()
        return self

    def layout(self) -> CanLayout:
        """Return where channels, counter and status are; raises ValueError where the DBC file does not fit."""
        counter = self.counter
        return CanLayout.of(
            self.dbc, self.signals, axes=self.axes, units=self.units, hold=self.hold, status=self.status,
            counters=() if counter is None else counter.signals, first=self.first,
        )  # fmt: skip
