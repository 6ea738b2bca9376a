"""Tables of numbers as C initialisers."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def c_table(values: NDArray[np.float64]) -> str:
    """Return an array of any number of dimensions as a braced C initialiser, exact to the last digit."""
    if values.ndim == 1:
        return "{" + ", ".join(f"{value:.17g}" for value in values) + "}"
    return "{" + ",\n ".join(c_table(row) for row in values) + "}"
