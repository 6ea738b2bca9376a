"""The part of a C header for g-sensitivity: what specific force adds to the output, and the correction with it."""

from __future__ import annotations

from labctl.exports.c_code.tables import c_table
from labctl.exports.force_text import size_line, unmeasured_line
from labctl.fitting.data.channels import BODY_AXES
from labctl.fitting.models.force_sensitivity import ForceSensitivity

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
