"""(c) The fibre-optic gyro of Ojeda et al. 2000: error per rate, and per full turn."""

from __future__ import annotations

import numpy as np

from labctl.cli.demo.runner import DemoRunner
from labctl.cli.output import table
from labctl.error_per_turn import MIN_RATE_DPS, error_per_turn
from labctl.fitting import fit, fit_data_of

SERIAL = "FOG-0001"


def play(demo: DemoRunner) -> None:
    """Measure, fit, and show what is left per rate and per turn of 360 deg."""
    demo.title("(c) Fibre-optic gyro: 21 rates x 11 temperatures on a single-axis table")
    answer = demo.campaign("ojeda2000", "single-axis-sim")
    recording = answer.recordings[SERIAL]
    fitted = demo.fit(SERIAL, "ojeda2000", recording)
    points = demo.store.recordings.points(recording)
    context, result = fit_data_of(points), fit(points, "ojeda2000")
    rate = np.asarray(points.columns["table_rate_dps"], dtype=np.float64)
    raw = context.outputs["z"] - context.true_rate_dps("z")
    at_rest = np.abs(rate) < 1e-9
    bias = float(raw[at_rest].mean())
    rows = table(
        "RMS over all temperatures", "rate, deg/s", "error, deg/s", "compensated", "per turn, deg (less static bias)",
        "per turn, compensated", numbers=5,
    )  # fmt: skip
    for nominal_dps in np.unique(np.round(rate[np.abs(rate) >= MIN_RATE_DPS], 0))[::4]:
        at_rate = np.abs(rate - nominal_dps) < 0.5
        before, after = raw[at_rate], result.residual_dps["z"][at_rate]
        turns = (_rms(error_per_turn(errors, rate[at_rate])) for errors in (before - bias, after))
        rows.add_row(f"{nominal_dps:+.0f}", f"{_rms(before):.3f}", f"{_rms(after):.4f}", *(f"{t:.4f}" for t in turns))
    demo.console.print(rows)
    held = fitted.error.heldout_rms_dps
    assert held is not None
    assert fitted.error.raw_rms_dps is not None
    demo.figures["single_axis"] = {"raw_over_held_out": fitted.error.raw_rms_dps / held}
    demo.say(f"raw over held-out compensated error: {fitted.error.raw_rms_dps / held:.0f}")


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))
