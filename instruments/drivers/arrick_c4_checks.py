"""What an open-loop table finds out about its own steps: how long its runs take, and steps missed since home.

The C4 tells no position. The homing starts where the table is, so its duration says how far home is from there. A
duration is as uncertain as the latency of the replies that end it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from instruments.clock import Clock
from instruments.errors import NoReply, WrongInstrument
from instruments.interfaces.table import HomeCheck, TimedRun, Wait
from instruments.protocols.arrick_c4_moves import Move
from instruments.protocols.arrick_c4_settings import ArrickC4Settings
from instruments.transport.latency import latency_s

#: A run that is further off was made with other settings, or the motor stands.
LARGEST_DEVIATION = 0.2
#: Turns, in parts of a whole one, from which the homing is learned, and the rate, deg/s.
LEARNING_PARTS, LEARNING_TURNS = 16, (1, 2, 3)
SLOW_DPS = 22.5
#: A homing that scatters by more than the limit of the check is learned so often: one may have been late, or short.
LEARNING_ATTEMPTS = 3
#: A reply that a homing has ended comes so much later at most than the answer that the table stands, s, or was late.
MAX_BEHIND_S = 0.02
POLL_S = 0.5
NO_SPEED = (
    "no constant rate: the C4's speed command is not public; set speed_template of the table in the bench file from "
    "your "
    "controller's manual"
)


def reply_u_s(settings: ArrickC4Settings) -> float:
    """Return the standard uncertainty of when a reply arrives, s: stated, or that of a latency from 0 to its limit."""
    return settings.reply_u_s or latency_s(settings.port) / math.sqrt(12.0)


def timed(clock: Clock, move: Move, await_end: Callable[[float], None], wait: Wait, start_s: float) -> TimedRun:
    """Return a move with its true duration; `await_end` waits for its end for some seconds, or raises NoReply.

    Raises NoReply, and WrongInstrument for a duration that no clock explains.
    """
    earliest_s = start_s + (1 - LARGEST_DEVIATION) * move.duration_s
    latest_s = start_s + (1 + 2 * LARGEST_DEVIATION) * move.duration_s + POLL_S
    wait(max(earliest_s - clock.now_s(), 0.0))
    while True:
        try:
            await_end(POLL_S)
            break
        except NoReply:
            if clock.now_s() >= latest_s:
                raise
            wait(0.0)
    return TimedRun(start_s, clock.now_s() - start_s, abs(move.steps), move.step_hz)


def require_plausible(device: str, run: TimedRun, move: Move) -> None:
    """Raise WrongInstrument for a run whose duration no error of a step clock explains."""
    share = move.duration_s / run.duration_s
    if abs(share - 1) > LARGEST_DEVIATION:
        raise WrongInstrument(
            device,
            f"{run.steps} steps took {run.duration_s:.3f} s, so the motor steps at about {100 * share:.4g} % of the "
            f"rate that the bench file gives, limit +-{100 * LARGEST_DEVIATION:g} % from 100 %; check step_clock_hz, "
            "speed_template and that the motor turns",
        )


@dataclass(frozen=True)
class TimedHome:
    """One homing, in s since it began."""

    took_s: float  #: until the reply that it has ended
    #: When the controller answered that the table stands, asked where steps would be missing beyond doubt. None: it was
    #: not asked, did not answer, or said that the table still moves.
    stood_s: float | None = None
    moved: bool = False  #: whether it answered that the table still moves


@dataclass(frozen=True)
class Homing:
    """How long the homing takes from the place that is home, and longer for each step away from it."""

    from_home_s: float
    step_s: float
    u_s: float  #: standard uncertainty of one duration

    @property
    def u_steps(self) -> float:
        """Standard uncertainty of a number of steps: of a duration less that from home."""
        return math.sqrt(2.0) * self.u_s / self.step_s

    def least_u_steps(self, settings: ArrickC4Settings) -> float:
        """Return the standard uncertainty of a number of steps by the latency of replies alone."""
        return math.sqrt(2.0) * reply_u_s(settings) / self.step_s

    def doubtful_s(self, settings: ArrickC4Settings) -> float:
        """Return how long a homing takes from where steps are missing beyond doubt."""
        return self.from_home_s + self._check(0.0, settings).doubt_steps * self.step_s

    def check(self, homing: TimedHome, settings: ArrickC4Settings) -> HomeCheck:
        """Return how many steps away from home a homing began; fewer than none where it ended sooner than from home."""
        checked = self._check((homing.took_s - self.from_home_s) / self.step_s, settings)
        if homing.stood_s is None or checked.missed_steps <= checked.doubt_steps:
            return replace(checked, is_shown=homing.moved)
        late_s = homing.took_s - homing.stood_s
        why = (
            f"the reply that the homing has ended came {late_s:.2f} s after the controller said that the table stands"
            if late_s > MAX_BEHIND_S
            else "the controller said that the table stands when it was asked whether it still homes"
        )
        at_most = round(min(checked.missed_steps, (homing.stood_s - self.from_home_s) / self.step_s), 1)
        text = f"home seems {checked.missed_steps:g} steps from where it was left, but {why}"
        return replace(checked, missed_steps=at_most, explained=text)

    def check_learning(self, took_s: Sequence[float], settings: ArrickC4Settings) -> HomeCheck:
        """Return how many steps were missed in the turns, of equal spacing, that the homing was learned from."""
        beside = np.abs(np.diff(np.asarray(took_s) / self.step_s, 2))
        spread = self._check(float(beside.max()) / 2, settings)  # a place in the middle counts twice
        return HomeCheck(spread.missed_steps, spread.u_steps, spread.limit_steps, spread.step_deg, spread.step_s, True)

    def _check(self, steps: float, settings: ArrickC4Settings) -> HomeCheck:
        return HomeCheck(
            round(steps, 1), self.u_steps, settings.home_limit_steps, 360.0 / settings.steps_per_turn, self.step_s
        )


def only_once(check: HomeCheck, once: HomeCheck) -> HomeCheck:
    """Return a check with what an earlier measurement showed that was repeated, and did not show it again.

    A check that shows missed steps itself stays as it is.
    """
    if check.is_missing:
        return check
    where = "in a turn from which the homing is learned" if once.learning else "before the first check"
    late_s = once.step_s * once.missed_steps
    late = f"up to {2 * late_s:.2f} s" if once.learning else f"about {late_s:.2f} s"  # one of three places on a line
    text = (
        f"{once.missed_steps:g} steps seemed to be missed {where}, but not when it was made again: a reply was late by "
        f"{late}, or the table missed steps that once; no data set depends on it"
    )
    return replace(check, explained="; ".join(filter(None, (check.explained, text))))


def learned_homing(at_home_s: Sequence[float], offsets: Sequence[int], took_s: Sequence[float], u_s: float) -> Homing:
    """Return the homing by its durations from home, (m,) s, and from places `offsets` steps from there, (n,) s each.

    `u_s` is the least standard uncertainty of a duration. A slope that is none means that the homing does not begin
    where the table is.
    """
    slope, _ = np.polyfit(offsets, took_s, 1)
    scatter = float(np.std(at_home_s, ddof=1)) if len(at_home_s) > 1 else 0.0
    return Homing(float(np.mean(at_home_s)), float(slope), max(scatter, u_s))
