"""Several recordings as one: joining, common coefficients, repeatability, agreement, and each held out."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta

import numpy as np
import pytest

from labctl.errors import BadInput
from labctl.fitting import fit
from labctl.fitting.criticism import criticise
from labctl.fitting.data.fit_data import fit_data_of
from labctl.fitting.data.joined import joined_recording, trend_t_s
from labctl.recording import Recording
from tests.helpers.joint_recordings import CENTRE_C, EFFECTS, TRUTH, recording_of_day, recordings


def head(recording: Recording, **changes: object) -> Recording:
    """Return a recording whose head says something else."""
    return replace(recording, info=recording.info.model_copy(update=changes))


def test_joined_recordings_share_no_number_and_keep_their_times() -> None:
    parts = recordings(1, (0.0, 10.0))
    whole = joined_recording({7: parts[2], 3: parts[1]})
    columns = whole.columns
    assert columns["recording"].tolist() == [3] * 45 + [7] * 45
    assert columns["dataset"].tolist() == list(range(1, 91))
    assert columns["recording_dataset"].tolist() == 2 * list(range(1, 46))
    assert columns["run"].tolist() == [1] * 45 + [2] * 45
    assert columns["t_s"][45] - columns["t_s"][0] == pytest.approx(10 * 86400.0)
    assert columns["recording_t_s"][45] == 0.0
    assert columns["previous_rate_dps"][45] == 0.0
    assert joined_recording({3: parts[1]}) is parts[1]


def test_recordings_whose_clocks_overlap_are_put_one_behind_the_other() -> None:
    parts = recordings(1, (0.0, 0.0))
    t_s = joined_recording(parts).columns["t_s"]
    assert np.all(np.diff(t_s) > 0)


def test_a_recording_without_a_date_is_placed_by_no_time() -> None:
    parts = recordings(1, (0.0, 10.0))
    first, second = parts[1], parts[2]
    dated = joined_recording({1: first, 2: second})
    assert trend_t_s(dated.info, dated.columns).tolist() == dated.columns["t_s"].tolist()
    early = second.info.started_at - timedelta(days=999)
    found = [
        joined_recording({1: head(first, date_known=False, started_at=imported), 2: second})
        for imported in (early, second.info.started_at, second.info.started_at + timedelta(days=999))
    ]
    for whole in found:
        assert whole.columns["recording"].tolist() == [2] * 45 + [1] * 45
        assert whole.info.measured_at is None
        np.testing.assert_array_equal(whole.columns["t_s"], found[0].columns["t_s"])
        np.testing.assert_array_equal(trend_t_s(whole.info, whole.columns), whole.columns["recording_t_s"])


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"serial": "other"}, "differ in serial"),
        ({"latitude_deg": 42.0}, "differ in latitude_deg"),
        ({"motion": "poses"}, "differ in motion"),
        ({"kind": "coefficients"}, "table of coefficients"),
    ],
)
def test_recordings_that_do_not_go_together_are_refused(changes: dict[str, object], said: str) -> None:
    parts = recordings(1)
    with pytest.raises(BadInput, match=said):
        joined_recording({1: parts[1], 2: head(parts[2], **changes)})


def test_two_recordings_with_a_run_shift_cover_the_truth_and_call_it_repeatability() -> None:
    result = fit(joined_recording(recordings(2)), None, EFFECTS)
    assert result.fitted.model.reference.temperature_c == CENTRE_C
    axis = result.fitted.axes["z"]
    for name, value, u in zip(axis.names, axis.values[:, 0], axis.u[:, 0], strict=True):
        assert abs(value - TRUTH[name]) < 3 * u, name  # how often within 2 u: studies/joint_recordings
    joint = result.joint
    assert joint is not None
    turn_on, day = joint["repeatability"]["z"]
    assert (turn_on["kind"], day["kind"]) == ("turn_on", "day_to_day")
    assert turn_on["seen"]
    assert turn_on["low"] < 0.01 < turn_on["high"]
    assert [shift["recording"] for shift in turn_on["shifts"]] == [1, 2]
    assert any("bias repeatability, turn-on to turn-on" in line and "neither a drift" in line for line in joint["text"])
    assert all(each["agree"] for each in joint["agreement"])
    assert "bias_drift" not in result.fitted.model.effect_ids


def test_without_shifts_two_recordings_know_more_than_one() -> None:
    parts = recordings(3, turn_on_dps=0.0, per_day=0.0)
    one, both = fit(parts[1], None, EFFECTS), fit(joined_recording(parts), None, EFFECTS)
    index = both.fitted.axes["z"].names.index("bias_t2")
    assert both.fitted.axes["z"].u[index, 0] < one.fitted.axes["z"].u[index, 0]
    assert both.joint is not None
    assert not any(line["seen"] for line in both.joint["repeatability"]["z"])
    assert one.joint is None
    assert "joint" not in one.to_json()


def test_an_effect_that_two_recordings_disagree_on_is_said() -> None:
    rng = np.random.default_rng(5)
    parts = {1: recording_of_day(rng, 0.0), 2: recording_of_day(rng, 10.0, bias_t1=3e-4, bias_shift_dps=0.01)}
    joint = fit(joined_recording(parts), None, EFFECTS).joint
    assert joint is not None
    apart = [each["effect"] for each in joint["agreement"] if not each["agree"]]
    assert apart == ["bias_temperature"]
    assert any(line.startswith("Recordings 1, 2 disagree on bias_temperature: chi2") for line in joint["text"])


def test_each_recording_is_predicted_by_the_others() -> None:
    joint = fit(joined_recording(recordings(6, (0.0, 10.0, 20.0), turn_on_dps=0.02, per_day=0.0)), None, EFFECTS).joint
    assert joint is not None
    assert [line["recording"] for line in joint["held_out"]] == [1, 2, 3]
    shifts = [shift["value"] for shift in joint["repeatability"]["z"][0]["shifts"]]
    expected = [abs(s - (sum(shifts) - s) / 2) for s in shifts]  # its own shift, less the mean of the others'
    assert [line["rms_dps"] for line in joint["held_out"]] == pytest.approx(expected, rel=0.3, abs=1e-3)


def test_a_recording_that_cannot_be_fitted_alone_is_not_compared_and_still_used() -> None:
    parts = recordings(7)
    few = np.abs(np.asarray(parts[2].columns["temperature_c"]) - 25.0) < 5.0
    parts[2] = replace(parts[2], columns={name: np.asarray(v)[few] for name, v in parts[2].columns.items()})
    joint = fit(joined_recording(parts), None, EFFECTS).joint
    assert joint is not None
    assert joint["agreement"] == []
    assert joint["not_compared"].startswith("recording 2 alone does not determine the model")
    assert joint["held_out"][0]["rms_dps"] is None
    assert joint["held_out"][1]["rms_dps"] is not None


def test_what_belongs_to_the_bench_has_a_coefficient_for_each_recording() -> None:
    parts = {}
    for number, recording in recordings(8).items():
        angle = np.random.default_rng(number).uniform(0.0, 360.0, len(recording))
        parts[number] = replace(recording, columns={**recording.columns, "table_angle_deg": angle})
    axis = fit(joined_recording(parts), None, [*EFFECTS, "earth_rate_tilt"]).fitted.axes["z"]
    own = [name for name, effect in zip(axis.names, axis.effects, strict=True) if effect == "earth_rate_tilt"]
    assert own == ["earth_cos1_of_1", "earth_cos1_of_2", "earth_sin1_of_1", "earth_sin1_of_2"]


@pytest.mark.parametrize("days", [(0.0, 10.0), (0.0, 10.0, 20.0)])
def test_shifts_between_recordings_are_no_missing_effect(days: tuple[float, ...]) -> None:
    whole = joined_recording(recordings(9, days))
    found = criticise(whole, fit(whole, None, EFFECTS).fitted.model, full=False)
    assert found.verdict.form == "adequate"


def test_an_effect_hidden_in_two_recordings_has_more_evidence_than_in_one() -> None:
    parts = recordings(11, quadratic=3e-8)
    model = fit(parts[1], None, EFFECTS).fitted.model

    def evidence(recording: Recording) -> float:
        found = criticise(recording, model, full=False)
        assert found.comparison is not None
        return next(c.log_bf for c in found.comparison.candidates if c.id == "scale_factor_even")

    assert evidence(joined_recording(parts)) > max(evidence(parts[1]), evidence(parts[2])) + 1.0


def test_a_ramp_in_each_recording_is_no_ramp_between_them() -> None:
    """The time of a ramp is that since the start of its own recording: ten days between them are none."""
    data = fit_data_of(joined_recording(recordings(11)))
    assert data.channels.recording_t_s().max() < 86400.0
