"""muRata Gyrostar ENV-05S: a voltage, read by an Advantech ADAM-6017 analog input module over Modbus TCP.

The unit's 2.5 V at rest and 22 mV per deg/s are from the Weiss report; the module's registers and range codes from two
public drivers of it. The module converts about ten times a second, whoever asks faster reads the same code again.
"""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from pydantic import Field, ValidationInfo, field_validator

from instruments.bench_config import GyroSettings, Strict
from instruments.clock import Clock, sleep_until
from instruments.errors import LinkError, WrongInstrument
from instruments.interfaces.gyro import Channel, GyroIdentity, GyroLimits, Readings
from instruments.protocols.modbus_registers import Register
from instruments.transport.factory import Ports
from instruments.transport.modbus import Client, Registers

REPLY_S = 1.0
SAMPLE_RATE_HZ = 10.0
SOURCE = "public ADAM-6017 drivers"
INPUT = Register(0, "analog input", unit="counts", source=SOURCE)
RANGE_CODE = Register(200, "range code of input", source=SOURCE)
MODULE_NAME = Register(210, "module name", source=SOURCE)
MODULE_6017 = 0x6017
CHANNELS = 8
FULL_CODE = 65535
#: The module clips; what stands at the rails is no measurement.
RAIL_LOW, RAIL_HIGH = 0, 65500
#: range code -> (lowest, highest) volts; code 0 and 65535 of the input
RANGES_V = {
    0x0103: (-0.15, 0.15),
    0x0104: (-0.5, 0.5),
    0x0105: (0.0, 0.15),
    0x0106: (0.0, 0.5),
    0x0140: (-1.0, 1.0),
    0x0142: (-5.0, 5.0),
    0x0143: (-10.0, 10.0),
    0x0145: (0.0, 1.0),
    0x0147: (0.0, 5.0),
    0x0148: (0.0, 10.0),
}
TINY = 1e-6  #: of a sampling period


class Options(Strict):
    """Where the unit is wired to the module, and a thermometer beside it where there is one: the unit has none."""

    channel: int = Field(default=0, ge=0, lt=CHANNELS)
    range_code: int = 0x0147
    rest_v: float = 2.5
    v_per_dps: float = 0.022
    thermometer_channel: int | None = Field(default=None, ge=0, lt=CHANNELS)
    thermometer_range_code: int = 0x0147
    thermometer_c_per_v: float = 20.0
    thermometer_zero_c: float = -25.0  #: at 0 V
    address: int = Field(default=1, ge=0, le=255)
    read_function: Literal[3, 4] = 4  #: which one reads inputs and ranges is the same to the modules that are known

    @field_validator("range_code", "thermometer_range_code")
    @classmethod
    def _is_known(cls, code: int) -> int:
        if code not in RANGES_V:
            known = ", ".join(f"0x{known:04X}" for known in RANGES_V)
            raise ValueError(
                f"input range code 0x{code:04X} is not a voltage range of the ADAM-6017 (there are {known})"
            )
        return code

    @field_validator("thermometer_channel")
    @classmethod
    def _is_another(cls, channel: int | None, info: ValidationInfo) -> int | None:
        if channel is not None and channel == info.data.get("channel"):
            raise ValueError(f"input {channel} cannot carry both the rate and the thermometer")
        return channel

    @property
    def wired(self) -> dict[int, int]:
        """The inputs in use and their range codes: the rate's first."""
        found = {self.channel: self.range_code}
        if self.thermometer_channel is not None:
            found[self.thermometer_channel] = self.thermometer_range_code
        return found


def make_channels(axis: str, options: Options) -> tuple[Channel, ...]:
    """Return what is read: the rate as a voltage, and the temperature where there is a thermometer."""
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
    """Driver of a Gyrostar, polled on the Clock. A reading's time is the instant at which it was asked for."""

    def __init__(self, settings: GyroSettings, ports: Ports, clock: Clock) -> None:
        self.name = settings.name
        self.settings = settings
        self.options = Options.model_validate(settings.options)
        self.axes: tuple[str, ...] = settings.axes
        self.channels = make_channels(self.axes[0], self.options)
        self.sample_rate_hz = settings.sample_rate_hz or SAMPLE_RATE_HZ
        self.limits = GyroLimits(settings.max_rate_dps, settings.min_c, settings.max_c)
        self._clock = clock

        def link() -> Client:
            return ports.modbus_tcp(settings.host or "", settings.tcp_port, device=self.name, timeout_s=REPLY_S)

        self._registers = Registers(self.name, self.options.address, clock, link)
        self._begun_s = 0.0  #: reading k is due at `_begun_s` + k periods
        self._k = 0

    def identify(self) -> GyroIdentity:
        """Get who the unit is (bench file); raises WrongInstrument when the module or its input ranges are others."""
        name = self._get(MODULE_NAME)
        if name != MODULE_6017:
            text = f"{MODULE_NAME} is 0x{name:04X}, an ADAM-6017's is 0x{MODULE_6017:04X}; check the host's address"
            raise WrongInstrument(self.name, text)
        for channel, wanted in self.options.wired.items():
            found = self._get(RANGE_CODE.nth(channel, 1, first=0))
            if found != wanted:
                text = f"input {channel} has range code 0x{found:04X}, the bench file says 0x{wanted:04X}; set either"
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
        """Control the stream: readings are polled from now on."""
        self._begun_s, self._k = self._clock.now_s(), 0

    def read(self, duration_s: float) -> Readings:
        """Get the readings of the next `duration_s` seconds, polled at the sample rate.

        What could not be read in time counts as lost; raises LinkError when not even the first one could.
        """
        end_s = self._clock.now_s() + duration_s
        self._skip()  # nobody asked for these
        rows: list[list[int]] = []
        times: list[float] = []
        lost = 0
        while self._due_s() <= end_s + TINY / self.sample_rate_hz:
            sleep_until(self._clock, self._due_s())
            lost += self._skip()
            if self._due_s() > end_s + TINY / self.sample_rate_hz:
                break  # what delayed the reading before took longer than the rest of the time
            times.append(self._clock.now_s())
            self._k += 1
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
        """Get one fresh reading; raises LinkError."""
        self._begun_s, self._k = self._clock.now_s(), 1
        return self._readings([self._poll()], [self._begun_s])

    def stop(self) -> None:
        """Control the link: close it; safe to call twice."""
        self._registers.close()

    def _due_s(self) -> float:
        return self._begun_s + self._k / self.sample_rate_hz

    def _skip(self) -> int:
        """Leave out readings that are due since a whole period or longer; returns how many."""
        missed = max(math.floor((self._clock.now_s() - self._due_s()) * self.sample_rate_hz + TINY), 0)
        self._k += missed
        return missed

    def _get(self, register: Register) -> int:
        return self._registers.get_int(self._readable(register))

    def _readable(self, register: Register) -> Register:
        return register.read_by(self.options.read_function)

    def _poll(self) -> list[int]:
        wired = self.options.wired
        first, last = min(wired), max(wired)
        words = self._registers.words(self._readable(INPUT.nth(first, 1, first=0)), last - first + 1)
        return [words[channel - first] for channel in wired]

    def _readings(self, rows: list[list[int]], times: list[float], lost: int = 0) -> Readings:
        codes = np.asarray(rows, dtype=np.int64).reshape(len(rows), len(self.channels))
        raw = {channel.name: codes[:, i] for i, channel in enumerate(self.channels)}
        valid = np.all((codes > RAIL_LOW) & (codes <= RAIL_HIGH), axis=1)
        return Readings(np.asarray(times, dtype=np.float64), raw, valid, lost)
