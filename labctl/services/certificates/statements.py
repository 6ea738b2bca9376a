"""The statements of a certificate that hold for every one, and those that its facts ask for."""

from __future__ import annotations

import math
from collections.abc import Sequence

from labctl.certificates.document import ResultPoint, StabilityResult
from labctl.services.certificates.facts import Facts

ITEM_ONLY = "The results relate only to the item that is identified here, in the condition in which it was received."
WHOLE = "This certificate may be reproduced only in full, unless the laboratory has agreed otherwise in writing."
BY_CUSTOMER = "Customer, order number and the customer's own number of the item were stated by the customer."
TRACEABLE = (
    "The results are metrologically traceable to the SI through the reference standards that are listed, whose "
    "uncertainties enter the uncertainty that is stated."
)
NOISE = "The noise of a single reading is not contained in the uncertainty."
SIMULATED = (
    "SPECIMEN: instruments of the bench are simulated. This document has no metrological value and is no certificate."
)


def statements(facts: Facts) -> tuple[str, ...]:
    """Return the statements in order; of a simulated bench that it is simulated first, and none on traceability."""
    found = [ITEM_ONLY, TRACEABLE, NOISE, BY_CUSTOMER, WHOLE]
    return (SIMULATED, *found[:1], *found[2:]) if facts.simulated else tuple(found)


def until(stability: StabilityResult | None, results: Sequence[ResultPoint]) -> tuple[str, ...]:
    """Return what U is until the date of the next calibration; nothing where no date is stated."""
    if stability is None:
        return ()
    if stability.drift_dps is None:
        text = (
            f"The uncertainties hold at the time of the calibration. What the item drifts by until {stability.until} "
            f"is not known, and they do not contain it: {stability.why}."
        )
        return (text,)
    largest = max((point.expanded_dps for point in results), default=0.0)
    text = (
        f"The uncertainties hold at the time of the calibration. By {stability.intervals} "
        f"{'interval' if stability.intervals == 1 else 'intervals'} between calibrations, the errors of this item "
        f"change by {stability.per_year_dps:.3g} °/s per year (root mean square at the worst place, "
        f"{_turned(stability)}): "
        f"until {stability.until} by {stability.drift_dps:.3g} °/s at most (95.45 %, Student's t). With it, the "
        f"largest U of the results is {math.hypot(largest, stability.drift_dps):.3g} °/s."
    )
    return (text,)


def _turned(stability: StabilityResult) -> str:
    return "turned about any axis" if stability.about == "any axis" else "turned about the axis of one output"
