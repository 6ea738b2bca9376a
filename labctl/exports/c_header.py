"""A calibration as a C99 header: constants, and the evaluation to compile with them."""

from __future__ import annotations

import math
import string

from labctl.calibration import Calibration
from labctl.compensator import MARGIN_C, output_limits_dps
from labctl.errors import BadInput
from labctl.exports.c_code.lag_and_hysteresis import memory_body
from labctl.exports.c_code.nodes import temperature_nodes
from labctl.exports.c_code.orientation import orientation_body
from labctl.exports.c_code.rounding_error import rounding_line
from labctl.exports.c_code.sine import sine_body
from labctl.exports.c_code.tables import c_table
from labctl.exports.comments import configuration_lines
from labctl.exports.force_text import size_line, unmeasured_line
from labctl.exports.format import Format
from labctl.exports.uncertainty_bound import bound_constant, bound_lines
from labctl.fitting.data.channels import BODY_AXES
from labctl.fitting.models.force_sensitivity import ForceSensitivity
from labctl.fitting.models.matrix_form import LINEAR as LINEAR_EFFECTS
from labctl.fitting.models.matrix_form import Linear, linear_of
from labctl.fitting.models.memory import split_memory
from labctl.fitting.models.polynomial_surface import Surface, surface_of
from labctl.fitting.models.sine_form import SINE, sine_form_of

BODY = """
/* g-sensitivity, largest error of each axis at 1 g: {name}_at_1_g_dps. {name}_correct{step} does not
 * correct it; {name}_correct_with_force{with_step} does. f: specific force in g along body axes x, y, z, +1
 * along an axis that points up at rest. error = sum of per_g[a][b] f[b] + per_g2[a] f[own axis]^2, deg/s. Measured at
 * 1 g, taken as proportional beyond.{unmeasured} A force that is not finite gives no number, and 1. */
static const double {name}_at_1_g_dps[{name}_AXES] = {at_1_g};
static const double {name}_dps_per_g[{name}_AXES][3] = {per_g};
static const double {name}_dps_per_g2[{name}_AXES] = {per_g2};
static const int {name}_own_axis[{name}_AXES] = {own};

static inline void {name}_by_force(const LABCTL_REAL *f, LABCTL_REAL *error)
{{
    int a, b, known = isfinite((double)f[0]) && isfinite((double)f[1]) && isfinite((double)f[2]);
    for (a = 0; a < {name}_AXES; a++) {{
        LABCTL_REAL own = f[{name}_own_axis[a]];
        error[a] = (LABCTL_REAL){name}_dps_per_g2[a] * own * own;
        for (b = 0; b < 3; b++) error[a] += (LABCTL_REAL){name}_dps_per_g[a][b] * f[b];
        if (!known) error[a] = (LABCTL_REAL)NAN;
    }}
}}
"""
FUNCTION = """
static inline int {name}_{function}_with_force(
    {state}const LABCTL_REAL *w, LABCTL_REAL temperature_c, {time}const LABCTL_REAL *f, LABCTL_REAL *rate)
{{
    LABCTL_REAL error[{name}_AXES], left[{name}_AXES];
    int a, outside;
    {name}_by_force(f, error);
    for (a = 0; a < {name}_AXES; a++) left[a] = {left};
    outside = {name}_{function}({give_state}left, temperature_c, {give_time}rate);
    {after}return outside;
}}
"""
#: A direct law has the error taken off its rate. An error that is not a number must reach the output, to be flagged.
DIRECT_LEFT, DIRECT_AFTER = "error[a] == error[a] ? w[a] : error[a]", "rate[a] -= error[a]"


