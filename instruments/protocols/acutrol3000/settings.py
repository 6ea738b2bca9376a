"""Settings of a table on an ACUTROL 3000, as a bench file gives them."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field

from instruments.bench_config import TableSettings
from instruments.protocols.port_or_host import PortOrHostSettings


class Acutrol3000Settings(PortOrHostSettings, TableSettings):
    """Address, axis and reference of a servo table."""

    follows_courses: ClassVar[bool] = True
    address_error: ClassVar[str] = "give either host (Ethernet) or port (serial) for the controller, not both"

    tcp_port: int = 9878  #: with `host`; a serial `port` leads to the same stream through a device server
    baudrate: int = 9600
    axis: int = Field(default=1, ge=1, le=6)
    direction: Literal[1, -1] = 1  #: -1 where a positive rate turns the table clockwise, seen from above
    #: Reference of readings: the rate measured by the encoder, or the demanded rate; both keep the encoder's angles.
    reference: Literal["measured", "demanded"] = "measured"
    rate_u_ppm: float = Field(default=20.0, ge=0)  #: standard uncertainty of a demanded rate
    encoder_u_deg: float = Field(default=3e-4, gt=0)  #: standard uncertainty of an angle against another one
    time_u_s: float = Field(default=5e-4, gt=0)  #: standard uncertainty of an angle's time, without what is common
    still_dps: float = Field(default=0.01, gt=0)  #: the estimated rate of a table at rest is below
    home_dps: float = Field(default=30.0, gt=0)  #: rate of homing; never beyond max_rate_dps
    reset_interlocks: bool = False  #: a frozen interlock fault is reset by labctl; else a person does so
