"""Simulated chambers that speak lines of text, on the world's chamber; written from the makers' commands."""

from __future__ import annotations

import re
from collections.abc import Callable

from instruments.bench_config import part_of
from instruments.protocols.text_lines import weiss_ascii2 as ascii2
from instruments.protocols.text_lines.chamber_dialects import (
    ESPEC,
    SIMSERV,
    SIMSERV_ALARM,
    THERMOTRON,
    THERMOTRON_MANUAL,
    THERMOTRON_PROGRAM,
)
from instruments.protocols.text_lines.chamber_settings import Ascii2Settings, EspecSettings, ThermotronSettings
from instruments.simulators.chamber_state import ChamberState
from instruments.simulators.links.line_device import LineDevice
from instruments.simulators.setup import InstrumentSetup

SEPARATOR = "\u00b6"


class SimulatedEspec(LineDevice):
    """An Espec P-300. While its panel is locked it refuses changes: whether a real one does is not known."""

    def __init__(self, setup: InstrumentSetup) -> None:
        super().__init__(ESPEC.syntax, setup.faults)
        address = part_of(setup.instrument("chamber"), EspecSettings).unit
        self._prefix = "" if address is None else f"{address},"
        self.chamber = ChamberState(setup)
        self.is_locked = False

    def answer(self, request: str, t_s: float) -> str | None:
        """Return the reply to a request; a request to another unit gets none."""
        if not request.startswith(self._prefix):
            return None
        request, chamber = request.removeprefix(self._prefix), self.chamber
        limits = f"{chamber.max_c:.1f},{chamber.min_c:.1f}"
        values: dict[str, Callable[[], str]] = {
            "TYPE?": lambda: f"T,P300,{chamber.max_c:.1f}",
            "TEMP?": lambda: f"{chamber.air_c(t_s):.1f},{chamber.setpoint_c:.1f},{limits}",
            "MODE?": lambda: "RUN" if chamber.program else "CONSTANT" if chamber.runs else "STANDBY",
            "ALARM?": lambda: ",".join(str(alarm) for alarm in (len(chamber.alarms), *chamber.alarms)),
            "KEYPROTECT?": lambda: "ON" if self.is_locked else "OFF",
        }
        return values[request]() if request in values else self._command(request, t_s)

    def _command(self, request: str, t_s: float) -> str:
        if (match := re.fullmatch(r"KEYPROTECT,(ON|OFF)", request, re.IGNORECASE)) is not None:
            if match[1].upper() == "ON" and not self.chamber.runs:
                return "NA:CONT NOT READY-4"
            self.is_locked = match[1].upper() == "ON"
            return f"OK:{request}"
        if self.is_locked:
            return "NA:PROTECT ON"
        if (match := re.fullmatch(r"TEMP, S(-?\d+\.\d)", request)) is not None:
            return f"OK:{request}" if self.chamber.set(float(match[1]), t_s) else "NA:DATA OUT OF RANGE"
        if (match := re.fullmatch(r"MODE,(CONSTANT|STANDBY|OFF)", request)) is not None:
            self.chamber.run(t_s, on=match[1] == "CONSTANT")
            return f"OK:{request}"
        return "NA:CMD ERR"


class SimulatedSimServ(LineDevice):
    """A Weiss chamber with SimServ."""

    def __init__(self, setup: InstrumentSetup) -> None:
        super().__init__(SIMSERV.syntax, setup.faults)
        self.chamber = ChamberState(setup)

    def answer(self, request: str, t_s: float) -> str | None:
        """Return the reply to a request: 1 and the values, or a negative number."""
        command, *arguments = request.split(SEPARATOR)
        chamber = self.chamber
        values: dict[str, Callable[[], str]] = {
            "99997": lambda: "LabEvent T/210/70/5",
            "10012": lambda: str((3 if chamber.runs else 1) + (SIMSERV_ALARM if chamber.alarms else 0)),
            "11004": lambda: f"{chamber.air_c(t_s):.4f}",
            "11002": lambda: f"{chamber.setpoint_c:.1f}",
            "11007": lambda: f"{chamber.min_c:.1f}",
            "11009": lambda: f"{chamber.max_c:.1f}",
            "19210": lambda: "1" if chamber.program else "0",
            "14003": lambda: "1" if chamber.runs else "0",
        }
        if command in values and arguments[:1] == ["1"]:
            return f"1{SEPARATOR}{values[command]()}"
        if command == "11001" and arguments[:2] == ["1", "1"]:
            return "1" if chamber.set(float(arguments[2]), t_s) else "-6"
        if command == "14001" and arguments[:2] == ["1", "1"]:
            chamber.run(t_s, on=arguments[2] == "1")
            return "1"
        if command == "19015":
            chamber.program = False
            return "1"
        return "-5"


