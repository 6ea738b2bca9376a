"""How far the C code's rounding can take a corrected rate from the calibration, before any is measured.

First-order error analysis (Higham, Accuracy and Stability of Numerical Algorithms, 2002, chapters 3, 5 and 9) of each
form at its largest output and over its temperatures: inputs and constants rounded to the precision, then every sum and
product. What is evaluated in double throughout is rounded at both ends alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labctl.calibration import Calibration
from labctl.compensator import output_limits_dps
from labctl.exports.c_code.nodes import temperature_nodes
from labctl.exports.static_part import CORNERS, SLOPE_STEP_DPS, StaticPart, all_turning
from labctl.fitting.models.correction import correction
from labctl.fitting.models.force_sensitivity import ForceSensitivity
from labctl.fitting.models.matrix_form import Linear
from labctl.fitting.models.memory import Memory, split_memory
from labctl.fitting.models.polynomial_surface import Surface, surface_of
from labctl.fitting.models.sine_form import sine_form_of
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.rounding import at_most

#: Unit roundoff of the two precisions.
DOUBLE, SINGLE = 2.0**-53, 2.0**-24
#: Roundings of sums and products on the way through a linear system of three axes, and of a temperature and its nodes.
SOLVING, WARMTH = 12, 4
#: Lebesgue constants of equidistant nodes, by their number: what rounded weights can add up to.
LEBESGUE = {1: 1.0, 2: 1.0, 3: 1.25, 6: 3.11}
#: The sine response is computed in double; there output and result alone are rounded.
ENDS = 2
#: Share for what is beyond first order.
BEYOND = 1.05
#: Without a range the bound is stated for these, deg/s and deg C; forces up to this, g.
UNLIMITED_DPS, UNLIMITED_C, MAX_G = 2048.0, 100.0, 128.0
#: Series of the sine near 0, as a share of the rate.
SERIES = 1e-14


@dataclass(frozen=True)
class Range:
    """The largest output, deg/s, and the temperatures (n,), deg C, over which a bound is stated."""

    output_dps: float
    temperature_c: Array

    @property
    def hottest(self) -> float:
        """The largest size of a temperature, deg C."""
        return float(np.abs(self.temperature_c).max())


def range_of(calibration: Calibration) -> Range:
    """Return the range of a calibration, with the margin that counts as inside."""
    fastest = float(np.abs(output_limits_dps(calibration)).max())
    low, high = calibration.temperature_c
    if not np.isfinite(high - low):
        low, high = -UNLIMITED_C, UNLIMITED_C
    return Range(fastest if np.isfinite(fastest) else UNLIMITED_DPS, np.linspace(low, high, 649))


def rounding_dps(calibration: Calibration, roundoff: float) -> float:
    """Return the bound of a header's corrected rate, deg/s, computed with a unit roundoff; with forces to `MAX_G`."""
    fitted, memory = split_memory(calibration.fitted, calibration.axes)
    over = range_of(calibration)
    surface = surface_of(fitted, calibration.axes)
    if surface is not None:
        roundoff_dps, gain = _of_surface(surface, over, roundoff)
    else:
        law = correction(fitted, calibration.axes)
        part = StaticPart(calibration, lambda raw, temperature_c: law(raw, temperature_c, {}), memory)
        sine = sine_form_of(fitted, calibration.axes)
        roundoff_dps, gain = _of_solution(part, over, roundoff, _roundings(calibration, is_sine=sine is not None))
    before = _of_memory(memory, over, roundoff) + _of_force(calibration.force_sensitivity, over, roundoff)
    whole = BEYOND * (roundoff_dps + gain * before)
    # the calibration is itself evaluated in double, and so is part of the code in any precision
    return whole + (rounding_dps(calibration, DOUBLE) if roundoff > DOUBLE else whole)


def rounding_line(calibration: Calibration) -> str:
    """Return the bounds as a sentence of a header: in which range, and in both precisions."""
    over = range_of(calibration)
    double, single = (at_most(rounding_dps(calibration, roundoff)) for roundoff in (DOUBLE, SINGLE))
    return (
        f"Rounding takes a rate at most {double:.3g} deg/s from the calibration in double, {single:.3g} deg/s in "
        f"single precision, inputs rounded to it too; outputs up to {over.output_dps:g} deg/s"
    )


