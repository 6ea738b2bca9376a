"""Readings of a magnetometer that is turned through all directions of a constant field."""

from __future__ import annotations

import numpy as np

FIELD_UT = 48.0
#: What corrects a reading: field = SOFT_IRON (reading - HARD_IRON_UT).
SOFT_IRON = np.array([[1.08, 0.03, -0.02], [0.03, 0.94, 0.015], [-0.02, 0.015, 1.01]])
HARD_IRON_UT = np.array([12.0, -33.0, 7.0])


def _turn(axis: int, angle: np.ndarray) -> np.ndarray:
    found = np.zeros((len(angle), 3, 3))
    i, j = (axis + 1) % 3, (axis + 2) % 3
    found[:, axis, axis] = 1.0
    found[:, i, i] = found[:, j, j] = np.cos(angle)
    found[:, i, j], found[:, j, i] = -np.sin(angle), np.sin(angle)
    return found


def fields(n: int, field_ut: float = FIELD_UT) -> np.ndarray:
    """Return the field in the axes of a unit that turns about all three, (n, 3) uT."""
    t_s = np.linspace(0.0, 60.0, n)
    turned = _turn(0, 2 * np.pi * t_s / 7.3) @ _turn(1, 2 * np.pi * t_s / 31 + 0.5) @ _turn(2, 2 * np.pi * t_s / 11.7)
    down = field_ut * np.array([0.4, 0.0, -np.sqrt(1 - 0.4**2)])
    return np.asarray(turned @ down)


def readings_of(field: np.ndarray, seed: int, noise_ut: float = 0.4, memory: float = 0.0) -> np.ndarray:
    """Return readings (n, 3) uT with noise, of which a share `memory` stays from one reading to the next."""
    noise = np.random.default_rng(seed).normal(0.0, noise_ut, field.shape)
    for k in range(1, len(noise) if memory else 0):
        noise[k] = memory * noise[k - 1] + np.sqrt(1 - memory**2) * noise[k]
    return np.asarray(field @ np.linalg.inv(SOFT_IRON).T + HARD_IRON_UT + noise)
