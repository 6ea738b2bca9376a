"""The drift of a reference standard: a straight line through its certificates, and what it predicts for a day.

The weights are the stated uncertainties. They are independent in the slope, which is the larger uncertainty of the two
that are possible: an error that all certificates share leaves the slope as it is. It does not leave the value as it is,
so the uncertainty of a predicted value is never less than that of the certificate before it, however many there are.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date, timedelta

import numpy as np

from labctl.errors import BadInput

YEAR = timedelta(days=365.25)
#: Certificates without which a drift is not known.
MIN_CERTIFICATES = 2


@dataclass(frozen=True)
class CertifiedValue:
    """What a certificate states at one nominal: value with its standard uncertainty, in one unit."""

    on: date  #: day of the calibration
    value: float | None  #: None: the certificate states an uncertainty only
    u: float
    after_adjustment: bool = False  #: the standard was adjusted or repaired before: no drift leads across it


@dataclass(frozen=True)
class Drift:
    """Slope of the line through certificates, per year, with its standard uncertainty."""

    per_year: float
    u_per_year: float
    certificates: int
    birge_ratio: float  #: by which the certificates scatter more than they state, 1 where they do not


@dataclass(frozen=True)
class Prediction:
    """Value and standard uncertainty of a standard on a day."""

    on: date
    value: float | None
    u: float
    drift: Drift | None  #: None: not known, `why` says why; `u` then holds no drift
    why: str = ""


def predicted(certificates: Sequence[CertifiedValue], on: date) -> Prediction:
    """Return what certificates of one quantity at one nominal predict for a day.

    With fewer than two values since the last adjustment the drift is unknown, and the prediction is that of the newest
    certificate. Certificates of later days count as well: a day between two is interpolated. Raises BadInput without a
    certificate, and for an uncertainty that is not a number above 0.
    """
    if not certificates:
        raise BadInput(f"no certificate to predict from on {on}; add one with `labctl standards certificate`")
    ordered = sorted(certificates, key=lambda certificate: certificate.on)
    for each in ordered:
        if not (math.isfinite(each.u) and each.u > 0):
            raise BadInput(f"certificate of {each.on}: u = {each.u:g} is no uncertainty; give a number above 0")
    before = next((each for each in reversed(ordered) if each.on <= on), ordered[0])
    same = _since_adjustment(ordered, before)
    valued = [each for each in same if each.value is not None]
    if len({each.on for each in valued}) < MIN_CERTIFICATES:
        return Prediction(on, before.value, before.u, None, _why(same, valued))
    return _on_line(valued, before, on)


def _since_adjustment(ordered: Sequence[CertifiedValue], before: CertifiedValue) -> list[CertifiedValue]:
    """Return the certificates that no adjustment separates from the one before the day."""
    at = ordered.index(before)
    first = max((i for i in range(at + 1) if ordered[i].after_adjustment), default=0)
    last = next((i for i in range(at + 1, len(ordered)) if ordered[i].after_adjustment), len(ordered))
    return list(ordered[first:last])


def _why(repeats: Sequence[CertifiedValue], valued: Sequence[CertifiedValue]) -> str:
    if len(valued) < len(repeats):
        return "drift unknown: the certificates state no value, only an uncertainty"
    since = " since the last adjustment" if repeats[0].after_adjustment else ""
    return f"drift unknown: one certificate{since}; u holds no contribution of a drift"


def _on_line(valued: Sequence[CertifiedValue], before: CertifiedValue, on: date) -> Prediction:
    """Return the prediction by the weighted line through values of at least two days."""
    time = np.array([(each.on - on) / YEAR for each in valued])  # 0 is the day itself: its value is the intercept
    values = np.array([each.value for each in valued], dtype=np.float64)
    root = 1.0 / np.array([each.u for each in valued])
    columns = np.column_stack([root, root * time])
    covariance = np.linalg.inv(columns.T @ columns)
    coefficients = covariance @ (columns.T @ (root * values))
    residual = root * values - columns @ coefficients
    freedom = len(valued) - 2
    birge = max(1.0, math.sqrt(float(residual @ residual) / freedom)) if freedom > 0 else 1.0
    u_value, u_slope = birge * np.sqrt(np.diag(covariance))
    drift = Drift(float(coefficients[1]), float(u_slope), len(valued), birge)
    return Prediction(on, float(coefficients[0]), max(float(u_value), before.u), drift)
