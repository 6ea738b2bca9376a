"""The array type of the numerical code."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

#: Double-precision array; the shape and the unit stand in the docstring of each function that takes or returns one.
Array = NDArray[np.float64]
