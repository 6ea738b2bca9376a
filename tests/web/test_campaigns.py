"""Planning, starting, scheduling and looking back at campaigns."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from labctl.services.planning.plan_answer import describe_plan
from tests.helpers.browser import MINUS, NARROW, Faults, Service, figure, number_of, on_page

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page


@pytest.mark.slow
def test_a_campaign_is_planned_started_and_looked_back_at(service: Service, visit: Callable[..., Page]) -> None:
    from playwright.sync_api import expect

    page = visit("/campaigns/new?recipe=short&hide=scale_factor_asymmetry")
    expect(page.get_by_role("region", name="Steps")).to_contain_text("15")
    assert_effects_are_counted(service, page)
    expect(page.get_by_role("spinbutton", name="Size")).not_to_have_value("")
    page.get_by_role("button", name="Start on").click()
    page.wait_for_url("**/bench")
    service.until("/api/campaigns/1", lambda answer: answer["state"] == "done")

    page.goto(f"{service.url}/campaigns")
    page.get_by_role("link", name="Campaign 1").click()
    expect(page.locator("main")).to_contain_text("all steps done")
    expect(page.locator("main")).to_contain_text("15 of 15")
    expect(page.get_by_role("list")).to_contain_text(["campaign running"])
    page.get_by_role("button", name="errors", exact=True).click()
    assert "level=error" in page.url
    expect(page.get_by_role("region", name="Events")).to_contain_text("No event of this kind")
    assert_course_is_scrubbed(service, page)
    assert_channels_are_chosen(service, page)


def assert_effects_are_counted(service: Service, page: Page) -> None:
    """Each effect stands in one of three lists, but for one form of a model; the page says that it is not counted."""
    from playwright.sync_api import expect

    rows = service.post("/api/plans", {"recipe": "short", "visibility": True})["visibility"]
    able = [row["effect"] for row in rows if row["visible"]]
    effects = {each["id"] for each in service.get("/api/effects")["effects"]}
    assert effects - {row["effect"] for row in rows} == {"rate_temperature_surface"}
    card = page.get_by_role("region", name="Effects that the plan can detect")
    expect(card).to_contain_text(f"This plan can detect {len(able)} of {len(effects) - 1} effects")
    expect(card).to_contain_text("A surface over rate and temperature is a form of a model, not a cause")
    expect(card.locator(".detectable-effects li")).to_have_count(len(able))
    estimated = [row["effect"] for row in rows if not row["visible"] and row["in_model"]]
    expect(card).to_contain_text(f"; {len(estimated)} are part of the model of a first fit, which estimates them.")
    expect(card.locator(".detectable-effects")).to_contain_text("scale factor even, order 4")
    links = card.locator("a[href^='/effects/']").evaluate_all("all => all.map((each) => each.pathname.split('/')[2])")
    assert sorted(links) == sorted(row["effect"] for row in rows)


def assert_channels_are_chosen(service: Service, page: Page) -> None:
    """What is drawn is what the service has of the chosen channels in the chosen time, and the address says both."""
    from playwright.sync_api import expect

    (serial,) = service.get("/api/campaigns/1")["recordings"]
    sets, course = service.get("/api/recordings/1/datasets"), service.get("/api/campaigns/1/course?points=4000")
    page.get_by_role("link", name="Choose channels").click()
    card = page.get_by_role("region", name="Channels")
    expect(card.locator(".plot .main-svg").first).to_be_visible()
    for name in ("set point of the chamber, °C", "table rate, deg/s", f"{serial}, own temperature, °C"):
        card.get_by_label(name).uncheck()
    expect(card).to_contain_text("2 of ")
    drawn = "() => Object.fromEntries((document.querySelector('.plot')?.data ?? []).map((t) => [t.name, t]))"
    page.wait_for_function(f"Object.keys(({drawn})()).length === 2")
    traces = page.evaluate(drawn)
    means = traces[f"{serial}, gyro output z (means)"]
    assert sorted(means["y"]) == sorted(sets["channels"]["gyro_z"]["mean"])
    assert means["x"] == sorted(means["x"])
    assert traces["chamber"]["y"] == course["chamber_c"]
    card.get_by_label("Time").select_option("300")
    end_s = max(course["t_s"][-1], *service.get("/api/campaigns/1/plan")["timeline"]["started_s"])
    page.wait_for_function(f"(({drawn})().chamber?.y.length ?? Infinity) < {len(course['t_s'])}")
    later = [value for t_s, value in zip(course["t_s"], course["chamber_c"], strict=True) if t_s >= end_s - 300]
    assert page.evaluate(drawn)["chamber"]["y"] == later
    assert "last=300" in page.url
    page.reload()
    expect(card).to_contain_text("2 of ")
    page.wait_for_function(f"Object.keys(({drawn})()).length === 2")


UNTIL_ENOUGH = """format = "labctl-recipe/1"
name = "until-enough"
temperatures_c = [22, 26, 30, 34]
rates_dps = [-40, -20, 0, 20, 40]
positions = ["z"]
[soak]
hold_s = 1800
max_drift_c = 1.0
drift_window_s = 60
[acquire]
duration_s = 10
settle_s = 2
[stop]
effects = ["bias", "bias_temperature", "scale_factor"]
u_dps = 0.1
"""


@pytest.mark.slow
def test_u_of_a_campaign_is_drawn_against_its_target(service: Service, visit: Callable[..., Page]) -> None:
    from playwright.sync_api import expect

    service.post("/api/campaigns", {"recipe": UNTIL_ENOUGH})
    campaign = service.until("/api/campaigns/1", lambda answer: answer["state"] == "done")
    answer = service.get("/api/campaigns/1/uncertainty")
    course, unit = answer["units"]["fog"], campaign["target"]["units"][0]
    assert (answer["target_u_dps"], answer["planned"]) == (0.1, 20)
    assert unit["u_dps"] == course["u_dps"][-1]
    assert set(course["known"]) == {"unknown", "at least", "of the fit"}

    card = visit("/campaigns/1").get_by_role("region", name="Uncertainty")
    card.scroll_into_view_if_needed()
    expect(card).to_contain_text(on_page(unit["text"]))
    plot = card.locator(".plot")
    expect(plot.locator(".main-svg").first).to_be_attached()
    drawn = json.loads(
        plot.evaluate("plot => JSON.stringify(plot.data.map(({ name, x, y }) => [name, [...x], [...y]]))")
    )
    rows = list(zip(course["datasets"], course["u_dps"], course["known"], strict=True))
    assert drawn == [
        [name, [n for n, _, each in rows if each == known], [u for _, u, each in rows if each == known]]
        for name, known in (("at least", "at least"), ("U", "of the fit"))
    ] + [["target", [0, 20], [0.1, 0.1]]]


def assert_course_is_scrubbed(service: Service, page: Page) -> None:
    """The slider moves chamber, unit, output and data set together, to what the service has of that time."""
    from playwright.sync_api import expect

    course, steps = service.get("/api/campaigns/1/course"), service.get("/api/campaigns/1/plan")["timeline"]
    sets = service.get("/api/recordings/1/datasets")
    card = page.get_by_role("region", name="Course")
    card.scroll_into_view_if_needed()
    expect(card).to_contain_text(f"all {course['samples']} times")
    step = steps["dataset"].index(7)
    inside_s = (steps["started_s"][step] + steps["ended_s"][step]) / 2
    at = max(k for k, t_s in enumerate(course["t_s"]) if t_s <= inside_s)
    assert course["t_s"][at] >= steps["started_s"][step]
    slider = card.get_by_role("slider", name="Time of the campaign")
    slider.fill(str(at))
    expect(card).to_contain_text(f"{course['chamber_c'][at]:.2f} °C")
    (values,) = course["units_c"].values()
    expect(card).to_contain_text(f"{values[at]:.2f} °C")
    expect(card).to_contain_text("7: complete")
    (mean,) = (channel["mean"][6] for name, channel in sets["channels"].items() if name.startswith("gyro_"))
    expect(card).to_contain_text(f"{mean:.7g}".rstrip("0").replace("-", MINUS))
    card.get_by_text("Two soaks over each other").first.click()
    soaks = [k for k, kind in enumerate(steps["kind"]) if kind == "soak"]
    expect(card.get_by_label("First soak").get_by_role("option")).to_have_count(len(soaks))


@pytest.mark.slow
def test_a_plan_says_what_further_mountings_are_worth(tmp_path: Path, chromium: Browser) -> None:
    from playwright.sync_api import expect

    serving = Service(tmp_path, bench=None)
    serving.start()
    try:
        page = chromium.new_page()
        page.goto(f"{serving.url}/campaigns/new?recipe=quick-triaxial")
        page.get_by_text("Misalignment: U").click()
        rows = page.get_by_role("group", name="What further mountings of each position are worth").get_by_role("row")
        plan = describe_plan("quick-triaxial", "triaxial-sim", clip=False)
        assert plan.misalignment is not None
        expect(rows).to_have_count(1 + len(plan.misalignment.further))
        expect(rows.first.get_by_role("columnheader").nth(1)).to_have_text("U, mrad")
        for row, more in enumerate(plan.misalignment.further, start=1):
            expect(rows.nth(row)).to_contain_text(more.turned)
            expect(rows.nth(row)).to_contain_text(more.recipe_toml)
            said = number_of(rows.nth(row).get_by_role("cell").nth(1).inner_text())
            assert said / 1e3 == pytest.approx(more.expanded, rel=0.05)
        page.close()
    finally:
        serving.stop()


@pytest.mark.slow
def test_a_plan_for_a_unit_without_a_bench_says_that_another_unit_is_simulated(
    tmp_path: Path, chromium: Browser
) -> None:
    from playwright.sync_api import expect

    serving = Service(tmp_path, bench=None)
    serving.start()
    try:
        page = chromium.new_page()
        page.goto(f"{serving.url}/campaigns/new?recipe=short&unit=OSU-FOG-2024")
        expect(page.get_by_text("This experiment is for OSU-FOG-2024. This service drives no bench.")).to_be_visible()
        page.get_by_role("button", name="Simulate the recording").click()
        page.wait_for_url("**/explore?**recording=1**")
        (made,) = serving.get("/api/recordings")
        assert made["serial"] != "OSU-FOG-2024"
        expect(page.get_by_text(f"Recording 1 of the simulated unit {made['serial']}")).to_be_visible()
        page.close()
    finally:
        serving.stop()


@pytest.mark.slow
def test_a_next_experiment_is_judged_beside_its_version(tmp_path: Path, chromium: Browser) -> None:
    """The plan says what it was proposed for, and its effects are those beside the model of that version."""
    from playwright.sync_api import expect

    serving = Service(tmp_path, bench="triaxial-sim")
    serving.start()
    try:
        serving.post("/api/recordings/example", {"name": "osu-fog"})
        unit = "/api/units/OSU-FOG-2024/calibrations"
        serving.post(unit, {"model": "bias_scale"})
        (first, *_) = serving.get(f"{unit}/1/criticism")["experiments"]
        page = chromium.new_page()
        page.goto(f"{serving.url}/explore?unit=OSU-FOG-2024&version=1")
        page.get_by_role("link", name="Next experiment").click()
        card = page.get_by_role("region", name="Effects that the plan can detect")
        suspects = ", ".join(each.replace("_", " ") for each in first["separates"])
        expect(card).to_contain_text(f"Proposed to distinguish {suspects}.")
        assert page.url.endswith("unit=OSU-FOG-2024&version=1")
        expect(card).to_contain_text("With the recordings of OSU-FOG-2024, version 1, this plan can detect")
        detected = card.locator(".detectable-effects")
        expect(detected).to_contain_text("scale factor odd")
        expect(detected).to_contain_text("sine response")
        expect(card).to_contain_text("part of the model of version 1")
        page.close()
    finally:
        serving.stop()


def test_what_the_bench_cannot_do_is_refused_or_left_out(visit: Callable[..., Page], faults: Faults) -> None:
    from playwright.sync_api import expect

    page = visit("/campaigns/new?recipe=table1-x-table2", size=NARROW)
    expect(page.get_by_role("alert")).to_contain_text("400")
    page.get_by_label("Leave out points beyond the limits of the bench or the unit").check()
    expect(page.get_by_role("region", name="Steps")).to_contain_text("points are left out")
    assert "clip=1" in page.url
    faults.clear()  # the browser notes the refusal as an error


def test_own_recipe_is_planned_as_it_is_typed_and_is_in_the_address(visit: Callable[..., Page], faults: Faults) -> None:
    from playwright.sync_api import expect

    page = visit("/campaigns/new?recipe=short")
    page.get_by_text("Recipe text").click()
    page.get_by_role("button", name="Change a copy of it").click()
    text = page.get_by_label("Recipe as TOML")
    text.fill(text.input_value().replace("[24, 26, 28]", "[24, 26]"))
    expect(page.get_by_role("region", name="Steps").locator("dd").first).to_contain_text("10")
    assert "toml=" in page.url
    text.fill('format = "labctl-recipe/1"\nname = "x"\ntemperatures_c = "warm"\n')
    expect(page.get_by_role("alert")).to_contain_text("temperatures_c")
    faults.clear()


def test_a_start_is_put_on_the_schedule_and_taken_out(service: Service, visit: Callable[..., Page]) -> None:
    from playwright.sync_api import expect

    page = visit("/campaigns/new?recipe=short")
    page.get_by_role("button", name="Repeatedly").click()
    page.get_by_label("Cron line").fill("0 20 * * FRI")
    page.get_by_label("Time zone").fill("Europe/Berlin")
    page.get_by_role("button", name="Add to the schedule").click()
    page.wait_for_url("**/campaigns")
    entry = page.get_by_role("region", name="Schedule").first
    expect(entry).to_contain_text("20:00")
    expect(entry).to_contain_text("Europe/Berlin")
    entry.get_by_role("button", name="Cancel").click()
    expect(page.locator(".toasts")).to_contain_text("Removed from the schedule")
    assert service.get("/api/schedule") == []


@pytest.mark.slow
def test_a_designed_recipe_is_the_services_and_its_plan_is_shown(service: Service, visit: Callable[..., Page]) -> None:
    from playwright.sync_api import expect

    page = visit("/campaigns/new?recipe=short")
    page.get_by_text("Design a campaign for an uncertainty").click()
    card = page.locator("details", has_text="Design a campaign for an uncertainty")
    card.get_by_label("Ranges of").select_option("short")
    card.get_by_label("U of a corrected rate").fill("0.02")
    card.get_by_role("button", name="Design", exact=True).click()
    expected = service.post("/api/designs", {"like": "short", "u_dps": 0.02})
    expect(card.get_by_role("button", name="Take this recipe")).to_be_visible()
    for sentence in expected["decisions"]:
        expect(card).to_contain_text(on_page(sentence))
    rows = [expected["chosen"], *expected["others"], *filter(None, [expected["reference"]])]
    drawn = figure(page, "Hours and uncertainty of the recipes")["data"][0]
    assert drawn["x"] == pytest.approx([row["hours"] for row in rows])
    assert drawn["y"] == pytest.approx([row["u_worst_dps"] for row in rows])
    expect(card.locator("tbody tr")).to_have_count(len(rows))
    card.get_by_role("button", name="Take this recipe").click()
    expect(page.get_by_label("Recipe as TOML")).to_have_value(expected["recipe_toml"])
    plan = service.post("/api/plans", {"recipe": expected["recipe_toml"]})
    expect(page.get_by_role("region", name="Steps")).to_contain_text(str(plan["datasets"]))
    assert plan["expected_s"] == pytest.approx(3600 * expected["chosen"]["hours"])


#: A list of events of two days, on the page.
EVENTS = """async (given) => {
  const { eventList } = await import("/static/js/bench/event_list.js");
  const list = eventList(10);
  document.querySelector("main").replaceChildren(list);
  given.forEach((at, k) =>
    list.add({ at, t_s: 60 * k, level: "info", kind: "note", message: `event ${k}`, device: null, value: null }));
}"""


def test_events_of_several_days_stand_below_their_day(visit: Callable[..., Page]) -> None:
    from playwright.sync_api import expect

    page = visit("/campaigns")
    page.get_by_role("heading", name="Campaigns", exact=True).wait_for()
    page.evaluate(EVENTS, ["2026-01-05T12:00:00Z", "2026-01-06T12:00:00Z", "2026-01-06T12:01:00Z"])
    lines = page.locator("main .events li")
    expect(lines).to_have_count(5)
    days = [text for text in lines.all_inner_texts() if text.endswith("2026")]
    assert days == ["6 Jan 2026", "5 Jan 2026"]
    assert lines.nth(0).inner_text() == "6 Jan 2026"
    assert "event 0" in lines.nth(4).inner_text()
    page.evaluate(EVENTS, ["2026-01-06T12:00:00Z", "2026-01-06T12:01:00Z"])
    expect(lines).to_have_count(2)  # one day needs no line of its own
