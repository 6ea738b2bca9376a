"""Packets of a LabJack's spontaneous stream (T-series data sheet, 3.2.4): a header of 16 bytes, then 16-bit codes.

0-1 transaction number, 2-3 protocol 0, 4-5 length, 6 unit 1, 7 function 76, 8 type 16, 9 reserved,
10-11 backlog (bytes), 12-13 status, 14-15 additional information, 16.. codes, high byte first
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

HEADER = struct.Struct(">HHHBBBBHHH")
UNIT, FUNCTION, TYPE = 1, 76, 16
#: Bytes of the length field's count that are no codes.
BEFORE_CODES = HEADER.size - 6
MAX_BYTES = HEADER.size + 2 * 512
NUMBERS = 1 << 16  #: transaction numbers
#: A scan that was not taken: the device was recovering from a full buffer.
DUMMY = 0xFFFF
RECOVERING, RECOVERED, OVERLAP, RECOVERED_UNKNOWN, BURST_ENDED = 2940, 2941, 2942, 2943, 2944
#: Statuses after which no further scan comes, or an unknown number is missing -> what they mean, and what to do.
FATAL = {
    OVERLAP: "the inputs cannot be scanned at this rate; lower sample_rate_hz or resolution_index",
    RECOVERED_UNKNOWN: "more than 65535 scans were skipped while its buffer was full; check network and processor",
    BURST_ENDED: "the device was set to a limited number of scans, so another program has used it",
}


@dataclass(frozen=True)
class Packet:
    """One packet."""

    number: int  #: transaction number, counted by the device
    backlog: int  #: bytes that wait in the device
    status: int
    info: int  #: of status RECOVERED: scans that were skipped
    codes: NDArray[np.int64]  #: (n,) all inputs of a scan one after the other
    behind: int = 0  #: bytes that were received after it, in the same data


def split(data: bytes) -> tuple[list[Packet], bytes, int]:
    """Return the packets of a stream, the bytes of an unfinished one, and how many times bytes were no packet."""
    packets, at, damaged = [], 0, 0
    in_damage = False
    while len(data) - at >= HEADER.size:
        number, protocol, length, unit_id, function, kind, _, backlog, status, info = HEADER.unpack_from(data, at)
        size = 6 + length
        is_packet = (protocol, unit_id, function, kind) == (0, UNIT, FUNCTION, TYPE)
        if not is_packet or not HEADER.size <= size <= MAX_BYTES or length % 2:
            damaged += not in_damage
            in_damage, at = True, at + 1
            continue
        if len(data) - at < size:
            break
        codes = np.frombuffer(data, dtype=">u2", count=(size - HEADER.size) // 2, offset=at + HEADER.size)
        behind = len(data) - at - size
        packets.append(Packet(number, backlog, status, info, codes.astype(np.int64), behind))
        in_damage, at = False, at + size
    return packets, data[at:], damaged


def build(packet: Packet) -> bytes:
    """Return the bytes of a packet."""
    codes = packet.codes.astype(">u2").tobytes()
    head = (packet.number % NUMBERS, 0, BEFORE_CODES + len(codes), UNIT, FUNCTION, TYPE, 0)
    return HEADER.pack(*head, packet.backlog, packet.status, packet.info) + codes
