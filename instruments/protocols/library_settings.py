"""Instruments that another library drives: PyMeasure's or MSL-Equipment's classes, named in the bench file."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, JsonValue, model_validator

from instruments.bench_config import ChamberSettings, ReferenceSettings, Strict
from instruments.protocols.port_or_host import PortOrHostSettings
from instruments.protocols.serial_options import SerialOptions


class LibraryOptions(PortOrHostSettings):
    """Which class, and how it is reached."""

    library: Literal["pymeasure", "msl-equipment"] = "pymeasure"
    #: Of pymeasure: module and class. Of msl-equipment: manufacturer and model, as its registry spells them.
    instrument: str = Field(pattern=r"^[^:]+:[^:]+$")
    baudrate: int = Field(default=9600, gt=0)
    tcp_port: int = 0
    options: SerialOptions = Field(default_factory=SerialOptions)
    end: str = "\r\n"  #: line end of a request (pymeasure)
    timeout_s: float = Field(default=3.0, gt=0)
    address: str = ""  #: of msl-equipment, in its own words: "TCP::10.0.0.7::2000", "ASRL/dev/ttyUSB0"
    #: Further arguments of the class (pymeasure), or properties of the connection (msl-equipment).
    arguments: dict[str, JsonValue] = Field(default_factory=dict)
    #: Attribute that states its identity; None: the usual one of the class, where it has one; empty: none is asked.
    identity: str | None = None

    def _require_address(self) -> None:
        """Raise ValueError where the library does not know how the instrument is reached."""
        if self.library == "pymeasure":
            super()._require_address()
        elif not self.address:
            raise ValueError(
                'key address is missing; write it in the syntax of msl-equipment, such as "TCP::10.0.0.7::2000"'
            )


class LibraryChamberSettings(LibraryOptions, ChamberSettings):
    """A chamber: names of the attributes or methods of its class."""

    serial: str = ""  #: compared with what it says of itself, where that holds a serial number
    temperature: str = "temperature"
    setpoint: str = "setpoint"
    start: str = ""  #: called after each set point; empty: it needs no start
    stop: str = ""  #: switches heating and cooling off
    program: str = ""  #: other than 0 while a program runs; empty: the class does not tell
    program_mask: int | None = None  #: bits of `program` that count
    running: str = ""  #: other than 0 while heating and cooling are on; empty: the class does not tell
    running_mask: int | None = None  #: bits of `running` that count
    alarms: str = ""  #: other than 0 while there is an alarm
    resolution_c: float = Field(default=0.1, gt=0)
    safe_state: Literal["setpoint", "off"] = "setpoint"

    @model_validator(mode="after")
    def _can_be_off(self) -> LibraryChamberSettings:
        if self.safe_state == "off" and not self.stop:
            raise ValueError(
                'safe_state = "off" also needs the key stop: the method that switches heating and cooling off'
            )
        return self


class LibraryQuantity(Strict):
    """One quantity: an attribute, or a method without arguments."""

    attribute: str
    unit: str = "deg C"
    resolution: float = Field(default=1e-4, gt=0)


class LibraryReferenceSettings(LibraryOptions, ReferenceSettings):
    """A thermometer or hygrometer: column -> attribute."""

    reads: dict[str, LibraryQuantity] = Field(
        default_factory=lambda: {"reference_c": LibraryQuantity(attribute="temperature")}, min_length=1
    )
