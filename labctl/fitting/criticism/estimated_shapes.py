"""Estimates of every candidate beside a model, whatever its evidence, for the criticism of a type by its units.

A list of suspects says which effects stand out in one unit. An effect of the type may stand out in none, so each shape
of each effect counts here: each coefficient as it is estimated alone beside the model, in standard uncertainties.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.criticism.candidate_shape import CandidateShape
from labctl.fitting.criticism.criticism import Criticism
from labctl.fitting.criticism.evidence.bayes_factors import AxisEvidence
from labctl.fitting.criticism.evidence.gains import MIN_REMAINING
from labctl.fitting.effects import CATALOGUE
from labctl.fitting.numeric.arrays import Array


@dataclass(frozen=True)
class EstimatedShape:
    """One shape of one effect, the same for all units that were measured by one recipe."""

    effect: str  #: id of the effect
    shape: str  #: its order and parameters in words; "" for an effect of one shape
    names: tuple[str, ...]  #: of its coefficients
    units: tuple[str, ...]
    is_exact: bool  #: whether order and parameters determine the shape of the effect exactly

    @property
    def key(self) -> tuple[str, str, tuple[str, ...]]:
        """What makes it the same shape in another unit."""
        return self.effect, self.shape, self.names


@dataclass(frozen=True)
class CandidateEstimates:
    """The shapes of one output axis with K coefficients side by side."""

    shapes: tuple[EstimatedShape, ...]
    z: Array  #: (K,) each coefficient, estimated alone beside the model, over its standard uncertainty
    u: Array  #: (K,) that uncertainty, in the unit of the coefficient
    overlap: NDArray[np.float64]  #: (K, K) correlation of the regressors beside the model


def candidate_estimates(criticism: Criticism) -> Mapping[str, CandidateEstimates]:
    """Return the estimates by output axis; none where there was too little for a verdict.

    The noise is that beside all that was found missing; columns that the model absorbs are left out.
    """
    comparison = criticism.beside_missing
    if comparison is None:
        return {}
    return {
        axis: estimates for axis, design in comparison.designs.items()
        if (estimates := _of_axis(design.options, comparison.axes[axis])).shapes
    }  # fmt: skip


def _of_axis(options: list[CandidateShape], evidence: AxisEvidence) -> CandidateEstimates:
    base = evidence.best
    remaining = np.diag(base.gram)
    is_visible = remaining > MIN_REMAINING * np.maximum(base.squared_norms, 1e-300)
    shapes, places = [], []
    keys: set[tuple[str, str, tuple[str, ...]]] = set()
    for option, rows in zip(options, evidence.slices, strict=True):
        own = np.arange(rows.start, rows.stop)[is_visible[rows]]
        if option.term is None or not len(own):
            continue
        names, units = np.array(option.names)[own - rows.start], np.array(option.units)[own - rows.start]
        kind = CATALOGUE.get(option.candidate)
        shape = EstimatedShape(
            option.candidate, _in_words(option), tuple(names.tolist()), tuple(units.tolist()),
            kind is not None and kind.exact,
        )  # fmt: skip
        if shape.key not in keys:  # two shapes that four digits of their parameters do not distinguish are one
            keys.add(shape.key)
            shapes.append(shape)
            places.append(own)
    at = np.concatenate([np.zeros(0, dtype=np.int64), *places])
    size = np.sqrt(remaining[at])
    return CandidateEstimates(
        tuple(shapes), base.data_products[at] / size, 1.0 / size, base.gram[np.ix_(at, at)] / np.outer(size, size)
    )


def _in_words(option: CandidateShape) -> str:
    assert option.term is not None
    order = [] if option.term.order is None else [f"order {option.term.order}"]
    return ", ".join([*order, *(f"{name} {value:.4g}" for name, value in sorted(option.term.parameters.items()))])
