"""Numbered scans from the packets of a LabJack's stream."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from instruments.protocols.labjack.stream import DUMMY, NUMBERS, RECOVERED, Packet

Counts = NDArray[np.int64]


class PacketScans:
    """Numbers the scans of packets, so that missing ones leave gaps.

    A packet that is missing leaves a gap by the device's own count. So do scans that the device skipped while its
    buffer was full: it says how many, and puts one dummy scan in their place.
    """

    def __init__(self, inputs: int, per_packet: int) -> None:
        self._inputs, self._per_packet = inputs, per_packet
        self.drop()

    def drop(self) -> None:
        """Reset the count: the next packet is the first."""
        self._number: int | None = None
        self._base = 0

    def add(self, packets: Sequence[Packet]) -> tuple[Counts, Counts, Counts]:
        """Return the numbers (n,) and the codes (n, inputs) of the scans that were taken, in order.

        Third, (n,), how many bytes were received after the packet of each.
        """
        numbers: list[Counts] = [np.zeros(0, dtype=np.int64)]
        codes: list[Counts] = [np.zeros((0, self._inputs), dtype=np.int64)]
        behind: list[Counts] = [np.zeros(0, dtype=np.int64)]
        for packet in packets:
            own_scans, theirs = self._scans_of(packet)
            numbers.append(own_scans)
            codes.append(theirs)
            behind.append(np.full(len(own_scans), packet.behind, dtype=np.int64))
        return np.concatenate(numbers), np.concatenate(codes), np.concatenate(behind)

    def _scans_of(self, packet: Packet) -> tuple[Counts, Counts]:
        scans = packet.codes[: len(packet.codes) // self._inputs * self._inputs].reshape(-1, self._inputs)
        if self._number is None:
            self._number, self._base = packet.number, packet.number * self._per_packet
        self._base += ((packet.number - self._number) % NUMBERS) * self._per_packet
        self._number = packet.number
        numbers = self._base + np.arange(len(scans), dtype=np.int64)
        is_measured = np.ones(len(scans), dtype=bool)
        if packet.status == RECOVERED:
            is_measured = ~np.all(scans == DUMMY, axis=1)
            skipped = max(packet.info - 1, 0)
            first = 0 if is_measured.all() else int(np.argmin(is_measured))
            numbers[first:] += skipped
            self._base += skipped
        return numbers[is_measured], scans[is_measured]
