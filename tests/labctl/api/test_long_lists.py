"""Long lists in parts: each row once, whatever is added meanwhile; searches are of the whole list."""

from __future__ import annotations

import re
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest
import sqlalchemy as sa
from fastapi.testclient import TestClient

from instruments.clock import VirtualClock
from labctl.api import create_app
from labctl.recording import RecordingInfo
from labctl.services.lab_service import LabService
from labctl.store import NewCampaign, Store
from labctl.store.connection.database import Database
from labctl.store.schema import tables

AT = datetime(2026, 1, 5, 8, tzinfo=UTC)
STEP = {"kind": "acquire", "expected_s": 60.0, "rate_dps": 10.0}
UNITS = 23
#: Serial numbers in natural order: % and _ are no wildcards in a search.
SERIALS = sorted([f"G{k:03d}" for k in range(UNITS - 3)] + ["5.0", "a_b", "axb"])


@pytest.fixture
def database(tmp_path: Path) -> Database:
    return Database(str(tmp_path / "lab.sqlite"), write=True)


@pytest.fixture
def client(database: Database) -> Iterator[TestClient]:
    store = Store(database)
    add_units(database, SERIALS)
    for number in range(7):
        store.campaigns.create(NewCampaign("short", {}, f"bench {number % 2}", {}, "hash", 60.0, [STEP], ()), AT)
    with database.writing() as connection:
        connection.execute(sa.update(tables.campaigns).values(state="done"))
        connection.execute(
            sa.update(tables.recordings).where(tables.recordings.c.serial == "axb").values(campaign_id=3)
        )
        connection.execute(
            sa.update(tables.recordings).where(tables.recordings.c.serial == "G005").values(kind="samples")
        )
    with TestClient(create_app(LabService(store, VirtualClock()))) as opened:
        yield opened


def add_units(database: Database, serials: list[str]) -> None:
    head = {"axes": ["z"], "kind": "points", "started_at": AT}
    with database.writing() as connection:
        for serial in serials:
            info = RecordingInfo.model_validate({**head, "serial": serial, "notes": f"bought with {serial}"})
            connection.execute(
                sa.insert(tables.units).values(serial=serial, model="VG-35", technology="fog", first_seen_at=AT)
            )
            connection.execute(
                sa.insert(tables.recordings).values(
                    serial=serial, kind="points", info=info.model_dump(mode="json"), channels=[], created_at=AT
                )
            )


def parts(client: TestClient, address: str) -> Iterator[list[dict[str, Any]]]:
    """Yield the parts of a list, by its links."""
    following: str | None = address
    while following:
        answer = client.get(following)
        assert answer.status_code == 200, answer.text
        yield answer.json()
        link = re.fullmatch(r'<(.*)>; rel="next"', answer.headers.get("Link", ""))
        following = link and link.group(1)


@pytest.mark.parametrize("limit", [1, 5, UNITS - 1, UNITS, UNITS + 1])
@pytest.mark.parametrize(
    ("address", "key", "rows"),
    [
        ("/api/units", "serial", SERIALS),
        ("/api/recordings", "id", list(range(UNITS, 0, -1))),
        ("/api/campaigns", "id", list(range(7, 0, -1))),
        ("/api/units?search=g0", "serial", [serial for serial in SERIALS if serial.startswith("G")]),
        ("/api/recordings?search=bought", "id", list(range(UNITS, 0, -1))),
        ("/api/campaigns?search=bench%201", "id", [6, 4, 2]),
    ],
)
def test_the_parts_of_a_list_are_the_list(
    client: TestClient, address: str, key: str, rows: list[object], limit: int
) -> None:
    read = list(parts(client, f"{address}{'&' if '?' in address else '?'}limit={limit}"))
    assert [row[key] for part in read for row in part] == rows
    assert all(len(part) == limit for part in read[:-1])
    whole = client.get(address)
    assert whole.json() == [row for part in read for row in part]
    assert whole.headers["X-Total-Count"] == str(len(rows))
    assert "Link" not in whole.headers


def test_what_is_added_between_two_parts_neither_hides_a_row_nor_shows_one_twice(
    client: TestClient, database: Database
) -> None:
    read = parts(client, "/api/recordings?limit=10")
    first = next(read)
    add_units(database, ["G900", "G901"])
    rest = [row["id"] for part in read for row in part]
    assert [row["id"] for row in first] + rest == list(range(UNITS, 0, -1))


@pytest.mark.parametrize(
    ("address", "found"),
    [
        ("/api/units?search=g00", [f"G00{k}" for k in range(10)]),
        ("/api/units?search=a_b", ["a_b"]),
        ("/api/units?search=%25", []),
        ("/api/units?search=5.", ["5.0"]),
        ("/api/units?search=FOG", SERIALS),
        ("/api/units?search=nosuch", []),
        ("/api/recordings?search=with%20g003", ["G003"]),
        ("/api/recordings?unit=axb", ["axb"]),
        ("/api/recordings?unit=ax", []),
        ("/api/recordings?kind=samples", ["G005"]),
        ("/api/recordings?kind=points&search=with%20g005", []),
        ("/api/recordings?kind=samples&search=with%20g005", ["G005"]),
    ],
)
def test_a_search_is_of_the_whole_list_and_takes_every_character_as_it_is(
    client: TestClient, address: str, found: list[str]
) -> None:
    answer = client.get(f"{address}&limit=5")
    assert [row["serial"] for row in answer.json()] == found[:5]
    assert answer.headers["X-Total-Count"] == str(len(found))


@pytest.mark.parametrize(
    ("search", "found"),
    [("bench 1", [6, 4, 2]), ("SHORT", [7, 6, 5, 4, 3, 2, 1]), ("done", [7, 6, 5, 4, 3, 2, 1]), ("AXB", [3])],
)
def test_campaigns_are_found_by_recipe_bench_state_and_unit(client: TestClient, search: str, found: list[int]) -> None:
    assert [row["id"] for row in client.get("/api/campaigns", params={"search": search}).json()] == found


@pytest.mark.parametrize("limit", ["0", "-1", "10001", "many"])
def test_a_limit_out_of_range_is_refused(client: TestClient, limit: str) -> None:
    assert client.get(f"/api/units?limit={limit}").status_code == 422


def test_the_number_of_statements_does_not_grow_with_the_units(client: TestClient) -> None:
    counts = []
    client.get("/api/units")  # what a service asks only once
    for limit in (2, UNITS):
        statements: list[str] = []
        note = lambda *given, to=statements: to.append(given[2])  # noqa: E731
        sa.event.listen(sa.Engine, "before_cursor_execute", note)
        client.get(f"/api/units?limit={limit}")
        sa.event.remove(sa.Engine, "before_cursor_execute", note)
        counts.append(len(statements))
    assert 0 < counts[1] <= counts[0]  # a list that is whole is not counted
