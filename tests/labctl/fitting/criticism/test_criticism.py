"""A model compared with recordings whose truth is known: what is named, what is not, and what must not matter."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from labctl.errors import BadInput
from labctl.fitting.criticism import visibility
from labctl.fitting.effects import CATALOGUE, formulas
from labctl.fitting.effects.formula import Formula
from labctl.recording import Recording, to_points, write_recording
from tests.helpers.criticism import held
from tests.helpers.lab import Lab
from tests.helpers.simulated_recordings import single_axis, three_axes
from tests.helpers.spoilt import quantised, spoilt

HELD: dict[str, Any] = {"scale_factor_asymmetry": 2e-4}


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_complete_model_is_adequate(seed: int) -> None:
    found = held(single_axis(seed))
    assert (found.verdict.form, found.verdict.named) == ("adequate", ())


def test_a_drift_that_is_the_data_sheet_s_is_not_compared_with_the_data_sheet() -> None:
    """The page once said that it was 2.0 times the data sheet's."""
    whole = single_axis(1)
    few = replace(whole, columns={name: values[np.asarray(whole.columns["dataset"]) <= 15]
                                  for name, values in whole.columns.items()})  # fmt: skip
    found = held(few, "bias")
    assert found.comparison is not None
    assert found.floor.source == "within data sets, and by the data sheet"
    assert found.drift_over_datasheet is None
    assert held(whole).drift_over_datasheet is not None


@pytest.mark.slow
def test_three_axes_with_nothing_hidden() -> None:
    assert held(three_axes(4), "yang2018").verdict.form == "adequate"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("effect", "size"),
    [
        ("scale_factor_asymmetry", 2e-4),
        ("vibration_rectification", 0.006),
        ("rate_hysteresis", 0.005),
        ("start_transient", 6e-4),
        ("supply_sensitivity", 0.2),
        ("table_rate_ripple", 3e-5),
        ("dead_band", 0.2),
    ],
)
def test_what_is_hidden_is_named(effect: str, size: float) -> None:
    found = held(single_axis(5, **{effect: size}))
    assert (found.verdict.form, found.verdict.named) == ("missing", (effect,))


@pytest.mark.parametrize(("effect", "size"), [("saturation", -7e-4), ("missed_steps", 1e-4), ("sine_response", 0.25)])
def test_what_only_the_fastest_rates_show_is_among_those_named(effect: str, size: float) -> None:
    """Eleven rates cannot tell every law of the fastest of them from the next."""
    found = held(single_axis(5, **{effect: size}))
    assert effect in found.verdict.named
    assert len(found.verdict.named) <= 4


def test_what_cannot_be_told_apart_is_said_together() -> None:
    """Once per turn: the Earth on a tilted axis and a magnetic field are the same columns."""
    found = held(single_axis(5, earth_rate_tilt=0.0012))
    assert found.verdict.form == "ambiguous"
    assert {"earth_rate_tilt", "magnetic_sensitivity"} <= set(found.verdict.named)


@pytest.mark.slow
def test_gravity_in_yangs_three_positions_is_an_alias_group() -> None:
    """Three mountings, each in a powered run of its own: no statistics can split gravity from run and mounting."""
    found = held(three_axes(5, g_sensitivity=0.015), "yang2018")
    assert found.verdict.form == "ambiguous"
    assert {"g_sensitivity", "run_shift", "mounting_shift"} <= set(found.verdict.named)


@pytest.mark.slow
def test_what_no_effect_describes_is_unexplained() -> None:
    found = held(single_axis(5, outside_etalon=0.03))
    assert found.verdict.form == "unexplained"
    assert found.verdict.depends_on[0] == "temperature_c"
    assert found.verdict.named == ()


@pytest.mark.slow
def test_two_at_once_are_both_named() -> None:
    found = held(single_axis(6, scale_factor_asymmetry=3e-4, rate_hysteresis=0.006))
    assert set(found.verdict.named) == {"scale_factor_asymmetry", "rate_hysteresis"}


@pytest.mark.slow
def test_a_small_one_is_named_where_a_large_one_does_nothing() -> None:
    """Waves within data sets, however large, leave no drift between them: that is a second cause, no wrong shape."""
    found = held(single_axis(6, magnetic_sensitivity=0.003, supply_sensitivity=0.06))
    assert {"magnetic_sensitivity", "supply_sensitivity"} <= set(found.verdict.named)


