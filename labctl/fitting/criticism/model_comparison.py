"""Comparison of a model with everything that may be missing from it, over all axes of a reduced recording."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.criticism.base_columns import base_of
from labctl.fitting.criticism.candidate_shape import CandidateShape
from labctl.fitting.criticism.candidates import options_of, thermometer_options
from labctl.fitting.criticism.evidence.bayes_factors import AxisEvidence, evidence, means_by_noise
from labctl.fitting.criticism.evidence.design import Design, Discrepancy
from labctl.fitting.criticism.evidence.elimination import MeansByNoise, eliminate_base
from labctl.fitting.criticism.evidence.gains import gains_of, solve_option
from labctl.fitting.criticism.evidence.noise_grid import Noise, noise_grid
from labctl.fitting.criticism.ranking import Candidate, rank_candidates
from labctl.fitting.criticism.reduction import ReducedRecording
from labctl.fitting.effects import CATALOGUE, Effect
from labctl.fitting.effects.response import response_of_terms
from labctl.fitting.models.error_model import ErrorModel
from labctl.fitting.numeric.arrays import Array
from labctl.progress import report_stage

#: From this evidence on, the scatter of the coordinates is estimated again without what the leader explains.
REESTIMATE_FROM = 6.0
ROBUST = 1.4826
#: Least variance of a mean, (deg/s)^2: data without any scatter, as formulas make them, must not divide by zero.
MIN_VAR = 1e-20


@dataclass(frozen=True)
class AxisComparison:
    """Evidence on one axis with the scatter that it was computed with."""

    evidence: AxisEvidence
    white_var: Array  #: (m,) variance of the means besides the drift, (deg/s)^2
    scale: NDArray[np.float64]  #: (R, m) standard deviation of the coordinates besides the means, deg/s


def compare_axis(data: ReducedRecording, design: Design, axis: str) -> AxisComparison:
    """Return the evidence for every option of one axis, with the scatter estimated from the data."""
    y = data.error_dps(axis)
    white, noises = noise_of(data, design, y, axis)
    explained = np.zeros_like(y)
    means: MeansByNoise | None = None
    for estimate in range(2):
        scale = _scales(design, y, white, explained)
        white_now = white + _growing(data, design, y, white, explained)
        if means is None or not np.array_equal(white_now, means.white_var):
            means = means_by_noise(design, y, white_now, noises)
        axis_evidence = evidence(design, y, means, scale, int(design.present.sum()))
        leader = int(np.argmax(axis_evidence.log_bf)) if len(axis_evidence.log_bf) else -1
        if estimate == 1 or leader < 0 or axis_evidence.log_bf[leader] < REESTIMATE_FROM:
            break
        explained = _explained(design, axis_evidence, leader)
    return AxisComparison(axis_evidence, white_now, scale)


def _explained(design: Design, axis_evidence: AxisEvidence, option: int) -> NDArray[np.float64]:
    """Return what an option explains, (R, m)."""
    coefficients, _ = solve_option(axis_evidence.best, axis_evidence.slices[option])
    return np.asarray(design.options[option].rows @ coefficients)


def noise_of(data: ReducedRecording, design: Design, y: NDArray[np.float64], axis: str) -> tuple[Array, list[Noise]]:
    """Return the white variance of each mean, (m,) (deg/s)^2, and the drifts to average over."""
    stability = data.info.stability_dps
    white_var = data.white_var
    white = white_var[axis] if white_var is not None else np.full(len(data), max(_floor_squared(design, y), MIN_VAR))
    level = float(np.sqrt(np.median(white)))
    return white, noise_grid(data.info.technology or "", stability, level, data.instability_dps(axis))


def _floor_squared(design: Design, y: NDArray[np.float64]) -> float:
    """Return the variance of a mean, (deg/s)^2, without known readings: from the residual of a rich smooth model."""
    rich = [design.base[0], *(o.rows[0] for o in design.options if o.smooth)]
    columns = np.concatenate(rich, axis=1)
    columns = columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-12)
    u, s, _ = np.linalg.svd(columns, full_matrices=False)
    u = u[:, s > 1e-6 * s[0]]
    residual = y[0] - u @ (u.T @ y[0])
    return float((ROBUST * np.median(np.abs(residual))) ** 2 * len(residual) / max(len(residual) - u.shape[1], 1))


def _base_residual(design: Design, y: NDArray[np.float64], white: Array) -> NDArray[np.float64]:
    """Return what the base leaves of y (R, m) when its means are fitted with equal drift: good enough for scatter."""
    weight = 1.0 / np.sqrt(white)
    prior = np.diag(np.sqrt(design.precision))[design.precision > 0]
    columns = np.vstack([design.base[0] * weight[:, None], prior])
    size = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    weighted_target = np.concatenate([y[0] * weight, np.zeros(len(prior))])
    solution, *_ = np.linalg.lstsq(columns / size, weighted_target, rcond=1e-9)
    return np.asarray(y - design.base @ (solution / size))


def _scales(
    design: Design, y: NDArray[np.float64], white: Array, explained: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the standard deviation of each coordinate (R, m): robust, one per kind, never below white noise."""
    residual = _base_residual(design, y - explained, white)
    scale = np.repeat(np.sqrt(white)[None, :], len(y), axis=0)
    for k in range(1, len(y)):
        present = design.present[k]
        if present.sum() < 8:
            continue
        values = residual[k, present] / scale[k, present]
        spread = ROBUST * float(np.median(np.abs(values - np.median(values))))
        scale[k] *= max(spread, 1.0)
    return scale


