"""Shifts between recordings: what is different after each power-on, day and mounting, as regressors of one axis.

Each is a random effect (IEEE Std 528: repeatability): its size differs from one power-on to the next, its spread is
what is estimated, and none of it belongs to the unit's calibration.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import helmert

from labctl.fitting.data.channels import Channels
from labctl.fitting.data.joined import recordings_in
from labctl.fitting.data.mounting_angles import angle_columns
from labctl.fitting.numeric.arrays import Array
from labctl.recording.columns import RECORDING

ShiftKind = Literal["turn_on", "day_to_day", "mounting"]


@dataclass(frozen=True)
class Repeatability:
    """One kind of shift: the standard's term, its unit, and the largest standard deviation that is accepted."""

    kind: ShiftKind
    term: str
    unit: str
    largest: float
    effect: str  #: the effect whose coefficient it shifts


#: In the order of their columns. The largest are far above those of any gyro or mount.
KINDS: dict[ShiftKind, Repeatability] = {
    "turn_on": Repeatability("turn_on", "bias repeatability, turn-on to turn-on", "deg/s", 5.0, "bias"),
    "day_to_day": Repeatability("day_to_day", "scale factor repeatability, day to day", "1", 0.1, "scale_factor"),
    "mounting": Repeatability("mounting", "alignment repeatability, mounting to mounting", "rad", 0.1, "misalignment"),
}


@dataclass(frozen=True)
class Shift:
    """One shift: its kind, its number and its regressor (n,)."""

    kind: ShiftKind
    recording: int
    number: int  #: of the run or mounting, counted through all recordings; of a day the recording
    values: Array
    along: str = ""  #: of a mounting: the axis that the unit was turned about

    @property
    def name(self) -> str:
        """What identifies the shift among those of its axis."""
        return f"{self.kind}_{self.number}{self.along}"


def shifts_of(channels: Channels, axis: str) -> list[Shift]:
    """Return the shifts of one output axis that the rows (n,) show; none for a single recording."""
    return shown_shifts(channels, axis) if len(recordings_in(channels.columns)) > 1 else []


def shown_shifts(channels: Channels, axis: str) -> list[Shift]:
    """Return the shifts that rows (n,) of several recordings show, also where these are all of one recording."""
    return [shift for shift in _every(channels, axis) if np.any(shift.values)]


def shift_columns(channels: Channels, axis: str) -> NDArray[np.float64]:
    """Return the regressors of the shifts of one axis, (n, q)."""
    columns = [shift.values for shift in shifts_of(channels, axis)]
    return np.column_stack(columns) if columns else np.zeros((len(channels), 0))


def shift_contrasts(channels: Channels, axis: str, placed_rad: float = 0.0) -> tuple[NDArray[np.float64], Array]:
    """Return contrasts between the shifts of one axis, (n, k), and the largest standard deviation of each, (k,).

    What all recordings have in common is no shift: an error of the bias that they share can still be found. So it is
    with the angles of mountings. The bias of a recording is one: what differs between its powered runs, or mountings,
    is what effects of gravity, of the runs and of the mountings compete for, as in a single recording.
    """
    of_recording: dict[int, Array] = {}
    kinds: dict[tuple[ShiftKind, str], list[Array]] = {}
    for shift in shifts_of(channels, axis):
        if shift.kind == "turn_on":
            of_recording[shift.recording] = of_recording.get(shift.recording, np.zeros(len(channels))) + shift.values
        else:
            kinds.setdefault((shift.kind, shift.along), []).append(shift.values)
    if of_recording:
        kinds = {("turn_on", ""): list(of_recording.values()), **kinds}
    angles = angle_columns(channels, axis, placed_rad)
    columns, largest = [angles.values], angles.size.tolist()
    for (kind, _), values in kinds.items():
        columns.append(np.column_stack(values) @ helmert(len(values)).T)
        largest += [KINDS[kind].largest] * (len(values) - 1)
    return np.concatenate(columns, axis=1), np.array(largest)


def _every(channels: Channels, axis: str) -> Iterator[Shift]:
    of = np.asarray(channels[RECORDING])
    run, mounting = np.asarray(channels["run"]), np.asarray(channels["mounting"])
    for number in np.unique(run):
        rows = run == number
        yield Shift("turn_on", int(of[rows][0]), int(number), rows.astype(np.float64))
    for number in recordings_in(channels.columns):
        yield Shift("day_to_day", number, number, np.where(of == number, channels.rate_dps(axis), 0.0))
    for other in channels.rates:
        if other != axis:
            for number in np.unique(mounting):
                rows = mounting == number
                rate_dps = np.where(rows, channels.rate_dps(other), 0.0)
                yield Shift("mounting", int(of[rows][0]), int(number), rate_dps, other)
