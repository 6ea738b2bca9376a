"""The hidden law in the data sets of a recording, with which what is proposed or fitted is compared."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.data.fit_data import FitData
from labctl.fitting.estimation.result import FitResult
from labctl.fitting.models.error_model import ErrorModel, expand

Array = NDArray[np.float64]
#: The channels that a law may depend on: outside their ranges it is not compared with the truth.
LIMITING = (
    "table_rate_dps", "temperature_c", "chamber_c", "supply_v", "humidity_pct", "power_s", "t_s",
)  # fmt: skip


def without_absorbed(model: ErrorModel, data: FitData, axis: str) -> Callable[[Array], Array]:
    """Return what takes the part that a model absorbs from values (m,) of an axis."""
    columns = np.column_stack([column.values for _, column in model.columns(data.channels, axis)])
    whole = expand(columns, model.temperature.basis(data.channels.temperature_c(axis)))
    whole = whole / np.maximum(np.linalg.norm(whole, axis=0), 1e-300)
    u, s, _ = np.linalg.svd(whole, full_matrices=False)
    u = u[:, s > 1e-9 * s[0]]
    return lambda values: np.asarray(values - u @ (u.T @ values))


def _rms(parts: Iterable[Array]) -> float:
    return float(np.sqrt(np.mean(np.concatenate(list(parts)) ** 2)))


@dataclass(frozen=True)
class Witness:
    """The data sets of one recording with the hidden law in each, with which proposals are compared."""

    data: FitData
    hidden_dps: Mapping[str, Array]

    @staticmethod
    def of(added: FitData, plain: FitData, rows: NDArray[np.bool_] | None = None) -> Witness:
        """Return some rows of a recording with a law and of the same one without it."""
        hidden = {axis: added.outputs[axis] - plain.outputs[axis] for axis in added.outputs}
        kept = np.ones(len(added), dtype=np.bool_) if rows is None else rows
        return Witness(added.take(kept), {axis: values[kept] for axis, values in hidden.items()})

    def error(self, base: ErrorModel, fit: FitResult) -> float:
        """Return the error of what a fit models over the hidden law, both without what the base absorbs."""
        wrong, whole = [], []
        for axis, hidden in self.hidden_dps.items():
            left = without_absorbed(base, self.data, axis)
            wrong.append(left(fit.fitted.error_dps(self.data.channels, axis) - hidden))
            whole.append(left(hidden))
        return _rms(wrong) / max(_rms(whole), 1e-300)

    def known_form(self, base: ErrorModel) -> float:
        """Return the error where the form of the hidden law is known, and its size is fitted to each axis."""
        wrong, whole = [], []
        for axis, hidden in self.hidden_dps.items():
            left = without_absorbed(base, self.data, axis)
            column, seen = left(hidden), left(self.data.outputs[axis] - self.data.true_rate_dps(axis))
            wrong.append(column * (1.0 - float(column @ seen) / max(float(column @ column), 1e-300)))
            whole.append(column)
        return _rms(wrong) / max(_rms(whole), 1e-300)

    def left_dps(self, fit: FitResult) -> float:
        """Return the root mean square of what a fit leaves, deg/s."""
        channels = self.data.channels
        return _rms(
            self.data.outputs[axis] - self.data.true_rate_dps(axis) - fit.fitted.error_dps(channels, axis)
            for axis in self.data.outputs
        )


def inside(first: FitData, other: FitData) -> NDArray[np.bool_]:
    """Return the data sets of another recording at which no channel is outside the range of the first, (m,)."""
    rows = np.ones(len(other), dtype=np.bool_)
    for name in LIMITING:
        if name in first.channels and name in other.channels:
            known, values = (np.asarray(data.channels[name], dtype=np.float64) for data in (first, other))
            rows &= (values >= known.min()) & (values <= known.max())
    return rows
