"""Settings of a serial port that a stream comes through, as a bench file gives them."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from instruments.bench_config import Strict


class Rs485Options(Strict):
    """Direction of an RS-485 line, where the adapter does not switch it by itself (most USB adapters do)."""

    by: Literal["kernel", "rts"] = "kernel"  #: who switches: the port's kernel driver, or labctl by RTS
    send_level: bool = True  #: level of RTS while sending; the other one while receiving
    delay_before_send_s: float = Field(default=0.0, ge=0, le=0.1)
    delay_after_send_s: float = Field(default=0.0, ge=0, le=0.1)


class SerialOptions(Strict):
    """Line settings beyond the bit rate. Not given: no parity, one stop bit, DTR and RTS as the system leaves them."""

    parity: Literal["none", "odd", "even"] = "none"
    stop_bits: Literal[1, 2] = 1
    dtr: bool | None = None
    rts: bool | None = None
    echo: bool = False  #: the adapter echoes what is sent; it is dropped
    rs485: Rs485Options | None = None
    adapter: str | None = None  #: serial number of the USB adapter of the unit
