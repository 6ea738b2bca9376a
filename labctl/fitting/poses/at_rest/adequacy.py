"""What nine parameters of an accelerometer are worth: held-out rests against the noise of their means."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.numeric.arrays import Array
from labctl.fitting.poses.at_rest.accelerometer import Accelerometer, size_jacobian
from labctl.fitting.poses.at_rest.rests import Rests

#: Error of held-out rests over what the noise of their means lets expect, from which on the model leaves more.
UNEXPLAINED = 1.5
Verdict = Literal["adequate", "unexplained"]


@dataclass(frozen=True)
class Adequacy:
    """Sizes of gravity in the used rests of an accelerometer, g."""

    before_g: float  #: root mean square by which the raw sizes differ from gravity
    heldout_g: float  #: the same of rests predicted from all others
    expected_g: float  #: what the noise of the means alone makes of `heldout_g`

    @property
    def verdict(self) -> Verdict:
        return "unexplained" if self.heldout_g > UNEXPLAINED * self.expected_g else "adequate"


def adequacy_of(accelerometer: Accelerometer, rests: Rests, covariance: NDArray[np.float64] | None = None) -> Adequacy:
    """Return what is left of each rest by a fit to the others.

    The fit without a rest is that to all with one unknown more, which absorbs its residual: none is made again.
    `covariance` are the rows (m, 9), of variance 1, of what was known of the parameters before.
    """
    accel_g, sigma = rests.accel_g[accelerometer.used], accelerometer.u_rest_g[accelerometer.used]
    forces = np.linalg.solve(np.eye(3) + accelerometer.errors, (accel_g - accelerometer.bias_g).T).T
    residual = np.linalg.norm(forces, axis=1) - accelerometer.gravity_g
    white = rests.accel_white_var.mean(axis=1)[accelerometer.used]
    jacobian = size_jacobian(accelerometer.errors, accelerometer.bias_g, accel_g) / sigma[:, None]
    before = np.linalg.norm(accel_g, axis=1) - accelerometer.gravity_g
    return left_out_adequacy(residual, jacobian, accelerometer.covariance, sigma, white, before, covariance)


def left_out_adequacy(
    residual: Array, jacobian: NDArray[np.float64], covariance: NDArray[np.float64], sigma: Array, white: Array,
    before: Array, known: NDArray[np.float64] | None = None,
) -> Adequacy:  # fmt: skip
    """Return the adequacy of a fit to k sizes, g: what is left, (k,), and its derivative over `sigma` (k, p).

    `white` (k,) is the variance of a mean by its noise, g^2, `before` (k,) what was left before the fit.
    """
    hat = jacobian @ covariance @ jacobian.T
    remaining_share = np.maximum(1 - np.diag(hat), 1e-6)
    # residual / sigma = (1 - hat) noise / sigma: the noise of every rest is in what the others predict of one
    spread = (np.eye(len(hat)) - hat) * (np.sqrt(white) / sigma)
    if known is not None:
        spread = np.hstack([spread, jacobian @ covariance @ known.T])
    expected = sigma * np.linalg.norm(spread, axis=1) / remaining_share
    return Adequacy(_rms(before), _rms(residual / remaining_share), _rms(expected))


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))