def without(recording: Recording, *names: str) -> Recording:
    return replace(recording, columns={k: v for k, v in recording.columns.items() if k not in names})


@pytest.mark.slow
@pytest.mark.parametrize(
    ("channel", "silenced"),
    [
        ("table_angle_deg", {"earth_rate_tilt", "magnetic_sensitivity", "table_tilt", "table_rate_ripple"}),
        ("supply_v", {"supply_sensitivity"}),
        ("power_s", {"warm_up", "self_heating"}),
    ],
)
def test_a_channel_that_was_not_kept_silences_its_effects(channel: str, silenced: set[str]) -> None:
    recording = without(single_axis(1, **HELD), channel)
    found = held(recording, full=True)
    said = {line["effect"] for line in found.not_testable if line["why"] == "channel"}
    assert silenced <= said
    assert found.verdict.named[0] == "scale_factor_asymmetry"
    assert not silenced & set(found.verdict.named)


@pytest.mark.slow
def test_what_is_suspected_is_not_called_beyond_what_the_recording_can_say(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(visibility, "MIN_VISIBLE", 1.1)  # as if the schedule hid everything
    found = held(single_axis(1, **HELD), full=True)
    hidden = {line["effect"] for line in found.not_testable}
    assert found.verdict.named
    assert hidden
    assert not hidden & set(found.verdict.named)
    assert not hidden & {s.candidate.id for s in found.suspects if s.candidate.log_bf > 0}


def test_without_the_chamber_nothing_wrong_is_said() -> None:
    assert held(without(single_axis(2), "chamber_c", "chamber_setpoint_c")).verdict.form == "adequate"


@pytest.mark.slow
def test_order_of_columns_units_and_names_of_axes_do_not_matter() -> None:
    recording = single_axis(1, **HELD)
    turned = replace(recording, columns=dict(reversed(list(recording.columns.items()))))
    radians = replace(
        recording,
        info=recording.info.model_copy(update={"output": {"z": {"unit": "rad/s"}}}).model_validate(
            {**recording.info.model_dump(), "output": {"z": {"unit": "rad/s"}}}
        ),
        columns={**recording.columns, "gyro_z": np.deg2rad(recording.columns["gyro_z"])},
    )
    renamed = replace(
        recording,
        info=recording.info.model_copy(update={"axes": ("x",)}),
        columns={
            **{k: v for k, v in recording.columns.items() if k != "gyro_z"},
            "gyro_x": recording.columns["gyro_z"],
            "position": np.full(len(recording), "x"),
        },
    )
    plain = held(recording)
    for other in (turned, radians, renamed):
        found = held(other)
        assert (found.verdict.form, found.verdict.named) == (plain.verdict.form, plain.verdict.named)
        assert found.comparison is not None
        assert plain.comparison is not None
        assert found.comparison.candidates[0].log_bf == pytest.approx(plain.comparison.candidates[0].log_bf, rel=1e-6)


def test_outliers_and_missing_data_sets_raise_no_alarm() -> None:
    recording = single_axis(3)
    rng = np.random.default_rng(9)
    rates = np.array(recording.columns["gyro_z"])
    hit = rng.random(len(rates)) < 0.01
    rates[hit] += rng.choice([-1, 1], hit.sum()) * rng.uniform(5, 50, hit.sum())
    kept = ~np.isin(recording.columns["dataset"], rng.choice(121, 4, replace=False) + 1)
    spoiled = replace(recording, columns={k: v[kept] for k, v in {**recording.columns, "gyro_z": rates}.items()})
    found = held(spoiled)
    assert found.verdict.form == "adequate"
    assert found.data.left_out > 0.8 * hit[kept].sum()


@pytest.mark.parametrize("text", ["hum: chamber_c * rate_dps", "x1: sqrt(abs(rate_dps)) + 2**2 - temperature_c / 3"])
def test_formulas_compute(text: str) -> None:
    (formula,) = formulas(text)
    data = held(single_axis(1), catalogue={formula.id: formula}).data
    from labctl.fitting.effects import Reference, Term

    (column,) = formula.columns(data.nodes, "z", Term(formula.id), Reference())
    rate, warm, air = data.nodes.rate_dps("z"), data.nodes.temperature_c("z"), np.asarray(data.nodes["chamber_c"])
    expected = {"hum": air * rate, "x1": np.sqrt(np.abs(rate)) + 4 - warm / 3}[formula.id]
    assert column.values == pytest.approx(expected)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("no colon here", "name: formula"),
        ("a b: 1", "small letters"),
        ("f: __import__('os')", "only exp"),
        ("f: supply_v.real", "Attribute"),
        ("f: [1, 2]", "List"),
        ("f: 'text'", "not a number"),
        ("f: supply_v @ supply_v", "use + - * / **"),
        ("f: supply_v *", "cannot be read"),
        ("f: exp(1, 2)", "of one value"),
        ("f: (lambda: 1)()", "only exp"),
        ("f: supply_v if 1 else 2", "IfExp"),
    ],
)
def test_a_formula_that_is_none_gets_one_clear_line(text: str, said: str) -> None:
    with pytest.raises(BadInput) as caught:
        formulas(text)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_formula_competes_and_is_named_when_true() -> None:
    recording = single_axis(7)
    columns = dict(recording.columns)
    rng = np.random.default_rng(1)
    humidity = np.repeat(rng.normal(40, 5, 121), len(recording) // 121)
    columns["humidity_pct"] = humidity
    columns["gyro_z"] = columns["gyro_z"] + 4e-6 * (humidity - 40) * columns["table_rate_dps"]
    wet: Formula = formulas("wet_scale: (humidity_pct - 40) * rate_dps")[0]
    found = held(replace(recording, columns=columns), catalogue={**CATALOGUE, wet.id: wet})
    assert found.verdict.named == ("wet_scale",)


@pytest.fixture
def lab(tmp_path: Path) -> Lab:
    return Lab(tmp_path)


@pytest.fixture
def bring(lab: Lab) -> Callable[[Recording], Lab]:
    def taken(recording: Recording) -> Lab:
        write_recording(recording, lab.folder / "in", "parquet")
        lab.run("import", str(lab.folder / "in"))
        return lab

    return taken


@pytest.mark.slow
def test_the_whole_walk(bring: Callable[[Recording], Lab]) -> None:
    """Fit, criticise, improve, ladder, criticise again: as a person types it."""
    lab = bring(single_axis(1, **HELD))
    lab.run("fit", "FOG-0001", "--model", "ojeda2000")
    first = lab.json("criticise", "FOG-0001")
    assert (first["verdict"], first["named"]) == ("missing", ["scale_factor_asymmetry"])
    assert set(first) >= {
        "serial", "version", "verdict", "error", "noise", "lack_of_fit", "where", "suspects", "named", "depends_on",
        "not_testable", "experiments",
    }  # fmt: skip
    assert set(first["suspects"][0]) >= {
        "effect", "probability", "p_value", "coefficients", "rms_after_dps", "heldout_rms_after_dps", "alias_group",
        "origin", "explanation",
    }  # fmt: skip
    better = lab.json("improve", "FOG-0001", "--add", "scale_factor_asymmetry")
    assert (better["version"], better["parent"]) == (2, 1)
    assert better["error"]["heldout_rms_dps"] < 0.75 * better["before"]["heldout_rms_dps"]
    found = better["axes"]["z"]["coefficients"]["asymmetry"]
    assert abs(found["value"] - 2e-4) < 4 * found["u"]
    steps = lab.json("ladder", "FOG-0001")["steps"]
    assert [step["version"] for step in steps] == [1, 2]
    assert steps[1]["rms_dps"] < steps[0]["rms_dps"]
    assert lab.json("criticise", "FOG-0001")["verdict"] == "adequate"
    again = lab.run("improve", "FOG-0001", "--add", "scale_factor_asymmetry", status=2)
    assert "'scale_factor_asymmetry' is in version 2 already" in again.stderr
    back = lab.json("improve", "FOG-0001", "--remove", "scale_factor_asymmetry")
    assert back["model"]["effects"] == ["rate_temperature_surface"]
    text = lab.run("criticise", "FOG-0001", "--version", "1").stdout
    assert text.startswith("Missing: scale_factor_asymmetry (Scale factor asymmetry).")
    assert "█" in lab.run("ladder", "FOG-0001").stdout


@pytest.mark.slow
def test_the_same_input_gives_the_same_bytes(
    bring: Callable[[Recording], Lab], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    lab = bring(single_axis(1, **HELD))
    lab.run("fit", "FOG-0001", "--model", "ojeda2000")
    first = lab.run("criticise", "FOG-0001", "--json").stdout
    assert lab.run("criticise", "FOG-0001", "--json").stdout == first
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "empty"))  # worked out again, not read back
    assert lab.run("criticise", "FOG-0001", "--json").stdout == first


