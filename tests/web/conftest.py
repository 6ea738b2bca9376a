"""A service in this process and a real browser before it."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from labctl.services.campaigns import preparation
from tests.helpers.browser import PATIENCE_MS, WIDE, Faults, Profile, Service
from tests.helpers.migrated_databases import migrated_once
from tests.helpers.paced_hand import PacedClock, PacedPerson

if TYPE_CHECKING:
    from playwright.sync_api import Browser, BrowserContext, Page, Playwright

CHROMIUM = shutil.which("chromium-headless-shell") or shutil.which("chromium")
ARGUMENTS = (
    "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync", "--enable-unsafe-swiftshader",
)  # fmt: skip


@pytest.fixture(scope="module", autouse=True)
def databases() -> Iterator[None]:
    """Take new databases from one that was migrated."""
    with migrated_once():
        yield


@pytest.fixture(autouse=True)
def answers(shared_answers: Path) -> Path:
    """All pages share their kept answers."""
    return shared_answers


@pytest.fixture(scope="session")
def furnish(tmp_path_factory: pytest.TempPathFactory, cache_of_fixtures: None) -> Callable[..., Path]:
    """Return a folder with the database of a service after requests: `furnish(lambda service: ...)`."""

    def furnished(requests: Callable[[Service], object]) -> Path:
        serving = Service(tmp_path_factory.mktemp("furnished"))
        serving.start()
        try:
            requests(serving)
        finally:
            serving.stop()
        return serving.folder

    return furnished


@pytest.fixture(scope="module")
def template() -> Path | None:
    """The folder that each service of a module begins with a copy of; without, it begins empty."""
    return None


@pytest.fixture
def service(tmp_path: Path, template: Path | None) -> Iterator[Service]:
    if template:
        shutil.copytree(template, tmp_path, dirs_exist_ok=True)
    serving = Service(tmp_path)
    serving.start()
    yield serving
    serving.stop()


@pytest.fixture
def waiting(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Service]:
    """A bench whose campaign waits for a person, until it is stopped."""
    monkeypatch.setattr(preparation, "operator_of", lambda _: PacedPerson())
    serving = Service(tmp_path, clock=PacedClock)
    serving.start()
    yield serving
    serving.stop()


@pytest.fixture(scope="session")
def playwright() -> Iterator[Playwright]:
    if CHROMIUM is None:
        pytest.skip("no chromium (on Debian: apt-get install chromium)")
    from playwright.sync_api import expect, sync_playwright

    expect.set_options(timeout=PATIENCE_MS)
    with sync_playwright() as started:
        yield started


@pytest.fixture(scope="session")
def chromium(playwright: Playwright) -> Iterator[Browser]:
    """A browser for contexts that share nothing; each of them compiles all scripts again (1 s)."""
    browser = playwright.chromium.launch(executable_path=CHROMIUM, args=list(ARGUMENTS))
    yield browser
    browser.close()


@pytest.fixture(scope="session")
def profile(playwright: Playwright, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Profile]:
    """A browser with one profile, for all tests of this worker. It keeps the scripts as they were compiled."""
    folder = tmp_path_factory.mktemp("profile")
    context = playwright.chromium.launch_persistent_context(
        folder, executable_path=CHROMIUM, args=list(ARGUMENTS), color_scheme="light"
    )
    yield Profile(context)
    context.close()
    shutil.rmtree(folder, ignore_errors=True)


@pytest.fixture
def faults() -> Iterator[Faults]:
    found = Faults()
    yield found
    assert not found, "\n".join(found)


@pytest.fixture
def visit(
    request: pytest.FixtureRequest, profile: Profile, service: Service, faults: Faults
) -> Iterator[Callable[..., Page]]:
    """Open a page of the service: `visit("/bench", size=NARROW, dark=True)`.

    Unless `idle`, the browser is never idle: a page without figures does not load Plotly for the next one (1 s).
    With `alone`, the page has a context of its own: for a test that changes more than its page.
    """
    contexts: list[BrowserContext] = []

    def new_page(alone: bool) -> Page:
        if not alone:
            return profile.new_page()
        chromium: Browser = request.getfixturevalue("chromium")
        contexts.append(chromium.new_context())
        return contexts[-1].new_page()

    def opened(
        path: str, *, size: dict[str, int] = WIDE, dark: bool = False, idle: bool = False, alone: bool = False
    ) -> Page:
        page = new_page(alone)
        page.set_default_timeout(PATIENCE_MS)
        page.set_viewport_size({"width": size["width"], "height": size["height"]})
        page.emulate_media(color_scheme="dark" if dark else "light")
        if not idle:
            page.add_init_script("window.requestIdleCallback = () => 0")
        page.on("pageerror", lambda error: faults.append(f"{path}: {error}"))
        page.on("console", lambda reported: faults.hear(path, reported))
        page.on("request", lambda asked: faults.check_request(asked.url, service.url))
        page.goto(service.url + path)
        return page

    yield opened
    for context in contexts:
        context.close()
    profile.clear(service.url)
