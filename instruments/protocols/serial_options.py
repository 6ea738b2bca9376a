"""Settings of a serial port that a stream comes through, as a bench file gives them."""

from __future__ import annotations

from typing import Literal

from instruments.bench_config import Strict


class SerialOptions(Strict):
    """Line settings beyond the bit rate. Not given: no parity, one stop bit, DTR and RTS as the system leaves them."""

    parity: Literal["none", "odd", "even"] = "none"
    stop_bits: Literal[1, 2] = 1
    dtr: bool | None = None
    rts: bool | None = None
    adapter: str | None = None  #: serial number of the USB adapter that the unit hangs on