@pytest.mark.slow
def test_bench_effects_stay_on_the_bench(bring: Callable[[Recording], Lab]) -> None:
    lab = bring(single_axis(8, table_rate_ripple=2e-4))
    lab.run("fit", "FOG-0001", "--model", "ojeda2000")
    better = lab.json("improve", "FOG-0001", "--add", "table_rate_ripple")
    assert [line["effect"] for line in better["left_out"]] == ["table_rate_ripple"]
    document = json.loads(lab.run("calibration", "FOG-0001", "--version", "2").stdout)
    assert [term["effect"] for term in document["model"]["terms"]] == ["rate_temperature_surface"]


@pytest.mark.slow
def test_a_formula_leaves_with_the_calibration(bring: Callable[[Recording], Lab]) -> None:
    lab = bring(single_axis(8, supply_sensitivity=0.2))
    lab.run("fit", "FOG-0001", "--model", "ojeda2000")
    better = lab.json("improve", "FOG-0001", "--formula", "supply_law: supply_v - 5")
    assert better["error"]["rms_dps"] < better["before"]["rms_dps"]
    document = json.loads(lab.run("calibration", "FOG-0001", "--version", "2").stdout)
    assert document["model"]["terms"][-1]["formula"] == "supply_v - 5"
    said = lab.run("improve", "FOG-0001", "--formula", "bad: open('x')", status=2).stderr
    assert said.count("\n") == 1


