"""A point of an Allan deviation: the clusters of readings that it is made of, and the same computed from them again."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labctl.answers.noise import AllanJson
from labctl.answers.points import FigureNumber, FigurePointResponse
from labctl.errors import NotEnoughData, NotFound
from labctl.fitting.numeric.allan import allan
from labctl.fitting.numeric.json_numbers import DIGITS
from labctl.services.cache import UNNAMED, compute
from labctl.services.recordings.allan import allan_unit, rest_of, valid_part
from labctl.services.recordings.figure_point import figure_number, figure_point
from labctl.store import Store

#: Share by which an averaging time that was asked for may differ from the one of the figure.
SAME_TAU = 1e-6


@dataclass(frozen=True)
class Clusters:
    """Rates averaged over m readings each: the sum of their squared differences, and how many these are."""

    squares_dps2: float
    differences: int

    @property
    def deviation_dps(self) -> float:
        """The overlapping Allan deviation, deg/s: root of half the mean squared difference."""
        return math.sqrt(self.squares_dps2 / (2 * self.differences))


def clusters_of(rate_dps: NDArray[np.float64], m: int) -> Clusters:
    """Return the differences of neighbouring averages over m of rates (n,), one from each reading on; n >= 2 m.

    NIST SP 1065, section 5.2.4, by the averages themselves and in extended precision: the figure has running sums.
    """
    sums = np.concatenate([[0], np.cumsum((rate_dps - rate_dps[0]).astype(np.longdouble))])
    means = (sums[m:] - sums[:-m]) / m
    differences = means[m:] - means[:-m]
    return Clusters(float(differences @ differences), len(differences))


def allan_point(store: Store, recording: int, axis: str, tau_s: float, dataset: int | None) -> FigurePointResponse:
    """Return the deviation of an axis at an averaging time, s, and what the readings give now.

    Raises NotFound for an axis or an averaging time that the figure does not have, and what `allan_unit` raises.
    """
    answer = allan_unit(store, recording, dataset)
    shown = answer.axes.get(axis)
    if shown is None:
        raise NotFound(
            f"the Allan deviation of recording {recording} has no axis {axis!r}; choose one of {', '.join(answer.axes)}"
        )
    k = _place(recording, shown, tau_s)
    compute(UNNAMED)
    rates_dps, period_s = _readings(store, recording, axis, dataset)
    again = allan(rates_dps, period_s)
    if again is None:
        raise NotEnoughData(f"recording {recording}, axis {axis}: its readings do not scatter; choose another axis")
    m = 1 << k
    clusters = clusters_of(rates_dps, m)
    deviation_dps = clusters.deviation_dps
    formula = (
        f"deviation = sqrt(sum of (mean[i + {m}] - mean[i])^2 / (2 x {clusters.differences})) = "
        f"sqrt({clusters.squares_dps2:.9g} / {2 * clusters.differences}) = {deviation_dps:.9g} deg/s; "
        f"mean[i] is of the {m} readings from i on"
    )
    first, last = answer.datasets
    numbers = [
        _number("Allan deviation", "deg/s", shown["deviation_dps"][k], deviation_dps),
        _number("95 % interval, from", "deg/s", shown["low_dps"][k], float(again.low_dps[k])),
        _number("95 % interval, to", "deg/s", shown["high_dps"][k], float(again.high_dps[k])),
        _number("averaging time", "s", shown["tau_s"][k], m * period_s),
        figure_number("clusters that do not overlap", "", None, len(rates_dps) // m),
        figure_number("differences of overlapping clusters", "", None, clusters.differences),
    ]
    title = f"Axis {axis}, averaging time {m * period_s:.6g} s"
    return figure_point("allan", title, recording, (first, last), numbers, formula, rates_dps)


def _number(name: str, unit: str, shown: float | None, again: float) -> FigureNumber:
    """Return a number beside that of the figure, which has DIGITS significant digits."""
    last_digit = 10.0 ** (math.floor(math.log10(abs(again))) + 1 - DIGITS) if again else 0.0
    return figure_number(name, unit, shown, again, rounding=0.5 * last_digit * (1 + 1e-6))


def _place(recording: int, shown: AllanJson, tau_s: float) -> int:
    """Return which averaging time of the figure is meant: the k-th is that of 2^k readings. Raises NotFound."""
    for k, tau in enumerate(shown["tau_s"]):
        if tau is not None and abs(tau - tau_s) <= SAME_TAU * tau:
            return k
    times = ", ".join(f"{tau:.6g}" for tau in shown["tau_s"] if tau is not None)
    raise NotFound(
        f"the Allan deviation of recording {recording} has no averaging time {tau_s:g} s; choose one of {times} s"
    )


def _readings(
    store: Store, recording: int, axis: str, dataset: int | None
) -> tuple[NDArray[np.float64], float]:  # fmt: skip
    """Return the rates at rest (n,), deg/s, and their period, s: read now."""
    readings = rest_of(store, recording) if dataset is None else valid_part(store, recording, dataset)
    t_s = np.asarray(readings.columns["t_s"], dtype=np.float64)
    return readings.gyro_dps(axis), float((t_s[-1] - t_s[0]) / (len(t_s) - 1))
