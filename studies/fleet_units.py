"""Units of the study of fleets: points of a campaign, and what a criticism of them would say, by its own algebra.

The errors that are hidden have shapes of their own here, not those of the catalogue.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.criticism import CandidateEstimates, Criticism, candidate_estimates, criticise
from labctl.fitting.criticism.evidence.elimination import eliminate_base
from labctl.fitting.criticism.evidence.gains import MIN_REMAINING
from labctl.fitting.data.fit_data import fit_data_of
from labctl.fitting.fleet.type_sums import AxisSums, TypeSums
from labctl.fitting.models.presets import usual_model
from labctl.recording import Recording, RecordingInfo

Array = NDArray[np.float64]
#: Rate along the axis (m,) deg/s, time since switching on (m,) s -> error (m,) in any unit.
Shape = Callable[[Array, Array], Array]

RATES_DPS = np.linspace(-100.0, 100.0, 11)
LEVELS_C = (0.0, 12.0, 25.0, 38.0, 50.0)
AXES = ("x", "y", "z")
READINGS, WHITE_DPS, SPACING_S = 300, 2e-3, 75.0
DRIFT_DPS, DRIFT_TAU_S = 1e-3, 900.0

#: What is hidden, with the effects of the catalogue that its name may stand for.
HIDDEN: Mapping[str, tuple[Shape, frozenset[str]]] = {
    "output that bends over like a hyperbolic tangent": (
        lambda rate, _: 60.0 * np.tanh(rate / 60.0) - rate,
        frozenset({"scale_factor_odd", "sine_response", "saturation"}),
    ),
    "rounded kink at rest": (
        lambda rate, _: np.sqrt(rate**2 + 15.0**2),
        frozenset({"scale_factor_asymmetry", "scale_factor_even"}),
    ),
    "bias that settles after switching on, by a power of time": (
        lambda _, t_s: (1.0 + t_s / 600.0) ** -1.5,
        frozenset({"warm_up"}),
    ),
}


def recording(seed: int, hidden: Mapping[str, tuple[Shape, float]] | None = None, serial: str = "") -> Recording:
    """Return the points of a unit: its own bias, scale factor and misalignment, white noise and drift, and `hidden`.

    `hidden` is axis -> (shape, size).
    """
    rng = np.random.default_rng(seed)
    n = len(RATES_DPS) * len(LEVELS_C)
    rate = np.tile(np.tile(RATES_DPS, len(LEVELS_C)), 3)
    warm = np.tile(np.repeat(np.array(LEVELS_C), len(RATES_DPS)), 3) + rng.normal(0.0, 0.02, 3 * n)
    position, t_s = np.repeat(np.array(AXES), n), SPACING_S * np.arange(3.0 * n)
    columns: dict[str, NDArray[np.generic]] = {
        "dataset": np.arange(1, 3 * n + 1), "t_s": t_s, "position": position, "run": np.ones(3 * n, dtype=np.int64),
        "table_rate_dps": rate, "temperature_c": warm, "power_s": t_s, "n": np.full(3 * n, READINGS),
    }  # fmt: skip
    for axis in AXES:
        along = np.where(position == axis, rate, 0.0)
        across = [np.where(position == other, rate, 0.0) for other in AXES if other != axis]
        bias, per_k, scale, scale_per_k = rng.normal(0.0, [0.2, 3e-3, 5e-3, 1e-4])
        output = along * (1.0 + scale + scale_per_k * (warm - 25.0)) + bias + per_k * (warm - 25.0)
        output = output + sum(rng.normal(0.0, 2e-3) * each for each in across) + _noise(rng, t_s)
        if hidden and axis in hidden:
            shape, size = hidden[axis]
            output = output + size * shape(along, t_s)
        columns |= {f"gyro_{axis}": output, f"gyro_{axis}_std": np.full(3 * n, WHITE_DPS * np.sqrt(READINGS))}
    info = RecordingInfo(
        serial=serial or f"U{seed}", axes=AXES, kind="points", started_at=datetime(2026, 1, 1, tzinfo=UTC)
    )
    return Recording(info, columns)


def _noise(rng: np.random.Generator, t_s: Array) -> Array:
    """Return white noise and an Ornstein-Uhlenbeck drift, (m,) deg/s."""
    decay = np.exp(-np.diff(t_s) / DRIFT_TAU_S)
    drift = np.empty(len(t_s))
    drift[0] = rng.normal(0.0, DRIFT_DPS)
    steps = rng.normal(0.0, DRIFT_DPS, len(decay)) * np.sqrt(1.0 - decay**2)
    for i, (part, step) in enumerate(zip(decay.tolist(), steps.tolist(), strict=True)):
        drift[i + 1] = part * drift[i] + step
    return np.asarray(drift + rng.normal(0.0, WHITE_DPS, len(t_s)))


def criticised(points: Recording) -> Criticism:
    """Return the criticism of a unit's points, beside the usual model."""
    return criticise(points, usual_model(fit_data_of(points)), points=points, full=False)


