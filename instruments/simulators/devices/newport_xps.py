"""A simulated Newport XPS with one group of one rotary positioner: its states, its jog mode and its error codes."""

from __future__ import annotations

import re
from collections.abc import Callable
from weakref import WeakSet

from instruments.simulators.links.replies import TimedReplies
from instruments.simulators.servo_axis import ServoAxis
from instruments.simulators.setup import InstrumentSetup

#: A function and its arguments: nothing else ends a request.
CALL = re.compile(rb"\s*([A-Za-z]\w*)\s*\(([^()]*)\)\s*")
ERROR, NAME, NOT_ALLOWED, RANGE, ARGUMENTS, ABORTED = -4, -19, -22, -17, -9, -27
NOT_INITIALISED, AFTER_ERROR, READY_ABORTED, READY_HOMED, NOT_REFERENCED, HOMING, JOGGING = 0, 2, 10, 11, 42, 43, 47
MAX_DPS, MAX_DPS2, INITIALISATION_S = 720.0, 4000.0, 1.5
LONGEST = 4096


class XpsController:
    """The group, its states and functions, which every link calls."""

    def __init__(self, setup: InstrumentSetup) -> None:
        self.links: WeakSet[SimulatedXps] = WeakSet()
        self.axis, self.faults = ServoAxis(setup, 5001), setup.faults
        self.group = str(self.axis.parameters["group"])
        self.status = NOT_INITIALISED
        self._homed_s = 0.0  #: when the home search is done that was begun last
        self._jog_dps2 = MAX_DPS2
        self._functions: dict[str, Callable[[list[str], float], tuple[int, str, float]]] = {
            "GroupInitialize": self._initialize,
            "GroupHomeSearch": self._home_search,
            "GroupKill": self._kill,
            "GroupJogModeEnable": self._jog_mode_enable,
            "GroupJogModeDisable": self._jog_mode_disable,
            "GroupJogParametersSet": self._jog_parameters_set,
            "GroupMoveAbort": self._move_abort,
            "GroupStatusGet": self._status_get,
            "GroupPositionCurrentGet": self._position_current_get,
            "GroupVelocityCurrentGet": self._velocity_current_get,
        }

    def stall(self, t_s: float) -> None:
        """Drop the motion where a fault says so."""
        if self.faults.trigger(["stall"], t_s) is not None and self.status == JOGGING:
            self.axis.run(t_s, 0.0, MAX_DPS2)
            self.status = AFTER_ERROR

    def result(self, name: str, arguments: list[str], t_s: float) -> tuple[int, str, float]:
        """Return the error code, what is returned, and when the function is done."""
        if self.status == HOMING and t_s >= self._homed_s:
            self.status = READY_HOMED
        if name == "FirmwareVersionGet":
            return 0, "XPS-D Firmware V1.4.1 (simulated)", t_s
        function = self._functions.get(name)
        if function is None:
            return ERROR, "", t_s
        if arguments[0] != self.group:
            return NAME, "", t_s
        return function(arguments[1:], t_s)

    def _initialize(self, _: list[str], t_s: float) -> tuple[int, str, float]:
        if self.status not in {NOT_INITIALISED, AFTER_ERROR}:
            return NOT_ALLOWED, "", t_s
        self.status = NOT_REFERENCED
        return 0, "", t_s + INITIALISATION_S

    def _home_search(self, _: list[str], t_s: float) -> tuple[int, str, float]:
        if self.status != NOT_REFERENCED:
            return NOT_ALLOWED, "", t_s
        self.status, self._homed_s = HOMING, self.axis.search_home(t_s, 100.0)
        return 0, "", self._homed_s

    def _kill(self, _: list[str], t_s: float) -> tuple[int, str, float]:
        for link in self.links:
            link.end_waiting(t_s)
        self.status = NOT_INITIALISED
        self.axis.run(t_s, 0.0, MAX_DPS2)
        return 0, "", t_s

    def _jog_mode_enable(self, _: list[str], t_s: float) -> tuple[int, str, float]:
        if not 10 <= self.status < 20:
            return NOT_ALLOWED, "", t_s
        self.status = JOGGING
        return 0, "", t_s

    def _jog_mode_disable(self, _: list[str], t_s: float) -> tuple[int, str, float]:
        if self.status != JOGGING or self.axis.motion.moving(t_s):
            return NOT_ALLOWED, "", t_s
        self.status = READY_ABORTED
        return 0, "", t_s

    def _jog_parameters_set(self, arguments: list[str], t_s: float) -> tuple[int, str, float]:
        if self.status != JOGGING:
            return NOT_ALLOWED, "", t_s
        try:
            rate, acceleration = (float(argument) for argument in arguments)
        except ValueError:
            return ARGUMENTS, "", t_s
        if abs(rate) > MAX_DPS or not 0 < acceleration <= MAX_DPS2:
            return RANGE, "", t_s
        self._jog_dps2 = acceleration
        self.axis.run(t_s, rate, acceleration)
        return 0, "", t_s

    def _move_abort(self, _: list[str], t_s: float) -> tuple[int, str, float]:
        if self.status != JOGGING:
            return NOT_ALLOWED, "", t_s
        self.status = READY_ABORTED
        self.axis.run(t_s, 0.0, self._jog_dps2)
        return 0, "", t_s

    def _status_get(self, _: list[str], t_s: float) -> tuple[int, str, float]:
        return 0, str(self.status), t_s

    def _position_current_get(self, _: list[str], t_s: float) -> tuple[int, str, float]:
        return 0, f"{self.axis.position_deg(t_s):.9g}", t_s

    def _velocity_current_get(self, _: list[str], t_s: float) -> tuple[int, str, float]:
        return 0, f"{self.axis.rate_dps(t_s):.9g}", t_s


class SimulatedXps(TimedReplies):
    """A link to a controller: it runs one function after the other, whatever the other links do."""

    def __init__(self, setup: InstrumentSetup, controller: XpsController | None = None) -> None:
        super().__init__()
        self._setup = setup
        self.controller = controller or XpsController(setup)
        self.controller.links.add(self)
        self._data = b""
        self._busy_until_s = 0.0

    def connect(self) -> SimulatedXps:
        """Return a further link to the same controller."""
        return SimulatedXps(self._setup, self.controller)

    def receive(self, data: bytes, t_s: float) -> None:
        """Take bytes; a function is run once its bracket closes."""
        self._data = self._data[-LONGEST:] + data
        while (call := CALL.match(self._data)) is not None:
            self._data = self._data[call.end() :]
            self._run(call[1].decode(), [each.strip() for each in call[2].decode("latin-1").split(",")], t_s)

    def end_waiting(self, t_s: float) -> None:
        """End the function that is under way: it answers that it was aborted."""
        if self._busy_until_s > t_s:
            self._busy_until_s = t_s
            self.forget_replies()
            self._reply(t_s, ABORTED, "")

    def _run(self, name: str, arguments: list[str], t_s: float) -> None:
        begin_s, faults = max(t_s, self._busy_until_s), self.controller.faults
        self.controller.stall(t_s)
        lost = faults.trigger(["lost_reply", "silence"], t_s) is not None
        refused = faults.trigger(["refusal"], t_s) is not None
        code, value, done_s = (RANGE, "", begin_s) if refused else self.controller.result(name, arguments, begin_s)
        self._busy_until_s = done_s
        if not lost:
            self._reply(done_s, code, value)

    def _reply(self, done_s: float, code: int, value: str) -> None:
        self.send_in_order(done_s + self.controller.axis.reply_s, f"{code},{value},EndOfAPI".encode())
