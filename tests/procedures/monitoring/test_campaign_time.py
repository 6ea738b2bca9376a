"""Campaign time: from the beginning of a campaign, on through an interruption."""

from __future__ import annotations

import numpy as np

from instruments.clock import VirtualClock
from procedures.monitoring.campaign_time import CampaignTime


def clock_at(now_s: float) -> VirtualClock:
    clock = VirtualClock()
    clock.sleep(now_s)
    return clock


def test_a_new_campaign_counts_from_its_beginning() -> None:
    clock = clock_at(100.0)
    time = CampaignTime(clock)
    clock.sleep(20.0)
    time.begin()
    clock.sleep(5.0)
    assert time.now_s() == 5.0
    assert time.of(np.array([120.0, 121.5])).tolist() == [0.0, 1.5]


def test_a_resumed_campaign_counts_on() -> None:
    clock = clock_at(100.0)
    time = CampaignTime(clock, elapsed_s=3600.0)
    clock.sleep(5.0)
    time.begin()
    assert time.now_s() == 3605.0
    assert time.of(100.0) == 3600.0
