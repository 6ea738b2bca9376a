"""A logged angle of the table that turns by another rate than the rate column says."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from labctl.recording.sanity.finding import Finding
from labctl.recording.sanity.summary import Summary

#: Slower data sets say nothing of a ratio, deg/s.
MIN_DPS = 1.0
#: Data sets of one direction that are compared, at least, where no uncertainty of the angle's rate is known.
MIN_SETS = 3
#: What counts as no error, ppm; beyond the largest it is no ratio but another unit or a wrapped angle.
NO_PPM, LARGEST_PPM = 20.0, 1e4
COVERAGE = 3.0


def check_reference(summary: Summary) -> list[Finding]:
    """Return a finding where the logged angle of the table turns by another rate than its rate column says.

    Two rates of one table differ by table_rate_ratio, whatever the gyro does. Each direction is judged by itself.
    """
    if summary.info.motion != "rates":
        return []
    rate, turning, u = (
        np.asarray(summary[name], dtype=np.float64) for name in ("table_rate_dps", "turning_dps", "turning_u_dps")
    )
    usable = np.isfinite(turning) & (np.abs(rate) >= MIN_DPS)
    ways = {"forwards": usable & (rate > 0), "backwards": usable & (rate < 0)}
    deviations = {
        way: 1e6 * np.array(_deviation(rate[of_way], turning[of_way], u[of_way]))
        for way, of_way in ways.items()
        if np.count_nonzero(of_way) >= (MIN_SETS if np.isnan(u[of_way]).any() else 1)
    }
    off = [way for way, (ppm, u_ppm) in deviations.items() if max(NO_PPM, COVERAGE * u_ppm) < abs(ppm)]
    if not off or max(abs(ppm) for ppm, _ in deviations.values()) > LARGEST_PPM:
        return []
    each = ", ".join(f"{ppm:+.0f} ppm {way} (u {u_ppm:.0f} ppm)" for way, (ppm, u_ppm) in deviations.items())
    worst_ppm = max((float(deviations[way][0]) for way in off), key=abs)
    return [
        Finding(
            "table_rate_ratio", "likely", "column table_rate_dps",
            f"table_rate_ratio: the logged table angle shows a rate that is larger than the commanded rate by "
            f"{each}", worst_ppm, "ppm",
            f"the same rate within {NO_PPM:g} ppm or {COVERAGE:g} u",
            "make the rate of the angle the reference (reference = \"measured\" in the bench file): the output of a "
            "gyro does not tell this from its scale factor, which contains it",
        )
    ]  # fmt: skip


def _deviation(rate: NDArray[np.float64], turning: NDArray[np.float64], u: NDArray[np.float64]) -> tuple[float, float]:
    """Return the ratio of two rates (m,) less 1, and its standard uncertainty: the scatter, or what is known of it."""
    weight = rate**2
    off = float(np.sum(rate * (turning - rate)) / np.sum(weight))
    residual = turning - (1 + off) * rate
    scatter = float(np.sqrt(residual @ residual / (len(rate) - 1) / weight.sum())) if len(rate) >= MIN_SETS else 0.0
    u_mean = float(np.sqrt(np.sum((rate * np.nan_to_num(u)) ** 2)) / np.sum(weight))
    return off, max(scatter, u_mean)
