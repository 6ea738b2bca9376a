"""The list of campaigns: the number of SQL statements does not grow with it, and no event is loaded."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest
import sqlalchemy as sa

from instruments.clock import VirtualClock
from labctl.services.campaigns.status import campaign_status, page_of_campaigns
from labctl.services.lab_service import LabService
from labctl.store import NewCampaign, Store, open_store
from labctl.store.paging import PageRequest
from labctl.store.repositories import campaign_summaries
from labctl.store.schema import tables
from procedures.contracts.journal import Event

AT = datetime(2026, 1, 5, 8, tzinfo=UTC)
STEP = {"kind": "acquire", "expected_s": 60.0, "rate_dps": 10.0}


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as opened:
        yield opened


def add_campaigns(store: Store, campaigns: int, events: int = 3) -> None:
    for _ in range(campaigns):
        number = store.campaigns.create(NewCampaign("short", {}, "bench", {}, "hash", 180.0, [STEP] * 3, ()), AT)
        journal = store.campaigns.journal(number)
        for k in range(events):
            journal.event(Event("fault", f"fault {k} of campaign {number}", level="error"), float(k), AT)
        journal.event(Event("note", "the last event is no fault"), 100.0, AT)
        journal.step_started(0, 1.0, AT)
        journal.step_ended(0, result("done"), 61.0, AT)
        journal.step_started(1, 61.0, AT)


def result(outcome: str) -> Any:
    from procedures.contracts.steps import StepResult

    return StepResult.model_validate({"outcome": outcome})


@contextmanager
def counted() -> Iterator[list[str]]:
    """Collect every SQL statement."""
    found: list[str] = []

    def note(*given: Any) -> None:
        found.append(given[2])

    sa.event.listen(sa.Engine, "before_cursor_execute", note)
    try:
        yield found
    finally:
        sa.event.remove(sa.Engine, "before_cursor_execute", note)


def statements_of_a_list(store: Store) -> int:
    service = LabService(store, VirtualClock())
    with counted() as found:
        service.campaigns(PageRequest())
    with counted() as from_the_command_line:
        page_of_campaigns(store, PageRequest())
    assert 0 < len(from_the_command_line) <= len(found) + 2  # campaigns without a process are read twice
    return len(found)


def test_the_number_of_statements_does_not_grow_with_the_number_of_campaigns(store: Store) -> None:
    add_campaigns(store, 2)
    few = statements_of_a_list(store)
    add_campaigns(store, 20)
    assert statements_of_a_list(store) == few


def test_it_grows_by_a_constant_with_each_page(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    add_campaigns(store, 12)
    counts = []
    for page in (12, 6, 4):
        monkeypatch.setattr(campaign_summaries, "PAGE", page)
        counts.append(statements_of_a_list(store))
    assert counts[1] - counts[0] == counts[2] - counts[1] > 0


def test_no_event_is_loaded_but_the_last_one_and_the_last_fault(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    add_campaigns(store, 1, events=50)
    loaded = []
    execute = sa.Connection.execute

    def counting(connection: sa.Connection, query: Any, *given: Any, **named: Any) -> Any:
        found = execute(connection, query, *given, **named)
        if isinstance(query, sa.Select) and tables.events in query.get_final_froms()[0]._from_objects:
            rows = found.all()
            loaded.append(len(rows))
            return rows
        return found

    monkeypatch.setattr(sa.Connection, "execute", counting)
    campaign_status(store, 1)
    assert loaded == [1, 1, 0]  # none of the repeated data sets and stalls that are counted


def test_a_status_of_the_database_shows_step_progress_fault_and_expected_end(store: Store) -> None:
    add_campaigns(store, 2)
    answer = campaign_status(store, 1)
    assert (answer.step, answer.steps, answer.step_text, answer.rate_dps) == (2, 3, "acquire", 10.0)
    assert answer.progress == pytest.approx(1 / 3)
    assert answer.last_error == "fault 2 of campaign 1"
    assert answer.t_s == 100.0
    assert answer.expected_end is not None
    assert (answer.expected_end - AT).total_seconds() == 120.0


def test_a_status_reads_the_recordings_of_its_own_campaign_only(store: Store) -> None:
    add_campaigns(store, 1)
    with counted() as found:
        store.campaigns.get(1)
    [recordings] = [text for text in found if "FROM recordings" in text]
    assert "WHERE recordings.campaign_id IN (SELECT campaigns.id" in recordings.replace("\n", "")
