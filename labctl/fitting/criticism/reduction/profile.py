"""Reduction of a recording whose rate changes: pieces of many windows, each in a few functions of the rate.

Windows are far too many to be correlated with each other. Within a piece of them an orthonormal basis is built from a
constant, time, the rate, the rate as it comes through delays and lags, and its powers: what any effect of the catalogue
does to the output lies in their span, or nearly. Regressors are evaluated at every window, averaged as the output is.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.criticism.reduction.reduced_recording import ReducedRecording
from labctl.fitting.data.channels import channels_of
from labctl.fitting.data.earth_rate import up_rate_dps
from labctl.fitting.data.fit_data import profile_of
from labctl.fitting.data.mean_noise import white_var_of
from labctl.fitting.data.rate_profile import RateProfile
from labctl.fitting.data.response import Response
from labctl.fitting.numeric.arrays import Array
from labctl.recording import Recording, to_points

#: Pieces of a recording, about.
MAX_PIECES = 300
#: Windows of different places or runs, or this many spacings apart, are of different pieces.
GAP_SPACINGS = 3.0
#: Responses in the span of which, with the rate itself, those of gyros are.
RESPONSES = (
    Response(0.002), Response(0.01), Response(-0.01), Response(0.03), Response(0.0, 0.01), Response(0.0, 0.1),
    Response(0.0, 3.0),
)  # fmt: skip
#: A function of which less than this share is independent of those before it in its piece is left out.
MIN_INDEPENDENT_SHARE = 1e-3


def reduce_profile(recording: Recording) -> ReducedRecording:
    """Return the coordinates of every piece; its nodes are its windows."""
    points = to_points(recording)
    channels = channels_of(points, up_rate_dps(points.info), profile_of(recording))
    assert channels.profile is not None
    index, presence = _pieces(points)
    basis, present = _basis(_functions(points, channels.profile), index, presence)
    count = presence.sum(axis=1)
    basis /= np.sqrt(count)[None, :, None]
    outputs: dict[str, NDArray[np.float64]] = {
        axis: np.einsum("rmb,mb->rm", basis, points.gyro_dps(axis)[index]) for axis in points.info.axes
    }
    white: dict[str, Array] = {}
    for axis in points.info.axes:
        variance = white_var_of(points, axis)
        if variance is not None:
            white[axis] = (variance[index] * presence).sum(axis=1) / count**2
    has_white = len(white) == len(outputs) and all(np.all(each > 0) for each in white.values())
    return ReducedRecording(
        points.info, channels.take(index.ravel()), basis, {}, outputs, present, white if has_white else None,
        np.asarray(points.columns["dataset"], dtype=np.int64)[index[:, 0]],
    )  # fmt: skip


def _pieces(points: Recording) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return the windows of each piece, (m, B), the last one again where there are fewer, and 1 where there is one."""
    columns, n = points.columns, len(points)
    t_s = np.asarray(columns["t_s"], dtype=np.float64)
    gap = np.diff(t_s) > GAP_SPACINGS * float(np.median(np.diff(t_s)))
    for name in ("dataset", "position", "run", "mounting"):
        if name in columns:
            values = np.asarray(columns[name])
            gap |= values[1:] != values[:-1]
    starts = np.concatenate([[0], np.flatnonzero(gap) + 1])
    sizes = np.diff(np.append(starts, n))
    parts = np.maximum(np.rint(sizes * MAX_PIECES / n).astype(np.int64), 1)
    groups = [
        group
        for start, size, number in zip(starts, sizes, parts, strict=True)
        for group in np.array_split(np.arange(start, start + size), min(number, size))
    ]
    most = max(map(len, groups))
    index = np.array([np.concatenate([group, np.repeat(group[-1:], most - len(group))]) for group in groups])
    presence = np.arange(most)[None, :] < np.array(list(map(len, groups)))[:, None]
    return index, presence.astype(np.float64)


def _functions(points: Recording, profile: RateProfile) -> list[Array]:
    """Return functions of the windows, (M,) each, the most important first."""
    rate = profile.seen_dps(Response())
    share = rate / max(float(np.abs(rate).max()), 1e-300)
    t_s = np.asarray(points.columns["t_s"], dtype=np.float64)
    through = [profile.seen_dps(response) - rate for response in RESPONSES]
    return [np.ones_like(rate), share, *through[:2], t_s - t_s.mean(), share**2, share**3, np.abs(share), *through[2:]]


def _basis(
    functions: list[Array], index: NDArray[np.int64], presence: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Return orthonormal functions, (R, m, B), and which exist in which piece, (R, m): by Gram-Schmidt, twice."""
    basis = np.zeros((len(functions), *presence.shape))
    present = np.zeros((len(functions), len(presence)), dtype=bool)
    for k, function in enumerate(functions):
        values = function[index] * presence
        size = np.sqrt((values**2).sum(axis=1))
        for _ in range(2):
            inner = np.einsum("rmb,mb->rm", basis[:k], values)
            values = values - np.einsum("rm,rmb->mb", inner, basis[:k])
        norm = np.sqrt((values**2).sum(axis=1))
        present[k] = norm > np.maximum(MIN_INDEPENDENT_SHARE * size, 1e-9)
        basis[k] = np.where(present[k][:, None], values / np.maximum(norm, 1e-300)[:, None], 0.0)
    return basis, present
