"""What is drawn does not depend on rounding: equal variances leave the eigenvectors open, and rounding rotates them."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from labctl.fitting.criticism.evidence.drawn_shifts import DrawnShifts
from labctl.fitting.criticism.joint_evidence import Known

Matrix = NDArray[np.float64]
W = 6
#: What is known of a coefficient of variance 1, 1/(deg/s)^2.
KNOWN = 1e8
#: A symmetric change of each element in its 16th digit.
ROUNDING = np.triu(np.random.default_rng(1).choice([-1e-16, 0.0, 1e-16], (W, W)))
ROUNDED = 1.0 + ROUNDING + np.triu(ROUNDING, 1).T


def gram_of(kind: str) -> Matrix:
    """Return a Gram matrix (w, w) with equal eigenvalues."""
    alike = np.eye(W) - np.full((W, W), 1.0 / (W + 1))  # of runs of equal lengths less the first, beside a constant
    if kind == "some":
        alike[W - 2 :], alike[:, W - 2 :] = 0.0, 0.0  # those still to come are not seen
    return np.asarray(KNOWN * alike)


def of_draws(gram: Matrix) -> Matrix:
    products = gram @ np.linspace(-2e-3, 3e-3, W)
    return DrawnShifts.of(gram, 600.0).draw(products, 50, np.random.default_rng(2))


def of_coefficients(gram: Matrix) -> Matrix:
    """Draw coefficients that are all known alike."""
    values, vectors = np.linalg.eigh(gram / KNOWN + 1.0 / (W + 1))
    factor = vectors / np.sqrt(KNOWN * values)
    return Known(factor, 600.0, None).draw(np.linspace(-2e5, 3e5, W), 50, np.random.default_rng(2))


@pytest.mark.parametrize("kind", ["all", "some"])
def test_shifts_that_are_known_alike_are_drawn_the_same_in_spite_of_rounding(kind: str) -> None:
    gram = gram_of(kind)
    first, second = of_draws(gram), of_draws(gram * ROUNDED)
    assert np.abs(second - first).max() < 1e-9 * np.abs(first).max()


def test_coefficients_that_are_known_alike_are_drawn_the_same_in_spite_of_rounding() -> None:
    gram = gram_of("all")
    first, second = of_coefficients(gram), of_coefficients(gram * ROUNDED)
    assert np.abs(second - first).max() < 1e-9 * np.abs(first).max()
