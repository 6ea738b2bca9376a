"""A campaign whose PostgreSQL server cannot be reached for longer than it waits: safe, then resumed by itself."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
import sqlalchemy as sa

from instruments.clock import VirtualClock
from labctl.answers.campaigns import CampaignRequest
from labctl.services.campaigns.bench_runner import BenchRunner
from labctl.services.planning.loading import load_bench
from labctl.store import open_store
from labctl.store.connection import database, postgresql_server
from labctl.store.connection.database import Database
from labctl.store.repositories.campaign_journal import StoreJournal
from procedures.contracts.campaign_state import CampaignState
from studies.crashable_process import all_readings, complete_data_sets
from studies.network_cut import Network, network_to
from studies.postgresql_cluster import Cluster

pytestmark = [
    pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning"),
]
BENCH = load_bench("single-axis-sim")
DATA_SETS = 15


@pytest.fixture
def network(cluster: Cluster) -> Iterator[Network]:
    with network_to(cluster.socket) as made:
        yield made


@pytest.fixture
def location(network: Network, url: str, monkeypatch: pytest.MonkeyPatch) -> str:
    """A database behind the network, for which a writer waits 0.3 s."""
    monkeypatch.setattr(postgresql_server, "WRITER_PATIENCE_S", 0.3)
    monkeypatch.setattr(database, "RETRY_S", 0.05)
    return sa.make_url(url).set(host="127.0.0.1", port=network.port, query={}).render_as_string(hide_password=False)


def ended(runner: BenchRunner) -> CampaignState:
    """Wait for the end of the campaign that runs; returns how its engine has ended it."""
    job = runner._job
    assert job is not None
    assert job.thread is not None
    job.thread.join()
    assert job.progress is not None
    return job.progress.state


@pytest.mark.slow
@pytest.mark.parametrize("cut_at", ["data set", "end"])
def test_a_campaign_whose_server_was_away_is_resumed_by_itself(
    network: Network, location: str, url: str, monkeypatch: pytest.MonkeyPatch, cut_at: str
) -> None:
    method = "dataset_closed" if cut_at == "data set" else "campaign_state"
    before = getattr(StoreJournal, method)
    cuts = 0

    def cut_first(self: StoreJournal, *given: object, **named: object) -> None:
        nonlocal cuts
        if not cuts and given[0] in {4, CampaignState.DONE}:
            cuts += 1
            network.cut()
        before(self, *given, **named)

    monkeypatch.setattr(StoreJournal, method, cut_first)
    with open_store(location, write=True) as store:
        runner = BenchRunner(store, BENCH, VirtualClock)
        campaign = runner.start(CampaignRequest(recipe="short")).id
        found = ended(runner)
        assert (found, cuts) == (CampaignState.INTERRUPTED if cut_at == "data set" else CampaignState.DONE, 1)
        here = Database(url, write=False)  # past the cut
        readings = all_readings(here)
        assert readings
        network.mend()
        runner.resume_interrupted()
        resumed = runner._job  # None where it has ended already: only its end was to be written
        if resumed is not None and resumed.thread is not None:
            resumed.thread.join()
        row = store.campaigns.get(campaign)
        assert row.state is CampaignState.DONE, row.reason
        assert store.benches.unconfirmed(BENCH.name) == ""
        assert complete_data_sets(here) == dict.fromkeys(range(1, DATA_SETS + 1), 1)
        assert readings <= all_readings(here)
        assert store.audit.first_broken() is None
        here.close()
