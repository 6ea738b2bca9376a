"""Gains of options beside an eliminated base: chi2 that each removes, its coefficients, and what is visible of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.criticism.evidence.design import EliminatedBase
from labctl.fitting.numeric.arrays import Array

#: Directions of an option that the base leaves less of than this (squared share) are taken as the base's.
MIN_REMAINING = 1e-4


@dataclass(frozen=True)
class _Group:
    """Options of one width w, which are solved together."""

    options: NDArray[np.int64]  #: (o,) their numbers
    columns: NDArray[np.int64]  #: (o, w) their columns
    pairs: NDArray[np.int64]  #: (o, w, w) the place of each inner product among the pairs


@dataclass(frozen=True)
class OptionPairs:
    """Pairs of columns that belong to one option: its gain needs the inner products of these, and no others."""

    groups: tuple[_Group, ...]
    left: NDArray[np.int64]  #: (p,) column
    right: NDArray[np.int64]  #: (p,) column of the same option
    number: int  #: of options

    @cached_property
    def single(self) -> NDArray[np.int64]:
        """The place of each column's pair with itself, (k,)."""
        alone = np.flatnonzero(self.left == self.right)
        return alone[np.argsort(self.left[alone])]

    @staticmethod
    def of(slices: Sequence[slice]) -> OptionPairs:
        """Return the pairs of options whose columns are at these places."""
        widths = np.array([option_rows.stop - option_rows.start for option_rows in slices], dtype=np.int64)
        groups, left, right, count = [], [], [], 0
        for width in np.unique(widths).tolist():
            options = np.flatnonzero(widths == width)
            option_slices = [slices[i] for i in options.tolist()]
            columns = np.array([np.arange(option_rows.start, option_rows.stop) for option_rows in option_slices])
            i, j = np.triu_indices(width)
            among = np.zeros((width, width), dtype=np.int64)
            among[i, j] = among[j, i] = np.arange(len(i))
            first = count + len(i) * np.arange(len(options))
            groups.append(_Group(options, columns, first[:, None, None] + among))
            left.append(columns[:, i].ravel())
            right.append(columns[:, j].ravel())
            count += len(i) * len(options)
        none = np.zeros(0, dtype=np.int64)
        return OptionPairs(tuple(groups), np.concatenate([none, *left]), np.concatenate([none, *right]), len(slices))

    def block(self, products: Array, columns: slice) -> NDArray[np.float64]:
        """Return the inner products (w, w) of one option, whose columns stand at `columns`, of those of all pairs."""
        own = np.flatnonzero((self.left >= columns.start) & (self.left < columns.stop))
        gram = np.zeros((columns.stop - columns.start,) * 2)
        gram[self.left[own] - columns.start, self.right[own] - columns.start] = products[own]
        gram[self.right[own] - columns.start, self.left[own] - columns.start] = products[own]
        return gram

    def gains(self, products: Array, squared_norms: Array, data_products: Array) -> tuple[Array, NDArray[np.int64]]:
        """Return gain in chi2 and number of directions, (options,) each.

        `products` (p,) are the inner products of the pairs, base eliminated, `squared_norms` (k,) those of the columns
        before, `data_products` (k,) those with the data, base eliminated.
        """
        gain, dimensions = np.zeros(self.number), np.zeros(self.number, dtype=np.int64)
        size = np.sqrt(np.maximum(squared_norms, 1e-300))
        for group in self.groups:
            column_size = size[group.columns]
            scaled = products[group.pairs] / (column_size[:, :, None] * column_size[:, None, :])
            inner = data_products[group.columns] / column_size
            if scaled.shape[1] == 1:
                values = scaled[:, :, 0]
            else:
                values, vectors = np.linalg.eigh(scaled)
                inner = np.einsum("oij,oi->oj", vectors, inner)
            is_estimable = values > MIN_REMAINING
            gain[group.options] = np.where(is_estimable, inner**2 / np.where(is_estimable, values, 1.0), 0.0).sum(
                axis=1
            )
            dimensions[group.options] = is_estimable.sum(axis=1)
        return gain, dimensions


def gains_of(base: EliminatedBase, slices: Sequence[slice]) -> tuple[Array, NDArray[np.int64]]:
    """Return the chi2 that each option removes, (options,), and the number of its directions beside the base."""
    pairs = OptionPairs.of(slices)
    return pairs.gains(base.gram[pairs.left, pairs.right], base.squared_norms, base.data_products)


def solve_option(base: EliminatedBase, option_rows: slice) -> tuple[Array, NDArray[np.float64]]:
    """Return the coefficients (k,) of an option beside the base, and their covariance (k, k)."""
    size = np.sqrt(np.maximum(base.squared_norms[option_rows], 1e-300))
    values, vectors = np.linalg.eigh(base.gram[option_rows, option_rows] / np.outer(size, size))
    is_estimable = values > MIN_REMAINING
    inverse = (vectors[:, is_estimable] / values[is_estimable]) @ vectors[:, is_estimable].T
    coefficients = inverse @ (base.data_products[option_rows] / size) / size
    return coefficients, inverse / np.outer(size, size)


def visible_share(base: EliminatedBase, option_rows: slice) -> float:
    """Return the largest share of an option's columns that the base does not absorb, 0 to 1, in whitened size."""
    shares = np.diag(base.gram)[option_rows] / np.maximum(base.squared_norms[option_rows], 1e-300)
    return float(np.sqrt(np.clip(shares.max(initial=0.0), 0.0, 1.0)))


def reproduced_and_size(base: EliminatedBase, signal: slice, by: slice) -> tuple[float, float]:
    """Return the part of an option's fitted signal that another option reproduces, and the signal's size, in chi2."""
    values, _ = solve_option(base, signal)
    return reproduced(base, signal, values, by), float(values @ base.gram[signal, signal] @ values)


def reproduced(base: EliminatedBase, signal: slice, values: Array, by: slice) -> float:
    """Return the part of an option's signal with coefficients (k,) that another option reproduces, in chi2."""
    inner = base.gram[by, signal] @ values
    scale = np.sqrt(np.maximum(base.squared_norms[by], 1e-300))
    sizes, vectors = np.linalg.eigh(base.gram[by, by] / np.outer(scale, scale))
    is_estimable = sizes > MIN_REMAINING
    return float(((vectors[:, is_estimable].T @ (inner / scale)) ** 2 / sizes[is_estimable]).sum())