class SimulatedAscii2(LineDevice):
    """A Weiss chamber with ASCII-2: temperature, humidity, fan and four measured values."""

    reply_end = "\r"
    UNUSED = (0.0, 0.0, 90.0, 90.0, 0.0, 23.8, 0.0, 22.2, 0.0, 25.5, 0.0, 24.4)

    def __init__(self, setup: InstrumentSetup) -> None:
        super().__init__(ascii2.SYNTAX, setup.faults)
        settings = part_of(setup.instrument("chamber"), Ascii2Settings)
        self._unit, self._start, self._fault = f"${settings.unit:02d}", settings.start_channel, settings.alarm_channel
        self.chamber = ChamberState(setup)
        self.others = "0" * 32  #: the digital channels; those of start and fault are put in

    def answer(self, request: str, t_s: float) -> str | None:
        """Return the reply to a request; a request to another unit gets none."""
        if not request.startswith(self._unit):
            return None
        chamber = self.chamber
        if request == f"{self._unit}I":
            values = (chamber.setpoint_c, chamber.air_c(t_s), *self.UNUSED)
            return " ".join([*(ascii2.number(value) for value in values), self._channels()])
        pattern = re.escape(self._unit) + r"E (-?\d+\.\d)(?: \d+\.\d){6} ([01]{32})"
        if (match := re.fullmatch(pattern, request)) is None:
            return f"'{request}' is an unknown command."
        self.others = match[2]
        on = self.others[self._start] == "1"
        if on != chamber.runs:
            chamber.run(t_s, on=on)
        return "0" if chamber.setpoint_c == float(match[1]) or chamber.set(float(match[1]), t_s) else "6"

    def _channels(self) -> str:
        channels = list(self.others)
        channels[self._start] = "1" if self.chamber.runs else "0"
        if self._fault is not None:
            channels[self._fault] = "1" if self.chamber.alarms else "0"
        return "".join(channels)


class SimulatedThermotron(LineDevice):
    """A Thermotron 8800, or a 3800 that answers no command."""

    def __init__(self, setup: InstrumentSetup) -> None:
        super().__init__(THERMOTRON.syntax, setup.faults)
        settings = part_of(setup.instrument("chamber"), ThermotronSettings)
        acknowledges = setup.world.settings.chamber.get("acknowledges", settings.acknowledges)
        self._channel, self._acknowledges = settings.channel, bool(acknowledges)
        self.chamber = ChamberState(setup)

    def answer(self, request: str, t_s: float) -> str | None:
        """Return the reply to a request: the value, or 0 for a command that was done."""
        chamber, n = self.chamber, self._channel
        mode = THERMOTRON_PROGRAM if chamber.program else THERMOTRON_MANUAL if chamber.runs else 2
        values: dict[str, Callable[[], str]] = {
            "IDEN?": lambda: "THERMOTRON 8800",
            f"PVAR{n}?": lambda: f"{chamber.air_c(t_s):.1f}",
            f"SETP{n}?": lambda: f"{chamber.setpoint_c:.1f}",
            "MODE?": lambda: str(mode),
            f"ALRM{n}?": lambda: str(sum(set(chamber.alarms))),
        }
        if request in values:
            return values[request]()
        done = self._command(request, t_s)
        return ("0" if done else "3") if self._acknowledges else None

    def _command(self, request: str, t_s: float) -> bool:
        if request in ("RUNM", "STOP"):
            self.chamber.run(t_s, on=request == "RUNM")
            return True
        match = re.fullmatch(rf"SETP{self._channel},(-?\d+(?:\.\d+)?)", request)
        return match is not None and self.chamber.set(float(match[1]), t_s)
