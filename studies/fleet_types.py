"""Types of gyroscopes for the study of fleets: units with coefficients, as a campaign would estimate them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime, timedelta
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.data.channels import BODY_AXES
from labctl.fitting.data.fit_data import FitData
from labctl.fitting.design.heat_course import HeatCourse
from labctl.fitting.design.noise_figures import AxisNoiseFigures, NoiseFigures, UnsettledHeat
from labctl.fitting.design.planned_sets import PlannedSets, planned_data
from labctl.fitting.design.range_of_use import RangeOfUse
from labctl.fitting.effects import Reference
from labctl.fitting.estimation.axis_design import AxisDesign, axis_design
from labctl.fitting.estimation.prior import coefficient_names
from labctl.fitting.fleet.batched import batched_fit
from labctl.fitting.fleet.directions import kind_of_coefficient
from labctl.fitting.fleet.unit_coefficients import UnitCoefficients
from labctl.fitting.models.error_model import ErrorModel
from labctl.fitting.models.presets import preset_for
from labctl.fitting.numeric.arrays import block_diagonal
from labctl.fitting.numeric.drift_noise import PRIOR_FACTOR, TAU_SPACINGS, Drift, Scatter

Array = NDArray[np.float64]
PRESET = preset_for("bias_scale", [])
USE = RangeOfUse(BODY_AXES, 100.0, (0.0, 50.0))
#: Noise of a mean of 40 s: 2 mdeg/s white, 1 mdeg/s drift with a correlation time of 900 s.
LASTS_S, PERIOD_S, DRIFT = 40.0, 60.0, Drift(1e-3, 900.0)
NOISE = NoiseFigures(
    dict.fromkeys(BODY_AXES, AxisNoiseFigures(2e-3 * np.sqrt(LASTS_S), DRIFT.drift_dps, DRIFT.tau_s)),
    UnsettledHeat(0.0),
)
BEGAN = datetime(2024, 1, 1, tzinfo=UTC)
BATCHES, BENCHES, SUPPLIERS, YEARS = 20, 3, 2, 2.0

#: Mean and spread of each kind of coefficient over units; the unit of each is that of the model.
DIFFERENT: Mapping[str, tuple[float, float]] = {
    "bias": (0.1, 0.2), "bias_t1": (2e-3, 2e-3), "bias_t2": (3e-5, 3e-5),
    "scale_factor": (2e-3, 3e-3), "scale_factor_t1": (5e-5, 5e-5), "scale_factor_t2": (5e-7, 5e-7),
    "misalignment_x": (0.0, 2e-3), "misalignment_y": (0.0, 2e-3), "misalignment_z": (0.0, 2e-3),
}  # fmt: skip
#: The same where the units of a type follow the temperature alike: what a prior is for.
ALIKE_IN_TEMPERATURE: Mapping[str, tuple[float, float]] = {
    **DIFFERENT, "bias_t1": (2e-3, 3e-5), "bias_t2": (3e-5, 1e-6), "scale_factor_t1": (5e-5, 3e-7),
    "scale_factor_t2": (5e-7, 1e-8),
}  # fmt: skip
#: The same where units are alike in scale factor and alignment too, and only the bias differs.
ALIKE_BUT_BIAS: Mapping[str, tuple[float, float]] = {
    **ALIKE_IN_TEMPERATURE, "scale_factor": (2e-3, 2e-5), "misalignment_x": (0.0, 2e-5), "misalignment_y": (0.0, 2e-5),
    "misalignment_z": (0.0, 2e-5),
}  # fmt: skip


@dataclass(frozen=True)
class Campaign:
    """A schedule of data sets in three positions, and the design that it gives the model of the study."""

    sets: PlannedSets
    data: FitData  #: without errors
    model: ErrorModel
    designs: Mapping[str, AxisDesign]
    names: tuple[str, ...]  #: (k,) of the coefficients of all axes

    @staticmethod
    def of(rates: int, levels: int) -> Campaign:
        """Return a campaign of so many rates at so many temperatures in each of three positions."""
        warm = np.linspace(*USE.temperature_c, levels) if levels > 1 else np.array([25.0])
        of_position = [(rate, level) for level in warm.tolist() for rate in np.linspace(-100.0, 100.0, rates).tolist()]
        each = np.array(of_position * len(BODY_AXES))
        n = len(each)
        begin, one = PERIOD_S * np.arange(n, dtype=np.float64), np.ones(n, dtype=np.int64)
        sets = PlannedSets(
            begin, np.full(n, LASTS_S), each[:, 0], np.repeat(np.array(BODY_AXES), len(of_position)), one, one, begin,
            HeatCourse.constant_in_steps(each[:, 1], PERIOD_S),
        )  # fmt: skip
        data = planned_data(sets, BODY_AXES, NOISE)
        data = replace(
            data, info=data.info.model_copy(update={"datasheet": {"bias_stability_dps": 2 * DRIFT.drift_dps}})
        )
        model = replace(PRESET.build(data)[0], reference=Reference(25.0))
        designs = {axis: axis_design(data, model, axis) for axis in BODY_AXES}
        names: list[str] = []
        for axis, design in designs.items():
            owners = [owner for owner, _, _ in design.names]
            names += coefficient_names(model, axis, owners, [name for _, name, _ in design.names])
        return Campaign(sets, data, model, designs, tuple(names))

    @cached_property
    def covariance(self) -> NDArray[np.float64]:
        """The covariance of the coefficients by a fit to the data sets alone, (k, k)."""
        nothing = np.zeros((len(self.data), 1))
        return block_diagonal([
            batched_fit(design.columns, nothing, self.data.scatter(axis), DRIFT).covariance(0)
            for axis, design in self.designs.items()
        ])  # fmt: skip

    def measured(self, rng: np.random.Generator, truth: Array, *, is_drift_drawn: bool = False) -> FitData:
        """Return the data sets of a unit with coefficients (k,): the drift of the study, or one drawn for each axis."""
        outputs, begin = {}, 0
        for axis, design in self.designs.items():
            own, scatter = truth[begin : begin + design.columns.shape[1]], self.data.scatter(axis)
            begin += len(own)
            drift = expected_drifts(rng, scatter, 1)[0] if is_drift_drawn else DRIFT
            noise = drawn_noise(rng, self.sets.middle_s, scatter, drift)
            outputs[axis] = self.data.outputs[axis] + design.columns @ own + noise
        return replace(self.data, outputs=outputs)


def drawn_noise(rng: np.random.Generator, t_s: Array, scatter: Scatter, noise: Drift) -> Array:
    """Return the errors of data sets: white noise, and a drift that is a sum of first-order processes."""
    white = scatter.white_var
    assert white is not None
    whole, size_dps = np.zeros(len(t_s)), noise.drift_dps / np.sqrt(len(noise.taus_s))
    for tau_s in noise.taus_s:
        decay = np.exp(-np.diff(t_s) / tau_s)
        drift = [float(rng.normal(0.0, size_dps))]
        for part, step in zip(decay.tolist(), rng.normal(size=len(decay)).tolist(), strict=True):
            drift.append(part * drift[-1] + size_dps * float(np.sqrt(1.0 - part**2)) * step)
        whole += drift
    return np.asarray(whole + np.sqrt(white) * rng.normal(size=len(white)))


def expected_drifts(rng: np.random.Generator, scatter: Scatter, n: int) -> list[Drift]:
    """Return n drifts as a fit expects them: about half the bias stability, of any time constant that it tries.

    Those are multiples of the spacing of data sets, the length of the run, and flicker between the two.
    """
    assert scatter.datasheet_drift_dps is not None
    spacing_s, span_s = float(np.median(np.diff(np.sort(scatter.t_s)))), float(np.ptp(scatter.t_s))
    shapes: list[tuple[float, float | None]] = [(ratio * spacing_s, None) for ratio in TAU_SPACINGS]
    shapes += [(span_s, None), (span_s, spacing_s)]
    sizes_dps = scatter.datasheet_drift_dps / 2 * PRIOR_FACTOR ** rng.normal(size=n)
    chosen = [shapes[k] for k in rng.integers(len(shapes), size=n).tolist()]
    return [
        Drift(size_dps, tau_s, shortest_tau_s=shortest_s)
        for size_dps, (tau_s, shortest_s) in zip(sizes_dps.tolist(), chosen, strict=True)
    ]


def truths(rng: np.random.Generator, kind: Mapping[str, tuple[float, float]], names: Sequence[str], n: int) -> Array:
    """Return the true coefficients of n units of a type, (n, k)."""
    mean, spread = np.array([kind[kind_of_coefficient(name)] for name in names]).T
    return np.asarray(mean + spread * rng.normal(size=(n, len(names))))


@dataclass(frozen=True)
class Fleet:
    """Units of a type as calibrated: which batch and bench each is of, and what is wrong with one of them."""

    kind: Mapping[str, tuple[float, float]]
    units: int = 200
    bench_error: float = 0.0  #: relative error of the rate of bench 2: all scale factors on it are off by it
    batch_shift: Mapping[str, float] = field(default_factory=dict)  #: coefficient -> shift of batch 7

    def drawn(self, campaign: Campaign, rng: np.random.Generator) -> list[UnitCoefficients]:
        """Return the calibrated units; benches measure all batches."""
        names = campaign.names
        true = truths(rng, self.kind, names, self.units)
        batch, bench = rng.integers(BATCHES, size=self.units), rng.integers(BENCHES, size=self.units)
        scales = [i for i, name in enumerate(names) if kind_of_coefficient(name) == "scale_factor"]
        true[np.ix_(bench == 2, scales)] += self.bench_error
        for name, shift in self.batch_shift.items():
            true[batch == 7, names.index(name)] += shift
        root = np.linalg.cholesky(campaign.covariance)
        values = true + rng.normal(size=true.shape) @ root.T
        days = rng.uniform(0.0, 365.25 * YEARS, size=self.units)
        return [
            UnitCoefficients(
                f"U{i:04d}", names, values[i], campaign.covariance,
                {"batch": f"B{batch[i]:02d}", "bench": f"bench {bench[i]}", "supplier": f"S{batch[i] % SUPPLIERS}"},
                BEGAN + timedelta(days=float(days[i])), (), "bias_scale of the rate", 25.0,
            )
            for i in range(self.units)
        ]  # fmt: skip
