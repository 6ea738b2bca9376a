"""Coverage of delay, bandwidth and scale factor over simulated sweeps, and what is named of them.

Each campaign is another unit and another noise on recipe `sweeps` (ramps both ways, a sine sweep to 10 Hz, 100 readings
per second). The simulated physics shares no formula with the fit.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from labctl.fitting import fit, fit_data_of
from labctl.fitting.criticism import criticise
from labctl.fitting.models.presets import preset_for
from labctl.recording import Recording
from labctl.services.simulation.recordings import SimulateRequest, make_recording

HIDDEN = {"time_delay": 0.005, "bandwidth": 1.0 / (2 * np.pi * 40.0)}
BASE = ["bias", "scale_factor", "scale_factor_odd", "scale_factor_even"]
#: Hidden effects by the name of a cell.
CELLS = {
    "nothing": (), "time_delay": ("time_delay",), "bandwidth": ("bandwidth",), "both": ("time_delay", "bandwidth"),
}  # fmt: skip


@dataclass(frozen=True)
class Covered:
    """Errors of one coefficient over campaigns, in its unit, and its standard uncertainties, (n,) each."""

    errors: np.ndarray
    u: np.ndarray

    @property
    def percent(self) -> float:
        """Share of errors within two standard uncertainties, %."""
        return 100.0 * float(np.mean(np.abs(self.errors) <= 2 * self.u))

    @property
    def bias_over_u(self) -> float:
        """Mean error over the usual uncertainty of one campaign."""
        return float(self.errors.mean() / np.median(self.u))


def recording_of(seed: int, hidden: Iterable[str]) -> Recording:
    """Return one simulated campaign."""
    hide = [f"{name}={HIDDEN[name]:.12g}" for name in hidden]
    return make_recording(SimulateRequest(recipe="sweeps", hide=hide, seed=seed, sample_rate_hz=100.0)).recording


def coverage(campaigns: int, first: int = 1) -> dict[str, Covered]:
    """Return coefficient -> coverage with both hidden; the scale factor against the same unit without them."""
    errors: dict[str, list[tuple[float, float]]] = {}
    for seed in range(first, first + campaigns):
        with_both = _coefficients(recording_of(seed, HIDDEN), [*BASE, "time_delay", "bandwidth"])
        without = _coefficients(recording_of(seed, ()), BASE)
        true = {"delay": HIDDEN["time_delay"], "bandwidth": 40.0, "scale_factor": without["scale_factor"][0]}
        for name, value in true.items():
            errors.setdefault(name, []).append((with_both[name][0] - value, with_both[name][1]))
    return {name: Covered(*np.array(pairs).T) for name, pairs in errors.items()}


def named(campaigns: int, hidden: Iterable[str], first: int = 1) -> Counter[str]:
    """Return how often each answer came: the verdict and what it names."""
    found: Counter[str] = Counter()
    for seed in range(first, first + campaigns):
        recording = recording_of(seed, hidden)
        model, _ = preset_for(None, BASE).build(fit_data_of(recording))
        verdict = criticise(recording, model, full=False).verdict
        found[f"{verdict.form} {'+'.join(sorted(verdict.named))}".strip()] += 1
    return found


def _coefficients(recording: Recording, effects: list[str]) -> dict[str, tuple[float, float]]:
    entries = fit(recording, None, effects).to_json()["axes"]["z"]["coefficients"]
    found = {}
    for name, entry in entries.items():
        if isinstance(entry, dict) and isinstance(entry["value"], float) and isinstance(entry["u"], float):
            found[name] = entry["value"], entry["u"]
    return found


def run(campaigns: int = 100) -> str:
    """Return the tables of this study as text."""
    lines = [f"coverage of U (k = 2), {campaigns} campaigns, a delay of 5 ms and a bandwidth of 40 Hz hidden"]
    for name, one in coverage(campaigns).items():
        lines.append(f"{name:14s} {one.percent:5.1f} %   mean error {one.bias_over_u:+.2f} u")
    for cell, hidden in CELLS.items():
        lines.append(f"{cell:14s} {dict(named(max(campaigns // 5, 1), hidden))}")
    return "\n".join(lines)
