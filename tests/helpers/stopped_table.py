"""A service that drives a table at the end of a wire: a campaign that turns it, and its recorded stop."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Any

import httpx

from labctl.answers.campaigns import BENCH_CHECKS
from labctl.store import AuditRow, open_store
from tests.helpers.patience import WAIT_S
from tests.helpers.processes import ServiceProcess
from tests.helpers.simulator_process import FIRST_DPS, RECIPE, Simulator
from tests.helpers.waiting import before_next_request

#: What the table hears when it is stopped.
ABORT = "!1a"
START = {"recipe": RECIPE.format(rate=FIRST_DPS), "confirmed_by": "Ada", "checks": list(BENCH_CHECKS)}


def wait_until(simulator: Simulator, holds: Callable[[list[dict[str, Any]]], bool]) -> None:
    """Wait until what the instruments have heard is as expected."""
    while not (simulator.heard and holds(simulator.heard)):  # the test has a time-out
        before_next_request()


def turning(service: ServiceProcess, simulator: Simulator) -> int:
    """Start a campaign; returns its number once the table turns."""
    started = service.http.post("/api/campaigns", json=START)
    assert started.status_code == 201, started.text
    wait_until(simulator, lambda lines: lines[-1]["table_turns"])
    return int(started.json()["id"])


def stopped(simulator: Simulator) -> int:
    """Wait until the table was commanded to stop, and stands; returns how many lines were heard then."""
    wait_until(simulator, lambda lines: any(ABORT in line["heard"] for line in lines))
    wait_until(simulator, lambda lines: not lines[-1]["table_turns"])
    return len(simulator.heard)


def ended(service: ServiceProcess, campaign: int) -> dict[str, Any]:
    """Ask until the campaign has ended; returns it."""
    while True:
        with suppress(httpx.TransportError, ValueError):
            answer = service.http.get(f"/api/campaigns/{campaign}", timeout=WAIT_S)
            if answer.status_code == 200 and answer.json()["state"] in {"aborted", "failed", "done"}:
                found: dict[str, Any] = answer.json()
                return found
        before_next_request()


def stops(service: ServiceProcess) -> list[AuditRow]:
    """Wait until a stop is in the audit trail, and return all that are."""
    while True:
        with open_store(str(service.database), write=False) as store:
            found = [row for row in store.audit.rows() if row.action in {"campaign abort", "bench stop"}]
        if found:
            return found
        before_next_request()
