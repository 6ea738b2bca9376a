"""Driver of any gyro whose stream a format describes: lines of numbers or binary frames."""

from __future__ import annotations

from instruments.clock import Clock
from instruments.drivers.driver import GyroDriver, Trial
from instruments.drivers.streamed_readings import (
    SILENCE_S,
    StreamedGyro,
    StreamedReadings,
    StreamLaw,
    identify_stream,
)
from instruments.interfaces.gyro import Channel, GyroIdentity, GyroLimits
from instruments.protocols.stream_formats.frames import FrameDecoder
from instruments.protocols.stream_formats.lines import LineDecoder
from instruments.protocols.stream_formats.readings import Decoder, pulse_ticks, scale_of, stamp_ticks
from instruments.protocols.stream_formats.settings import StreamSettings
from instruments.transport.factory import Ports
from instruments.transport.serial_stream import SerialStream, line_of


class StreamFormatGyro(StreamedGyro):
    """A gyro that sends readings unasked. Raw values are the whole numbers of the format's fields."""

    def __init__(self, settings: StreamSettings, ports: Ports, clock: Clock) -> None:
        self.name = settings.name
        self.settings = settings
        self._format = format_ = settings.format
        self._baudrate = settings.options.baudrate or format_.baudrate
        self.axes: tuple[str, ...] = tuple(settings.axes)
        self.sample_rate_hz: float = settings.sample_rate_hz or 0.0
        self.limits = GyroLimits(settings.max_rate_dps, settings.min_c, settings.max_c)
        decoder: Decoder = LineDecoder(format_) if format_.line is not None else FrameDecoder(format_)
        unused = {f"gyro_{axis}" for axis in format_.axes} - {f"gyro_{axis}" for axis in self.axes}
        self._fields = [each for each in format_.fields if each.unit is not None and each.name not in unused]
        stream = SerialStream(
            self.name, settings.port or "", ports, clock, baudrate=self._baudrate, timeout_s=SILENCE_S,
            line=line_of(settings.options),
        )  # fmt: skip
        law = StreamLaw(
            self.sample_rate_hz,
            [each.name for each in self._fields],
            format_.counter,
            stamp_ticks(format_),
            pulse_ticks(format_),
        )
        readings = StreamedReadings(self.name, settings.port or "", stream, decoder, law, clock, self._unread)
        super().__init__(stream, readings)

    @property
    def channels(self) -> tuple[Channel, ...]:
        """What a message holds: the fields with a unit, in deg/s, deg C and g."""
        scales = [(each.name, scale_of(each, self.sample_rate_hz)) for each in self._fields]
        return tuple(Channel(name, scale.unit, scale.scale, scale.offset) for name, scale in scales)

    def identify(self) -> GyroIdentity:
        """Get the unit's identity from the bench file, after one message was read.

        Raises WrongInstrument where the port is on another USB adapter than the bench file names, NoReply, LinkError.
        """
        adapter = self.settings.options.adapter
        return identify_stream(self, self.settings, self._stream, (self._format.name, "mems"), adapter=adapter)

    def start(self) -> None:
        """Control the stream: open the port, send what the format sends at the start, drop what is old; LinkError."""
        self._readings.begin([text.encode("latin-1") for text in self._format.start])

    def _unread(self, stream: SerialStream, silence_s: float) -> str:
        port, name = self.settings.port, self._format.name
        advice = stream.advice(f"baud rate {self._baudrate} and that the unit sends what the format says")
        return f"no intact {name} reading on {port} for {silence_s:.1f} s: {advice}"


DRIVER = GyroDriver(
    StreamSettings,
    StreamFormatGyro,
    Trial("triaxial-sim", {"port": "sim://stream-format/mems", "format": "xsens-mti", "sample_rate_hz": 100}),
)
