"""The part of a C header behind the corrected rate: the static bias at rest, and the angle of one axis."""

from __future__ import annotations

from labctl.orientation import StandstillRule

BODY = """
/* Static bias (Ojeda et al. 2000, eqs. 1, 15 and 16): the mean of corrected rates at rest, 10 to 20 s of them, to
 * be taken off afterwards; it contains the Earth's rate at that place and heading. Call {name}_rest_begin,
 * {name}_rest_add for each reading, then {name}_static_bias. instability_dps is the bias instability, which no mean
 * removes; u_dps the standard uncertainty. Returns 1, and no numbers, for fewer than 10 readings or one that is no
 * number. Link with -lm. */
typedef struct {{ long n; double mean[{name}_AXES], squares[{name}_AXES]; }} {name}_rest;

static inline void {name}_rest_begin({name}_rest *rest)
{{
    int a;
    rest->n = 0;
    for (a = 0; a < {name}_AXES; a++) rest->mean[a] = rest->squares[a] = 0;
}}

static inline void {name}_rest_add({name}_rest *rest, const LABCTL_REAL *rate)
{{
    int a;
    rest->n++;
    for (a = 0; a < {name}_AXES; a++) {{
        double off = (double)rate[a] - rest->mean[a];
        rest->mean[a] += off / (double)rest->n;
        rest->squares[a] += off * ((double)rate[a] - rest->mean[a]);
    }}
}}

static inline int {name}_static_bias(const {name}_rest *rest, double instability_dps, double *bias_dps, double *u_dps)
{{
    int a, bad = rest->n < 10;
    for (a = 0; a < {name}_AXES; a++) if (!isfinite(rest->mean[a])) bad = 1;
    for (a = 0; a < {name}_AXES; a++) {{
        double n = (double)rest->n;
        bias_dps[a] = bad ? NAN : rest->mean[a];
        u_dps[a] = bad ? NAN : sqrt(rest->squares[a] / (n - 1) / n + instability_dps * instability_dps);
    }}
    return bad;
}}

/* Orientation of one axis, deg, positive counter-clockwise and never wrapped, from corrected rates at their times.
 * While the vehicle stands the angle is held and the offset learned (Weiss): a stretch of settle_s counts as rest when
 * every reading is within near_dps of the offset and their standard deviation is at most quiet_dps. Call
 * {name}_orientation_begin once, change the rule in the state if need be, then {name}_orientation_update for each
 * reading in order of time; still: 1 the vehicle stands, 0 it moves, -1 the readings tell. Returns 1, and changes
 * nothing, for a reading that is no number or not later than the last. A steady turn below near_dps passes for an
 * offset unless still is 0. The same as labctl's Orientation in Python. */
#define {name}_RESTS 32
typedef struct {{
    double settle_s, near_dps, quiet_dps, learn_s, max_gap_s;
    double angle_deg, offset_dps, gap_s;
    int standing;
    int begun, n, waiting, rests;
    double last_s, last_dps, from_s, until_s, at_dps, mean, squares, held_deg, angle_from_deg, waiting_s, waiting_dps;
    double rest_s[{name}_RESTS], rest_dps[{name}_RESTS];
}} {name}_orientation;

static inline void {name}_orientation_begin({name}_orientation *o, double angle_deg, double offset_dps)
{{
    static const {name}_orientation none;
    *o = none;
    o->settle_s = {settle:.17g};
    o->near_dps = {near:.17g};
    o->quiet_dps = {quiet:.17g};
    o->learn_s = {learn:.17g};
    o->max_gap_s = {gap:.17g};
    o->angle_deg = o->angle_from_deg = angle_deg;
    o->offset_dps = offset_dps;
}}

static inline void {name}_orientation_moves({name}_orientation *o, double held_deg, double until_s)
{{
    if (o->standing) o->angle_deg += held_deg - o->offset_dps * (until_s - o->from_s);
    o->standing = o->n = o->waiting = o->rests = 0;
}}

static inline void {name}_orientation_learn({name}_orientation *o)
{{
    double seconds = 0, sum = 0;
    int i;
    if (o->rests == {name}_RESTS) {{
        for (i = 1; i < o->rests; i++) o->rest_s[i - 1] = o->rest_s[i], o->rest_dps[i - 1] = o->rest_dps[i];
        o->rests--;
    }}
    o->rest_s[o->rests] = o->waiting_s;
    o->rest_dps[o->rests++] = o->waiting_dps;
    for (i = 1; i < o->rests; i++) seconds += o->rest_s[i];
    while (o->rests > 1 && seconds >= o->learn_s) {{
        for (i = 1; i < o->rests; i++) o->rest_s[i - 1] = o->rest_s[i], o->rest_dps[i - 1] = o->rest_dps[i];
        o->rests--;
        seconds -= o->rest_s[0];
    }}
    for (i = 0, seconds = 0; i < o->rests; i++) seconds += o->rest_s[i], sum += o->rest_s[i] * o->rest_dps[i];
    o->offset_dps = sum / seconds;
}}

static inline void {name}_orientation_judge({name}_orientation *o, double t_s, double rate_dps, int still)
{{
    double held_deg = o->held_deg, until_s = o->until_s, off;
    if (still == 0 || (still < 0 && !(fabs(rate_dps - o->offset_dps) <= o->near_dps))) {{
        {name}_orientation_moves(o, o->n ? held_deg : 0, o->n ? until_s : o->from_s);
        return;
    }}
    if (o->n == 0) {{
        o->angle_from_deg = o->angle_deg;
        o->from_s = o->until_s = until_s = t_s;
        o->mean = o->squares = o->held_deg = held_deg = 0;
    }} else {{
        o->held_deg += 0.5 * (rate_dps + o->at_dps) * (t_s - o->until_s);
        o->until_s = t_s;
    }}
    o->at_dps = rate_dps;
    off = rate_dps - o->mean;
    o->mean += off / ++o->n;
    o->squares += off * (rate_dps - o->mean);
    if (t_s - o->from_s < o->settle_s) return;
    if (still < 0 && o->n > 1 && o->squares / (o->n - 1) > o->quiet_dps * o->quiet_dps) {{
        {name}_orientation_moves(o, held_deg, until_s);
        return;
    }}
    if (!o->standing) o->angle_deg = o->angle_from_deg;
    o->standing = 1;
    if (o->waiting) {name}_orientation_learn(o);
    o->waiting = 1;
    o->waiting_s = t_s - o->from_s;
    o->waiting_dps = o->mean;
    o->n = 1;
    o->from_s = t_s;
    o->mean = rate_dps;
    o->squares = o->held_deg = 0;
}}

static inline int {name}_orientation_update({name}_orientation *o, double t_s, double rate_dps, int still)
{{
    int stood;
    if (!isfinite(t_s) || !isfinite(rate_dps) || (o->begun && t_s <= o->last_s)) return 1;
    if (o->begun && t_s - o->last_s > o->max_gap_s) {{
        o->gap_s += t_s - o->last_s;
        {name}_orientation_moves(o, o->n ? o->held_deg : 0, o->n ? o->until_s : o->from_s);
    }}
    stood = o->standing;
    if (!stood && o->begun) o->angle_deg += (0.5 * (rate_dps + o->last_dps) - o->offset_dps) * (t_s - o->last_s);
    {name}_orientation_judge(o, t_s, rate_dps, still);
    if (stood && !o->standing)
        o->angle_deg += (0.5 * (rate_dps + o->last_dps) - o->offset_dps) * (t_s - o->last_s);
    o->begun = 1;
    o->last_s = t_s;
    o->last_dps = rate_dps;
    return 0;
}}
"""


def orientation_body(name: str, rule: StandstillRule | None = None) -> str:
    """Return the C code of the static bias and the orientation; the rule of standstill can be changed in its state."""
    usual = rule or StandstillRule()
    return BODY.format(
        name=name, settle=usual.settle_s, near=usual.near_dps, quiet=usual.quiet_dps, learn=usual.learn_s,
        gap=usual.max_gap_s,
    )  # fmt: skip
