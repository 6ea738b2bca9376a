"""(e) The tri-axial campaign of Yang et al. 2018, judged on a second campaign that the fit did not use."""

from __future__ import annotations

import numpy as np

from labctl.calibration import read_calibration
from labctl.cli.demo.runner import DemoRunner
from labctl.cli.output import table
from labctl.fitting import ErrorSummary, FitData, by_turning_axis, fit_turning, residuals

SERIAL = "STIM-0001"
#: Recipe of the campaign that judges the fit.
SECOND = "quick-triaxial"


def play(demo: DemoRunner, *, quick: bool) -> None:
    """Measure, fit two models, measure again, and compare."""
    size = "a small campaign, 20 min soaks" if quick else "10 temperatures x 21 rates x 3 positions, 1 h soaks"
    demo.title(f"(e) Tri-axial MEMS gyro: {size}")
    recipe = "quick-triaxial" if quick else "table1-x-table2"
    first = demo.campaign(recipe, "triaxial-sim")
    versions = {
        model: demo.fit(SERIAL, model, first.recordings[SERIAL]).version for model in ("yang2018", "single_temperature")
    }
    demo.say("the same unit on another day, with data that no fit used:")
    second = demo.campaign(SECOND, "triaxial-sim", noise_seed=1)
    context = demo.context(second.recordings[SERIAL])
    errors = {"raw": {axis: context.outputs[axis] - context.true_rate_dps(axis) for axis in context.outputs}}
    for model, version in versions.items():
        document, _ = demo.store.calibrations.document(SERIAL, version)
        fitted = read_calibration(document).fitted
        errors[model] = residuals(fitted, context, fit_turning(fitted, context))
    print_tables(demo, context, errors)
    floor = demo.store.calibrations.get(SERIAL, versions["yang2018"]).answer["error"]["noise_floor_dps"]
    assert floor is not None
    over_floor = {axis: float(np.sqrt(np.mean(values**2))) / floor for axis, values in errors["yang2018"].items()}
    demo.figures["triaxial"] = {
        "held_out_rms_over_floor": {**over_floor},
        "raw_over_compensated": {**_gains(context, errors)},
    }
    ratios = ", ".join(f"{axis} {r:.2f}" for axis, r in over_floor.items())
    demo.say(
        f"yang2018 on the second campaign, RMS error divided by the noise floor: {ratios} (1 is the best possible)"
    )


def _gains(context: FitData, errors: dict[str, dict[str, np.ndarray]]) -> dict[str, float]:
    """Return raw over compensated RMS for the two large cross axes: x turning seen in y, and y turning seen in x."""
    raw, yang_errors = by_turning_axis(context, errors["raw"]), by_turning_axis(context, errors["yang2018"])
    return {f"{a}->{b}": raw[a][b].rms_dps / yang_errors[a][b].rms_dps for a, b in (("x", "y"), ("y", "x"))}


def print_tables(demo: DemoRunner, context: FitData, errors: dict[str, dict[str, np.ndarray]]) -> None:
    """Print what is shaped like the paper's Tables 3 and 4: by turning axis and output axis."""
    split = {name: by_turning_axis(context, values) for name, values in errors.items()}
    third = table(
        "mean and RMS, deg/s (as Table 3)", "turns", "output", "mean", "RMS", "mean after", "RMS after", numbers=4
    )
    fourth = table(
        "RMS, deg/s (as Table 4)", "turns", "output", "uncompensated", "single temperature", "yang2018", numbers=3
    )
    for turning, outputs in split["raw"].items():
        for output, before in outputs.items():
            after: ErrorSummary = split["yang2018"][turning][output]
            single = split["single_temperature"][turning][output]
            third.add_row(
                turning, output, *(f"{v:.4f}" for v in (before.mean_dps, before.rms_dps, after.mean_dps, after.rms_dps))
            )
            fourth.add_row(turning, output, *(f"{s.rms_dps:.4f}" for s in (before, single, after)))
    demo.console.print(third)
    demo.console.print(fourth)
