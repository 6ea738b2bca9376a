"""A stop that the supervisor has carried out while the web process was late, and then passed on to it, is one stop."""

from __future__ import annotations

import os
import signal
import threading
from pathlib import Path

import httpx

from tests.helpers.patience import WAIT_S
from tests.helpers.processes import running
from tests.helpers.simulator_process import Simulator
from tests.helpers.stopped_table import ABORT, ended, stopped, stops, turning, wait_until
from tests.helpers.waiting import before_next_request


def test_a_stop_that_is_passed_on_to_the_web_process_is_recorded_once(tmp_path: Path) -> None:
    simulator = Simulator(tmp_path)
    try:
        with running(tmp_path / "lab.sqlite", "--bench", str(simulator.bench)) as service:
            campaign = turning(service, simulator)
            os.kill(service.web_pid, signal.SIGSTOP)
            answers: list[httpx.Response] = []

            def ask() -> None:
                url = f"{service.url}/api/campaigns/{campaign}/abort"  # a new connection, which the supervisor accepts
                answers.append(httpx.post(url, json={"reason": "a hand in the bench", "by": "Ada"}, timeout=WAIT_S))

            asking = threading.Thread(target=ask, daemon=True)
            asking.start()
            wait_until(simulator, lambda lines: any(ABORT in line["heard"] for line in lines))
            os.kill(service.web_pid, signal.SIGCONT)
            asking.join(WAIT_S)
            stopped(simulator)
            assert answers[0].status_code == 200, answers[0].text
            assert ended(service, campaign)["state"] == "aborted"
            for _ in range(20):
                before_next_request()
            assert [row.detail["reason"] for row in stops(service)] == ["a hand in the bench (Ada)"]
    finally:
        simulator.close()
