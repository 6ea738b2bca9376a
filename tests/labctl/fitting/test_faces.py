"""Opposite mountings: what the faces of the fixture differ by is found, and is no error of the unit or of its model."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from labctl.fitting.criticism import criticise
from labctl.fitting.data.channels import Channels
from labctl.fitting.data.faces import face_columns
from labctl.fitting.data.fit_data import fit_data_of
from labctl.fitting.data.temperature.channel import with_temperature
from labctl.fitting.estimation.axis_solutions import solve_axes
from labctl.fitting.estimation.fit import fit_preset
from labctl.fitting.models.presets import preset_for
from labctl.recording import Recording
from studies.rate_vector_coverage import CASES, MODEL, info_of
from studies.rate_vector_simulation import AXES, Bench, Noise, Statement, Unit, campaign

SIX = next(case for case in CASES if case.plan.name.startswith("six") and len(case.outputs) == 3 and case.is_adequate)


@pytest.fixture(scope="module", params=[3, 4])
def made(request: pytest.FixtureRequest) -> tuple[Recording, Unit, Bench]:
    """A unit on six faces of a fixture that is twice as bad as stated."""
    rng, stated = np.random.default_rng(request.param), Statement(fixture_deg=0.05)
    unit, bench = Unit.of(rng, 0.0), Bench.of(rng, stated, SIX.plan.positions)
    columns = campaign(unit, bench, SIX.plan, Noise(), stated.turn_on_dps, rng)
    return with_temperature(Recording(info_of(SIX, Statement()), columns)), unit, bench


def lean(bench: Bench, axis: str, other: str, *, sign: float) -> float:
    """Return half the sum (sign +1) or difference (-1) of what opposite mountings about `other` lean towards `axis`."""
    row = AXES.index(axis)
    return 0.5 * float(bench.lean[other][row] - sign * bench.lean[f"-{other}"][row])


def test_the_difference_is_found_and_the_mean_acts_as_misalignment(made: tuple[Recording, Unit, Bench]) -> None:
    recording, unit, bench = made
    data = fit_data_of(recording)
    model, _ = preset_for(None, list(MODEL)).build(data)
    found = solve_axes(data, model)
    for i, axis in enumerate(AXES):
        fit = found.fits[axis]
        assert set(found.nuisance[axis].faces) == set(AXES) - {axis}
        for j, other in enumerate(AXES):
            if other == axis:
                continue
            assert found.nuisance[axis].faces[other] == pytest.approx(lean(bench, axis, other, sign=-1.0), abs=3e-5)
            misaligned = fit.values[fit.names.index(f"misalignment_{other}"), 0]
            assert misaligned == pytest.approx(unit.gain[i, j] + lean(bench, axis, other, sign=1.0), abs=3e-5)


def test_what_is_left_is_noise_and_no_effect_is_blamed(made: tuple[Recording, Unit, Bench]) -> None:
    data = fit_data_of(made[0])
    result = fit_preset(data, preset_for(None, list(MODEL)))
    assert result.error.rms_dps is not None
    assert result.error.noise_floor_dps is not None
    assert result.error.heldout_rms_dps is not None
    assert result.error.rms_dps < 1.2 * result.error.noise_floor_dps
    assert result.error.heldout_rms_dps < 1.5 * result.error.noise_floor_dps
    assert criticise(made[0], result.fitted.model, full=False).verdict.named == ()


@pytest.mark.parametrize(
    ("positions", "rates", "axes"),
    [
        (("x", "-x", "y"), (-10.0, 10.0), ["x"]),
        (("x", "y", "z"), (-10.0, 10.0), []),
        (("x", "-x"), (0.0, 0.0), []),
        (("x", "-x", "-y", "y"), (0.0, 10.0), ["x", "y"]),
    ],
)
def test_only_what_turns_with_either_end_up_has_a_column(positions: Any, rates: Any, axes: list[str]) -> None:
    position = np.repeat(np.array(positions), len(rates))
    table = np.tile(np.array(rates), len(positions))
    channels = Channels({"position": position, "table_rate_dps": table}, dict.fromkeys(AXES, table))
    assert list(face_columns(channels, "z")) == axes
    for other, values in face_columns(channels, "z").items():
        assert np.array_equal(values, np.where(np.char.endswith(position, other), table, 0.0))


def test_held_out_errors_know_the_faces_where_one_mounting_is_left_out(made: tuple[Recording, Unit, Bench]) -> None:
    """Opposite mountings at two of the temperatures, as [inverted] has them: a part left out has one of them alone."""
    columns = made[0].columns
    down = np.char.startswith(np.asarray(columns["position"]).astype(str), "-")
    warm = np.asarray(columns["chamber_c"])
    kept = ~down | (np.abs(warm - np.median(warm)) < 20.0)
    part = Recording(made[0].info, {name: values[kept] for name, values in columns.items()})
    error = fit_preset(fit_data_of(part), preset_for(None, list(MODEL))).error
    assert error.heldout_rms_dps is not None
    assert error.noise_floor_dps is not None
    assert error.heldout_rms_dps < 2.0 * error.noise_floor_dps
