"""Chamber whose requests and replies a TOML document describes."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from instruments.clock import Clock
from instruments.drivers.chambers.line_chamber import TextChamber
from instruments.drivers.chambers.setpoint_chamber import TINY_C
from instruments.drivers.driver import ChamberDriver, Trial
from instruments.drivers.request_reply.dialogue import NONE, Dialogue
from instruments.errors import RequestRejected
from instruments.protocols.request_reply.chamber import SETPOINT
from instruments.protocols.request_reply.parts import AskNumber
from instruments.protocols.request_reply.settings import DescribedChamberSettings, parameters_of
from instruments.protocols.request_reply.templates import as_written
from instruments.transport.factory import Ports


class DescribedChamber(TextChamber):
    """A chamber by its description. What the description leaves out is not asked: alarms, programs, on and off."""

    def __init__(self, settings: DescribedChamberSettings, ports: Ports, clock: Clock) -> None:
        self._described = described = settings.format
        self._serial = settings.serial
        super().__init__(settings, ports, clock, described.line.syntax, described.line.timeout_s)
        self.switches_on = bool(described.switch_on)
        names = parameters_of(described, settings.parameters)
        self.dialogue = Dialogue(self._lines, described.line, names)

    def identify(self) -> str:
        """Get what the chamber says it is, after a reading of its air.

        Raises WrongInstrument for another instrument, RequestRejected, MalformedReply, NoReply, LinkError.
        """
        text = self.dialogue.identity(self._described.identity, self._serial)
        self._read_air()
        return text

    def make_safe(self) -> float:
        """Bring the chamber to its safe state, then end its remote operation; returns the set point read back.

        What ends the remote operation is sent also where the safe state is refused. Raises as `set_temperature_c`.
        """
        try:
            return super().make_safe()
        finally:
            if self._described.end:
                self.dialogue.command(self._described.end, "end remote operation")
                self.dialogue.ended()

    def _controller_limits(self) -> tuple[float, float]:
        described = self._described
        low = described.min_c if described.low is None else self._ask_c(described.low, "read the lower limit")
        high = described.max_c if described.high is None else self._ask_c(described.high, "read the upper limit")
        return max(low, described.min_c), min(high, described.max_c)

    def _resolution_c(self) -> float:
        return self._described.resolution * self._described.temperature.factor

    def _write_setpoint(self, temperature_c: float) -> None:
        number = self._described.temperature.written(temperature_c)
        self._command(self._described.set, "set the set point", {SETPOINT: number})

    def _write_and_verify(self, rounded_c: float) -> float:
        # the set point that the written text carries: a unit such as deg F has other steps
        scale = self._described.temperature
        carried = as_written(self._described.set, SETPOINT, scale.written(rounded_c))
        carried_c = scale.read(carried)
        if not self.limits.min_c - TINY_C <= carried_c <= self.limits.max_c + TINY_C:
            carried_c -= math.copysign(self.limits.resolution_c, carried_c - rounded_c)
        return super()._write_and_verify(carried_c)

    def _read_setpoint(self) -> float:
        return self._ask_c(self._described.setpoint, "read the set point")

    def _read_air(self) -> float:
        return self._ask_c(self._described.air, "read the air temperature")

    def _alarms(self) -> tuple[str, ...]:
        return () if self._described.alarms is None else self.dialogue.alarms(self._described.alarms)

    def _profile_runs(self) -> bool:
        program = self._described.program
        return program is not None and self.dialogue.holds(program, "read whether a program runs")

    def _end_profile(self) -> None:
        if not self._described.end_program:
            raise RequestRejected(
                self.name,
                "a program runs, and the description does not say how it is ended; end it at the panel of the "
                "controller",
            )
        self._command(self._described.end_program, "end the program")

    def _stopped(self) -> str:
        running = self._described.running
        runs = running is None or self.dialogue.holds(running, "read whether it runs")
        return "" if runs else "the chamber does not run"

    def _start(self) -> None:
        self._command(self._described.switch_on, "switch on")

    def _switch_off(self) -> None:
        self._command(self._described.switch_off, "switch off")

    def _command(self, lines: Sequence[str], purpose: str, values: Mapping[str, object] = NONE) -> None:
        """Send commands; what prepares the chamber goes first, once for each opening of the link."""
        if self.dialogue.is_new:
            self.dialogue.command(self._described.start, "prepare")
        self.dialogue.command(lines, purpose, values)
        self.dialogue.started()

    def _ask_c(self, ask: AskNumber, purpose: str) -> float:
        return round(self._described.temperature.read(self.dialogue.number(ask, purpose)), 9)


DRIVER = ChamberDriver(
    DescribedChamberSettings, DescribedChamber, Trial(section={"port": "sim://thermotron", "format": "thermotron"})
)
