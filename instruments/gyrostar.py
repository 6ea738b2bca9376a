"""muRata Gyrostar ENV-05S: a voltage, read by an Advantech ADAM-6017 analog input module over Modbus TCP."""

from __future__ import annotations

import numpy as np
from pydantic import Field

from instruments.bench import GyroSettings, Strict
from instruments.clock import Clock, sleep_until
from instruments.errors import LimitError, WrongInstrument
from instruments.gyro import Channel, GyroIdentity, GyroLimits, Readings
from instruments.modbus import Registers
from instruments.ports import Ports

REPLY_S = 1.0
MODULE_NAME, MODULE_6017 = 210, 0x6017
RANGE_CODE = 200
FULL_CODE = 65535
#: The module clips; what stands at the rails is no measurement.
RAIL_LOW, RAIL_HIGH = 0, 65500
#: type code -> (lowest, highest) volts
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
CHANNELS = 8


class Options(Strict):
    """Where the unit is wired to the module. Defaults: the Weiss report's scale, 0 to 5 V, a thermometer on input 1."""

    channel: int = Field(default=0, ge=0, lt=CHANNELS)
    range_code: int = 0x0147
    rest_v: float = 2.5
    v_per_dps: float = 0.022
    thermometer_channel: int | None = Field(default=1, ge=0, lt=CHANNELS)
    thermometer_range_code: int = 0x0147
    thermometer_c_per_v: float = 20.0
    thermometer_zero_c: float = -25.0  #: at 0 V


class Gyrostar:
    """Driver of a Gyrostar; sampled at the module's pace, about ten readings per second."""

    def __init__(self, settings: GyroSettings, ports: Ports, clock: Clock) -> None:
        self.name = settings.name
        self.settings = settings
        self.options = Options.model_validate(settings.options)
        self.axes: tuple[str, ...] = tuple(settings.axes)
        self.sample_rate_hz = settings.sample_rate_hz or 10.0
        self.limits = GyroLimits(settings.max_rate_dps, settings.min_c, settings.max_c)
        self._clock = clock
        host = settings.host or ""
        self._registers = Registers(
            self.name, 1, clock, lambda: ports.modbus_tcp(host, settings.tcp_port, device=self.name, timeout_s=REPLY_S)
        )
        self._next_s = 0.0

    @property
    def channels(self) -> tuple[Channel, ...]:
        """What is read: the rate as a voltage, and the thermometer where there is one."""
        options = self.options
        low, high = self._range(options.range_code)
        found = [Channel(f"gyro_{self.axes[0]}", "V", (high - low) / FULL_CODE, low)]
        if options.thermometer_channel is not None:
            low, high = self._range(options.thermometer_range_code)
            per_code = options.thermometer_c_per_v * (high - low) / FULL_CODE
            zero = options.thermometer_zero_c + options.thermometer_c_per_v * low
            found.append(Channel("temperature_c", "deg C", per_code, zero))
        return tuple(found)

    def _range(self, code: int) -> tuple[float, float]:
        if code not in RANGES_V:
            known = ", ".join(f"0x{known:04X}" for known in RANGES_V)
            raise LimitError(self.name, f"input range code 0x{code:04X} is not known (there are {known})")
        return RANGES_V[code]

    def identify(self) -> GyroIdentity:
        """Get the module's name and input ranges; raises WrongInstrument when they are not the bench file's."""
        name = self._registers.read(MODULE_NAME, 1, "module name", function=4)[0]
        if name != MODULE_6017:
            raise WrongInstrument(self.name, f"module name 0x{name:04X} is not an ADAM-6017's; check the address")
        wired = [(self.options.channel, self.options.range_code)]
        if self.options.thermometer_channel is not None:
            wired.append((self.options.thermometer_channel, self.options.thermometer_range_code))
        for channel, wanted in wired:
            found = self._registers.read(RANGE_CODE + channel, 1, f"range of input {channel}", function=4)[0]
            if found != wanted:
                raise WrongInstrument(
                    self.name, f"input {channel} has range code 0x{found:04X}, the bench file says 0x{wanted:04X}"
                )
        output: dict[str, dict[str, float | str]] = {
            self.axes[0]: {"unit": "V", "offset": self.options.rest_v, "scale": self.options.v_per_dps}
        }
        settings = self.settings
        return GyroIdentity(
            settings.serial, settings.model or "muRata Gyrostar ENV-05S", settings.technology or "piezo",
            settings.datasheet, output,
        )  # fmt: skip

    def start(self) -> None:
        """Control the stream: readings are polled from now on."""
        self._next_s = self._clock.now_s()

    def read(self, duration_s: float) -> Readings:
        """Get the readings of the next `duration_s` seconds, polled at the sample rate."""
        end_s = self._clock.now_s() + duration_s
        rows, times = [], []
        self._next_s = max(self._next_s, self._clock.now_s())
        while self._next_s <= end_s:
            sleep_until(self._clock, self._next_s)
            rows.append(self._poll())
            times.append(self._next_s)
            self._next_s += 1.0 / self.sample_rate_hz
        sleep_until(self._clock, end_s)
        return self._readings(rows, times)

    def glance(self) -> Readings:
        """Get one fresh reading."""
        now = self._clock.now_s()
        self._next_s = max(self._next_s, now)
        return self._readings([self._poll()], [now])

    def stop(self) -> None:
        """Control the link: close it; safe to call twice."""
        self._registers.close()

    def _poll(self) -> list[int]:
        options = self.options
        wanted = [options.channel]
        if options.thermometer_channel is not None:
            wanted.append(options.thermometer_channel)
        first = min(wanted)
        words = self._registers.read(first, max(wanted) - first + 1, "analog inputs", function=4)
        return [words[channel - first] for channel in wanted]

    def _readings(self, rows: list[list[int]], times: list[float]) -> Readings:
        codes = np.asarray(rows, dtype=np.int64).reshape(len(rows), len(self.channels))
        raw = {channel.name: codes[:, i] for i, channel in enumerate(self.channels)}
        valid = np.all((codes > RAIL_LOW) & (codes <= RAIL_HIGH), axis=1)
        return Readings(np.asarray(times), raw, valid)
