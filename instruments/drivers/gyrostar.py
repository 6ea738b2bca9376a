"""muRata Gyrostar ENV-05S: a voltage, read by an Advantech ADAM-6017 analog input module over Modbus TCP."""

from __future__ import annotations

import math

import numpy as np

from instruments.clock import Clock, sleep_until
from instruments.drivers import probes
from instruments.drivers.driver import GyroDriver
from instruments.errors import LinkError, WrongInstrument
from instruments.interfaces.gyro import Channel, GyroIdentity, GyroLimits, Readings
from instruments.protocols.adam6017 import (
    FULL_CODE,
    INPUT,
    MODULE_6017,
    MODULE_NAME,
    RAIL_HIGH,
    RAIL_LOW,
    RANGE_CODE,
    RANGES_V,
    GyrostarSettings,
    WiringOptions,
)
from instruments.protocols.modbus_registers import Register
from instruments.transport.factory import Ports
from instruments.transport.modbus import Registers
from instruments.transport.modbus_link import Client

REPLY_S = 1.0
#: The module converts about ten times a second; a faster poll reads the same code again.
SAMPLE_RATE_HZ = 10.0
TINY = 1e-6  #: sampling periods, a tolerance for rounding


def make_channels(axis: str, options: WiringOptions) -> tuple[Channel, ...]:
    """Return the channels: the rate output in V, and the temperature in deg C where there is a thermometer."""
    low, high = RANGES_V[options.range_code]
    rate = Channel(f"gyro_{axis}", "V", (high - low) / FULL_CODE, low)
    if options.thermometer_channel is None:
        return (rate,)
    low, high = RANGES_V[options.thermometer_range_code]
    per_code = options.thermometer_c_per_v * (high - low) / FULL_CODE
    return rate, Channel(
        "temperature_c", "deg C", per_code, options.thermometer_zero_c + options.thermometer_c_per_v * low
    )


class Gyrostar:
    """Driver of a Gyrostar, polled on the clock. The time of a reading is the instant of its request."""

    def __init__(self, settings: GyrostarSettings, ports: Ports, clock: Clock) -> None:
        self.name = settings.name
        self.settings = settings
        self.options = settings.options
        self.axes: tuple[str, ...] = settings.axes
        self.channels = make_channels(self.axes[0], self.options)
        self.sample_rate_hz = settings.sample_rate_hz or SAMPLE_RATE_HZ
        self.limits = GyroLimits(settings.max_rate_dps, settings.min_c, settings.max_c)
        self._clock = clock

        def link() -> Client:
            return ports.modbus_tcp(settings.host or "", settings.tcp_port, device=self.name, timeout_s=REPLY_S)

        self._registers = Registers(self.name, self.options.address, clock, link)
        self._start_s = 0.0  #: reading `_index` is due at this time plus `_index` periods
        self._index = 0

    def identify(self) -> GyroIdentity:
        """Get the unit's identity from the bench file, after the module and its input ranges were checked.

        Raises WrongInstrument for another module or input range, and what a register read raises.
        """
        name = self._get(MODULE_NAME)
        if name != MODULE_6017:
            text = (
                f"{MODULE_NAME} is 0x{name:04X} instead of 0x{MODULE_6017:04X} (ADAM-6017); check the "
                "address of the host"
            )
            raise WrongInstrument(self.name, text)
        for channel, expected in self.options.range_codes.items():
            range_code = self._get(RANGE_CODE.nth(channel, 1, first=0))
            if range_code != expected:
                text = (
                    f"input {channel} has range code 0x{range_code:04X}, but the bench file says 0x{expected:04X}; "
                    "change one of the two"
                )
                raise WrongInstrument(self.name, text)
        settings, options = self.settings, self.options
        return GyroIdentity(
            serial=settings.serial,
            model=settings.model or "muRata Gyrostar ENV-05S",
            technology=settings.technology or "piezo",
            datasheet=settings.datasheet,
            output={self.axes[0]: {"unit": "V", "offset": options.rest_v, "scale": options.v_per_dps}},
        )

    def start(self) -> None:
        """Start the readings, which are polled from now on."""
        self._start_s, self._index = self._clock.now_s(), 0

    def read(self, duration_s: float) -> Readings:
        """Get the readings of the next `duration_s` seconds, polled at the sample rate.

        A reading that cannot be made in time counts as lost. Raises LinkError when the first reading fails.
        """
        end_s = self._clock.now_s() + duration_s
        self._skip()  # readings before this call are not part of it
        rows: list[list[int]] = []
        times: list[float] = []
        lost = 0
        while self._due_s() <= end_s + TINY / self.sample_rate_hz:
            sleep_until(self._clock, self._due_s())
            lost += self._skip()
            if self._due_s() > end_s + TINY / self.sample_rate_hz:
                break  # the previous reading took longer than the rest of the time
            times.append(self._clock.now_s())
            self._index += 1
            try:
                rows.append(self._poll())
            except LinkError:
                if not rows:
                    raise
                times.pop()
                lost += 1
        sleep_until(self._clock, end_s)
        return self._readings(rows, times, lost)

    def read_latest(self) -> Readings:
        """Get one fresh reading; raises LinkError, RequestRejected."""
        self._start_s, self._index = self._clock.now_s(), 1
        return self._readings([self._poll()], [self._start_s])

    def stop(self) -> None:
        """Close the link; safe to call twice."""
        self._registers.close()

    def _due_s(self) -> float:
        return self._start_s + self._index / self.sample_rate_hz

    def _skip(self) -> int:
        """Skip readings that are overdue by a whole period or longer; returns their number."""
        missed = max(math.floor((self._clock.now_s() - self._due_s()) * self.sample_rate_hz + TINY), 0)
        self._index += missed
        return missed

    def _get(self, register: Register) -> int:
        return self._registers.get_int(self._with_function(register))

    def _with_function(self, register: Register) -> Register:
        return register.read_by(self.options.read_function)

    def _poll(self) -> list[int]:
        inputs = self.options.range_codes
        first, last = min(inputs), max(inputs)
        words = self._registers.words(self._with_function(INPUT.nth(first, 1, first=0)), last - first + 1)
        return [words[channel - first] for channel in inputs]

    def _readings(self, rows: list[list[int]], times: list[float], lost: int = 0) -> Readings:
        codes = np.asarray(rows, dtype=np.int64).reshape(len(rows), len(self.channels))
        raw = {channel.name: codes[:, i] for i, channel in enumerate(self.channels)}
        valid = np.all((codes > RAIL_LOW) & (codes <= RAIL_HIGH), axis=1)
        return Readings(np.asarray(times, dtype=np.float64), raw, valid, lost)


DRIVER = GyroDriver(GyrostarSettings, Gyrostar, probe=probes.ADAM_6017)
