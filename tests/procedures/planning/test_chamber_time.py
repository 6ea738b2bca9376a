"""The expected time of a chamber, against the differential equation of its air, solved by another library."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from procedures.planning.chamber_time import counted_move_s, move_s


def solved_s(way_c: float, ramp_c_per_min: float, band_c: float, tau_s: float) -> float:
    """Return when the air, which follows min(r t, way) with a lag, is within its band for good."""
    rate = ramp_c_per_min / 60.0
    end_s = way_c / rate + 20.0 * tau_s

    def slope(t_s: float, air_c: list[float]) -> list[float]:
        return [(min(rate * t_s, way_c) - air_c[0]) / tau_s]

    t_s = np.linspace(0.0, end_s, 20_001)
    air_c = solve_ivp(slope, (0.0, end_s), [0.0], t_eval=t_s, max_step=tau_s / 5, rtol=1e-8, atol=1e-8).y[0]
    return float(t_s[np.argmax(way_c - air_c <= band_c)])


@pytest.mark.parametrize(
    ("way_c", "ramp", "band_c", "tau_s"),
    [
        (1.0, 1.67, 0.5, 180.0),
        (2.0, 1.67, 0.5, 180.0),
        (40.0, 1.67, 0.5, 180.0),
        (65.0, 10.0, 0.2, 60.0),
        (5.0, 0.5, 0.5, 300.0),
    ],
)
def test_it_is_that_of_a_first_order_lag(way_c: float, ramp: float, band_c: float, tau_s: float) -> None:
    assert move_s(way_c, ramp, band_c, tau_s) == pytest.approx(solved_s(way_c, ramp, band_c, tau_s), rel=0.01)


def test_move_time_in_limiting_cases() -> None:
    assert move_s(0.4, 1.0, 0.5) == 0.0
    assert move_s(40.0, math.inf, 0.5) == 0.0
    # air that hardly lags is in its band at the end of the ramp
    assert move_s(10.0, 1.0, 0.5, 1.0) == 600.0
    assert counted_move_s(10.0, 1.0, 0.5) == 900.0
