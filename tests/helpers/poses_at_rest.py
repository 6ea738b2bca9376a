"""Readings of an accelerometer that is laid down in poses and turned between them, made with NumPy only."""

from __future__ import annotations

from pathlib import Path

import numpy as np

BIAS_G = np.array([0.03, -0.05, 0.02])
#: reading = BIAS_G + (1 + ERRORS) force.
ERRORS = np.array([[0.01, 0.004, -0.006], [0.0, -0.008, 0.003], [0.0, 0.0, 0.005]])
RATE_HZ = 50.0


def poses(n: int, seed: int) -> np.ndarray:
    """Return n directions of gravity in the body, (n, 3)."""
    vectors = np.random.default_rng(seed).normal(size=(n, 3))
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1)[:, None])


def readings_in(directions: np.ndarray, seed: int, noise_g: float = 0.001, rest_s: float = 3.0) -> np.ndarray:
    """Return time, s, and readings, g, (n, 4): rests in directions (k, 3), and a second of shaking before each."""
    rng = np.random.default_rng(seed)
    n, moving = round(rest_s * RATE_HZ), round(RATE_HZ)
    parts = []
    for direction in directions:
        parts += [direction + rng.normal(0.0, 0.4, (moving, 3)), np.tile(direction, (n, 1))]
    force = np.vstack(parts)
    output = force @ (np.eye(3) + ERRORS).T + BIAS_G + rng.normal(0.0, noise_g, force.shape)
    return np.column_stack([np.arange(len(force)) / RATE_HZ, output])


def write_readings(path: Path, readings: np.ndarray) -> str:
    np.savetxt(path, readings, delimiter=",", header="t_s,accel_x_g,accel_y_g,accel_z_g", comments="", fmt="%.7f")
    return str(path)
