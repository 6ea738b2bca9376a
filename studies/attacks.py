"""Abort under attack: how soon it is answered and the bench safe, at real pace, whatever else the service is asked.

`LABCTL_STUDY_ABORTS` is how many campaigns are begun and aborted under each attack.
"""

from __future__ import annotations

import os
import sqlite3
import tempfile
import threading
import time
from collections.abc import Mapping
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import httpx
import numpy as np

from studies.attack_kinds import ATTACKS, WITHIN_S, Target

ABORTS = int(os.environ.get("LABCTL_STUDY_ABORTS", "20"))
POLL_INTERVAL_S = 0.05
RECIPE = """
format = "labctl-recipe/1"
name = "attacked"
temperatures_c = [25]
rates_dps = [-40, 20, 40]
positions = ["z"]
[soak]
hold_s = 1
max_drift_c = 20.0
drift_window_s = 1
timeout_s = 600
[acquire]
duration_s = 10
settle_s = 1
"""


@dataclass
class Seen:
    """What was measured under one attack."""

    answer_s: list[float] = field(default_factory=list)
    safe_s: list[float] = field(default_factory=list)
    health_s: float = 0.0  #: the longest answer of /health
    heard_s: float = 0.0  #: the longest that the bench process gave no sign of life
    refused: int = 0


def measure(target: Target, attack: AbstractContextManager[None], seed: int) -> Seen:
    """Begin and abort campaigns while an attack goes on."""
    seen, rng, over = Seen(), np.random.default_rng(seed), threading.Event()
    monitor = threading.Thread(target=_monitor, args=(target, seen, over), daemon=True)
    with attack:
        monitor.start()
        for _ in range(ABORTS):
            with suppress(httpx.TransportError):
                _abort_once(target, seen, float(rng.uniform(1.0, 8.0)))
        over.set()
        monitor.join()
    return seen


def _abort_once(target: Target, seen: Seen, after_s: float) -> None:
    started = _ask(target, seen, "/api/campaigns", {"recipe": RECIPE})
    if started is None:
        return
    campaign = started["id"]
    time.sleep(after_s)
    begun_s = time.monotonic()
    answer = _ask(target, seen, f"/api/campaigns/{campaign}/abort", {"reason": "the study"})
    seen.answer_s.append(time.monotonic() - begun_s)
    while answer is None or answer["state"] not in {"aborted", "failed", "done"}:
        time.sleep(POLL_INTERVAL_S)
        with suppress(httpx.TransportError, ValueError, KeyError):
            answer = target.http.get(f"/api/campaigns/{campaign}").json()
    seen.safe_s.append(time.monotonic() - begun_s)


def _ask(target: Target, seen: Seen, path: str, body: Mapping[str, Any]) -> Any:
    answer = target.http.post(path, json=body)
    if answer.is_success:
        return answer.json()
    seen.refused += 1
    print(f"   {answer.status_code} {answer.text[:200]}", flush=True)
    time.sleep(POLL_INTERVAL_S)
    return None


def _monitor(target: Target, seen: Seen, over: threading.Event) -> None:
    with httpx.Client(base_url=target.url, timeout=WITHIN_S) as http:
        while not over.wait(0.2):
            begun_s = time.monotonic()
            with suppress(httpx.TransportError, ValueError):
                seen.heard_s = max(seen.heard_s, http.get("/health/heartbeat").json()["heard_s"])
            seen.health_s = max(seen.health_s, time.monotonic() - begun_s)


def lost_readings(database: Path) -> int:
    """Return how many readings the campaigns of a database lost."""
    with sqlite3.connect(f"file:{database}?mode=ro", uri=True) as connection:
        found = connection.execute("select coalesce(sum(lost), 0) from data_sets").fetchone()
    return int(found[0])


def run(names: tuple[str, ...] = tuple(ATTACKS)) -> str:
    """Measure every attack on a service of its own, and return the table."""
    lines = ["attack            aborts  answer_s p50 / p99 / max   safe_s max  health_s  heard_s  lost  refused  MiB"]
    for number, name in enumerate(names):
        with tempfile.TemporaryDirectory() as folder:
            target = Target(Path(folder))
            try:
                target.fit_example()
                seen = measure(target, ATTACKS[name](target), number)
                p50, p99 = np.percentile(seen.answer_s, [50, 99])
                lines.append(
                    f"{name:18}{len(seen.answer_s):6}  {p50:8.3f} / {p99:.3f} / {max(seen.answer_s):.3f}"
                    f"{max(seen.safe_s):16.2f}{seen.health_s:10.2f}{seen.heard_s:9.1f}{lost_readings(target.database):6}"
                    f"{seen.refused:9}  {target.largest_mib('bench'):.0f} / {target.largest_mib('web'):.0f}"
                )
                print(lines[-1], flush=True)
            finally:
                target.close()
    return "\n".join(lines)
