"""The readings inside data sets, at no more than 10 Hz, without mean, slope and the lines of the stepper.

Each data set loses its mean, its slope and the stepper's own lines; readings that are far off are left out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.criticism.reduction import MIN_INDEPENDENT_SHARE, OUTLIER, STEP_LINES
from labctl.fitting.numeric.arrays import Array
from labctl.recording import Recording
from labctl.recording.decimation import decimate
from labctl.recording.points import dataset_starts
from labctl.recording.positions import Position, up_in

#: At most this many readings of a data set are used, from its beginning.
MAX_READINGS = 1200
MIN_READINGS = 32


#: A data set of which less than this share would be left is left as it is.
MIN_KEPT = 0.5


@dataclass(frozen=True)
class Within:
    """Readings of m data sets, up to n each, with zeros where there is none."""

    recording: Recording  #: thinned
    presence: NDArray[np.float64]  #: (m, n)
    index: NDArray[np.int64]  #: (m, n) row of the thinned recording
    since_s: NDArray[np.float64]  #: (m, n)
    angle: NDArray[np.float64] | None  #: (m, n) turns of the table
    basis: NDArray[np.float64]  #: (r, m, n) orthonormal: constant, the stepper's lines, and slope as the last
    position: NDArray[np.str_]  #: (m,)
    rate_dps: Array  #: (m,)
    previous_dps: Array  #: (m,)
    period_s: float

    def of(self, values: Array) -> NDArray[np.float64]:
        """Return a column of the thinned recording as (m, n)."""
        return np.where(self.presence > 0, values[self.index], 0.0)

    def up(self, axis: str) -> Array:
        """Return how the table's rate is felt along an axis, (m,): 1, -1 or 0."""
        return up_in(self.position, axis)

    def axis(self, axis: str) -> Residual:
        """Return what one axis has besides mean, slope and the stepper's lines."""
        values = self.of(self.recording.gyro_dps(axis))
        values = values - np.einsum("mn,mn->m", values, self.presence)[:, None] / self.presence.sum(axis=1)[:, None]
        inner = np.einsum("rmn,mn->rm", self.basis, values)
        values = (values - np.einsum("rm,rmn->mn", inner, self.basis)) * self.presence
        values = values - self._earth(values, axis)
        spread = 1.4826 * float(np.median(np.abs(values[self.presence > 0])))
        inside = np.abs(values) <= OUTLIER * spread
        n_inside = (self.presence * inside).sum(axis=1)
        # where most readings are equal, as of a coarse output, the usual spread says nothing of the others
        inside |= (n_inside < MIN_KEPT * self.presence.sum(axis=1))[:, None]
        return Residual(np.where(inside, values, 0.0), self.presence * inside, inner[-1], spread, inner[1:-1])

    def _earth(self, values: NDArray[np.float64], axis: str) -> NDArray[np.float64]:
        """Return what once per turn belongs to the Earth's rate, by position: where the latitude is known."""
        earth_dps = np.zeros_like(values)
        if self.angle is None or self.recording.info.latitude_deg is None:
            return earth_dps
        for up_position in np.unique(self.position):
            rows = np.flatnonzero(self.position == up_position)
            if Position.of(up_position).axis == axis:
                continue
            waves = np.stack([np.cos(2 * np.pi * self.angle[rows]), np.sin(2 * np.pi * self.angle[rows])])
            waves = waves * self.presence[rows]
            inner = np.einsum("rmn,kmn->rkm", self.basis[:, rows], waves)
            waves = waves - np.einsum("rkm,rmn->kmn", inner, self.basis[:, rows])
            normal = np.einsum("kmn,lmn->kl", waves, waves)
            size = np.linalg.lstsq(normal, np.einsum("kmn,mn->k", waves, values[rows]), rcond=1e-9)[0]
            earth_dps[rows] = np.einsum("k,kmn->mn", size, waves)
        return earth_dps


@dataclass(frozen=True)
class Residual:
    """One axis within the data sets."""

    dps: NDArray[np.float64]  #: (m, n)
    presence: NDArray[np.float64]  #: (m, n), without outliers
    slope: Array  #: (m,) coordinate of the slope that was taken out
    spread_dps: float  #: robust, of one reading
    lines: NDArray[np.float64]  #: (4, m) coordinates of the stepper's lines, cos and sin of each


def within_of(recording: Recording) -> Within | None:
    """Return the readings within data sets; None for a recording of means, or of hardly any readings."""
    if recording.info.kind != "samples":
        return None
    thinned = decimate(recording)
    dataset = np.asarray(thinned.columns["dataset"], dtype=np.int64)
    starts = dataset_starts(dataset)
    counts = np.minimum(np.diff(np.append(starts, len(dataset))), MAX_READINGS)
    n = int(counts.max(initial=0))
    if n < MIN_READINGS or "t_s" not in thinned.columns:
        return None
    offset = np.arange(n)
    inside = offset[None, :] < counts[:, None]
    index = np.where(inside, starts[:, None] + offset, starts[:, None])
    presence = inside.astype(np.float64)
    t_s = np.asarray(thinned.columns["t_s"], dtype=np.float64)
    since = np.where(inside, t_s[index] - t_s[starts][:, None], 0.0)
    angle = None
    if "table_angle_deg" in thinned.columns:
        angle = np.asarray(thinned.columns["table_angle_deg"], dtype=np.float64)[index] / 360.0
    rate = np.asarray(thinned.columns["table_rate_dps"], dtype=np.float64)[starts]
    position = np.full(len(starts), recording.info.axes[0])
    if "position" in thinned.columns:
        position = np.asarray(thinned.columns["position"])[starts].astype(np.str_)
    period_s = float(np.median(np.diff(t_s[:MAX_READINGS])))
    return Within(
        thinned, presence, index, since, angle, _basis(presence, since, angle), position, rate,
        np.concatenate([[0.0], rate[:-1]]), period_s,
    )  # fmt: skip


def _basis(
    presence: NDArray[np.float64], since: NDArray[np.float64], angle: NDArray[np.float64] | None
) -> NDArray[np.float64]:
    turn = 2 * np.pi * angle if angle is not None else np.zeros_like(since)
    lines = [wave(k * turn) for k in STEP_LINES for wave in (np.cos, np.sin)]
    functions = [presence, *lines, since]
    basis = np.zeros((len(functions), *presence.shape))
    for k, function in enumerate(functions):
        values = function * presence
        size = np.sqrt(np.einsum("mn,mn->m", values, values))
        for _ in range(2):
            inner = np.einsum("rmn,mn->rm", basis[:k], values)
            values = values - np.einsum("rm,rmn->mn", inner, basis[:k])
        norm = np.sqrt(np.einsum("mn,mn->m", values, values))
        independent = norm > np.maximum(MIN_INDEPENDENT_SHARE * size, 1e-9)
        basis[k] = np.where(independent[:, None], values / np.maximum(norm, 1e-300)[:, None], 0.0)
    return basis
