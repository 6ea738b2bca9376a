"""The bench process as the web process sees it: transactions run there, campaigns are controlled, silence is
reported."""

from __future__ import annotations

import pickle
import threading
from collections.abc import Iterator
from datetime import UTC, datetime
from multiprocessing.connection import Client
from pathlib import Path

import pytest

from instruments.clock import VirtualClock, WallClock
from labctl.acting_user import Actor, acting
from labctl.errors import BenchSilent, Conflict, NotFound
from labctl.processes.bench_methods import method_of
from labctl.processes.bench_rpc import BenchRpc
from labctl.processes.driver_note import DriverNoteWriter
from labctl.processes.held_address import HeldAddress
from labctl.processes.remote_bench import RemoteBench, RemoteWriter
from labctl.processes.rpc import RpcServer
from labctl.processes.settings import CALLS, STOP, BenchSettings
from labctl.processes.supervision import Supervision
from labctl.processes.waker import Waker
from labctl.recording import RecordingInfo
from labctl.services.campaigns.bench_runner import BenchRunner
from labctl.services.lab_service import LabService
from labctl.services.local_bench import LocalBench
from labctl.services.planning.loading import load_bench
from labctl.stop.wire import StopServer
from labctl.store import Store, StoreAddress, open_store
from labctl.store.store import REPOSITORIES, transactions

AT = datetime(2026, 1, 5, 8, tzinfo=UTC)
BENCH = load_bench("single-axis-sim")


@pytest.fixture
def folder(tmp_path: Path) -> Iterator[Path]:
    """Sockets of what answers as the bench process does, in this process; the database lies beside them."""
    waker = Waker()
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as store:
        settings = BenchSettings(store.location, BENCH.name, simulate=True, speed=0.0, folder=tmp_path, url="")
        local = LocalBench(store, WallClock(), BenchRunner(store, BENCH, VirtualClock))
        address = HeldAddress(local.request_stop, local.describe_running)
        supervision = Supervision(settings, store, waker, lambda: False, address)
        calls = BenchRpc(store, local, supervision, address, WallClock())
        servers = StopServer(tmp_path / STOP, local.request_stop), RpcServer(tmp_path / CALLS, calls.answer, method_of)
        DriverNoteWriter(settings, store, local).write(settings)
        for server in servers:
            server.start()
        yield tmp_path
        local.close()
        for server in servers:
            server.close()
    waker.close()


@pytest.fixture
def store(folder: Path) -> Iterator[Store]:
    """The database as the web process has it."""
    writer = pickle.loads(pickle.dumps(RemoteWriter(folder)))
    with StoreAddress(str(folder / "lab.sqlite"), writer).open() as opened:
        yield opened
    writer.close()


def test_a_transaction_runs_in_the_bench_process_in_the_name_of_who_asked(store: Store) -> None:
    with acting(Actor("Ada", "key")):
        store.audit.record(AT, "backup", "copy.sqlite", {"bytes": 1})
    (row,) = store.audit.rows()
    assert (row.who, row.action, row.detail["bytes"]) == ("Ada", "backup", 1)
    with pytest.raises(NotFound, match="was never used with this database"):
        store.benches.clear("nowhere", "Ada", "looked", AT)


def test_what_a_killed_web_process_was_importing_is_discarded_by_the_next_one(store: Store) -> None:
    left = store.imports.begin(RecordingInfo(serial="LEFT-1", axes=("z",), kind="samples", started_at=AT), AT)
    assert store.imports.discard_unfinished() == 1
    with pytest.raises(Conflict, match="the import was discarded"):
        store.imports.claim(left)
    assert store.imports.discard_unfinished() == 0


def test_every_transaction_is_a_method_of_a_repository(store: Store) -> None:
    repositories = {type(each).__name__: type(each) for each in (getattr(store, name) for name in REPOSITORIES)}
    assert transactions()
    for name in transactions():
        repository, _, method = name.partition(".")
        assert callable(getattr(repositories[repository], method)), name
    with pytest.raises(KeyError):
        store.run("Audit.rows", (), {})


@pytest.mark.slow
def test_a_campaign_is_started_followed_and_aborted_from_the_web_process(store: Store, folder: Path) -> None:
    access = RemoteBench(folder, BENCH, str(folder / "lab.sqlite"))
    rings = threading.Semaphore(0)
    access.listen(rings.release)
    service = LabService(store, WallClock(), access=access)
    service.start()
    try:
        assert rings.acquire(timeout=20.0)
        from labctl.answers.campaigns import CampaignRequest, ReasonRequest
        from labctl.services.commands.acts.abort import ABORT_CAMPAIGN
        from labctl.services.commands.acts.start import START_CAMPAIGN
        from labctl.services.commands.requests import CampaignStart, ToCampaign

        campaign = service.execute(START_CAMPAIGN, CampaignStart(CampaignRequest(recipe="short"))).id
        while access.runs(campaign):  # until its end is written
            assert rings.acquire(timeout=20.0)
        assert service.status(campaign).state == "done"
        with pytest.raises(Conflict, match=r"has already ended \(done\)"):
            service.execute(ABORT_CAMPAIGN, ToCampaign(campaign, ReasonRequest(reason="tea")))
    finally:
        service.close()


def test_a_bench_process_that_is_sent_what_is_no_call_goes_on(store: Store, folder: Path) -> None:
    transaction = pickle.dumps(("store.Audit.record", (AT, "backup", "x", {})))
    for sent in (transaction, b'[{"call":"store.Audit.rows","actor":{"name":"Eve"}}]\n[[]]', b"\x80\x05."):
        with Client(str(folder / CALLS), "AF_UNIX") as line:
            line.send_bytes(sent)
            assert line.recv_bytes().startswith(b"raised\n")
            with pytest.raises(EOFError):
                line.recv_bytes()
    assert store.audit.rows() == []
    store.audit.record(AT, "backup", "copy.sqlite", {})
    assert [row.action for row in store.audit.rows()] == ["backup"]


def test_a_bench_process_that_was_never_heard_is_silent_and_unconfirmed(tmp_path: Path) -> None:
    access = RemoteBench(tmp_path, BENCH)
    assert (access.running, access.status(1), access.runs(1)) == (None, None, False)
    described = access.describe()
    assert described is not None
    assert described.name == BENCH.name
    with pytest.raises(BenchSilent):
        RemoteWriter(tmp_path).run("Fetches.record", ([],), {})
