"""The mean residuals as waves in time: their periodogram beside what the noise would give."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.signal import lombscargle

from labctl.fitting.criticism.views.axis import AxisView
from labctl.fitting.plain import plain_list

POINTS = 150
LEAST_SETS = 16


def between_sets(view: AxisView) -> dict[str, Any] | None:
    """Return the amplitude of waves in the mean residuals, and what noise alone gives on average, both in deg/s.

    None without times, or for few data sets.
    """
    t_s = view.t_s
    steps = np.diff(np.unique(t_s))
    if "t_s" not in view.data.nodes or len(view) < LEAST_SETS or len(steps) < LEAST_SETS:
        return None
    lowest, highest = 1.0 / np.ptp(t_s), 0.5 / float(np.median(steps))
    if highest <= 2 * lowest:
        return None
    hz = np.geomspace(lowest, highest, POINTS)
    power = lombscargle(t_s - t_s[0], view.residual_dps, 2 * np.pi * hz, floating_mean=True)
    waves = np.exp(-2j * np.pi * hz[:, None] * (t_s - t_s[0])[None, :])
    noise = np.einsum("fm,fm->f", waves @ view.covariance, waves.conj()).real
    return {
        "axis": view.axis,
        "per_hour": plain_list(3600.0 * hz),
        "amplitude_dps": plain_list(np.sqrt(4 * np.maximum(power, 0.0) / len(view))),
        "noise_dps": plain_list(2 * np.sqrt(np.maximum(noise, 0.0)) / len(view)),
    }
