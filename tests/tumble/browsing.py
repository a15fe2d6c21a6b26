"""Pages opened from disk in Chromium, and what axe finds in them; tests that use it are skipped where there is no browser."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from tumble.environment import find_chromium

SERIOUS = ("serious", "critical")
COUNT_COLOUR = """([id, red, green, blue]) => {
  const canvas = document.getElementById(id), data = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
  let count = 0;
  for (let k = 0; k < data.length; k += 4) {
    count += Math.abs(data[k] - red) + Math.abs(data[k + 1] - green) + Math.abs(data[k + 2] - blue) < 12 && data[k + 3] > 200;
  }
  return count;
}"""


class Tab:
    """A page opened from disk; what it asked for and what went wrong."""

    def __init__(self, page: Any) -> None:
        self.page = page
        self.requests: list[str] = []
        self.errors: list[str] = []
        page.on("request", lambda request: self.requests.append(request.url))
        page.on("pageerror", lambda error: self.errors.append(str(error)))
        page.on("console", lambda message: self.errors.append(message.text) if message.type == "error" else None)

    def colour_count(self, canvas: str, colour: tuple[int, int, int]) -> int:
        """Pixels of a canvas in a colour (red, green, blue)."""
        return int(self.page.evaluate(COUNT_COLOUR, [canvas, *colour]))


@contextmanager
def opened(page: Path) -> Iterator[Tab]:
    """``page`` in a tab of a browser of its own."""
    chromium = find_chromium()
    if chromium is None:
        pytest.skip("there is no Chromium here; `tumble doctor` says how to get it")
    playwright = pytest.importorskip("playwright.sync_api")
    with playwright.sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=str(chromium), args=["--no-sandbox", "--disable-gpu"])
        tab = Tab(browser.new_page(viewport={"width": 1280, "height": 900}, color_scheme="light"))
        tab.page.goto(page.as_uri())
        yield tab
        browser.close()


def serious_findings(tab: Tab) -> list[str]:
    """What axe finds to be serious, by day and by night, with everything unfolded."""
    axe = pytest.importorskip("axe_playwright_python.sync_playwright").Axe()
    tab.page.evaluate("() => document.querySelectorAll('details').forEach((part) => { part.open = true; })")
    found = []
    for scheme in ("light", "dark"):
        tab.page.emulate_media(color_scheme=scheme)
        violations = axe.run(tab.page).response["violations"]
        found += [f"{scheme}: {v['id']}: {v['nodes'][0]['html'][:120]}" for v in violations if v["impact"] in SERIOUS]
    tab.page.emulate_media(color_scheme="light")
    return found
