"""Designed campaigns beside the standard one: bench hours, error on a held-out campaign, coverage of U, verdicts.

Units are those of the simulated world, each with its own laws and noise. Every unit is calibrated by each recipe in
turn and judged on a standard campaign (Table 1 x Table 2) of another day that no fit has seen: nine cells, the axis
that turns by the output, error over the noise floor of that campaign. A perfect model leaves 1 in the mean. Hours are
those of the plan on a bench where a person mounts the units. `LABCTL_STUDY_UNITS` is how many units,
`LABCTL_STUDY_WORKERS` how many processes, `LABCTL_STUDY_SEED` the first seed.
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from instruments.bench_config import BenchFile, SimulationSettings
from instruments.clock import VirtualClock
from instruments.simulation import open_simulation
from instruments.standards import Standard
from labctl.answers.design import DesignRequest, DesignResponse
from labctl.errors import LabctlError
from labctl.fitting.criticism import criticise
from labctl.fitting.data.channels import BODY_AXES, Channels
from labctl.fitting.data.fit_data import FitData, fit_data_of
from labctl.fitting.estimation.axis_solutions import fit_turning, residuals
from labctl.fitting.estimation.fit import fit_preset
from labctl.fitting.models.fitted_model import FittedModel
from labctl.fitting.models.presets import Preset, preset_for
from labctl.fitting.numeric.blas_threads import single_threaded
from labctl.fitting.uncertainty import conditions_of, rate_vector_uncertainty, use_evidence
from labctl.recording import Recording
from labctl.services.design.design import design_campaign
from labctl.services.planning.loading import limits_of, load_bench, load_recipe
from labctl.services.simulation.plan_simulation import simulate
from procedures.planning.plan import Plan, make_plan
from procedures.recipe.recipe import Recipe, parse_recipe
from studies.rate_vector_simulation import in_ball
from studies.report_tables import wilson

Array = NDArray[np.float64]
UNITS = int(os.environ.get("LABCTL_STUDY_UNITS", "20"))
WORKERS = int(os.environ.get("LABCTL_STUDY_WORKERS", "2"))
FIRST_SEED = int(os.environ.get("LABCTL_STUDY_SEED", "90001"))
STANDARD, BENCH = "table1-x-table2", "triaxial-sim"
#: Readings per second: the noise of a mean does not depend on it.
READINGS_HZ = 4.0
#: The design with a tilted fixture, and the standard uncertainty of its direction.
TILTED, TILTED_U_DEG = "designed, U = 0.004 deg/s, tilted fixture", 0.05
#: One unit in so many is also criticised.
VERDICTS = 5
#: What a cell may have, over the floor.
ALLOWED = 1.2
#: Rate vectors of each unit in the coverage, and the drift of a later day, deg/s, that of the simulated units.
VECTORS, DRIFT_DPS = 50, 0.0015
#: What is hidden in the units of the last table, by effect.
HIDDEN: Mapping[str, Mapping[str, float]] = {
    "nothing": {}, "thermal_lag": {"thermal_lag": 0.005}, "thermal_hysteresis": {"thermal_hysteresis": 0.01},
    "scale_factor_odd": {"scale_factor_odd": 1e-4},
}  # fmt: skip
CELLS = tuple((turned, output) for turned in BODY_AXES for output in BODY_AXES)


@dataclass(frozen=True)
class Case:
    """A recipe and the model that is fitted to it."""

    name: str
    recipe: Recipe
    model: str
    effects: tuple[str, ...] = ()

    @property
    def preset(self) -> Preset:
        """How to make its model."""
        return preset_for(self.model, list(self.effects))


@dataclass(frozen=True)
class Judged:
    """One unit by one case: mean square error and floor of each cell, (9,) (deg/s)^2; None where it does not fit."""

    case: str
    squares: NDArray[np.float64] | None
    floors: NDArray[np.float64]


def cut(name: str, temperatures: Sequence[float], rates: Sequence[float], hold_s: float) -> Recipe:
    """Return the standard recipe with fewer temperatures and rates, and shorter soaks."""
    standard = load_recipe(STANDARD)
    soak = {"hold_s": hold_s, "drift_window_s": min(max(hold_s, 10.0), 600.0), "max_drift_c": 50.0}
    changes = {"name": name, "temperatures_c": list(temperatures), "rates_dps": list(rates), "soak": soak, "fit": None}
    return Recipe.model_validate({**standard.model_dump(), **changes})


def both(*sizes: float) -> list[float]:
    """Return rest and rates of both signs, deg/s."""
    return [0.0, *(sign * size for size in sizes for sign in (1.0, -1.0))]


@lru_cache(maxsize=1)
def cases() -> tuple[Case, ...]:
    """Return what is compared."""
    standard = load_recipe(STANDARD)
    four, five = (-40.0, -10.0, 20.0, 50.0), (-40.0, -20.0, 0.0, 20.0, 50.0)
    return (
        Case("table1-x-table2", standard, "yang2018"),
        Case("table1-x-table2, bias_scale", standard, "bias_scale"),
        Case("4 temperatures x 5 rates, soak 10 min", cut("cut-a", four, both(100, 400), 600), "yang2018"),
        Case("5 x 9, soak 15 min", cut("cut-b", five, both(50, 100, 200, 400), 900), "yang2018"),
        Case("10 x 5, no soaks, bias_scale", cut("cut-c", standard.temperatures_c, both(100, 400), 0), "bias_scale"),
        Case("niu2013", load_recipe("niu2013"), "bias_scale"),
        *(_case(name, asked) for name, asked in DESIGNS.items()),
    )


@lru_cache(maxsize=1)
def tilted_bench() -> BenchFile:
    """Return the bench with a tilted fixture too, which is off five times as much as the faces of the cube."""
    bench = load_bench(BENCH)
    fixture = Standard(quantity="tilted_fixture_angle", u=TILTED_U_DEG)
    return bench.model_copy(update={"tilted_positions": ("x+y+z",), "standards": (*bench.standards, fixture)})


#: The hours are those of a bench that mounts the units itself: a person takes half an hour more for three mountings.
DESIGNS: Mapping[str, Mapping[str, object]] = {
    "designed, U = 0.004 deg/s": {"model": "bias_scale", "u_dps": 0.004},
    "designed, best within 10 h": {"model": "bias_scale", "hours": 9.5},
    "designed, yang2018, U = 0.01 deg/s": {"model": "yang2018", "u_dps": 0.01},
    TILTED: {"model": "bias_scale", "u_dps": 0.004},
}


@lru_cache(maxsize=8)
def designed(name: str) -> DesignResponse:
    """Return a design on the simulated bench."""
    bench = tilted_bench() if name == TILTED else load_bench(BENCH)
    return design_campaign(None, DesignRequest.model_validate({"like": STANDARD, **DESIGNS[name]}), bench)


def _case(name: str, asked: Mapping[str, object]) -> Case:
    answer = designed(name)
    return Case(name, parse_recipe(answer.recipe_toml), str(asked["model"]), tuple(answer.effects))


def hours(recipe: Recipe) -> float:
    """Return the expected hours of a recipe where a person mounts the units."""
    return make_plan(recipe, replace(limits_of(tilted_bench()), needs_person=True)).expected_s / 3600.0


def measured(recipe: Recipe, seed: int, day: int, **settings: object) -> tuple[Plan, BenchFile, Recording]:
    """Return a campaign of the unit of a seed on a day."""
    bench = tilted_bench()
    gyro = bench.gyros[0].model_copy(update={"sample_rate_hz": READINGS_HZ})
    simulation = SimulationSettings.model_validate({"seed": seed, "noise_seed": day, **settings})
    bench = bench.model_copy(update={"gyros": (gyro,), "simulation": simulation})
    plan = make_plan(recipe, limits_of(bench))
    return plan, bench, simulate(plan, bench, gyro)


@single_threaded
def judged(number: int) -> list[Judged]:
    """Return how one unit is calibrated by every case, judged on a standard campaign of another day."""
    seed = FIRST_SEED + number
    held_out = fit_data_of(measured(load_recipe(STANDARD), seed, 1)[2])
    floors = _cells(held_out, {axis: held_out.noise_floor.axes[axis].floor_dps for axis in held_out.outputs})
    found = []
    for case in cases():
        data = fit_data_of(measured(case.recipe, seed, 0)[2])
        try:
            fitted = fit_preset(data, case.preset).fitted
        except LabctlError:
            found.append(Judged(case.name, None, floors))
            continue
        errors = residuals(_in_use(fitted), held_out, fit_turning(_in_use(fitted), held_out))
        found.append(Judged(case.name, _cells(held_out, errors), floors))
    return found


def _in_use(fitted: FittedModel) -> FittedModel:
    """Return what a calibration contains."""
    return fitted.exported()[0]


def _cells(data: FitData, values: Mapping[str, NDArray[np.float64]]) -> NDArray[np.float64]:
    """Return the mean squares of values of the data sets by the axis that turns and the output, (9,)."""
    position = np.asarray(data.channels["position"]).astype(np.str_)
    return np.array([np.mean(values[output][position == turned] ** 2) for turned, output in CELLS])


@dataclass(frozen=True)
class Covered:
    """Whether errors of one unit are within U, (vectors, outputs)."""

    case: str
    by_campaign: NDArray[np.bool_]  #: the error of the coefficients alone, within U of these
    promised: Array  #: bench off as its standards state, a later day: within U of the calibration; NaN: unknown
    over_predicted: float  #: mean square of the error of the coefficients over that of U / 2 before the campaign


def true_output(bench: BenchFile, rates: Array, warm: Array) -> Array:
    """Return the outputs of the unit of a bench, (n, 3) deg/s, at rates (n, 3) and temperatures (n,), without noise."""
    truth = open_simulation(bench, VirtualClock()).world.gyro(bench.gyros[0].name).truth
    return np.asarray(np.einsum("nij,nj->ni", truth.gain(warm), rates) + truth.offset(warm))


def corrected(fitted: FittedModel, output: Array, warm: Array) -> Array:
    """Return corrected rates, (n, 3) deg/s."""
    outputs = {axis: output[:, i] for i, axis in enumerate(BODY_AXES)}
    rates = fitted.compensate(outputs, _channels(output, warm))
    return np.stack([rates[axis] for axis in BODY_AXES], axis=1)


def _channels(rates: Array, warm: Array) -> Channels:
    columns = {"temperature_c": warm, "table_rate_dps": rates[:, 0], "position": np.full(len(warm), "x")}
    return Channels(columns, {axis: rates[:, i] for i, axis in enumerate(BODY_AXES)})


def coefficient_u(fitted: FittedModel, rates: Array, warm: Array) -> Array:
    """Return the standard uncertainty of corrected rates by the coefficients alone, (n, 3) deg/s."""
    channels, found = _channels(rates, warm), []
    for axis in BODY_AXES:
        fit = fitted.axes[axis]
        basis = fitted.model.temperature.basis(warm)
        values = {column.name: column.values for _, column in fitted.model.columns(channels, axis)}
        jacobian = np.concatenate([values[name][:, None] * basis for name in fit.names], axis=1)
        found.append(np.sqrt(np.sum((jacobian @ fit.covariance) * jacobian, axis=1)))
    return np.stack(found, axis=1)


@single_threaded
def covered(number: int) -> list[Covered]:
    """Return whether the errors of one unit's corrected rates are within U, for each designed campaign."""
    seed = FIRST_SEED + 10_000 + number
    rng = np.random.default_rng([seed, 1])
    rates, warm = in_ball(rng, VECTORS, 400.0), rng.uniform(-40.0, 50.0, VECTORS)
    found = []
    for case in (each for each in cases() if each.name in DESIGNS):
        _, bench, recording = measured(case.recipe, seed, 0)
        fitted = _in_use(fit_preset(fit_data_of(recording), case.preset).fitted)
        error = corrected(fitted, true_output(bench, rates, warm), warm) - rates
        within = np.abs(error) <= 2.0 * coefficient_u(fitted, rates, warm)
        predicted = designed(case.name).chosen.u_rms_dps / 2.0
        promised = _promised(case, seed, rates, warm, rng)
        found.append(Covered(case.name, within, promised, float(np.mean(error**2)) / predicted**2))
    return found


