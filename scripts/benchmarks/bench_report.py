"""A report of 100 sequences of pictures: how large it is, how fast it opens, sorts, plays and prints, and what axe finds in it.

``python -m scripts.benchmarks.bench_report`` or, for fewer, ``--sequences 10``; two minutes on one core, in Chromium without a window.
Sequences are the project's own: silhouettes of cut stones painted as pictures and estimated, ``--distinct`` of them, each under many names,
since a page is as large and as slow with one body as with another. Observations under other names are links to the same files.

Opening is the median of five fresh tabs, from the call to the picture of the first sequence; files are in the system's cache by then.
"""

import argparse
import json
import statistics
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from datasets.estimate_files import write_estimate
from datasets.observation_files import read_observation
from datasets.recipes.recipe import HsvRecipe, MotionRecipe, NoiseRecipe, Recipe, RigRecipe
from datasets.truth_files import write_truth
from estimator.data.configuration import Configuration
from estimator.measuring.free_flight import estimate
from scripts.benchmarks.bench_estimate import as_pictures
from synth.sequence import build_silhouette_sequence
from tumble.cli.main import main
from tumble.environment import find_chromium

FRAMES, SIZE_PX, DROPS = 40, 512, 4
RECIPE = Recipe(
    seed=33,
    motion=MotionRecipe(frames=FRAMES, speed_ms=(0.3, 0.8), spin_rads=(100.0, 200.0)),
    hsv=HsvRecipe(width_px=SIZE_PX, height_px=SIZE_PX),
    rig=RigRecipe(drops=DROPS),
    noise=NoiseRecipe(hsv_boundary_px=0.0),
)
TABS = 5
"""How often the page is opened; the median counts."""
READY = "() => { const image = imageOf(picture()); return image.complete && image.naturalWidth > 0; }"
"""Whether the picture of the sequence that is shown is there."""
SORT = "() => { const began = performance.now(); sortBy(3); document.body.offsetHeight; return performance.now() - began; }"
PICK = "(number) => { const began = performance.now(); pick(number); document.body.offsetHeight; return performance.now() - began; }"
PLAY = "() => { const began = performance.now(); for (let k = 0; k < 40; k++) show(k); return (performance.now() - began) / 40; }"
SERIOUS = ("serious", "critical")


def make_sequences(folder: Path, *, count: int, distinct: int) -> None:
    """Estimates, observations and truth of ``count`` sequences."""
    recipe = replace(RECIPE, sequences=distinct)
    (folder / "estimates").mkdir()
    for index in range(distinct):
        observation, truth = build_silhouette_sequence(recipe, index)
        made = folder / "made" / str(index)
        as_pictures(observation, made, np.random.default_rng(index))
        write_truth(truth, folder / "true" / str(index))
        found = estimate(read_observation(made), Configuration())
        for k in range(index, count, distinct):
            name = f"stone-{k:04d}"
            write_estimate(replace(found, name=name), folder / "estimates" / f"{name}.estimate.json")
            _link(folder / "observations" / name, made)
            _link(folder / "truth" / name, folder / "true" / str(index))


def _link(path: Path, target: Path) -> None:
    path.parent.mkdir(exist_ok=True)
    path.symlink_to(target.resolve(), target_is_directory=True)


@contextmanager
def opened_browser() -> Iterator[Any]:
    """Chromium without a window.

    Raises
    ------
    SystemExit
        Where there is none.
    """
    chromium = find_chromium()
    if chromium is None:
        sys.exit("expected Chromium, got none; `tumble doctor` says how to get it")
    from playwright.sync_api import sync_playwright  # noqa: PLC0415 - only this script needs it, not the library

    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=str(chromium), args=["--no-sandbox", "--disable-gpu"])
        yield browser
        browser.close()


def seconds_to_open(browser: Any, page: Path) -> float:
    """From the call to the first picture, in a fresh tab."""
    tab = browser.new_page(viewport={"width": 1280, "height": 900})
    began = time.perf_counter()
    tab.goto(page.as_uri())
    tab.wait_for_function(READY)
    took = time.perf_counter() - began
    tab.close()
    return took


