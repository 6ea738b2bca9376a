"""Drift between certificates: what is predicted, how well, and that an unknown drift is said to be unknown."""

from __future__ import annotations

from datetime import date, timedelta

import numpy as np
import pytest

from labctl.errors import BadInput
from labctl.metrology.certificate_drift import YEAR, CertifiedValue, predicted

FIRST = date(2024, 1, 10)


def after(years: float) -> date:
    return FIRST + timedelta(days=round(years * YEAR.days))


def test_one_certificate_has_an_unknown_drift_and_not_none() -> None:
    found = predicted([CertifiedValue(FIRST, 0.010, 0.005)], after(3))
    assert (found.value, found.u, found.drift) == (0.010, 0.005, None)
    assert found.why == "drift unknown: one certificate; u holds no contribution of a drift"


def test_a_line_through_two_certificates_grows_in_its_uncertainty() -> None:
    certificates = [CertifiedValue(FIRST, 0.010, 0.003), CertifiedValue(after(1), 0.020, 0.004)]
    found = predicted(certificates, after(2))
    years = (after(1) - FIRST) / YEAR
    assert found.drift is not None
    assert found.drift.per_year == pytest.approx(0.010 / years)
    assert found.drift.u_per_year == pytest.approx(0.005 / years)
    # by hand: x = x2 + (x2 - x1) h, u^2 = u2^2 (1 + h)^2 + u1^2 h^2
    h = (after(2) - after(1)) / (after(1) - FIRST)
    assert found.value == pytest.approx(0.020 + 0.010 * h)
    assert found.u == pytest.approx(np.hypot(0.004 * (1 + h), 0.003 * h))
    assert predicted(certificates, after(5)).u > found.u > predicted(certificates, after(1.5)).u


def test_many_certificates_do_not_make_a_value_better_than_the_newest_of_them() -> None:
    certificates = [CertifiedValue(after(n), 0.01 * n, 0.004) for n in range(12)]
    found = predicted(certificates, after(11.2))
    assert found.u == 0.004
    assert found.drift is not None
    assert abs(found.drift.per_year) > 2.0 * found.drift.u_per_year


def test_certificates_that_scatter_more_than_they_state_widen() -> None:
    values = [0.00, 0.05, 0.00, 0.05]
    certificates = [CertifiedValue(after(n), value, 0.005) for n, value in enumerate(values)]
    found = predicted(certificates, after(4)).drift
    assert found is not None
    assert found.birge_ratio > 4
    assert found.u_per_year > 4 * 0.005 / np.sqrt(5)  # sum of (t - mean)^2 of four years is 5


def test_no_drift_leads_across_an_adjustment() -> None:
    before = [CertifiedValue(FIRST, 0.0, 0.005), CertifiedValue(after(1), 0.1, 0.005)]
    new = CertifiedValue(after(2), 0.0, 0.005, after_adjustment=True)
    found = predicted([*before, new], after(2.5))
    assert (found.value, found.drift) == (0.0, None)
    assert "since the last adjustment" in found.why
    assert predicted([*before, new], after(1.5)).value == pytest.approx(0.15, abs=0.01)  # before it: by the others


def test_certificates_without_a_value_say_so() -> None:
    found = predicted([CertifiedValue(FIRST, None, 0.005), CertifiedValue(after(1), None, 0.006)], after(2))
    assert (found.value, found.u) == (None, 0.006)
    assert "state no value" in found.why


def test_what_is_no_certificate_is_refused() -> None:
    with pytest.raises(BadInput, match="no certificate to predict from"):
        predicted([], FIRST)
    with pytest.raises(BadInput, match="give a number above 0"):
        predicted([CertifiedValue(FIRST, 0.0, 0.0)], FIRST)


@pytest.mark.parametrize("common", [0.0, 0.5, 0.9])
@pytest.mark.parametrize("at", [2.0, 3.5, 6.0])
def test_twice_u_covers_the_truth_whatever_share_the_certificates_have_in_common(common: float, at: float) -> None:
    """Standards that drift, four certificates each, of whose variance a share is one error of the laboratory."""
    random, u, inside, trials = np.random.default_rng(3), 0.01, 0, 600
    for _ in range(trials):
        start, slope = random.normal(0.0, 0.1, 2)
        shared = random.normal(0.0, u * np.sqrt(common))
        own = random.normal(0.0, u * np.sqrt(1 - common), 4)
        certificates = [CertifiedValue(after(n), start + slope * n + shared + own[n], u) for n in range(4)]
        found = predicted(certificates, after(at))
        assert found.value is not None
        truth = start + slope * ((after(at) - FIRST) / YEAR)
        inside += abs(found.value - truth) <= 2 * found.u
    assert inside / trials >= 0.94
