"""Measured beside specified: pass or fail by simple acceptance."""

from __future__ import annotations

from labctl.services.datasheet.catalogue import Line
from labctl.services.schemas.reports.datasheet import Characteristic

RULE = (
    "Simple acceptance (ILAC-G8:09/2019, 4.2.1): a measured value inside the specified one passes, whatever its "
    "uncertainty; where the specified value is less than 2 u away, the risk of a wrong decision is up to 50 %."
)
#: A specified value less than so many standard uncertainties away is near.
NEAR = 2.0


def decided(line: Line, found: Characteristic, specified: float | None) -> Characteristic:
    """Return a characteristic with the specified value and the decision on it."""
    if specified is None:
        return found
    if found.value is None:  # a bound below the specified value passes; one above it decides nothing
        bounded = line.specified_as == "at most" and found.at_most is not None and found.at_most <= specified
        return found.model_copy(update={"specified": specified, "passed": True if bounded else None})
    value = abs(found.value) if line.specified_as == "at most" else found.value
    passed = value <= specified if line.specified_as == "at most" else value >= specified
    near = found.u is not None and abs(value - specified) < NEAR * found.u
    return found.model_copy(update={"specified": specified, "passed": passed, "near_limit": near})
