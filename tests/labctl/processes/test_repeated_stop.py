"""A stop that comes by the supervisor and again by the web process is carried out and recorded as one."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from unittest.mock import patch

import pytest

from labctl.processes import remote_bench
from labctl.processes.remote_bench import RemoteControl
from labctl.stop.latch import StopRequest
from labctl.stop.places import BenchPlace


class Attempt:
    """A stop attempt that reaches nothing: it writes down the stop, as every attempt does."""

    text = ""

    def __init__(self, place: BenchPlace, stop: StopRequest) -> None:
        place.latch.request(stop)

    def is_heard(self, _within_s: float) -> bool:
        return False


@pytest.fixture
def ask(tmp_path: Path) -> Iterator[Callable[[str, int], int]]:
    """Ask for a stop of a campaign; returns how many stops the latch then knows."""
    place = BenchPlace(tmp_path / "bench")
    control = RemoteControl(tmp_path, None, place)

    def asked(reason: str, campaign: int) -> int:
        control._attempt(reason, campaign)
        return len(place.latch.state().known)

    with patch.object(remote_bench, "StopAttempt", Attempt):
        yield asked
    control.close()


def test_the_same_stop_again_is_one(ask: Callable[[str, int], int]) -> None:
    assert [ask("smoke (Ada)", 1), ask("smoke (Ada)", 1)] == [1, 1]


def test_another_reason_or_campaign_is_another_stop(ask: Callable[[str, int], int]) -> None:
    assert [ask("smoke (Ada)", 1), ask("smoke (Bo)", 1), ask("smoke (Ada)", 2)] == [1, 2, 3]


def test_a_later_stop_is_another(tmp_path: Path, ask: Callable[[str, int], int]) -> None:
    stop = StopRequest.new("Ada", "stop page", "smoke (Ada)", 1)
    before = (datetime.now(UTC) - timedelta(seconds=20)).isoformat()
    BenchPlace(tmp_path / "bench").latch.request(replace(stop, at=before))
    assert ask("smoke (Ada)", 1) == 2
