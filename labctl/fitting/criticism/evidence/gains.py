"""Gains of options beside an eliminated base: chi2 that each removes, its coefficients, and what is visible of it."""

from __future__ import annotations

from collections.abc import Callable
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.criticism.evidence.design import EliminatedBase
from labctl.fitting.numeric.arrays import Array

#: Directions of an option that the base leaves less of than this (squared share) are taken as the base's.
LEAST_LEFT = 1e-4


def gains_of(left: EliminatedBase, slices: list[slice]) -> tuple[Array, NDArray[np.int64]]:
    """Return the chi2 that each option removes, (options,), and the number of its directions beside the base."""
    return option_gains(
        slices, lambda index: left.gram[index[:, :, None], index[:, None, :]], left.squared_norms, left.data_products
    )


def option_gains(
    slices: list[slice],
    within: Callable[[NDArray[np.int64]], NDArray[np.float64]],
    squared_norms: Array,
    data_products: Array,
) -> tuple[Array, NDArray[np.int64]]:
    """Return gain in chi2 and number of directions, (options,) each; options of one width are solved together.

    `within` returns the inner products inside each option, base eliminated, (o, w, w) for column indices (o, w).
    """
    gain, dimensions = np.zeros(len(slices)), np.zeros(len(slices), dtype=np.int64)
    size = np.sqrt(np.maximum(squared_norms, 1e-300))
    order = sorted(range(len(slices)), key=lambda i: slices[i].stop - slices[i].start)
    for _, members in groupby(order, key=lambda i: slices[i].stop - slices[i].start):
        which = list(members)
        index = np.array([np.arange(slices[i].start, slices[i].stop) for i in which])
        values, vectors = np.linalg.eigh(within(index) / (size[index][:, :, None] * size[index][:, None, :]))
        inner = np.einsum("oij,oi->oj", vectors, (data_products / size)[index])
        kept = values > LEAST_LEFT
        gain[which] = np.where(kept, inner**2 / np.where(kept, values, 1.0), 0.0).sum(axis=1)
        dimensions[which] = kept.sum(axis=1)
    return gain, dimensions


def solve_option(left: EliminatedBase, where: slice) -> tuple[Array, NDArray[np.float64]]:
    """Return the coefficients (k,) of an option beside the base, and their covariance (k, k)."""
    size = np.sqrt(np.maximum(left.squared_norms[where], 1e-300))
    values, vectors = np.linalg.eigh(left.gram[where, where] / np.outer(size, size))
    kept = values > LEAST_LEFT
    inverse = (vectors[:, kept] / values[kept]) @ vectors[:, kept].T
    coefficients = inverse @ (left.data_products[where] / size) / size
    return coefficients, inverse / np.outer(size, size)


def visible_share(left: EliminatedBase, where: slice) -> float:
    """Return the largest share of an option's columns that the base does not absorb, 0 to 1, in whitened size."""
    shares = np.diag(left.gram)[where] / np.maximum(left.squared_norms[where], 1e-300)
    return float(np.sqrt(np.clip(shares.max(initial=0.0), 0.0, 1.0)))


def reproduced_and_size(left: EliminatedBase, signal: slice, by: slice) -> tuple[float, float]:
    """Return the part of an option's fitted signal that another option reproduces, and the signal's size, in chi2."""
    values, _ = solve_option(left, signal)
    return reproduced(left, signal, values, by), float(values @ left.gram[signal, signal] @ values)


def reproduced(left: EliminatedBase, signal: slice, values: Array, by: slice) -> float:
    """Return the part of an option's signal with coefficients (k,) that another option reproduces, in chi2."""
    inner = left.gram[by, signal] @ values
    scale = np.sqrt(np.maximum(left.squared_norms[by], 1e-300))
    sizes, vectors = np.linalg.eigh(left.gram[by, by] / np.outer(scale, scale))
    kept = sizes > LEAST_LEFT
    return float(((vectors[:, kept].T @ (inner / scale)) ** 2 / sizes[kept]).sum())
