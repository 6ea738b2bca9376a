"""The Allan deviation against AllanTools, and against the deviations printed in NIST Special Publication 1065."""

from __future__ import annotations

import allantools
import numpy as np
import pytest

from labctl.fitting.numeric.allan import allan, overlapping_variance


@pytest.mark.parametrize("slope", [0.0, 1.0, 2.0])
def test_deviations_are_those_of_allantools(slope: float) -> None:
    rng = np.random.default_rng(3)
    white = rng.normal(0, 0.01, 20_000)
    series = white if slope == 0 else np.cumsum(white) if slope == 2 else white + 1e-4 * np.cumsum(white)
    found = allan(series, 0.02)
    assert found is not None
    taus, theirs, _, _ = allantools.oadev(series, rate=50.0, data_type="freq", taus=found.tau_s)
    assert taus == pytest.approx(found.tau_s)
    assert found.deviation_dps == pytest.approx(theirs, rel=1e-9)


def test_deviations_are_those_printed_by_nist() -> None:
    """The 1000-point set of NIST SP 1065, table 31: overlapping Allan deviations at 1, 10 and 100."""
    numbers = [1234567890]
    for _ in range(999):
        numbers.append(16807 * numbers[-1] % 2147483647)
    series = np.array(numbers) / 2147483647
    found = [np.sqrt(overlapping_variance(series, m)) for m in (1, 10, 100)]
    assert found == pytest.approx([2.922319e-01, 9.159953e-02, 3.241343e-02], rel=1e-6)
