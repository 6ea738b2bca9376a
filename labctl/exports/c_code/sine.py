"""The body of a C header for a linear model with a sine response: Newton's method from the arcsine on."""

from __future__ import annotations

import numpy as np

from labctl.exports.c_code.tables import c_table
from labctl.fitting.models.sine_form import FOLLOWED, STEPS, SineForm
from labctl.fitting.numeric.arrays import Array

BODY = """
#include <math.h>

/* output = K w + B + sine(w) - w with K[output][input], B and the square of each axis' modulation constant k, in
 * (rad/(rad/s))^2, at the nodes below and Lagrange interpolation over {points} of them; sine(w) = sin(k w) / k, with
 * w in rad/s, and sinh where the square is negative. Result: w, by {steps} steps of Newton's method from the arcsine
 * on. Computed in double throughout; link with the C library's mathematics (-lm). */
#define {name}_NODES {nodes}
static const double {name}_node_c[{name}_NODES] = {node_table};
static const double {name}_k[{name}_NODES][{name}_AXES][{name}_AXES] = {k_table};
static const double {name}_b[{name}_NODES][{name}_AXES] = {b_table};
static const double {name}_k_squared[{name}_NODES][{name}_AXES] = {squared_table};

static inline int {name}_correct(const LABCTL_REAL *w, LABCTL_REAL temperature_c, LABCTL_REAL *rate)
{{
    const double degree = 0.017453292519943295;
    double k[{name}_AXES][{name}_AXES], b[{name}_AXES], squared[{name}_AXES], held[{name}_AXES], x[{name}_AXES];
    double m[{name}_AXES][{name}_AXES + 1], weight[{points}], t;
    int outside = 0, last, step, i, j, r, c, p;
    t = (double){name}_held_c(temperature_c, &outside);
    for (last = {points} - 1; last < {name}_NODES - 1 && t > {name}_node_c[last]; last++) {{ }}
    for (i = 0; i < {points}; i++) {{
        weight[i] = 1;
        for (j = 0; j < {points}; j++) if (j != i)
            weight[i] *= (t - {name}_node_c[last - {points} + 1 + j])
                / ({name}_node_c[last - {points} + 1 + i] - {name}_node_c[last - {points} + 1 + j]);
    }}
    for (r = 0; r < {name}_AXES; r++) {{
        b[r] = squared[r] = 0;
        for (c = 0; c < {name}_AXES; c++) k[r][c] = 0;
        for (i = 0; i < {points}; i++) {{
            int node = last - {points} + 1 + i;
            b[r] += weight[i] * {name}_b[node][r];
            squared[r] += weight[i] * {name}_k_squared[node][r];
            for (c = 0; c < {name}_AXES; c++) k[r][c] += weight[i] * {name}_k[node][r][c];
        }}
        held[r] = (double){name}_held(w[r], &outside);
        {{
            double root = sqrt(fmax(fabs(squared[r]), 1e-12)), phase = root * degree * (held[r] - b[r]);
            phase = squared[r] > 0 ? asin(fmin(fmax(phase, -{followed}), {followed})) : asinh(phase);
            x[r] = phase / root / degree;
        }}
    }}
    for (step = 0; step < {steps}; step++) {{
        for (r = 0; r < {name}_AXES; r++) {{
            double turned = degree * x[r], root = sqrt(fabs(squared[r])), phase = root * turned, sine, slope;
            if (phase * phase < 1e-6) {{
                sine = x[r] * (1 - squared[r] * turned * turned / 6);
                slope = 1 - squared[r] * turned * turned / 2;
            }} else {{
                sine = (squared[r] > 0 ? sin(phase) : sinh(phase)) / root / degree;
                slope = squared[r] > 0 ? cos(phase) : cosh(phase);
            }}
            m[r][{name}_AXES] = b[r] + sine - x[r] - held[r];
            for (c = 0; c < {name}_AXES; c++) {{
                m[r][c] = k[r][c];
                m[r][{name}_AXES] += k[r][c] * x[c];
            }}
            m[r][r] += fmax(slope, 1 - {followed}) - 1;
        }}
        for (c = 0; c < {name}_AXES; c++) {{
            p = c;
            for (r = c + 1; r < {name}_AXES; r++) if (fabs(m[r][c]) > fabs(m[p][c])) p = r;
            for (i = 0; i <= {name}_AXES; i++) {{ double swap = m[c][i]; m[c][i] = m[p][i]; m[p][i] = swap; }}
            for (r = c + 1; r < {name}_AXES; r++) {{
                double f = m[r][c] / m[c][c];
                for (i = c; i <= {name}_AXES; i++) m[r][i] -= f * m[c][i];
            }}
        }}
        for (r = {name}_AXES - 1; r >= 0; r--) {{
            for (c = r + 1; c < {name}_AXES; c++) m[r][{name}_AXES] -= m[r][c] * m[c][{name}_AXES];
            m[r][{name}_AXES] /= m[r][r];
            x[r] -= m[r][{name}_AXES];
        }}
    }}
    for (r = 0; r < {name}_AXES; r++) rate[r] = (LABCTL_REAL)(x[r] + ((double)w[r] - held[r]));
    return outside;
}}
"""


def sine_body(name: str, sine: SineForm, nodes_c: Array, points: int) -> str:
    """Return the constants at temperature nodes (n,), interpolated over `points` of them, and the function."""
    k, b = sine.linear.k_and_b(nodes_c)
    return BODY.format(
        name=name,
        points=points,
        nodes=len(nodes_c),
        node_table=c_table(nodes_c),
        k_table=c_table(k),
        b_table=c_table(b),
        squared_table=c_table(np.asarray(sine.k_squared(nodes_c))),
        steps=STEPS,
        followed=FOLLOWED,
    )
