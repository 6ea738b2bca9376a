"""An abort comes in two parts, first the stop: a campaign that ends between them was aborted by it, once."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from instruments.clock import VirtualClock
from labctl.errors import Conflict
from labctl.services.campaigns.bench_runner import BenchRunner
from labctl.services.commands.context import CommandContext
from labctl.services.commands.requests import ToCampaign
from labctl.services.commands.service_control import ServiceControl
from labctl.services.planning.loading import load_bench
from labctl.services.schemas.campaigns import CampaignRequest, ReasonRequest
from labctl.stop.latch import StopRequest
from labctl.store import Store, open_store


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as opened:
        yield opened


def test_a_campaign_that_ended_by_the_stop_is_answered_and_written_down_and_the_next_abort_is_refused(
    store: Store,
) -> None:
    runner = BenchRunner(store, load_bench("single-axis-sim"), VirtualClock)
    control = ServiceControl(runner)
    context = CommandContext(lambda: store, VirtualClock(), control)
    campaign = runner.start(CampaignRequest(recipe="short")).id
    assert runner.stops.request(StopRequest.new("Ada", "key", "tea", campaign)).campaign == campaign
    runner.close()  # the campaign is over, in the safe state
    asked = ToCampaign(campaign, ReasonRequest(reason="tea"))
    answer = control.abort(context, asked)
    assert (answer.state, "tea" in answer.reason) == ("aborted", True)
    assert [row.action for row in store.audit.rows()].count("campaign abort") == 1
    with pytest.raises(Conflict, match="has already ended"):
        control.abort(context, asked)
