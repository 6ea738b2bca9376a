"""Driver of any gyro whose stream a format describes: lines of numbers or binary frames."""

from __future__ import annotations

from instruments.clock import Clock
from instruments.drivers.driver import GyroDriver, Trial
from instruments.drivers.streamed_readings import SILENCE_S, StreamedReadings, StreamLaw
from instruments.interfaces.gyro import Channel, GyroIdentity, GyroLimits, Readings
from instruments.protocols.stream_formats.frames import FrameDecoder
from instruments.protocols.stream_formats.lines import LineDecoder
from instruments.protocols.stream_formats.readings import Decoder, scale_of, stamp_ticks
from instruments.protocols.stream_formats.settings import StreamSettings
from instruments.transport.adapters import require_adapter
from instruments.transport.factory import Ports
from instruments.transport.serial_stream import SerialStream, line_of


class StreamFormatGyro:
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
        self._fields = [field for field in format_.fields if field.unit is not None and field.name not in unused]
        self._stream = SerialStream(
            self.name, settings.port or "", ports, clock, baudrate=self._baudrate, timeout_s=SILENCE_S,
            line=line_of(settings.options),
        )  # fmt: skip
        law = StreamLaw(
            self.sample_rate_hz, [field.name for field in self._fields], format_.counter, stamp_ticks(format_)
        )
        self._readings = StreamedReadings(
            self.name, settings.port or "", self._stream, decoder, law, clock, self._unread
        )  # fmt: skip

    @property
    def channels(self) -> tuple[Channel, ...]:
        """What a message holds: the fields with a unit, in deg/s, deg C and g."""
        scales = [(field.name, scale_of(field, self.sample_rate_hz)) for field in self._fields]
        return tuple(Channel(name, scale.unit, scale.scale, scale.offset) for name, scale in scales)

    def identify(self) -> GyroIdentity:
        """Get the unit's identity from the bench file, after one message was read.

        Raises WrongInstrument where the port is on another USB adapter than the bench file names, NoReply, LinkError.
        """
        settings = self.settings
        adapter = require_adapter(self.name, settings.port, settings.options.adapter)
        was_open = self._stream.is_open
        self.start()
        self.read_latest()
        if not was_open:
            self.stop()
        return GyroIdentity(
            settings.serial, settings.model or self._format.name, settings.technology or "mems", settings.datasheet,
            reported=adapter,
        )  # fmt: skip

    def start(self) -> None:
        """Open the port, send what the format sends at the start, drop what is old; LinkError."""
        self._readings.begin([text.encode("latin-1") for text in self._format.start])

    def read(self, duration_s: float) -> Readings:
        """Get every reading of the next `duration_s` seconds; fewer where messages are missing.

        Raises NoReply after SILENCE_S, or five sampling periods, without a reading; MalformedReply for a counter that
        stands; WrongInstrument for another rate; LinkError.
        """
        return self._readings.read(duration_s)

    def read_latest(self) -> Readings:
        """Get one fresh reading and drop everything older; raises NoReply after SILENCE_S, LinkError."""
        return self._readings.read_latest()

    def stop(self) -> None:
        """Close the port; safe to call twice."""
        self._stream.close()

    @property
    def is_late(self) -> bool:
        """Get whether the stream is too far behind the clock, so that readings may be lost."""
        return self._readings.is_late

    def _unread(self, stream: SerialStream, silence_s: float) -> str:
        port, name = self.settings.port, self._format.name
        advice = stream.advice(f"baud rate {self._baudrate} and that the unit sends what the format says")
        return f"no intact {name} reading on {port} for {silence_s:.1f} s: {advice}"


DRIVER = GyroDriver(
    StreamSettings,
    StreamFormatGyro,
    Trial("triaxial-sim", {"port": "sim://stream-format/mems", "format": "xsens-mti", "sample_rate_hz": 100}),
)
