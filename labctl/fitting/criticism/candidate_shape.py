"""One shape of one candidate on one axis."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.effects import Term, kind_of


@dataclass(frozen=True)
class CandidateShape:
    """One shape of one candidate on one axis: its coordinates and the names and units of its k coefficients."""

    candidate: str  #: effect id, or a channel's name with `smooth`
    term: Term | None
    rows: NDArray[np.float64]  #: (R, m, k)
    names: tuple[str, ...]
    units: tuple[str, ...]
    beside_base: bool = False  #: whether only the part that the base leaves of it counts, however small

    @property
    def smooth(self) -> bool:
        """Whether this is a smooth function of a channel."""
        return self.term is None

    @property
    def is_drawn(self) -> bool:
        """Whether each coefficient is a draw, for a powered run or a mounting of its own."""
        return self.term is not None and kind_of(self.term).is_random


def slices_of(options: Sequence[CandidateShape]) -> list[slice]:
    """Return the place of each option's columns when all options stand side by side."""
    ends = np.cumsum([0, *(option.rows.shape[2] for option in options)])
    return [slice(int(begin), int(end)) for begin, end in pairwise(ends)]
