"""Simulated ramps and sweeps: what is hidden is found, and the encoder has its errors."""

from __future__ import annotations

import numpy as np
import pytest

from instruments.bench_config import SimulationSettings
from instruments.simulators.hidden import EFFECTS
from instruments.simulators.physics.world import ProfileMotion
from labctl.errors import BadInput
from labctl.fitting import fit
from labctl.fitting.models.fitted_model import FittedModel
from labctl.fitting.uncertainty import response_budgets
from labctl.fitting.uncertainty.conditions import conditions_of
from labctl.recording import Recording
from labctl.recording.columns import RATE_TIME_U
from labctl.recording.sanity import inspect_recording
from labctl.services.planning.loading import limits_of, load_bench
from labctl.services.simulation.plan_simulation import simulate
from procedures.planning.plan import make_plan
from procedures.recipe.recipe import parse_recipe

RECIPE = """
name = "short-sweep"
temperatures_c = [25]
rates_dps = [0]
positions = ["z"]

[[profiles]]
kind = "sine_sweep"
amplitude_dps = {amplitude}
from_hz = 0.2
to_hz = 10
duration_s = 30

[[profiles]]
kind = "ramp"
from_dps = -30
to_dps = 30
duration_s = 10

[soak]
hold_s = 7200
timeout_s = 14400
[acquire]
duration_s = 5
"""
EFFECTS_FITTED = ["bias", "scale_factor", "scale_factor_odd", "scale_factor_even", "time_delay"]


def simulated(amplitude_dps: float = 40.0, table: dict[str, object] | None = None, **hidden: float) -> Recording:
    """Return a recording of the recipe, 100 readings per second, with effects hidden and a table with settings."""
    bench = load_bench("single-axis-sim")
    gyro = bench.gyros[0].model_copy(update={"sample_rate_hz": 100.0})
    settings = SimulationSettings(seed=5, table=table or {}, hidden=dict(hidden))
    bench = bench.model_copy(update={"gyros": (gyro,), "simulation": settings})
    plan = make_plan(parse_recipe(RECIPE.format(amplitude=amplitude_dps)), limits_of(bench))
    return simulate(plan, bench, gyro)


def coefficient(recording: Recording, effects: list[str], name: str) -> tuple[float, float]:
    """Return a fitted coefficient of axis z with its standard uncertainty."""
    entry = fit(recording, None, effects).to_json()["axes"]["z"]["coefficients"][name]
    assert isinstance(entry, dict)
    value, u = entry["value"], entry["u"]
    assert isinstance(value, float)
    assert isinstance(u, float)
    return value, u


@pytest.mark.slow
def test_a_hidden_delay_is_found_and_the_recording_is_a_sound_profile() -> None:
    recording = simulated(time_delay=0.005)
    assert recording.info.motion == "profile"
    assert inspect_recording(recording) == []
    assert len(np.unique(recording.columns["dataset"])) == 3
    value, u = coefficient(recording, EFFECTS_FITTED, "delay")
    assert value == pytest.approx(0.005, abs=3 * u)
    assert u < 1e-5


@pytest.mark.slow
def test_a_simulated_profile_states_the_time_of_its_reference() -> None:
    """Without wires it is known: the budget of a delay has a line of 0, and none of unknown size."""
    recording = simulated(time_delay=0.005)
    assert not any(np.any(recording.columns[name]) for name in RATE_TIME_U)
    fitted = FittedModel.from_dict(fit(recording, None, EFFECTS_FITTED).fitted.to_dict())
    budget = response_budgets(fitted, evidence={}, bench=conditions_of(recording.info, {}))["z"]["delay"]
    assert budget.not_stated == ()
    assert {line.source: line.contribution for line in budget.lines}["table_time_common"] == 0.0


@pytest.mark.slow
def test_a_hidden_bandwidth_is_found_beside_a_delay() -> None:
    recording = simulated(time_delay=0.003, bandwidth=0.004)
    value, u = coefficient(recording, [*EFFECTS_FITTED, "bandwidth"], "bandwidth")
    assert value == pytest.approx(1 / (2 * np.pi * 0.004), abs=3 * u)
    assert u < 1.0


@pytest.mark.slow
def test_a_late_encoder_looks_like_an_early_gyro() -> None:
    """Delays are against the time stamps of the reference: nothing in the data tells whose clock is off."""
    value, u = coefficient(simulated(table={"encoder_late_s": 0.002}, time_delay=0.005), EFFECTS_FITTED, "delay")
    assert value == pytest.approx(0.005 - 0.002, abs=3 * u)


def test_the_noise_of_the_encoder_is_in_the_reference() -> None:
    quiet, noisy = simulated(), simulated(table={"encoder_noise_deg": 1e-3})
    difference = np.asarray(noisy.columns["table_rate_dps"]) - np.asarray(quiet.columns["table_rate_dps"])
    moving = difference[np.abs(np.asarray(quiet.columns["table_rate_dps"])) > 0]
    assert float(np.std(moving)) == pytest.approx(np.sqrt(2) * 1e-3 * 100.0, rel=0.05)


def test_a_course_has_the_angle_that_its_rates_integrate_to() -> None:
    step_s, rad_s = 1e-3, 2 * np.pi * 2.0
    times = np.arange(0.0, 3.0 + step_s / 2, step_s)
    motion = ProfileMotion(10.0, step_s, 40.0 * np.sin(rad_s * times))
    at = np.array([10.123456, 11.5, 12.999])
    assert motion.angle_deg(at) == pytest.approx(40.0 / rad_s * (1 - np.cos(rad_s * (at - 10.0))), abs=1e-7)
    assert motion.angle_deg(np.array([9.0, 14.0])) == pytest.approx([0.0, 0.0], abs=1e-6)


def test_the_memory_of_a_bandwidth_is_that_of_a_first_order_filter() -> None:
    memory = EFFECTS["bandwidth"](0.004, [1]).memory()
    assert memory is not None
    past_s, weights = memory
    for hertz in (1.0, 10.0, 40.0, 60.0):
        rad_s = 2 * np.pi * hertz
        assert np.sum(weights * np.exp(-1j * rad_s * past_s)) == pytest.approx(1 / (1 + 1j * rad_s * 0.004), abs=1e-6)


def test_a_course_beyond_the_table_is_refused() -> None:
    with pytest.raises(BadInput, match=r"a sine_sweep reaches .* deg/s, but the limit of the table of bench"):
        simulated(amplitude_dps=5000.0)
