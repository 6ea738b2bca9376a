"""Codes of the Modbus application protocol: functions, exceptions, and the frames of a Modbus TCP stream."""

from __future__ import annotations

from typing import Final

READ_HOLDING: Final = 3
READ_INPUT: Final = 4
WRITE_SINGLE: Final = 6
WRITE_MULTIPLE: Final = 16
READ_FUNCTIONS: Final = frozenset({READ_HOLDING, READ_INPUT})
ILLEGAL_FUNCTION, ILLEGAL_ADDRESS, ILLEGAL_VALUE, DEVICE_FAILURE, ACKNOWLEDGED, BUSY = 1, 2, 3, 4, 5, 6
MEMORY_PARITY, GATEWAY_PATH, GATEWAY_TARGET = 8, 10, 11
#: Modbus Application Protocol V1.1b3, section 7.
EXCEPTIONS = {
    ILLEGAL_FUNCTION: "the instrument does not know the function; check driver and address in the bench file",
    ILLEGAL_ADDRESS: "the instrument has no such register, or the register cannot be written; check model and driver",
    ILLEGAL_VALUE: "the instrument does not accept the value; check the limits that are set on the instrument",
    DEVICE_FAILURE: "the instrument has an internal failure; read its panel, then switch it off and on",
    ACKNOWLEDGED: "the instrument needs more time; try again later",
    BUSY: "the instrument is busy; end its present task at its panel, or try again later",
    MEMORY_PARITY: "the instrument has a memory parity error; switch it off and on, and have it repaired if the "
    "error persists",
    GATEWAY_PATH: "gateway path unavailable; check the gateway's serial port settings",
    GATEWAY_TARGET: "gateway target device failed to respond; check address, power and cable behind the gateway",
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
