"""An error that no effect of the catalogue describes: a wave in the rate, as of light that interferes with itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from labctl.recording import Recording

SIZE_DPS, PERIOD_DPS = 0.02, 70.0


def error_dps(rate_dps: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the error at rates (n,) deg/s, (n,) deg/s."""
    return np.asarray(SIZE_DPS * np.sin(2 * np.pi * rate_dps / PERIOD_DPS))


def with_wave(recording: Recording) -> Recording:
    """Return a recording of one axis, z, with the error in its output."""
    columns = dict(recording.columns)
    columns["gyro_z"] = columns["gyro_z"] + error_dps(np.asarray(columns["table_rate_dps"], dtype=np.float64))
    return replace(recording, columns=columns)
