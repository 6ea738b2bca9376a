"""A simulated Aerotech Ensemble with one rotary axis: its ASCII commands, status word and faults."""

from __future__ import annotations

import re
from collections.abc import Callable

from instruments.simulators.links.replies import TimedReplies
from instruments.simulators.servo_axis import ServoAxis
from instruments.simulators.setup import InstrumentSetup

DONE, INVALID, FAULT = "%", "!", "#"
ENABLED, HOMED, IN_POSITION, MOVE_ACTIVE, CLOCKWISE = 1 << 0, 1 << 1, 1 << 2, 1 << 3, 1 << 9
POSITION_ERROR = 1 << 0
MAX_DPS = 1080.0
NUMBER = r"[-+]?\d+\.?\d*"
LONGEST = 1024
#: A command as it was found, and when; its reply, and when it is done.
Act = Callable[[re.Match[str], float], tuple[str, float]]


class SimulatedEnsemble(TimedReplies):
    """One controller, its axis by number or name; a line feed ends a command."""

    def __init__(self, setup: InstrumentSetup) -> None:
        super().__init__()
        self.axis, self.faults = ServoAxis(setup, 8000), setup.faults
        self.number = str(self.axis.parameters["axis"])
        self.status, self.fault = 0, 0
        self.waits = True  #: whether a command is answered when what it does is done
        self._ramp_dps2, self._abort_dps2 = 50.0, 200.0
        self._done_s = 0.0
        self._rate_dps = 0.0
        self._line = b""
        self._commands = self._compiled()

    def receive(self, data: bytes, t_s: float) -> None:
        """Take bytes; a command is executed when its line ends."""
        *lines, self._line = (self._line[-LONGEST:] + data).split(b"\n")
        for line in lines:
            if text := line.decode("latin-1").strip():
                self._answer(text, t_s)

    def _answer(self, text: str, t_s: float) -> None:
        if self.faults.trigger(["stall"], t_s) is not None:
            self.fault, self.status = POSITION_ERROR, self.status & ~ENABLED
            self._turn(0.0, t_s, self._abort_dps2)
        lost = self.faults.trigger(["lost_reply", "silence"], t_s) is not None
        if self.faults.trigger(["refusal"], t_s) is not None:
            reply, done_s = FAULT, t_s
        else:
            reply, done_s = self._execute(text, t_s)
        if not lost:
            self.send_in_order(done_s + self.axis.reply_s, f"{reply}\n".encode())

    def _execute(self, text: str, t_s: float) -> tuple[str, float]:
        """Return the reply and when the command is done."""
        for pattern, act in self._commands:
            if match := pattern.fullmatch(text):
                return act(match, t_s)
        return INVALID, t_s

    def _compiled(self) -> list[tuple[re.Pattern[str], Act]]:
        """Return what each command does: its text, in which {axis} and {number} stand for theirs."""
        acts: dict[str, Act] = {
            r"WAIT MODE (NOWAIT|MOVEDONE)": self._wait_mode,
            r"RAMP MODE {axis} RATE": lambda _, t_s: (DONE, t_s),
            r"RAMP RATE {axis} {number}": self._ramp_rate,
            r"SETPARM {axis}, *73, *{number}": self._abort_rate,
            r"GETPARM\({axis}, *140\)": lambda _, t_s: (f"{DONE}TABLE", t_s),
            r"(AXISSTATUS|AXISFAULT|PFBKPROG|VFBK)\({axis}\)": lambda match, t_s: (
                DONE + self._value(match[1], t_s),
                t_s,
            ),
            r"FAULTACK {axis}": self._acknowledge,
            r"ENABLE {axis}": self._enable,
            r"ABORT {axis}": self._abort,
            r"FREERUN {axis} {number}": self._freerun,
            r"HOME {axis}": self._home,
        }
        axis = rf"@{re.escape(self.number)}(?!\d)"
        named = {text.replace("{axis}", axis).replace("{number}", f"({NUMBER})"): act for text, act in acts.items()}
        return [(re.compile(text), act) for text, act in named.items()]

    def _wait_mode(self, match: re.Match[str], t_s: float) -> tuple[str, float]:
        self.waits = match[1] != "NOWAIT"
        return DONE, t_s

    def _ramp_rate(self, match: re.Match[str], t_s: float) -> tuple[str, float]:
        self._ramp_dps2 = float(match[1])
        return DONE, t_s

    def _abort_rate(self, match: re.Match[str], t_s: float) -> tuple[str, float]:
        self._abort_dps2 = float(match[1])
        return DONE, t_s

    def _value(self, name: str, t_s: float) -> str:
        if name == "AXISSTATUS":
            moves = self.axis.motion.moving(t_s) or self._rate_dps
            backwards = CLOCKWISE if self._rate_dps < 0 else 0
            return str(self.status | backwards | (MOVE_ACTIVE if moves else IN_POSITION))
        if name == "AXISFAULT":
            return str(self.fault)
        return f"{self.axis.position_deg(t_s) if name == 'PFBKPROG' else self.axis.rate_dps(t_s):.6f}"

    def _acknowledge(self, _: re.Match[str], t_s: float) -> tuple[str, float]:
        self.fault = 0
        return DONE, t_s

    def _enable(self, _: re.Match[str], t_s: float) -> tuple[str, float]:
        if self.fault:
            return FAULT, t_s
        self.status |= ENABLED
        return DONE, t_s

    def _abort(self, _: re.Match[str], t_s: float) -> tuple[str, float]:
        done_s = self._turn(0.0, t_s, self._abort_dps2)
        return DONE, done_s if self.waits else t_s

    def _freerun(self, match: re.Match[str], t_s: float) -> tuple[str, float]:
        rate_dps = float(match[1])
        if not self._can_move or abs(rate_dps) > MAX_DPS:
            return FAULT, t_s
        self._turn(rate_dps, t_s, self._ramp_dps2)
        return DONE, t_s

    def _home(self, _: re.Match[str], t_s: float) -> tuple[str, float]:
        """Home; it answers when it is there, in any wait mode."""
        if not self._can_move:
            return FAULT, t_s
        self.status |= HOMED
        return DONE, self.axis.search_home(t_s, self._ramp_dps2)

    @property
    def _can_move(self) -> bool:
        return not self.fault and bool(self.status & ENABLED)

    def _turn(self, rate_dps: float, t_s: float, ramp_dps2: float) -> float:
        self._rate_dps = rate_dps
        return self.axis.run(t_s, rate_dps, ramp_dps2)
