"""Alignment of a magnetometer by rests and turns: against known turns, and beside a linear solution by NumPy alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from labctl.errors import NotEnoughData
from labctl.fitting.magnetometer.alignment import FieldAlignment, align_field
from labctl.fitting.magnetometer.calibrate import Magnetometer, calibrate_magnetometer
from labctl.fitting.numeric.degrees_of_freedom import student_factor
from labctl.fitting.poses.at_rest.rests import rest_of_each
from labctl.fitting.poses.fit import Solved, solve
from labctl.fitting.poses.readings import PoseReadings, readings_of
from studies.triads import recording_of, scores
from studies.triads_simulation import DIP_DEG, TrueTriads, turned_by_hand, vector_of

Session = tuple[PoseReadings, Solved, np.ndarray, Magnetometer, TrueTriads]


@pytest.fixture(scope="module")
def session() -> Session:
    unit = TrueTriads.drawn(np.random.default_rng(3))
    parts = turned_by_hand(3, unit, 16, place_ut=0.1)
    readings = readings_of(recording_of(*parts))
    return readings, solve(readings), parts[3], calibrate_magnetometer("m", parts[3][::10]), unit


def aligned(session: Session) -> FieldAlignment:
    return align_field(*session[:4])


@pytest.mark.slow
def test_the_uncertainty_covers_known_turns() -> None:
    found = [scores(seed, 14) for seed in range(40, 46)]
    for kind in ("magnetometer", "bias", "scale factor", "misalignment", "hard iron", "soft iron"):
        ratio = np.array([each[kind] for each in found])
        assert np.mean(np.abs(ratio) <= 1) > 0.8, kind
        assert 0.2 < np.sqrt(np.mean(ratio**2)) < 0.75, kind


def test_the_degrees_of_freedom_are_those_of_the_rests_and_not_of_the_readings(session: Session) -> None:
    readings, solved, field, magnetometer, _ = session
    rest = rest_of_each(solved.rests, len(readings), readings.spacing_s)
    known = calibrate_magnetometer("m", field[::10], rest=rest[::10])
    assert magnetometer.u_freedom.min() > 100  # as if the errors of readings of one rest were independent
    assert 5 < known.u_freedom.min() < 40
    assert np.all(known.expanded[:3] > magnetometer.expanded[:3])
    found = align_field(readings, solved, field, known)
    assert len(solved.rests) / 2 < found.u_freedom.min() < found.u_freedom.max() < 3 * len(solved.rests)
    assert found.expanded_rad == pytest.approx(
        [student_factor(n) * u for n, u in zip(found.u_freedom, found.u_rad, strict=True)]
    )


def test_it_is_the_turn_of_the_corrected_fields_axes_and_the_dip(session: Session) -> None:
    found, unit = aligned(session), session[4]
    assert found.u_rad.max() < 2e-3
    assert found.angles_rad == pytest.approx(vector_of(unit.turned), abs=float(4 * found.u_rad.max()))
    assert np.degrees(found.dip_rad) == pytest.approx(DIP_DEG, abs=float(np.degrees(4 * found.u_rad[3])))
    assert found.place_rad * 49 == pytest.approx(0.1, rel=0.6)


def test_the_rests_alone_say_the_same_by_a_linear_solution(session: Session) -> None:
    _, solved, field, magnetometer, _ = session
    seen = np.array([
        magnetometer.soft_iron @ (field[a:b].mean(axis=0) - magnetometer.hard_iron_ut)
        for a, b in zip(solved.rests.begin, solved.rests.end, strict=True)
    ])  # fmt: skip
    products = np.einsum("ka,kb->kab", solved.accelerometer.up, seen).reshape(-1, 9)
    _, _, right = np.linalg.svd(np.column_stack([products, -np.ones(len(products))]))
    matrix = right[-1, :9].reshape(3, 3)
    left, _, last = np.linalg.svd(matrix * np.sign(np.linalg.det(matrix)))
    assert vector_of(left @ last) == pytest.approx(aligned(session).angles_rad, abs=np.radians(1.0))


def test_a_field_that_changes_from_rest_to_rest_is_refused_with_what_to_do(session: Session) -> None:
    readings, solved, field, magnetometer, _ = session
    rng = np.random.default_rng(1)
    moved = field.copy()
    for a, b in zip(solved.rests.begin, solved.rests.end, strict=True):
        moved[a:b] += rng.normal(0, 8.0, 3)
    with pytest.raises(
        NotEnoughData, match=r"uncertain by u = .* record rests in more poses in the same place, away from iron"
    ):
        align_field(replace(readings), solved, moved, magnetometer)


@pytest.mark.slow
def test_a_rest_whose_error_makes_the_field_steeper_has_no_more_weight() -> None:
    """The dip is that of the plain mean over the rests, within half its u; it was 3 u larger."""
    unit = TrueTriads.drawn(np.random.default_rng(10**6 + 80004))
    parts = turned_by_hand(80004, unit, 60, place_ut=0.6)
    readings = readings_of(recording_of(*parts))
    solved, field = solve(readings), parts[3]
    rest = rest_of_each(solved.rests, len(readings), readings.spacing_s)
    magnetometer = calibrate_magnetometer("m", field[::10], rest=rest[::10])
    found = align_field(readings, solved, field, magnetometer)
    means = np.array([field[a:b].mean(axis=0) for a, b in zip(solved.rests.begin, solved.rests.end, strict=True)])
    seen = (means - magnetometer.hard_iron_ut) @ magnetometer.soft_iron
    body = seen / np.linalg.norm(seen, axis=1)[:, None] @ Rotation.from_rotvec(found.angles_rad).as_matrix().T
    of_mean = -np.arcsin(np.mean(np.sum(solved.accelerometer.up * body, axis=1)))
    assert found.dip_rad == pytest.approx(of_mean, abs=float(found.u_rad[3]) / 2)
