"""The integration of a rate: against a motion in closed form, and its derivatives against differences."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from labctl.fitting.poses.rotation import integrate, integration_u

#: A coning motion: half angle, rad, and angular frequency, rad/s.
CONE, OMEGA = 0.3, 5.0


def coning(t_s: np.ndarray) -> tuple[np.ndarray, Rotation]:
    """Return the rate in the body and the orientation of a motion whose axis goes round a cone (Savage 1998)."""
    quaternion = np.column_stack([
        np.sin(CONE / 2) * np.cos(OMEGA * t_s), np.sin(CONE / 2) * np.sin(OMEGA * t_s),
        np.zeros_like(t_s), np.full_like(t_s, np.cos(CONE / 2)),
    ])  # fmt: skip
    rate = np.column_stack([
        -np.sin(CONE) * np.sin(OMEGA * t_s), np.sin(CONE) * np.cos(OMEGA * t_s),
        np.full_like(t_s, -2 * np.sin(CONE / 2) ** 2),
    ])  # fmt: skip
    return OMEGA * rate, Rotation.from_quat(quaternion)


def angle(matrix: np.ndarray, truth: Rotation) -> float:
    return float((Rotation.from_matrix(matrix).inv() * truth).magnitude())


def test_a_coning_motion_ends_where_its_closed_form_does_and_the_stated_uncertainty_holds() -> None:
    for n, limit in ((101, 2e-3), (401, 1e-4)):
        t_s = np.linspace(0, 2, n)
        rate, attitude = coning(t_s)
        truth = attitude[0].inv() * attitude[-1]
        found = integrate(rate[None], np.diff(t_s)[None], np.zeros((1, n)), np.zeros((3, 3)))
        u = integration_u(rate[None], np.diff(t_s)[None], np.zeros((3, 3)), found.matrix)
        assert angle(found.matrix[0], truth) < min(limit, 2 * u[0])


def test_short_moves_are_filled_up_without_a_change() -> None:
    t_s = np.linspace(0, 1, 51)
    rate, _ = coning(t_s)
    alone = integrate(rate[None], np.diff(t_s)[None], np.zeros((1, 51)), np.zeros((3, 3)))
    longer = np.concatenate([rate, np.repeat(rate[-1:], 20, axis=0)])
    step = np.concatenate([np.diff(t_s), np.zeros(20)])
    filled = integrate(longer[None], step[None], np.zeros((1, 71)), np.zeros((3, 3)))
    assert filled.matrix == pytest.approx(alone.matrix, abs=1e-12)
    alone_u = integration_u(rate[None], np.diff(t_s)[None], np.zeros((3, 3)), alone.matrix)
    filled_u = integration_u(longer[None], step[None], np.zeros((3, 3)), filled.matrix)
    assert filled_u == pytest.approx(alone_u, rel=1e-6)


def test_derivatives_are_those_of_differences() -> None:
    t_s = np.linspace(0, 1.5, 301)
    rate, _ = coning(t_s)
    share = np.linspace(0.2, 0.8, 301)[None]
    errors = np.array([[0.01, -0.02, 0.005], [0.0, -0.01, 0.02], [0.015, 0.0, 0.01]])
    found = integrate(rate[None], np.diff(t_s)[None], share, errors)

    def turned(other: np.ndarray) -> np.ndarray:
        return np.asarray((Rotation.from_matrix(other) * Rotation.from_matrix(found.matrix[0]).inv()).as_rotvec())

    for place in range(9):
        changed = errors.copy()
        changed.flat[place] += 1e-6
        other = integrate(rate[None], np.diff(t_s)[None], share, changed).matrix[0]
        assert turned(other) / 1e-6 == pytest.approx(found.by_error[0, :, place], abs=2e-3)
    for axis in range(3):
        bias = np.zeros(3)
        bias[axis] = 1e-6
        late = integrate((rate - share[0][:, None] * bias)[None], np.diff(t_s)[None], share, errors).matrix[0]
        assert turned(late) / 1e-6 == pytest.approx(found.by_bias_after[0, :, axis], abs=2e-3)
