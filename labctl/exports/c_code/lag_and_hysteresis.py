"""The part of a C header that remembers: the followers of a lag or a hysteresis, and a step from sample to sample."""

from __future__ import annotations

import numpy as np

from labctl.exports.c_code.tables import c_table
from labctl.fitting.models.correction import SCALE_STEPS
from labctl.fitting.models.memory import Memory

BODY = """
/* State: {count} filters of the temperature, of a thermal lag (time constant, s) or a hysteresis (width of a
 * play, K). A lag moves by d at_c / dt = (temperature - at_c) / tau, tau that of {name}_cooling while it is above the
 * temperature, and adds size * (at_c - temperature) to the output, or size times the difference of the squares about
 * {name}_reference_c. Call {name}_begin once, and {name}_step for every sample in order of time, t_s in s; the unit is
 * taken to have rested at its first temperature. A temperature that goes straight from sample to sample is followed
 * exactly, however far they are apart. {name}_correct alone is right where the temperature has not changed for long,
 * but for the side of a hysteresis. Link with the C library's mathematics (-lm). */
#define {name}_FOLLOWERS {count}
typedef struct {{ int begun; double t_s, temperature_c, at_c[{name}_FOLLOWERS]; }} {name}_state;
static const int {name}_is_lag[{name}_FOLLOWERS] = {is_lag};
static const double {name}_follower[{name}_FOLLOWERS] = {parameters};
static const double {name}_cooling[{name}_FOLLOWERS] = {cooling}; /* of a lag: time constant from above, s */
static const int {name}_is_curved[{name}_FOLLOWERS] = {is_curved};
static const double {name}_reference_c[{name}_FOLLOWERS] = {references};
static const double {name}_bow_c[{name}_FOLLOWERS][2] = {bows};
static const double {name}_size[{name}_FOLLOWERS][{name}_AXES] = {sizes};
{scales}
static inline void {name}_begin({name}_state *state)
{{
    int f;
    state->begun = 0;
    state->t_s = state->temperature_c = 0;
    for (f = 0; f < {name}_FOLLOWERS; f++) state->at_c[f] = 0;
}}

static inline int {name}_step(
    {name}_state *state, const LABCTL_REAL *w, LABCTL_REAL temperature_c, double t_s, LABCTL_REAL *rate)
{{
    double now = (double)temperature_c, error[{name}_AXES]{declared};
    LABCTL_REAL left[{name}_AXES];
    int a, f, outside, known = isfinite(now) && isfinite(t_s);
    for (a = 0; a < {name}_AXES; a++) {begun}error[a] = known ? 0 : NAN;
    for (f = 0; known && f < {name}_FOLLOWERS; f++) {{
        double parameter = {name}_follower[f], at = now, side;
        if (state->begun && {name}_is_lag[f]) {{
            double tau = now < state->at_c[f] ? {name}_cooling[f] : parameter;
            double ratio = (t_s - state->t_s) / tau, keep = exp(-ratio);
            double mean = ratio > 0 ? -expm1(-ratio) / ratio : 1;
            at = keep * state->at_c[f] + (mean - keep) * state->temperature_c + (1 - mean) * now;
        }} else if (state->begun) {{
            at = fmin(fmax(state->at_c[f], now - parameter / 2), now + parameter / 2);
        }}
        state->at_c[f] = at;
        side = {name}_is_lag[f] ? at - now : (now - at) / (parameter / 2);
        if ({name}_is_curved[f]) side *= at + now - 2 * {name}_reference_c[f];
        if ({name}_bow_c[f][1] > {name}_bow_c[f][0]) {{
            double share = (now - {name}_bow_c[f][0]) / ({name}_bow_c[f][1] - {name}_bow_c[f][0]);
            share = fmin(fmax(share, 0), 1);
            side *= 4 * share * (1 - share);
        }}
        for (a = 0; a < {name}_AXES; a++) error[a] += {name}_size[f][a] * side;
{added}    }}
    if (known) {{
        state->begun = 1;
        state->t_s = t_s;
        state->temperature_c = now;
    }}
    for (a = 0; a < {name}_AXES; a++) left[a] = {left};
    outside = {name}_correct(left, temperature_c, rate);
    {after}return outside;
}}
"""


