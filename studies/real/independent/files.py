"""The published files, column by column, and what an analysis finds in them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pyarrow.parquet as pq
from numpy.typing import NDArray

Array = NDArray[np.float64]
PUBLISHED = Path(__file__).resolve().parents[3] / "examples" / "published"
AXES = "xyz"
GRAVITY_M_S2 = 9.80665


class Value(NamedTuple):
    """A quantity and its standard uncertainty, in the same unit; nan where an analysis states none."""

    value: float
    u: float = float("nan")


#: What an analysis finds: name of a quantity, with its unit -> value.
Found = dict[str, Value]


def columns_of(name: str) -> dict[str, NDArray[np.generic]]:
    """Return the columns of a published file by their names there."""
    path = PUBLISHED / name
    if path.suffix == ".parquet":
        table = pq.read_table(path)
        return {column: table[column].to_numpy(zero_copy_only=False) for column in table.column_names}
    header, *rows = path.read_text(encoding="utf-8").splitlines()
    values = np.array([row.split(",") for row in rows], dtype=np.float64)
    return dict(zip(header.split(","), values.T, strict=True))


def numbers(columns: Mapping[str, NDArray[np.generic]], *names: str) -> Array:
    """Return columns side by side, (n, names)."""
    return np.column_stack([np.asarray(columns[name], dtype=np.float64) for name in names])


def root_mean_square(values: Array) -> float:
    """Return the root of the mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def clustered(design: Array, y: Array, cluster: NDArray[np.int64]) -> tuple[Array, Array]:
    """Return least-squares coefficients and their covariance where rows of one cluster err together.

    The sandwich of Liang and Zeger (1986): (X'X)^-1 (sum over clusters of X'r r'X) (X'X)^-1 C / (C - 1).
    """
    inverse = np.linalg.inv(design.T @ design)
    values = inverse @ (design.T @ y)
    left = y - design @ values
    _, number = np.unique(cluster, return_inverse=True)
    scores = np.zeros((int(number.max()) + 1, design.shape[1]))
    np.add.at(scores, number, design * left[:, None])
    count = len(scores)
    return values, count / (count - 1) * inverse @ (scores.T @ scores) @ inverse
