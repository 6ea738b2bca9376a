"""What was published of the same recordings, brought to output = bias + (1 + E) rate in the axes of this study."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from studies.real.independent.files import Array

#: imucal, commit 8716e4c, tests/snapshots/example_cal.json: K_g @ R_g, words per deg/s, by turns of -360 deg.
IMUCAL_WORDS = np.diag([16.67769558952488, 16.187895200550262, 16.253362639451936]) @ np.array([
    [-0.9999143756542296, -0.0006142300632876558, 0.013071498821540703],
    [0.0055057030733027396, -0.9992594967426224, -0.03808077472097593],
    [-0.01314650914177706, 0.0365074524847183, -0.9992469040284595],
])  # fmt: skip
IMUCAL_E = -IMUCAL_WORDS / 16.4 - np.eye(3)  #: the sense of the turns is taken the other way round


@dataclass(frozen=True)
class PublishedPoses:
    """E in 1e-3 (3, 3), rows outputs, columns axes of turning, and the bias (3,) deg/s; without uncertainties."""

    matrix: Array
    bias: Array
    source: str


_IMU_TK = "imu_tk, as its program prints it (Tedaldi et al. 2014)"
_MIKOV = "Mikov, Reginya and Moschevikin, ICINS 2020"
#: As docs/explanation/poses.md has them.
POSES: Mapping[str, PublishedPoses] = {
    "xsens": PublishedPoses(
        np.array([[0.70, -5.94, -1.43], [-9.42, -2.07, 53.46], [-25.33, 2.70, -0.11]]),
        np.array([0.109, -3.698, -3.074]), _IMU_TK,
    ),
    "mpu9150-0": PublishedPoses(
        np.array([[0.41, -0.80, 7.66], [-1.29, 4.57, -1.14], [6.36, 0.51, 8.35]]),
        np.array([1.137, -0.403, 1.268]), _MIKOV,
    ),
    "mpu9150-1": PublishedPoses(
        np.array([[0.07, 2.46, 4.81], [1.20, 2.60, -1.30], [-0.23, -9.89, -1.68]]),
        np.array([-0.574, 1.091, 0.275]), _MIKOV,
    ),
    "mpu9150-2": PublishedPoses(
        np.array([[-0.58, 0.13, 6.86], [-1.38, 2.77, 0.11], [8.41, 2.47, 2.56]]),
        np.array([0.562, -0.348, 1.265]), _MIKOV,
    ),
}  # fmt: skip
#: The warm-up's author: square, linear and constant term in words of the output over the word of the thermometer.
FREEIMU_WORDS = {
    "x": (-4.387634e-08, -5.878346e-04, 6.699801),
    "y": (-1.779335e-08, 1.172002e-03, 8.341212),
    "z": (4.216745e-09, -6.897733e-05, -21.71155),
}
