"""A statement of conformity by ILAC-G8:09/2019: rule, acceptance limit, the use it holds for, and what it risks."""

from __future__ import annotations

import math

from labctl.answers.certificates import OrderedConformity
from labctl.certificates.document import AnyAxisResult, Conformity, ConformityResult, ResultPoint, StabilityResult
from labctl.errors import BadInput
from labctl.probability_text import risk_text
from labctl.services.certificates.evidence import Errors, VerifiedError
from labctl.services.certificates.stability import until_date

#: Largest probability of a false acceptance at the limit (ILAC-G8, table 1), normal distribution.
RISKS = {
    "simple": "up to 50 % at the limit for each single error, more for the largest of all",
    "guard-band": "up to 2.5 % at the limit",
}
#: What the errors are of, in the sentence that compares them with the limit.
OF_FITTED = "over the {n} data sets that the calibration was fitted to"
OF_VERIFICATION = (
    "over {n} data sets that were measured to verify, at {rates} and {temperatures}, {how}, and that the calibration "
    "was not fitted to ({verified:.3g} °/s), and over the {fitted} that it was fitted to ({seen:.3g} °/s)"
)
OWN_AXIS = ', or order about = "own axis" if the item turns about one axis at a time'
ANEW, SHARED = "mounted and switched on anew", "in a mounting or a powered session of the others"


class NoAcceptance(BadInput):
    """The uncertainty leaves no room for acceptance; nothing was written."""


class NoDecision(BadInput):
    """The uncertainty is not known in all of the range that a statement is to hold for; nothing was written."""


def conformity(
    ordered: OrderedConformity,
    errors: Errors,
    results: tuple[ResultPoint, ...],
    any_axis: tuple[AnyAxisResult, ...],
    left_out: tuple[str, ...],
    widening: float,
    stability: StabilityResult | None = None,
) -> Conformity:
    """Return the statement on the largest error of a corrected rate, at the places where it was verified one by one.

    It holds for the largest error of all of the range, so its guard band is the largest U there, times `widening`
    (`widening_of`). Where a date is stated until which it holds, U contains the drift until then (`stability`).
    `left_out` are the sentences on places of the range where U is not known. Raises NoDecision, NoAcceptance.
    """
    expanded, place_text = _about_any(ordered, any_axis) if ordered.about == "any axis" else _about_own(results)
    if left_out:
        raise NoDecision(f"conformity to {ordered.specification}: {' '.join(left_out)} {_MEASURE}")
    decided = tuple(_decided(ordered, each, stability) for each in errors.verified)
    expanded = max(until_date(expanded, stability), *(each.expanded_dps for each in decided), 0.0)
    band = widening * expanded if ordered.rule == "guard-band" else 0.0
    acceptance = _acceptance(ordered, expanded, band)
    passed = errors.largest_dps <= acceptance
    statement = (
        f"{'PASS' if passed else 'FAIL'}: {place_text}{_temperatures(results)}, the largest error of the corrected "
        "rate, "
        f"{errors.largest_dps:.3g} °/s {_of(errors)}, "
        f"{'does not exceed' if passed else 'exceeds'} the acceptance limit of {acceptance:.3g} °/s = "
        f"{ordered.limit_dps:g} °/s − {band:.3g} °/s. Decision rule: {_rule(ordered, widening)}, "
        f"U = {expanded:.3g} °/s (ILAC-G8:09/2019); risk of a false acceptance {RISKS[ordered.rule]}{_risk(decided)}"
        f"{_until(stability)}."
    )
    return Conformity(
        specification=ordered.specification, limit_dps=ordered.limit_dps, rule=ordered.rule, guard_band_dps=band,
        guard_band_factor=widening if band else 0.0,
        acceptance_dps=acceptance, largest_error_dps=errors.largest_dps, expanded_dps=expanded, passed=passed,
        about=ordered.about, evidence=errors.evidence, datasets=errors.datasets, results=decided, statement=statement,
    )  # fmt: skip


def _acceptance(ordered: OrderedConformity, expanded: float, band: float) -> float:
    """Return the acceptance limit, deg/s. Raises NoDecision where U is unknown, NoAcceptance where it is too large."""
    if not math.isfinite(expanded) or not math.isfinite(band):
        raise NoDecision(
            f"conformity to {ordered.specification}: U is not known for all outputs, so that the largest error has no "
            f"bound. {_MEASURE}"
        )
    if ordered.rule == "simple" and expanded >= ordered.limit_dps:
        raise NoAcceptance(
            f"conformity to {ordered.specification}: U = {expanded:.3g} deg/s is not smaller than the limit, "
            f"{ordered.limit_dps:g} deg/s, so nothing can be decided; measure with a smaller uncertainty"
            f"{OWN_AXIS * (ordered.about == 'any axis')}"
        )
    if band >= ordered.limit_dps:
        raise NoAcceptance(
            f"conformity to {ordered.specification}: the guard band, {band:.3g} deg/s, is not smaller than the "
            f"limit, {ordered.limit_dps:g} deg/s; measure with a smaller uncertainty, or agree with the customer on "
            f"{_otherwise(ordered)}"
        )
    return ordered.limit_dps - band


_MEASURE = "Measure more data sets there, fit again, and certify that version; or leave the statement out of the order"


