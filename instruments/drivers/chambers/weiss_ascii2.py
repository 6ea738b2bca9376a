"""Weiss and Votsch chambers with the protocol ASCII-2."""

from __future__ import annotations

from instruments.clock import Clock
from instruments.drivers.chambers.line_chamber import TextChamber
from instruments.drivers.driver import ChamberDriver, Trial
from instruments.errors import RequestRejected
from instruments.protocols.text_lines import weiss_ascii2 as ascii2
from instruments.protocols.text_lines.chamber_settings import Ascii2Settings
from instruments.transport.factory import Ports


class WeissAscii2(TextChamber):
    """Driver of a chamber with ASCII-2. A command holds everything, so it is made from what the chamber has now."""

    def __init__(self, settings: Ascii2Settings, ports: Ports, clock: Clock) -> None:
        super().__init__(settings, ports, clock, ascii2.SYNTAX)
        self._start_channel, self._fault = settings.start_channel, settings.alarm_channel
        self._unit = f"${settings.unit:02d}"

    def identify(self) -> str:
        """Get how many values the chamber controls; raises MalformedReply, NoReply or LinkError for another device."""
        status = self._status()
        return f"Weiss/Votsch ASCII-2, {len(status.actual)} values, {len(status.channels)} digital channels"

    def _status(self) -> ascii2.Status:
        return ascii2.parse(self._lines.ask(f"{self._unit}I", ascii2.STATUS, "read values and digital channels"))

    def _controller_limits(self) -> tuple[float, float]:
        return -float("inf"), float("inf")  # the protocol does not tell them

    def _resolution_c(self) -> float:
        return ascii2.RESOLUTION_C

    def _command(self, temperature_c: float, *, on: bool, status: ascii2.Status) -> None:
        arguments = status.commanded(temperature_c, self._start_channel, on=on)
        self._lines.ask(f"{self._unit}E {arguments}", ascii2.ACKNOWLEDGED, "set the set point")

    def _write_setpoint(self, temperature_c: float) -> None:
        status = self._status()
        self._command(temperature_c, on=status.is_on(self._start_channel), status=status)

    def _read_setpoint(self) -> float:
        return self._status().nominal[0]

    def _read_air(self) -> float:
        return self._status().actual[0]

    def _alarms(self) -> tuple[str, ...]:
        status = self._status()
        return () if self._fault is None or not status.is_on(self._fault) else (f"digital channel {self._fault} is on",)

    def _profile_runs(self) -> bool:
        return False  # the protocol does not tell; a set point that a program changes is seen when it is read back

    def _end_profile(self) -> None:
        raise RequestRejected(
            self.name,
            "a program is running, and protocol ASCII-2 has no command to end it; end it at the panel of the chamber",
        )

    def _stopped(self) -> str:
        channel = self._start_channel
        return "" if self._status().is_on(channel) else f"the chamber does not run (digital channel {channel} is off)"

    def _start(self) -> None:
        status = self._status()
        self._command(status.nominal[0], on=True, status=status)

    def _switch_off(self) -> None:
        status = self._status()
        self._command(status.nominal[0], on=False, status=status)


DRIVER = ChamberDriver(Ascii2Settings, WeissAscii2, Trial(section={"port": "sim://weiss-ascii2"}))
