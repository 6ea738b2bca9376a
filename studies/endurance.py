"""Memory over a long campaign at real pace with watchers, imports, criticisms and broken connections, all at once.

`LABCTL_STUDY_MINUTES` is how long the campaign runs. The last columns say whether memory is flat: its median in the
second and in the last quarter of the time, and the slope of a line through both halves.
"""

from __future__ import annotations

import os
import tempfile
import threading
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field
from pathlib import Path

import httpx
import numpy as np

from studies.attack_kinds import ATTACKS, WITHIN_S, Target
from studies.attacks import lost_readings

MINUTES = float(os.environ.get("LABCTL_STUDY_MINUTES", "20"))
TOGETHER = ("watchers", "imports", "criticisms", "endless_headers", "half_sent")
EVERY_S = 2.0
RECIPE = """
format = "labctl-recipe/1"
name = "endurance"
temperatures_c = [25]
rates_dps = [-40, -20, 20, 40]
positions = ["z"]
[soak]
hold_s = 1
max_drift_c = 20.0
drift_window_s = 1
timeout_s = 600
[acquire]
duration_s = 3600
settle_s = 1
"""


@dataclass
class Measured:
    """What was read every `EVERY_S`: memory of each process, MiB, and the age of the bench's last answer, s."""

    memory_mib: dict[str, list[float]] = field(default_factory=dict)
    heard_s: list[float] = field(default_factory=list)
    unanswered: int = 0

    def look(self, target: Target) -> None:
        """Read memory and the bench's age once."""
        for process in target.pids:
            self.memory_mib.setdefault(process, []).append(target.memory_mib(process))
        try:
            self.heard_s.append(float(target.http.get("/health/heartbeat").json()["heard_s"]))
        except (httpx.HTTPError, ValueError, KeyError):
            self.unanswered += 1

    def table(self) -> list[str]:
        """Return a line for each process."""
        lines = []
        for process, values in self.memory_mib.items():
            mib = np.array(values)
            quarter = len(mib) // 4
            early, late = np.median(mib[quarter : 2 * quarter]), np.median(mib[-quarter:])
            minutes = np.arange(len(mib) - quarter) * EVERY_S / 60.0
            slope = np.polyfit(minutes, mib[quarter:], 1)[0]
            lines.append(f"{process:8}{mib.max():8.0f}{early:16.0f}{late:14.0f}{slope:+14.2f}")
        return lines


def run() -> str:
    """Run the campaign under everything at once, abort it, and return the table."""
    measured, over = Measured(), threading.Event()
    with tempfile.TemporaryDirectory() as folder:
        target = Target(Path(folder))
        try:
            target.fit_example()
            started = target.http.post("/api/campaigns", json={"recipe": RECIPE}).raise_for_status().json()
            with ExitStack() as attacks:
                for name in TOGETHER:
                    attacks.enter_context(ATTACKS[name](target))
                for _ in range(round(MINUTES * 60.0 / EVERY_S)):
                    over.wait(EVERY_S)
                    measured.look(target)
                state = _state(target, started["id"])
                abort = target.http.post(f"/api/campaigns/{started['id']}/abort", json={"reason": "the study"})
            said = (
                f"{MINUTES:g} min at real pace under {', '.join(TOGETHER)}: campaign {state}, "
                f"{lost_readings(target.database)} readings lost; abort answered in "
                f"{abort.elapsed.total_seconds():.2f} s; bench silent for at most {max(measured.heard_s):.1f} s; "
                f"{measured.unanswered} heartbeats unanswered"
            )
        finally:
            target.close()
    return "\n".join([said, "process  max_MiB  2nd_quarter_MiB  last_quarter_MiB  MiB_per_min", *measured.table()])


def _state(target: Target, campaign: int) -> str:
    with suppress(httpx.HTTPError, ValueError, KeyError), httpx.Client(base_url=target.url, timeout=WITHIN_S) as http:
        return str(http.get(f"/api/campaigns/{campaign}").json()["state"])
    return "not answered"
