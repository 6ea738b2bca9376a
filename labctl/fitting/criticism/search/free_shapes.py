"""Free shapes: polynomials over rate and temperature, whose evidence an effect must reach before it is named.

Some shape of the catalogue follows any law to some degree, but to name an effect is to claim that the shape is this
one. So the effects to be named, with their discrepancy, are compared with polynomials over rate and temperature that
have no physical meaning.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.polynomial.legendre import legvander
from numpy.typing import NDArray

from labctl.fitting.criticism.candidate_shape import CandidateShape
from labctl.fitting.criticism.candidates import option_of
from labctl.fitting.criticism.channel_functions import smooth_channels
from labctl.fitting.criticism.evidence.bayes_factors import AxisEvidence, evidence_of
from labctl.fitting.criticism.evidence.design import Design, Discrepancy
from labctl.fitting.criticism.model_comparison import (
    Comparison,
    centred,
    compare_models,
    constant_coordinates,
    designs_beside,
    orthogonalised,
)
from labctl.fitting.criticism.rivals import LEAD
from labctl.fitting.effects import Effect, Term
from labctl.fitting.models.error_model import ErrorModel
from labctl.progress import report_stage

#: Degrees of a polynomial of the rate, and total degrees of one over rate and temperature.
OF_RATE, OF_BOTH = (5, 7), (5, 8)
#: Free shapes may have this share more evidence than the named effects: no shape is exact, and the remainder is
#: reported beside the names. For laws outside the catalogue they had more than twice the evidence of any named effect.
SHARE_LEFT = 0.1
RATE, TEMPERATURE = "table_rate_dps", "temperature_c"


def channels_of_free_shape(
    first: Comparison, beside: Comparison, terms: tuple[Term, ...], catalogue: Mapping[str, Effect], least: float = 0.0
) -> tuple[str, ...]:
    """Return the channels of a polynomial that has clearly more evidence than terms and their discrepancy; () if none.

    The polynomial must also have at least the evidence `least`. `first` is the comparison without the terms, `beside`
    the one with them and their discrepancy in its base, at whose scatter all are weighed. Terms that are exact need no
    discrepancy.
    """
    report_stage(f"comparing {', '.join(term.effect for term in terms) or 'channels'} with free shapes")
    model = with_steady(first, terms)
    named: float = 0.0
    free: dict[tuple[str, ...], float] = {}
    for axis, exact in designs_beside(first, model, {}).items():
        rivals = _shapes(first, axis)
        options = [shape for shapes in rivals.values() for shape in shapes]
        first_options = _named(first, axis, terms, catalogue)
        log_bf_by_shape = _weighed(
            first, beside, axis, replace(first.designs[axis], options=[*options, *first_options])
        ).log_bf
        for channels, shapes in rivals.items():
            log_bf_free, log_bf_by_shape = log_bf_by_shape[: len(shapes)], log_bf_by_shape[len(shapes) :]
            free[channels] = free.get(channels, 0.0) + float(log_bf_free.max(initial=0.0))
        wrong_by = beside.axes[axis].log_p - _weighed(first, beside, axis, replace(exact, options=[])).log_p
        named += float(log_bf_by_shape.max(initial=0.0)) + max(wrong_by, 0.0)
    best = max(free, key=lambda channels: free[channels], default=())
    return best if best and free[best] > max((1 + SHARE_LEFT) * named, least) + LEAD else ()


def channels_beside_smooth(first: Comparison, catalogue: Mapping[str, Effect]) -> tuple[str, ...]:
    """Return the channels of a polynomial that has clearly more evidence than every function of one channel."""
    smooth = first.leader(smooth=True)
    return channels_of_free_shape(first, first, (), catalogue, least=smooth.log_bf if smooth is not None else 0.0)


def with_steady(first: Comparison, terms: tuple[Term, ...]) -> ErrorModel:
    """Return the model of a comparison with more terms, each of one coefficient for all temperatures."""
    return first.model.with_added(terms)


def beside_terms(first: Comparison, terms: tuple[Term, ...], discrepancy: Mapping[str, Discrepancy]) -> Comparison:
    """Return the comparison beside terms and their discrepancy, in which nothing competes."""
    model = with_steady(first, terms)
    designs = designs_beside(first, model, discrepancy)
    return compare_models(
        first.data, model, {}, {axis: replace(design, options=[]) for axis, design in designs.items()}
    )


def _shapes(comparison: Comparison, axis: str) -> dict[tuple[str, ...], list[CandidateShape]]:
    """Return channels -> polynomials of them, for one axis."""
    data = comparison.data
    channels = smooth_channels(data, axis)
    if RATE not in channels:
        return {}
    rate = channels[RATE] / max(float(np.abs(channels[RATE]).max()), 1e-9)
    of_rate = np.asarray(legvander(rate, max(OF_BOTH)), dtype=np.float64)
    shapes: dict[tuple[str, ...], list[CandidateShape]] = {
        (RATE,): [_shape(comparison, RATE, of_rate[:, 1 : degree + 1]) for degree in OF_RATE]
    }
    if TEMPERATURE in channels:
        temperature_c = channels[TEMPERATURE]
        of_warm = legvander(2 * (temperature_c - temperature_c.min()) / np.ptp(temperature_c) - 1, max(OF_BOTH)).astype(
            np.float64
        )
        shapes[RATE, TEMPERATURE] = [_shape(comparison, RATE, _products(of_rate, of_warm, d)) for d in OF_BOTH]
    return shapes


def _products(first: NDArray[np.float64], other: NDArray[np.float64], degree: int) -> NDArray[np.float64]:
    """Return the products of polynomials up to a total degree."""
    return np.column_stack(
        [first[:, i] * other[:, j] for i in range(degree + 1) for j in range(degree + 1 - i) if i + j > 0]
    )


def _shape(comparison: Comparison, name: str, columns: NDArray[np.float64]) -> CandidateShape:
    count = columns.shape[1]
    return CandidateShape(name, None, comparison.data.rows_of(columns), ("",) * count, ("deg/s",) * count)


def _named(
    comparison: Comparison, axis: str, terms: tuple[Term, ...], catalogue: Mapping[str, Effect]
) -> list[CandidateShape]:
    """Return what is to be named on one axis as one option; none where it does not touch the axis."""
    pair_options = (
        option_of(comparison.data, axis, comparison.model.reference, catalogue[term.effect], term) for term in terms
    )
    base, precision = comparison.designs[axis].base, comparison.designs[axis].precision
    level = constant_coordinates(base, comparison.data)
    exact = base[:, :, precision == 0]
    options = [orthogonalised(centred(option, level), exact) for option in pair_options if option is not None]
    if not options:
        return []
    rows = np.concatenate([option.rows for option in options], axis=2)
    names, units = (sum(each, ()) for each in ([o.names for o in options], [o.units for o in options]))
    return [CandidateShape(RATE, None, rows, names, units)]


def _weighed(first: Comparison, beside: Comparison, axis: str, design: Design) -> AxisEvidence:
    """Return the evidence of a design at the scatter of another comparison."""
    white, scale, noises = beside.white_var[axis], beside.scales[axis], beside.axes[axis].noises
    return evidence_of(design, first.data.error_dps(axis), white, scale, noises)
