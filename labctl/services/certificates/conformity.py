"""A statement of conformity by ILAC-G8:09/2019: rule, acceptance limit, the use it holds for, and what it risks."""

from __future__ import annotations

from labctl.certificates.document import AnyAxisResult, Conformity, ResultPoint, StateOfItem
from labctl.errors import BadInput
from labctl.services.schemas.documents.certificates import OrderedConformity

#: Largest probability of a false acceptance at the limit (ILAC-G8, table 1), normal distribution.
RISKS = {"simple": "up to 50 % at the limit", "guard-band": "up to 2.5 % at the limit"}
RULES = {"simple": "simple acceptance, no guard band (w = 0)", "guard-band": "guard band w = U"}


class NoAcceptance(BadInput):
    """The uncertainty leaves no room for acceptance; nothing was written."""


class NoDecision(BadInput):
    """The uncertainty is not known in all of the range that a statement is to hold for; nothing was written."""


def conformity(
    ordered: OrderedConformity,
    left: StateOfItem,
    results: tuple[ResultPoint, ...],
    any_axis: tuple[AnyAxisResult, ...],
    left_out: tuple[str, ...],
) -> Conformity:
    """Return the statement on the largest error of a corrected rate over all data sets, which the fit has seen.

    `left_out` are the sentences on places of the range where U is not known. Raises NoDecision, NoAcceptance.
    """
    largest = max(axis.max_dps for axis in left.axes)
    expanded, where = _about_any(ordered, any_axis) if ordered.about == "any axis" else _about_own(results)
    if left_out:
        raise NoDecision(f"conformity to {ordered.specification}: {' '.join(left_out)} {_MEASURE}")
    band = expanded if ordered.rule == "guard-band" else 0.0
    acceptance = ordered.limit_dps - band
    if acceptance <= 0:
        raise NoAcceptance(
            f"conformity to {ordered.specification}: the guard band, U = {expanded:.3g} deg/s, is not smaller than the "
            f"limit, {ordered.limit_dps:g} deg/s; measure with a smaller uncertainty, or agree with the customer on "
            f"{_otherwise(ordered)}"
        )
    passed = largest <= acceptance
    statement = (
        f"{'PASS' if passed else 'FAIL'}: {where}{_temperatures(results)}, the largest error of the corrected rate, "
        f"{largest:.3g} °/s over the data sets that the calibration was fitted to, "
        f"{'does not exceed' if passed else 'exceeds'} the acceptance limit of {acceptance:.3g} °/s = "
        f"{ordered.limit_dps:g} °/s − {band:.3g} °/s. Decision rule: {RULES[ordered.rule]}, U = {expanded:.3g} °/s "
        f"(ILAC-G8:09/2019); risk of a false acceptance {RISKS[ordered.rule]}."
    )
    return Conformity(
        specification=ordered.specification, limit_dps=ordered.limit_dps, rule=ordered.rule, guard_band_dps=band,
        acceptance_dps=acceptance, largest_error_dps=largest, expanded_dps=expanded, passed=passed, about=ordered.about,
        statement=statement,
    )  # fmt: skip


_MEASURE = "Measure more data sets there, fit again, and certify that version; or leave the statement out of the order"


def _otherwise(ordered: OrderedConformity) -> str:
    """Return what else can be agreed where the guard band is too wide."""
    own = (
        'about = "own axis", if the item turns about one axis at a time, or on ' if ordered.about == "any axis" else ""
    )
    return f'{own}rule = "simple"'


def _about_any(ordered: OrderedConformity, any_axis: tuple[AnyAxisResult, ...]) -> tuple[float, str]:
    """Return U and for which rotations it holds, in the frame of the case."""
    known = [each.expanded_dps for each in any_axis if each.expanded_dps is not None]
    if not any_axis or len(known) < len(any_axis):
        whys = "; ".join(dict.fromkeys(each.why for each in any_axis if each.why)) or (
            "the version was made by an older version of labctl"
        )
        raise NoDecision(
            f"conformity to {ordered.specification}: U is not known where the item turns about any axis ({whys}); "
            "measure it in three mountings and fit again, or, if the item turns about this axis alone in use, order "
            'about = "own axis" in [conformity]'
        )
    reach = max(each.reach_dps for each in any_axis)
    return max(known), f"turned about any axis of its case at up to {reach:.4g} °/s"


def _about_own(results: tuple[ResultPoint, ...]) -> tuple[float, str]:
    """Return U and for which rotations it holds: those of the results."""
    rates = [point.rate_dps for point in results]
    turned = f"turned about the axis of one output, the others at rest, at {min(rates):.4g} to {max(rates):.4g} °/s"
    return max(point.expanded_dps for point in results), turned


def _temperatures(results: tuple[ResultPoint, ...]) -> str:
    """Return the range of temperatures that a statement holds for; nothing where the calibration knows none."""
    known = [point.temperature_c for point in results if point.temperature_c is not None]
    return f" and {min(known):.1f} to {max(known):.1f} °C" if known else ""
