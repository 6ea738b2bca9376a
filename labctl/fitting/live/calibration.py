"""The live calibration: readings go in as they come, and `assess` says what they determine by now.

The figures are those of the fit that a stored recording gets (`labctl.fitting.estimation.fit`), over all readings so
far; it is made anew whenever another rest has become long enough.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from labctl.errors import BadInput, LabctlError, NotEnoughData
from labctl.fitting.estimation.fit import fit
from labctl.fitting.estimation.result import FitResult
from labctl.fitting.live.directions import DIRECTIONS, Direction, covered, turn_between
from labctl.fitting.live.state import (
    LiveCoefficient,
    LiveState,
    PoseRequest,
    coefficients_of,
    left_out_of,
    needs_of_fit,
    turns_left,
)
from labctl.fitting.live.target import Target
from labctl.fitting.models.presets import POSES
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.poses.at_rest.rests import MARGIN, MIN_IN_WINDOW, WINDOW_S, find_rests
from labctl.fitting.poses.readings import GAP, PoseReadings, readings_of
from labctl.fitting.poses.triad import unit
from labctl.recording import Recording, RecordingInfo
from labctl.recording.columns import holds_flags, needed

#: Readings that the arrays begin with.
FIRST = 4096


class ReadingBuffer:
    """The columns of a recording that begins."""

    def __init__(self, info: RecordingInfo) -> None:
        self._info = info
        self._columns: dict[str, NDArray[np.generic]] = {}
        self._n = 0

    def __len__(self) -> int:
        return self._n

    def add(self, columns: Mapping[str, NDArray[np.generic]]) -> None:
        """Append a block, (n,) each. Raises BadInput for columns that are missing or differ, and for times that fall.

        Data set 1 is all of it.
        """
        n = len(columns["t_s"]) if "t_s" in columns else 0
        extended = {"dataset": np.ones(n, dtype=np.int64), **columns}
        serial = self._info.serial
        if not self._columns:
            if absent := [name for name in needed(self._info) if name not in extended]:
                raise BadInput(
                    f"{serial}: the stream has no {', '.join(absent)}; add rates and specific forces of all three axes"
                )
            self._columns = {name: np.zeros(FIRST, dtype=_type(name)) for name in extended}
        if set(extended) != set(self._columns) or any(len(values) != n for values in extended.values()):
            raise BadInput(f"{serial}: a block has other columns than those before it; send the same columns each time")
        if n == 0:
            return
        times = np.asarray(extended["t_s"], dtype=np.float64)
        last = float(np.asarray(self._columns["t_s"])[self._n - 1]) if self._n else -np.inf
        if not np.all(np.diff(np.concatenate([[last], times])) > 0):
            raise BadInput(f"{serial}: t_s does not rise after {max(last, 0.0):.6f} s; send readings in order of time")
        self._grow(self._n + n)
        for name, values in extended.items():
            self._columns[name][self._n : self._n + n] = values
        self._n += n

    def recording(self) -> Recording:
        """Return all readings so far; later ones do not change it."""
        n = self._n
        return Recording(self._info, {name: values[:n] for name, values in self._columns.items()} or _none(self._info))

    def _grow(self, n: int) -> None:
        room = len(self._columns["t_s"])
        if n > room:
            size = max(2 * room, n)
            self._columns = {
                name: np.concatenate([values[: self._n], np.zeros(size - self._n, dtype=values.dtype)])
                for name, values in self._columns.items()
            }


def _type(name: str) -> type[np.generic]:
    return np.int64 if name == "dataset" or holds_flags(name) else np.float64


def _none(info: RecordingInfo) -> dict[str, NDArray[np.generic]]:
    return {name: np.zeros(0, dtype=_type(name)) for name in needed(info)}


#: A turn from 60 to 150 deg changes gravity's direction most surely; further, the path of a hand is any.
GOOD_TURN_DEG = (60.0, 150.0)
#: What a turn outside of that range is worth beside one inside.
OTHER_TURN = 0.3


def next_pose(covered: tuple[bool, ...], poses: int, direction: Array | None, needs: Array) -> Direction:
    """Return the pose to ask for; `covered` says of each of DIRECTIONS whether a rest covers it.

    `direction` (3,) is gravity's direction in the last rest, None before the first; `needs` (3,) how much a turn about
    each body axis would add. While some of the first `poses` poses are missing it is one of them, else any.
    """
    missing = [place for place in range(poses) if not covered[place]]
    places = missing or list(range(len(DIRECTIONS)))
    if direction is None:
        return DIRECTIONS[places[0]]
    worth = [_worth(direction, np.array(DIRECTIONS[place].up), needs) for place in places]
    return DIRECTIONS[places[int(np.argmax(worth))]]


def _worth(direction: Array, candidate: Array, needs: Array) -> float:
    axis, angle_deg = turn_between(direction, candidate)
    shared = float(np.sum(axis**2 * needs))
    low, high = GOOD_TURN_DEG
    return shared * (1.0 if low <= angle_deg <= high else OTHER_TURN) * min(angle_deg, 90.0)


def needs_of_turns(up: NDArray[np.float64]) -> Array:
    """Return how much a turn about each axis would add, (3,), before any fit: by the turns between rests (k, 3) so far.

    An axis about which the unit has not turned yet comes first.
    """
    turned_deg = np.zeros(3)
    for before, after in pairwise(up):
        axis, angle_deg = turn_between(before, after)
        turned_deg += axis**2 * angle_deg
    return np.asarray(1.0 / (turned_deg + 90.0))


#: Poses that are named in one message.
MAX_NAMED = 6
#: The present pose is that of the specific force over so long, s.
NEWEST_S = 0.25
#: Between these sizes lies the specific force at rest, by an accelerometer before its calibration, g.
MIN_G, MAX_G = 0.7, 1.4


@dataclass(frozen=True)
class _Rests:
    """The rests of the readings so far."""

    up: NDArray[np.float64]  #: (k, 3) direction of the specific force in each rest that is long enough
    count: int  #: of all
    still_s: float  #: of the last, where it still goes on; else 0


class LiveCalibration:
    """Readings so far, and the last fit to them. One thread may add while another assesses, each by itself.

    Raises BadInput for a recording that is not of every reading in poses.
    """

    def __init__(self, info: RecordingInfo, target: Target | None = None) -> None:
        if info.motion != "poses" or info.kind != "samples":
            raise BadInput(
                f"{info.serial}: a live calibration is by readings in poses; give kind = 'samples' and motion = 'poses'"
            )
        self.info = info
        self.target = target or Target()
        self._buffer = ReadingBuffer(info)
        self._lost = self._damaged = 0
        self._fitted: tuple[int, FitResult | None, str] = (
            0,
            None,
            "",
        )  #: rests long enough, the fit, why there is none

        self._asked: tuple[int, Direction | None] = (0, None)  #: long rests when the pose was chosen, and the pose

    def add(self, columns: Mapping[str, NDArray[np.generic]], *, lost: int = 0, damaged: int = 0) -> None:
        """Take in a block of readings: the columns of a recording, (n,) each, in order of time.

        Raises BadInput for a column that is missing, and for times that do not rise.
        """
        self._buffer.add(columns)
        self.add_unread(lost=lost, damaged=damaged)

    def add_unread(self, *, lost: int = 0, damaged: int = 0) -> None:
        """Count readings that are missing, and lines or frames that could not be read."""
        self._lost, self._damaged = self._lost + lost, self._damaged + damaged

    def __len__(self) -> int:
        return len(self._buffer)

    @property
    def recording(self) -> Recording:
        """All readings so far as a recording."""
        return self._buffer.recording()

    def assess(self, *, finally_: bool = False) -> LiveState:
        """Return what the readings so far determine; `finally_`: by a fit to all of them, whatever came last."""
        recording = self._buffer.recording()
        up: tuple[float, float, float] | None = None
        try:
            readings = readings_of(recording)
            up = _up(readings)
            rests = self._rests(readings)
            reason = ""
        except NotEnoughData as error:
            rests, reason = _Rests(np.zeros((0, 3)), 0, 0.0), self._plain(error)
        if not reason and (len(rests.up) != self._fitted[0] or finally_):
            self._fitted = (len(rests.up), *self._fit(recording))
        return self._state(recording, rests, reason, up)

    def _rests(self, readings: PoseReadings) -> _Rests:
        rests = find_rests(readings)
        cut_s = MARGIN * max(WINDOW_S, MIN_IN_WINDOW * readings.spacing_s)  # of both ends, by `find_rests`
        since_s = float(readings.t_s[-1] - readings.t_s[rests.end[-1] - 1]) if len(rests) else np.inf
        goes_on = since_s <= cut_s + GAP * readings.spacing_s
        long = rests.duration_s + 2 * cut_s >= self.target.rest_s
        still_s = float(rests.duration_s[-1]) + cut_s + since_s if goes_on else 0.0
        size = np.linalg.norm(rests.accel_g, axis=1)
        if len(size) and not MIN_G <= np.median(size) <= MAX_G:
            raise NotEnoughData(
                f"the specific force at rest is {np.median(size):.3g} g where gravity is 1 g: check unit and scale of "
                "the accelerometer"
            )
        return _Rests(unit(rests.accel_g[long & (size > MIN_G)]), len(rests), still_s)

    def _fit(self, recording: Recording) -> tuple[FitResult | None, str]:
        try:
            return fit(recording, POSES), ""
        except (LabctlError, ArithmeticError, ValueError) as error:  # the latter two: of matrices that have no inverse
            return None, self._plain(error)

    def _plain(self, error: Exception) -> str:
        return str(error).removeprefix(f"{self.info.serial}: ")

    def _state(
        self, recording: Recording, rests: _Rests, reason: str, up: tuple[float, float, float] | None
    ) -> LiveState:
        target, (_, result, refused) = self.target, self._fitted
        covers = covered(rests.up)
        coefficients = () if result is None else tuple(coefficients_of(result, target))
        turns = 0 if result is None or result.poses is None else result.poses["moves"]["used"]
        absent = [each.name for each, has in zip(DIRECTIONS[: target.poses], covers, strict=False) if not has]
        missing = [text for text in (_poses_text(absent, target), reason or (refused if len(rests.up) else "")) if text]
        missing += [
            f"U of {coefficient.name} of {coefficient.axis} is {coefficient.expanded:.2g}, above its limit of "
            f"{coefficient.limit:g} ({coefficient.unit})"
            for coefficient in coefficients
            if not coefficient.is_met
        ]
        request = PoseRequest(self._pose(rests.up, covers, coefficients), target.rest_s) if missing else None
        t_s = recording.columns["t_s"]
        return LiveState(
            float(np.asarray(t_s, dtype=np.float64)[-1]) if len(t_s) else 0.0, len(recording), self._lost,
            self._damaged, rests.still_s, rests.count,
            tuple(each.name for each, has in zip(DIRECTIONS[: target.poses], covers, strict=False) if has),
            target.poses, coefficients, tuple(missing), request,
            turns_left(coefficients, turns), () if result is None else left_out_of(result), result, up,
        )  # fmt: skip

    def _pose(
        self, up: NDArray[np.float64], covers: tuple[bool, ...], coefficients: tuple[LiveCoefficient, ...]
    ) -> Direction:
        """Return the pose to ask for: another one only after another rest that is long enough."""
        rests, pose = self._asked
        if pose is None or rests != len(up):
            needs = needs_of_fit(coefficients) if coefficients else needs_of_turns(up)
            pose = next_pose(covers, self.target.poses, up[-1] if len(up) else None, needs)
            self._asked = (len(up), pose)
        return pose


def _up(readings: PoseReadings) -> tuple[float, float, float] | None:
    """Return the direction of the newest specific force, by the accelerometer as it is; None where it is 0."""
    force = np.mean(readings.accel_g[readings.t_s > readings.t_s[-1] - NEWEST_S], axis=0)
    size = float(np.linalg.norm(force))
    if not size > 0:
        return None
    x, y, z = (float(each) for each in force / size)
    return x, y, z


def _poses_text(absent: list[str], target: Target) -> str:
    if not absent:
        return ""
    named = "; ".join(absent[:MAX_NAMED]) + ("; ..." if len(absent) > MAX_NAMED else "")
    return f"{len(absent)} of {target.poses} poses are missing, by the axes that point up: {named}"
