"""Comparison of a fit's errors with those before it: a fit that makes things worse is reported, or refused."""

from __future__ import annotations

from typing import Protocol

from labctl.recording.sanity import Finding

#: Errors that differ by less than this share are the same: what the rounding of a refit leaves.
ROUNDING = 1e-6
#: A changed model whose error on its own data is more than this many times the error before is reported.
WORSE = 1.01
#: A version is worse than another one of the same recording from this ratio of their errors on.
WORSE_VERSION = 1.01


class Errors(Protocol):
    """Error figures, deg/s; None where one is not known."""

    @property
    def raw_rms_dps(self) -> float | None:
        """RMS error of the output without correction."""

    @property
    def rms_dps(self) -> float | None:
        """RMS error on the data of the fit."""

    @property
    def heldout_rms_dps(self) -> float | None:
        """RMS error on temperatures left out of the fit."""


def worse_than_raw(error: Errors, *, late: bool = False) -> list[Finding]:
    """Return a finding, a certain one, where a fit leaves more of its own data than there was without correction.

    With `late`, of a fit without delay and bandwidth to rates that change, these are the likely cause.
    """
    raw, residual_dps = error.raw_rms_dps, error.rms_dps
    if raw is None or residual_dps is None or not residual_dps > (1.0 + ROUNDING) * raw:
        return []
    return [
        Finding(
            "worse", "likely" if late else "certain", "fit",
            f"the residual of the model on the data of the fit is {residual_dps:.4g} deg/s RMS, but the error without "
            f"correction is only {raw:.4g} deg/s", residual_dps, "deg/s", f"less than {raw:.4g} deg/s",
            "add time_delay and bandwidth to the effects" if late
            else "check sign, unit and axes of the output, or choose another model",
        )
    ]  # fmt: skip


def worse_than_before(before: Errors, after: Errors) -> list[Finding]:
    """Return findings where a changed model is worse than the one it was made from, or predicts no better."""
    findings = worse_than_raw(after)
    first, second = before.rms_dps, after.rms_dps
    if first is not None and second is not None and second > WORSE * first:
        findings.append(_of_change(f"the RMS error rises from {first:.4g} to {second:.4g} deg/s", first, second))
    first, second = before.heldout_rms_dps, after.heldout_rms_dps
    if first is not None and second is not None and second >= first:
        rises = second > (1.0 + ROUNDING) * first
        text = f"the RMS error on data left out of the fit {'rises' if rises else 'does not fall'}"
        findings.append(_of_change(f"{text}: {first:.4g} deg/s before, {second:.4g} deg/s after", first, second))
    return findings


def _of_change(text: str, first: float, second: float) -> Finding:
    return Finding(
        "worse", "likely", "change", text, second, "deg/s", f"less than {first:.4g} deg/s", "keep the model unchanged"
    )


def worse_than_version(other: Errors, errors: Errors) -> str:
    """Return in words by which error a version is worse than another one of the same recording; empty where it is not.

    The held-out error decides; where one of them has none, the error of their own data.
    """
    for name, first, second in (
        ("RMS error on data left out of the fit", other.heldout_rms_dps, errors.heldout_rms_dps),
        ("RMS error", other.rms_dps, errors.rms_dps),
    ):
        if first is not None and second is not None:
            text = f"the version's {name}, {second:.4g} deg/s, is larger than the {first:.4g} deg/s"
            return text if second > WORSE_VERSION * first else ""
    return ""
