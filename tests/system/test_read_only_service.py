"""`labctl serve --read-only` in real processes: several on one port, before a replica that its server streams to."""

from __future__ import annotations

import json
import os
import signal
from datetime import UTC, datetime
from pathlib import Path

import httpx
import pytest
import sqlalchemy as sa

from labctl.answers.admin import KeyRequest, Role
from labctl.errors import BadInput, StoreError
from labctl.processes.listening import listening
from labctl.processes.read_only_supervisor import serve_read_only
from labctl.processes.settings import ServeRequest
from labctl.services.admin.api_keys import create_key
from labctl.store import open_store
from studies.postgresql_cluster import Cluster
from tests.helpers.patience import WAIT_S
from tests.helpers.processes import begin_loaded, first_line, kill
from tests.helpers.waiting import eventually

AT = datetime(2026, 1, 5, 8, tzinfo=UTC)
LAB = "http://lab.example:8420"


@pytest.mark.slow
def test_two_processes_serve_a_replica_and_a_killed_one_is_replaced(cluster: Cluster) -> None:
    url = cluster.new_database()
    with open_store(url, write=True) as store:
        key = create_key(store, KeyRequest(name="robot", role=Role.OPERATOR), AT).key
    before = rows_of(url)
    with cluster.replica() as copy:
        replica = copy.url(sa.make_url(url).database or "")
        options = ("--read-only", "--processes", "2", "--require-keys", "--acts-at", LAB, "--port", "0", "--json")
        service = begin_loaded(["serve", *options, "--database", replica])
        try:
            ready = json.loads(first_line(service))
            assert ready["bench_pid"] is None
            assert len(set(ready["web_pids"])) == 2
            with httpx.Client(
                base_url=ready["url"], timeout=WAIT_S, headers={"Authorization": f"Bearer {key}"}
            ) as http:
                health = http.get("/health").json()
                assert (health["read_only"], health["replica"]["is_connected"]) == (True, True)
                refused = http.post("/api/batches", json={"batch": "B", "serials": ["G"]})
                assert (refused.status_code, refused.json()["acts_at"]) == (403, LAB)
                with open_store(url, write=True) as store:  # the server goes on to write, and the replica follows
                    create_key(store, KeyRequest(name="later", role=Role.APPROVER), AT)
                eventually(lambda: rows_of(replica) > before)
                assert http.get("/api/audit").json()[-1]["subject"] == "key later"
            os.kill(ready["web_pids"][0], signal.SIGKILL)
            for _ in range(8):  # connections that the kernel gives to the socket of either process
                answer = httpx.get(f"{ready['url']}/health", timeout=WAIT_S)
                assert answer.json()["status"] == "ok"
            service.send_signal(signal.SIGTERM)
            assert service.wait(WAIT_S) == 0
        finally:
            kill(service)


def rows_of(url: str) -> int:
    """Return how many rows the audit trail has, in which every act leaves one."""
    with open_store(url, write=False, read_only=True) as store:
        return len(store.audit.rows())


def test_a_port_that_is_in_use_is_not_shared_with_another_service() -> None:
    with listening("127.0.0.1", 0, shared=True) as taken:
        request = ServeRequest(port=taken.port, read_only=True, processes=2, database="absent.sqlite")
        with pytest.raises(BadInput, match=f"--port {taken.port} on 127.0.0.1: .*; give another port"):
            serve_read_only(request, lambda _: None)


@pytest.mark.slow
def test_a_database_that_is_not_there_is_refused_in_one_line(tmp_path: Path) -> None:
    request = ServeRequest(port=0, read_only=True, database=str(tmp_path / "absent.sqlite"))
    with pytest.raises(StoreError, match="there is no such file, and a service that only reads makes none"):
        serve_read_only(request, lambda _: None)
