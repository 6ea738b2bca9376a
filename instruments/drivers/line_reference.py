"""Reference thermometers and hygrometers that are asked by lines of text."""

from __future__ import annotations

from dataclasses import replace

from instruments.clock import Clock
from instruments.drivers.driver import ReferenceDriver, Trial
from instruments.drivers.serial_numbers import refuse_other_serial
from instruments.errors import MalformedReply
from instruments.interfaces.gyro import Channel
from instruments.interfaces.reference import ReferenceState
from instruments.protocols.text_lines.line_syntax import LineSyntax
from instruments.protocols.text_lines.quantity import Quantity
from instruments.protocols.text_lines.reference_lines import LineReferenceSettings
from instruments.transport.factory import Ports
from instruments.transport.line_link import LineLink
from instruments.transport.serial_stream import line_of

#: A precision readout averages for seconds before it answers.
REPLY_S = 3.0


def column_of(settings: LineReferenceSettings, column: str) -> str:
    """Return the column of the recording that a quantity goes to."""
    return settings.columns.get(column, column)


class LineReference:
    """Driver of a readout. A reading is a whole number of its resolution; the certificate's correction is added."""

    def __init__(self, settings: LineReferenceSettings, ports: Ports, clock: Clock) -> None:
        self.name = settings.name
        self.settings = settings
        self._clock, self._model = clock, settings.known
        self.channels: tuple[Channel, ...] = tuple(
            Channel(column_of(settings, name), each.unit, each.resolution, settings.corrections.get(name, 0.0))
            for name, each in self._model.quantities.items()
        )
        described = settings.format
        syntax = LineSyntax() if described is None else described.line.syntax
        reply_s = REPLY_S if described is None else described.line.timeout_s
        self._lines = LineLink(
            self.name, settings.address_url, ports, clock, replace(syntax, end=self._model.end),
            baudrate=self._model.baudrate, timeout_s=reply_s, line=line_of(settings.options),
        )  # fmt: skip

    def identify(self) -> str:
        """Get model, serial number and certificate, after a reading.

        Raises WrongInstrument for another serial number than the bench file's, MalformedReply, NoReply, LinkError.
        """
        identity = ""
        if self._model.identity:
            identity = self._lines.ask(self._model.identity, r".*\S.*", "say what it is")[0]
            refuse_other_serial(self.name, identity, self.settings.serial, holds_serial=True)
        self.read()
        certificate = f"; certificate {self.settings.certificate}" if self.settings.certificate else ""
        return f"{identity or self._model.title}{certificate}"

    def read(self) -> ReferenceState:
        """Get one reading of every quantity; raises MalformedReply for another unit, NoReply, LinkError."""
        raw = {
            channel.name: self._raw(quantity)
            for channel, quantity in zip(self.channels, self._model.quantities.values(), strict=True)
        }
        return ReferenceState(self._clock.now_s(), raw)

    def _raw(self, quantity: Quantity) -> int:
        request = quantity.ask.replace("{input}", str(self.settings.input))
        match = self._lines.ask(request, quantity.pattern, f"read by {request!r}")
        unit_symbol = match.groupdict().get("unit")
        if unit_symbol is not None and unit_symbol != quantity.says_unit:
            raise MalformedReply(
                self.name,
                f"answers in {unit_symbol!r} instead of {quantity.says_unit!r}; set the unit of measurement "
                "at the panel of the instrument",
            )
        return round(float(match["value"]) / quantity.resolution)

    def close(self) -> None:
        """Control the link: close it; safe to call twice."""
        self._lines.close()


DRIVER = ReferenceDriver(
    LineReferenceSettings,
    LineReference,
    Trial(section={"port": "sim://line-reference/reference", "model": "fluke-1529"}),
)
