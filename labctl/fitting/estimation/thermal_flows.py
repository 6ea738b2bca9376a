"""Heat flows and an axis: the structures that are tried, their columns on every time constant, and what they leave.

For given time constants bias and scale factor are linear in all other coefficients (variable projection: Golub and
Pereyra 1973, doi:10.1137/0710036), so a grid of them is tried at once by its normal equations.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.data.fit_data import FitData
from labctl.fitting.effects.thermal_lag import LONGEST_S, SHORTEST_S, Lag, LagElement, Part, ThermalLag
from labctl.fitting.estimation.axis_design import axis_design
from labctl.fitting.models.error_model import ErrorModel
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.drift_whitening import whitened
from labctl.fitting.numeric.variable_projection import Local, refined

#: Time constants that are tried, s; neighbours are a tenth apart.
GRID_S = np.geomspace(SHORTEST_S, LONGEST_S, 60)
#: Two flows of one element are at least so many places of the grid apart: nearer ones are one.
APART = 4
#: A structure with more coefficients is taken where it lowers the chi2 of what was left out by this share, and by so
#: much more in units of its scatter.
BETTER_BY, BETTER_TO = 0.02, 9.0
#: Columns that the base explains but for this share of their square are not tried; two that differ by less are one.
MIN_REMAINING = 1e-6
#: Steps by Gauss and Newton from the grid's best, for a stretch left out and for all data; difference of a logarithm.
FEW_STEPS, MAX_STEPS, STEP = 2, 12, 0.01
LOG_BOUNDS = (float(np.log(SHORTEST_S)), float(np.log(LONGEST_S)))
#: Axis -> name -> time constant, s.
Taus = Mapping[str, Mapping[str, float]]
#: Data sets that are fitted and those that are tested, masks (m,); errors of axes on tested data sets, deg/s.
Stretch = tuple[NDArray[np.bool_], NDArray[np.bool_]]
Errors = Sequence[tuple["Axis", NDArray[np.bool_], Array]]
PARTS: tuple[Part, ...] = ("all", "curved")
#: Places on the grid of the time constants of warming and cooling that are tried together, (q, 2).
PAIRS = np.stack(np.meshgrid(*2 * [np.arange(0, len(GRID_S), 4)], indexing="ij"), axis=-1).reshape(-1, 2)


@dataclass(frozen=True)
class Structure:
    """A set of heat flows: for each column the name of its time constant, and what of the lag it takes."""

    id: str
    sentence: str
    columns: tuple[tuple[str, Part], ...] = ()
    per_axis: bool = True  #: whether each axis has time constants of its own
    two_ways: bool = False  #: whether the first time constant is another one while the element cools
    fixed: Mapping[str, float] = field(default_factory=dict)  #: name -> time constant that is not looked for, s

    @property
    def size(self) -> tuple[int, bool]:
        """How much it takes: structures of one size are compared before the next ones."""
        return len(self.columns) + self.two_ways, self.per_axis

    def coefficients(self, axes: int) -> int:
        """Return how many coefficients and time constants it has on so many axes."""
        return len(self.columns) * axes + len(self.constants) * (axes if self.per_axis else 1)

    @property
    def constants(self) -> tuple[str, ...]:
        """The names of the time constants that are looked for, without the axis."""
        named = dict.fromkeys(name for name, _ in self.columns if name not in self.fixed)
        return (*named, *(("cooling_tau",) if self.two_ways else ()))

    def taus_s(self, logarithms: Array) -> dict[str, float]:
        """Return its time constants, s, by the logarithms of those that are looked for."""
        return {**dict(zip(self.constants, np.exp(logarithms).tolist(), strict=True)), **self.fixed}

    def of_axis(self) -> Structure:
        """Return the same for one axis by itself."""
        return replace(self, per_axis=True, sentence=self.sentence.replace(" for all axes", "").replace(ON_EACH, ""))


#: How a sentence says that a structure is that of every axis.
ON_EACH = " on each axis"
NONE = Structure("none", "no lag")
#: Simplest first.
STRUCTURES: tuple[Structure, ...] = (
    Structure("one", "one time constant for all axes", (("tau", "all"),), per_axis=False),
    Structure("per_axis", "one time constant on each axis", (("tau", "all"),)),
    Structure(
        "rate", "one time constant for all axes, and a term in dT/dt",  # a flow that is nearly at once: -tau dT/dt
        (("tau", "all"), ("second_tau", "all")), per_axis=False, fixed={"second_tau": SHORTEST_S},
    ),
    Structure("curved", "one time constant on each axis, and a curved law", (("tau", "all"), ("tau", "curved"))),
    Structure(
        "two_ways", "one time constant on each axis while it warms up, another while it cools",
        (("tau", "all"),), two_ways=True,
    ),
    Structure("two_flows", "two time constants on each axis", (("tau", "all"), ("second_tau", "all"))),
)  # fmt: skip


@dataclass(frozen=True)
class LeftOut:
    """What a structure leaves of stretches that it has not seen: root mean square, deg/s, and chi2 over the noise."""

    rms_dps: float
    chi2: float
    n: int  #: values that were predicted

    def is_below(self, other: LeftOut) -> bool:
        """Return whether it is clearly less than what another structure leaves."""
        return self.chi2 < (1 - BETTER_BY) * other.chi2 - BETTER_TO * other.chi2 / other.n


class Axis:
    """One axis: the columns of the other effects, those of every time constant, and what is to be explained."""

    def __init__(self, data: FitData, base_model: ErrorModel, name: str, kind: Lag | None = None) -> None:
        self.data, self.name = data, name
        self.factor = (kind or ThermalLag()).factor(data.channels, name)
        design = axis_design(data, base_model, name)
        self.base = design.columns
        self.y = data.outputs[name] - data.true_rate_dps(name) - design.offset_dps
        self.above_k = data.channels.temperature_c(name) - base_model.reference.temperature_c
        self._folds: dict[bytes, Projected] = {}

    @cached_property
    def lags(self) -> NDArray[np.float64]:
        """The columns of every time constant of the grid (m, .): of each part in turn, then of pairs of them."""
        behind = [self._behind_k(float(tau_s)) for tau_s in GRID_S]
        lag_columns = [LagElement("", "", part, 0.0).values(lag, self.above_k) for part in PARTS for lag in behind]
        channels, (warming, cooling) = self.data.channels, GRID_S[PAIRS.T]
        both = channels.history.lags_two_ways_k(channels.columns, warming, cooling)
        return np.column_stack([*lag_columns, both]) * self.factor[:, None]

    def _behind_k(self, tau_s: float, cooling_tau_s: float | None = None) -> Array:
        return self.data.channels.history.lag_k(self.data.channels.columns, tau_s, cooling_tau_s)

    def columns(self, structure: Structure, taus_s: Mapping[str, float]) -> NDArray[np.float64]:
        """Return the columns (m, k) of a structure at time constants, s."""
        elements = (
            LagElement("", "", part, 0.0).values(self._behind_k(taus_s[name], taus_s.get("cooling_tau")), self.above_k)
            for name, part in structure.columns
        )
        return np.column_stack([np.zeros((len(self.y), 0)), *elements]) * self.factor[:, None]

    def projected(self, in_fit: NDArray[np.bool_]) -> Projected:
        """Return the time constants' columns beside the base, over the noise, of the data sets of a mask."""
        key = in_fit.tobytes()
        if key not in self._folds:
            self._folds[key] = Projected(self, in_fit)
        return self._folds[key]

    def over_noise(self, values: NDArray[np.float64], in_fit: NDArray[np.bool_]) -> NDArray[np.float64]:
        """Return columns (m, k) of the data sets of a mask, whitened at the drift of the noise floor."""
        scatter = self.data.take(in_fit).scatter(self.name)
        white = scatter.white_var if scatter.white_var is not None else np.ones(int(in_fit.sum()))
        return whitened(scatter, [self.data.noise_floor.axes[self.name].drift], white, values[in_fit])[0][0]

    def left_over_noise(self, added: NDArray[np.float64], in_fit: NDArray[np.bool_]) -> Array:
        """Return what a fit of base and added columns (m, k) leaves of the data sets of a mask, whitened."""
        rows = self.over_noise(np.column_stack([self.base, added, self.y]), in_fit)
        size = np.maximum(np.linalg.norm(rows[:, :-1], axis=0), 1e-300)
        coordinates, *_ = np.linalg.lstsq(rows[:, :-1] / size, rows[:, -1], rcond=1e-9)
        return np.asarray(rows[:, -1] - rows[:, :-1] / size @ coordinates)

    def errors(self, added: NDArray[np.float64], in_fit: NDArray[np.bool_], tested: NDArray[np.bool_]) -> Array:
        """Return what a fit of base and added columns (m, k) to some data sets leaves of others, deg/s."""
        whole = np.concatenate([self.base, added], axis=1)
        rows = self.over_noise(np.column_stack([whole, self.y]), in_fit)
        size = np.maximum(np.linalg.norm(rows[:, :-1], axis=0), 1e-300)
        coordinates, *_ = np.linalg.lstsq(rows[:, :-1] / size, rows[:, -1], rcond=1e-9)
        return np.asarray(self.y[tested] - whole[tested] @ (coordinates / size))


