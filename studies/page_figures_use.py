"""The figures of uncertainty in use beside the same that was recomputed by data sets left out, and U about any axis."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from studies.page_figures_any_axis import Unit
from studies.page_figures_budget import of_datasheet
from studies.page_figures_pages import Compared, Row, figure
from studies.page_figures_recomputed import info_of, turning_size_of

#: What a refit leaves is what the fit leaves to this share, as its coefficients are the same to so much of their u.
OF_A_REFIT = 1e-6
#: A version keeps the variances that are left with five digits; of some, most is noise, which is taken off. Data sets
#: without times are numbered as if those that are not left out followed each other.
FIVE_DIGITS_LESS_NOISE = 1e-4
#: A coverage factor is stated with a further 2 % of u: half of the square of that, and what else it rounds.
SMOOTHED_K = 2.5e-4
#: Rates of the table are stored with so many: half a unit of the last one.
TWELVE_DIGITS = 5e-12
#: A calibration over less is of one temperature, K.
ONE_TEMPERATURE_C = 1.0


def use_page(c: Compared) -> Iterator[Row]:
    """Yield what the model leaves and the repeatability in use, the calibrated range, and U about any axis."""
    validity, left = c.get(c.path)["validity"], c.left
    warm = c.sets.raw.get("temperature_c", c.sets.temperature_c)
    rates = np.column_stack(list(c.sets.own_rate_dps.values()))
    limits_c, limits_dps = (warm.min(), warm.max()), (rates.min(), rates.max())
    yield figure("calibrated temperatures", validity["temperature_c"], limits_c)
    yield figure("calibrated rates", validity["rate_dps"], limits_dps, TWELVE_DIGITS)
    later = left.repeatability()
    middle_c = sum(limits_c) / 2
    for rate in (0.0, limits_dps[1] / 2, limits_dps[1]):
        answer = c.get(f"{c.path}/uncertainty?rate_dps={rate}&temperature_c={middle_c}")
        for axis, budget in answer["budget"].items():
            lines = {line["source"]: line for line in budget["lines"]}
            vector = np.where(np.array(list("xyz")) == axis, rate, 0.0)
            yield figure("model in use", [lines["model"]["u"]], [left.model(axis, vector, middle_c)],
                         FIVE_DIGITS_LESS_NOISE)  # fmt: skip
            if later is not None:
                said = lines["repeatability"]
                yield figure("repeatability between runs", [said["u"]], later[:1], OF_A_REFIT)
                yield figure("degrees of freedom between runs", [said["degrees_of_freedom"]], later[1:])
    yield from _any_axis(c, limits_c, max(abs(each) for each in limits_dps))


def _any_axis(c: Compared, limits_c: tuple[float, float], reach_dps: float) -> Iterator[Row]:
    """Yield U about any axis; it is unknown where the unit was not turned about each axis, or with one power-on."""
    shown = c.get(f"{c.path}/uncertainty?rate_dps=0&temperature_c={limits_c[0]}")["any_axis"]
    yield figure("reach of U about any axis", [each["reach_dps"] for each in shown.values()], [reach_dps] * len(shown),
                 TWELVE_DIGITS)  # fmt: skip
    unit = unit_in_use(c) if len(c.law.axes) == len("xyz") else None
    low, high = limits_c
    temperatures_c = [low, (low + high) / 2, high] if high - low >= ONE_TEMPERATURE_C else [(low + high) / 2]
    for name, aligned in (("bound_dps", False), ("aligned_bound_dps", True)):
        own = unit.bound(reach_dps, temperatures_c, aligned=aligned) if unit else dict.fromkeys(shown, np.nan)
        yield figure(f"U about any axis{', up to a rotation' if aligned else ''}",
                     [each[name] for each in shown.values()], [own[axis] for axis in shown], SMOOTHED_K)  # fmt: skip


def unit_in_use(c: Compared) -> Unit:
    """Return what U of a rate vector follows from; a later power-on is as far off as runs were, or as a data sheet."""
    info, later = info_of(c.database, c.recording), c.left.repeatability()
    stated = (info[each]["bias_stability_dps"] for each in ("datasheet", "datasheet_conventions") if later is None)
    u_later, freedom = later or (of_datasheet(*stated), None)
    horizontal_dps = turning_size_of(c.database, c.recording)
    return Unit(c.law, c.left, (u_later, freedom), info["standards"], horizontal_dps)