def force_body(name: str, force: ForceSensitivity, *, is_direct: bool, remembers: bool) -> str:
    """Return the constants and the functions; a direct law of the output takes the error off afterwards."""
    text = BODY.format(
        name=name,
        step=f" or {name}_step" if remembers else "",
        with_step=f" or {name}_step_with_force" if remembers else "",
        unmeasured=f"\n * {line}." if (line := unmeasured_line(force)) else "",
        at_1_g=c_table(force.at_1_g_dps),
        per_g=c_table(force.known_per_g),
        per_g2=c_table(force.known_per_g2),
        own="{" + ", ".join(str(BODY_AXES.index(axis)) for axis in force.axes) + "}",
    )
    for function in ("correct", "step") if remembers else ("correct",):
        is_step = function == "step"
        text += FUNCTION.format(
            name=name,
            function=function,
            state=f"{name}_state *state, " if is_step else "",
            give_state="state, " if is_step else "",
            time="double t_s, " if is_step else "",
            give_time="t_s, " if is_step else "",
            left=DIRECT_LEFT if is_direct else "w[a] - error[a]",
            after=f"for (a = 0; a < {name}_AXES; a++) {DIRECT_AFTER};\n    " if is_direct else "",
        )
    return text


def force_head(name: str, force: ForceSensitivity | None) -> str:
    """Return the line at the head of a header, inside of its comment; empty for a calibration without g-sensitivity."""
    return "" if force is None else f" * {size_line(force, f'{name}_correct_with_force')}.\n"


HEAD = """/* Calibration of gyro {serial}, version {version}: model {model}.
 * Hash of the calibration: {hash}
 * Names begin with {name}: letters and digits of the serial number as they are, anything else as _ and its code in
 * hexadecimal, so that headers of several units go into one program.
 * Valid {temperatures} and {rates}; outside, the error at the edge of the range is
 * taken off and the function returns 1, else 0. What is at most {margin_c:g} K or {margin:g} deg/s beyond counts as
 * inside: a thermometer's last digits, corrected at the edge, and rates in the output's, as the range is of true rates.
 * What is not a number gives no number, and 1.
 * Input: output of the gyro as a rate, deg/s ({nominal}); result: rate in deg/s.
{uncertainty} * {rounding}.
 * Define LABCTL_REAL as float before including it for single precision. */
#ifndef {guard}
#define {guard}

#include <math.h>

#ifndef LABCTL_REAL
#define LABCTL_REAL double
#endif

#define {name}_AXES {axes}
{bound}static const char {name}_hash[] = "{hash}";
static const double {name}_temperature_c[2] = {{{low}, {high}}};
static const double {name}_inside_c[2] = {{{coldest}, {warmest}}};
static const double {name}_output_dps[2] = {{{slowest}, {fastest}}};

static inline LABCTL_REAL {name}_held(LABCTL_REAL w, int *outside)
{{
    if (!(w >= (LABCTL_REAL){name}_output_dps[0] && w <= (LABCTL_REAL){name}_output_dps[1])) *outside = 1;
    if (w < (LABCTL_REAL){name}_output_dps[0]) return (LABCTL_REAL){name}_output_dps[0];
    if (w > (LABCTL_REAL){name}_output_dps[1]) return (LABCTL_REAL){name}_output_dps[1];
    return w;
}}

static inline LABCTL_REAL {name}_held_c(LABCTL_REAL t, int *outside)
{{
    if (!(t >= (LABCTL_REAL){name}_inside_c[0] && t <= (LABCTL_REAL){name}_inside_c[1])) *outside = 1;
    if (t < (LABCTL_REAL){name}_temperature_c[0]) return (LABCTL_REAL){name}_temperature_c[0];
    if (t > (LABCTL_REAL){name}_temperature_c[1]) return (LABCTL_REAL){name}_temperature_c[1];
    return t;
}}
"""

TAIL = """
#endif
"""

SURFACE = """
/* error = sum of c[i][j] * w^i * u^j with u = temperature - {reference:.17g}, by Horner's scheme in u, then in w;
 * result = w - error (Ojeda et al. 2000, eqs. 12 and 13). */
static const double {name}_c[{name}_AXES][{rows}][{columns}] = {table};

static inline int {name}_correct(const LABCTL_REAL *w, LABCTL_REAL temperature_c, LABCTL_REAL *rate)
{{
    int outside = 0, a, i, j;
    LABCTL_REAL u;
    temperature_c = {name}_held_c(temperature_c, &outside);
    u = temperature_c - (LABCTL_REAL){reference:.17g};
    for (a = 0; a < {name}_AXES; a++) {{
        LABCTL_REAL error = 0, held = {name}_held(w[a], &outside);
        for (i = {rows} - 1; i >= 0; i--) {{
            LABCTL_REAL row = 0;
            for (j = {columns} - 1; j >= 0; j--) row = row * u + (LABCTL_REAL){name}_c[a][i][j];
            error = error * held + row;
        }}
        rate[a] = w[a] - error;
    }}
    return outside;
}}
"""

