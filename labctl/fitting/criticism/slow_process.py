"""Slow process in the residual of a record at rest: nothing moved, and the output still wandered for minutes.

Either the bias itself drifts, or something drives it that was not logged; of that a temperature is the likeliest: the
thermometer of a unit is not where the heat of its electronics, of a hand or of the sun goes through the element.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from labctl.answers.criticism import Advice, SlowProcess
from labctl.fitting.criticism.advice import MIN_GAIN_AT_REST
from labctl.fitting.criticism.channel_functions import TIMES
from labctl.fitting.criticism.model_comparison import Comparison
from labctl.fitting.criticism.residuals import Residuals
from labctl.fitting.criticism.rivals import FAR
from labctl.fitting.criticism.verdict import ENOUGH, Verdict
from labctl.fitting.numeric.arrays import Array

#: Correlation of neighbouring data sets from which on a residual is slow: it goes on longer than the data sets last.
MIN_CORRELATION = 0.3
MIN_SETS = 16
TEMPERATURE = "temperature_c"
#: A second effect has to take off this share of the squared error on parts left out that was there before the first:
#: less is what the wrong shape of the first leaves, as all follow one course of the temperature.
NEXT_SHARE = 0.05


def slow_process(comparison: Comparison, axis_residuals: Mapping[str, Residuals]) -> SlowProcess | None:
    """Return the slow process in the residuals of a record at rest; None of another record, or where they are noise."""
    nodes = comparison.data.nodes
    if np.any(nodes.table_rate_dps()) or "t_s" not in nodes or len(comparison.data) < MIN_SETS:
        return None
    design = next(iter(comparison.designs.values()))
    order = np.lexsort((design.t_s, design.run))
    courses, taus = {}, {}
    for axis, residuals in axis_residuals.items():
        course = residuals.means[order] - residuals.means.mean()
        tau_s = _time_constant_s(course, design.t_s[order], design.run[order])
        if tau_s is not None:
            courses[axis], taus[axis] = course, tau_s
    if not courses:
        return None
    rms = {axis: float(np.sqrt(np.mean(course**2))) for axis, course in courses.items()}
    return {"rms_dps": rms, "tau_s": float(np.median(list(taus.values()))), "common": _common(list(courses.values()))}


def _time_constant_s(course: Array, t_s: Array, run: NDArray[np.int64]) -> float | None:
    """Return the time over which a course falls to 1 / e of its correlation, s; None where it is not slow."""
    same = run[1:] == run[:-1]
    size = float(np.mean(course**2))
    if size <= 0 or not same.any() or float(np.mean((course[1:] * course[:-1])[same])) < MIN_CORRELATION * size:
        return None
    spacing_s = float(np.median(np.diff(t_s)[same]))
    for lag in range(1, len(course) // 2):
        together = run[lag:] == run[:-lag]
        if not together.any() or float(np.mean((course[lag:] * course[:-lag])[together])) < size / math.e:
            return lag * spacing_s
    return len(course) / 2 * spacing_s


def _common(courses: list[Array]) -> float | None:
    """Return the share of courses, each over its size, that one common course explains; None of a single one."""
    if len(courses) < 2:
        return None
    values = np.linalg.svd(np.array([course / np.linalg.norm(course) for course in courses]), compute_uv=False)
    return float(values[0] ** 2 / np.sum(values**2))


def with_hypothesis(verdict: Verdict, comparison: Comparison, slow: SlowProcess | None) -> Verdict:
    """Return the verdict, an unexplained one at rest with the hypothesis that a temperature was not logged.

    Not where the logged thermometer has clearly more evidence than time: then it was logged, and its law is another.
    """
    if slow is None or verdict.form != "unexplained":
        return verdict
    smooth = {c.id: c.log_bf for c in comparison.candidates if c.smooth}
    of_time = max((smooth[name] for name in TIMES if name in smooth), default=-np.inf)
    if of_time < ENOUGH or smooth.get(TEMPERATURE, -np.inf) > of_time + FAR:
        return verdict
    return replace(verdict, hypothesis="temperature_not_logged")


def without_harm(
    verdict: Verdict, advice: tuple[Advice, ...], slow: SlowProcess | None, comparison: Comparison
) -> Verdict:
    """Return the verdict without names that what would be exported contradicts, in a record at rest.

    Nothing moved, so that an effect is only a course in time there: one with which parts left out are corrected worse
    has followed that course by chance, and one that is nothing but time is no cause of it. Where the evidence for all
    that was named is such that noise could have it, nothing is missing.
    """
    if slow is None or verdict.form not in {"missing", "ambiguous"}:
        return verdict
    refuted = {
        each["effect"]
        for place, each in enumerate(advice)
        if each["effect"] in OF_TIME_ALONE or _fails(each, advice[0]["before_dps"] if place else None)
    }
    groups = tuple(group for group in verdict.groups if group[0] not in refuted)
    if len(groups) == len(verdict.groups):
        return verdict
    if not groups:
        if max((c.log_bf for c in comparison.candidates), default=0.0) < FAR:
            return Verdict("adequate")
        return Verdict("unexplained", (), verdict.depends_on or ("t_s",), confounded=verdict.confounded)
    return replace(
        verdict,
        groups=groups,
        form="missing" if all(len(group) == 1 for group in groups) else "ambiguous",
        axes={name: axes for name, axes in verdict.axes.items() if name not in refuted},
    )


def _fails(advice: Advice, first_dps: float | None) -> bool:
    """Return whether what would be exported does not become clearly better on parts left out.

    Not where that is unknown. Beside an effect with `first_dps` before it, whether it gains too little to be a second.
    """
    before, after = advice["before_dps"], advice["after_dps"]
    if before is None or after is None:
        return False
    if first_dps is None:
        return after > (1.0 - MIN_GAIN_AT_REST) * before
    return before**2 - after**2 < NEXT_SHARE * first_dps**2


#: Effects whose only cause is that time goes on.
OF_TIME_ALONE = frozenset({"bias_drift"})