def _promised(case: Case, seed: int, rates: Array, warm: Array, rng: np.random.Generator) -> Array:
    """Return whether errors are within the U of a calibration, 1 or 0, (n, 3): on a bench that is off, on a later day.

    NaN where U is unknown.
    """
    _, bench, recording = measured(case.recipe, seed, 0, draw_standards=True)
    data = fit_data_of(recording)
    result, evidence = fit_preset(data, case.preset), use_evidence(data, case.preset)
    conditions = conditions_of(recording.info, result.environment, mountings=result.mountings)
    fitted = _in_use(result.fitted)
    output = true_output(bench, rates, warm) + rng.normal(0.0, DRIFT_DPS, rates.shape)
    error = corrected(fitted, output, warm) - rates
    claimed = [
        rate_vector_uncertainty(
            fitted, dict(zip(BODY_AXES, rate, strict=True)), at, evidence=evidence, name="unit", bench=conditions
        ).budgets
        for rate, at in zip(rates.tolist(), warm.tolist(), strict=True)
    ]
    u = np.array([[each[axis].expanded or np.nan for axis in BODY_AXES] for each in claimed])
    return np.where(np.isnan(u), np.nan, np.abs(error) <= u)


@single_threaded
def verdict(number: int) -> list[tuple[str, str]]:
    """Return what is hidden in one unit, and what a criticism of its designed campaign says."""
    found = []
    case = next(each for each in cases() if each.name == next(iter(DESIGNS)))
    for name, hidden in HIDDEN.items():
        recording = measured(case.recipe, FIRST_SEED + 20_000 + number, 0, hidden=dict(hidden))[2]
        data = fit_data_of(recording)
        model, _ = preset_for(case.model, []).build(data)
        said = criticise(recording, model, full=False).verdict
        found.append((name, f"{said.form}: {', '.join(sorted(said.named))}" if said.named else said.form))
    return found


