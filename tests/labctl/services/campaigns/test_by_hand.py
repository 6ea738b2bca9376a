"""Campaigns of turns by hand: from the bytes of a simulated gyro to a calibration, over HTTP, and after a kill."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fastapi.testclient import TestClient
from typer.testing import CliRunner

from instruments.bench_config import BenchFile, read_bench
from instruments.clock import SystemClock, VirtualClock
from labctl.answers.campaigns import ResumeRequest
from labctl.api import create_app
from labctl.cli.app import app
from labctl.fitting import fit
from labctl.recording import to_points, write_recording
from labctl.services.benches.start_confirmation import start_questions
from labctl.services.campaigns import preparation
from labctl.services.campaigns.bench_runner import BenchRunner
from labctl.services.campaigns.execution import run
from labctl.services.campaigns.plan_view import campaign_plan
from labctl.services.campaigns.preparation import prepare
from labctl.services.campaigns.resume import resume_here
from labctl.services.lab_service import LabService
from labctl.services.recordings.loading import points_of
from labctl.services.recordings.transfer import import_folder, model_for
from labctl.store import Store, open_store
from labctl.store.connection.database import Database
from tests.helpers.paced_hand import PacedHand
from tests.helpers.service import service_of
from tests.helpers.waiting import wait_until

#: Six positions, one turn each way.
WHOLE = """
name = "whole"
positions = ["x", "-x", "y", "-y", "z", "-z"]
[turns]
turns_deg = [720, -720]
rest_s = 3
"""
ONE = WHOLE.replace('"x", "-x", "y", "-y", "z", "-z"', '"z"').replace("[720, -720]", "[360, -360]")
HIDDEN = 0.02


def bench(seed: int = 1, mistakes: tuple[str, ...] = (), **hidden: float) -> BenchFile:
    file = read_bench("by-hand-sim").model_dump()
    file["simulation"] |= {"seed": seed, "hidden": hidden}
    file["simulation"]["hand"] |= {"mistakes": list(mistakes), "rate_dps": 180.0, "u_deg": 1.0}
    return BenchFile.model_validate(file)


@pytest.mark.slow
def test_a_hidden_scale_error_is_found_within_its_uncertainty(tmp_path: Path) -> None:
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as store:
        made = prepare(store, WHOLE, bench(scale_factor=HIDDEN), VirtualClock(), clip=False)
        answer = run(store, made)
        assert answer.state == "done", answer.reason
        row = store.recordings.get(answer.recordings["STIM-0001"])
        points = points_of(store, row)
        assert model_for(store, row) == "turns"
    assert (points.info.motion, row.datasets) == ("turns", 36)
    assert "chamber_c" not in points.columns
    result = fit(points, "turns")
    truth = made.bench.simulation.world.gyro("mems").truth.k(28.0)  # type: ignore[union-attr]
    for k, axis in enumerate("xyz"):
        found = result.fitted.axes[axis]
        values = dict(zip(found.names, found.values[:, 0], strict=True))
        u = dict(zip(found.names, np.sqrt(np.diag(found.covariance)), strict=True))
        expected = truth[k, k] + HIDDEN - 1.0
        assert u["scale_factor"] == pytest.approx(1.0 / 720 / np.sqrt(4), rel=0.1)
        assert abs(values["scale_factor"] - expected) < 2.0 * u["scale_factor"] < 0.1 * HIDDEN


@pytest.mark.slow
def test_what_was_refused_is_in_the_events_and_not_in_the_recording(tmp_path: Path) -> None:
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as store:
        made = prepare(store, ONE, bench(mistakes=("short", "axis")), VirtualClock(), clip=False)
        recording = run(store, made).recordings["STIM-0001"]
        samples = store.recordings.samples(recording)
        assert sorted(set(np.asarray(samples.columns["turn_deg"]).tolist())) == [-360.0, 0.0, 360.0]
        states = [each.state for each in store.recordings.data_sets(recording)]
        assert states == ["partial"] * 6 + ["complete"] * 6
        refused = [event.message for event in store.campaigns.events(made.id) if event.kind == "turn.refused"]
        assert (
            refused[0]
            == "turn by 360 deg, z up: the unit turned by only 301 deg about axis z instead of 360 deg: turn again"
        )
        assert "deg about axis x, not about axis z: turn again" in refused[1]
        view = campaign_plan(store, made.id)
        assert (view.datasets, view.timeline.turn_deg[2:4]) == (6, [360.0, -360.0])
        # what is exported comes in again as it was
        write_recording(samples, tmp_path / "out", "parquet")
        again = import_folder(store, tmp_path / "out", made.clock.utc())
        both = [to_points(store.recordings.samples(number)).columns for number in (recording, again.recording)]
    for name in ("gyro_z", "turn_deg", "table_rate_dps", "duration_s"):
        assert np.asarray(both[0][name], dtype=float) == pytest.approx(np.asarray(both[1][name], dtype=float))


def test_a_turn_that_a_kill_left_half_done_is_asked_again(tmp_path: Path) -> None:
    """The database as it is in the middle of the second turn is what a kill leaves behind."""
    location, left = tmp_path / "lab.sqlite", tmp_path / "left.sqlite"

    def copy_once(progress: Any) -> None:
        turn = progress.turn
        if turn and turn.asked_deg < 0 and turn.came_deg and turn.came_deg["mems"] < -100 and not left.exists():
            with sqlite3.connect(location) as here, sqlite3.connect(left) as there:
                here.backup(there)

    with open_store(str(location), write=True) as store:
        run(store, prepare(store, ONE, bench(), VirtualClock(), clip=False), observe=copy_once)
    with sqlite3.connect(left) as there:
        assert there.execute("SELECT state FROM steps WHERE kind = 'turn'").fetchall() == [("done",), ("running",)]
    answer = resume_here(str(left), None, None, None, ResumeRequest(by="Ada"))
    assert answer.state == "done", answer.reason
    with open_store(str(left), write=False) as store:
        samples = store.recordings.samples(1)
        sets = store.recordings.data_sets(1)
    assert [each.state for each in sets] == ["complete"] * 3 + ["partial"] * 2 + ["complete"] * 3
    assert sets[4].reason == "the process that took it ended"
    turns = {
        int(n): float(turn) for n, turn in zip(samples.columns["dataset"], samples.columns["turn_deg"], strict=True)
    }
    assert sorted(turns.values()) == [-360.0, 0.0, 0.0, 0.0, 0.0, 360.0]


@pytest.fixture
def client(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[TestClient]:
    monkeypatch.setattr(preparation, "operator_of", lambda opened: PacedHand(opened.unit_handler))
    store = Store(Database(str(tmp_path / "lab.sqlite"), write=True))
    runner = BenchRunner(store, bench(), VirtualClock)
    with TestClient(create_app(LabService(store, SystemClock(), runner))) as opened:
        yield opened


def until(client: TestClient, wanted: Callable[[Any], Any]) -> Any:
    runner = service_of(client).bench_access
    return wait_until(runner.listen, lambda: client.get("/api/campaigns/1").json(), wanted)


def test_a_turn_is_asked_shown_repeated_and_done_over_http(client: TestClient) -> None:
    def confirm(prompt: dict[str, Any], **how: Any) -> Any:
        return client.post("/api/campaigns/1/confirm", json={"prompt": prompt["id"], "by": "Ada", **how})

    client.post("/api/campaigns", json={"recipe": ONE.replace("[360, -360]", "[360]")}).raise_for_status()
    placed = until(client, lambda now: now["prompt"])["prompt"]
    assert (placed["kind"], placed["position"]) == ("mount", "z")
    refused = confirm(placed, again=True)
    assert (refused.status_code, refused.json()["type"]) == (409, "urn:labctl:problem:stale-prompt")
    assert "only a turn can be repeated" in refused.json()["detail"]
    confirm(placed).raise_for_status()
    confirm(until(client, lambda now: now["prompt"] and now["prompt"]["kind"] == "power_on")["prompt"])
    turned = until(client, lambda now: now["turn"] and now["turn"]["came_deg"].get("mems", 0) > 350)
    first = turned["prompt"]
    assert (first["kind"], first["turn_deg"], first["within_s"]) == ("turn", 360.0, 300.0)
    assert (turned["state"], turned["turn"]["phase"], turned["turn"]["attempt"]) == ("waiting", "turn", 1)
    confirm(first, again=True, reason="slipped").raise_for_status()
    second = until(client, lambda now: now["prompt"] and now["prompt"]["id"] != first["id"])
    assert second["prompt"]["text"].startswith("slipped: turn again; turn the units by 360 deg counter-clockwise")
    assert (second["turn"]["attempt"], second["turn"]["refused"]) == (2, "slipped")
    until(client, lambda now: now["turn"] and now["turn"]["came_deg"].get("mems", 0) > 350)
    confirm(second["prompt"]).raise_for_status()
    assert until(client, lambda now: now["ended"])["state"] == "done"


def test_an_abort_over_http_ends_a_turn_that_is_waited_for(client: TestClient) -> None:
    client.post("/api/campaigns", json={"recipe": ONE.replace("rest_s", "within_s = 1e6\nrest_s")}).raise_for_status()
    for kind in ("mount", "power_on"):
        asked = until(client, lambda now, kind=kind: now["prompt"] and now["prompt"]["kind"] == kind)["prompt"]
        client.post("/api/campaigns/1/confirm", json={"prompt": asked["id"], "by": "Ada"})
    until(client, lambda now: now["prompt"] and now["prompt"]["kind"] == "turn")
    ended = client.post("/api/campaigns/1/abort", json={"reason": "enough"}).json()
    assert (until(client, lambda now: now["ended"]) or ended)["state"] == "aborted"


def test_a_bench_without_table_and_chamber_asks_nothing_before_a_start() -> None:
    real = bench().model_dump(exclude={"simulation"})
    real["gyros"][0]["port"] = "/dev/ttyUSB0"
    assert start_questions(BenchFile.model_validate(real)) == {}
    table = {"port": "/dev/ttyS0", "max_rate_dps": 400, "acceleration_dps2": 100}
    assert set(start_questions(BenchFile.model_validate(real | {"table": table}))) == {"table_free"}


def test_which_recipe_needs_what_is_said_in_one_line(tmp_path: Path) -> None:
    runner, database = CliRunner(), ["--database", str(tmp_path / "lab.sqlite")]
    planned = runner.invoke(app, ["campaign", "plan", "by-hand"])
    assert "36 data sets in 20 steps" in planned.output
    refused = runner.invoke(app, ["campaign", "start", "short", "--bench", "by-hand-sim", *database])
    assert refused.exit_code == 2
    assert "rates_dps: a rate table is needed, but the bench has none" in refused.stderr
    checked = runner.invoke(app, ["bench", "check", "by-hand-sim", *database])
    assert (checked.exit_code, "table" in checked.output, "mems" in checked.output) == (0, False, True)
    simulated = runner.invoke(app, ["simulate", "by-hand", "--out", str(tmp_path / "out")])
    assert simulated.exit_code == 2
    assert "turns by hand cannot be simulated without a campaign" in simulated.stderr
