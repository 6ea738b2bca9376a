"""Driver of gyros on a CAN bus: a DBC file says what their messages hold, the bench file which signal is what."""

from __future__ import annotations

from importlib import resources

from instruments.clock import Clock
from instruments.drivers.driver import GyroDriver, Trial
from instruments.drivers.streamed_readings import (
    SILENCE_S,
    StreamedGyro,
    StreamedReadings,
    StreamLaw,
    identify_stream,
)
from instruments.errors import LinkError
from instruments.interfaces.gyro import Channel, GyroIdentity, GyroLimits, Readings
from instruments.protocols.can.cycles import CycleDecoder
from instruments.protocols.can.frames import frame_of_text, packed
from instruments.protocols.can.settings import CanSettings
from instruments.protocols.can.signals import COUNTER
from instruments.protocols.stream_formats.document import Counter
from instruments.transport.factory import Ports
from instruments.transport.serial_stream import SerialStream


class CanGyro(StreamedGyro):
    """A gyro that sends its readings as messages of a CAN bus. Raw values are the whole numbers of the signals."""

    def __init__(self, settings: CanSettings, ports: Ports, clock: Clock) -> None:
        self.name, self.settings = settings.name, settings
        self.axes: tuple[str, ...] = tuple(settings.axes)
        self.sample_rate_hz: float = settings.sample_rate_hz or 0.0
        self.limits = GyroLimits(settings.max_rate_dps, settings.min_c, settings.max_c)
        layout = settings.layout()
        self._scales = layout.scales
        self._decoder = CycleDecoder(layout)
        port = settings.port or ""
        stream = SerialStream(self.name, port, ports, clock, baudrate=0, timeout_s=SILENCE_S)
        counter = _counter(settings, layout.counter_bits)
        law = StreamLaw(self.sample_rate_hz, list(layout.scales), counter)
        super().__init__(
            stream, StreamedReadings(self.name, port, stream, self._decoder, law, clock, self._unread)
        )  # fmt: skip

    @property
    def channels(self) -> tuple[Channel, ...]:
        """What a reading holds: the signals of the bench file, in deg/s, deg C and g."""
        return tuple(Channel(name, scale.unit, scale.scale, scale.offset) for name, scale in self._scales.items())

    def identify(self) -> GyroIdentity:
        """Get the unit's identity from the bench file, after one reading came; raises NoReply, LinkError."""
        return identify_stream(self, self.settings, self._stream, ("gyro on a CAN bus", "mems"))

    def start(self) -> None:
        """Control the stream: open the bus, send the frames that start the unit, drop what is old; LinkError."""
        self._readings.begin([packed(frame_of_text(text)) for text in self.settings.start])

    def read(self, duration_s: float) -> Readings:
        """Get every reading of the next `duration_s` seconds; fewer where messages are missing.

        Raises NoReply after SILENCE_S, or five sampling periods, without a reading; MalformedReply for a counter that
        stands; WrongInstrument for another rate; LinkError, also where the interface has left the bus.
        """
        readings = super().read(duration_s)
        self._refuse_bus_off()
        return readings

    def read_latest(self) -> Readings:
        """Get one fresh reading and drop everything older; raises NoReply after SILENCE_S, LinkError."""
        readings = super().read_latest()
        self._refuse_bus_off()
        return readings

    def _refuse_bus_off(self) -> None:
        if self._decoder.is_bus_off:
            self.stop()
            raise LinkError(
                self.name,
                f"the interface of {self.settings.port} has left the bus after too many errors (bus-off); check bit "
                "rate, wiring and the two terminating resistors of 120 ohm, then start the interface again",
            )

    def _unread(self, stream: SerialStream, silence_s: float) -> str:
        decoder, text = self._decoder, f"no reading on {self.settings.port} for {silence_s:.1f} s: "
        if decoder.errors:
            counted = ", ".join(f"{count} of {kind}" for kind, count in decoder.errors.items())
            return f"{text}the bus reports errors ({counted}); check bit rate, wiring and terminating resistors"
        if not stream.unused:
            return f"{text}no frame arrived; check power, cable and bit rate"
        if missing := decoder.missing:
            return (
                f"{text}frames arrived, but not message {', '.join(missing)}; check that the unit sends it, and that "
                "the DBC file is that of the unit"
            )
        return (
            f"{text}all of its messages arrived, but none of their cycles is whole; check counter and first in the "
            "bench file"
        )


def _counter(settings: CanSettings, bits: int | None) -> Counter | None:
    if settings.counter is None or bits is None:
        return None
    wrap = settings.counter.wrap or 1 << bits
    return Counter(field=COUNTER, step=settings.counter.step, wrap=wrap)


#: A unit of three messages: two of each cycle, in both byte orders, and a rare one with an extended identifier.
TRIAL_DBC = (resources.files("instruments") / "formats" / "can-imu.dbc").read_text(encoding="utf-8")
TRIAL = {
    "port": "sim://can/mems",
    "dbc": TRIAL_DBC,
    "sample_rate_hz": 100,
    "signals": {
        "gyro_x": "Rates.RateX",
        "gyro_y": "Rates.RateY",
        "gyro_z": "RateAndForce.RateZ",
        "accel_z_g": "RateAndForce.ForceZ",
        "temperature_c": "Housekeeping.Temperature",
    },
    "hold": ["temperature_c"],
    "counter": "Rates.Count",
    "first": "Rates.Count",
    "status": {"Rates.State": "Valid"},
}
DRIVER = GyroDriver(CanSettings, CanGyro, Trial("triaxial-sim", TRIAL))
