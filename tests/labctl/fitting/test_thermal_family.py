"""The thermal response of a unit at rest in a criticism: one family, what is certain of it, and what is not."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from labctl.fitting.criticism import Criticism, criticise
from labctl.fitting.criticism.thermal_family import (
    LAG,
    ThermalFamily,
    hint_of_added,
    thermal_family,
    with_family,
)
from labctl.fitting.criticism.verdict import Verdict
from labctl.fitting.data.fit_data import FitData, fit_data_of
from labctl.fitting.effects import Term
from labctl.fitting.models.error_model import ErrorModel
from labctl.fitting.models.presets import preset_for
from labctl.recording import Recording, to_points
from labctl.services.criticism.answer import sentences
from studies.rest_units import Hidden, unit_at_rest
from tests.helpers.rest import at_rest, flowing, follow

UNEXPLAINED = Verdict("unexplained", depends_on=("t_s",))


def based(recording: Recording) -> tuple[FitData, ErrorModel]:
    data = fit_data_of(to_points(recording))
    return data, preset_for(None, ["bias", "bias_temperature"]).build(data)[0]


def family_of(recording: Recording, verdict: Verdict = UNEXPLAINED) -> ThermalFamily | None:
    return thermal_family(*based(recording), verdict)


@pytest.fixture(scope="module")
def by_axis() -> Criticism:
    recording = flowing({axis: partial(follow, tau_s=tau) for axis, tau in {"x": 300.0, "y": 480.0}.items()})
    return criticise(recording, based(recording)[1], points=to_points(recording))


def test_lags_that_differ_between_axes_are_named_once_with_what_is_certain(by_axis: Criticism) -> None:
    assert by_axis.verdict.form == "missing"
    assert by_axis.verdict.named == (LAG,)
    assert set(by_axis.verdict.terms[LAG].parameters) == {"tau_x_s", "tau_y_s"}
    family = by_axis.family
    assert family is not None
    assert family.after.rms_dps < 0.1 * family.before.rms_dps
    assert family.shapes["tau_x_s"]["value"] == pytest.approx(300.0, rel=0.1)
    assert family.shapes["tau_y_s"]["u"] is not None
    assert "one time constant on each axis" in family.sentence
    assert family.to_json()["structure"] == "per_axis"


def test_a_response_that_follows_the_rate_of_change_is_not_claimed_to_be_a_lag() -> None:
    recording = flowing({"z": partial(follow, tau_s=25.0)}, dps_k=8e-4)  # faster than a window of a minute
    family = family_of(recording)
    assert family is not None
    assert family.alike == ("temperature_rate",)
    assert "this recording cannot tell" in family.sentence
    verdict = with_family(UNEXPLAINED, family)
    assert (verdict.form, verdict.named) == ("ambiguous", (LAG, "temperature_rate"))


def test_no_response_is_named_where_there_is_none_or_where_it_was_not_asked_for() -> None:
    still = at_rest(("z",))
    assert family_of(still) is None
    assert family_of(at_rest(("z",), lag_s=400.0), Verdict("adequate")) is None
    assert family_of(at_rest(("z",), lag_s=400.0), Verdict("missing", (("supply_sensitivity",),))) is None


def test_a_course_that_repeats_in_no_leg_is_no_response() -> None:
    recording = at_rest(("z",))
    t_s = np.asarray(recording.columns["t_s"], dtype=np.float64)
    stepped = np.asarray(recording.columns["gyro_z"]) + 0.02 * (t_s > 4000.0)
    assert family_of(Recording(recording.info, {**recording.columns, "gyro_z": stepped})) is None


@pytest.fixture(scope="module")
def half_explained() -> Recording:
    """Return a unit whose lag is as large as a wander in time that follows no temperature."""
    recording = at_rest(("z",), lag_s=400.0)
    t_s = np.asarray(recording.columns["t_s"], dtype=np.float64)
    wander = 8e-3 * np.sin(2 * np.pi * t_s / 1300.0 + 0.7)
    return Recording(recording.info, {**recording.columns, "gyro_z": np.asarray(recording.columns["gyro_z"]) + wander})


def test_a_response_that_predicts_a_part_is_a_hint_and_not_named(half_explained: Recording) -> None:
    data, model = based(half_explained)
    family = thermal_family(data, model, UNEXPLAINED)
    assert family is not None
    assert not family.is_certain
    assert family.after.is_below(family.before)
    assert with_family(UNEXPLAINED, family) is UNEXPLAINED
    told = family.hint_json()
    assert told["after_rms_dps"] < told["before_rms_dps"]
    assert "% of the chi2 of these stretches" in told["why"]
    assert f"from {told['before_rms_dps']:.3g} to {told['after_rms_dps']:.3g} deg/s" in told["text"]
    assert set(told["rivals_rms_dps"]) == {"temperature_rate", "thermal_hysteresis"}


def test_an_added_lag_has_a_hint_only_where_it_is_not_certain(half_explained: Recording) -> None:
    data, model = based(half_explained)
    assert hint_of_added(data, model, [LAG]) is not None
    assert hint_of_added(data, model, ["thermal_hysteresis"]) is None
    certain, base = based(at_rest(("z",), lag_s=400.0))
    assert hint_of_added(certain, base, [LAG]) is None


@pytest.mark.slow
def test_the_hint_stands_in_the_criticism_without_advice(half_explained: Recording) -> None:
    found = criticise(half_explained, based(half_explained)[1], points=to_points(half_explained))
    assert found.family is None
    assert found.hint is not None
    assert LAG not in found.verdict.named
    assert not [advice for advice in found.advice if advice["add"]]
    assert found.hint.hint in sentences(found)


def test_other_effects_stay_beside_the_family() -> None:
    verdict = Verdict(
        "ambiguous", (("thermal_hysteresis", "temperature_rate"), ("supply_sensitivity",)),
        terms={"thermal_hysteresis": Term("thermal_hysteresis", None, {"width_k": 4.0})},
    )  # fmt: skip
    family = family_of(at_rest(("z",), lag_s=400.0), verdict)
    found = with_family(verdict, family)
    assert found.groups == ((LAG,), ("supply_sensitivity",))
    assert found.form == "missing"


@pytest.mark.slow
def test_a_lag_and_a_hysteresis_that_are_there_together_are_both_named() -> None:
    recording = unit_at_rest(2, Hidden(lag_s=600.0, width_k=5.0))  # with dwells: evenly, two lags look like both
    found = criticise(recording, based(recording)[1], points=to_points(recording), full=False)
    assert found.verdict.groups == ((LAG,), ("thermal_hysteresis",))
    assert found.family is not None
    assert found.family.to_json()["beside"] == ["thermal_hysteresis"]
    assert "and thermal_hysteresis beside it" in found.family.sentence
    assert [each["effect"] for each in found.advice] == [LAG, "thermal_hysteresis"]


def test_a_lag_alone_has_no_hysteresis_beside_it() -> None:
    family = family_of(at_rest(("z",), lag_s=400.0))
    assert family is not None
    assert family.beside is None
    assert family.to_json()["beside"] == []
