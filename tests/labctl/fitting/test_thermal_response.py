"""Heat flows of a unit at rest: how many time constants a recording shows, and how well it determines them."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import pytest

from labctl.fitting import fit
from labctl.fitting.data.fit_data import fit_data_of
from labctl.fitting.effects import Term
from labctl.fitting.effects.thermal_lag import lag_elements
from labctl.fitting.estimation.thermal_flows import MAX_STEPS, STRUCTURES, Axis, best_taus
from labctl.fitting.estimation.thermal_response import are_told_apart, stretches_of, thermal_response
from labctl.fitting.models.error_model import ErrorModel
from labctl.recording import Recording
from tests.helpers.rest import RATE_HZ, at_rest, flowing, follow

EFFECTS = ["bias", "bias_temperature", "thermal_lag"]


def mixture(warm: np.ndarray) -> np.ndarray:
    """Return an element that a fast and a slow flow reach."""
    return 0.5 * follow(warm, 90.0) + 0.5 * follow(warm, 1500.0)


def two_ways(warm: np.ndarray) -> np.ndarray:
    """Return an element that warms up in 200 s and cools in 900 s."""
    found, now = np.empty_like(warm), float(warm[0])
    for k, there in enumerate(warm.tolist()):
        now += (there - now) * -np.expm1(-1.0 / RATE_HZ / (200.0 if there > now else 900.0))
        found[k] = now
    return found


def shapes(recording: Recording) -> dict[str, tuple[float, float]]:
    """Return the time constants of a fit with a lag and their standard uncertainties, s."""
    found = fit(recording, effects=EFFECTS).to_json()["shapes"]["thermal_lag"]
    return {name: (entry["value"], float(entry["u"] or 0.0)) for name, entry in found.items()}


@pytest.mark.slow
def test_axes_with_one_time_constant_share_it() -> None:
    found = shapes(flowing(dict.fromkeys("xyz", partial(follow, tau_s=400.0))))
    assert list(found) == ["tau_s"]
    value, u = found["tau_s"]
    assert abs(value - 400.0) < 3 * u < 40.0


@pytest.mark.slow
def test_each_axis_gets_its_own_time_constant_where_they_differ() -> None:
    true = {"x": 250.0, "y": 500.0, "z": 900.0}
    found = shapes(flowing({axis: partial(follow, tau_s=tau_s) for axis, tau_s in true.items()}))
    assert set(found) == {f"tau_{axis}_s" for axis in true}
    for axis, tau_s in true.items():
        value, u = found[f"tau_{axis}_s"]
        assert abs(value - tau_s) < 3 * u < 0.2 * tau_s


def test_two_flows_are_found_where_one_does_not_predict_the_legs_left_out() -> None:
    found = shapes(flowing({"z": mixture}))
    assert found["tau_s"][0] == pytest.approx(90.0, rel=0.3)
    assert found["second_tau_s"][0] == pytest.approx(1500.0, rel=0.3)


@pytest.mark.slow
def test_axes_of_different_structures_have_one_each() -> None:
    recording = flowing({"x": partial(follow, tau_s=300.0), "y": mixture, "z": partial(follow, tau_s=700.0)})
    found = fit(recording, effects=EFFECTS)
    taus = {name: entry["value"] for name, entry in found.to_json()["shapes"]["thermal_lag"].items()}
    assert set(taus) == {"tau_x_s", "tau_y_s", "second_tau_y_s", "tau_z_s"}
    assert taus["tau_x_s"] == pytest.approx(300.0, rel=0.05)
    assert taus["tau_z_s"] == pytest.approx(700.0, rel=0.05)
    assert taus["second_tau_y_s"] == pytest.approx(1500.0, rel=0.2)
    leg = next(leg["rms_dps"] for leg in found.error.heldout_by_leg if leg["fitted"] == "all legs but one")
    assert leg is not None
    assert found.error.noise_floor_dps is not None
    assert leg < 1.1 * found.error.noise_floor_dps


def test_structures_by_axis_are_said_axis_by_axis() -> None:
    data = fit_data_of(flowing({"x": partial(follow, tau_s=300.0), "y": mixture, "z": partial(follow, tau_s=700.0)}))
    model = ErrorModel("", (Term("bias"), Term("bias_temperature", 2)))
    response = thermal_response(data, model, Term("thermal_lag"))
    assert response is not None
    assert response.structure.id == "by_axis"
    assert response.structure.sentence == "on x one time constant; on y two time constants; on z one time constant"
    assert response.held_out["by_axis"].is_below(response.held_out["two_flows"])


def test_a_curved_law_may_be_that_of_one_axis() -> None:
    term = Term("thermal_lag", None, {"tau_x_s": 200.0, "tau_y_s": 300.0, "curved_y": 1.0})
    assert [e.part for e in lag_elements(term, "x")] == ["all"]
    assert [e.part for e in lag_elements(term, "y")] == ["all", "curved"]


def test_a_lag_that_is_longer_while_the_unit_cools_is_found_as_that() -> None:
    found = shapes(flowing({"z": two_ways}))
    assert found["tau_s"][0] == pytest.approx(200.0, rel=0.3)
    assert found["cooling_tau_s"][0] == pytest.approx(900.0, rel=0.3)


@pytest.mark.parametrize(("law", "differs"), [(partial(follow, tau_s=400.0), False), (two_ways, True)])
def test_warming_and_cooling_are_one_time_constant_unless_the_data_tell_two(law: Any, differs: bool) -> None:
    data = fit_data_of(flowing({"z": law}))
    axes = [Axis(data, ErrorModel("", (Term("bias"), Term("bias_temperature", 2))), "z")]
    (structure,) = (each for each in STRUCTURES if each.two_ways)
    every = np.ones(len(data), dtype=bool)
    found = best_taus(axes, structure, every, MAX_STEPS)
    assert are_told_apart(axes, structure, found, every) == differs


def test_a_fit_with_its_heat_flows_predicts_each_leg_to_the_noise() -> None:
    for law in (mixture, two_ways):
        error = fit(flowing({"z": law}), effects=EFFECTS).error
        leg = next(leg["rms_dps"] for leg in error.heldout_by_leg if leg["fitted"] == "all legs but one")
        assert leg is not None
        assert error.noise_floor_dps is not None
        assert leg < 1.1 * error.noise_floor_dps


def test_nothing_is_chosen_where_the_temperature_goes_one_way() -> None:
    data = fit_data_of(at_rest(("z",), lag_s=400.0, minutes=160.0))
    rising = data.take(np.asarray(data.channels["t_s"]) < 38 * 60.0)
    model = ErrorModel("", (Term("bias"), Term("bias_temperature", 2)))
    assert not stretches_of(rising)
    assert thermal_response(rising, model, Term("thermal_lag")) is None
    assert thermal_response(data, model, Term("thermal_lag")) is not None


def test_one_loop_leaves_out_half_of_each_leg() -> None:
    data = fit_data_of(at_rest(("z",), lag_s=400.0))
    loop = data.take(np.asarray(data.channels["t_s"]) < 78 * 60.0)
    assert len(stretches_of(loop)) == 4
    assert len(stretches_of(data)) == 4  # of two loops each leg


def test_an_axis_without_a_time_constant_of_its_own_has_the_common_one() -> None:
    term = Term("thermal_lag", None, {"tau_s": 300.0, "tau_x_s": 200.0, "curved": 1.0})
    assert [(e.column, e.tau_s) for e in lag_elements(term, "x")] == [
        ("thermal_lag", 200.0), ("thermal_lag_curved", 200.0),
    ]  # fmt: skip
    assert [e.tau_s for e in lag_elements(term, "y")] == [300.0, 300.0]
