"""What bytes that are no reply say about their cause."""

from __future__ import annotations

from pymodbus.framer import FramerRTU

from instruments.errors import one_line
from instruments.protocols.modbus_codes import TCP_PREFIX_BYTES

SHORTEST_RTU_BYTES = 5
#: This many printable characters in a row are the greeting of another kind of server; it is shown up to this length.
LEAST_TEXT, LONGEST_TEXT = 6, 40
LINE = "check line settings and cable"
ADDRESS = "check host and tcp_port in the bench file"


def explain_rtu(received: bytes, address: int) -> str:
    """Return why bytes on a serial line are no reply of unit `address`, and what to do."""
    if len(received) >= SHORTEST_RTU_BYTES and received[0] != address and _is_frame(received):
        return _other_unit(received[0], address)
    return _bytes(received, LINE)


def explain_tcp(received: bytes, sent: bytes, address: int) -> str:
    """Return why bytes on a TCP link are no reply to a request of unit `address`, and what to do."""
    if other := other_server(received):
        return other
    if len(received) <= TCP_PREFIX_BYTES:
        return _bytes(received, LINE)
    if protocol := int.from_bytes(received[2:4], "big"):
        return f"the reply has protocol number {protocol} instead of 0 (Modbus TCP); {ADDRESS}"
    if received[:2] != sent[:2]:
        number, asked = (int.from_bytes(each[:2], "big") for each in (received, sent))
        return (
            f"the reply to request {number} arrived instead of that to request {asked}; find the second "
            "Modbus master on this link"
        )
    if received[TCP_PREFIX_BYTES] != address:
        return _other_unit(received[TCP_PREFIX_BYTES], address)
    return _bytes(received, LINE)


def other_server(received: bytes) -> str:
    """Return what answered where bytes begin as those of no Modbus instrument do; empty where they may be of one."""
    if received.startswith(b"HTTP/") or b"<html" in received[:200].lower():
        return f"an HTTP server answered, not a Modbus instrument; {ADDRESS}"
    beginning = received[:LEAST_TEXT]
    if len(beginning) == LEAST_TEXT and beginning.isascii() and beginning.decode().isprintable():
        return (
            f"text arrived ({one_line(received[:LONGEST_TEXT].decode('latin-1'))}) instead of a Modbus reply; {ADDRESS}"
        )
    return ""


def _is_frame(data: bytes) -> bool:
    return FramerRTU.check_CRC(data[:-2], int.from_bytes(data[-2:], "big"))


def _other_unit(found: int, address: int) -> str:
    return f"unit {found} answered instead of unit {address}; set address in the bench file, or find the second device"


def _bytes(received: bytes, advice: str) -> str:
    return f"{len(received)} bytes arrived that are not a Modbus reply; {advice}"
