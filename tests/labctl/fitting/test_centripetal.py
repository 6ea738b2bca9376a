"""The centripetal acceleration of a unit whose distance from the table's axis is known, and of one where it is not."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, datetime

import numpy as np
import pytest

from instruments.standards import Standard
from labctl.errors import NotEnoughData
from labctl.fitting.data.channels import Channels, channels_of
from labctl.fitting.data.joined import joined_recording
from labctl.fitting.effects import CATALOGUE, Column, Reference, Term
from labctl.fitting.effects.acceleration import force_g
from labctl.fitting.estimation.fit import fit
from labctl.recording import Recording, RecordingInfo
from labctl.recording.positions import comparable, further

RATES = np.array([0.0, 100.0, -100.0, 200.0, -200.0, 300.0, -300.0, 400.0, -400.0])
G_X = 0.02  #: deg/s/g, of the output z
PULL_G = np.radians(400.0) ** 2 * 0.2 / 9.80665


def recording(
    positions: Sequence[str], error_of: float = 0.0, standards: tuple[Standard, ...] = (), seed: int = 1
) -> Recording:
    """Return means of a z gyro at some rates in positions, at the true radius of each with a cross g-sensitivity."""
    rate, position = np.tile(RATES, len(positions)), np.repeat(np.array(positions), len(RATES))
    n = len(rate)
    radius_m = np.array([int("".join(c for c in p if c.isdigit()) or 0) / 1000 for p in positions]).repeat(len(RATES))
    pull_g = -(np.radians(rate) ** 2) * (radius_m + error_of * (radius_m > 0)) / 9.80665
    noise = np.random.default_rng(seed).normal(0.0, 1e-4, n)
    columns = {
        "dataset": np.arange(1, n + 1), "t_s": 60.0 * np.arange(n), "position": position, "run": np.ones(n, dtype=int),
        "mounting": np.repeat(np.arange(1, len(positions) + 1), len(RATES)), "table_rate_dps": rate,
        "temperature_c": np.full(n, 25.0), "gyro_z": rate + G_X * pull_g + noise, "gyro_z_std": np.full(n, 1e-3),
        "n": np.full(n, 100),
    }  # fmt: skip
    info = RecordingInfo(
        serial="U-1", axes=("z",), kind="points", started_at=datetime(2026, 1, 5, tzinfo=UTC), standards=standards
    )
    return Recording(info, columns)


def columns(effect: str, channels: Channels, **parameters: float) -> dict[str, Column]:
    made = CATALOGUE[effect].columns(channels, "z", Term(effect, None, parameters), Reference())
    return {column.name: column for column in made}


def test_the_specific_force_points_to_the_axis_where_distance_and_direction_are_known() -> None:
    channels = channels_of(recording(["zr200x", "zr200-y", "zr0x"]))
    fast = channels.take(channels.table_rate_dps() == 400.0)
    assert force_g(fast, "x") == pytest.approx([-PULL_G, 0.0, 0.0], abs=1e-12)
    assert force_g(fast, "y") == pytest.approx([0.0, PULL_G, 0.0], abs=1e-12)
    np.testing.assert_array_equal(force_g(fast, "z"), 1.0)


@pytest.mark.parametrize("positions", [["z"], ["zr200"], ["zr200x", "z"], ["zr200x", "zr60"], ["zr200x", "zr60x@0/90"]])
def test_where_some_row_does_not_say_it_the_force_is_gravity_in_all(positions: list[str]) -> None:
    """A row without the direction would count as one without a pull, beside rows that have it."""
    channels = channels_of(recording(positions))
    np.testing.assert_array_equal(force_g(channels, "x"), 0.0)
    assert CATALOGUE["centripetal_acceleration"].undetermined_by(channels, "z") == ""
    assert CATALOGUE["cross_g_sensitivity"].undetermined_by(channels, "z") != ""


def test_positions_are_comparable_by_the_rows_that_turn() -> None:
    position = np.array(["zr200x", "z"])
    assert comparable(position, np.array([True, False])).tolist() == ["zr200x", "z"]
    assert comparable(position, np.array([True, True])).tolist() == ["zr200", "z"]
    assert further(position, 1).tolist() == ["zr201x", "z"]


def test_recordings_of_known_and_unknown_distance_are_comparable_together() -> None:
    joined = joined_recording({1: recording(["z"]), 2: recording(["zr200x", "zr50x"])})
    assert {name for name, _ in channels_of(joined).positions()} == {"z", "zr200", "zr50"}


def test_rows_of_unknown_distance_have_a_coefficient_of_their_own() -> None:
    known = columns("centripetal_acceleration", channels_of(recording(["zr200", "zr50"])), by_position=0.0)
    assert list(known) == ["centripetal"]
    assert known["centripetal"].values[[7, 16]] == pytest.approx([PULL_G, PULL_G / 4])
    mixed = columns("centripetal_acceleration", channels_of(recording(["z", "zr200"])), by_position=1.0)
    assert list(mixed) == ["centripetal_z_up", "centripetal_z_up_unknown_radius"]
    assert mixed["centripetal_z_up"].values[[7, 16]] == pytest.approx([0.0, PULL_G])
    assert mixed["centripetal_z_up_unknown_radius"].values[[7, 16]] == pytest.approx([PULL_G / 2, 0.0])  # at 0.1 m
    unknown = columns("centripetal_acceleration", channels_of(recording(["z"])), by_position=1.0)
    assert unknown["centripetal_z_up"].values[7] == pytest.approx(PULL_G / 2)


def test_a_second_distance_determines_the_sensitivity_beside_an_even_nonlinearity() -> None:
    effects = ["bias", "scale_factor", "scale_factor_even", "cross_g_sensitivity"]
    fitted = fit(recording(["zr200x", "zr50x"]), effects=effects).fitted.axes["z"]
    value = dict(zip(fitted.names, fitted.values[:, 0].tolist(), strict=True))
    assert value["g_x"] == pytest.approx(G_X, abs=5e-4)
    assert abs(value["scale_factor_r2"]) < 5e-9
    with pytest.raises(NotEnoughData):
        fit(recording(["zr200x", "zr200x"]), effects=effects)


def test_what_is_part_of_the_specific_force_is_not_fitted_twice() -> None:
    with pytest.raises(NotEnoughData, match="part of the specific force; fit g_sensitivity or cross_g_sensitivity"):
        fit(recording(["zr200x", "zr50x"]), effects=["bias", "scale_factor", "centripetal_acceleration"])


def u_of_g(standards: tuple[Standard, ...]) -> float:
    fitted = fit(recording(["zr200x"], standards=standards), effects=["bias", "scale_factor", "cross_g_sensitivity"])
    axis = fitted.fitted.axes["z"]
    return float(axis.u[axis.names.index("g_x")][0])


def test_the_uncertainty_of_the_distance_is_in_that_of_the_sensitivity() -> None:
    """At one distance sensitivity times distance is measured: their relative uncertainties are the same."""
    without, stated = u_of_g(()), u_of_g((Standard(quantity="radius", u=0.01),))
    assert np.sqrt(stated**2 - without**2) == pytest.approx(G_X * 0.01 / 0.2, rel=0.02)
    off = fit(
        recording(["zr200x"], error_of=0.01), effects=["bias", "scale_factor", "cross_g_sensitivity"]
    ).fitted.axes["z"]
    assert off.values[off.names.index("g_x"), 0] == pytest.approx(G_X * 0.21 / 0.2, abs=5e-4)
