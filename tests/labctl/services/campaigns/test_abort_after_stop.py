"""An abort comes in two parts, first the stop: a campaign that ends between them was aborted by it, once."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

import pytest

from instruments.clock import VirtualClock
from labctl.answers.campaigns import CampaignRequest, ReasonRequest
from labctl.errors import Conflict
from labctl.services.campaigns.bench_runner import BenchRunner
from labctl.services.campaigns.preparation import prepare
from labctl.services.campaigns.unattended import abort_abandoned
from labctl.services.commands.acts.abort import ABORT
from labctl.services.commands.context import CommandContext
from labctl.services.commands.requests import ToCampaign
from labctl.services.commands.service_control import ServiceControl
from labctl.services.planning.loading import load_bench
from labctl.stop.latch import StopRequest
from labctl.store import Store, open_store
from procedures.contracts.campaign_state import CampaignState

AT = datetime(2026, 1, 5, 8, tzinfo=UTC)


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
    answer = control.perform(ABORT, context, asked)
    assert (answer.state, "tea" in answer.reason) == ("aborted", True)
    assert [row.action for row in store.audit.rows()].count("campaign abort") == 1
    with pytest.raises(Conflict, match="has already ended"):
        control.perform(ABORT, context, asked)


def test_a_stop_that_the_latch_has_is_recorded_once_for_a_campaign_that_no_process_runs(store: Store) -> None:
    bench = load_bench("single-axis-sim")
    prepared = prepare(store, "short", bench, VirtualClock(), clip=False)
    store.campaigns.journal(prepared.id).campaign_state(CampaignState.RUNNING, "started", 0.0, AT)
    prepared.bench.close()
    runner = BenchRunner(store, bench, VirtualClock)
    stop = StopRequest.new("Ada", "key", "a hand in the bench (Ada)", prepared.id)
    runner.stop_latch.place.latch.request(stop)
    assert abort_abandoned(store, prepared.id, stop.reason, AT, runner.stop_latch).state == "aborted"
    runner.stops.carry_out()
    rows = [row for row in store.audit.rows() if row.action == "campaign abort"]
    assert [(row.who, row.detail["stop"]) for row in rows] == [("Ada", stop.id)]
    runner.close()
