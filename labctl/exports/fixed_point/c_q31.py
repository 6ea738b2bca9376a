"""A calibration as a C99 header for processors without floating point: whole numbers alone, Q31."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from labctl.calibration import Calibration
from labctl.exports.c_header import GUARD_DIGITS, c_name
from labctl.exports.comments import head_lines
from labctl.exports.fixed_point.force import FixedForce, fixed_force
from labctl.exports.fixed_point.whole_numbers import POSITION_BITS, RECIPROCAL_BITS, FixedPoint, fixed_point
from labctl.exports.format import Format, Written
from labctl.exports.options import whole_number
from labctl.exports.static_part import TEMPERATURES, StaticPart, all_turning, needs_thermometer, static_part
from labctl.fitting.numeric.arrays import Array

NAME = "c-q31"
NODES, MAX_NODES = 65, 1025
#: Outputs of each axis at which the difference from the calibration is looked for.
OUTPUTS = 25

SOURCE = """/* {head}
 * Input: outputs of the gyro as rates in Q31 of {full_scale:.17g} deg/s, so that 2^31 would be {full_scale:.17g} deg/s;
 * temperature in 1/65536 deg C. Result: rates in Q31 of the same full scale; the function returns 1 outside the
 * calibrated range, where the error at its edge is taken off, else 0. Whole numbers of 32 and 64 bits alone; right
 * shifts of negative numbers have to be arithmetic, which is checked when it is compiled. */
#ifndef {guard}
#define {guard}

#include <stdint.h>

#define {name}_Q31_AXES {axes}
#define {name}_Q31_NODES {nodes}
#define {name}_Q31_FULL_SCALE_DPS {full_scale:.17g}
typedef char {name}_q31_shifts_are_arithmetic[((int64_t)-1 >> 1) == (int64_t)-1 ? 1 : -1];
static const char {name}_q31_hash[] = "{hash}";
/* error = sum over by and i of c[axis][by][i][temperature] output[by]^i, Q31 of full scale / 2^{shift} */
static const int32_t {name}_q31_c[{axes}][{axes}][{terms}][{nodes}] = {table};

static inline int64_t {name}_q31_product(int64_t a, int64_t b, int bits)
{{
    return (a * b + ((int64_t)1 << (bits - 1))) >> bits;
}}

