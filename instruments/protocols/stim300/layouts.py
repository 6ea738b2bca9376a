"""Layouts of the STIM300's datagrams and their CRC (data sheet TS1524 rev. 31, tables 5-13 to 5-22).

The CRC (polynomial 04C11DB7, start FFFFFFFF, most significant bit first, no final exclusive or) is linear over GF(2):
the CRC of a frame is the exclusive or of one table entry for each pair of its bytes.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Bytes = NDArray[np.uint8]
POLYNOMIAL = 0x04C11DB7
CRC_BYTES, COUNTER_BYTES, LATENCY_BYTES = 4, 1, 2
CLUSTER_BYTES, TEMPERATURES_BYTES, PPS_BYTES = 10, 7, 4  #: three values or one, and a status byte


def crc32_mpeg2(data: bytes, start: int = 0xFFFFFFFF) -> int:
    """Return the CRC-32/MPEG-2 of bytes, one bit at a time: the definition that the tables are made from."""
    crc = start
    for byte in data:
        crc ^= byte << 24
        for _ in range(8):
            crc = ((crc << 1) ^ POLYNOMIAL) & 0xFFFFFFFF if crc & 0x80000000 else (crc << 1) & 0xFFFFFFFF
    return crc


@dataclass(frozen=True)
class Layout:
    """Offsets of the fields of a datagram, bytes (data sheet TS1524, section 5.5.6)."""

    id: int
    length: int  #: without CR LF
    pad: int  #: zero bytes that the CRC covers but that are not sent
    status: int
    temperature: int | None
    temperature_status: int | None
    crlf: bool = False

    @property
    def stride(self) -> int:
        """Bytes from one frame to the next."""
        return self.length + (2 if self.crlf else 0)

    @property
    def covered(self) -> int:
        """Bytes before the CRC."""
        return self.length - CRC_BYTES

    @property
    def counter(self) -> int:
        """Offset of the counter."""
        return self.covered - COUNTER_BYTES - LATENCY_BYTES

    @cached_property
    def _tables(self) -> tuple[int, list[NDArray[np.uint32]]]:
        """Return the CRC of zeros, and a table for each pair of covered bytes (the last may stand alone)."""
        size = self.covered + self.pad
        single = np.zeros((size, 256), dtype=np.uint32)
        for place in range(size):
            bits = [
                crc32_mpeg2(bytes(place) + bytes([1 << bit]) + bytes(size - place - 1), start=0) for bit in range(8)
            ]
            for bit, value in enumerate(bits):
                single[place, (np.arange(256) >> bit) & 1 == 1] ^= np.uint32(value)
        # two bytes read as one little-endian word: the first is the low one
        pairs = [
            (single[place + 1][:, None] ^ single[place][None, :]).reshape(-1) for place in range(0, self.covered - 1, 2)
        ]
        if self.covered % 2:
            pairs.append(single[self.covered - 1])
        return crc32_mpeg2(bytes(size)), pairs

    def crc(self, frames: Bytes) -> NDArray[np.uint32]:
        """Return the CRC, (n,), of frames (n, >= length - 4)."""
        zeros, pairs = self._tables
        words = np.ascontiguousarray(frames[:, : self.covered // 2 * 2]).view("<u2")
        crc = np.full(len(frames), zeros, dtype=np.uint32)
        for index in range(self.covered // 2):
            crc ^= pairs[index].take(words[:, index])
        if self.covered % 2:
            crc ^= pairs[-1].take(frames[:, self.covered - 1])
        return crc

    def intact(self, frames: Bytes) -> NDArray[np.bool_]:
        """Return which frames (n, stride) carry the right id and CRC, (n,)."""
        sent = np.ascontiguousarray(frames[:, self.covered : self.length]).view(">u4")[:, 0]
        return (frames[:, 0] == self.id) & (self.crc(frames) == sent)


@dataclass(frozen=True)
class Content:
    """What a normal-mode datagram holds beside the rates."""

    acceleration: bool = False
    inclination: bool = False
    temperature: bool = False
    pps: bool = False  #: a pulse per second or, in units of older firmware, the auxiliary input

    @property
    def index(self) -> int:
        """Position in the rows of identifiers below."""
        return self.acceleration + 2 * self.inclination + 4 * self.temperature


#: Identifiers by content (table 5-21): without and with a pulse per second, and with the auxiliary input of firmware
#: from before the pulse (drivers of that time: vortexntnu, rock-drivers).
PLAIN = (0x90, 0x91, 0x92, 0x93, 0x94, 0xA5, 0xA6, 0xA7)
PPS = (0xF0, 0xF1, 0xF2, 0xF3, 0xF4, 0xF5, 0xF6, 0xF7)
AUXILIARY = (0x98, 0x99, 0x9A, 0x9B, 0x9C, 0xAD, 0xAE, 0xAF)


def content_of(identifier: int) -> Content:
    """Return what the datagram of an identifier holds; raises ValueError for an unknown one."""
    for row in (PLAIN, PPS, AUXILIARY):
        if identifier in row:
            index = row.index(identifier)
            return Content(bool(index & 1), bool(index & 2), bool(index & 4), row is not PLAIN)
    raise ValueError(f"0x{identifier:02X} is not the identifier of a normal-mode datagram of a STIM300")


def _layout(identifier: int) -> Layout:
    content = content_of(identifier)
    clusters = 1 + content.acceleration + content.inclination
    temperature_byte = 1 + CLUSTER_BYTES * clusters
    covered = temperature_byte + content.temperature * clusters * TEMPERATURES_BYTES + content.pps * PPS_BYTES
    covered += COUNTER_BYTES + LATENCY_BYTES
    temperature = temperature_byte if content.temperature else None
    return Layout(
        identifier,
        covered + CRC_BYTES,
        -covered % 4,
        CLUSTER_BYTES,
        temperature,
        None if temperature is None else temperature + TEMPERATURES_BYTES - 1,
    )


#: Normal-mode datagrams by identifier.
LAYOUTS = {identifier: _layout(identifier) for row in (PLAIN, PPS, AUXILIARY) for identifier in row}


def _special(identifier: int, length: int, *, crlf: bool) -> Layout:
    return Layout(identifier, length, -(length - CRC_BYTES) % 4, 0, None, None, crlf)


SERIAL_NUMBER, CONFIGURATION, BIAS_TRIM = (0xB5, 0xB7), (0xBC, 0xBD), (0xD1, 0xD2)  #: without and with CR LF
#: Datagrams that a unit sends once at its start or when it is asked: part and serial number, configuration, bias trim
#: offset, extended error information. The second identifier of each stands for the one with CR LF.
SPECIALS = {
    identifier: _special(identifier, length, crlf=crlf)
    for identifiers, length in (
        ((0xB1, 0xB3), 20),
        (SERIAL_NUMBER, 20),
        (CONFIGURATION, 26),
        (BIAS_TRIM, 40),
        ((0xBE, 0xBF), 21),
    )
    for identifier, crlf in zip(identifiers, (False, True), strict=True)
}
