"""Takes the picture of the README: the upper part of a report, as a browser shows it.

``python -m scripts.pages.readme_picture out/demo/report/report.html docs/images/report.png``
"""

import sys
from pathlib import Path

from scripts.pages.browser import tab

WIDTH_PX, FRAME = 1180, 20
REGION = ".columns"


def take(page: Path, target: Path) -> None:
    """Save the region of ``page`` that shows a frame, its residuals, the body and the trajectory.

    Raises
    ------
    InputError
        Where there is no browser.
    """
    target.parent.mkdir(parents=True, exist_ok=True)
    with tab(WIDTH_PX) as shown_in:
        shown_in.goto(page.resolve().as_uri())
        shown_in.evaluate(f"show({FRAME})")
        shown_in.wait_for_timeout(300)
        shown_in.locator(REGION).screenshot(path=target)


if __name__ == "__main__":
    take(Path(sys.argv[1]), Path(sys.argv[2]))
