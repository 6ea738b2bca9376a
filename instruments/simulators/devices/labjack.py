"""A simulated LabJack T7: registers over Modbus TCP, and its stream at an address of its own."""

from __future__ import annotations

import weakref
from functools import partial

import numpy as np
from numpy.typing import NDArray

from instruments.bench_config import part_of
from instruments.protocols.analog_settings import LabJackSettings
from instruments.protocols.labjack import registers as lj
from instruments.protocols.labjack import stream
from instruments.simulators.links.faults import Faults
from instruments.simulators.links.modbus_device import Cell, ModbusDevice, float32, int16, uint32
from instruments.simulators.physics.world import SimulatedGyro
from instruments.simulators.setup import InstrumentSetup

#: Packets that the device makes at once at most; it has lost older ones.
MAX_PACKETS = 60
#: Nominal constants of the +-10 V range, and of the others, from LabJack's C examples: slopes, centre, offset.
NOMINAL = [
    value
    for n in range(8)
    for value in (3.1580578e-4 / 10 ** (n % 4), -3.158058e-4 / 10 ** (n % 4), 33523.0, -10.586956522 / 10 ** (n % 4))
]
SERIAL = 470012345


class Stream:
    """What registers and stream of one device share."""

    def __init__(self, setup: InstrumentSetup) -> None:
        self.settings = part_of(setup.gyro, LabJackSettings)
        self.unit = setup.unit
        self.values = {lj.SCAN_RATE.number: 0.0}
        self.scans: list[int] = []  #: addresses of the scan list
        self.started_s: float | None = None
        self.sent = 0  #: packets
        self.skipped = 0  #: scans that it could not keep

    def enable(self, value: int, t_s: float) -> bool:
        """Start or end the stream."""
        if value and self.started_s is not None:
            return False
        self.started_s, self.sent, self.skipped = (t_s if value else None), 0, 0
        return True

    @property
    def per_packet(self) -> int:
        """Scans of one packet."""
        return int(self.values[lj.SAMPLES_PER_PACKET.number]) // int(self.values[lj.NUMBER_OF_ADDRESSES.number])

    @property
    def rate_hz(self) -> float:
        """Scans per second, as the device's own clock makes them."""
        return self.unit.sample_rate_hz

    def packets_by(self, t_s: float) -> int:
        """Return how many packets are complete."""
        if self.started_s is None:
            return 0
        return int(np.floor(((t_s - self.started_s) * self.rate_hz - self.skipped + 1e-6) / self.per_packet))

    def complete_s(self, number: int) -> float | None:
        """Return when a packet, counted from 1, is complete, s; None while no stream runs."""
        return (
            None
            if self.started_s is None
            else self.started_s + (number * self.per_packet + self.skipped) / self.rate_hz
        )


_STREAMS: weakref.WeakKeyDictionary[SimulatedGyro, Stream] = weakref.WeakKeyDictionary()


def _stream_of(setup: InstrumentSetup) -> Stream:
    return _STREAMS.setdefault(setup.unit, Stream(setup))


class SimulatedT7(ModbusDevice):
    """The registers that the driver uses; `product` and `constants` may be set to those of another device."""

    def __init__(self, setup: InstrumentSetup) -> None:
        self.product = float(lj.T7)
        self.constants = list(NOMINAL)
        self._pointer = 0
        self.stream = _stream_of(setup)
        plain = (
            lj.SCAN_RATE, lj.NUMBER_OF_ADDRESSES, lj.SAMPLES_PER_PACKET, lj.SETTLING, lj.RESOLUTION_INDEX,
            lj.BUFFER_BYTES, lj.AUTO_TARGET, lj.DATA_TYPE, lj.NUMBER_OF_SCANS,
            *(lj.SCAN_LIST.nth(n, 2, first=0) for n in range(16)),
            *(lj.AIN_RANGE.nth(n, 2, first=0) for n in range(14)),
        )  # fmt: skip
        cells: dict[int, Cell] = {
            lj.PRODUCT_ID.number: float32("big", lambda _: self.product),
            lj.SERIAL_NUMBER.number: uint32("big", lambda _: SERIAL),
            lj.ENABLE.number: uint32("big", lambda _: self.stream.started_s is not None, self.stream.enable),
            lj.FLASH_POINTER.number: uint32("big", lambda _: self._pointer, self._point),
        }
        for register in plain:
            make = float32 if register.kind == "float32" else uint32
            cells[register.number] = make(
                "big", partial(self._get, register.number), partial(self._put, register.number)
            )
        for n in range(14):
            number = lj.AIN_NEGATIVE.number + n
            cells[number] = int16(partial(self._get, number), partial(self._put, number))
        for n in range(lj.FRAME):
            cells[lj.FLASH.number + 2 * n] = float32("big", partial(self._constant, n))
        super().__init__("tcp", cells, setup.faults)

    def _get(self, number: int, _t_s: float) -> float:
        return self.stream.values.get(number, 0)

    def _put(self, number: int, value: float, _t_s: float) -> bool:
        self.stream.values[number] = value
        return True

    def _point(self, address: int, _t_s: float) -> bool:
        self._pointer = address
        return True

    def _constant(self, n: int, _t_s: float) -> float:
        index = (self._pointer - lj.CONSTANTS_AT) // 4 + n
        return self.constants[index] if 0 <= index < len(self.constants) else 0.0