def specific_risk(error_dps: float, u_dps: float, limit_dps: float) -> float:
    """Return the probability that an error is beyond +-limit, measured with a standard uncertainty, deg/s.

    By JCGM 106:2012, 9.3.2, for a normal distribution and no prior knowledge of the error.
    """
    if u_dps == 0.0:
        return float(abs(error_dps) > limit_dps)
    above, below = (limit_dps - error_dps) / u_dps, (-limit_dps - error_dps) / u_dps
    return 0.5 * (math.erfc(above / math.sqrt(2.0)) + math.erfc(-below / math.sqrt(2.0)))


def _decided(
    ordered: OrderedConformity, verified: VerifiedError, stability: StabilityResult | None
) -> ConformityResult:
    """Decide at one place that was verified; the drift widens U. Raises NoDecision where U is unknown there."""
    budget = verified.budget
    if budget.expanded is None or budget.k is None:
        unknown = "; ".join(f"{line.source}: {line.why}" for line in budget.lines if line.contribution is None)
        rates = ", ".join(f"{rate:.4g}" for rate in verified.rates_dps)
        raise NoDecision(
            f"conformity to {ordered.specification}: the uncertainty of output {verified.output} is not known at "
            f"{rates} deg/s about x, y, z, where it was verified ({unknown}). {_MEASURE}"
        )
    expanded = until_date(budget.expanded, stability)
    acceptance = ordered.limit_dps - (expanded if ordered.rule == "guard-band" else 0.0)
    return ConformityResult(
        output=verified.output, rates_dps=verified.rates_dps, temperature_c=verified.temperature_c,
        error_dps=verified.error_dps, expanded_dps=expanded, k=budget.k, acceptance_dps=acceptance,
        passed=abs(verified.error_dps) <= acceptance,
        risk=specific_risk(verified.error_dps, expanded / budget.k, ordered.limit_dps),
    )  # fmt: skip


def _rule(ordered: OrderedConformity, widening: float) -> str:
    """Return the decision rule in words."""
    if ordered.rule == "simple":
        return "simple acceptance, no guard band (w = 0)"
    return (
        f"guard band w = {widening:.3g} U, which covers the largest of all errors with the probability that U has for "
        "a single one"
    )


def _of(errors: Errors) -> str:
    """Return in words what the errors are of."""
    if errors.evidence == "fitted":
        return OF_FITTED.format(n=errors.datasets)
    rates = [rate for each in errors.verified for rate in each.rates_dps]
    temperatures_c = [each.temperature_c for each in errors.verified if each.temperature_c is not None]
    return OF_VERIFICATION.format(
        n=errors.datasets, rates=f"{min(rates):.4g} to {max(rates):.4g} °/s",
        temperatures=(
            f"{min(temperatures_c):.1f} to {max(temperatures_c):.1f} °C"
            if temperatures_c
            else "the temperature of the room"
        ),
        how=ANEW if errors.is_anew else SHARED, fitted=errors.fitted_datasets, seen=errors.fitted_dps,
        verified=max(abs(each.error_dps) for each in errors.verified),
    )  # fmt: skip


def _risk(decided: tuple[ConformityResult, ...]) -> str:
    """Return the largest specific risk in words; nothing where nothing was verified."""
    if not decided:
        return ""
    return (
        "; where it was verified, the probability that the error is beyond the limit is "
        f"{risk_text(max(each.risk for each in decided))} (JCGM 106:2012, no prior knowledge of the error)"
    )


def _until(stability: StabilityResult | None) -> str:
    """Return in words until when the statement holds; nothing where no date is stated."""
    if stability is None:
        return ""
    if stability.drift_dps is None:
        return f"; it holds at the time of the calibration: the drift until {stability.until} is not known"
    drift_type = stability.type
    source = "" if drift_type is None else f", by {drift_type.units} other units of model {drift_type.model}"
    return f"; U contains a drift of {stability.drift_dps:.3g} °/s until {stability.until}{source}"


def _otherwise(ordered: OrderedConformity) -> str:
    """Return what else can be agreed where the guard band is too wide."""
    about_text = (
        'about = "own axis", if the item turns about one axis at a time, or on ' if ordered.about == "any axis" else ""
    )
    return f'{about_text}rule = "simple"'


def _about_any(ordered: OrderedConformity, any_axis: tuple[AnyAxisResult, ...]) -> tuple[float, str]:
    """Return U and for which rotations it holds, in the frame of the case."""
    bounds = [each.expanded_dps for each in any_axis if each.expanded_dps is not None]
    if not any_axis or len(bounds) < len(any_axis):
        whys = "; ".join(dict.fromkeys(each.why for each in any_axis if each.why)) or (
            "the version was made by an older version of labctl"
        )
        raise NoDecision(
            f"conformity to {ordered.specification}: U is not known where the item turns about any axis ({whys}); "
            "measure it in three mountings and fit again, or, if the item turns about this axis alone in use, order "
            'about = "own axis" in [conformity]'
        )
    reach = max(each.reach_dps for each in any_axis)
    return max(bounds), f"turned about any axis of its case at up to {reach:.4g} °/s"


def _about_own(results: tuple[ResultPoint, ...]) -> tuple[float, str]:
    """Return U and for which rotations it holds: those of the results."""
    rates = [point.rate_dps for point in results]
    motion_text = (
        f"turned about the axis of one output, the others at rest, at {min(rates):.4g} to {max(rates):.4g} °/s"
    )
    return max(point.expanded_dps for point in results), motion_text


def _temperatures(results: tuple[ResultPoint, ...]) -> str:
    """Return the range of temperatures that a statement holds for; nothing where the calibration knows none."""
    temperatures = [point.temperature_c for point in results if point.temperature_c is not None]
    return f" and {min(temperatures):.1f} to {max(temperatures):.1f} °C" if temperatures else ""
