"""From one version to the next: what moves on the page begins and ends at the numbers of the service."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from labctl.probability_text import probability_text
from tests.helpers.browser import Faults, Service, figure, settled

if TYPE_CHECKING:
    from playwright.sync_api import Page

#: Keep every text that the counter shows, from the moment that it is on the page.
WATCH = """() => {
  window.counted = [];
  new MutationObserver(() => {
    const text = document.querySelector("#finish .finish-counter")?.textContent;
    if (text && text !== window.counted.at(-1)) window.counted.push(text);
  }).observe(document.querySelector("main"), { childList: true, subtree: true, characterData: true });
}"""


@pytest.fixture(scope="module")
def template(furnish: Callable[..., Path]) -> Path:
    """Import the real gyro and fit it with the effect left out that it shows."""

    def fitted(service: Service) -> None:
        made = service.post("/api/recordings/example", {"name": "osu-fog"})
        path = f"/api/units/{made['serial']}/calibrations"
        service.post(path, {"recording": made["recording"], "model": "bias_scale"})

    return furnish(fitted)


@pytest.fixture
def unit(service: Service) -> str:
    return str(service.get("/api/recordings/1")["serial"])


def make_version(page: Page) -> None:
    """Add the sine of an open-loop gyro to the first version."""
    from playwright.sync_api import expect

    settled(page)
    learn = page.get_by_role("region", name="Which effects are missing")
    learn.get_by_role("listitem").filter(has_text="sine response").get_by_role("button", name="Add").first.click()
    adding = page.get_by_role("region", name="Add it")
    expect(adding).to_contain_text("RMS residual")
    page.evaluate(WATCH)
    adding.get_by_role("button", name="Make version 2").click()
    page.wait_for_url("**version=2**")


def shown(value: float) -> float:
    return float(f"{value:.3g}")


@pytest.mark.slow
def test_explore_says_what_its_buttons_do_and_what_an_experiment_can_decide(
    service: Service, visit: Callable[..., Page], unit: str, faults: Faults
) -> None:
    from playwright.sync_api import expect

    criticism = service.get(f"/api/units/{unit}/calibrations/1/criticism")
    best = criticism["experiments"][0]
    assert best["power"] - best["names_wrong"] < 0.05, (
        "this recording needs an experiment that is not expected to decide"
    )
    page = visit(f"/explore?unit={unit}&version=1")
    settled(page)
    expect(page.get_by_role("region", name="Verdict")).to_contain_text(
        "No experiment that labctl can plan from these data is expected to name one cause alone"
    )
    expect(page.locator("main")).not_to_contain_text("To distinguish them")
    for link in page.get_by_role("navigation", name="On this page").get_by_role("link").all():
        heading = page.locator(f"{link.get_attribute('href')} h2").inner_text()
        assert set(link.inner_text().lower().split()) <= set(re.findall("[a-z]+", heading.lower())), heading

    learn = page.get_by_role("region", name="Which effects are missing")
    expect(learn).to_contain_text(
        f"the probability that one cause is then named alone is {probability_text(best['power'])}"
    )
    primary = learn.get_by_role("listitem").filter(has=page.locator(".button.primary"))
    expect(primary.locator(".suspect-name")).to_have_text(["sine response"])  # whose addition is advised
    sine = learn.get_by_role("listitem").filter(has_text="sine response")
    sine.get_by_role("button", name="What if").click()
    expect(page.get_by_role("heading", name="What if: sine response")).to_be_in_viewport()
    adding = page.get_by_role("region", name="Add it")
    assert not adding.locator(".button.primary").all()  # there is nothing to preview yet
    sine.get_by_role("button", name="Add").click()
    expect(adding).to_contain_text("nothing is stored yet")
    expect(adding).to_contain_text("(usual: 0 (rad/(rad/s))² to 2.3 (rad/(rad/s))²)")
    assert [row["version"] for row in service.get(f"/api/units/{unit}/calibrations")] == [1]
    assert adding.locator(".button.primary").all_inner_texts() == ["Make version 2"]  # the one next step

    learn.get_by_role("link", name="Plan it").first.click()
    expect(page.get_by_text(f"This experiment is for {unit}, which is not on single-axis-sim.")).to_be_visible()
    own = page.get_by_role("radiogroup", name="Recipe").get_by_role("radio").first
    expect(own).to_be_checked()
    assert own.get_attribute("value") == "own"
    faults.clear()  # this bench refuses the plan, and the browser reports that


def residual_of(service: Service, serial: str, version: int) -> dict[str, Any]:
    answer: dict[str, Any] = service.get(f"/api/units/{serial}/calibrations/{version}/criticism")
    return answer


def test_the_error_runs_from_the_one_version_to_the_other_and_ends_green(
    service: Service, visit: Callable[..., Page], unit: str
) -> None:
    from playwright.sync_api import expect

    page = visit(f"/explore?unit={unit}")
    make_version(page)
    finish = page.locator("#finish")
    expect(finish).to_contain_text("these data say nothing more", ignore_case=True)
    expect(finish.locator(".notice.good")).to_be_visible()
    before, after = (residual_of(service, unit, version) for version in (1, 2))
    page.wait_for_function(
        "end => Number(window.counted.at(-1)) === end && window.counted.length > 3",
        arg=shown(after["error"]["rms_dps"]),
    )
    bar = finish.get_by_role("group", name="RMS error, deg/s, on a logarithmic scale")
    ticks = bar.locator(".finish-tick")
    sizes = [float(text) for text in ticks.all_inner_texts()]
    places = [tick.bounding_box() for tick in ticks.all()]
    middles = [place["x"] + place["width"] / 2 for place in places if place]
    steps = [(b - a) / math.log(q / p) for a, b, p, q in zip(middles, middles[1:], sizes, sizes[1:], strict=False)]
    assert len(steps) > 1
    assert steps == pytest.approx([steps[0]] * len(steps), rel=0.03)  # a factor is as far wherever it is
    counted = [float(text) for text in page.evaluate("window.counted")]
    assert counted[0] == shown(before["error"]["rms_dps"])
    assert counted == sorted(counted, reverse=True)
    drawn = figure(page, "Residual from version to version")["data"][0]
    residual = after["views"]["sets"]["residual_dps"]["z"]
    assert drawn["y"] == pytest.approx(residual, abs=1e-5)  # the preview is a fit of its own
    cells = figure(page, "Residual over floor from version to version")["data"][0]
    scores = after["views"]["sets"]["over_floor"]["z"]
    shades = cells["marker"]["color"] if "marker" in cells else [z for row in cells["z"] for z in row if z is not None]
    assert max(shades) <= max(scores) + 1e-3
    assert min(shades) >= min(scores) - 1e-3
    assert after["undistinguished"] == [{"effect": "sine_response", "others": ["scale_factor_odd"], "version": 1}]
    expect(finish).to_contain_text("the cause is not known: sine response or scale factor odd")
    finish.get_by_role("button", name="Certify").click()
    expect(page.get_by_role("dialog")).to_contain_text("Certify version 2 of")
    assert f"/units/{unit}" in page.url
    page.goto(f"{service.url}/explore?unit={unit}&version=2")  # the next step is there after a reload as well
    page.locator("main").get_by_role("button", name="Certify").click()
    expect(page.get_by_role("dialog")).to_contain_text("Certify version 2 of")
    body = {"by": "A. Person", "reason": "corrects the error of the optics", "override": True}
    service.post(f"/api/units/{unit}/calibrations/2/certify", body)
    page.goto(f"{service.url}/explore?unit={unit}&version=2#finish")
    expect(page.locator("#finish")).to_contain_text("This version is in force")
    expect(page.locator("#finish")).to_contain_text("the cause is not known: sine response or scale factor odd")
    page.get_by_role("link", name="Experiments to distinguish the causes").click()
    expect(page).to_have_url(re.compile(r"version=1\b.*#learn"))
    expect(page.get_by_role("link", name="Plan it").first).to_be_visible()


@pytest.mark.slow
def test_suspects_beside_an_adequate_model_say_why_none_is_named_and_what_the_noises_are(
    service: Service, visit: Callable[..., Page], unit: str
) -> None:
    from playwright.sync_api import expect

    service.post(f"/api/units/{unit}/calibrations/1/improve", {"add": ["sine_response"]})
    answer = residual_of(service, unit, 2)
    assert answer["verdict"] == "adequate"
    assert answer["why_not_named"] in answer["text"]
    page = visit(f"/explore?unit={unit}&version=2")
    settled(page)
    suspects = page.get_by_role("region", name="Suspected effects: none is named")
    said = re.sub("(?<=[a-z])_(?=[a-z])", " ", answer["why_not_named"])  # the page names effects in words
    expect(suspects).to_contain_text(said)
    expect(suspects).not_to_contain_text("distinguished from noise")
    for suspect in (each for each in answer["suspects"] if each["log_bayes_factor"] > 0):
        row = suspects.get_by_role("listitem").filter(has=page.locator(f"a[href='/effects/{suspect['effect']}']"))
        expect(row.get_by_role("button")).to_have_count(0 if suspect["fit_refused"] else 3)
        if suspect["fit_refused"]:
            expect(row).to_contain_text("It cannot be added to this model: ")
        if suspect["plausible"]:
            expect(row).to_contain_text("of a usual size" if suspect["usual_size"] else "outside of what is usual")
    assert any(each["fit_refused"] for each in answer["suspects"])
    verdict = page.get_by_role("region", name="Verdict")
    expect(verdict).not_to_contain_text(said)  # stands beside the odds, once
    expect(verdict).not_to_contain_text("nothing is missing")
    expect(verdict).to_contain_text("by data sets that repeat each other")
    ratio = answer["error"]["rms_dps"] / answer["error"]["noise_floor_dps"]
    expect(verdict).to_contain_text(
        f"the same for every model: {ratio:.2g} floors are {ratio**2:.2g} times its variance. The ratio "
        f"{answer['lack_of_fit']['statistic']:.2g} compares each data set with its own noise"
    )


@pytest.mark.slow
def test_a_unit_shows_the_coefficients_of_the_version_in_force(
    service: Service, visit: Callable[..., Page], unit: str
) -> None:
    from playwright.sync_api import expect

    service.post(f"/api/units/{unit}/calibrations/1/improve", {"add": ["sine_response"]})
    page = visit(f"/units/{unit}")
    expect(page.get_by_role("region", name="Coefficients").get_by_label("of")).to_have_value("2")
    body = {"by": "A. Person", "reason": "to compare with what was in use before", "override": True}
    service.post(f"/api/units/{unit}/calibrations/1/certify", body)
    page.reload()
    card = page.get_by_role("region", name="Coefficients")
    expect(card.get_by_label("of")).to_have_value("1")
    expect(card).to_contain_text("The uncertainties are those of the fit alone.")


@pytest.mark.slow
def test_nothing_moves_where_less_motion_is_wanted(service: Service, visit: Callable[..., Page], unit: str) -> None:
    from playwright.sync_api import expect

    page = visit(f"/explore?unit={unit}")
    page.emulate_media(reduced_motion="reduce")
    make_version(page)
    after = residual_of(service, unit, 2)
    expect(page.locator("#finish .finish-counter")).to_have_text(f"{shown(after['error']['rms_dps'])}")
    assert len(page.evaluate("window.counted")) == 1


@pytest.mark.slow
def test_the_versions_are_played_again_from_the_ladder(service: Service, visit: Callable[..., Page], unit: str) -> None:
    from playwright.sync_api import expect

    service.post(f"/api/units/{unit}/calibrations/1/improve", {"add": ["sine_response"]})
    page = visit(f"/explore?unit={unit}&version=2")
    settled(page)
    watch = page.get_by_role("region", name="Error of the versions")
    watch.get_by_role("button", name="Replay versions 1, 2").click()
    played = watch.get_by_role("region", name="Versions 1, 2")
    expect(played.locator(".finish-counter")).to_have_text(
        f"{shown(residual_of(service, unit, 2)['error']['rms_dps'])}"
    )
    first, last = (residual_of(service, unit, version)["error"] for version in (1, 2))
    expect(played).to_contain_text(f"Version 1: {shown(first['rms_dps']):.3f} deg/s")
    expect(played).to_contain_text(f"Version 2: {shown(last['rms_dps'])} deg/s")


@pytest.mark.slow
def test_two_versions_lie_side_by_side_with_one_scale_and_one_camera(
    service: Service, visit: Callable[..., Page], unit: str
) -> None:
    from playwright.sync_api import expect

    service.post(f"/api/units/{unit}/calibrations/1/improve", {"add": ["sine_response"]})
    page = visit(f"/explore?unit={unit}&version=2&view=surface")
    settled(page)
    choice = page.get_by_label("Beside the residual")
    choice.select_option(label="the residual of version 1")
    expect(page).to_have_url(re.compile("beside=1"))
    drawn = figure(page, "Residual surfaces of two versions")
    for version, scene in ((2, "scene"), (1, "scene2")):
        columns = service.get(f"/api/units/{unit}/calibrations/{version}/comparison")["columns"]
        residual = dict(zip(columns["dataset"], columns["residual_dps"], strict=True))
        (dots,) = (each for each in drawn["data"] if each["name"] == f"version {version}")
        assert (dots["type"], dots["scene"]) == ("scatter3d", scene)
        assert dots["z"] == pytest.approx([residual[number] for number in dots["customdata"]])
        assert sorted(dots["customdata"]) == sorted(residual)
        title = next(each["text"] for each in drawn["layout"]["annotations"] if f"version {version}:" in each["text"])
        rms = (sum(value**2 for value in residual.values()) / len(residual)) ** 0.5
        assert float(title.split("RMS ")[1].split()[0]) == pytest.approx(rms, rel=0.06)  # two digits
    layout = drawn["layout"]
    for axis in ("xaxis", "yaxis", "zaxis"):
        assert layout["scene"][axis]["range"] == layout["scene2"][axis]["range"]
    plot = page.locator('.plot[aria-label^="Residual surfaces of two versions"]')
    camera = {
        "eye": {"x": 0.3, "y": -2.4, "z": 0.7},
        "center": {"x": 0, "y": 0, "z": 0},
        "up": {"x": 0, "y": 0, "z": 1},
    }
    plot.evaluate("(plot, camera) => Plotly.relayout(plot, {'scene2.camera': camera})", camera)
    page.wait_for_function(
        """() => {
          const plots = [...document.querySelectorAll('.plot')];
          const plot = plots.find((each) => each.getAttribute('aria-label').startsWith('Residual surfaces of two'));
          return [plot.layout.scene, plot.layout.scene2].every(({ camera }) => camera.eye.x === 0.3);
        }"""
    )
