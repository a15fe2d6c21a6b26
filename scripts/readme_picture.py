"""Takes the picture of the README: the upper part of a report, as a browser shows it.

``python -m scripts.readme_picture out/demo/report/report.html docs/images/report.png``
"""

import sys
from pathlib import Path

from playwright.sync_api import sync_playwright

from datasets.errors import InputError
from tumble.environment import find_chromium

WIDTH_PX, FRAME = 1180, 20
REGION = ".columns"


def take(page: Path, target: Path) -> None:
    """Save the region of ``page`` that shows a frame, its residuals, the body and the trajectory.

    Raises
    ------
    InputError
        Where there is no browser.
    """
    chromium = find_chromium()
    if chromium is None:
        raise InputError("a browser is needed: apt-get install chromium")
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=str(chromium), args=["--no-sandbox"])
        tab = browser.new_page(viewport={"width": WIDTH_PX, "height": 900}, color_scheme="light")
        tab.goto(page.resolve().as_uri())
        tab.evaluate(f"show({FRAME})")
        tab.wait_for_timeout(300)
        target.parent.mkdir(parents=True, exist_ok=True)
        tab.locator(REGION).screenshot(path=target)
        browser.close()


if __name__ == "__main__":
    take(Path(sys.argv[1]), Path(sys.argv[2]))
