"""Coverage of the uncertainty of scale factor, misalignment, bias and g-sensitivity from turns by hand.

Simulated units rest on six faces and are turned by hand about three axes, in both senses, by 360 deg with an error of
1 deg, or of what a fixture leaves. The hand never turns twice alike, and wobbles. How often the true coefficient lies
within U (k = 2) of the fitted one, pooled over axes.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from datetime import UTC, datetime
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from labctl.fitting import fit
from labctl.recording import Recording, RecordingInfo
from labctl.recording.checks import checked

SETS = 200
FIRST_SEED = 17_001
AXES = "xyz"
REST_S, STILL_S = 8.0, 0.8
#: Correlation time of the bias instability.
WANDER_TAU_S = 100.0
#: Cases: standard deviation of a turn, deg, turns in each sense, degrees of one turn.
CASES = {
    "360 +- 1 deg, once each way": (1.0, 1, 360.0),
    "360 +- 1 deg, three times each way": (1.0, 3, 360.0),
    "1080 +- 1 deg, once each way": (1.0, 1, 1080.0),
    "360 +- 0.02 deg in a fixture": (0.02, 2, 360.0),
}


@dataclass(frozen=True)
class Unit:
    """A tri-axial gyro: output = gain @ rate + bias + g_sensitivity @ force, deg/s and g."""

    gain: NDArray[np.float64]  #: (3, 3)
    bias: NDArray[np.float64]  #: (3,)
    g_sensitivity: NDArray[np.float64]  #: (3, 3)
    noise_dps: float  #: of a reading
    wander_dps: float  #: of the bias, with a correlation time of WANDER_TAU_S

    @staticmethod
    def drawn(rng: np.random.Generator) -> Unit:
        """Return a MEMS gyro."""
        gain = np.eye(3) + np.where(np.eye(3) > 0, rng.normal(0, 0.02, (3, 3)), rng.normal(0, 0.01, (3, 3)))
        return Unit(gain, rng.normal(0, 0.5, 3), rng.normal(0, 0.01, (3, 3)), 0.08, 0.003)


def hand_motion(rng: np.random.Generator, turn_deg: float, axis: int, rate_hz: float) -> NDArray[np.float64]:
    """Return the rate about the body axes of one turn by hand, (n, 3) deg/s, at rest at both ends."""
    length_s = float(rng.uniform(3.0, 6.0)) * abs(turn_deg) / 360.0
    n, still = round(length_s * rate_hz), round(STILL_S * rate_hz)
    at = np.linspace(0.0, 1.0, n)
    pushes = np.clip(1.0 + 0.4 * np.sin(2 * np.pi * (rng.uniform(2, 5) * at + rng.uniform())), 0.1, None)
    course = pushes * (at * (1 - at)) ** 2
    rates = np.zeros((n + 2 * still, 3))
    rates[still:-still, axis] = course * turn_deg * rate_hz / course.sum()
    for other in set(range(3)) - {axis}:  # there and back: a wobble that leaves no angle
        rates[still:-still, other] = 5.0 * rng.normal() * np.sin(2 * np.pi * at) * (at * (1 - at)) * 4
    return rates


def measured(
    rng: np.random.Generator, unit: Unit, u_deg: float, each_way: int, turn_deg: float, rate_hz: float = 100.0
) -> Recording:
    """Return the recording of six rests and of the turns about every axis in both senses, as labctl takes it in."""
    plan = [(sign + axis, 0.0) for axis in AXES for sign in ("", "-")]
    plan += [(axis, way * turn_deg) for axis in AXES for _ in range(each_way) for way in (1.0, -1.0)]
    parts: dict[str, list[NDArray[np.generic]]] = defaultdict(list)
    begin_s, wander = 0.0, _wander_dps(rng, unit, len(plan))
    for number, (position, said_deg) in enumerate(plan, start=1):
        axis, up = AXES.index(position[-1]), -1.0 if position[0] == "-" else 1.0
        rates = np.zeros((round(REST_S * rate_hz), 3))
        if said_deg:
            rates = hand_motion(rng, said_deg + rng.normal(0, u_deg), axis, rate_hz)
        force = np.zeros(3)
        force[axis] = up
        steady = unit.bias + unit.g_sensitivity @ force + wander[number - 1]
        output = rates @ unit.gain.T + steady + rng.normal(0, unit.noise_dps, rates.shape)
        n = len(rates)
        columns = {"dataset": number, "position": position, "turn_deg": said_deg, "turn_u_deg": u_deg}
        for name, value in columns.items():
            parts[name].append(np.full(n, value))
        parts["t_s"].append(begin_s + np.arange(n) / rate_hz)
        for k, name in enumerate(AXES):
            parts[f"gyro_{name}"].append(output[:, k])
        begin_s += n / rate_hz + 2.0
    info = RecordingInfo(
        serial="HAND", axes=("x", "y", "z"), kind="samples", motion="turns", started_at=datetime(2026, 1, 5, tzinfo=UTC)
    )
    return Recording(info, checked(Path("simulated"), info, {k: np.concatenate(v) for k, v in parts.items()}))


def _wander_dps(rng: np.random.Generator, unit: Unit, sets: int) -> NDArray[np.float64]:
    """Return the bias of each data set about that of the session, (sets, 3) deg/s."""
    kept = np.exp(-(REST_S + 2.0) / WANDER_TAU_S)
    found = rng.normal(0, unit.wander_dps, (sets, 3))
    for before, now in pairwise(found):
        now[:] = kept * before + np.sqrt(1 - kept**2) * now
    return np.asarray(found - found.mean(axis=0))


def truths(unit: Unit, axis: str) -> dict[str, float]:
    """Return the coefficients that a fit of one axis should find, by name."""
    row = AXES.index(axis)
    found = {"bias": unit.bias[row], "scale_factor": unit.gain[row, row] - 1, "g_own": unit.g_sensitivity[row, row]}
    for k, other in enumerate(AXES):
        if k != row:
            found |= {f"misalignment_{other}": unit.gain[row, k], f"g_{other}": unit.g_sensitivity[row, k]}
    return {name: float(value) for name, value in found.items()}


def deviations(seed: int, u_deg: float, each_way: int, turn_deg: float) -> dict[str, list[float]]:
    """Return kind of coefficient -> deviations from the truth of one simulated set, in standard uncertainties."""
    rng = np.random.default_rng(seed)
    unit = Unit.drawn(rng)
    answer = fit(measured(rng, unit, u_deg, each_way, turn_deg), "turns").to_json()
    found: dict[str, list[float]] = defaultdict(list)
    for axis in AXES:
        coefficients = answer["axes"][axis]["coefficients"]
        for name, truth in truths(unit, axis).items():
            kind = "g-sensitivity" if name.startswith("g_") else name.split("_")[0]
            value, u = (np.asarray(coefficients[name][key]).item() for key in ("value", "u"))
            found[kind].append((value - truth) / u)
    return found


def run(sets: int = SETS) -> str:
    """Return a table: share of coefficients within U (k = 2), by case and kind."""
    lines = [f"   {sets} sets of turns a case; share within U (k = 2), and root mean square of the deviation over u"]
    for case, (u_deg, each_way, turn_deg) in CASES.items():
        pooled: dict[str, list[float]] = defaultdict(list)
        for k in range(sets):
            for kind, values in deviations(FIRST_SEED + k, u_deg, each_way, turn_deg).items():
                pooled[kind] += values
        parts = [
            f"{kind} {100 * np.mean(np.abs(values) <= 2):.1f} % ({np.sqrt(np.mean(np.square(values))):.2f})"
            for kind, values in pooled.items()
        ]
        lines.append(f"   {case:36} {', '.join(parts)}")
    return "\n".join(lines)
