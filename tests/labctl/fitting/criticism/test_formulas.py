"""Formulas of a person's own, in criticism and in a calibration that is used; and a recording without a table angle."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from labctl.calibration import build_calibration
from labctl.compensator import Compensator
from labctl.errors import BadInput
from labctl.fitting import FitResult
from labctl.fitting.data.channels import Channels
from labctl.fitting.data.fit_data import fit_data_of
from labctl.fitting.effects import CATALOGUE, Reference, Term, formulas
from labctl.fitting.estimation.fit import fit_preset
from labctl.fitting.models.presets import changed, preset_for
from labctl.recording import Recording
from labctl.services.simulation.plan_simulation import hidden_recording
from tests.helpers.criticism import held
from tests.helpers.simulated_recordings import plan_on, single_axis, three_axes

SUPPLY = "supply_scale: supply_v * table_rate_dps"


def supplied(seed: int) -> Recording:
    """Return a recording whose scale factor follows a supply of 5 V that wanders by a hundredth."""
    recording = single_axis(seed)
    columns = dict(recording.columns)
    volts = np.asarray(columns["supply_v"], dtype=np.float64)
    columns["gyro_z"] = columns["gyro_z"] + 2e-3 * (volts - volts.mean()) * columns["table_rate_dps"]
    return replace(recording, columns=columns)


def fitted_with(recording: Recording, text: str) -> FitResult:
    (formula,) = formulas(text)
    context = fit_data_of(recording)
    model, _ = preset_for("bias_scale", []).build(context)
    return fit_preset(context, changed(model, (Term(formula.id, formula=formula.text),)))


def in_use(recording: Recording, text: str) -> Compensator:
    made = fitted_with(recording, text)
    at = recording.info.started_at
    assert at is not None
    return Compensator(build_calibration(recording.info, made, version=1, parent=None, issued_at=at, provenance={}))


def test_a_formula_whose_value_hardly_varies_is_named_when_true() -> None:
    (formula,) = formulas(SUPPLY)
    found = held(supplied(3), catalogue={**CATALOGUE, formula.id: formula})
    assert found.verdict.named == ("supply_scale",)


@pytest.mark.parametrize("text", ["same: 3 * rate_dps", "level: rate_dps * 0 + 4"])
def test_a_formula_that_the_model_has_already_is_not_named(text: str) -> None:
    (formula,) = formulas(text)
    found = held(single_axis(2), catalogue={**CATALOGUE, formula.id: formula})
    assert found.verdict.form == "adequate"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("odd: position", "column 'position' holds text"),
        ("odd: pressure_kpa", "the recording has no column 'pressure_kpa'"),
    ],
)
def test_a_column_that_a_formula_cannot_take_is_named(text: str, said: str) -> None:
    (formula,) = formulas(text)
    still = {"z": np.zeros(3)}
    channels = Channels({"position": np.array(["z", "z", "z"]), "temperature_c": np.zeros(3)}, still)
    with pytest.raises(BadInput, match=said):
        formula.columns(channels, "z", Term(formula.id), Reference())


def test_in_use_the_tables_rate_is_that_of_the_only_axis() -> None:
    recording = supplied(1)
    by_table, by_axis = (in_use(recording, text) for text in (SUPPLY, SUPPLY.replace("table_rate_dps", "rate_dps")))
    rates, volts = np.array([-40.0, 3.0, 80.0]), {"supply_v": np.array([4.9, 5.0, 5.1])}
    found, expected = (each.compensate(rates, 30.0, volts).rate_dps for each in (by_table, by_axis))
    assert np.allclose(found, expected, atol=2e-4)


@pytest.mark.slow
def test_of_three_axes_it_is_refused_by_name() -> None:
    recording = three_axes(1)
    used = in_use(recording, SUPPLY)
    with pytest.raises(BadInput, match="the recording has no column 'table_rate_dps'"):
        used.compensate(np.zeros((2, 3)), 25.0, {"supply_v": np.full(2, 5.0)})


def test_without_a_table_angle_the_steps_are_no_effect() -> None:
    plan, bench = plan_on("ojeda2000", "single-axis-sim")
    recording = hidden_recording(plan, bench, bench.gyros[0], 7, {})
    columns = {name: values for name, values in recording.columns.items() if name != "table_angle_deg"}
    found = held(replace(recording, columns=columns))
    assert (found.verdict.form, found.verdict.named) == ("adequate", ())
