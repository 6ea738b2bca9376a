"""Ctrl-C and a request to end, once and impatiently, while a campaign in the foreground turns a table."""

from __future__ import annotations

import signal
import subprocess
from contextlib import suppress

import pytest

from tests.helpers.patience import WAIT_S
from tests.helpers.processes import end_of
from tests.helpers.simulator_process import FIRST_DPS, Simulator

DATABASE = "lab.sqlite"
SAFE = "campaign 1 was stopped; bench single-axis-sim is safe"


@pytest.fixture
def campaign(simulator: Simulator) -> subprocess.Popen[str]:
    """Return the process of a campaign whose table has begun to turn."""
    process = simulator.drive(FIRST_DPS, DATABASE, loads=True)
    simulator.wait_for("!1m1")
    return process


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_ending_it_twice_in_a_row_still_leaves_the_bench_safe(
    campaign: subprocess.Popen[str], simulator: Simulator, number: signal.Signals
) -> None:
    campaign.send_signal(number)
    campaign.send_signal(number)
    _, said = campaign.communicate(timeout=WAIT_S)
    if campaign.returncode == 130:
        assert SAFE in said
    assert campaign.returncode in {130, 1}  # the second may come when the bench is safe and the command is at its end
    assert end_of(simulator.folder / DATABASE) == ("aborted", "interrupted (Ctrl-C or a signal)")


@pytest.mark.slow
def test_impatience_once_the_table_is_stop_requested_changes_nothing(
    campaign: subprocess.Popen[str], simulator: Simulator
) -> None:
    campaign.send_signal(signal.SIGINT)
    simulator.wait_for("!1a")
    while campaign.poll() is None:
        campaign.send_signal(signal.SIGINT)
        with suppress(subprocess.TimeoutExpired):
            campaign.wait(0.002)
    _, said = campaign.communicate(timeout=WAIT_S)
    assert campaign.returncode == 130, said
    assert said.count("\n") == 1
    assert SAFE in said
    assert end_of(simulator.folder / DATABASE)[0] == "aborted"
