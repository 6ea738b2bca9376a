"""g-sensitivity in whole numbers: coefficients in Q31 of a share of the full scale for each g, forces in 1/65536 g.

As in `whole_numbers`, the numbers are those of the C code, bit by bit.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labctl.errors import BadInput
from labctl.exports.fixed_point.whole_numbers import MAX_Q31, Q16, Q31, FixedPoint, Whole, product
from labctl.exports.force_text import size_line
from labctl.fitting.data.channels import BODY_AXES
from labctl.fitting.models.force_sensitivity import ForceSensitivity

#: Forces up to this are taken, g: no sum and no product leaves its 64 bits.
MAX_G = 128
#: Bits by which a coefficient is finer than the rates, at most.
MAX_SHIFT = 24

SOURCE = """
/* {head}.
 * f: specific force in 1/65536 g along body axes x, y, z, +1 g along an axis that points up at rest; beyond {most} g
 * the function returns 1. Coefficients in Q31 of full scale / 2^{shift} for each g, and for each g^2. */
static const int32_t {name}_q31_per_g[{axes}][3] = {per_g};
static const int32_t {name}_q31_per_g2[{axes}] = {per_g2};
static const int {name}_q31_own_axis[{axes}] = {own};

static inline int {name}_q31_correct_with_force(
    const int32_t *w, int32_t temperature_q16, const int32_t *f, int32_t *rate)
{{
    int32_t left[{axes}];
    int64_t held[3];
    int outside = 0, a, b;
    for (b = 0; b < 3; b++) {{
        held[b] = f[b] < -{most_q16} ? -{most_q16} : f[b] > {most_q16} ? {most_q16} : f[b];
        if (held[b] != f[b]) outside = 1;
    }}
    for (a = 0; a < {axes}; a++) {{
        int64_t own = held[{name}_q31_own_axis[a]];
        int64_t error = {name}_q31_product(own, own, 16) * {name}_q31_per_g2[a];
        for (b = 0; b < 3; b++) error += held[b] * {name}_q31_per_g[a][b];
        error = w[a] - {name}_q31_product(error, 1, {bits});
        left[a] = (int32_t)(error < INT32_MIN ? INT32_MIN : error > INT32_MAX ? INT32_MAX : error);
        if (left[a] != error) outside = 1;
    }}
    return {name}_q31_correct(left, temperature_q16, rate) || outside;
}}
"""
#: The same for a direct law, whose error is taken off the corrected rate.
AFTER = (
    ("    int32_t left[{axes}];\n", ""),
    (
        "int outside = 0, a, b;\n",
        "int outside = {name}_q31_correct(w, temperature_q16, rate), a, b;\n",
    ),
    ("error = w[a] - ", "error = rate[a] - "),
    ("left[a]", "rate[a]"),
    ("    return {name}_q31_correct(left, temperature_q16, rate) || outside;\n", "    return outside;\n"),
)


@dataclass(frozen=True)
class FixedForce:
    """Coefficients (axes, 3) and (axes,) in Q31 of full scale / 2^shift for each g, and for each g^2."""

    fixed: FixedPoint
    force: ForceSensitivity
    per_g: Whole
    per_g2: Whole
    shift: int
    is_direct: bool

    def corrected(self, raw_q31: Whole, temperature_q16: Whole, force_q16: Whole) -> tuple[Whole, NDArray[np.bool_]]:
        """Return corrected rates (n, axes) of outputs (n, axes) at temperatures (n,) and forces (n, 3), and outside."""
        held = np.clip(force_q16, -MAX_G << Q16, MAX_G << Q16)
        along_axes = held[:, [BODY_AXES.index(axis) for axis in self.force.axes]]
        error = product(
            held @ self.per_g.T + product(along_axes, along_axes, Q16) * self.per_g2,
            np.ones(1, dtype=np.int64),
            Q16 + self.shift,
        )
        rate, outside = self.fixed.corrected(raw_q31, temperature_q16) if self.is_direct else (raw_q31, None)
        limited = np.clip(rate - error, -MAX_Q31 - 1, MAX_Q31)
        beyond = np.any(held != force_q16, axis=1) | np.any(limited != rate - error, axis=1)
        if outside is not None:
            return limited, outside | beyond
        turning_q31, outside = self.fixed.corrected(limited, temperature_q16)
        return turning_q31, outside | beyond

    def rounding_dps(self) -> float:
        """Return what rounding can add, deg/s, at forces up to `MAX_G`: of forces, squares, coefficients and sums.

        Half a unit each, and what the correction of the output makes of it.
        """
        lsb_dps = self.fixed.full_scale_dps / 2.0**Q31
        linear, square = np.abs(self.force.known_per_g).sum(axis=1), np.abs(self.force.known_per_g2)
        of_force = 2.0 ** -(Q16 + 1) * (linear + square * (2 * MAX_G + 1))
        most = 3 * MAX_G * (linear > 0) + MAX_G**2 * (square > 0)
        added = of_force + most * lsb_dps * 2.0 ** -(self.shift + 1) + lsb_dps / 2
        gain = 1.0 if self.is_direct else 1.0 + self.fixed.steepest
        return float(gain * added.max())

    def source(self, name: str) -> str:
        """Return the C code behind that of the rates."""
        text = SOURCE
        for before, after in AFTER if self.is_direct else ():
            text = text.replace(before, after)
        return text.format(
            name=name, axes=len(self.per_g), most=MAX_G, most_q16=MAX_G << Q16, shift=self.shift,
            bits=Q16 + self.shift, head=size_line(self.force, f"{name}_q31_correct_with_force"),
            per_g="{" + ", ".join(_row(row) for row in self.per_g.tolist()) + "}", per_g2=_row(self.per_g2.tolist()),
            own=_row([BODY_AXES.index(axis) for axis in self.force.axes]),
        )  # fmt: skip


def fixed_force(fixed: FixedPoint, force: ForceSensitivity, format_name: str, *, is_direct: bool) -> FixedForce:
    """Return the coefficients of a calibration whose rates are `fixed`, as fine as 32 bits hold them.

    Raises BadInput for coefficients beyond the full scale.
    """
    per_g, per_g2 = force.known_per_g, force.known_per_g2
    largest = max(float(np.abs(per_g).max()), float(np.abs(per_g2).max()), fixed.full_scale_dps * 2.0**-MAX_SHIFT)
    shift = min(MAX_SHIFT, math.floor(math.log2(fixed.full_scale_dps / largest * (1 - 2.0**-20))))
    if shift < 0:
        raise BadInput(
            f"format {format_name}: a g-sensitivity of {largest:.3g} deg/s/g is more than the full scale of "
            f"{fixed.full_scale_dps:g} deg/s; use c or json"
        )
    scale = 2.0 ** (Q31 + shift) / fixed.full_scale_dps
    whole, whole2 = (np.rint(values * scale).astype(np.int64) for values in (per_g, per_g2))
    return FixedForce(fixed, force, whole, whole2, shift, is_direct)


def _row(values: list[int]) -> str:
    return "{" + ", ".join(str(value) for value in values) + "}"