LINEAR = """
/* output = K w + B with K[output][input] and B at the nodes below and Lagrange interpolation over {points} of them;
 * result: w, by Gaussian elimination with pivoting (Yang et al. 2018). */
#define {name}_NODES {nodes}
static const double {name}_node_c[{name}_NODES] = {node_table};
static const double {name}_k[{name}_NODES][{name}_AXES][{name}_AXES] = {k_table};
static const double {name}_b[{name}_NODES][{name}_AXES] = {b_table};

static inline int {name}_correct(const LABCTL_REAL *w, LABCTL_REAL temperature_c, LABCTL_REAL *rate)
{{
    LABCTL_REAL m[{name}_AXES][{name}_AXES + 1], weight[{points}];
    int outside = 0, last, i, j, r, c, p;
    temperature_c = {name}_held_c(temperature_c, &outside);
    for (last = {points} - 1; last < {name}_NODES - 1 && temperature_c > (LABCTL_REAL){name}_node_c[last]; last++) {{ }}
    for (i = 0; i < {points}; i++) {{
        LABCTL_REAL at = (LABCTL_REAL){name}_node_c[last - {points} + 1 + i];
        weight[i] = 1;
        for (j = 0; j < {points}; j++) if (j != i) {{
            LABCTL_REAL other = (LABCTL_REAL){name}_node_c[last - {points} + 1 + j];
            weight[i] *= (temperature_c - other) / (at - other);
        }}
    }}
    for (r = 0; r < {name}_AXES; r++) {{
        for (c = 0; c <= {name}_AXES; c++) m[r][c] = c < {name}_AXES ? 0 : {name}_held(w[r], &outside);
        for (i = 0; i < {points}; i++) {{
            int node = last - {points} + 1 + i;
            for (c = 0; c < {name}_AXES; c++) m[r][c] += weight[i] * (LABCTL_REAL){name}_k[node][r][c];
            m[r][{name}_AXES] -= weight[i] * (LABCTL_REAL){name}_b[node][r];
        }}
    }}
    for (c = 0; c < {name}_AXES; c++) {{
        p = c;
        for (r = c + 1; r < {name}_AXES; r++)
            if ((m[r][c] < 0 ? -m[r][c] : m[r][c]) > (m[p][c] < 0 ? -m[p][c] : m[p][c])) p = r;
        for (i = 0; i <= {name}_AXES; i++) {{ LABCTL_REAL t = m[c][i]; m[c][i] = m[p][i]; m[p][i] = t; }}
        for (r = c + 1; r < {name}_AXES; r++) {{
            LABCTL_REAL f = m[r][c] / m[c][c];
            for (i = c; i <= {name}_AXES; i++) m[r][i] -= f * m[c][i];
        }}
    }}
    for (r = {name}_AXES - 1; r >= 0; r--) {{
        rate[r] = m[r][{name}_AXES];
        for (c = r + 1; c < {name}_AXES; c++) rate[r] -= m[r][c] * rate[c];
        rate[r] /= m[r][r];
    }}
    for (r = 0; r < {name}_AXES; r++) rate[r] += w[r] - {name}_held(w[r], &outside);
    return outside;
}}
"""

#: What may stand in a C name, the underscore set apart for codes.
PLAIN = frozenset(string.ascii_letters + string.digits)
#: Hexadecimal digits of the calibration's hash that the include guard carries.
GUARD_DIGITS = 16


def c_name(serial: str) -> str:
    """Return the beginning of every name in the header of a unit: no two serial numbers have the same.

    Letters, in their case, and digits stay; anything else, the underscore too, becomes `_` and its code in two
    hexadecimal digits: `A-1` is `gyro_A_2d1`. No suffix of a name below begins with two such digits, so no name of one
    unit is another's either.
    """
    return "gyro_" + "".join(f"_{byte:02x}" if chr(byte) not in PLAIN else chr(byte) for byte in serial.encode())