def in_use(browser: Any, page: Path, sequences: int) -> list[dict[str, Any]]:
    """What sorting, picking, playing and printing take."""
    tab = browser.new_page(viewport={"width": 1280, "height": 900})
    requests: list[str] = []
    tab.on("request", lambda request: requests.append(request.url))
    tab.goto(page.as_uri())
    sort, picked, frame = tab.evaluate(SORT), tab.evaluate(PICK, sequences - 1), tab.evaluate(PLAY)
    began = time.perf_counter()
    printed = tab.pdf()
    took = time.perf_counter() - began
    asked = [url for url in requests if not url.startswith("data:") and url != page.as_uri()]
    tab.close()
    return [
        _figure("sorting the table", sort / 1e3, "s"),
        _figure("picking a sequence", picked / 1e3, "s"),
        _figure("one frame while playing, all charts", frame / 1e3, "s"),
        _figure("printing", took, "s"),
        _figure("its PDF", len(printed) / 1e6, "MB"),
        _figure("files or addresses that the page asked for", len(asked), "", limit=0),
    ]


def findings(browser: Any, page: Path) -> list[dict[str, Any]]:
    """What axe finds, by day and by night, with everything unfolded."""
    from axe_playwright_python.sync_playwright import Axe  # noqa: PLC0415 - as above

    found = []
    for scheme in ("light", "dark"):
        tab = browser.new_page(viewport={"width": 1280, "height": 900}, color_scheme=scheme)
        tab.goto(page.as_uri())
        tab.evaluate("() => document.querySelectorAll('details').forEach((part) => { part.open = true; })")
        violations = Axe().run(tab).response["violations"]
        for violation in violations:
            print(f"axe, {scheme}: {violation['impact']}: {violation['help']} ({len(violation['nodes'])})", file=sys.stderr)
        found.append(_figure(f"axe, {scheme}: serious findings", sum(v["impact"] in SERIOUS for v in violations), "", limit=0))
        found.append(_figure(f"axe, {scheme}: other findings", sum(v["impact"] not in SERIOUS for v in violations), ""))
        tab.close()
    return found


def _figure(name: str, value: float, unit: str, *, limit: float | None = None) -> dict[str, Any]:
    return {"name": name, "value": value, "unit": unit} | ({} if limit is None else {"limit": limit, "direction": "lower"})


def figures(folder: Path, *, count: int, distinct: int, jobs: int) -> list[dict[str, Any]]:
    """Every figure with its unit and, where there is one, its limit."""
    make_sequences(folder, count=count, distinct=distinct)
    words = ["report", str(folder / "estimates"), "--observations", str(folder / "observations"), "--truth", str(folder / "truth")]
    began = time.perf_counter()
    code = main([*words, "--jobs", str(jobs), "--out", str(folder / "report"), "-q"])
    took, page = time.perf_counter() - began, folder / "report" / "report.html"
    pictures = page.read_text(encoding="utf-8").count("data:image/webp")
    size = page.stat().st_size / 1e6
    with opened_browser() as browser:
        opening = statistics.median(seconds_to_open(browser, page) for _ in range(TABS))
        return [
            _figure("exit code of tumble report", code, "", limit=0),
            _figure(f"making the page, {jobs} processes", took, "s"),
            _figure(f"size with {pictures} pictures", size, "MB"),
            _figure("size per 100 pictures", 100.0 * size / max(pictures, 1), "MB", limit=3.0),
            _figure(f"opening, {count} sequences", opening, "s", limit=2.0),
            *in_use(browser, page, count),
            *findings(browser, page),
        ]


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sequences", type=int, default=100, metavar="N", help="sequences of the page (default: %(default)s)")
    parser.add_argument("--distinct", type=int, default=4, metavar="N", help="how many of them are made (default: %(default)s)")
    parser.add_argument("--jobs", type=int, default=1, metavar="N", help="processes that make the page (default: %(default)s)")
    parser.add_argument("--keep", type=Path, metavar="FOLDER", help="keep everything in this new folder")
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        place = given.keep or Path(temporary)
        place.mkdir(parents=True, exist_ok=True)
        found = figures(place, count=given.sequences, distinct=given.distinct, jobs=given.jobs)
    if given.json:
        print(json.dumps(found))
    else:
        for figure in found:
            limit = f"   (at most {figure['limit']:g})" if "limit" in figure else ""
            print(f"{figure['name']:45} {figure['value']:10.3g} {figure['unit']}{limit}")
