"""Design of one axis before any data, and what remains of it once the base is eliminated."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.criticism.candidate_shape import CandidateShape
from labctl.fitting.criticism.evidence.noise_grid import Noise
from labctl.fitting.numeric.arrays import Array


@dataclass(frozen=True)
class Design:
    """Columns of one axis over m data sets in R coordinates: the base (kb columns) and the options beside it."""

    base: NDArray[np.float64]  #: (R, m, kb)
    precision: Array  #: (kb,) prior precision of each coefficient of the base, 0: none
    options: list[CandidateShape]
    present: NDArray[np.bool_]  #: (R, m): which coordinates exist in which data set
    t_s: Array  #: (m,)
    run: NDArray[np.int64]  #: (m,)


@dataclass(frozen=True)
class Discrepancy:
    """What the shape of an effect may be wrong by on one axis, as columns of a base."""

    rows: NDArray[np.float64]  #: (R, m, k)
    precision: Array  #: (k,) prior precision of each coefficient


@dataclass(frozen=True)
class EliminatedBase:
    """Inner products of all K option columns and the data at one noise, with what the base explains removed."""

    noise: Noise
    log_p: float  #: restricted log likelihood of the base, with the noise's prior
    gram: NDArray[np.float64]  #: (K, K), base eliminated
    squared_norms: Array  #: (K,) of the columns before the elimination
    data_products: Array  #: (K,) with the data, base eliminated
    chi2: float  #: of the data, base eliminated
