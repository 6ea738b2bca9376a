"""Tilted mountings: what the angle of their fixture does to a matrix, by numpy alone, and where it is separated."""

from __future__ import annotations

from datetime import UTC, datetime

import numpy as np
import pytest
from numpy.typing import NDArray

from labctl.errors import NotEnoughData
from labctl.fitting import FitResult, fit
from labctl.fitting.data.tilted_mountings import TILTED, element_gain, has_tilted, leaning_mountings, undetermined
from labctl.fitting.uncertainty import (
    BenchConditions,
    coefficient_budgets,
    conditions_of,
    evidence_of,
    rate_vector_uncertainty,
)
from labctl.fitting.uncertainty.local_model_error import LocalModelError
from labctl.recording import Recording, RecordingInfo, Standard

AXES = "xyz"
STRAIGHT = ("x", "y", "z")
#: The four diagonals of a cube and their directions, written down by hand.
DIAGONALS = {"x+y+z": (1, 1, 1), "x-y-z": (1, -1, -1), "-x+y-z": (-1, 1, -1), "-x-y+z": (-1, -1, 1)}
UP = {"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1), **DIAGONALS}
EFFECTS = ["bias", "scale_factor", "misalignment"]
K = np.eye(3) + np.array([[0.004, 0.011, -0.007], [-0.009, -0.003, 0.002], [0.005, -0.012, 0.006]])
BIAS = np.array([0.3, -0.2, 0.1])
U_DEG = 0.1
W = {"x": 60.0, "y": -40.0, "z": 30.0}


def unit_vector(position: str) -> NDArray[np.float64]:
    return np.array(UP[position], dtype=np.float64) / np.linalg.norm(UP[position])


def leans(positions: tuple[str, ...], rng: np.random.Generator, u_rad: float) -> dict[str, NDArray[np.float64]]:
    """Return what each axis of rotation is off by, across its direction."""
    drawn = {each: rng.normal(0.0, u_rad, 3) for each in positions}
    return {each: lean - (lean @ unit_vector(each)) * unit_vector(each) for each, lean in drawn.items()}


def measured(positions: tuple[str, ...], lean: dict[str, NDArray[np.float64]] | None = None) -> Recording:
    """Return means of a tri-axial unit, with little noise."""
    rng = np.random.default_rng(5)
    rates = np.tile([100.0, -100.0, 50.0, -50.0, 0.0, 0.0], 3)
    position = np.repeat(positions, len(rates))
    rate = np.tile(rates, len(positions))
    direction = np.array([unit_vector(each) + (lean[each] if lean else 0.0) for each in position.tolist()])
    output = (direction * rate[:, None]) @ K.T + BIAS + rng.normal(0.0, 1e-5, (len(rate), 3))
    columns: dict[str, NDArray[np.generic]] = {
        "dataset": np.arange(len(rate)), "t_s": 100.0 * np.arange(len(rate)), "position": position,
        "mounting": np.repeat(np.arange(len(positions)), len(rates)), "table_rate_dps": rate,
        "temperature_c": np.full(len(rate), 25.0), "n": np.full(len(rate), 100),
    }  # fmt: skip
    columns |= {f"gyro_{axis}": output[:, i] for i, axis in enumerate(AXES)}
    columns |= {f"gyro_{axis}_std": np.full(len(rate), 1e-4) for axis in AXES}
    info = RecordingInfo(
        serial="TILTED", axes=("x", "y", "z"), kind="points", started_at=datetime(2026, 1, 5, tzinfo=UTC),
        max_rate_dps=100, standards=(Standard(quantity=TILTED, u=U_DEG),),
    )  # fmt: skip
    return Recording(info, columns)


def matrix_of(result: FitResult) -> NDArray[np.float64]:
    fits = result.fitted.axes
    return np.array(
        [
            [
                fits[axis].value_of("scale_factor" if other == axis else f"misalignment_{other}") + (other == axis)
                for other in AXES
            ]
            for axis in AXES
        ]
    )


@pytest.mark.parametrize("positions", [STRAIGHT, tuple(DIAGONALS), tuple(DIAGONALS)[:3], ("x", "y", "x+y+z")])
def test_a_lean_changes_the_matrix_as_plain_least_squares_says(positions: tuple[str, ...]) -> None:
    rng = np.random.default_rng(1)
    weights = rng.uniform(0.5, 2.0, len(positions))
    shares = dict(zip(positions, (weights / weights.sum()).tolist(), strict=True))
    up, root = np.array([unit_vector(each) for each in positions]), np.sqrt(weights)[:, None]
    lean = leans(positions, rng, 1e-3)
    shown = up @ K.T + np.array([lean[each] for each in positions])
    solved, *_ = np.linalg.lstsq(root * up, root * shown, rcond=None)
    assert len(leaning_mountings(shares)) == len(positions)
    change = np.zeros((3, 3))
    for position, mounting in zip(positions, leaning_mountings(shares), strict=True):
        change += np.tensordot(mounting.across @ lean[position], mounting.matrices, axes=1)
    np.testing.assert_allclose(solved.T - K, change, atol=1e-12)


def test_one_axis_after_the_other_leaves_the_scale_factor_alone_and_diagonals_do_not() -> None:
    straight, four, three = (
        dict.fromkeys(positions, 1.0 / len(positions)) for positions in (STRAIGHT, DIAGONALS, tuple(DIAGONALS)[:3])
    )
    assert element_gain(straight, "x", "x") == pytest.approx(0.0, abs=1e-12)
    assert element_gain(straight, "x", "y") == pytest.approx(1.0)
    # sum of g^2 (1 - d_x^2) over four mountings with |g_x| = 3/4 / sqrt 3: 9/16 * 4 / 3 * 2/3 = 1/2
    assert element_gain(four, "x", "x") == pytest.approx(np.sqrt(0.5))
    assert element_gain(four, "x", "y") == pytest.approx(np.sqrt(0.5))
    assert element_gain(three, "x", "x") > element_gain(four, "x", "x")


def test_beside_the_straight_mountings_the_tilted_fixture_is_found_and_changes_nothing() -> None:
    positions = (*STRAIGHT, "x+y+z")
    off = {**leans(positions, np.random.default_rng(2), 0.0), "x+y+z": np.array([0.02, -0.01, -0.01])}
    ideal, leaning = (fit(measured(positions, lean), effects=EFFECTS) for lean in (None, off))
    assert not has_tilted(positions)
    np.testing.assert_allclose(matrix_of(ideal), K, atol=3e-6)
    np.testing.assert_allclose(matrix_of(leaning), K, atol=3e-6)
    for i, axis in enumerate(AXES):
        assert leaning.angles_rad[axis]["x+y+z tilt"] == pytest.approx(off["x+y+z"][i], abs=5e-6)
    conditions = conditions_of(measured(positions).info, leaning.environment, mountings=leaning.mountings)
    (line,) = (each for each in budget_lines(measured(positions), leaning, conditions) if each.source == TILTED)
    assert line.contribution == 0.0
    assert "separated from the coefficients" in line.why


def budget_lines(recording: Recording, result: FitResult, conditions: BenchConditions) -> list:  # type: ignore[type-arg]
    evidence = evidence_of(recording, None, EFFECTS)
    budgets = coefficient_budgets(result.fitted, 25.0, evidence=evidence, name="unit", bench=conditions)
    return list(budgets["x"]["scale_factor"].lines)


def test_diagonals_alone_carry_the_angle_of_their_fixture_in_every_element() -> None:
    positions, rng = tuple(DIAGONALS), np.random.default_rng(3)
    recording = measured(positions)
    result = fit(recording, effects=EFFECTS)
    np.testing.assert_allclose(matrix_of(result), K, atol=3e-6)
    conditions = conditions_of(recording.info, result.environment, mountings=result.mountings)
    assert conditions.has_tilted
    (line,) = (each for each in budget_lines(recording, result, conditions) if each.source == TILTED)
    u_rad = np.radians(U_DEG)
    assert line.contribution == pytest.approx(np.sqrt(0.5) * u_rad, rel=0.02)
    up = np.array([unit_vector(each) for each in positions])
    w = np.array(list(W.values()))
    drawn = [
        np.linalg.lstsq(up, np.array(list(leans(positions, rng, u_rad).values())), rcond=None)[0].T @ w
        for _ in range(4000)
    ]
    promised = rate_vector_uncertainty(
        result.fitted, W, 25.0, evidence=evidence_of(recording, None, EFFECTS), name="unit", bench=conditions
    )
    (of_fixture,) = (each for each in promised.sources if each.lines[0].source == TILTED)
    np.testing.assert_allclose(of_fixture.covariance, np.cov(np.array(drawn).T), rtol=0.1, atol=5e-4)
    aligned = next(each for each in promised.aligned_sources if each.lines[0].source == TILTED)
    assert np.trace(aligned.covariance) < np.trace(of_fixture.covariance)


@pytest.mark.parametrize("positions", [("x+y+z",), ("x+y+z", "x-y-z"), ("x", "x+y+z")])
def test_too_few_directions_are_refused_with_what_to_add(positions: tuple[str, ...]) -> None:
    with pytest.raises(NotEnoughData, match=r"need three directions along the table axis.*such as x, y and z"):
        fit(measured(positions), effects=EFFECTS)
    assert undetermined(STRAIGHT) == undetermined(tuple(DIAGONALS)[:3]) == undetermined(("x",)) == ""


def test_data_of_a_tilted_unit_say_what_the_model_leaves_at_a_rate_about_another_axis() -> None:
    turned = np.repeat([-230.0, -115.0, 0.0, 115.0, 230.0], 4)
    rest, n = 0.0 * turned, len(turned)
    warm = np.repeat([-30.0, 25.0], n)
    left, white = np.full(2 * n, 4e-6), np.full(2 * n, 1e-6)
    about_y = np.concatenate([rest, turned])  # at 25 deg C alone
    straight = LocalModelError(np.concatenate([turned, rest]), warm, left, white, {"y": about_y})
    assert straight.at(0.0, 25.0, {"y": 230.0}) is not None
    assert straight.at(0.0, -30.0, {"y": 230.0}) is None
    both = np.concatenate([turned, turned])
    tilted = LocalModelError(np.concatenate([turned, rest]), warm, left, white, {"y": both})
    found = tilted.at(0.0, -30.0, {"y": 230.0})
    assert found is not None
    assert found >= np.sqrt(3e-6)  # all that is left counts, whichever axis it is of
    assert "about y, no data set was measured near there" in str(tilted.unknown_at(0.0, -30.0, {"y": 500.0}))
