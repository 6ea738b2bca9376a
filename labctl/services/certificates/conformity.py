"""A statement of conformity by ILAC-G8:09/2019: the rule, its acceptance limit, and what it risks."""

from __future__ import annotations

from labctl.certificates.document import Conformity, ResultPoint, StateOfItem
from labctl.errors import BadInput
from labctl.services.schemas.documents.certificates import OrderedConformity

#: Largest probability of a false acceptance at the limit (ILAC-G8, table 1), normal distribution.
RISKS = {"simple": "up to 50 % at the limit", "guard-band": "up to 2.5 % at the limit"}


class NoAcceptance(BadInput):
    """The uncertainty leaves no room for acceptance; nothing was written."""


def conformity(ordered: OrderedConformity, left: StateOfItem, results: tuple[ResultPoint, ...]) -> Conformity:
    """Return the statement on the largest error of a corrected rate over all data sets. Raises NoAcceptance."""
    largest = max(axis.max_dps for axis in left.axes)
    expanded = max(point.expanded_dps for point in results)
    band = expanded if ordered.rule == "guard-band" else 0.0
    acceptance = ordered.limit_dps - band
    if acceptance <= 0:
        raise NoAcceptance(
            f"conformity to {ordered.specification}: the guard band, U = {expanded:.3g} deg/s, is not smaller than the "
            f"limit, {ordered.limit_dps:g} deg/s; measure with a smaller uncertainty, or agree with the customer on "
            'rule = "simple"'
        )
    passed = largest <= acceptance
    rule = "guard band w = U" if ordered.rule == "guard-band" else "simple acceptance, no guard band (w = 0)"
    statement = (
        f"{'PASS' if passed else 'FAIL'}: the largest error of the corrected rate, {largest:.3g} °/s, "
        f"{'does not exceed' if passed else 'exceeds'} the acceptance limit of {acceptance:.3g} °/s = "
        f"{ordered.limit_dps:g} °/s − {band:.3g} °/s. Decision rule: {rule} (ILAC-G8:09/2019); risk of a false "
        f"acceptance {RISKS[ordered.rule]}."
    )
    return Conformity(
        specification=ordered.specification, limit_dps=ordered.limit_dps, rule=ordered.rule, guard_band_dps=band,
        acceptance_dps=acceptance, largest_error_dps=largest, expanded_dps=expanded, passed=passed,
        statement=statement,
    )  # fmt: skip