class SimulatedT7Stream:
    """The packets of the stream. `overflow_scans`: so many scans are skipped once, as with a full buffer."""

    def __init__(self, setup: InstrumentSetup) -> None:
        self._faults: Faults = setup.faults
        self.stream = _stream_of(setup)
        self.overflow_scans = self._recovered = 0
        self.status = 0  #: of the next packet

    def receive(self, data: bytes, t_s: float) -> None:
        """Ignore what a host sends here."""

    def transmit(self, t_s: float) -> bytes:
        """Return the packets up to `t_s`."""
        if self.overflow_scans and self.stream.started_s is not None:
            self.stream.skipped += self.overflow_scans - 1
            self._recovered, self.overflow_scans = self.overflow_scans, 0
        newest = self.stream.packets_by(t_s)
        first = max(self.stream.sent, newest - MAX_PACKETS)
        self.stream.sent = max(newest, self.stream.sent)
        if newest <= first:
            return b""
        packets = self._packets(first, newest)
        if (gap := self._faults.trigger(["counter_gap"], t_s)) is not None:
            packets = packets[gap.value :]
        return b"".join(packets)

    def skip(self, t_s: float) -> None:
        """Drop the packets up to `t_s`."""
        self.stream.sent = max(self.stream.sent, self.stream.packets_by(t_s))

    @property
    def newest_s(self) -> float | None:
        """When the newest packet was complete, s."""
        return self.stream.complete_s(self.stream.sent)

    def next_byte_s(self, t_s: float) -> float | None:  # noqa: ARG002
        """Return when the next packet is complete; None while no stream runs."""
        return self.stream.complete_s(self.stream.sent + 1)

    def _packets(self, first: int, end: int) -> list[bytes]:
        """Return the packets of numbers `first` to `end`, the last left out; all scans are made at once."""
        s = self.stream
        assert s.started_s is not None
        index = np.arange(first * s.per_packet, end * s.per_packet) + s.skipped + 1
        codes = self._codes(s.started_s + index / s.rate_hz).reshape(end - first, s.per_packet, -1)
        packets = []
        for number, scans in zip(range(first, end), codes, strict=True):
            status, info, self.status = self.status, 0, 0
            if self._recovered:
                status, info, self._recovered = stream.RECOVERED, self._recovered, 0
                scans[0] = stream.DUMMY
            packets.append(stream.build(stream.Packet(number, 0, status, info, scans.ravel())))
        return packets

    def _codes(self, t_s: NDArray[np.float64]) -> NDArray[np.int64]:
        options, sample = self.stream.settings.options, self.stream.unit.sample(t_s)
        volts = options.rest_v + options.v_per_dps * sample.rate_dps
        if options.thermometer_input is not None:
            above_zero_c = (sample.temperature_c[:, :1] - options.thermometer_zero_c) / options.thermometer_c_per_v
            volts = np.hstack([volts, above_zero_c])
        slope, _, centre, _ = NOMINAL[4 * lj.gain_index(options.range_v) :][:4]
        return np.clip(np.rint(volts / slope + centre), 0, stream.DUMMY).astype(np.int64)