def _growing(
    data: ReducedRecording, design: Design, y: NDArray[np.float64], white: Array, explained: NDArray[np.float64]
) -> Array:
    """Return the variance of means that grows with the table's rate, (m,): scatter between sets of one rate."""
    rate = data.at_sets(data.nodes.table_rate_dps())
    residual = _base_residual(design, y - explained, white)[0]
    centred = residual.copy()
    position = np.asarray(data.nodes["position"]).reshape(len(data), -1)[:, 0]
    for up_position in np.unique(position):
        for value in np.unique(np.round(rate[position == up_position], 2)):
            same = (position == up_position) & (np.round(rate, 2) == value)
            centred[same] -= np.median(residual[same])
    speed = np.abs(rate)
    fast, slow = speed > np.quantile(speed, 2 / 3), speed < np.quantile(speed, 1 / 3)
    if fast.sum() < 12 or slow.sum() < 12:
        return np.zeros(len(rate))
    high, low = (ROBUST * float(np.median(np.abs(centred[part]))) for part in (fast, slow))
    if high < 1.5 * low:
        return np.zeros(len(rate))
    return np.asarray((high**2 - low**2) * (rate / float(np.median(speed[fast]))) ** 2)


#: A formula of which the base leaves less than this share is not orthogonalised.
MIN_ORTHOGONAL_SHARE = 1e-5
#: A column of which this share or less is left is constant but for rounding.
ROUNDING = 1e-12
#: Spacing of data sets, s, where the recording has no times.
USUAL_SPACING_S = 75.0


@dataclass(frozen=True)
class Comparison:
    """A model compared with every candidate, beside the model as their base."""

    data: ReducedRecording
    model: ErrorModel
    designs: Mapping[str, Design]
    axes: Mapping[str, AxisEvidence]
    white_var: Mapping[str, Array]  #: axis -> (m,) variance of the means besides the drift, (deg/s)^2
    scales: Mapping[str, NDArray[np.float64]]  #: axis -> (R, m) standard deviation of the other coordinates, deg/s
    candidates: tuple[Candidate, ...]  #: best first

    def leader(self, *, smooth: bool) -> Candidate | None:
        """Return the best catalogue effect of a physical size, or the best smooth channel."""
        return next((c for c in self.candidates if c.smooth == smooth and c.physical), None)


def design_of(
    data: ReducedRecording,
    model: ErrorModel,
    axis: str,
    catalogue: Mapping[str, Effect] = CATALOGUE,
    *,
    smooth: bool = True,
) -> Design:
    """Return the design of one axis: all that does not depend on its output; without `smooth` of the effects alone."""
    base, precision = base_of(data, model, axis)
    catalogue = {name: kind for name, kind in catalogue.items() if not (kind.exact and name in model.effect_ids)}
    nodes = data.nodes
    t_s = USUAL_SPACING_S * np.arange(len(data), dtype=np.float64)
    if "t_s" in nodes:
        t_s = data.at_sets(np.asarray(nodes["t_s"], dtype=np.float64))
    run = data.at_sets(np.asarray(nodes["run"] if "run" in nodes else np.ones(len(nodes)), dtype=np.float64))
    level = constant_coordinates(base, data)
    without_prior = base[:, :, precision == 0]
    shaped = options_of(data, axis, model.reference, catalogue, smooth=smooth)
    shaped += thermometer_options(data, model, axis) if smooth else []
    options = [orthogonalised(centred(option, level), without_prior) for option in shaped]
    return Design(base, precision, options, data.present, t_s, np.rint(run).astype(np.int64))


def compare_beside(
    comparison: Comparison,
    model: ErrorModel,
    catalogue: Mapping[str, Effect] = CATALOGUE,
    discrepancy: Mapping[str, Discrepancy] | None = None,
) -> Comparison:
    """Compare again beside a model with other terms, and their discrepancy by axis: same candidates, another base.

    Every candidate sees the rate that comes through a delay and a bandwidth of the model: then all are made again.
    """
    data = comparison.data.through(response_of_terms(model.terms))
    if data is not comparison.data:
        designs = {axis: design_of(data, model, axis, catalogue) for axis in comparison.designs}
        comparison = replace(comparison, data=data, designs=designs)
    return compare_models(comparison.data, model, catalogue, designs_beside(comparison, model, discrepancy or {}))


