"""A report of pictures, from files to the page in a browser: outlines, residuals, the body that turns, table, print, accessibility."""

import hashlib
import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from datasets.estimate import Status
from datasets.estimate_files import write_estimate
from datasets.truth_files import write_truth
from scripts.benchmarks.bench_estimate import as_pictures
from synth.sequence import build_silhouette_sequence
from tests.tumble.browsing import Tab, opened, serious_findings
from tests.tumble.made_up import made_up_estimate
from tests.tumble.small_drops import small_drop
from tumble.cli.main import main

FRAMES = 6
NAMES = ("drop_a", "drop_b", "drop_c")
SEEN, OUTSIDE, INSIDE = (0x1C, 0x7E, 0xD6), (0x9C, 0x36, 0xB5), (0x08, 0x7F, 0x5B)
NAMES_SHOWN = "() => [...document.querySelectorAll('#index tbody tr:not([hidden]) .pick')].map((button) => button.textContent)"
DRAWN = "(id) => document.getElementById(id).toDataURL()"


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One recording of pictures under three names, with three estimates and the truth."""
    root = tmp_path_factory.mktemp("pictures")
    observation, truth = build_silhouette_sequence(small_drop(frames=FRAMES, size_px=160), 0)
    for k, name in enumerate(NAMES):
        as_pictures(observation, root / "observations" / name, np.random.default_rng(1))
        estimate = made_up_estimate(observation, truth, status=Status.AMBIGUOUS if k == 1 else Status.CONVERGED, off=k)
        (root / "estimates").mkdir(exist_ok=True)
        write_estimate(type(estimate)(**{**vars(estimate), "name": name}), root / "estimates" / f"{name}.estimate.json")
        write_truth(truth, root / "truth" / name)
    return root


@pytest.fixture(scope="module")
def out(files: Path) -> Path:
    words = ["report", str(files / "estimates"), "--observations", str(files), "--truth", str(files / "truth"), "--jobs", "1", "-q"]
    assert main([*words, "--out", str(files / "report")]) == 0
    return files / "report"


@pytest.fixture(scope="module")
def opened_page(out: Path) -> Iterator[Tab]:
    with opened(out / "report.html") as tab:
        yield tab


@pytest.fixture
def tab(opened_page: Tab) -> Any:
    """The page itself, for what a person does."""
    return opened_page.page


def test_files_that_were_read_have_their_digests(files: Path, out: Path) -> None:
    told = dict(line.split(",")[1:] for line in (out / "files_read.csv").read_text().splitlines()[1:] if line.startswith("drop_a,"))
    expected = {"drop_a.estimate.json": files / "estimates" / "drop_a.estimate.json"}
    for path in [*(files / "observations" / "drop_a").iterdir(), *(files / "truth" / "drop_a").iterdir()]:
        expected[str(path.relative_to(files))] = path
    assert told == {name: hashlib.sha256(path.read_bytes()).hexdigest() for name, path in expected.items()}


def test_the_outline_seen_in_a_picture_and_the_residuals_are_drawn(tab: Any, opened_page: Tab) -> None:
    count = opened_page.colour_count
    tab.click('.pick[data-sequence="0"]')
    assert count("player", SEEN) > 200
    tab.uncheck("#show-seen")
    assert count("player", SEEN) < 20
    tab.check("#show-seen")
    assert "residual RMS" in tab.inner_text("#frame-label")
    tab.select_option("#exaggeration", "50")
    whiskers = count("player", OUTSIDE) + count("player", INSIDE)
    assert whiskers > 200
    tab.select_option("#exaggeration", "0")
    assert count("player", OUTSIDE) + count("player", INSIDE) < 0.1 * whiskers


def test_the_body_is_turned_by_mouse_and_keys(tab: Any) -> None:
    tab.click('.pick[data-sequence="0"]')
    before = tab.evaluate(DRAWN, "body")
    tab.focus("#body")
    tab.keyboard.press("ArrowRight")
    by_key = tab.evaluate(DRAWN, "body")
    box = tab.locator("#body").bounding_box()
    tab.mouse.move(box["x"] + 100, box["y"] + 100)
    tab.mouse.down()
    tab.mouse.move(box["x"] + 180, box["y"] + 130)
    tab.mouse.up()
    by_mouse = tab.evaluate(DRAWN, "body")
    assert len({before, by_key, by_mouse}) == 3
    tab.keyboard.press("Home")
    assert tab.evaluate(DRAWN, "body") == before


def test_the_table_is_sorted_and_searched_by_keyboard(tab: Any) -> None:
    head = tab.locator("#index thead th", has_text="error of v")
    for order in ("ascending", "descending"):
        head.locator("button").focus()
        tab.keyboard.press("Enter")
        assert head.get_attribute("aria-sort") == order
        assert tab.evaluate(NAMES_SHOWN) == (list(NAMES) if order == "ascending" else list(NAMES[::-1]))
    tab.select_option("#status-choice", "converged")
    assert tab.evaluate(NAMES_SHOWN) == ["drop_c", "drop_a"]
    assert tab.inner_text("#count") == "2 of 3 sequences"
    tab.select_option("#status-choice", "")
    tab.fill("#find", "_B")
    assert tab.evaluate(NAMES_SHOWN) == ["drop_b"]
    tab.fill("#find", "")
    tab.focus('.pick[data-sequence="2"]')
    tab.keyboard.press("ArrowDown")
    tab.keyboard.press("Enter")
    assert "drop_b" in tab.inner_text("#verdict h2")


def test_frames_are_gone_through_on_the_chart_of_errors(tab: Any) -> None:
    tab.click('.pick[data-sequence="0"]')
    tab.focus("#errors")
    for key, frame in (("End", FRAMES - 1), ("ArrowLeft", FRAMES - 2), ("Home", 0), ("ArrowRight", 1)):
        tab.keyboard.press(key)
        assert tab.get_attribute("#errors", "aria-valuenow") == str(frame)
        assert tab.get_attribute("#errors", "aria-valuetext").startswith(f"Frame {frame} ·")
    tab.click("#errors-numbers summary")
    tab.locator("#errors-numbers tbody tr").first.wait_for()
    assert tab.locator("#errors-numbers tbody tr").count() == FRAMES


def test_downloads_are_the_files_beside_the_page(tab: Any, out: Path) -> None:
    tab.select_option("#table-choice", "frames")
    with tab.expect_download() as found:
        tab.click("#download")
    assert found.value.suggested_filename == "frames.csv"
    assert Path(found.value.path()).read_bytes() == (out / "frames.csv").read_bytes()


def test_it_prints_black_on_white(tab: Any) -> None:
    tab.emulate_media(color_scheme="dark")
    dark = tab.evaluate("() => colour('panel')")
    tab.evaluate("() => window.dispatchEvent(new Event('beforeprint'))")
    assert (dark, tab.evaluate("() => colour('panel')")) == ("#1d2125", "#ffffff")
    tab.evaluate("() => window.dispatchEvent(new Event('afterprint'))")
    assert tab.pdf().startswith(b"%PDF")
    tab.emulate_media(color_scheme="light")


def test_axe_finds_nothing_serious(opened_page: Tab) -> None:
    assert serious_findings(opened_page) == []


def test_nothing_went_wrong_on_the_way(opened_page: Tab) -> None:
    opened_page.page.click('.pick[data-sequence="1"]')
    assert opened_page.errors == []


def test_a_sequence_that_cannot_be_read_is_named_and_the_page_has_the_others(
    files: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copytree(files, tmp_path / "some")
    (tmp_path / "some" / "observations" / "drop_b" / "observation.json").write_text("{}")
    words = ["report", str(tmp_path / "some" / "estimates"), "--observations", str(tmp_path / "some" / "observations")]
    assert main([*words, "--jobs", "1", "-q", "--out", str(tmp_path / "out")]) == 1
    assert "drop_b failed" in capsys.readouterr().err
    assert re.findall(r'class="pick"[^>]*>([^<]*)<', (tmp_path / "out" / "report.html").read_text()) == ["drop_a", "drop_c"]
