"""What common tools name on the same campaigns: each is given exactly the columns that labctl compares.

Every tool sees the base's columns, which it always keeps, and every column of every effect in every shape. "means" are
the data-set means alone, unweighted, as in the papers; "rows" are all coordinates over their white standard deviation.
The base is taken off data and columns beforehand (Frisch-Waugh: the same least-squares fit, and no penalty on the
base), and what is left of each column is brought to unit size, so that no tool suffers from units.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.criticism.evidence.design import Design
from labctl.fitting.criticism.evidence.gains import MIN_REMAINING
from labctl.fitting.criticism.reduction import ReducedRecording
from labctl.fitting.data.temperature.levels import folds
from labctl.fitting.numeric.arrays import Array

#: What the extra `study` brings.
DISTRIBUTIONS = ("statsmodels", "scikit-learn", "pysindy")
#: Forward selection ends here at the latest.
MAX_TERMS = 30
LASSO_FOLDS = 5
#: The default path of LassoCV takes some five times as long on collinear columns, and is right no more often.
LASSO_PATH = {"eps": 1e-2, "alphas": 30, "max_iter": 300}
#: Base columns that add less than this to those before are left out.
INDEPENDENT = 1e-7

#: (effect, how much its column takes off the residual, over the residual variance at the end)
Picks = list[tuple[str, float]]


@dataclass(frozen=True)
class Table:
    """One axis as a regression: n rows, K columns, the base taken off both columns and target."""

    columns: NDArray[np.float64]  #: (n, K) of unit size
    target: Array  #: (n,)
    effects: NDArray[np.str_]  #: (K,)
    level: NDArray[np.int64]  #: (n,) temperature level


def missing() -> list[str]:
    """Return the tools that are not installed."""
    return [name for name in DISTRIBUTIONS if _version(name) is None]


def versions() -> dict[str, str]:
    """Return the version of each tool."""
    return {name: found for name in DISTRIBUTIONS if (found := _version(name)) is not None}


def _version(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None


def table_of(data: ReducedRecording, design: Design, axis: str, *, means: bool) -> Table:
    """Return one axis of a campaign as a regression."""
    y = data.output[axis] - data.rows_of(data.nodes.rate_dps(axis)[:, None])[:, :, 0]
    effects = [option for option in design.options if not option.smooth]
    there = design.present.copy()
    there[1:] &= not means  # the first coordinate is the mean
    weight = np.ones(len(data)) if means or data.white_var is None else 1.0 / np.sqrt(data.white_var[axis])
    weights = np.broadcast_to(weight, there.shape)[there]
    base = _orthonormal(design.base[there] * weights[:, None])
    columns = np.concatenate([option.rows[there] for option in effects], axis=1) * weights[:, None]
    left = columns - base @ (base.T @ columns)
    left -= base @ (base.T @ left)
    before, after = np.linalg.norm(columns, axis=0), np.linalg.norm(left, axis=0)
    kept = after**2 > MIN_REMAINING * np.maximum(before**2, 1e-300)
    names = np.repeat([option.candidate for option in effects], [option.rows.shape[2] for option in effects])
    target = y[there] * weights
    return Table(left[:, kept] / after[kept], target - base @ (base.T @ target), names[kept], _levels(data, there))


def _orthonormal(columns: NDArray[np.float64]) -> NDArray[np.float64]:
    u, s, _ = np.linalg.svd(columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-300), full_matrices=False)
    return np.asarray(u[:, s > INDEPENDENT * s[0]])


def _levels(data: ReducedRecording, there: NDArray[np.bool_]) -> NDArray[np.int64]:
    masks = folds(data.at_sets(np.asarray(data.nodes["temperature_c"], dtype=np.float64)))
    return np.asarray(np.broadcast_to(np.argmax(masks, axis=0), there.shape)[there], dtype=np.int64)


def entries(table: Table) -> Iterator[tuple[int, float]]:
    """Yield the columns of forward selection in order, each with the sum of squares that it takes off."""
    left, residual = table.columns.copy(), table.target.copy()
    for _ in range(MAX_TERMS):
        size = np.einsum("nk,nk->k", left, left)
        gains = np.where(size > MIN_REMAINING, (left.T @ residual) ** 2 / np.maximum(size, MIN_REMAINING), 0.0)
        best = int(np.argmax(gains)) if len(gains) else -1
        if best < 0 or gains[best] <= 0:
            return
        yield best, float(gains[best])
        direction = left[:, best] / np.sqrt(size[best])
        residual -= direction * (direction @ residual)
        left -= np.outer(direction, direction @ left)


def forward(table: Table) -> dict[str, Picks]:
    """Select forward while AIC, and while BIC, of a statsmodels OLS fit falls; the order of entry is the same.

    The base's own columns would add the same to every AIC and every BIC, so they need not be there.
    """
    from statsmodels.regression.linear_model import OLS

    def fitted(chosen: list[int]) -> Any:
        return OLS(table.target, table.columns[:, chosen]).fit(method="qr")

    chosen: list[int] = []
    gains: list[float] = []
    found: dict[str, Picks] = {}
    last = fitted(chosen)
    for column, gain in entries(table):
        now = fitted([*chosen, column])
        for name in ("aic", "bic"):
            if name not in found and getattr(now, name) >= getattr(last, name):
                found[name] = _as_entered(table, chosen, gains, last)
        if len(found) == 2:
            break
        chosen, gains, last = [*chosen, column], [*gains, gain], now
    for name in ("aic", "bic"):
        found.setdefault(name, _as_entered(table, chosen, gains, last))
    return {"forward AIC (statsmodels)": found["aic"], "forward BIC (statsmodels)": found["bic"]}


def _as_entered(table: Table, chosen: list[int], gains: list[float], model: Any) -> Picks:
    # an effect counts by its first column, and by no more than what came before it: so one axis keeps its order
    falling = np.minimum.accumulate(gains) / model.mse_resid if gains else []
    first: dict[str, float] = {}
    for column, gain in zip(chosen, falling, strict=True):
        first.setdefault(str(table.effects[column]), float(gain))
    return list(first.items())


def lasso(table: Table) -> dict[str, Picks]:
    """Select by LassoCV, whole temperatures left out together."""
    from sklearn.linear_model import LassoCV
    from sklearn.model_selection import GroupKFold

    scale = np.sqrt(len(table.target))
    number = min(LASSO_FOLDS, len(np.unique(table.level)))
    cv = list(GroupKFold(number).split(table.columns, groups=table.level))
    model = LassoCV(fit_intercept=False, cv=cv, **LASSO_PATH)
    model.fit(table.columns * scale, table.target / _rms(table.target))
    return {"LassoCV (scikit-learn)": _by_size(table, model.coef_)}


def stlsq(table: Table) -> dict[str, Picks]:
    """Select by PySINDy's sequentially thresholded least squares with the threshold that it comes with."""
    from pysindy import STLSQ

    model = STLSQ()
    model.fit(table.columns * np.sqrt(len(table.target)), table.target / _rms(table.target))
    return {"STLSQ (PySINDy)": _by_loss(table, np.asarray(model.coef_)[0])}


