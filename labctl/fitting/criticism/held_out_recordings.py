"""Parts of several recordings that are left out to check what a calibration with an effect would do.

A recording is left out whole, so that its own drift and shifts are in what is predicted. That asks nothing fair where
the recording is the only one in which what drives the effect was changed, as the supply voltage by steps: the others do
not determine its coefficient. Such a recording is left out in parts, each with every value of the driving channel.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.data.channels import BODY_AXES
from labctl.fitting.data.fit_data import FitData
from labctl.fitting.effects import Term, kind_of
from labctl.fitting.effects.acceleration import force_g
from labctl.fitting.models.force_sensitivity import EFFECTS as OF_FORCE
from labctl.fitting.numeric.arrays import Array
from labctl.recording.columns import RECORDING

#: So many parts, one after the other in time.
PARTS = 4
#: Values of a channel that are further apart than this share of all it covers are two values.
APART = 0.1
#: Numbers that count up, times and angles: they are the same in every recording, or have no law between recordings.
NOT_DRIVING = frozenset({"t_s", "power_s", "run", "mounting", "table_angle_deg"})
Mask = NDArray[np.bool_]


def held_out_recordings(data: FitData, term: Term) -> list[Mask]:
    """Return what is left out in turn of several recordings, masks (m,), to check an effect."""
    of = np.asarray(data.channels[RECORDING])
    driving, wholes = _driving(data, term), [of == number for number in np.unique(of)]
    alone = [whole for whole in wholes if any(_is_beyond(values, whole) for values in driving)]
    return [part for whole in alone for part in _in_parts(whole, driving)] or wholes


def _driving(data: FitData, term: Term) -> list[Array]:
    """Return the channels besides rate, temperature and time that an effect follows, (m,) each."""
    names = [name for name in kind_of(term).needs if name not in NOT_DRIVING]
    channels = [np.asarray(data.channels[name], dtype=np.float64) for name in names if name in data.channels]
    if term.effect in OF_FORCE:
        channels += [force_g(data.channels, axis) for axis in BODY_AXES]
    return [values for values in channels if np.all(np.isfinite(values))]


def _is_beyond(values: Array, whole: Mask) -> bool:
    """Return whether a channel of a recording goes beyond the values that it has in the others."""
    own, others = values[whole], values[~whole]
    margin = APART * float(np.ptp(values))
    return bool(own.min() < others.min() - margin or own.max() > others.max() + margin)


def _in_parts(whole: Mask, driving: list[Array]) -> Iterator[Mask]:
    """Yield parts of a recording: of the data sets at each value of the channels every `PARTS`th stretch of time."""
    levels = np.zeros(len(whole), dtype=np.int64)
    for values in driving:
        levels = levels * (len(values) + 1) + _levels(values)
    part = np.full(len(whole), -1, dtype=np.int64)
    for level in np.unique(levels[whole]):
        rows = np.flatnonzero(whole & (levels == level))
        for number, some in enumerate(np.array_split(rows, PARTS)):
            part[some] = number
    yield from (part == number for number in range(PARTS) if np.any(part == number))


def _levels(values: Array) -> NDArray[np.int64]:
    """Return the number of the value of each data set, (m,): values that are close to each other have one."""
    order = np.argsort(values, kind="stable")
    steps = np.diff(values[order], prepend=values[order][:1]) > APART * max(float(np.ptp(values)), 1e-300)
    levels = np.empty(len(values), dtype=np.int64)
    levels[order] = np.cumsum(steps)
    return levels