class Projected:
    """Normal equations of the time constants' columns of one axis, beside its base."""

    def __init__(self, axis: Axis, in_fit: NDArray[np.bool_]) -> None:
        rows = axis.over_noise(np.column_stack([axis.base, axis.lags, axis.y]), in_fit)
        base, other_columns = rows[:, : axis.base.shape[1]], rows[:, axis.base.shape[1] :]
        whole = (other_columns**2).sum(axis=0)
        if base.shape[1]:
            directions, sizes, _ = np.linalg.svd(
                base / np.maximum(np.linalg.norm(base, axis=0), 1e-300), full_matrices=False
            )
            directions = directions[:, sizes > 1e-9 * sizes[0]]
            other_columns = other_columns - directions @ (directions.T @ other_columns)
        alone = other_columns[:, : len(PARTS) * len(GRID_S)]  # columns that are also tried in twos
        self._gram, self._pull = alone.T @ alone, other_columns[:, :-1].T @ other_columns[:, -1]
        size = (other_columns[:, :-1] ** 2).sum(axis=0)
        self._kept = size > MIN_REMAINING * np.maximum(whole[:-1], 1e-300)
        self._single = self._pull**2 / np.where(self._kept, size, np.inf)

    def gains(self, columns: NDArray[np.int64]) -> Array:
        """Return the chi2 that each set of one or two columns (q, 1 or 2) takes off, (q,)."""
        if columns.shape[1] == 1:
            return self._single[columns[:, 0]]
        i, j = columns.T
        a, b, c = self._gram[i, i], self._gram[j, j], self._gram[i, j]
        determinant = a * b - c**2
        good = self._kept[i] & self._kept[j] & (determinant > MIN_REMAINING * a * b)
        both = b * self._pull[i] ** 2 - 2 * c * self._pull[i] * self._pull[j] + a * self._pull[j] ** 2
        return np.where(good, both / np.where(good, determinant, 1.0), np.maximum(self._single[i], self._single[j]))


