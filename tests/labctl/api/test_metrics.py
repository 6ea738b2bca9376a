"""`/metrics` is read by Prometheus's own parser: every metric has its help and its type, and counts come from SQL."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest
import sqlalchemy as sa
from fastapi.testclient import TestClient
from prometheus_client import Metric
from prometheus_client.parser import text_string_to_metric_families

from labctl.store import Store
from tests.helpers.service import service_of


def metrics(client: TestClient) -> dict[str, Metric]:
    answer = client.get("/metrics")
    assert answer.status_code == 200
    assert answer.headers["content-type"] == "text/plain; version=0.0.4; charset=utf-8"
    return {family.name: family for family in text_string_to_metric_families(answer.text)}


def value(family: Metric, **labels: str) -> float:
    (found,) = [sample.value for sample in family.samples if sample.labels == labels]
    return found


def test_every_metric_has_a_help_and_a_type(client: TestClient) -> None:
    found = metrics(client)
    assert {"labctl_units", "labctl_campaigns", "labctl_campaigns_failed", "labctl_campaign_running"} <= set(found)
    assert not [name for name, family in found.items() if not family.documentation or family.type == "unknown"]
    assert {found[name].type for name in found if name.startswith("labctl_campaign")} == {"gauge"}
    assert {found[name].type for name in ("labctl_http_requests", "labctl_log_records_lost")} == {"counter"}
    assert found["process_open_fds"].samples[0].value > 0


@pytest.mark.slow
def test_campaigns_are_counted_by_state(ran: TestClient) -> None:
    found = metrics(ran)
    assert value(found["labctl_units"]) == 1
    assert value(found["labctl_campaigns"]) == 1
    assert value(found["labctl_campaigns_failed"]) == 0
    assert value(found["labctl_campaigns_by_state"], state="done") == 1


def test_requests_are_counted(client: TestClient) -> None:
    client.get("/api/units/NO_SERVICE")
    client.request("INVENTED", "/api/units")
    found = metrics(client)["labctl_http_requests"]
    assert value(found, method="GET", status="4xx") == 1
    assert value(found, method="other", status="4xx") == 1


@contextmanager
def statements(store: Store) -> Iterator[list[str]]:
    """Yield every statement that is executed while the block runs."""
    reported: list[str] = []

    def note(_connection: Any, _cursor: Any, statement: str, *_: Any) -> None:
        reported.append(statement)

    sa.event.listen(sa.Engine, "before_cursor_execute", note)
    try:
        yield reported
    finally:
        sa.event.remove(sa.Engine, "before_cursor_execute", note)


@pytest.mark.slow
def test_no_campaign_and_no_unit_is_loaded_for_it(ran: TestClient) -> None:
    with statements(service_of(ran).store) as executed:
        metrics(ran)
    about = [each for each in executed if re.search(r"FROM (campaigns|units)\b", each)]
    assert about
    assert all("count(" in each.lower() for each in about), about


@pytest.mark.slow
@pytest.mark.parametrize("path", ["/metrics", "/health"])
def test_a_key_may_be_sent_and_the_description_says_so(client: TestClient, path: str) -> None:
    document = client.get("/openapi.json").json()
    assert document["components"]["securitySchemes"]["key"]["scheme"] == "bearer"
    assert document["paths"][path]["get"]["security"] == [{"key": []}]
