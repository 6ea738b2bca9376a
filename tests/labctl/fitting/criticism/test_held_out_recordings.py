"""Advice on an effect of a channel that one recording changes and the others hold constant."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from labctl.fitting.criticism.advice import advice_for, exported_errors
from labctl.fitting.criticism.held_out_recordings import held_out_recordings
from labctl.fitting.data.fit_data import FitData, fit_data_of
from labctl.fitting.data.joined import joined_recording
from labctl.fitting.effects import Term
from labctl.fitting.estimation.fit import fit
from labctl.fitting.models.presets import preset_for
from labctl.recording import Recording
from tests.helpers.joint_recordings import EFFECTS, WHITE_DPS, recordings
from tests.helpers.simulated_recordings import single_axis

SUPPLY = Term("supply_sensitivity")
STEPS_V = (-0.25, 0.0, 0.25)


def with_supply(recording: Recording, steps_v: tuple[float, ...], dps_per_v: float, seed: int) -> Recording:
    """Return a recording whose regulated supply has steps, and the output that follows it."""
    n = len(recording)
    wander_v = 1e-3 * np.random.default_rng(seed).standard_normal(n)
    supply_v = 5.0 + np.resize(np.repeat(steps_v, 3), n) + wander_v
    gyro = np.asarray(recording.columns["gyro_z"]) + dps_per_v * (supply_v - 5.0)
    return replace(recording, columns={**recording.columns, "supply_v": supply_v, "gyro_z": gyro})


def joined(steps_v: tuple[tuple[float, ...], tuple[float, ...]], dps_per_v: float) -> FitData:
    """Return two days of one unit, each with its steps of the supply voltage."""
    parts = {
        number: with_supply(recording, steps_v[number - 1], dps_per_v, number)
        for number, recording in recordings(21).items()
    }
    return fit_data_of(joined_recording(parts))


def test_a_recording_is_left_out_whole_where_the_others_have_its_voltages() -> None:
    data = joined((STEPS_V, STEPS_V), 0.0)
    of = np.asarray(data.channels["recording"])
    masks = held_out_recordings(data, SUPPLY)
    assert [mask.tolist() for mask in masks] == [(of == 1).tolist(), (of == 2).tolist()]


def test_the_only_recording_with_steps_is_left_out_in_parts_with_every_voltage() -> None:
    data = joined(((0.0,), STEPS_V), 0.0)
    of, supply_v = np.asarray(data.channels["recording"]), np.asarray(data.channels["supply_v"], dtype=np.float64)
    parts = held_out_recordings(data, SUPPLY)
    assert np.array_equal(np.sum(parts, axis=0), (of == 2).astype(int))  # each data set in one part
    for mask in parts:
        assert set(np.round(supply_v[mask] - 5.0, 2)) == set(STEPS_V)
        assert set(np.round(supply_v[~mask & (of == 2)] - 5.0, 2)) == set(STEPS_V)
    assert [mask.tolist() for mask in held_out_recordings(data, Term("scale_factor_even"))] == [
        (of == number).tolist() for number in (1, 2)
    ]


@pytest.mark.parametrize(("dps_per_v", "better"), [(100 * WHITE_DPS, True), (0.0, False)])
def test_the_steps_of_one_recording_are_enough_to_advise_the_effect(dps_per_v: float, *, better: bool) -> None:
    parts = recordings(21)
    steps = {1: (0.0,), 2: STEPS_V}
    whole = joined_recording({n: with_supply(r, steps[n], dps_per_v, n) for n, r in parts.items()})
    model = fit(whole, None, EFFECTS).fitted.model
    checked = exported_errors(fit_data_of(whole), model, (), SUPPLY)
    assert checked.is_better is better
    assert checked.before_dps is not None
    assert checked.after_dps is not None
    assert checked.after_dps < 1.1 * checked.before_dps


@pytest.mark.parametrize(("levels", "said"), [(3, "2 temperatures remain, and the model needs 3"), (4, None)])
def test_how_many_temperatures_are_missing_for_one_to_be_left_out_is_said(levels: int, said: str | None) -> None:
    whole = fit_data_of(single_axis(1))
    warm = np.asarray(whole.channels["chamber_setpoint_c"], dtype=np.float64)
    steps = np.unique(warm)
    kept = whole.take(np.isin(warm, steps[:: len(steps) // levels][:levels]))
    model, _ = preset_for("bias_scale", []).build(kept)
    checked = exported_errors(kept, model, (), Term("scale_factor_odd"))
    assert (checked.before_dps is None) is (said is not None)
    advice = advice_for(kept, model, [Term("scale_factor_odd")])[0]
    assert advice["checked"] is (said is None)
    assert (f"beside one that is left out, {said}; measure at 1 more temperature, or" in advice["why"]) is bool(said)