def test_too_little_data_is_a_verdict_and_an_exit_status(bring: Callable[[Recording], Lab]) -> None:
    recording = single_axis(1)
    kept = np.isin(recording.columns["dataset"], [1, 5, 9])
    lab = bring(replace(recording, columns={k: v[kept] for k, v in recording.columns.items()}))
    lab.run("fit", "FOG-0001", "--effects", "bias,scale_factor")
    answer = json.loads(lab.run("criticise", "FOG-0001", "--json", status=1).stdout)
    assert answer["verdict"] == "insufficient_data"
    assert "more data sets" in answer["text"][0]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["criticise", "FOG-0001"], "has no calibration yet"),
        (["criticise", "NO_SERVICE"], "'NO_SERVICE' is not in this database"),
        (["ladder", "FOG-0001"], "has no calibration yet"),
    ],
)
def test_what_is_wrong_gets_one_line(bring: Callable[[Recording], Lab], arguments: list[str], said: str) -> None:
    lab = bring(single_axis(1))
    result = lab.run(*arguments, status=2)
    assert said in result.stderr
    assert result.stderr.count("\n") == 1


@pytest.mark.parametrize("step", [0.05, 0.5, 5.0])
def test_coarse_readings_are_noise_and_no_missing_effect(step: float) -> None:
    """A mean of coarse readings is known to the step only; without scatter there is no division by zero."""
    found = held(spoilt(single_axis(1), quantised(step)), full=True)
    assert (found.verdict.form, found.verdict.named) == ("adequate", ())
    assert found.base is not None
    assert found.base.error.rms_dps is not None
    assert found.base.error.noise_floor_dps is not None
    assert found.base.error.rms_dps < 1.5 * found.base.error.noise_floor_dps


@pytest.mark.parametrize("as_points", [False, True])
def test_data_without_any_scatter_are_no_traceback(as_points: bool) -> None:
    def exact(columns: dict[str, np.ndarray]) -> None:
        columns["gyro_z"] = 1.01 * columns["table_rate_dps"] + 0.1

    recording = spoilt(single_axis(1), exact)
    assert held(to_points(recording) if as_points else recording).verdict.form == "adequate"
