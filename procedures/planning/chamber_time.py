"""How long a chamber takes to a temperature: the fastest ramp, which the air follows with a first-order lag."""

from __future__ import annotations

import math

from instruments.bench_config import USUAL_AIR_TAU_S

#: From the end of a ramp until the air is in the band, as far as that decides what is done.
COUNTED_SETTLING_S = 300.0


def move_s(way_c: float, ramp_c_per_min: float, band_c: float, air_tau_s: float = USUAL_AIR_TAU_S) -> float:
    """Return the time, s, until the air is within +- `band_c` (K) of a set point that is `way_c` (K) away.

    The set value ramps at `ramp_c_per_min`; air with the time constant `air_tau_s` (s) lags behind a ramp of the rate r
    that lasts T by r tau (1 - exp(-T / tau)), which decays after its end: the step response of a first-order lag to a
    ramp.
    """
    if way_c <= band_c or math.isinf(ramp_c_per_min):
        return 0.0
    ramp_s = 60.0 * way_c / ramp_c_per_min
    lag_c = way_c * (air_tau_s / ramp_s) * -math.expm1(-ramp_s / air_tau_s)
    return ramp_s + air_tau_s * max(math.log(lag_c / band_c), 0.0)


def counted_move_s(way_c: float, ramp_c_per_min: float, band_c: float) -> float:
    """Return the time, s, that a move of `way_c` (K) counts as where it decides what is done.

    It does not depend on how well the air of the chamber is known: the steps of a plan, and what a seed simulates, are
    the same on two benches with the same limits.
    """
    return 60.0 * way_c / ramp_c_per_min + (COUNTED_SETTLING_S if way_c > band_c else 0.0)
