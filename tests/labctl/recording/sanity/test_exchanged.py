"""Exchanged outputs: how much their noises have to differ where many places are compared."""

from __future__ import annotations

from statistics import NormalDist

import pytest

from labctl.recording.sanity.readings.exchanged import _noise_changes
from labctl.recording.sanity.readings.factors import NOISE_CHANGES


@pytest.mark.parametrize("places", [1, 100, 5000])
def test_all_places_together_find_by_chance_as_rarely_as_one(places: int) -> None:
    at_each = 2.0 * NormalDist().cdf(-_noise_changes(places))
    assert places * at_each == pytest.approx(2.0 * NormalDist().cdf(-NOISE_CHANGES))
    assert _noise_changes(places) >= NOISE_CHANGES - 1e-9
