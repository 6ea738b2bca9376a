"""Reference thermometers and hygrometers of PyMeasure and MSL-Equipment."""

from __future__ import annotations

from instruments.clock import Clock
from instruments.drivers.driver import ReferenceDriver, Trial
from instruments.drivers.library_instrument import LibraryInstrument
from instruments.drivers.serial_numbers import refuse_other_serial
from instruments.interfaces.gyro import Channel
from instruments.interfaces.reference import ReferenceState
from instruments.protocols.library_settings import LibraryReferenceSettings
from instruments.transport.factory import Ports


class LibraryReference:
    """Driver of an instrument that another library reads."""

    def __init__(self, settings: LibraryReferenceSettings, ports: Ports, clock: Clock) -> None:
        self.name, self.settings, self._clock = settings.name, settings, clock
        self.channels: tuple[Channel, ...] = tuple(
            Channel(settings.columns.get(name, name), each.unit, each.resolution, settings.corrections.get(name, 0.0))
            for name, each in settings.reads.items()
        )
        self._instrument = LibraryInstrument(self.name, settings, ports, clock)

    def identify(self) -> str:
        """Get what the instrument says of itself; raises WrongInstrument for another serial number, InstrumentError."""
        settings, identity = self.settings, self._instrument.identity()
        refuse_other_serial(self.name, identity, settings.serial, holds_serial=bool(settings.identity))
        self.read()
        certificate = f"; certificate {settings.certificate}" if settings.certificate else ""
        return f"{settings.instrument} of {settings.library} {identity}".strip() + certificate

    def read(self) -> ReferenceState:
        """Get one reading of every quantity; raises InstrumentError."""
        raw = {
            channel.name: round(self._instrument.number(quantity.attribute) / quantity.resolution)
            for channel, quantity in zip(self.channels, self.settings.reads.values(), strict=True)
        }
        return ReferenceState(self._clock.now_s(), raw)

    def close(self) -> None:
        """Control the link: close it; safe to call twice."""
        self._instrument.close()


DRIVER = ReferenceDriver(
    LibraryReferenceSettings,
    LibraryReference,
    Trial(section={"instrument": "pymeasure.instruments.fluke:Fluke7341", "port": "sim://fluke-7341/reference"}),
)
