"""Faults that can be armed in any simulated instrument, by time or by count; random ones are drawn from a seed."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
import serial

from instruments.simulators.links.device import SimulatedDevice, connected

FaultKind = Literal[
    "silence",  # nothing comes out
    "noise",  # bytes that the instrument never sent
    "split",  # a frame comes in two pieces, the second later
    "merge",  # output is held back and comes at once
    "dropped_link",  # the port is gone
    "wrong_crc",
    "counter_gap",
    "refusal",
    "modbus_exception",
    "lost_reply",
    "stall",
]


@dataclass
class Fault:
    """One armed fault: from when to when, and how often at most."""

    kind: FaultKind
    from_s: float = 0.0
    until_s: float = float("inf")
    count: int | None = None
    value: int = 1

    def active(self, t_s: float) -> bool:
        """Return whether the fault is armed at this time, s."""
        return self.from_s <= t_s < self.until_s and self.count != 0


@dataclass
class Faults:
    """Faults armed in one instrument."""

    seed: int = 1
    armed: list[Fault] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.rng = np.random.default_rng(self.seed)

    def arm(
        self,
        kind: FaultKind,
        *,
        from_s: float = 0.0,
        until_s: float = float("inf"),
        count: int | None = None,
        value: int = 1,
    ) -> Fault:
        """Arm a fault between two clock times, for at most `count` occurrences; `value` is its size."""
        fault = Fault(kind, from_s, until_s, count, value)
        self.armed.append(fault)
        return fault

    def clear(self) -> None:
        """Disarm every fault."""
        self.armed.clear()

    def present(self, kind: FaultKind, t_s: float) -> bool:
        """Return whether a fault is active at this time, without counting it down."""
        return any(fault.kind == kind and fault.active(t_s) for fault in self.armed)

    def trigger(self, kinds: Iterable[FaultKind], t_s: float) -> Fault | None:
        """Return the first active fault of the given kinds, counted down; None when there is none."""
        fault_kinds = set(kinds)
        for fault in self.armed:
            if fault.kind in fault_kinds and fault.active(t_s):
                if fault.count is not None:
                    fault.count -= 1
                return fault
        return None


class FaultyWire:
    """A wire to an instrument that loses, adds, splits and delays bytes as armed."""

    def __init__(self, device: SimulatedDevice, faults: Faults) -> None:
        self._device = device
        self.faults = faults
        self._held = bytearray()
        self._later_s = 0.0

    def receive(self, data: bytes, t_s: float) -> None:
        """Pass bytes on to the instrument; raises serial.SerialException on a dropped link."""
        self._check_link(t_s)
        self._device.receive(data, t_s)

    def transmit(self, t_s: float) -> bytes:
        """Return the bytes that arrive; raises serial.SerialException on a dropped link."""
        self._check_link(t_s)
        if not self.faults.armed and not self._held:
            return self._device.transmit(t_s)
        sent = self._device.transmit(t_s)
        if self.faults.present("silence", t_s):
            self._held.clear()
            return b""
        if sent and (noise := self.faults.trigger(["noise"], t_s)) is not None:
            at = int(self.faults.rng.integers(0, len(sent) + 1))
            sent = sent[:at] + self.faults.rng.bytes(max(noise.value, 1)) + sent[at:]
        if self.faults.present("merge", t_s) or (self._held and t_s < self._later_s):
            self._held += sent
            return b""
        sent, self._held = bytes(self._held) + sent, bytearray()
        if sent and self.faults.trigger(["split"], t_s) is not None:
            at = int(self.faults.rng.integers(0, len(sent) + 1))
            self._held += sent[at:]
            self._later_s = t_s + 0.02
            return sent[:at]
        return sent

    def skip(self, t_s: float) -> None:
        """Drop the bytes that have arrived and the delayed ones; raises serial.SerialException on a dropped link."""
        self._check_link(t_s)
        self._held.clear()
        self._device.skip(t_s)

    def next_byte_s(self, t_s: float) -> float | None:
        """Return when the next byte comes."""
        if self._held:
            return max(self._later_s, t_s + 1e-3)
        if self.faults.present("silence", t_s):
            ends = [f.until_s for f in self.faults.armed if f.kind == "silence" and f.active(t_s)]
            return min(ends) if ends and np.isfinite(min(ends)) else None
        return self._device.next_byte_s(t_s)

    @property
    def newest_s(self) -> float | None:
        """When the newest byte was sent, s; None where the instrument does not tell, or a fault may hide it."""
        return None if self.faults.armed or self._held else getattr(self._device, "newest_s", None)

    def connect(self) -> FaultyWire:
        """Return a further link to the instrument: one of its own where each connection has one, else this wire."""
        connection = connected(self._device)
        return self if connection is self._device else FaultyWire(connection, self.faults)

    @property
    def is_rpc(self) -> bool:
        """Whether the instrument answers calls of gRPC."""
        return getattr(self._device, "is_rpc", False)

    def _check_link(self, t_s: float) -> None:
        if self.faults.trigger(["dropped_link"], t_s) is not None:
            raise serial.SerialException("device disconnected")