@dataclass(frozen=True)
class Algebra:
    """Algebra of the criticism of one schedule: what it estimates of every candidate, at the noise that it found."""

    found: Criticism
    axes: Mapping[str, CandidateEstimates]
    roots: Mapping[str, NDArray[np.float64]]  #: axis -> (K, r) root of the overlap

    @staticmethod
    def of(points: Recording) -> Algebra:
        """Return the algebra of a recording's schedule."""
        found = criticised(points)
        axes = candidate_estimates(found)
        roots = {}
        for axis, each in axes.items():
            values, vectors = np.linalg.eigh(each.overlap)
            roots[axis] = vectors * np.sqrt(np.maximum(values, 0.0))
        return Algebra(found, axes, roots)

    def signal(self, axis: str, shape: Shape) -> tuple[Array, float]:
        """Return what an error of an axis adds to its estimates over their uncertainty, (K,), and its own z.

        z is the length that the model does not absorb, in units of the noise.
        """
        comparison = self.found.beside_missing
        assert comparison is not None
        design, base, nodes = comparison.designs[axis], comparison.axes[axis].best, comparison.data.nodes
        along = np.where(np.asarray(nodes["position"]) == axis, np.asarray(nodes["table_rate_dps"]), 0.0)
        error = shape(along, np.asarray(nodes["t_s"]))
        y = comparison.data.rows_of(error[:, None])[:, :, 0]
        (beside,) = eliminate_base(design, y, comparison.white_var[axis], comparison.scales[axis], [base.noise])
        left = np.diag(base.gram)
        visible = np.zeros(len(left), dtype=bool)
        for option, rows in zip(design.options, comparison.axes[axis].slices, strict=True):
            is_seen = left[rows] > MIN_REMAINING * np.maximum(base.squared_norms[rows], 1e-300)
            visible[rows] = is_seen & (option.term is not None)
        return beside.data_products[visible] / np.sqrt(left[visible]), float(np.sqrt(max(beside.chi2, 0.0)))

    def drawn(self, rng: np.random.Generator, units: int, axis: str) -> NDArray[np.float64]:
        """Return estimates of units without any error, over their uncertainty, (units, K)."""
        root = self.roots[axis]
        return np.asarray(rng.normal(size=(units, root.shape[1])) @ root.T)

    def fleet(
        self, rng: np.random.Generator, benches: Sequence[str], hidden: Mapping[str, Array] | None = None,
        signs: Array | None = None,
    ) -> TypeSums:  # fmt: skip
        """Return the sums over units, one for each of `benches`; `hidden` is axis -> (K,) what all of them have.

        `signs` (units,) multiply what is hidden; without them all units have it alike.
        """
        sums = TypeSums(units=len(benches))
        each_bench = np.array(benches)
        for axis, of_axis in self.axes.items():
            z = self.drawn(rng, len(benches), axis)
            if hidden and axis in hidden:
                z += (np.ones(len(benches)) if signs is None else signs)[:, None] * hidden[axis]
            for bench in dict.fromkeys(benches):
                own = each_bench == bench
                u = np.broadcast_to(of_axis.u, (int(own.sum()), len(of_axis.u)))
                added = sums.benches.setdefault(bench, {}).setdefault(axis, AxisSums())
                added.add(of_axis.shapes, z[own], u, of_axis.overlap)
        return sums
