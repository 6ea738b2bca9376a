"""Other tools on a small campaign: they see labctl's columns, and name what is plain to see."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest

from labctl.fitting.criticism.evidence.design import Design
from labctl.fitting.criticism.model_comparison import design_of
from labctl.fitting.criticism.reduction import ReducedRecording, reduce_recording
from labctl.fitting.data.fit_data import fit_data_of
from labctl.fitting.models.presets import changed, preset_for
from studies import baselines
from studies.baselines import Table, entries, table_of
from studies.campaigns import campaign

installed = pytest.mark.skipif(
    bool(baselines.missing()),
    reason=f"not installed: {', '.join(baselines.missing())} (the extra `study`, by `make study`)",
)
HIDDEN = {"scale_factor_asymmetry": 1e-3}


@lru_cache(maxsize=1)
def small() -> tuple[ReducedRecording, Design]:
    recording = campaign("O", 3, HIDDEN)
    context = fit_data_of(recording)
    model, _ = changed(preset_for("ojeda2000", []).build(context)[0]).build(context)
    data = reduce_recording(recording)
    return data, design_of(data, model, "z")


@pytest.mark.parametrize("means", [True, False])
def test_a_table_has_the_base_taken_off_every_column(means: bool) -> None:
    data, design = small()
    table = table_of(data, design, "z", means=means)
    rows = len(data) if means else int(design.present.sum())
    assert table.columns.shape == (rows, len(table.effects))
    assert np.linalg.norm(table.columns, axis=0) == pytest.approx(1.0)
    weight = np.ones(len(data)) if means else 1.0 / np.sqrt((data.white_var or {})["z"])
    there = design.present & (np.arange(len(design.present))[:, None] < (1 if means else 99))
    base = design.base[there] * np.broadcast_to(weight, there.shape)[there][:, None]
    base /= np.maximum(np.linalg.norm(base, axis=0), 1e-300)
    assert np.abs(base.T @ table.columns).max() < 1e-5
    assert np.abs(base.T @ table.target).max() < 1e-5 * np.linalg.norm(table.target)
    assert set(table.effects) <= {option.candidate for option in design.options if not option.smooth}


def made_up(noise: float = 0.1) -> Table:
    """Ten columns, two of them in the target; the fourth is nearly the second."""
    rng = np.random.default_rng(8)
    columns = rng.normal(size=(80, 10))
    columns[:, 4] = columns[:, 2] + 0.05 * columns[:, 4]
    columns /= np.linalg.norm(columns, axis=0)
    target = 9.0 * columns[:, 2] - 5.0 * columns[:, 7] + noise * rng.normal(size=80)
    effects = np.array([f"effect_{k}" for k in range(10)])
    return Table(columns, target, effects, np.repeat(np.arange(8), 10))


def test_forward_selection_takes_the_greatest_fall_each_time() -> None:
    table = made_up()
    found = list(entries(table))
    assert [column for column, _ in found[:2]] == [2, 7]
    for k in (1, 2, 5):
        chosen = table.columns[:, [column for column, _ in found[:k]]]
        left = table.target - chosen @ np.linalg.lstsq(chosen, table.target)[0]
        assert sum(gain for _, gain in found[:k]) == pytest.approx(table.target @ table.target - left @ left)


@installed
@pytest.mark.parametrize("tool", baselines.TOOLS)
def test_each_tool_finds_both_made_up_effects(tool: object) -> None:
    assert callable(tool)
    for picks in tool(made_up()).values():
        assert {effect for effect, _ in picks[:3]} >= {"effect_7"}
        assert {effect for effect, _ in picks} & {"effect_2", "effect_4"}


@installed
def test_bic_stops_no_later_than_aic() -> None:
    found = baselines.forward(made_up(1.0))
    assert len(found["forward BIC (statsmodels)"]) <= len(found["forward AIC (statsmodels)"])


@installed
def test_every_tool_answers_on_means_and_on_rows() -> None:
    data, design = small()
    answers = baselines.ask(data, {"z": design})
    assert len(answers) == 8
    assert {name.rsplit(", ", 1)[1] for name in answers} == {"means", "rows"}
    for name, answer in answers.items():
        # thresholded least squares loses it among as many columns as there are means
        assert answer["named"] if "STLSQ" in name else "scale_factor_asymmetry" in answer["named"], name
    assert answers["forward BIC (statsmodels), means"]["named"][0] == "scale_factor_asymmetry"
    assert set(baselines.versions()) == set(baselines.DISTRIBUTIONS)
