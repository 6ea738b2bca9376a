"""The list of benches: those that were used, and those that a service drives without a campaign yet."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from instruments.clock import VirtualClock, WallClock
from labctl.cli.printing.benches import print_status
from labctl.services.benches.lease import TERM_S
from labctl.services.campaigns.bench_status import bench_statuses
from labctl.services.campaigns.preparation import prepare
from labctl.services.planning.loading import load_bench
from labctl.store import LeaseRow, Store, open_store

AT = datetime(2026, 1, 5, 8, tzinfo=UTC)
USED = "single-axis-sim"


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as opened:
        yield opened


def reserve(store: Store, bench: str, expires_at: datetime) -> None:
    """Have a service on another computer drive a bench."""
    lease = LeaseRow(bench, bench.ljust(32, "0"), "far-pc", "", 4321, AT, 7, AT, expires_at, url="http://far-pc:8420")
    assert store.leases.claim(lease, replacing=None)


def test_a_bench_is_listed_as_soon_as_its_service_drives_it(store: Store, capsys: pytest.CaptureFixture[str]) -> None:
    assert bench_statuses(store) == []
    soon = WallClock().utc() + timedelta(seconds=TERM_S)
    reserve(store, "a-new-bench", soon)
    prepare(store, "short", load_bench(USED), VirtualClock(AT), clip=False).bench.close()
    reserve(store, "z-lost-bench", AT)
    benches = bench_statuses(store)
    assert [(each.name, each.last_used_at and each.last_used_at.date(), each.unconfirmed) for each in benches] == [
        ("a-new-bench", None, ""),
        (USED, AT.date(), ""),
        ("z-lost-bench", None, ""),
    ]
    assert [each.driver and each.driver.alive for each in benches] == [True, None, False]
    store.leases.release("a-new-bench", "a-new-bench".ljust(32, "0"))
    assert [each.name for each in bench_statuses(store)] == [USED, "z-lost-bench"]
    for each in benches:
        print_status(each)
    printed = capsys.readouterr().out.splitlines()
    assert [line[:18].strip() for line in printed] == ["a-new-bench"] * 2 + [USED] + ["z-lost-bench"] * 2
    assert [line[19:].partition(" drive")[0] for line in printed[:3]] == [
        "no campaign was begun on the bench yet",
        "the service at http://far-pc:8420",
        "the safe state is confirmed",
    ]
    assert "is gone, last sign of life" in printed[-1]