def _by_size(table: Table, coefficients: Array) -> Picks:
    """Return the effects with a coefficient, by the size of all their columns together."""
    scale = _rms(table.target)
    columns, target = table.columns * np.sqrt(len(table.target)), table.target / scale
    variance = max(float(np.mean((target - columns @ coefficients) ** 2)), 1e-300)
    found = []
    for effect in np.unique(table.effects[coefficients != 0]):
        own = table.effects == effect
        found.append((str(effect), float(np.sum((columns[:, own] @ coefficients[own]) ** 2)) / variance))
    return sorted(found, key=lambda pick: -pick[1])


def _by_loss(table: Table, coefficients: Array) -> Picks:
    """Return the effects with a coefficient, by how much worse least squares on what was picked gets without each.

    Unpenalised, collinear columns have coefficients that are huge and cancel, so their size says little.
    """
    picked = coefficients != 0
    effects = table.effects[picked]
    small = np.linalg.qr(np.column_stack([table.columns[:, picked], table.target]), mode="r")

    def left(kept: NDArray[np.bool_]) -> float:
        columns, target = small[:, :-1][:, kept], small[:, -1]
        return float(np.sum((target - columns @ np.linalg.lstsq(columns, target, rcond=INDEPENDENT)[0]) ** 2))

    whole = left(np.ones(len(effects), dtype=bool))
    variance = max(whole / len(table.target), 1e-300)
    found = [(str(effect), (left(effects != effect) - whole) / variance) for effect in np.unique(effects)]
    return sorted(found, key=lambda pick: -pick[1])


def _rms(values: Array) -> float:
    return max(float(np.sqrt(np.mean(values**2))), 1e-300)


TOOLS: tuple[Callable[[Table], dict[str, Picks]], ...] = (forward, lasso, stlsq)


def ask(data: ReducedRecording, designs: Mapping[str, Design]) -> dict[str, dict[str, Any]]:
    """Return tool and view -> the effects it names, greatest gain over all axes first, and the seconds it took."""
    answers: dict[str, dict[str, Any]] = {}
    for view in ("means", "rows"):
        tables = [table_of(data, design, axis, means=view == "means") for axis, design in designs.items()]
        for tool in TOOLS:
            begun = time.process_time()
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # collinear columns and eliminated ones are what is studied here
                found = [tool(table) for table in tables]
            seconds = time.process_time() - begun
            for name in found[0]:
                named = _together([picks[name] for picks in found])
                answers[f"{name}, {view}"] = {"named": named, "seconds": round(seconds, 3)}
    return answers


def _together(per_axis: list[Picks]) -> list[str]:
    total: dict[str, float] = {}
    for picks in per_axis:
        for effect, gain in picks:
            total[effect] = total.get(effect, 0.0) + gain
    return sorted(total, key=lambda effect: -total[effect])
