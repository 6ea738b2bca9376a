"""Arrick rate table on a C4 serial controller: finite moves of whole steps are the only confirmed motion commands.

A constant rate is one long move at a speed that was programmed before. The speed command is not public: it is a
template of the bench file, and without it the driver refuses to turn. The reference rate follows from the whole divisor
of the step clock: it is exact against the controller's own clock, and it is never the requested rate.
"""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import dataclass

from instruments.clock import Clock, sleep_until
from instruments.drivers import arrick_c4_checks as checks
from instruments.drivers import probes
from instruments.drivers.arrick_c4_link import LATE_LETTERS, C4Link
from instruments.drivers.driver import TableDriver
from instruments.errors import MalformedReply, NoReply, RequestRejected, WrongInstrument
from instruments.interfaces.table import HomeCheck, Spin, StepClock, TableLimits, TimedRun, Wait
from instruments.protocols import arrick_c4_lines as lines
from instruments.protocols.arrick_c4_moves import SPARE_S, Move, finite_move, plan_move
from instruments.protocols.arrick_c4_settings import ArrickC4Settings
from instruments.transport.factory import Ports

HOME_S = 120.0
#: A move may end this much earlier or later than computed, s and share of its duration; beyond it, steps were lost or
#: the step clock differs from the bench file.
END_TOLERANCE_S = 2.0
END_TOLERANCE_SHARE = 0.02
POLL_S = 0.2


@dataclass(frozen=True)
class ActiveMove:
    """A move that the controller executes since `start_s`, clock time."""

    move: Move
    start_s: float

    def steady_elapsed_s(self, now_s: float) -> float:
        """Return how much of the steady part is over at `now_s`, s."""
        return min(max(now_s - self.start_s - self.move.ramp_s, 0.0), self.move.steady_s)


