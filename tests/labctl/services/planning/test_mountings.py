"""What opposite mountings are worth, before the run, against the budget of a fit to the run."""

from __future__ import annotations

from typing import Any

import pytest

from labctl.calibration import read_calibration
from labctl.recording import to_points
from labctl.services.calibrations.fitting import fit_unit
from labctl.services.calibrations.uncertainty import coefficients_at
from labctl.services.planning.loading import limits_of, load_bench, load_recipe
from labctl.services.planning.mountings import misalignment_outlook
from labctl.services.schemas.calibrations import FitRequest
from labctl.services.simulation.plan_simulation import hidden_recording
from labctl.store import open_store
from procedures.planning.plan import make_plan
from procedures.recipe.recipe import Recipe
from procedures.recipe.rules import Inverted
from tests.helpers.certificates import AT

BENCH = load_bench("triaxial-sim")
INVERTED = Inverted(temperatures_c=(30.0,), rates_dps=(400.0, -400.0, 0.0))
SIX = ("x", "-x", "y", "-y", "z", "-z")


def outlook(recipe: Recipe) -> Any:
    return misalignment_outlook(make_plan(recipe, limits_of(BENCH)), BENCH, limits_of(BENCH))


@pytest.mark.parametrize(
    "changes", [{}, {"inverted": INVERTED}, {"positions": SIX}], ids=["three mountings", "inverted", "six faces"]
)
def test_the_budget_of_the_fit_is_what_the_plan_said(changes: dict[str, Any], tmp_path: Any) -> None:
    recipe = load_recipe("quick-triaxial").model_copy(update=changes)
    said = outlook(recipe)
    gyro = BENCH.gyros[0].model_copy(update={"sample_rate_hz": 4.0})
    recording = hidden_recording(make_plan(recipe, limits_of(BENCH)), BENCH, gyro, 3, {})
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as store:
        store.recordings.add_import(to_points(recording), AT)
        fit_unit(store, "STIM-0001", FitRequest(effects=["bias", "scale_factor", "misalignment"]), AT)
        calibration = read_calibration(store.calibrations.document("STIM-0001", 1)[0])
    budget = coefficients_at(calibration, 25.0)["x"]["misalignment_y"]
    of_bench = sum((line.contribution or 0.0) ** 2 for line in budget.lines if line.source in {"fixture_angle", "tilt"})
    assert 2.0 * of_bench**0.5 == pytest.approx(said.expanded, rel=2e-3)
    assert (said.with_opposite is None) is bool(changes)


def test_opposite_mountings_halve_the_variance_and_cost_one_soak_each() -> None:
    said = outlook(load_recipe("quick-triaxial"))
    assert said.with_opposite == pytest.approx(said.expanded / 2**0.5, rel=1e-9)
    rules = Inverted(temperatures_c=tuple(said.inverted_temperatures_c), rates_dps=tuple(said.inverted_rates_dps))
    longer = load_recipe("quick-triaxial").model_copy(update={"inverted": rules})
    plans = [make_plan(recipe, limits_of(BENCH)) for recipe in (load_recipe("quick-triaxial"), longer)]
    assert plans[1].expected_s - plans[0].expected_s == pytest.approx(said.more_s)
    assert outlook(longer).expanded == pytest.approx(said.with_opposite)


def test_where_no_output_lies_across_nothing_is_said() -> None:
    bench = load_bench("single-axis-sim")
    assert misalignment_outlook(make_plan(load_recipe("short"), limits_of(bench)), bench, limits_of(bench)) is None


def test_where_the_bench_states_nothing_nothing_is_known() -> None:
    bare = BENCH.model_copy(update={"standards": ()})
    plan = make_plan(load_recipe("quick-triaxial"), limits_of(bare))
    assert misalignment_outlook(plan, bare, limits_of(bare)) is None
