"""A g-sensitive unit off the table's axis, or an even nonlinearity: one at one radius, two after another radius."""

from __future__ import annotations

import pytest

from instruments.eccentricity import Eccentricity
from labctl.fitting.criticism import Criticism, criticise
from labctl.fitting.data.fit_data import fit_data_of
from labctl.fitting.data.joined import joined_recording
from labctl.fitting.models.presets import preset_for
from labctl.recording import Recording
from labctl.services.planning.loading import limits_of, load_bench, load_recipe
from labctl.services.simulation.plan_simulation import hidden_recording
from procedures.experiments import BLOCKS
from procedures.planning.plan import make_plan
from procedures.recipe.recipe import Recipe

SIZES = tuple(range(50, 401, 50))
RATES = (0, *(sign * size for size in SIZES for sign in (1, -1)))
ALIKE = "scale_factor_even"
DIRECTION = {"z": "x"}


def measured(recipe: Recipe, outward: dict[str, str], day: int, hidden: dict[str, float]) -> Recording:
    """Return what a MEMS gyro at 0.2 m from the axis of the table gives, and in the experiment at 0.05 m."""
    bench = load_bench("triaxial-sim")
    assert bench.simulation is not None
    where = Eccentricity(radius_m=0.2, other_radii_m=(0.05,), outward=outward)
    gyro = bench.gyros[0].model_copy(update={"axes": ("z",), "sample_rate_hz": 5.0})
    simulation = bench.simulation.model_copy(update={"noise_seed": day})
    bench = bench.model_copy(update={"eccentricity": where, "gyros": (gyro,), "simulation": simulation})
    return hidden_recording(make_plan(recipe, limits_of(bench)), bench, gyro, 1, hidden)


def criticised(recording: Recording) -> Criticism:
    model, _ = preset_for("bias_scale", []).build(fit_data_of(recording))
    return criticise(recording, model, full=False)


def before_and_after(outward: dict[str, str], hidden: dict[str, float]) -> list[tuple[str, tuple[str, ...]]]:
    """Return form and names of the verdict on the campaign alone, and together with the experiment."""
    recipe = load_recipe("quick-triaxial").model_copy(update={"positions": ("z",), "rates_dps": RATES})
    block = next(block for block in BLOCKS if block.id == "another_radius").changed(recipe)
    assert block is not None
    alone, experiment = measured(recipe, outward, 0, hidden), measured(block, outward, 1, hidden)
    verdicts = [criticised(each).verdict for each in (alone, joined_recording({1: alone, 2: experiment}))]
    return [(verdict.form, verdict.named) for verdict in verdicts]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("outward", "hidden", "named"),
    [
        (DIRECTION, {"cross_g_sensitivity": 0.03}, "cross_g_sensitivity"),
        ({}, {"cross_g_sensitivity": 0.03}, "centripetal_acceleration"),
        ({}, {"centripetal_acceleration": 0.03}, "centripetal_acceleration"),
        (DIRECTION, {"scale_factor_even": 5e-7}, "scale_factor_even"),
        ({}, {"scale_factor_even": 5e-7}, "scale_factor_even"),
    ],
)
def test_what_is_alike_at_one_radius_is_named_alone_after_another(
    outward: dict[str, str], hidden: dict[str, float], named: str
) -> None:
    """Where the direction is known, it is the sensor's sensitivity to a force across its axis; else the mounting's."""
    of_force = "cross_g_sensitivity" if outward else "centripetal_acceleration"
    (form, alike), after = before_and_after(outward, hidden)
    assert form == "ambiguous"
    assert {of_force, ALIKE} <= set(alike)
    assert after == ("missing", (named,))


@pytest.mark.slow
@pytest.mark.parametrize("outward", [DIRECTION, {}])
def test_nothing_is_named_where_nothing_is_hidden(outward: dict[str, str]) -> None:
    assert before_and_after(outward, {}) == [("adequate", ()), ("adequate", ())]
