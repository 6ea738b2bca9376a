"""Chambers that are spoken to in lines of text, as data: Espec P-300 and SCP-220, Weiss and Votsch SimServ, Thermotron.

One driver (`instruments.drivers.chambers.line_chamber`) serves them all. Facts are from public code, named at each.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from instruments.protocols.text_lines.line_syntax import LineSyntax, Question

NUMBER = r"\s*[-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?\s*"
C = rf"(?P<c>{NUMBER})"


@dataclass(frozen=True)
class PanelLock:
    """Protection of the panel against changes."""

    lock: str
    unlock: str
    question: Question  #: group `text`
    is_locked: Callable[[str], bool]


@dataclass(frozen=True)
class Dialect:
    """What a chamber is asked and commanded, and what its replies mean."""

    maker: str
    source: str
    syntax: LineSyntax
    identity: Question  #: group `text`
    air: Question  #: group `c`
    setpoint: Question  #: group `c`
    low: Question | None  #: group `c`; None: the chamber does not say
    high: Question | None
    program: Question  #: group `text`
    runs_program: Callable[[str], bool]
    running: Question  #: group `text`
    is_running: Callable[[str], bool]
    alarms: Question  #: group `text`
    alarm_texts: Callable[[str], tuple[str, ...]]
    write: str  #: sets the set point `c`
    start: str
    stop: str
    end_program: str
    acknowledged: str  #: pattern of the reply to a command
    resolution_c: float = 0.1
    panel_lock: PanelLock | None = None  #: None: none is documented


def _espec_alarms(text: str) -> tuple[str, ...]:
    """Return the alarms of a reply `2,1,7`: how many, and their codes."""
    return tuple(f"alarm {code.strip()}" for code in text.split(",")[1:])


ESPEC = Dialect(
    maker="Espec",
    source="EspecNorthAmerica/ChamberConnectLibrary 1d2deb8: p300.py, scp220.py, especinteract.py",
    syntax=LineSyntax(
        refusal=r"NA:\s*(?P<why>.*)",
        reasons=(
            ("CMD ERR", "unknown command"),
            ("ADDR ERR", "wrong unit number"),
            ("CONT NOT READY-1", "the chamber has no such control"),
            ("CONT NOT READY-2", "no program runs"),
            ("CONT NOT READY-3", "the controller has no such command"),
            ("CONT NOT READY-4", "the panel cannot be locked while the controller is off"),
            ("DATA OUT OF RANGE", "the value is out of its range"),
            ("PARA ERR", "a parameter is missing or unknown"),
            ("PROTECT ON", "its panel is protected against changes"),
            ("INVALID REQ", "the controller has no such command"),
            ("CHB NOT READY", "the chamber is not ready"),
        ),
    ),
    identity=Question("{prefix}TYPE?", rf"(?P<text>[^,]+(?:,[^,]+){{1,2}}),{NUMBER}", "read its type"),
    air=Question("{prefix}TEMP?", rf"{C},{NUMBER},{NUMBER},{NUMBER}", "read the air temperature"),
    setpoint=Question("{prefix}TEMP?", rf"{NUMBER},{C},{NUMBER},{NUMBER}", "read the set point"),
    low=Question("{prefix}TEMP?", rf"{NUMBER},{NUMBER},{NUMBER},{C}", "read the lower limit"),
    high=Question("{prefix}TEMP?", rf"{NUMBER},{NUMBER},{C},{NUMBER}", "read the upper limit"),
    program=Question("{prefix}MODE?", r"(?P<text>[A-Z ]+)", "read its mode"),
    runs_program=lambda mode: mode.removeprefix("RMT ").startswith("RUN"),
    running=Question("{prefix}MODE?", r"(?P<text>[A-Z ]+)", "read its mode"),
    is_running=lambda mode: mode == "CONSTANT",
    alarms=Question("{prefix}ALARM?", r"(?P<text>\d+(?:,\s*\d+)*)", "read the alarms"),
    alarm_texts=_espec_alarms,
    write="{prefix}TEMP, S{c:.1f}",
    start="{prefix}MODE,CONSTANT",
    stop="{prefix}MODE,STANDBY",
    end_program="{prefix}MODE,STANDBY",
    acknowledged=r"OK:.*",
    panel_lock=PanelLock(
        "{prefix}KEYPROTECT,ON",
        "{prefix}KEYPROTECT,off",
        Question("{prefix}KEYPROTECT?", r"(?P<text>ON|OFF|on|off)", "read whether its panel is locked"),
        lambda state: state.upper() == "ON",
    ),
)

_SIMSERV_OK = "1\u00b6"
SIMSERV_ALARM = 8  #: in the chamber's status; 1: idle, 2: a test runs, 4: a warning
SIMSERV = Dialect(
    maker="Weiss/Votsch SimServ",
    source="IzaakWN/ClimateChamberMonitor 858ca67 chamber_commands.py; SiLab-Bonn/basil 85c4116 HL/weiss_labevent.py",
    syntax=LineSyntax(
        end="\r",
        encoding="latin-1",  # its separator is byte B6
        refusal=r"(?P<why>-\d+)(?:\u00b6.*)?",
        reasons=(
            ("-5", "unknown command number"),
            ("-6", "a parameter is wrong or missing"),
            ("-8", "the value cannot be read"),
        ),
    ),
    identity=Question("99997\u00b6{index}\u00b61", _SIMSERV_OK + r"(?P<text>.+)", "read its type"),
    air=Question("11004\u00b6{index}\u00b6{variable}", _SIMSERV_OK + C, "read the air temperature"),
    setpoint=Question("11002\u00b6{index}\u00b6{variable}", _SIMSERV_OK + C, "read the set point"),
    low=Question("11007\u00b6{index}\u00b6{variable}", _SIMSERV_OK + C, "read the lower limit"),
    high=Question("11009\u00b6{index}\u00b6{variable}", _SIMSERV_OK + C, "read the upper limit"),
    program=Question("19210\u00b6{index}", _SIMSERV_OK + r"(?P<text>\d+)", "read whether a program runs"),
    runs_program=lambda status: status != "0",
    running=Question("14003\u00b6{index}\u00b61", _SIMSERV_OK + r"(?P<text>\d+)", "read whether it runs"),
    is_running=lambda state: state != "0",
    alarms=Question("10012\u00b6{index}", _SIMSERV_OK + r"(?P<text>\d+)", "read its status"),
    alarm_texts=lambda status: ("the controller reports an alarm",) if int(status) & SIMSERV_ALARM else (),
    write="11001\u00b6{index}\u00b6{variable}\u00b6{c:.1f}",
    start="14001\u00b6{index}\u00b61\u00b61",
    stop="14001\u00b6{index}\u00b61\u00b60",
    end_program="19015\u00b6{index}",
    acknowledged=r"1(?:\u00b6.*)?",
)

#: Bits of a Thermotron's mode.
THERMOTRON_PROGRAM, THERMOTRON_HELD, THERMOTRON_MANUAL, THERMOTRON_DELAYED = 1, 8, 16, 32
#: Bits of its alarm status.
THERMOTRON_ALARMS = {1: "low deviation", 2: "high deviation", 16: "low process", 32: "high process"}


def _thermotron_alarms(text: str) -> tuple[str, ...]:
    bits = int(float(text))
    return tuple(f"{name} alarm" for bit, name in THERMOTRON_ALARMS.items() if bits & bit)


_CODE = r"(?P<text>\d+)\.?"
THERMOTRON = Dialect(
    maker="Thermotron",
    source="Thermotron, Interface Command Descriptions (8800); pymeasure 32503b8 thermotron3800.py",
    syntax=LineSyntax(refusal=r"(?P<why>[1-9]\d*)\.?", reasons=()),
    identity=Question("IDEN?", r"(?P<text>.+)", "read its type"),
    air=Question("PVAR{channel}?", C, "read the air temperature"),
    setpoint=Question("SETP{channel}?", C, "read the set point"),
    low=None,
    high=None,
    program=Question("MODE?", _CODE, "read its mode"),
    runs_program=lambda mode: bool(int(mode) & (THERMOTRON_PROGRAM | THERMOTRON_HELD | THERMOTRON_DELAYED)),
    running=Question("MODE?", _CODE, "read its mode"),
    is_running=lambda mode: bool(int(mode) & THERMOTRON_MANUAL),
    alarms=Question("ALRM{channel}?", _CODE, "read the alarms"),
    alarm_texts=_thermotron_alarms,
    write="SETP{channel},{c:.1f}",
    start="RUNM",
    stop="STOP",
    end_program="STOP",
    acknowledged=r"0\.?",
)
