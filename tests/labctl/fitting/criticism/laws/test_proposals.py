"""Laws for a residual without a name, of a simulated gyro with an error that no effect of the catalogue describes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from labctl.fitting.criticism import (
    Criticism,
    Law,
    bends_over,
    breaking,
    coefficients_of_law,
    consequences,
    criticise,
    laws_of,
)  # fmt: skip
from labctl.fitting.criticism.laws.proposals import _channels
from labctl.fitting.data.fit_data import fit_data_of
from labctl.fitting.data.joined import joined_recording
from labctl.fitting.effects import Term
from labctl.fitting.effects.formula import read_formula
from labctl.fitting.estimation.fit import fit_preset
from labctl.fitting.models.presets import changed, preset_for, usual_model
from labctl.recording import Recording, to_points
from tests.helpers.simulated_recordings import single_axis
from tests.helpers.unnamed_error import SIZE_DPS, error_dps, with_wave


def judged(recording: Recording) -> Criticism:
    return criticise(recording, usual_model(fit_data_of(to_points(recording))))


@pytest.fixture(scope="module")
def found() -> Criticism:
    return judged(with_wave(single_axis(3)))


@pytest.fixture(scope="module")
def laws(found: Criticism) -> list[Law]:
    return laws_of(found)


@pytest.mark.slow
def test_the_likeliest_law_is_the_true_one(found: Criticism, laws: list[Law]) -> None:
    assert found.verdict.form == "unexplained"
    assert len(laws[0].formulas) == 1
    coefficient = coefficients_of_law(laws[0])["z"]["law_1"]
    rates = np.linspace(-100.0, 100.0, 41)
    channels = found.fit_data.channels.take(np.arange(len(found.fit_data)) < 1)
    formula = read_formula(laws[0].formulas[0])
    term = laws[0].terms[0]
    described = []
    for rate in rates:
        (column,) = formula.columns(
            channels.with_rates({"z": np.array([rate])}), "z", term, laws[0].fit.fitted.model.reference
        )
        described.append(coefficient["value"] * float(column.values[0]))
    assert described == pytest.approx(error_dps(rates), abs=0.1 * SIZE_DPS)


@pytest.mark.slow
def test_a_law_leaves_less_of_the_data_sets_and_of_those_left_out(found: Criticism, laws: list[Law]) -> None:
    assert found.base is not None
    for law in laws:
        before, after = found.base.error, law.fit.error
        assert after.rms_dps < 0.2 * before.rms_dps  # type: ignore[operator]
        assert after.heldout_rms_dps < 0.2 * before.heldout_rms_dps  # type: ignore[operator]
    assert sum(law.probability for law in laws) == pytest.approx(1.0)


@pytest.mark.slow
def test_it_says_what_else_would_follow(found: Criticism, laws: list[Law]) -> None:
    said = consequences(laws[0], found)
    assert said[0] == "It changes its sign with the direction of the rate, and is 0 at rest."


@pytest.mark.slow
def test_two_laws_are_told_apart_where_they_differ_most(found: Criticism, laws: list[Law]) -> None:
    """Of one law it is where it differs from the model; two that differ in period part where no data set is."""
    assert breaking([], found) is None
    other = replace(laws[0], fit=found.base)
    place = breaking([laws[0], other], found)
    assert place is not None
    assert place.laws == 2
    assert breaking(laws[:1], found) == replace(place, laws=1)
    assert place.difference_dps > SIZE_DPS / 2
    assert abs(place.rate_dps) <= 125.0


@pytest.mark.parametrize(("formula", "channel"), [
    ("sin(rate_dps/9)", "table_rate_dps"),
    ("((temperature_c - 36)/10) * sin(rate_dps/9)", "table_rate_dps"),
    ("(rate_dps/100) * sin(temperature_c/2)", "temperature_c"),
    ("sin(temperature_c/2)", "temperature_c"),
    ("sign(rate_dps) * abs(rate_dps/100)**0.5 * exp((temperature_c - 36)/40)", "table_rate_dps"),
])  # fmt: skip
def test_a_law_is_tested_along_the_channel_over_which_it_bends_most(formula: str, channel: str) -> None:
    recording, term = single_axis(3), Term("law_1", formula=formula)
    model = usual_model(fit_data_of(to_points(recording)))
    found = criticise(recording, model, full=False)
    fit = fit_preset(found.fit_data, changed(model, (term,)))
    law = Law((term,), ("a law",), 0.0, 1.0, fit, {})
    assert bends_over(law, found) == channel


def test_of_several_recordings_no_law_follows_the_time_which_is_a_date() -> None:
    whole = joined_recording({seed: single_axis(seed) for seed in (3, 4)})
    found = criticise(whole, usual_model(fit_data_of(to_points(whole))), full=False)
    verdict = replace(found.verdict, form="unexplained", depends_on=("table_rate_dps", "t_s", "supply_v"))
    assert _channels(replace(found, verdict=verdict)) == ["table_rate_dps", "supply_v", "temperature_c"]


def test_nothing_is_proposed_for_noise() -> None:
    quiet = judged(single_axis(4))
    assert quiet.verdict.form == "adequate"
    assert laws_of(quiet) == []


def test_a_law_without_a_finite_value_beyond_the_data_is_one_of_the_measured_range() -> None:
    found = judged(single_axis(3))
    assert found.base is not None
    pole_c = float(found.fit_data.temperature_c.max()) + 10.0
    steep = Term("law_1", formula=f"1/({pole_c!r} - temperature_c)")
    fit = fit_preset(found.fit_data, changed(found.base.fitted.model, (steep,)))
    law = Law((steep,), ("pole",), 10.0, 1.0, fit, {})
    said = consequences(law, found)
    assert said[0] == "It does not depend on the rate."
    assert "10 K beyond the warmest data set, where nothing was measured, it has no finite value" in said[1]
    assert "10 K beyond the coldest data set, where nothing was measured, it would add" in said[2]
    assert breaking([law, replace(law, fit=found.base)], found) is not None  # at the temperatures of the data sets


@pytest.mark.slow
def test_a_temperature_that_was_held_is_in_no_law() -> None:
    whole = with_wave(single_axis(3))
    warm_c = np.asarray(whole.columns["chamber_setpoint_c"])
    held = {name: np.asarray(values)[warm_c == warm_c[0]] for name, values in whole.columns.items()}
    recording = replace(whole, columns=held)
    model, _ = preset_for("single_temperature", []).build(fit_data_of(to_points(recording)))
    formulas = [text for law in laws_of(criticise(recording, model)) for text in law.formulas]
    assert formulas
    assert not [text for text in formulas if "temperature_c" in text]
