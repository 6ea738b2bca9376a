"""Hard and soft iron of simulated turns, with the shares that their uncertainties cover; and data that lack them."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from labctl.errors import NotEnoughData
from labctl.fitting.magnetometer import calibrate
from labctl.fitting.magnetometer.calibrate import calibrate_magnetometer
from labctl.fitting.magnetometer.ellipsoid import PLACES, Ellipsoid, Product, nearest_ellipsoid, quadric, unweighed
from labctl.fitting.numeric.arrays import Array
from tests.helpers.magnetic_turns import FIELD_UT, HARD_IRON_UT, SOFT_IRON, fields, readings_of


def truth(field_ut: float | None) -> np.ndarray:
    """Return hard iron, soft iron and field, (10,), where the field is given or the matrix has determinant 1."""
    scale = 1.0 if field_ut is not None else 1 / np.cbrt(np.linalg.det(SOFT_IRON))
    return np.array([*HARD_IRON_UT, *(scale * SOFT_IRON[place] for place in PLACES), scale * FIELD_UT])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("field_ut", "noise_ut", "memory"), [(FIELD_UT, 0.4, 0.0), (None, 0.4, 0.0), (FIELD_UT, 1.5, 0.0), (None, 0.4, 0.8)]
)
def test_its_uncertainties_cover_the_truth(field_ut: float | None, noise_ut: float, memory: float) -> None:
    field, inside = fields(1000 if memory else 400), []
    for seed in range(40):
        found = calibrate_magnetometer("m", readings_of(field, seed, noise_ut, memory), field_ut)
        values = np.array([*found.hard_iron_ut, *(found.soft_iron[place] for place in PLACES), found.field_ut])
        known = slice(9 if field_ut is not None else 10)
        inside.append(np.abs(values - truth(field_ut))[known] <= 1.96 * found.u[known])
        assert found.verdict == "adequate"
    assert 0.91 < np.mean(inside) < 0.98


def test_corrected_readings_have_the_size_of_the_field() -> None:
    readings = readings_of(fields(2000), 1, noise_ut=1e-6)
    found = calibrate_magnetometer("m", readings, FIELD_UT)
    corrected = (readings - found.hard_iron_ut) @ found.soft_iron.T
    assert corrected == pytest.approx(fields(2000), abs=1e-4)
    assert found.largest_gap_deg < 30


def test_the_start_is_the_quadric_through_exact_readings() -> None:
    start = quadric(readings_of(fields(500), 1, noise_ut=0.0))
    assert start is not None
    assert start[0] == pytest.approx(HARD_IRON_UT, abs=1e-9)
    assert FIELD_UT * start[1] == pytest.approx(SOFT_IRON, abs=1e-9)


def test_a_few_wrong_readings_change_nothing() -> None:
    readings = readings_of(fields(1500), 3)
    right = calibrate_magnetometer("m", readings, FIELD_UT)
    readings[100:110] += 60.0  # a magnet passes
    found = calibrate_magnetometer("m", readings, FIELD_UT)
    assert np.count_nonzero(~found.used) == 10
    assert np.all(np.abs(found.hard_iron_ut - right.hard_iron_ut) < 0.5 * right.u[:3])
    assert found.verdict == "adequate"


def test_a_field_that_differs_with_place_is_not_explained() -> None:
    field = fields(1500)
    drift = 1 + 0.05 * np.sin(np.linspace(0, 9, len(field)))[:, None]
    assert calibrate_magnetometer("m", readings_of(field * drift, 4), FIELD_UT).verdict == "unexplained"


def test_without_an_ellipsoid_by_the_weights_of_places_nothing_is_stated(monkeypatch: pytest.MonkeyPatch) -> None:
    """The scatter of places says nothing of an ellipsoid by equal weights."""
    readings, rest = readings_of(fields(400), 1), np.repeat(np.arange(40) % 2 * (1 + np.arange(40) // 2), 10)
    assert calibrate_magnetometer("m", readings, FIELD_UT, rest).u.shape == (10,)

    def only_by_equal_weights(
        of: NDArray[np.float64], centre: Array, matrix: NDArray[np.float64], product: Product = unweighed
    ) -> Ellipsoid | None:
        return nearest_ellipsoid(of, centre, matrix) if product is unweighed else None

    monkeypatch.setattr(calibrate, "nearest_ellipsoid", only_by_equal_weights)
    with pytest.raises(NotEnoughData, match=r"turn the unit slowly through all directions"):
        calibrate_magnetometer("m", readings, FIELD_UT, rest)


def test_turns_about_one_axis_do_not_determine_the_others() -> None:
    angle = np.linspace(0, 12 * np.pi, 600)
    flat = FIELD_UT * np.column_stack([np.cos(angle), np.sin(angle), np.zeros(600)])
    with pytest.raises(NotEnoughData, match=r"turn the unit slowly through all directions"):
        calibrate_magnetometer("m", flat + HARD_IRON_UT, FIELD_UT)
    rng = np.random.default_rng(1)
    tilted = readings_of(flat + [0, 0, 5.0] * np.sign(np.sin(5 * angle))[:, None], 5, noise_ut=0.5)
    with pytest.raises(NotEnoughData, match=r"do(es)? not determine|that they determine"):
        calibrate_magnetometer("m", tilted + rng.normal(0, 0.1, tilted.shape), FIELD_UT)
    with pytest.raises(NotEnoughData, match=r"20 readings of a magnetometer; nine parameters need 60"):
        calibrate_magnetometer("m", flat[:20])
