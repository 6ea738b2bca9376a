"""Chambers that are spoken to in lines of text: one driver, and the lines of each maker as data."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import replace

from instruments.clock import Clock
from instruments.drivers.chambers.setpoint_chamber import SetpointChamber
from instruments.drivers.driver import ChamberDriver, Trial
from instruments.errors import InstrumentError, RequestRejected
from instruments.protocols.text_lines.chamber_dialects import ESPEC, SIMSERV, THERMOTRON, Dialect, PanelLock
from instruments.protocols.text_lines.chamber_settings import (
    EspecSettings,
    LineChamberSettings,
    SimServSettings,
    ThermotronSettings,
)
from instruments.protocols.text_lines.line_syntax import LineSyntax, Question
from instruments.transport.factory import Ports
from instruments.transport.line_link import LineLink
from instruments.transport.serial_stream import line_of


def open_link(
    device: str, settings: LineChamberSettings, ports: Ports, clock: Clock, syntax: LineSyntax, timeout_s: float = 1.0
) -> LineLink:
    """Return the link of a chamber; nothing is opened yet."""
    return LineLink(
        device, settings.address_url, ports, clock, syntax, baudrate=settings.baudrate, timeout_s=timeout_s,
        line=line_of(settings.options),
    )  # fmt: skip


class TextChamber(SetpointChamber):
    """A chamber on a line link, with a safe state that may be "off"."""

    def __init__(
        self, settings: LineChamberSettings, ports: Ports, clock: Clock, syntax: LineSyntax, timeout_s: float = 1.0
    ) -> None:
        self._lines = open_link(self.name, settings, ports, clock, syntax, timeout_s)
        super().__init__(settings, self._lines, clock)
        self._ends_off = settings.safe_state == "off"

    def make_safe(self) -> float:
        """Set the safe set point, and switch the chamber off where the bench file says so; returns the value read back.

        Raises as `set_temperature_c` does.
        """
        setpoint_c = super().make_safe()
        if self._ends_off:
            self._switch_off()
            self._has_controlled = False  # that the chamber is off is no fault from now on
        return setpoint_c

    @abstractmethod
    def _switch_off(self) -> None:
        """Switch heating and cooling off."""


class LineChamber(TextChamber):
    """Driver of a chamber whose requests and replies are a dialect. `names` fills the braces of its requests."""

    def __init__(
        self,
        settings: LineChamberSettings,
        ports: Ports,
        clock: Clock,
        dialect: Dialect,
        names: dict[str, object],
        *,
        acknowledges: bool = True,
        locks_panel: bool = False,
    ) -> None:
        super().__init__(settings, ports, clock, dialect.syntax)
        self._panel_lock = dialect.panel_lock if locks_panel else None
        self._dialect, self._names, self._acknowledges = dialect, names, acknowledges

    def identify(self) -> str:
        """Get type and maker; raises RequestRejected, MalformedReply, NoReply or LinkError for another device."""
        text = self._ask(self._dialect.identity)
        self._read_air()
        return f"{self._dialect.maker} {text}"

    def set_temperature_c(self, temperature_c: float) -> float:
        """Set the temperature; the panel is locked afterwards where the bench file says so.

        Raises as every chamber does, and RequestRejected where the panel is not locked after the command.
        """
        lock = self._panel_lock
        if lock is None:
            return super().set_temperature_c(temperature_c)
        self._checked(temperature_c)
        self._unlock(lock)  # a protected controller may refuse a set point
        setpoint_c = super().set_temperature_c(temperature_c)
        self._command(lock.lock, "lock its panel")
        if not lock.is_locked(self._ask(lock.question)):
            raise RequestRejected(
                self.name, "the panel is not locked after the command; leave lock_panel out of the bench file"
            )
        return setpoint_c

    def make_safe(self) -> float:
        """Unlock the panel, then bring the chamber to its safe state; returns the value read back.

        A panel that cannot be unlocked keeps no set point from being written. Raises as `set_temperature_c` does.
        """
        failure: InstrumentError | None = None
        if self._panel_lock is not None:
            try:
                self._unlock(self._panel_lock)
            except InstrumentError as error:
                failure = error
        setpoint_c = super().make_safe()
        if failure is not None:
            raise failure
        return setpoint_c

    def _unlock(self, lock: PanelLock) -> None:
        if lock.is_locked(self._ask(lock.question)):
            self._command(lock.unlock, "unlock its panel")

    def _controller_limits(self) -> tuple[float, float]:
        low, high = self._dialect.low, self._dialect.high
        return (
            -float("inf") if low is None else self._ask_c(low),
            float("inf") if high is None else self._ask_c(high),
        )

    def _resolution_c(self) -> float:
        return self._dialect.resolution_c

    def _write_setpoint(self, temperature_c: float) -> None:
        self._command(self._dialect.write, "set the set point", c=temperature_c)

    def _read_setpoint(self) -> float:
        return self._ask_c(self._dialect.setpoint)

    def _read_air(self) -> float:
        return self._ask_c(self._dialect.air)

    def _alarms(self) -> tuple[str, ...]:
        return self._dialect.alarm_texts(self._ask(self._dialect.alarms))

    def _profile_runs(self) -> bool:
        return self._dialect.runs_program(self._ask(self._dialect.program))

    def _end_profile(self) -> None:
        self._command(self._dialect.end_program, "end the program")

    def _stopped(self) -> str:
        return "" if self._dialect.is_running(self._ask(self._dialect.running)) else "the chamber does not run"

    def _start(self) -> None:
        self._command(self._dialect.start, "start")

    def _switch_off(self) -> None:
        self._command(self._dialect.stop, "stop")

    def _ask(self, question: Question) -> str:
        return self._lines.ask(question.send.format(**self._names), question.reply, question.what)["text"].strip()

    def _ask_c(self, question: Question) -> float:
        return float(self._lines.ask(question.send.format(**self._names), question.reply, question.what)["c"])

    def _command(self, command: str, purpose: str, **values: float) -> None:
        line = command.format(**self._names, **values)
        if self._acknowledges:
            self._lines.ask(line, self._dialect.acknowledged, purpose)
        else:
            self._lines.tell(line, purpose)


class Espec(LineChamber):
    """Driver of a chamber on an Espec P-300 or SCP-220."""

    def __init__(self, settings: EspecSettings, ports: Ports, clock: Clock) -> None:
        prefix = "" if settings.unit is None else f"{settings.unit},"
        super().__init__(settings, ports, clock, ESPEC, {"prefix": prefix}, locks_panel=settings.lock_panel)


class SimServ(LineChamber):
    """Driver of a Weiss or Votsch chamber with SimServ."""

    def __init__(self, settings: SimServSettings, ports: Ports, clock: Clock) -> None:
        names: dict[str, object] = {"index": settings.chamber_index, "variable": settings.variable}
        super().__init__(settings, ports, clock, SIMSERV, names)


class Thermotron(LineChamber):
    """Driver of a Thermotron 3800, 8200 or 8800."""

    def __init__(self, settings: ThermotronSettings, ports: Ports, clock: Clock) -> None:
        syntax = replace(THERMOTRON.syntax, pause_s=settings.command_pause_s)
        dialect = replace(THERMOTRON, syntax=syntax)
        names: dict[str, object] = {"channel": settings.channel}
        super().__init__(settings, ports, clock, dialect, names, acknowledges=settings.acknowledges)


ESPEC_DRIVER = ChamberDriver(EspecSettings, Espec, Trial(section={"port": "sim://espec"}))
SIMSERV_DRIVER = ChamberDriver(SimServSettings, SimServ, Trial(section={"port": "sim://weiss-simserv"}))
THERMOTRON_DRIVER = ChamberDriver(ThermotronSettings, Thermotron, Trial(section={"port": "sim://thermotron"}))
