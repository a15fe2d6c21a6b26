"""A browser's tab for the pictures of the documents."""

from collections.abc import Iterator
from contextlib import contextmanager

from playwright.sync_api import Page, sync_playwright

from datasets.errors import InputError
from tumble.environment import find_chromium

HEIGHT_PX = 900


@contextmanager
def tab(width_px: int) -> Iterator[Page]:
    """A tab ``width_px`` wide, in the colours of the day.

    Raises
    ------
    InputError
        Where there is no browser.
    """
    chromium = find_chromium()
    if chromium is None:
        raise InputError("a browser is needed for the pictures: apt-get install chromium")
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=str(chromium), args=["--no-sandbox"])
        yield browser.new_page(viewport={"width": width_px, "height": HEIGHT_PX}, color_scheme="light")
        browser.close()