class ArrickC4:
    """Driver of an Arrick table. The angle is counted in steps since home."""

    def __init__(self, settings: ArrickC4Settings, ports: Ports, clock: Clock) -> None:
        self.name = "table"
        self.settings = settings
        self._step_deg = 360.0 / settings.steps_per_turn
        self.limits = TableLimits(
            settings.max_rate_dps,
            settings.acceleration_dps2,
            self._step_deg,
            clock_run_s=settings.clock_run_s,
            clock_limit_ppm=settings.clock_limit_ppm,
            checks_home=settings.check_home,
        )
        self.step_clock = StepClock(settings.step_clock_hz, settings.clock_u_ppm)
        self._true = settings  #: with the step clock as it was measured
        self._clock = clock
        self._link = C4Link(self.name, settings, ports, clock, self._forget_programming)
        self._divisor: int | None = None
        self._ramp_set = False
        self._steps = 0.0
        self._active: ActiveMove | None = None
        self._counted = False  #: whether `_steps` is where the table is
        self._homing: checks.Homing | None = None

    def identify(self) -> str:
        """Get what the controller says it is (`!1fp`, a text that begins with C4).

        Raises WrongInstrument, NoReply, LinkError.
        """
        self._discard_late_replies()
        self._command(lines.IDENTIFY)
        text = self._link.read_line()
        if not text.startswith(lines.IDENTITY_PREFIX):
            advice = lines.ECHO_ADVICE if lines.is_echo(text) else "check the name of the port and the baud rate"
            raise WrongInstrument(
                self.name,
                f"{self.settings.port} answered {text!r}, which is not the answer of a C4 controller; {advice}",
            )
        return text

    def achievable_dps(self, rate_dps: float) -> float:
        """Get the rate that the nearest whole divisor of the step clock gives, deg/s; raises LimitError."""
        self.limits.require_rate(self.name, rate_dps)
        if rate_dps == 0:
            return 0.0
        move = plan_move(self._true, rate_dps, 1.0)
        return math.copysign(move.step_hz * self._step_deg, rate_dps)

    def home(self) -> None:
        """Turn the table to its home switch (`!1h1`, one `o`); the angle is 0 deg there.

        Raises RequestRejected, NoReply, LinkError.
        """
        self._begin_homing()
        self._end_homing(HOME_S)

    def spin(self, rate_dps: float, steady_s: float) -> Spin:
        """Turn the table at a constant rate, deg/s, for at least `steady_s` seconds; returns when it is steady.

        Raises LimitError (nothing was sent), RequestRejected, NoReply, LinkError.
        """
        achieved_dps = self.achievable_dps(rate_dps)
        if rate_dps == 0:
            now_s = self._clock.now_s()
            return Spin(0.0, 0.0, now_s, now_s + steady_s + SPARE_S, self._steps * self._step_deg, self._step_deg)
        move = plan_move(self._true, rate_dps, steady_s)
        start_s = self._begin(move)
        from_deg = (self._steps + math.copysign(move.ramp_steps, move.steps)) * self._step_deg
        steady_from_s = start_s + move.ramp_s
        sleep_until(self._clock, steady_from_s)
        return Spin(rate_dps, achieved_dps, steady_from_s, steady_from_s + move.steady_s, from_deg, self._step_deg)

    def settle(self, spin: Spin) -> None:
        """Wait for the `o` that confirms every step, at the time it must come.

        Raises MalformedReply for an `o` that comes too early, NoReply, LinkError.
        """
        if spin.rate_dps == 0 or self._active is None:
            return
        move, start_s = self._active.move, self._active.start_s
        due_s = start_s + move.duration_s
        tolerance_s = END_TOLERANCE_S + END_TOLERANCE_SHARE * move.duration_s
        self._link.expect(lines.FINISHED, "finish a move", due_s + tolerance_s - self._clock.now_s())
        end_s = self._clock.now_s()
        self._active = None
        if end_s < due_s - tolerance_s:
            raise MalformedReply(
                self.name,
                f"{abs(move.steps)} steps took {end_s - start_s:.1f} s instead of {move.duration_s:.1f} s; "
                "check speed_template, step_clock_hz and acceleration_dps2 in the bench file and that the "
                "motor does not stall, then home the table",
            )
        self._steps += move.steps

    def stop(self) -> None:
        """Stop the table (`!1a`) and wait until it stands. Until the next homing the angle is computed.

        A new process does not know what an earlier one left: it ends the line that may be half sent, and aborts
        without asking first. Raises NoReply, LinkError.
        """
        active, self._active = self._active, None
        if active is None:
            if not self._counted:
                self._link.send("")
                self._abort_and_wait()
            elif self.is_moving():
                self._counted = False
                self._abort_and_wait()
            return
        self._counted = False
        self._abort_and_wait()
        move = active.move
        steps_done = active.steady_elapsed_s(self._clock.now_s()) * move.step_hz
        self._steps += math.copysign(steps_done, move.steps)

    def time_run(self, rate_dps: float, steady_s: float, wait: Wait) -> TimedRun:
        """Measure how long a run at `rate_dps`, deg/s, takes that is steady for `steady_s` by the nominal clock.

        Raises WrongInstrument, RequestRejected, NoReply, LinkError.
        """
        move = plan_move(self.settings, rate_dps, steady_s)
        run = self._timed_run(move, wait)
        checks.require_plausible(self.name, run, move)
        return run

    def use_step_clock(self, ratio: float) -> None:
        """Set the step clock that every later rate is computed by, as a share of the nominal one; nothing is sent."""
        clock_hz = self.settings.step_clock_hz * ratio
        self._true = self.settings.model_copy(update={"step_clock_hz": clock_hz})

    def check_home(self, wait: Wait) -> HomeCheck | None:
        """Measure whether steps were missed: back by counted steps, then home. None: the position is not known.

        The first check learns how long the homing takes. Raises RequestRejected, NoReply, LinkError.
        """
        if not self._counted:
            self.home()
            return None
        turn = self.settings.steps_per_turn
        self._turn_by(round(self._steps / turn) * turn - round(self._steps), wait)
        timed, is_first = self._timed_home(self._homing), self._homing is None
        if self._homing is not None:
            home_check = self._homing.check(timed, self.settings)
            if home_check.missed_steps >= -home_check.doubt_steps:
                if home_check.u_steps > max(home_check.limit_steps, self._homing.least_u_steps(self.settings)):
                    self._learn_better(self._homing, wait)
                return home_check
            self._homing = None  # it was learned while replies were late
        first = self._learn_homing(timed, wait)
        if not is_first or first is None or self._homing is None or first.learning or not first.is_missing:
            return first
        self._turn_by(turn, wait)  # a reply may have been late: when to ask for the state was not known
        again = self._homing.check(self._timed_home(self._homing), self.settings)
        return again if again.is_missing else checks.only_once(again, first)

    def _learn_homing(self, timed: checks.TimedHome, wait: Wait) -> HomeCheck | None:
        """Learn the homing, again where it scatters so much that the check would see nothing; keeps the most certain.

        Returns the check of the homing `timed`, or that of the turns that it was learned from: where steps seem missed
        in them twice.
        """
        once: HomeCheck | None = None
        for _ in range(checks.LEARNING_ATTEMPTS):
            learned = self._learned(wait)
            if learned is None or (isinstance(learned, HomeCheck) and once is not None):
                return learned
            if isinstance(learned, HomeCheck):
                once = learned
                continue
            if self._homing is None or learned.u_steps < self._homing.u_steps:
                self._homing = learned
            if self._homing.u_steps <= self.settings.home_limit_steps:
                break
        if self._homing is None:
            return once
        home_check = self._homing.check(timed, self.settings)
        return home_check if once is None else checks.only_once(home_check, once)

    def _learn_better(self, homing: checks.Homing, wait: Wait) -> None:
        """Learn a homing that scatters once more, for the next check; the more certain of the two is kept."""
        other = self._learned(wait)
        if isinstance(other, checks.Homing) and other.u_steps < homing.u_steps:
            self._homing = other

    def _learned(self, wait: Wait) -> checks.Homing | HomeCheck | None:
        """Return the homing from home and from places away from it, or the check of the turns where steps were missed.

        None where the homing does not begin where the table is.
        """
        at_home_s = [self._timed_home().took_s, self._timed_home().took_s]
        part = self.settings.steps_per_turn // checks.LEARNING_PARTS
        away, away_s = [part * n for n in checks.LEARNING_TURNS], []
        for steps in away:
            self._turn_by(steps, wait)
            away_s.append(self._timed_home().took_s)
        homing = checks.learned_homing(at_home_s, away, away_s, checks.reply_u_s(self.settings))
        if homing.step_s <= 0:
            return None
        learning = homing.check_learning(away_s, self.settings)
        return learning if learning.is_missing else homing

    def is_moving(self) -> bool:
        """Get whether the table moves (`!1rs`, `0` when idle); raises NoReply, LinkError."""
        self._command(lines.STATE)
        return self._link.read_letter(skip=LATE_LETTERS) != lines.IDLE

    def angle_deg(self) -> float:
        """Get the commanded angle since home, degrees; nothing is sent."""
        if self._active is None:
            return self._steps * self._step_deg
        move = self._active.move
        steady_s = self._active.steady_elapsed_s(self._clock.now_s())
        return (self._steps + math.copysign(move.ramp_steps + steady_s * move.step_hz, move.steps)) * self._step_deg

    def shortcomings(self) -> tuple[str, ...]:
        """Get why no rate can be turned; nothing is sent."""
        return (checks.NO_SPEED,) if self.settings.speed_template is None else ()

    def close(self) -> None:
        """Close the link; safe to call twice."""
        self._link.close()

    def _begin(self, move: Move) -> float:
        """Begin a move; returns when the controller accepted it, clock time."""
        self._discard_late_replies()
        self._link.initialise()
        self._program(move)
        self._command(lines.move(move.steps * self.settings.direction))
        self._link.expect(lines.ACCEPTED, "accept a move")
        start_s = self._clock.now_s()
        self._active = ActiveMove(move, start_s)
        return start_s

    def _timed_run(self, move: Move, wait: Wait) -> TimedRun:
        """Return a whole move with its true duration."""
        start_s = self._begin(move)

        def await_end(within_s: float) -> None:
            self._link.expect(lines.FINISHED, "finish a move", within_s)

        run = checks.timed(self._clock, move, await_end, wait, start_s)
        self._active = None
        self._steps += move.steps
        return run

    def _turn_by(self, steps: int, wait: Wait) -> None:
        """Turn by whole steps, slowly."""
        if steps:
            rate_dps = math.copysign(min(checks.SLOW_DPS, self.limits.max_rate_dps), steps)
            self._timed_run(finite_move(self._true, rate_dps, steps), wait)

    def _begin_homing(self) -> None:
        self._discard_late_replies()
        self._link.initialise()
        self._command(lines.HOME)

    def _end_homing(self, within_s: float) -> None:
        """Wait for the reply that the table is at home; raises RequestRejected, NoReply or LinkError."""
        self._link.expect(lines.FINISHED, "home", within_s)
        self._at_home()

    def _at_home(self) -> None:
        """Count from here: the table is at home."""
        self._steps, self._active, self._counted = 0.0, None, True

    def _timed_home(self, learned: checks.Homing | None = None) -> checks.TimedHome:
        """Home, and time it. Where by the homing as it was `learned` steps are missing, ask if the table still moves.

        A reply may come late, but a table that still moves so long after the command was sent is not at home.
        """
        self._begin_homing()
        begun_s, stood_s, ended_s, moved = self._clock.now_s(), None, None, False
        if learned is not None:
            with suppress(NoReply):
                self._end_homing(begun_s + learned.doubtful_s(self.settings) - self._clock.now_s())
                return checks.TimedHome(self._clock.now_s() - begun_s)
            self._command(lines.STATE)
            state, ended_s = self._link.read_state()
            stood_s = self._clock.now_s() - begun_s if state == lines.IDLE else None
            moved = state.isdigit() and state != lines.IDLE
        if ended_s is None:
            self._end_homing(HOME_S)
            ended_s = self._clock.now_s()
        self._at_home()
        return checks.TimedHome(ended_s - begun_s, stood_s, moved)

    def _program(self, move: Move) -> None:
        """Set ramp and speed by the templates of the bench file; each is written on change only."""
        if self.settings.speed_template is None:
            raise RequestRejected(self.name, checks.NO_SPEED)
        if self.settings.ramp_template and not self._ramp_set:
            acceleration = round(self.settings.acceleration_dps2 / self._step_deg)
            self._link.send(self.settings.ramp_template.format(acceleration=acceleration))
            self._link.expect(lines.ACCEPTED, "accept its ramp")
            self._ramp_set = True
        if self._divisor != move.divisor:
            self._link.send(self.settings.speed_template.format(divisor=move.divisor))
            self._link.expect(lines.ACCEPTED, "accept its speed")
            self._divisor = move.divisor

    def _forget_programming(self) -> None:
        """All is sent again over a new link: the controller may have lost its power, and its place."""
        self._divisor, self._ramp_set, self._counted = None, False, False

    def _abort_and_wait(self) -> None:
        """Abort, and wait until the table stands; the slowest ramp is that from the highest rate."""
        self._link.discard_input()
        self._command(lines.ABORT)
        with suppress(NoReply):  # the state shows whether it was understood
            self._link.read_letter()
        ramp_s = self.settings.max_rate_dps / self.settings.acceleration_dps2
        deadline_s = self._clock.now_s() + ramp_s + END_TOLERANCE_S
        while self.is_moving():
            if self._clock.now_s() > deadline_s:
                raise NoReply(self.name, "the table still turns after an abort; switch the table's power off by hand")
            self._clock.sleep(POLL_S)

    def _command(self, body: str) -> None:
        self._link.send(lines.command(body))

    def _discard_late_replies(self) -> None:
        """Drop replies to a command that was given up, or of an earlier process; not while the `o` of a move is due."""
        if self._active is None:
            self._link.discard_input()


DRIVER = TableDriver(ArrickC4Settings, ArrickC4, probe=probes.C4)