def run(units: int = UNITS) -> str:
    """Print the tables as they come, and return the last one."""
    with ProcessPoolExecutor(max_workers=WORKERS) as pool:
        cells = _cell_table([each for found in pool.map(judged, range(units)) for each in found], units)
        print(cells, flush=True)
        cover = _cover_table([each for found in pool.map(covered, range(units)) for each in found], units)
        print(f"\n{cover}", flush=True)
        of_verdicts = [each for found in pool.map(verdict, range(max(units // VERDICTS, 1))) for each in found]
    return f"\n{_verdict_table(of_verdicts)}"


def _cell_table(found: Sequence[Judged], units: int) -> str:
    cells = [f"{turned}>{output}" for turned, output in CELLS]
    lines = [
        "| recipe | h | n | error, deg/s | floor | " + " | ".join(cells) + " | worst | units with all nine in 1.2 |",
        "| --- " * (len(cells) + 7) + "|",
    ]
    for case in cases():
        of_case = [each for each in found if each.case == case.name]
        fitted = [each for each in of_case if each.squares is not None]
        if not fitted:
            lines.append(f"| {case.name} | {hours(case.recipe):.1f} | 0 of {units} | does not fit |")
            continue
        squares, floors = (np.array([getattr(each, name) for each in fitted]) for name in ("squares", "floors"))
        pooled = np.sqrt(squares.mean(axis=0) / floors.mean(axis=0))
        good = int(np.sum(np.all(squares <= ALLOWED**2 * floors, axis=1)))
        low, high = wilson(good, len(fitted))
        each_cell = " | ".join(f"{value:.2f}" for value in pooled)
        in_all = f"{good} ({100 * low:.0f} to {100 * high:.0f} %)"
        lines.append(
            f"| {case.name} | {hours(case.recipe):.1f} | {len(fitted)} | {np.sqrt(squares.mean()):.4f} | "
            f"{np.sqrt(floors.mean()):.4f} | {each_cell} | {pooled.max():.2f} | {in_all} |"
        )
    return "\n".join(lines)


def _cover_table(found: Sequence[Covered], units: int) -> str:
    lines = [
        f"| within U (k = 2), %; n = {units} x {VECTORS} | coefficients | promise | unknown, % | rms / predicted |",
        "| --- | --- | --- | --- | --- |",
    ]
    for name in DESIGNS:
        of_case = [each for each in found if each.case == name]
        over = float(np.sqrt(np.mean([each.over_predicted for each in of_case])))
        texts = [_interval([np.nanmean(getattr(each, key)) for each in of_case]) for key in ("by_campaign", "promised")]
        unknown = 100 * float(np.mean([np.isnan(each.promised).mean() for each in of_case]))
        lines.append(f"| {name} | {texts[0]} | {texts[1]} | {unknown:.1f} | {over:.2f} |")
    return "\n".join(lines)


def _interval(shares: Sequence[float]) -> str:
    """Return the mean of shares of units, %, with its 95 % interval: the vectors of a unit are not independent."""
    middle, half = float(np.mean(shares)), 1.96 * float(np.std(shares, ddof=1)) / np.sqrt(len(shares))
    return f"{100 * middle:.1f} ({100 * (middle - half):.1f} to {min(100 * (middle + half), 100):.1f})"


def _verdict_table(found: Sequence[tuple[str, str]]) -> str:
    lines = [f"| hidden, in {next(iter(DESIGNS))} | verdicts |", "| --- | --- |"]
    for name in HIDDEN:
        counts = Counter(said for hidden, said in found if hidden == name)
        lines.append(f"| {name} | " + "; ".join(f"{said} {n}" for said, n in counts.most_common()) + " |")
    return "\n".join(lines)
