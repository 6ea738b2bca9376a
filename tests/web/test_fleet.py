"""The page of many units: what is drawn is what the service answers, and a brush lists the groups inside."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING, Any

import pytest
import sqlalchemy as sa

from labctl.recording import RecordingInfo
from labctl.store.schema import tables
from tests.helpers.browser import NARROW, Faults, Service

if TYPE_CHECKING:
    from playwright.sync_api import Page


AT = datetime(2026, 1, 5, 8, tzinfo=UTC)
#: Units of the type; every fourth one is of the batch that differs, and was measured later.
UNITS = 40
FIELDS = {"kind": "fit", "request": {"kind": "fit", "model": "bias"}, "engine": "local", "by": "Ann", "created_at": AT}


@pytest.fixture
def fleet(service: Service) -> None:
    """Write a type of 40 units as fleet jobs leave it, and one unit of another type."""
    store = service.lab_service.store
    info = RecordingInfo.model_validate({"serial": "G", "axes": ["x"], "kind": "points", "started_at": AT})
    head = info.model_dump(mode="json")
    serials = [f"G{k:03d}" for k in range(UNITS)]
    odd = {serial for k, serial in enumerate(serials) if k % 4 == 0}
    units = [
        {"serial": serial, "model": "FOG-A", "first_seen_at": AT, "batch": "B2" if serial in odd else "B1"}
        for serial in serials
    ] + [{"serial": "M", "model": "MEMS-B", "first_seen_at": AT, "batch": ""}]
    recordings = [
        {"serial": each["serial"], "kind": "points", "info": head, "channels": [], "created_at": AT} for each in units
    ]  # fmt: skip
    done: dict[str, Any] = {"state": "done", "newest": True, "version": 1, "noise_floor_dps": 0.001}
    fits = [
        {**done, "job_id": 1, "serial": serial, "kind": "fit", "rms_dps": 0.0012 if serial in odd else 0.001}
        for serial in serials
    ]
    verdicts = [
        {**done, "job_id": 2, "serial": serial, "kind": "criticise", "rms_dps": 0.001}
        | ({"verdict": "missing", "named": ["warm_up"]} if serial in odd else {"verdict": "adequate", "named": []})
        for serial in serials
    ]
    coefficients = [
        {
            "serial": serial, "axis": "x", "name": "scale_factor", "value": 0.01 if serial in odd else 0.0, "u": 1e-5,
            "unit": "1", "model": "bias_scale", "version": 1, "bench": "",
            "measured_at": AT + timedelta(days=30 if serial in odd else 0),
        }
        for serial in serials
    ]  # fmt: skip
    with store._database.writing() as connection:
        connection.execute(sa.insert(tables.units), units)
        connection.execute(sa.insert(tables.recordings), recordings)
        for kind in ("fit", "criticise"):
            connection.execute(
                sa.insert(tables.fleet_jobs).values(**FIELDS | {"kind": kind}, units=UNITS, state="done")
            )
        connection.execute(sa.insert(tables.fleet_units), fits)
        connection.execute(sa.insert(tables.fleet_units), verdicts)
        connection.execute(sa.insert(tables.fleet_coefficients), coefficients)


@pytest.mark.usefixtures("fleet")
def test_types_are_small_multiples_and_a_type_has_its_chart_and_report(
    service: Service, visit: Callable[..., Page]
) -> None:
    from playwright.sync_api import expect

    page = visit("/fleet")
    card = page.get_by_role("region", name="FOG-A: 40 units")
    expect(card.get_by_role("list", name="Error over noise floor").get_by_role("listitem")).to_have_text(
        ["0 to 1.130", "1.1 to 1.2510"]
    )
    expect(card.get_by_role("list", name="Verdict").get_by_role("listitem")).to_have_count(2)
    expect(card.get_by_role("list", name="Due").get_by_role("listitem")).to_have_text(["none in force40"])
    expect(page.get_by_role("region", name="MEMS-B: 1 unit")).to_contain_text(
        "Next: labctl fleet fit --model NAME --type 'MEMS-B'"
    )
    card.get_by_role("link", name="Open FOG-A").click()
    groups = page.get_by_role("group", name="Groups in the chosen time")
    expect(groups.get_by_role("row")).to_have_count(3)
    drawn = page.locator(".plot.js-plotly-plot").evaluate(
        "plot => Object.fromEntries(plot.data.map(trace => [trace.name, [...trace.customdata]]))"
    )
    answer = service.get("/api/fleet/chart?type=FOG-A")
    assert drawn == {"B1": [30], "B2": [10]}
    assert {point["level"]: [point["units"]] for point in answer["points"]} == drawn
    page.get_by_label("From", exact=True).fill("2026-02-01")
    page.get_by_label("From", exact=True).dispatch_event("change")
    expect(groups.get_by_role("row")).to_have_count(2)
    expect(groups).to_contain_text("B2")
    missing = page.get_by_role("region", name="What is missing")
    expect(missing.get_by_role("list", name="Named in single units")).to_contain_text("warm up")
    expect(page.get_by_role("region", name="Report")).to_contain_text("at least 5")


@pytest.mark.usefixtures("fleet")
def test_jobs_say_how_far_they_are_and_why_units_failed_and_one_is_cancelled(
    service: Service, visit: Callable[..., Page]
) -> None:
    from playwright.sync_api import expect

    store, now = service.lab_service.store, service.lab_service.clock.utc()
    request = {"kind": "fit", "model": "bias", "type": "FOG-A", "effects": ["warm_up"]}
    running = FIELDS | {"request": request, "units": 3, "state": "waiting", "runner": "another", "seen_at": now}
    why = "G002: recording 3 has no rates; import the log with its rate column"
    with store._database.writing() as connection:
        connection.execute(sa.insert(tables.fleet_jobs).values(**running))
        for serial, row in (("G000", {"state": "done"}), ("G001", {"state": "waiting"}), ("G002", {"state": "failed"})):
            fields = {"job_id": 3, "serial": serial, "kind": "fit", "reason": why if serial == "G002" else "", **row}
            connection.execute(sa.insert(tables.fleet_units).values(**fields))
    page = visit("/fleet")
    jobs = page.get_by_role("region", name="Jobs")
    row = jobs.get_by_role("row").filter(has_text="warm_up")
    expect(row).to_contain_text("Fit bias + warm_up")
    expect(row).to_contain_text("2 of 3, 1 failed")
    expect(jobs.get_by_role("row")).to_have_count(4)
    row.get_by_role("button", name="Reasons").click()
    expect(jobs.get_by_role("group", name="Failed units of job 3")).to_contain_text(why)
    row.get_by_role("button", name="Cancel job").click()
    dialog = page.get_by_role("dialog", name="Cancel job 3")
    dialog.get_by_label("Who").fill("Ann")
    dialog.get_by_label("Why").fill("the wrong model")
    dialog.get_by_role("button", name="Cancel job").click()
    expect(row).to_contain_text("cancelled by Ann: the wrong model")
    expect(row.get_by_role("button", name="Cancel job")).to_have_count(0)
    answer = service.get("/api/fleet/jobs/3")
    assert (answer["state"], answer["why"]) == ("cancelled", "cancelled by Ann: the wrong model")


def running_job(service: Service) -> None:
    """Write a third job that another service carries out."""
    store, now = service.lab_service.store, service.lab_service.clock.utc()
    row = FIELDS | {"units": 3, "state": "running", "runner": "another", "seen_at": now}
    with store._database.writing() as connection:
        connection.execute(sa.insert(tables.fleet_jobs).values(**row))
        for number in range(3):
            fields = {"job_id": 3, "serial": f"G00{number}", "kind": "fit", "state": "waiting"}
            connection.execute(sa.insert(tables.fleet_units).values(**fields))


@pytest.mark.usefixtures("fleet")
def test_jobs_that_go_on_are_read_again_until_they_have_ended(service: Service, visit: Callable[..., Page]) -> None:
    from playwright.sync_api import expect

    running_job(service)
    page = visit("/effects")
    page.clock.install()
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url) if "/api/fleet/jobs" in request.url else None)
    page.goto(service.url + "/fleet")
    row = page.get_by_role("region", name="Jobs").get_by_role("row").nth(1)
    expect(row).to_contain_text("0 of 3")
    store = service.lab_service.store
    with store._database.writing() as connection:
        connection.execute(sa.update(tables.fleet_units).where(tables.fleet_units.c.job_id == 3).values(state="done"))
        connection.execute(sa.update(tables.fleet_jobs).where(tables.fleet_jobs.c.id == 3).values(state="done"))
    with page.expect_response("**/api/fleet/jobs?*"):
        page.clock.run_for(2_000)
    expect(row).to_contain_text("3 of 3")
    expect(row).to_contain_text("done")
    before = len(asked)
    page.clock.run_for(10_000)
    assert len(asked) == before  # nothing goes on any more


@pytest.mark.usefixtures("fleet")
def test_a_failed_request_for_jobs_is_said_in_their_card_alone(
    service: Service, visit: Callable[..., Page], faults: Faults
) -> None:
    from playwright.sync_api import expect

    page = visit("/effects")
    page.clock.install()
    problem = {"type": "about:blank", "title": "Failed", "status": 500, "detail": "the table of jobs is damaged"}
    page.route("**/api/fleet/jobs?*", lambda route: route.fulfill(status=500, json=problem))
    page.goto(service.url + "/fleet")
    jobs = page.get_by_role("region", name="Jobs")
    expect(jobs).to_contain_text("The fleet jobs could not be read")
    expect(jobs).to_contain_text("the table of jobs is damaged")
    expect(page.get_by_role("region", name="FOG-A").first).to_be_visible()
    expect(page.get_by_role("heading", level=1)).to_have_text("Fleet")
    page.unroute("**/api/fleet/jobs?*")
    page.clock.run_for(2_000)
    expect(jobs.get_by_role("row")).to_have_count(3)
    faults.clear()  # the browser complains of the answer 500


@pytest.mark.usefixtures("fleet")
def test_on_a_phone_nothing_is_wider_than_the_page(visit: Callable[..., Page]) -> None:
    page = visit("/fleet?type=FOG-A", size=NARROW, dark=True)
    page.get_by_role("region", name="Report").wait_for()
    assert page.evaluate("document.documentElement.scrollWidth <= document.documentElement.clientWidth")