#: Where the scale factor lags: the constants, and what its solution by fixed-point steps needs.
ABOUT_SCALE = """/* {name}_scale times the difference is added to the scale factor: {law}. */
static const double {name}_scale[{name}_FOLLOWERS][{name}_AXES] = {scales};
"""
LAWS = {False: "of the true rate", True: "of the output"}
ADDED = "        for (a = 0; a < {name}_AXES; a++) scale[a] += {name}_scale[f][a] * side;\n"
#: output - error - scale * rate is corrected by the rest; the steps end where rounding alone changes the rate.
SOLVED = """for (a = 0; a < {name}_AXES; a++) solved[a] = (double)rate[a] / (1 + scale[a]);
    for (f = 0; f < {steps}; f++) {{
        double change = 0;
        for (a = 0; a < {name}_AXES; a++) {{
            double held = fmin(fmax(solved[a], {name}_output_dps[0]), {name}_output_dps[1]);
            left[a] = (LABCTL_REAL)((double)w[a] - error[a] - scale[a] * held);
        }}
        {name}_correct(left, temperature_c, rate);
        for (a = 0; a < {name}_AXES; a++) {{
            double step = ((double)rate[a] - solved[a]) / (1 + scale[a]);
            solved[a] += step;
            change = fmax(change, fabs(step));
        }}
        if (!(change < before)) break;
        before = change;
    }}
    for (a = 0; a < {name}_AXES; a++) rate[a] = (LABCTL_REAL)solved[a];
    """
#: A direct law of the output takes the errors off afterwards.
TAKEN = "for (a = 0; a < {name}_AXES; a++) rate[a] = (LABCTL_REAL)((double)rate[a] - error[a]{by_scale});\n    "
BY_SCALE = " - scale[a] * fmin(fmax((double)w[a], {name}_output_dps[0]), {name}_output_dps[1])"


def memory_body(name: str, memory: Memory, *, is_direct: bool) -> str:
    """Return the constants, the state and the step; a direct law of the output takes the error off afterwards."""
    followers = memory.followers
    bows = np.array([follower.bow or (0.0, 0.0) for follower in followers])
    return BODY.format(
        name=name,
        count=len(followers),
        is_lag="{" + ", ".join(str(int(follower.kind == "lag")) for follower in followers) + "}",
        parameters=c_table(np.array([follower.parameter for follower in followers])),
        cooling=c_table(np.array([follower.cooling_s or follower.parameter for follower in followers])),
        is_curved="{" + ", ".join(str(int(follower.part == "curved")) for follower in followers) + "}",
        references=c_table(np.array([follower.reference_c for follower in followers])),
        bows=c_table(bows),
        sizes=c_table(np.stack([follower.size for follower in followers])),
        left="w[a]" if is_direct else "(LABCTL_REAL)((double)w[a] - error[a])",
        **_parts_of_scale(name, memory, is_direct=is_direct),
    )


def _parts_of_scale(name: str, memory: Memory, *, is_direct: bool) -> dict[str, str]:
    """Return what stands in the step for a scale factor that lags; without one the errors of the bias alone."""
    if not memory.has_scale:
        after = TAKEN.format(name=name, by_scale="") if is_direct else ""
        return {"scales": "", "declared": "", "begun": "", "added": "", "after": after}
    none = np.zeros(len(memory.axes))
    scales = np.stack([none if follower.scale is None else follower.scale for follower in memory.followers])
    by_scale = BY_SCALE.format(name=name)
    return {
        "scales": ABOUT_SCALE.format(name=name, law=LAWS[is_direct], scales=c_table(scales)),
        "declared": f", scale[{name}_AXES]" + ("" if is_direct else f", solved[{name}_AXES], before = INFINITY"),
        "begun": "scale[a] = ",
        "added": ADDED.format(name=name),
        "after": TAKEN.format(name=name, by_scale=by_scale) if is_direct
        else SOLVED.format(name=name, steps=SCALE_STEPS),
    }  # fmt: skip