static inline int {name}_q31_correct(const int32_t *w, int32_t temperature_q16, int32_t *rate)
{{
    int64_t held[{axes}], position, part, t = temperature_q16;
    int outside = t < {coldest} || t > {warmest}, a, by, i, node;
    for (a = 0; a < {axes}; a++) {{
        held[a] = w[a] < {slowest} ? {slowest} : w[a] > {fastest} ? {fastest} : w[a];
        if (held[a] != w[a]) outside = 1;
    }}
    t = t < {low} ? {low} : t > {high} ? {high} : t;
    position = ((t - ({low})) * INT64_C({reciprocal})) >> {reciprocal_bits};
    node = (int)(position >> {position_bits});
    if (node > {nodes} - 2) node = {nodes} - 2;
    part = position - ((int64_t)node << {position_bits});
    for (a = 0; a < {axes}; a++) {{
        int64_t error = 0;
        for (by = 0; by < {axes}; by++) {{
            int64_t total = 0;
            for (i = {terms} - 1; i >= 0; i--) {{
                const int32_t *c = {name}_q31_c[a][by][i] + node;
                total = {name}_q31_product(total, held[by], 31);
                total += c[0] + {name}_q31_product((int64_t)c[1] - c[0], part, {position_bits});
            }}
            error += total;
        }}
        error = w[a] - {rounded};
        rate[a] = (int32_t)(error < INT32_MIN ? INT32_MIN : error > INT32_MAX ? INT32_MAX : error);
    }}
    return outside;
}}
{force}
#endif
"""


def write(calibration: Calibration, options: Mapping[str, str]) -> Written:
    """Return the header; raises BadInput for a model that depends on more than output and temperature."""
    needs_thermometer(
        calibration, NAME, "the error of this calibration is the same at every temperature; use format c or json"
    )
    part = static_part(calibration, NAME, carries="the table of this format depends on output and temperature only")
    nodes = whole_number(options, "temperatures", (2, MAX_NODES), NODES, NAME)
    fixed = fixed_point(part, nodes, NAME)
    force = None
    if calibration.force_sensitivity is not None:
        is_direct = calibration.fitted.model.argument == "output"
        force = fixed_force(fixed, calibration.force_sensitivity, NAME, is_direct=is_direct)
    differs = largest_difference(part, fixed) + (force.rounding_dps() if force is not None else 0.0)
    losses = part.memory_losses()
    bytes_ = 4 * fixed.tables.size
    head = head_lines(calibration, f"the whole correction of output and temperature, in {bytes_} bytes of tables",
                      differs, losses)  # fmt: skip
    return Written(_source(calibration, fixed, force, head).encode("ascii"), losses, differs)


def largest_difference(part: StaticPart, fixed: FixedPoint) -> float:
    """Return the largest difference from the calibration, deg/s: one axis at a time, summed, and all axes at once."""
    axes = len(part.axes)
    temperatures_c = part.temperatures(1 + 4 * (TEMPERATURES - 1))
    nodes = fixed.tables.shape[-1]
    between = np.clip(
        np.linspace(fixed.low_q16, fixed.high_q16, 2 * nodes - 1) / 2.0**16, *part.calibration.temperature_c
    )
    temperatures_c = part.with_kinks(np.union1d(temperatures_c, between))
    apart = np.zeros((axes, axes))
    outputs = part.outputs(OUTPUTS)
    still = np.zeros((len(temperatures_c), axes))
    at_zero = np.abs(_apart(part, fixed, still, temperatures_c)).max(axis=0)
    for by in range(axes):
        raw = np.zeros((len(outputs) * len(temperatures_c), axes))
        raw[:, by] = np.repeat(outputs, len(temperatures_c))
        apart[:, by] = np.abs(_apart(part, fixed, raw, np.tile(temperatures_c, len(outputs)))).max(axis=0)
    largest = float((apart.sum(axis=1) + at_zero * (axes > 1)).max())
    largest = max(largest, float(np.abs(_apart(part, fixed, *all_turning(part))).max()))
    return largest + fixed.rounding_dps()


def _apart(part: StaticPart, fixed: FixedPoint, raw: Array, temperature_c: Array) -> Array:
    return fixed.rate_dps(raw, temperature_c) - part.rate(raw, temperature_c)


def _source(calibration: Calibration, fixed: FixedPoint, force: FixedForce | None, head: list[str]) -> str:
    name = c_name(calibration.serial)
    axes, _, terms, nodes = fixed.tables.shape
    shift = fixed.shift
    return SOURCE.format(
        head="\n * ".join(line.replace("*/", "* /").replace("\\", "/") for line in head),
        name=name, axes=axes, terms=terms, nodes=nodes, shift=shift, hash=calibration.calibration_hash,
        guard=f"LABCTL_{name}_Q31_V{calibration.version}_{calibration.calibration_hash[:GUARD_DIGITS]}_H",
        full_scale=fixed.full_scale_dps, table=_table(fixed.tables.tolist()),
        low=fixed.low_q16, high=fixed.high_q16, coldest=fixed.inside_q16[0], warmest=fixed.inside_q16[1],
        slowest=fixed.outputs_q31[0], fastest=fixed.outputs_q31[1], reciprocal=fixed.reciprocal,
        reciprocal_bits=RECIPROCAL_BITS, position_bits=POSITION_BITS,
        force="" if force is None else force.source(name),
        rounded="error" if shift == 0 else f"((error + INT64_C({1 << (shift - 1)})) >> {shift})",
    )  # fmt: skip


def _table(values: object) -> str:
    if not isinstance(values, list):
        return str(values)
    between = ",\n " if isinstance(values[0], list) else ", "
    return "{" + between.join(_table(value) for value in values) + "}"


FORMAT = Format(
    "C header, Q31",
    "text/x-c",
    "h",
    write,
    {"temperatures": f"nodes of the table over temperature, 2 to {MAX_NODES}; default {NODES}"},
)