def _roundings(calibration: Calibration, *, is_sine: bool) -> tuple[float, float]:
    """Return how many roundings an output goes through in the header's own precision, and in double."""
    fitted, _ = split_memory(calibration.fitted, calibration.axes)
    sine = sine_form_of(fitted, calibration.axes)
    _, points = temperature_nodes(sine.linear if sine is not None else Linear(fitted, calibration.axes),
                                  calibration.temperature_c)  # fmt: skip
    solving = SOLVING + (3 * points - 2) * LEBESGUE[points]
    return (ENDS, solving) if is_sine else (solving, solving)


def _of_surface(surface: Surface, over: Range, roundoff: float) -> tuple[float, float]:
    """Return the bound of Horner's scheme in temperature, then in the output, and the largest slope of rate."""
    c = np.abs(surface.coefficients)
    i, j = np.arange(c.shape[1])[:, None], np.arange(c.shape[2])[None, :]
    w, u = over.output_dps, float(np.abs(over.temperature_c - surface.reference_c).max())
    terms = c * w**i * u**j
    by_output = (terms * i).sum(axis=(1, 2))
    by_warmth = (c * w**i * j * u ** np.maximum(j - 1, 0)).sum(axis=(1, 2))
    moved_c = over.hottest + abs(surface.reference_c) + u
    operations = 2 * (c.shape[1] + c.shape[2])
    off = operations * terms.sum(axis=(1, 2)) + by_output + by_warmth * moved_c + 2 * w
    return float(roundoff * off.max()), float(1 + (by_output / w).max())


def _of_solution(part: StaticPart, over: Range, roundoff: float, roundings: tuple[float, float]) -> tuple[float, float]:
    """Return the bound of a law that is solved for the rate, and the largest slope of a rate along all outputs.

    Rounding acts as if the output were off by as many roundoffs of its largest size as there are roundings, and the
    temperature by some roundoffs of its own.
    """
    raw, temperature_c = _corners(part, over)
    rate = part.rate(raw, temperature_c)
    gain = np.zeros(rate.shape)
    for by in range(raw.shape[1]):
        moved = raw.copy()
        moved[:, by] -= np.copysign(SLOPE_STEP_DPS, raw[:, by])
        gain += np.abs(part.rate(moved, temperature_c) - rate) / SLOPE_STEP_DPS
    largest, size = float(gain.max()), over.output_dps + float(np.abs(raw - rate).max())
    step_k = max(float(np.ptp(over.temperature_c)) / (len(over.temperature_c) - 1), 1e-9)
    slope = len(part.axes) * float(np.abs(np.diff(_by_temperature(part, over), axis=1)).max()) / step_k
    count = roundings[0] if roundoff > DOUBLE else roundings[1]
    return roundoff * (count * size * largest + WARMTH * over.hottest * slope) + SERIES * size, largest


def _corners(part: StaticPart, over: Range) -> tuple[Array, Array]:
    """Return all axes turning at once, (n, axes), also without a range of rates or a thermometer."""
    if part.has_rates and np.isfinite(part.calibration.temperature_c).all():
        return all_turning(part)
    ends = np.linspace(-over.output_dps, over.output_dps, CORNERS)
    raw = np.array(np.meshgrid(*[ends] * len(part.axes))).reshape(len(part.axes), -1).T
    return raw, np.full(len(raw), float(over.temperature_c.mean()))


def _by_temperature(part: StaticPart, over: Range) -> NDArray[np.float64]:
    """Return the rates of the fastest outputs over the temperatures, (2, n, axes)."""
    shape = (len(over.temperature_c), len(part.axes))
    ends = [part.rate(np.full(shape, sign * over.output_dps), over.temperature_c) for sign in (-1.0, 1.0)]
    return np.stack(ends)


def _of_memory(memory: Memory | None, over: Range, roundoff: float) -> float:
    """Return what a rounded temperature does to the followers, all of them together, deg/s."""
    largest_dps = 0.0
    for each in memory.followers if memory is not None else ():
        size = float(np.abs(each.size).max())
        if each.scale is not None:
            size += float(np.abs(each.scale).max()) * over.output_dps
        per_k = size if each.kind == "lag" else size / (each.parameter / 2)
        if each.bow is not None:
            per_k += 4 * size / max(each.bow[1] - each.bow[0], 1e-9)
        largest_dps += per_k * (2 * over.hottest * roundoff + 20 * DOUBLE * float(np.ptp(over.temperature_c)))
    return largest_dps + roundoff * over.output_dps * bool(largest_dps)


def _of_force(force: ForceSensitivity | None, over: Range, roundoff: float) -> float:
    if force is None:
        return 0.0
    largest = np.abs(force.known_per_g).sum(axis=1) * MAX_G + np.abs(force.known_per_g2) * MAX_G**2
    return float(roundoff * (8 * largest.max() + over.output_dps))