def designs_beside(
    comparison: Comparison, model: ErrorModel, discrepancy: Mapping[str, Discrepancy]
) -> dict[str, Design]:
    """Return the designs of a comparison with another model, and its discrepancy, as their base."""
    designs = {}
    for axis, design in comparison.designs.items():
        base, precision = base_of(comparison.data, model, axis)
        if axis in discrepancy:
            base = np.concatenate([base, discrepancy[axis].rows], axis=2)
            precision = np.concatenate([precision, discrepancy[axis].precision])
        designs[axis] = replace(design, base=base, precision=precision)
    return designs


def constant_coordinates(base: NDArray[np.float64], data: ReducedRecording) -> NDArray[np.float64] | None:
    """Return the coordinates of a constant, (R, m), where it lies in the span of the base; None where not."""
    constant = data.rows_of(np.ones((len(data.nodes), 1)))[:, :, 0]
    coordinates, *_ = np.linalg.lstsq(base[0], constant[0], rcond=1e-9)
    return constant if np.max(np.abs(base[0] @ coordinates - constant[0]), initial=0.0) < 1e-6 else None


def centred(option: CandidateShape, level: NDArray[np.float64] | None) -> CandidateShape:
    """Return an option without its constant part, where the base has that anyway.

    A supply of 5 V that wanders by millivolts would otherwise look like nothing but that constant.
    """
    if level is None:
        return option
    rows = option.rows - level[:, :, None] * option.rows[0].mean(axis=0)
    size, size_left = (np.linalg.norm(each, axis=(0, 1)) for each in (option.rows, rows))
    return replace(option, rows=np.where(size_left > ROUNDING * size, rows, 0.0))


def orthogonalised(option: CandidateShape, base: NDArray[np.float64]) -> CandidateShape:
    """Return a formula, or an option with `beside_base`, orthogonalised to the base (R, m, k); others unchanged.

    A formula is not centred on what was measured: all but a hundredth of `supply_v * table_rate_dps` is scale factor,
    and only that hundredth is of interest. A formula that lies in the span of the base stays as it is.
    """
    meant = option.beside_base or (option.term is not None and option.term.formula)
    if not meant or base.shape[2] == 0:
        return option
    coordinates, *_ = np.linalg.lstsq(base[0], option.rows[0], rcond=1e-9)
    rows = option.rows - base @ coordinates
    return (
        replace(option, rows=rows)
        if np.linalg.norm(rows) > MIN_ORTHOGONAL_SHARE * np.linalg.norm(option.rows)
        else option
    )


def compare_models(
    data: ReducedRecording,
    model: ErrorModel,
    catalogue: Mapping[str, Effect] = CATALOGUE,
    designs: Mapping[str, Design] | None = None,
) -> Comparison:
    """Compare every candidate with a model. `designs` may be those of an earlier call for the same model and data."""
    report_stage("preparing candidates")
    designs = designs or {axis: design_of(data, model, axis, catalogue) for axis in data.info.axes}
    axis_comparisons = {}
    for axis, design in designs.items():
        number = len({(option.candidate, option.smooth) for option in design.options})
        report_stage(f"comparing {number} candidates, axis {axis}")
        axis_comparisons[axis] = compare_axis(data, design, axis)
    axes = {axis: axis_comparison.evidence for axis, axis_comparison in axis_comparisons.items()}
    return Comparison(
        data, model, designs, axes,
        {axis: axis_comparison.white_var for axis, axis_comparison in axis_comparisons.items()},
        {axis: axis_comparison.scale for axis, axis_comparison in axis_comparisons.items()},
        rank_candidates(designs, axes, data.info.technology or ""),
    )  # fmt: skip


def on_axis(comparison: Comparison, axis: str) -> Comparison:
    """Return a comparison of one axis alone."""
    designs, axes = {axis: comparison.designs[axis]}, {axis: comparison.axes[axis]}
    return replace(
        comparison, designs=designs, axes=axes, white_var={axis: comparison.white_var[axis]},
        scales={axis: comparison.scales[axis]},
        candidates=rank_candidates(designs, axes, comparison.data.info.technology or ""),
    )  # fmt: skip


def with_noise_of(comparison: Comparison, fuller: Comparison) -> Comparison:
    """Return a comparison with the noise that a fuller model of the same data leaves.

    Beside a model that misses an effect, that effect looks like drift. The evidence for each candidate is unchanged.
    """
    axes = {}
    for axis, design in comparison.designs.items():
        axis_comparison, other = comparison.axes[axis], fuller.axes[axis]
        y = comparison.data.error_dps(axis)
        (eliminated,) = eliminate_base(design, y, fuller.white_var[axis], fuller.scales[axis], [other.best.noise])
        gain, dimensions = gains_of(eliminated, axis_comparison.slices)
        axes[axis] = replace(
            axis_comparison,
            best=eliminated,
            gain=gain,
            dimensions=dimensions,
            weights=other.weights,
            noises=other.noises,
        )
    return replace(comparison, axes=axes, white_var=fuller.white_var, scales=fuller.scales)
