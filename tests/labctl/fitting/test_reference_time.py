"""The time of a reference rate that changes, in coefficients and budgets, by formulas of its own."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime

import numpy as np
import pytest

from labctl.calibration import build_calibration, read_calibration
from labctl.errors import BadInput
from labctl.fitting import fit
from labctl.fitting.models.fitted_model import AxisFit, FittedModel
from labctl.fitting.uncertainty import response_budgets
from labctl.fitting.uncertainty.conditions import conditions_of
from labctl.recording import Recording
from labctl.recording.columns import TIME_COMMON_U_S, TIME_U_S
from labctl.services.calibrations.uncertainty import uncertainty_answer
from tests.helpers.profiles import profile_recording, ramp, sweep

PLAIN = ["bias", "scale_factor"]
DELAYED = [*PLAIN, "time_delay"]
COMMON_S, OWN_S = 7e-4, 2e-4
DELAY_S = 0.005


def swept(
    common_s: float | None = COMMON_S, own_s: float | None = None, sets: int = 4, delay_s: float = DELAY_S
) -> Recording:
    """Return equal data sets, each a sweep, whose reference has a time of such uncertainties."""
    one = sweep(20.0, 0.2, 2.0, 20.0, 20.0)
    whole = profile_recording(np.tile(one, sets), 20.0, delay_s=DELAY_S, noise_dps=1e-3)
    n = len(whole) // sets
    columns = whole.columns | {"dataset": np.repeat(np.arange(1, sets + 1), n)}
    columns["t_s"] = np.asarray(columns["t_s"]) + 10.0 * np.asarray(columns["dataset"])
    for name, u_s in ((TIME_COMMON_U_S, common_s), (TIME_U_S, own_s)):
        if u_s is not None:
            columns[name] = np.full(len(whole), u_s)
    return replace(whole, columns=columns)


def axis_of(recording: Recording, effects: list[str]) -> AxisFit:
    return fit(recording, None, effects).fitted.axes["z"]


@pytest.mark.slow
def test_a_time_that_all_data_sets_have_in_common_is_in_a_delay_in_full_and_in_nothing_beside_it() -> None:
    alone, found = axis_of(swept(common_s=None), DELAYED), axis_of(swept(), DELAYED)
    assert found.values == pytest.approx(alone.values, abs=1e-12)
    assert alone.u_of("delay") < 1e-5
    assert found.u_of("delay") == pytest.approx(np.hypot(alone.u_of("delay"), COMMON_S), rel=1e-6)
    for name in ("bias", "scale_factor"):
        assert found.u_of(name) == pytest.approx(alone.u_of(name), rel=1e-6)


@pytest.mark.slow
def test_times_of_their_own_average_over_the_data_sets() -> None:
    alone, found = axis_of(swept(common_s=None), DELAYED), axis_of(swept(common_s=None, own_s=OWN_S), DELAYED)
    assert found.u_of("delay") == pytest.approx(np.hypot(alone.u_of("delay"), OWN_S / 2), rel=0.02)


def test_a_model_without_a_delay_has_it_as_far_as_its_coefficients_follow() -> None:
    """On a ramp that goes one way a time is a bias: the slope of the rate times it."""
    one_way = profile_recording(ramp(60.0, -60.0, 60.0, 20.0), 20.0, noise_dps=1e-3)
    stated = replace(one_way, columns=one_way.columns | {TIME_COMMON_U_S: np.full(len(one_way), COMMON_S)})
    alone, found = axis_of(one_way, PLAIN), axis_of(stated, PLAIN)
    part = found.parts[0].root[:, 0]
    assert np.abs(part) == pytest.approx([2.0 * COMMON_S, 0.0], rel=1e-3, abs=1e-9)
    assert found.u_of("bias") == pytest.approx(np.hypot(alone.u_of("bias"), 2.0 * COMMON_S), rel=1e-3)
    assert found.u_of("scale_factor") == pytest.approx(alone.u_of("scale_factor"), rel=1e-6)


def test_a_budget_has_it_as_lines_of_their_own() -> None:
    result = fit(swept(own_s=OWN_S), None, DELAYED)
    bench = conditions_of(swept().info, {})
    budget = response_budgets(result.fitted, evidence={}, bench=bench)["z"]["delay"]
    lines = {line.source: line for line in budget.lines}
    assert list(lines) == ["coefficients", "table_time_common", "table_time"]
    common = lines["table_time_common"]
    assert (common.u, common.unit, common.is_common) == (pytest.approx(COMMON_S), "s", True)
    assert common.sensitivity == pytest.approx(1.0, rel=1e-6)
    assert common.distribution == "u-shaped"
    assert lines["table_time"].contribution == pytest.approx(OWN_S / 2, rel=0.02)
    assert budget.combined == pytest.approx(result.fitted.axes["z"].u_of("delay"), rel=1e-9)
    # half of a reply is sqrt(2) u: U is hardly more than that
    assert np.sqrt(2) * COMMON_S < (budget.expanded or 0.0) < 1.15 * np.sqrt(2) * COMMON_S
    kept = FittedModel.from_dict(result.fitted.to_dict())
    assert response_budgets(kept, evidence={}, bench=bench)["z"]["delay"] == budget


def test_a_recording_that_does_not_state_it_says_so() -> None:
    recording = swept(common_s=None)
    bench = conditions_of(recording.info, {})
    budget = response_budgets(fit(recording, None, DELAYED).fitted, evidence={}, bench=bench)["z"]["delay"]
    assert budget.not_stated == ("table_time_common",)
    assert "measure again" in budget.lines[-1].why


@pytest.mark.slow
def test_document_and_answer_have_the_same_budget() -> None:
    recording = swept(own_s=OWN_S)
    made = build_calibration(
        recording.info, fit(recording, None, DELAYED), version=1, parent=None, provenance={},
        issued_at=datetime(2026, 1, 2, tzinfo=UTC),
    )  # fmt: skip
    calibration = read_calibration(made.to_bytes())
    stated = calibration.document["response"]["z"]["delay"]
    answered = uncertainty_answer(calibration, [5.0], 25.0).coefficients["z"]["delay"]
    assert answered == stated
    assert stated["combined"] == pytest.approx(axis_of(recording, DELAYED).u_of("delay"), rel=1e-9)


def test_an_uncertainty_below_zero_is_refused() -> None:
    with pytest.raises(BadInput, match=r"'table_time_common_u_s' has -0\.001 s; give a standard uncertainty of at"):
        fit(swept(common_s=-1e-3), None, DELAYED)
