"""A calibration in whole numbers: polynomials in the output, their coefficients tabulated over temperature.

The numbers here are those of the C code (`c_q31`), step by step and bit by bit, so that what is stated of the C code is
measured on them. Rates are Q31 of a full scale, temperatures Q16 (1/65536 K).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from labctl.compensator import MARGIN_C, output_limits_dps
from labctl.errors import BadInput
from labctl.exports.static_part import StaticPart, all_turning
from labctl.fitting.numeric.arrays import Array

Whole = NDArray[np.int64]
Q31, Q16, POSITION_BITS, RECIPROCAL_BITS = 31, 16, 24, 32
MAX_Q31 = 2**31 - 1
#: Highest order of the polynomials. The lowest order within TARGET_DEVIATION of the calibration is taken; the highest
#: has to be within MAX_DEVIATION, as does what several axes cause only together. Both are shares of the full scale.
MAX_ORDER, TARGET_DEVIATION, MAX_DEVIATION = 11, 2.0**-30, 2.0**-18
#: Coefficients of an axis may add up to this share of the full scale: no sum and no product leaves its 64 bits.
MAX_FILL = 0.99
#: Full scale where the calibration has no range of rates, deg/s.
UNLIMITED_DPS = 2048.0


@dataclass(frozen=True)
class FixedPoint:
    """Tables (axes, by axes, order + 1, nodes) in Q31 of full scale / 2^shift, and limits in Q31 and Q16."""

    tables: Whole
    full_scale_dps: float
    shift: int  #: the error's own full scale is the rates' over 2^shift
    low_q16: int
    high_q16: int
    inside_q16: tuple[int, int]
    outputs_q31: tuple[int, int]

    @property
    def reciprocal(self) -> int:
        """Steps of the table for each unit of temperature, times 2^56."""
        steps = (self.tables.shape[-1] - 1) << (POSITION_BITS + RECIPROCAL_BITS)
        return steps // (self.high_q16 - self.low_q16)

    def corrected(self, raw_q31: Whole, temperature_q16: Whole) -> tuple[Whole, NDArray[np.bool_]]:
        """Return corrected rates (n, axes) of outputs (n, axes) at temperatures (n,), and which were outside."""
        held = np.clip(raw_q31, *self.outputs_q31)
        outside = np.any(held != raw_q31, axis=1)
        outside |= (temperature_q16 < self.inside_q16[0]) | (temperature_q16 > self.inside_q16[1])
        above = np.clip(temperature_q16, self.low_q16, self.high_q16) - self.low_q16
        position = (above * self.reciprocal) >> RECIPROCAL_BITS
        node = np.minimum(position >> POSITION_BITS, self.tables.shape[-1] - 2)
        part = position - (node << POSITION_BITS)
        rate_q31 = np.empty_like(raw_q31)
        for axis in range(raw_q31.shape[1]):
            error = np.zeros(len(raw_q31), dtype=np.int64)
            for by in range(raw_q31.shape[1]):
                total = np.zeros_like(error)
                for row in self.tables[axis, by, ::-1]:
                    total = product(total, held[:, by], Q31)
                    total += row[node] + product(row[node + 1] - row[node], part, POSITION_BITS)
                error += total
            scaled = error if self.shift == 0 else (error + (1 << (self.shift - 1))) >> self.shift
            rate_q31[:, axis] = np.clip(raw_q31[:, axis] - scaled, -MAX_Q31 - 1, MAX_Q31)
        return rate_q31, outside

    def rate_dps(self, raw_dps: Array, temperature_c: Array) -> Array:
        """Return corrected rates, deg/s, through the whole numbers."""
        rate_q31, _ = self.corrected(self.as_q31(raw_dps), np.rint(temperature_c * 2.0**Q16).astype(np.int64))
        return np.asarray(rate_q31 * (self.full_scale_dps / 2.0**Q31), dtype=np.float64)

    def rounding_dps(self) -> float:
        """Return what rounding can add, deg/s: of outputs and rates to Q31, and of temperatures to 1/65536 K."""
        step_k = (self.high_q16 - self.low_q16) / 2.0**Q16 / (self.tables.shape[-1] - 1)
        steepest = np.abs(np.diff(self.tables, axis=-1)).max(axis=-1).sum(axis=(1, 2)).max() / step_k
        unit_dps = self.full_scale_dps / 2.0**Q31
        return float(steepest * unit_dps / 2**self.shift / 2 ** (Q16 + 1)) + 2 * unit_dps

    @property
    def steepest(self) -> float:
        """Upper bound of the change of an error per change of all outputs, deg/s per deg/s."""
        powers = np.arange(self.tables.shape[2])[None, None, :, None]
        return float((np.abs(self.tables) * powers).max(axis=-1).sum(axis=(1, 2)).max() / 2.0 ** (Q31 + self.shift))

    def as_q31(self, rate_dps: Array) -> Whole:
        """Return rates in Q31 of the full scale."""
        return np.clip(np.rint(rate_dps * (2.0**Q31 / self.full_scale_dps)), -(2.0**Q31), MAX_Q31).astype(np.int64)


def product(a: Whole, b: Whole, bits: int) -> Whole:
    """Return a b / 2^bits, rounded to nearest, halves up."""
    return (a * b + (1 << (bits - 1))) >> bits


def fixed_point(part: StaticPart, nodes: int, format_name: str) -> FixedPoint:
    """Return the tables of a calibration over `nodes` temperatures; raises BadInput for a law they cannot follow."""
    slowest, fastest = output_limits_dps(part.calibration) if part.has_rates else (-UNLIMITED_DPS, UNLIMITED_DPS)
    full_scale = 2.0 ** math.ceil(math.log2(max(abs(slowest), abs(fastest), 2.0**-10) * (1 + 2.0**-20)))
    low, high = part.calibration.temperature_c
    low_q16, high_q16 = math.floor(low * 2**Q16), max(math.ceil(high * 2**Q16), math.floor(low * 2**Q16) + 1)
    temperatures_c = np.linspace(low_q16, high_q16, nodes) / 2.0**Q16
    for order in range(MAX_ORDER + 1) if part.has_rates else (0,):
        coefficients, off = _polynomials(part, temperatures_c, (slowest, fastest), full_scale, order)
        if off <= TARGET_DEVIATION * full_scale:
            break
    if off > MAX_DEVIATION * full_scale:
        raise BadInput(
            f"format {format_name}: polynomials of order {MAX_ORDER} in the output differ from model "
            f"{part.calibration.fitted.model.name} by up to {off:.2g} deg/s; use format c or json"
        )
    if (joint := _of_several_axes(part)) > MAX_DEVIATION * full_scale:
        raise BadInput(
            f"format {format_name}: it adds up the errors that the output of each axis causes, and while several axes "
            f"turn model {part.calibration.fitted.model.name} differs from this sum by up to {joint:.2g} deg/s; use "
            "format c or json"
        )
    largest = float(np.abs(coefficients).max(axis=-1).sum(axis=(1, 2)).max())
    room = MAX_FILL * full_scale
    shift = max(0, math.floor(math.log2(room / max(largest, full_scale * 2.0**-20))))
    if largest > room:
        raise BadInput(
            f"format {format_name}: the coefficients of {part.calibration.serial} add up to {largest:.3g} "
            f"deg/s, more than the full scale of the format, {room:.3g} deg/s; use format c or json"
        )
    tables = np.rint(coefficients * (2.0 ** (Q31 + shift) / full_scale)).astype(np.int64)
    inside = (math.floor((low - MARGIN_C) * 2**Q16), math.ceil((high + MARGIN_C) * 2**Q16))
    limits = (math.floor(slowest / full_scale * 2**Q31), math.ceil(fastest / full_scale * 2**Q31))
    return FixedPoint(tables, full_scale, shift, low_q16, high_q16, inside, limits)


def _of_several_axes(part: StaticPart) -> float:
    """Return the largest difference of the error from the sum of the errors by each output alone, deg/s."""
    raw, temperature_c = all_turning(part)
    apart = raw - part.rate(raw, temperature_c)
    still = -part.rate(np.zeros_like(raw), temperature_c)
    for by in range(raw.shape[1]):
        alone = np.zeros_like(raw)
        alone[:, by] = raw[:, by]
        apart = apart - (alone - part.rate(alone, temperature_c) - still)
    return float(np.abs(apart - still).max())


def _polynomials(
    part: StaticPart, temperature_c: Array, limits: tuple[float, float], full_scale: float, order: int
) -> tuple[NDArray[np.float64], float]:
    """Return coefficients (axes, by, order + 1, nodes), deg/s, of powers of output / full scale, and how far off."""
    axes, nodes, middle, half = len(part.axes), len(temperature_c), sum(limits) / 2, (limits[1] - limits[0]) / 2
    m = max(2 * order, 1) + 4
    at = np.cos(np.pi * (np.arange(m) + 0.5) / m) if part.has_rates else np.zeros(1)
    still = -part.rate(np.zeros((nodes, axes)), temperature_c)
    polynomials = np.zeros((axes, axes, order + 1, nodes))
    off = 0.0
    scale = full_scale / half if part.has_rates else 1.0
    for by in range(axes):
        raw = np.zeros((len(at) * nodes, axes))
        raw[:, by] = np.repeat(middle + half * at, nodes) if part.has_rates else 0.0
        error = (raw - part.rate(raw, np.tile(temperature_c, len(at)))).reshape(len(at), nodes, axes)
        for axis in range(axes):
            values = error[:, :, axis] - (0.0 if axis == by else still[:, axis])
            series = chebyshev.chebfit(at, values, order)
            off = max(off, float(np.abs(chebyshev.chebval(at, series).T - values).max()))
            for node in range(nodes):
                powers = np.polynomial.Polynomial(chebyshev.cheb2poly(series[:, node]))
                moved = powers(np.polynomial.Polynomial([-middle / half, scale]))
                polynomials[axis, by, : len(moved.coef), node] = moved.coef
    return polynomials, off
