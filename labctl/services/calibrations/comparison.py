"""Comparison of a fit's errors with those before it: a fit that makes things worse is said, or refused."""

from __future__ import annotations

from labctl.fitting import ErrorFigures
from labctl.recording.sanity import Finding

#: A fit that leaves more than this many times the raw error is certainly wrong; from 1 on it is said.
REFUSED = 1.02
#: A change is said to be worse from these ratios of errors on: on its own data, and on temperatures left out.
WORSE, WORSE_HELD_OUT = 1.01, 1.1


def worse_than_raw(error: ErrorFigures) -> list[Finding]:
    """Return a finding where a fit leaves more of its own data than there was without any correction."""
    raw, left = error.raw_rms_dps, error.rms_dps
    if raw is None or left is None or not left > raw:
        return []
    return [
        Finding(
            "worse", "certain" if left > REFUSED * raw else "likely", "fit",
            f"it leaves {left:.4g} deg/s RMS of its own data, where the output without correction is off by "
            f"{raw:.4g} deg/s", left, "deg/s", f"less than {raw:.4g} deg/s",
            "check sign, unit and axes of the output, or choose another model",
        )
    ]  # fmt: skip


def worse_than_before(before: ErrorFigures, after: ErrorFigures) -> list[Finding]:
    """Return findings where a changed model is worse than the one it was made from."""
    found = worse_than_raw(after)
    for name, first, second, ratio in (
        ("RMS", before.rms_dps, after.rms_dps, WORSE),
        ("held-out RMS", before.heldout_rms_dps, after.heldout_rms_dps, WORSE_HELD_OUT),
    ):
        if first is not None and second is not None and second > ratio * first:
            found.append(
                Finding(
                    "worse", "likely", "change", f"the {name} error rises from {first:.4g} to {second:.4g} deg/s",
                    second, "deg/s", f"at most {first:.4g} deg/s", "leave the model as it was",
                )
            )  # fmt: skip
    return found
