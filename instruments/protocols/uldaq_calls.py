"""The calls of libuldaq about a scan as messages, in which a simulated device gets them.

A program calls libuldaq in its own process, where no simulated instrument can answer. The calls that the driver makes
go to a simulated device as messages of gRPC's form under the names of the C functions. Every reply begins with the
error number.
"""

from __future__ import annotations

import struct
from dataclasses import astuple, dataclass

import numpy as np
from numpy.typing import NDArray

SERVICE = "uldaq"
CONNECT, INFO, SCAN, STATUS, STOP = (
    "ulConnectDaqDevice",
    "ulAIGetInfo",
    "ulAInScan",
    "ulAInScanStatus",
    "ulAInScanStop",
)
#: No function of the library: reads the buffer that the caller gave to the scan.
BUFFER = "buffer"

_ERROR = struct.Struct("<i")
_SCAN = struct.Struct("<iiiiid")
_STATUS = struct.Struct("<iQ")
_PART = struct.Struct("<II")


@dataclass(frozen=True)
class Scan:
    """A scan of all inputs from `low` to `high` without end, into a circular buffer of `samples` scans."""

    low: int
    high: int
    mode: int  #: InputMode
    range_code: int  #: of BIPOLAR_RANGES
    samples: int
    rate_hz: float

    @property
    def inputs(self) -> int:
        """How many inputs are scanned."""
        return self.high - self.low + 1


class CallFailed(Exception):
    """A call that the library refuses, with its number and text."""

    def __init__(self, error_code: int, error_message: str) -> None:
        super().__init__(error_message)
        self.error_code, self.error_message = error_code, error_message


def scan_request(scan: Scan) -> bytes:
    """Return the message that begins a scan."""
    return _SCAN.pack(*astuple(scan))


def parsed_scan(message: bytes) -> Scan:
    """Return the scan of a message; raises struct.error for no such message."""
    return Scan(*_SCAN.unpack(message))


def part_request(first: int, count: int) -> bytes:
    """Return the message that asks for `count` scans of the buffer from place `first`."""
    return _PART.pack(first, count)


def parsed_part(message: bytes) -> tuple[int, int]:
    """Return place and count of a message; raises struct.error."""
    first, count = _PART.unpack(message)
    return first, count


def reply(error: int, content: bytes = b"") -> bytes:
    """Return a reply: error number, and content."""
    return _ERROR.pack(error) + content


def parsed_reply(message: bytes) -> tuple[int, bytes]:
    """Return error number and content of a reply; raises struct.error."""
    (error,) = _ERROR.unpack_from(message)
    return error, message[_ERROR.size :]


def status_content(status: int, scans: int) -> bytes:
    """Return the content of a reply about a scan: its status, and how many scans were made since its begin."""
    return _STATUS.pack(status, scans)


def parsed_status(content: bytes) -> tuple[int, int]:
    """Return status and number of scans; raises struct.error."""
    status, scans = _STATUS.unpack(content)
    return status, scans


def volts_content(volts: NDArray[np.float64]) -> bytes:
    """Return doubles as the content of a reply."""
    return volts.astype("<f8").tobytes()


def parsed_volts(content: bytes) -> NDArray[np.float64]:
    """Return the doubles (n,) of a reply; raises ValueError."""
    return np.frombuffer(content, dtype="<f8").astype(np.float64)
