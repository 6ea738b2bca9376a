"""An accelerometer laid down in poses at several temperatures, made with NumPy only: no formula of the fit is used."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

RATE_HZ, REST_S, MOVING_S = 50.0, 2.0, 0.6
NOISE_G = 0.001


@dataclass(frozen=True)
class TrueUnit:
    """reading = bias + (1 + errors) force, bias and scale factors with powers of the temperature about `about_c`."""

    bias_g: np.ndarray  #: (3,) at `about_c`
    errors: np.ndarray  #: (3, 3), upper triangle
    bias_powers: np.ndarray  #: (3, 3) power and axis, g/K^k
    scale_powers: np.ndarray  #: (1, 3) 1/K
    about_c: float

    @staticmethod
    def drawn(rng: np.random.Generator, about_c: float = 25.0) -> TrueUnit:
        """Return a unit of the size that MEMS accelerometers have."""
        return TrueUnit(
            rng.normal(0, 0.03, 3), np.triu(rng.normal(0, 0.006, (3, 3))),
            np.stack([rng.normal(0, 5e-4, 3), rng.normal(0, 5e-6, 3), rng.normal(0, 1e-7, 3)]),
            rng.normal(0, 1e-4, (1, 3)), about_c,
        )  # fmt: skip

    def output_g(self, force_g: np.ndarray, temperature_c: np.ndarray) -> np.ndarray:
        """Return readings (n, 3) without noise of forces (n, 3)."""
        away = temperature_c - self.about_c
        bias = self.bias_g + sum(away[:, None] ** (k + 1) * row for k, row in enumerate(self.bias_powers))
        scale = sum(away[:, None] ** (k + 1) * row for k, row in enumerate(self.scale_powers))
        return np.asarray(bias + force_g @ (np.eye(3) + self.errors).T + scale * force_g)


def poses_at_temperatures(
    seed: int, unit: TrueUnit, temperatures_c: tuple[float, ...] = (-10.0, 10.0, 35.0, 60.0), poses: int = 14,
    noise_g: float = NOISE_G, pose_g: float = 0.0,
) -> np.ndarray:  # fmt: skip
    """Return time, s, readings, g, and temperature, deg C, (n, 5): rests, and shaking before each.

    `pose_g` is an error of each rest beyond its noise. The temperature moves by up to 1 K within a level.
    """
    rng = np.random.default_rng(seed)
    rest, moving = round(REST_S * RATE_HZ), round(MOVING_S * RATE_HZ)
    parts = []
    for level in temperatures_c:
        directions = rng.normal(size=(poses, 3))
        directions[:6] = np.vstack([np.eye(3), -np.eye(3)]) + rng.normal(0, 0.1, (6, 3))
        for place, direction in enumerate(directions / np.linalg.norm(directions, axis=1)[:, None]):
            force = np.vstack([direction + rng.normal(0, 0.4, (moving, 3)), np.tile(direction, (rest, 1))])
            warm = np.full(len(force), level + place / poses)
            output = unit.output_g(force, warm) + rng.normal(0, noise_g, force.shape) + rng.normal(0, pose_g, 3)
            parts.append(np.column_stack([output, warm]))
    whole = np.vstack(parts)
    return np.column_stack([np.arange(len(whole)) / RATE_HZ, whole])
