"""Angles of mountings: what of them is separated is found, and is no error of the unit or of its model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from labctl.fitting.criticism import criticise
from labctl.fitting.data.channels import Channels
from labctl.fitting.data.fit_data import fit_data_of
from labctl.fitting.data.mounting_angles import (
    WAVES,
    AngleGains,
    angle_columns,
    angle_gains,
    angle_regressor,
    mountings_of,
)
from labctl.fitting.data.temperature.channel import with_temperature
from labctl.fitting.estimation.axis_solutions import solve_axes
from labctl.fitting.estimation.fit import fit_preset
from labctl.fitting.models.presets import preset_for
from labctl.recording import Recording
from labctl.recording.columns import RECORDING
from studies.rate_vector_coverage import CASES, MODEL, info_of
from studies.rate_vector_simulation import AXES, Bench, Noise, Statement, Unit, campaign

TURNED = next(case for case in CASES if case.plan.turned and len(case.outputs) == 3 and case.is_adequate)
POSITIONS = [f"{end}{turned}" for end in ("x", "-x", "y") for turned in ("", "@90", "@180", "@0/90", "@180/90", "@37")]
ENDS = ("x", "-x", "y", "-y")
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
        fit, angles = found.fits[axis], found.nuisance[axis].angles_rad
        for j, other in enumerate(AXES):
            if other == axis:
                continue
            shown = [angles[f"{end} fixture cos"] + angles[f"{end} table cos"] for end in (other, f"-{other}")]
            assert shown == pytest.approx([lean(bench, axis, other, sign=-1.0)] * 2, abs=3e-5)
            misaligned = fit.values[fit.names.index(f"misalignment_{other}"), 0]
            assert misaligned == pytest.approx(unit.gain[i, j] + lean(bench, axis, other, sign=1.0), abs=3e-5)


@pytest.mark.parametrize("seed", [5, 6])
def test_a_unit_turned_on_its_face_shows_its_misalignment_free_of_the_fixture(seed: int) -> None:
    rng, stated = np.random.default_rng(seed), Statement(fixture_deg=0.05, mounting_deg=0.0)
    unit, bench = Unit.of(rng, 0.0), Bench.of(rng, stated, TURNED.plan.mountings)
    columns = campaign(unit, bench, TURNED.plan, Noise(), stated.turn_on_dps, rng)
    data = fit_data_of(with_temperature(Recording(info_of(TURNED, stated), columns)))
    result = fit_preset(data, preset_for(None, list(MODEL)))
    off = []
    for i, axis in enumerate(AXES):
        fit = result.fitted.axes[axis]
        for j, other in enumerate(AXES):
            if other != axis:
                off.append(fit.values[fit.names.index(f"misalignment_{other}"), 0] - unit.gain[i, j])
    assert np.abs(off).max() < 2e-5  # of angles of 9e-4 rad
    assert result.error.rms_dps is not None
    assert result.error.noise_floor_dps is not None
    assert result.error.rms_dps < 1.2 * result.error.noise_floor_dps


@pytest.mark.slow
def test_what_is_left_is_noise_and_no_effect_is_blamed(made: tuple[Recording, Unit, Bench]) -> None:
    data = fit_data_of(made[0])
    result = fit_preset(data, preset_for(None, list(MODEL)))
    assert result.error.rms_dps is not None
    assert result.error.noise_floor_dps is not None
    assert result.error.heldout_rms_dps is not None
    assert result.error.rms_dps < 1.2 * result.error.noise_floor_dps
    assert result.error.heldout_rms_dps < 1.5 * result.error.noise_floor_dps
    assert criticise(made[0], result.fitted.model, full=False).verdict.named == ()


@pytest.mark.slow
@pytest.mark.parametrize("seed", [5, 6])
def test_how_a_unit_is_placed_in_more_mountings_than_needed_is_no_error_of_the_model(seed: int) -> None:
    plan = replace(TURNED.plan, turned=tuple(f"{end}@{angle}" for end in AXES for angle in (90, 180, 270)))
    rng, stated = np.random.default_rng(seed), Statement(mounting_deg=0.006)
    unit, bench = Unit.of(rng, 0.0), Bench.of(rng, stated, plan.mountings)
    columns = campaign(unit, bench, plan, Noise(), stated.turn_on_dps, rng)
    recording = with_temperature(Recording(info_of(replace(TURNED, plan=plan), stated), columns))
    result = fit_preset(fit_data_of(recording), preset_for(None, list(MODEL)))
    assert result.error.rms_dps is not None
    assert result.error.noise_floor_dps is not None
    assert result.error.rms_dps < 1.3 * result.error.noise_floor_dps
    verdict = criticise(recording, result.fitted.model, full=False).verdict
    assert (verdict.form, verdict.named) == ("adequate", ())
    u = result.fitted.axes["x"].u_of("misalignment_y")
    assert u == pytest.approx(np.radians(stated.mounting_deg) / 2, rel=0.1)  # the mean of four mountings


def test_of_several_recordings_no_angle_is_separated_and_all_of_it_is_in_the_budget() -> None:
    position = np.array(["x", "x", "x@180", "x@180", "y", "y"])
    table, of = np.array([1.0, -1.0] * 3), np.array([1, 1, 2, 2, 1, 1])
    channels = Channels({"position": position, "table_rate_dps": table, RECORDING: of}, dict.fromkeys(AXES, table))
    assert len(angle_columns(channels, "z")) == 0
    assert angle_gains(mountings_of(channels), "x") == AngleGains(1.0, 1.0, 1.0)


def channels_of(positions: Sequence[str], rates: Sequence[float]) -> Channels:
    position, table = np.repeat(np.array(positions), len(rates)), np.tile(np.array(rates), len(positions))
    return Channels({"position": position, "table_rate_dps": table}, dict.fromkeys(AXES, table))


@pytest.mark.parametrize(
    ("positions", "rates", "number"),
    [
        (("x", "-x", "y"), (-10.0, 10.0), 1),
        (("x", "y", "z"), (-10.0, 10.0), 0),
        (("x", "-x"), (0.0, 0.0), 0),
        (("x", "-x", "-y", "y"), (0.0, 10.0), 2),
        (("x", "x@180"), (-10.0, 10.0), 1),
        (("z", "z@180"), (-10.0, 10.0), 0),  # its own axis
        (("x", "x@0/180"), (-10.0, 10.0), 1),
        (("x", "x@90", "x@180", "x@270", "-x"), (-10.0, 10.0), 3),
    ],
)
def test_there_is_a_column_for_each_angle_that_is_separated(
    positions: Sequence[str], rates: Sequence[float], number: int
) -> None:
    columns = angle_columns(channels_of(positions, rates), "z")
    assert len(columns) == number
    assert columns.values.shape == (len(positions) * len(rates), number)


@given(st.lists(st.sampled_from(POSITIONS), min_size=1, max_size=6, unique=True))
def test_gains_are_those_of_a_fit_to_the_mountings(positions: list[str]) -> None:
    """Slopes of each mounting with any angles, fitted by the columns: what is wrong with the misalignment."""
    channels, output = channels_of(positions, (-1.0, 1.0)), "z"
    columns = angle_columns(channels, output)
    for other in ("x", "y"):
        up = channels.up(other) * channels.table_rate_dps()
        if not np.any(up):
            continue
        design = np.column_stack([up, columns.values])
        gains = angle_gains(mountings_of(channels), other)
        taken = np.linalg.pinv(design, rcond=1e-9)[0]
        size = {
            part: np.linalg.norm(
                [
                    taken @ angle_regressor(channels, f"{end} {part} {wave}")
                    for end in ENDS
                    for wave in WAVES
                    if other in end
                ]
            )
            for part in ("fixture", "table")
        }
        assert (gains.fixture, gains.table) == pytest.approx((size["fixture"], size["table"]), abs=1e-9)
        mean = [taken[rows] @ channels.table_rate_dps()[rows] for _, rows in channels.positions()]
        assert gains.mounting == pytest.approx(np.linalg.norm(mean), abs=1e-9)


def test_angle_gains_by_mounting_positions() -> None:
    def gains(*positions: str) -> tuple[float, float, float]:
        found = angle_gains(dict.fromkeys(positions, 1.0 / len(positions)), "x")
        return found.fixture, found.table, found.mounting

    half = 0.5**0.5
    assert gains("x", "y") == pytest.approx((1, 1, 1))
    assert gains("x", "-x") == pytest.approx((half, half, half))
    assert gains("x", "x@180") == pytest.approx((0, 0, half))
    assert gains("x", "x@0/180") == pytest.approx((1, 0, half))
    assert gains("x", "x@90", "x@180", "x@270") == pytest.approx((0, 0, 0.5))
    assert gains("x", "x@90") == pytest.approx((half, half, half))
    pooled = angle_gains({"x": 0.9, "-x": 0.1}, "x", separates=False)
    assert pooled.fixture == pytest.approx((0.9**2 + 0.1**2) ** 0.5)


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
