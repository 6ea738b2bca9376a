"""A page of a service in a browser, as a person beside the bench uses it to stop the table; and what the page shows."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

SIZES = {"wide": {"width": 1280, "height": 860}, "narrow": {"width": 390, "height": 844}}
TITLE = "NOT STOPPED. Use the stop switch."
ARGUMENTS = ("--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking")
#: Notes each change of what lies over the page at nine points of the viewport, and the contrast of its text.
OBSERVE = """
(() => {
  const changes = (window.observed = []);
  const light = (text) => {
    const [r, g, b] = text.match(/[\\d.]+/g).slice(0, 3).map((each) => {
      const c = each / 255;
      return c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4;
    });
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  // a busy computer delays the press itself
  document.addEventListener("submit", () => (window.pressed = Date.now() / 1000), true);
  let before = "";
  setInterval(() => {
    const over = document.querySelector("[data-not-stopped]");
    let state = { shown: false };
    if (over) {
      const places = [0.02, 0.5, 0.98].flatMap((x) => [0.02, 0.5, 0.98].map((y) => [x, y]));
      const hit = places.filter(([x, y]) =>
        over.contains(document.elementFromPoint(x * innerWidth, y * innerHeight)));
      const title = over.querySelector("strong");
      const [a, b] = [getComputedStyle(title).color, getComputedStyle(over).backgroundColor].map(light);
      const box = title.getBoundingClientRect();
      state = {
        shown: true, covers: hit.length / places.length, title: title.textContent, text: over.textContent,
        contrast: (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05),
        size_px: parseFloat(getComputedStyle(title).fontSize),
        whole: box.left >= 0 && box.right <= innerWidth && box.top >= 0 && box.bottom <= innerHeight,
      };
    }
    const text = JSON.stringify(state);
    if (text !== before) changes.push({ at: Date.now() / 1000, ...state });
    before = text;
  }, 40);
})();
"""


@dataclass(frozen=True)
class Shown:
    """What the page showed over everything from a moment on."""

    at_s: float  #: seconds since 1970
    shown: bool
    plain: bool = False  #: over the whole viewport, whole, large and with contrast, with the title
    text: str = ""


@contextmanager
def chromium() -> Iterator[Browser]:
    """Run a browser without a screen."""
    from playwright.sync_api import sync_playwright

    path = shutil.which("chromium-headless-shell") or shutil.which("chromium")
    if path is None:
        raise SystemExit("no chromium (on Debian: apt-get install chromium)")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=list(ARGUMENTS))
        yield browser
        browser.close()


def opened(browser: Browser, url: str, size: str = "wide", *, dark: bool = False) -> Page:
    """Open a page in a browser of its own, which notes what is shown over it."""
    context = browser.new_context(viewport=SIZES[size], color_scheme="dark" if dark else "light")  # type: ignore[arg-type]
    context.set_default_timeout(60_000)
    context.add_init_script(OBSERVE)
    page = context.new_page()
    page.goto(url, wait_until="commit")
    return page


def press_stop(page: Page) -> float:
    """Press Safe stop and confirm it; returns when the page heard that, s since 1970."""
    page.get_by_role("button", name="Safe stop").click()
    confirm = page.get_by_role("dialog").get_by_role("button", name="Stop now")
    confirm.wait_for()
    confirm.click()
    return float(page.evaluate("window.pressed"))


def shown_over(page: Page) -> list[Shown]:
    """Return what was shown over the page since it was loaded."""
    found: list[dict[str, Any]] = page.evaluate("window.observed ?? []")
    return [Shown(each["at"], each["shown"], _is_plain(each), each.get("text", "")) for each in found]


def _is_plain(each: dict[str, Any]) -> bool:
    return bool(
        each["shown"] and each["covers"] == 1 and each["whole"] and each["contrast"] >= 4.5 and each["size_px"] >= 30
        and each["title"] == TITLE
    )  # fmt: skip


def picture(page: Page, folder: Path | None, name: str) -> None:
    """Keep a picture of the page, where pictures are asked for."""
    if folder is not None:
        folder.mkdir(parents=True, exist_ok=True)
        page.screenshot(path=folder / f"{name}.png")
