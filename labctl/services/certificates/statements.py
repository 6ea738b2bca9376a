"""The statements of a certificate that hold for every one, and those that its facts ask for."""

from __future__ import annotations

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
