"""Base of the Watlow chamber drivers: a chamber that is given set points, in Modbus registers."""

from __future__ import annotations

from instruments.clock import Clock
from instruments.drivers.chambers.setpoint_chamber import SetpointChamber
from instruments.protocols.watlow_settings import WatlowSettings
from instruments.transport.modbus import Registers

REPLY_S = 1.0


class Watlow(SetpointChamber):
    """A chamber on a Watlow controller."""

    def __init__(self, settings: WatlowSettings, registers: Registers, clock: Clock) -> None:
        super().__init__(settings, registers, clock)
        self.settings = settings
        self._registers = registers
