"""What goes wrong beside a page: reloads, a service that restarts, wrong files, wrong keys, two people at once."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import httpx
import pytest

from labctl.answers.admin import KeyRequest, Role
from labctl.services.commands.registry import CREATE_KEY
from tests.helpers.browser import PATIENCE_MS, Faults, Service, settled
from tests.helpers.paths import EXAMPLES
from tests.helpers.patience import WAIT_S

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

UNIT = "/api/units/OSU-FOG-2024/calibrations"


@pytest.fixture
def fog(service: Service) -> Service:
    service.post("/api/recordings/example", {"name": "osu-fog"})
    service.post(UNIT, {"model": "bias_scale"})
    return service


@pytest.mark.slow
def test_a_reload_in_the_middle_shows_the_same(fog: Service, visit: Callable[..., Page]) -> None:
    from playwright.sync_api import expect

    page = visit("/explore?unit=OSU-FOG-2024&version=1&view=rest")
    before = page.get_by_role("region", name="Verdict").inner_text()
    expect(page.get_by_role("button", name="At rest", exact=True)).to_have_attribute("aria-pressed", "true")
    page.reload()
    expect(page.get_by_role("region", name="Verdict")).to_have_text(before, use_inner_text=True)
    expect(page.get_by_role("button", name="At rest", exact=True)).to_have_attribute("aria-pressed", "true")


@pytest.mark.slow
def test_a_service_that_restarts_is_said_and_then_answers_again(
    fog: Service, visit: Callable[..., Page], faults: Faults
) -> None:
    from playwright.sync_api import expect

    page = visit("/explore?unit=OSU-FOG-2024&version=1")
    page.get_by_role("region", name="Verdict").wait_for()
    page.get_by_label("Add an effect").select_option("sine_response")
    fog.stop()
    page.get_by_role("button", name="Preview").click()
    expect(page.get_by_role("alert")).to_contain_text("The service does not answer")
    fog.start()
    page.get_by_role("button", name="Preview").click()
    expect(page.get_by_role("button", name="Make version 2")).to_be_visible()
    faults.clear()  # the browser itself logs that there was no answer


def test_a_wrong_file_is_refused_with_the_place_of_the_fault(
    service: Service, visit: Callable[..., Page], tmp_path: Path, faults: Faults
) -> None:
    from playwright.sync_api import expect

    source = EXAMPLES / "weiss-gyrostar"
    wrong = tmp_path / "wrong"
    wrong.mkdir()
    for file in source.iterdir():
        if file.suffix in {".toml", ".csv"}:
            text = file.read_text()
            if file.suffix == ".csv":
                lines = text.splitlines()
                lines[3] = ",".join(["twelve", *lines[3].split(",")[1:]])
                text = "\n".join(lines) + "\n"
            (wrong / file.name).write_text(text)
    page = visit("/recordings")
    settled(page)
    page.locator("input[type=file]").first.set_input_files(sorted(wrong.iterdir()))
    expect(page.locator("main")).to_contain_text("twelve")
    assert service.get("/api/recordings") == []
    faults.clear()  # the browser itself logs each refusal


@pytest.mark.slow
def test_the_second_of_two_people_is_told_and_makes_another_version(
    fog: Service, visit: Callable[..., Page], faults: Faults
) -> None:
    from playwright.sync_api import expect

    pages = [visit("/explore?unit=OSU-FOG-2024&version=1") for _ in range(2)]
    for page, effect in zip(pages, ("sine_response", "scale_factor_odd"), strict=True):
        page.get_by_role("region", name="Verdict").wait_for()
        page.get_by_label("Add an effect").select_option(effect)
        page.get_by_role("button", name="Preview").click()
        page.get_by_role("button", name="Make version 2").wait_for()
    first, second = pages
    first.get_by_role("button", name="Make version 2").click()
    expect(first.get_by_role("region", name="Error of the versions")).to_contain_text("Version 1: residual before")
    second.get_by_role("button", name="Make version 2").click()
    told = second.get_by_role("dialog", name="Version 2 of OSU-FOG-2024 exists already")
    expect(told.get_by_role("link", name="Explore version 2")).to_be_visible()
    assert versions(fog) == [(1, None), (2, 1)]
    faults.clear()  # the browser complains of the answer 409
    told.get_by_role("button", name="Make another version").click()
    expect(second.get_by_role("region", name="Error of the versions")).to_contain_text("Version 1: residual before")
    assert versions(fog) == [(1, None), (2, 1), (3, 1)]


def versions(service: Service) -> list[tuple[int, int | None]]:
    """Return each version's number and the number of the one that it was made from."""
    steps = service.get("/api/units/OSU-FOG-2024/ladder")["steps"]
    return [(step["version"], step["parent"]) for step in steps]


@pytest.fixture
def guarded(tmp_path: Path) -> Iterator[tuple[Service, str, str]]:
    """A service that asks for keys: the service, a viewer's key, an operator's."""
    service = Service(tmp_path, keys=True)
    service.start()
    made = [
        service.lab_service.execute(CREATE_KEY, KeyRequest(name=role.name.lower(), role=role)).key
        for role in (Role.VIEWER, Role.OPERATOR)
    ]
    headers = {"Authorization": f"Bearer {made[1]}"}
    for path, body in (("/api/recordings/example", {"name": "osu-fog"}), (UNIT, {"model": "bias_scale"})):
        httpx.post(service.url + path, json=body, headers=headers, timeout=WAIT_S).raise_for_status()
    yield service, made[0], made[1]
    service.stop()


@pytest.mark.slow
def test_a_viewer_may_look_and_preview_and_nothing_else(guarded: tuple[Service, str, str], chromium: Browser) -> None:
    from playwright.sync_api import expect

    service, viewer, _ = guarded
    context = chromium.new_context()
    context.set_default_timeout(PATIENCE_MS)
    page = context.new_page()
    page.goto(f"{service.url}/explore?unit=OSU-FOG-2024&version=1")
    asked = page.get_by_role("dialog")
    expect(asked).to_contain_text("requires a key")
    asked.get_by_label("Key").fill(viewer)
    asked.get_by_role("button", name="Use it").click()
    page.get_by_role("region", name="Verdict").wait_for()
    page.get_by_label("Add an effect").select_option("sine_response")
    page.get_by_role("button", name="Preview").click()
    page.get_by_role("button", name="Make version 2").click()
    expect(page.get_by_role("alert")).to_contain_text("operator")
    headers = {"Authorization": f"Bearer {viewer}"}
    assert len(httpx.get(service.url + UNIT, headers=headers, timeout=WAIT_S).json()) == 1
    context.close()