def _choices(structure: Structure) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the columns (q, k) that a structure tries together, and the places of its constants on the grid."""
    n = len(GRID_S)
    if structure.two_ways:
        return len(PARTS) * n + np.arange(len(PAIRS))[:, None], PAIRS
    if structure.fixed:
        places = np.arange(APART, n)[:, None]
        at = np.column_stack([places, np.zeros_like(places)])  # the shortest of the grid
    elif len(structure.constants) == 1:
        places = np.arange(n)[:, None]
        at = np.repeat(places, len(structure.columns), axis=1)
    else:
        first, second = np.indices((n, n)).reshape(2, -1)
        is_apart = second >= first + APART
        places = at = np.column_stack([first[is_apart], second[is_apart]])
    offsets = np.array([PARTS.index(part) * n for _, part in structure.columns])
    return at + offsets, places


def best_taus(axes: Sequence[Axis], structure: Structure, in_fit: NDArray[np.bool_], steps: int = FEW_STEPS) -> Taus:
    """Return axis -> name -> time constant, s, for the data sets of a mask: the grid's best, and steps from there."""
    if not structure.columns:
        return {axis.name: {} for axis in axes}
    columns, places = _choices(structure)
    gains = [axis.projected(in_fit).gains(columns) for axis in axes]
    groups = [([axis], gain) for axis, gain in zip(axes, gains, strict=True)]
    if not structure.per_axis:
        groups = [(list(axes), np.sum(gains, axis=0))]
    tau_by_axis: dict[str, Mapping[str, float]] = {}
    for group, gain in groups:
        begin = np.log(GRID_S[places[int(np.argmax(gain))]])
        logarithms = refined(partial(moved_around, group, structure, in_fit), begin, LOG_BOUNDS, steps)
        tau_by_axis |= {axis.name: structure.taus_s(logarithms) for axis in group}
    return tau_by_axis


def moved_around(
    group: Sequence[Axis], structure: Structure, in_fit: NDArray[np.bool_], logarithms: Array
) -> list[Local]:
    """Return what is left of each axis at logarithms of time constants, and what each of them moves."""
    taus_s = structure.taus_s(logarithms)
    neighbours = []
    for axis in group:
        at_taus = axis.columns(structure, taus_s)
        moved = [
            (axis.columns(structure, {**taus_s, name: taus_s[name] * np.exp(STEP)}) - at_taus) / STEP
            for name in structure.constants
        ]
        rows = axis.over_noise(np.column_stack([axis.base, at_taus, *moved, axis.y]), in_fit)
        neighbours.append(Local(rows, axis.base.shape[1], at_taus.shape[1]))
    return neighbours


def left_out_by(
    axes: Sequence[Axis], structure: Structure, stretches: Sequence[tuple[NDArray[np.bool_], NDArray[np.bool_]]]
) -> LeftOut:
    """Return the errors of stretches by fits to the rest, time constants included."""
    return pooled(errors_of(axes, structure, stretches))


def errors_of(axes: Sequence[Axis], structure: Structure, stretches: Sequence[Stretch]) -> Errors:
    """Return the same, axis by axis and stretch by stretch."""
    error_list = []
    for in_fit, tested in stretches:
        taus_s = best_taus(axes, structure, in_fit)
        error_list += [
            (axis, tested, axis.errors(axis.columns(structure, taus_s[axis.name]), in_fit, tested)) for axis in axes
        ]
    return error_list


def pooled(errors: Errors) -> LeftOut:
    """Return the errors of stretches together: of an axis, the data sets that were tested, and their errors, deg/s."""
    chi2 = 0.0
    for axis, tested, axis_errors in errors:
        whole = np.zeros(len(tested))
        whole[tested] = axis_errors
        chi2 += float(np.sum(axis.over_noise(whole[:, None], tested) ** 2))
    every = np.concatenate([axis_errors for *_, axis_errors in errors])
    return LeftOut(float(np.sqrt(np.mean(every**2))), chi2, len(every))
