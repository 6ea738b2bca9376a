"""The mean residuals as waves in time: their periodogram beside what the noise would give."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from labctl.answers.views import BetweenSets
from labctl.fitting.criticism.diagnostics.axis import AxisView
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.json_numbers import plain_list

POINTS = 150
MIN_SETS = 16


def between_sets(view: AxisView) -> BetweenSets | None:
    """Return the amplitude of waves in the mean residuals, and what noise alone gives on average, both in deg/s.

    None without times, or for few data sets.
    """
    t_s = view.t_s
    steps = np.diff(np.unique(t_s))
    if "t_s" not in view.data.nodes or len(view) < MIN_SETS or len(steps) < MIN_SETS:
        return None
    lowest, highest = 1.0 / np.ptp(t_s), 0.5 / float(np.median(steps))
    if highest <= 2 * lowest:
        return None
    hz = np.geomspace(lowest, highest, POINTS)
    waves = np.exp(-2j * np.pi * hz[:, None] * (t_s - t_s[0])[None, :])
    waves_removed = _taken_off(view.residual_dps, waves)
    noise = np.einsum("fm,fm->f", waves @ view.covariance, waves.conj()).real
    return {
        "axis": view.axis,
        "per_hour": plain_list(3600.0 * hz),
        "amplitude_dps": plain_list(np.sqrt(2 * np.maximum(waves_removed, 0.0) / len(view))),
        "noise_dps": plain_list(2 * np.sqrt(np.maximum(noise, 0.0)) / len(view)),
    }


def _taken_off(values: Array, waves: NDArray[np.complex128]) -> Array:
    """Return which part of the sum of squares a wave of each frequency takes off, beside a mean (Lomb-Scargle).

    Computed here: importing scipy.signal would lengthen the start of every command by a third.
    """
    pairs = np.stack([waves.real, waves.imag], axis=2)
    pairs -= pairs.mean(axis=1, keepdims=True)
    inner = np.einsum("fmk,m->fk", pairs, values)
    gram = np.einsum("fmk,fml->fkl", pairs, pairs)
    return np.asarray(np.einsum("fk,fkl,fl->f", inner, np.linalg.pinv(gram, hermitian=True), inner))