def c_header(calibration: Calibration) -> bytes:
    """Return a calibration as a C header; raises BadInput for a model that has no closed form in C yet."""
    name = c_name(calibration.serial)
    fitted, memory = split_memory(calibration.fitted, calibration.axes)
    surface = surface_of(fitted, calibration.axes)
    linear = linear_of(fitted, calibration.axes)
    sine = sine_form_of(fitted, calibration.axes)
    is_direct = fitted.model.argument == "output"
    if surface is not None:
        body = _surface(name, surface)
    elif linear is not None:
        body = _linear(name, linear, calibration.temperature_c)
    elif sine is not None:
        body = sine_body(name, sine, *temperature_nodes(sine.linear, calibration.temperature_c))
    else:
        effects = fitted.model.effect_ids
        blocking = [effect for effect in effects if effect not in LINEAR_EFFECTS | {SINE}] or effects
        raise BadInput(
            f"format c: model {calibration.fitted.model.name} has effects without a closed form in C "
            f"({', '.join(blocking)}); use the JSON file with labctl's Compensator"
        )
    if memory is not None:
        body += memory_body(name, memory, is_direct=is_direct)
    if calibration.force_sensitivity is not None:
        body += force_body(name, calibration.force_sensitivity, is_direct=is_direct, remembers=memory is not None)
    return (_head(name, calibration) + body + orientation_body(name) + TAIL).encode()


def _head(name: str, calibration: Calibration) -> str:
    (low, high), (slow, fast) = calibration.temperature_c, calibration.rate_dps
    has_thermometer = math.isfinite(high - low)
    slowest, fastest = output_limits_dps(calibration)
    is_limited = math.isfinite(slow) and math.isfinite(fast)
    nominal = "; ".join(
        f"{axis}: (output in {output.unit} - {output.offset:g}) / {output.scale:g}"
        for axis, output in calibration.output.items()
    )
    return HEAD.format(
        serial=_in_comment(calibration.serial),
        version=calibration.version,
        model=_in_comment(calibration.fitted.model.name),
        hash=calibration.calibration_hash,
        low=_number(low),
        high=_number(high),
        temperatures=f"from {low:g} to {high:g} deg C" if has_thermometer else "at any temperature (none was measured)",
        rates=f"from {slow:g} to {fast:g} deg/s" if is_limited else "at any rate",
        margin_c=MARGIN_C,
        margin=fastest - fast if is_limited else 0.0,
        coldest=_number(low - MARGIN_C),
        warmest=_number(high + MARGIN_C),
        slowest=_number(slowest),
        fastest=_number(fastest),
        nominal=nominal,
        guard=f"LABCTL_{name}_V{calibration.version}_{calibration.calibration_hash[:GUARD_DIGITS]}_H",
        name=name,
        axes=len(calibration.axes),
        uncertainty="".join(
            f" * {_in_comment(line)}\n" for line in [*configuration_lines(calibration), *bound_lines(calibration)]
        )
        + force_head(name, calibration.force_sensitivity),
        rounding=rounding_line(calibration),
        bound=bound_constant(name, calibration),
    )


def _number(value: float) -> str:
    """Return a number in C; an infinite one stands for no limit."""
    return f"{value:.17g}" if math.isfinite(value) else ("INFINITY" if value > 0 else "-INFINITY")


def _in_comment(text: str) -> str:
    """Return text for a C comment: nothing in it ends the comment or the line."""
    return "".join(char if char.isprintable() else "?" for char in text).replace("*/", "* /").replace("\\", "/")


def _surface(name: str, surface: Surface) -> str:
    _, rows, columns = surface.coefficients.shape
    return SURFACE.format(
        name=name, rows=rows, columns=columns, reference=surface.reference_c, table=c_table(surface.coefficients)
    )


def _linear(name: str, linear: Linear, span_c: tuple[float, float]) -> str:
    nodes, points = temperature_nodes(linear, span_c)
    k, b = linear.k_and_b(nodes)
    return LINEAR.format(
        name=name,
        points=points,
        nodes=len(nodes),
        node_table=c_table(nodes),
        k_table=c_table(k),
        b_table=c_table(b),
    )


FORMAT = Format("C header", "text/x-c", "h", c_header)
