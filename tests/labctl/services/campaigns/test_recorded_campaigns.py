"""Wire logs of a service's campaigns, of a resumed campaign and of a live calibration; a stop by another thread."""

from __future__ import annotations

import gzip
import json
import tempfile
import threading
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from instruments.clock import VirtualClock
from instruments.conformance.described import Tried
from labctl.answers.campaigns import CampaignRequest, ResumeRequest
from labctl.cli.app import app
from labctl.errors import BadInput
from labctl.processes.settings import ServeRequest
from labctl.services.benches import described_instruments
from labctl.services.benches.described_instruments import check_description
from labctl.services.campaigns.bench_runner import BenchRunner
from labctl.services.campaigns.recorded_campaigns import RecordedCampaigns
from labctl.services.live.gyro_source import recorded_source
from labctl.services.planning.loading import load_bench
from labctl.services.wire_replay import replay
from labctl.stop.latch import StopRequest
from labctl.store import open_store
from tests.helpers.wire_sessions import RECIPE

BENCH = load_bench("single-axis-sim")


def lines(file: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in gzip.decompress(file.read_bytes()).splitlines()]


def ended(runner: BenchRunner) -> None:
    job = runner._job
    if job is not None and job.thread is not None:
        job.thread.join()


def stopped_on_its_way(runner: BenchRunner, request: CampaignRequest) -> int:
    """Run a campaign up to its first data set, where it waits until it is asked to stop; returns its number."""
    reached, asked = threading.Event(), threading.Event()

    def wait_in_a_data_set() -> None:
        job = runner._job
        if job is not None and job.progress is not None and job.progress.step_text.startswith("data set"):
            reached.set()
            assert asked.wait(60.0)

    end = runner.listen(wait_in_a_data_set)
    campaign = runner.start(request).id
    assert reached.wait(60.0)
    runner.stop_latch.prepare()
    runner.abort(campaign, StopRequest.new("Ada", "key", "test of the stop", campaign, holds=False))
    asked.set()
    ended(runner)
    end()
    return campaign


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The logs of a service that has run a campaign, stopped a second one, and resumed that."""
    folder = tmp_path_factory.mktemp("logged")
    request = CampaignRequest(recipe=RECIPE, fit=False)
    with open_store(str(folder / "lab.sqlite"), write=True) as store:
        runner = BenchRunner(store, BENCH, VirtualClock, wire_logs=folder / "logs", safe_within_s=0.0)
        runner.start(request)
        ended(runner)
        second = stopped_on_its_way(runner, request)
        runner.resume(second, ResumeRequest(by="Ada", power="kept"))
        ended(runner)
        runner.close()
    return folder / "logs"


def test_each_campaign_of_a_service_has_a_log_of_its_own(logs: Path) -> None:
    names = ["campaign-1.jsonl.gz", "campaign-2-resumed.jsonl.gz", "campaign-2.jsonl.gz"]
    assert sorted(file.name for file in logs.iterdir()) == names
    results = {name: lines(logs / name)[-1]["result"]["state"] for name in names}
    assert results == dict(zip(names, ("done", "done", "aborted"), strict=True))


def test_a_campaign_of_a_service_is_replayed_bit_for_bit(logs: Path) -> None:
    answer = replay(logs / "campaign-1.jsonl.gz")
    assert (answer.ok, answer.difference, answer.remarks) == (True, "", [])
    assert answer.found is not None
    assert answer.found.readings > 0


def test_the_safe_state_after_a_stop_is_in_the_log(logs: Path) -> None:
    events = lines(logs / "campaign-2.jsonl.gz")[1:-1]
    table, chamber = BENCH.table, BENCH.chamber
    assert table is not None
    assert chamber is not None
    asked = [each["port"] for each in events if each["did"] == "sent"]
    assert set(asked[-10:]) >= {table.port, chamber.host or chamber.port}


def test_a_resumed_campaign_is_recorded_and_not_replayed(logs: Path) -> None:
    file = logs / "campaign-2-resumed.jsonl.gz"
    assert lines(file)[0]["session"] == {"kind": "campaign resume", "campaign": 2}
    with pytest.raises(BadInput, match=r"session of kind 'campaign resume'.* cannot be replayed; read it with `zcat"):
        replay(file)


def test_a_folder_that_cannot_be_made_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    store: Any = None
    with pytest.raises(BadInput, match=r"--wire-logs .*file/logs: the folder cannot be made \(Not a directory\)"):
        RecordedCampaigns(store, tmp_path / "file" / "logs")
    with pytest.raises(BadInput, match="this service drives no bench"):
        ServeRequest(wire_logs=tmp_path).check()


def test_the_stream_of_a_live_calibration_is_recorded(tmp_path: Path) -> None:
    file = tmp_path / "live.jsonl.gz"
    with recorded_source(load_bench("poses-sim"), None, VirtualClock(), file) as source:
        source.start()
        taken = sum(len(source.read(0.5)) for _ in range(4))
        source.stop()
    header, *events, end = lines(file)
    assert (header["session"]["kind"], end["did"]) == ("live", "ended")
    assert taken > 0
    assert [each["did"] for each in events if each["port"].startswith("sim://")][:1] == ["opened"]
    assert events[-1]["did"] == "closed"
    assert any(each["did"] == "arrived" and ("text" in each or "hex" in each) for each in events)


def test_a_description_that_is_tried_on_an_instrument_is_recorded(tmp_path: Path) -> None:
    file = tmp_path / "tried.jsonl.gz"
    clock = VirtualClock()
    answer = check_description("thermotron", None, "127.0.0.1:1", clock=clock, wire_log=file)  # no one listens there
    assert not answer.ok
    header, *events, end = lines(file)
    assert header["session"]["kind"] == "driver test"
    assert header["session"]["description"]["name"] == answer.name
    assert {each["did"] for each in events} == {"failed"}
    assert end["did"] == "ended"
    with pytest.raises(BadInput, match="kind 'driver test'"):
        replay(file)
    with pytest.raises(BadInput, match="nothing is sent without an instrument"):
        check_description("thermotron", None, None, wire_log=file)


def test_a_description_that_fails_leaves_a_log_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    clock = VirtualClock()
    answer = check_description("thermotron", None, "127.0.0.1:1", clock=clock)
    (file,) = tmp_path.iterdir()
    assert answer.wire_log == str(file)
    assert lines(file)[0]["session"]["kind"] == "driver test"
    file.unlink()
    assert check_description("thermotron", None, None).wire_log is None  # nothing was sent
    with monkeypatch.context() as patched:
        patched.setattr(described_instruments, "try_description", lambda *_a, **_k: [Tried("air", "21.0", "")])
        assert check_description("thermotron", None, "127.0.0.1:1", clock=clock).wire_log is None
    assert not list(tmp_path.iterdir())


def test_lines_of_another_program_are_not_recorded(tmp_path: Path) -> None:
    said = CliRunner().invoke(app, ["live", "U-1", "--lines", "-", "--wire-log", str(tmp_path / "live.jsonl.gz")])
    assert said.exit_code == 2
    assert "keep them with `tee`" in said.stderr
