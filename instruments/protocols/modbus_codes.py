"""Codes of the Modbus application protocol: functions, exceptions, and the frames of a Modbus TCP stream."""

from __future__ import annotations

from typing import Final

READ_HOLDING: Final = 3
READ_INPUT: Final = 4
WRITE_SINGLE: Final = 6
WRITE_MULTIPLE: Final = 16
ILLEGAL_FUNCTION, ILLEGAL_ADDRESS, ILLEGAL_VALUE, DEVICE_FAILURE, ACKNOWLEDGED, BUSY = 1, 2, 3, 4, 5, 6
EXCEPTIONS = {
    ILLEGAL_FUNCTION: "it does not know the function",
    ILLEGAL_ADDRESS: "it has no such register, or the register cannot be written",
    ILLEGAL_VALUE: "it does not accept the value",
    DEVICE_FAILURE: "it failed inside",
    ACKNOWLEDGED: "it needs more time",
    BUSY: "it is busy",
}
#: Bytes of a Modbus TCP frame up to and including its length field.
TCP_PREFIX_BYTES = 6


def ends_at_a_frame_end(data: bytes) -> bool:
    """Return whether a stretch of a Modbus TCP stream ends where a frame ends; the stream carries no checksum."""
    while data:
        length = TCP_PREFIX_BYTES + int.from_bytes(data[4:6], "big")
        if len(data) < length:
            return False
        data = data[length:]
    return True
