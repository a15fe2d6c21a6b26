"""The report shows the estimate's own numbers, draws its outlines, and asks nothing of a network."""

import json
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from datasets.estimate import Estimate, ImpactEstimate, Status
from datasets.estimate_files import write_estimate
from datasets.observation import Observation
from datasets.truth import Truth
from datasets.vocabulary.outline import Outline
from datasets.vocabulary.surface_mesh import SurfaceMesh
from estimator.outlines.sightings import tracks_of
from synth.sequence import build_silhouette_sequence
from tests.datasets.test_truth_files import impact
from tests.tumble.browsing import Tab, opened
from tests.tumble.made_up import made_up_estimate, small_recipe
from tumble.cli.estimate import impact_sentence
from tumble.numbers import with_sigma
from tumble.reporting import report_item
from tumble.reports.csv_tables import TABLES
from tumble.reports.overlay import estimated_outlines, surface_of
from tumble.reports.page import render, write_page
from tumble.reports.payload import flat, sequence_parts, sequence_payload
from tumble.reports.record import Record


@pytest.fixture(scope="module")
def sequences() -> list[tuple[Observation, Truth]]:
    recipe = small_recipe(sequences=2, frames=6, drops=2)
    return [build_silhouette_sequence(recipe, index) for index in range(2)]


@pytest.fixture(scope="module")
def estimates(sequences: list[tuple[Observation, Truth]]) -> list[Estimate]:
    statuses = (Status.CONVERGED, Status.AMBIGUOUS)
    return [made_up_estimate(*pair, status=status) for pair, status in zip(sequences, statuses, strict=True)]


@pytest.fixture(scope="module")
def page(sequences: list[tuple[Observation, Truth]], estimates: list[Estimate], tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("report") / "report.html"
    pairs = zip(sequences, estimates, strict=True)
    records = [Record(e, o, truth, estimated_outlines(e, o), tracks_of(o), surface_of(e, o)) for (o, truth), e in pairs]
    write_page([sequence_parts(record, most_frames=8) for record in records], path, title="A <report> & more")
    return path


def test_the_estimated_outline_lies_on_the_observed_one(sequences: list[tuple[Observation, Truth]], estimates: list[Estimate]) -> None:
    observation = sequences[0][0]
    (outlines,) = estimated_outlines(estimates[0], observation)
    for found, seen in zip(outlines, observation.recordings[0], strict=True):
        assert found is not None
        np.testing.assert_allclose(found.min(axis=0), seen.points_px.min(axis=0), atol=2.0)
        np.testing.assert_allclose(found.max(axis=0), seen.points_px.max(axis=0), atol=2.0)


def test_the_surface_of_the_fit_is_shown_where_there_is_one(sequences: list[tuple[Observation, Truth]], estimates: list[Estimate]) -> None:
    observation, truth = sequences[0]
    fitted = replace(estimates[0], surface=SurfaceMesh(truth.mesh_vertices, truth.mesh_faces))
    found = [sequence_payload(Record(e, observation, surface=surface_of(e, observation)), most_frames=1) for e in (fitted, estimates[0])]
    names = [next(name for name, _ in payload["body"]["facts"] if name.startswith("volume")) for payload in found]
    assert names == ["volume of the surface of the last fit, mm³", "volume of the visual hull of the views, mm³"]
    assert surface_of(fitted, observation) is fitted.surface


def test_a_view_that_the_estimate_left_out_does_not_carve_the_shown_hull(
    sequences: list[tuple[Observation, Truth]], estimates: list[Estimate]
) -> None:
    observation = sequences[0][0]
    outlines = list(observation.view_recording)
    outlines[3] = Outline(outlines[3].points_px.mean(axis=0) + 0.4 * (outlines[3].points_px - outlines[3].points_px.mean(axis=0)))
    mixed = replace(observation, view_recording=tuple(outlines))
    told = replace(estimates[0], statistics={**estimates[0].statistics, "views_left_out": [3]})
    whole, cut, mended = (surface_of(e, o) for e, o in ((estimates[0], observation), (estimates[0], mixed), (told, mixed)))
    assert whole is not None
    assert cut is not None
    assert mended is not None
    size = np.ptp(whole.vertices, axis=0)
    assert np.any(np.ptp(cut.vertices, axis=0) < 0.8 * size)
    np.testing.assert_allclose(np.ptp(mended.vertices, axis=0), size, rtol=0.05)


def test_the_outline_is_shown_through_the_focal_length_that_was_measured(
    sequences: list[tuple[Observation, Truth]], estimates: list[Estimate]
) -> None:
    observation = sequences[0][0]
    k = observation.cameras[0].intrinsics
    told = {**estimates[0].statistics, "focal_length": {"focal_px": [1.1 * k.fx_px, 1.1 * k.fy_px]}}
    (stated,), (measured,) = (estimated_outlines(e, observation) for e in (estimates[0], replace(estimates[0], statistics=told)))
    assert stated[0] is not None
    assert measured[0] is not None
    np.testing.assert_allclose(np.ptp(measured[0], axis=0), 1.1 * np.ptp(stated[0], axis=0), rtol=0.02)


def test_minima_are_told_in_words_and_with_the_digits_they_deserve(estimates: list[Estimate]) -> None:
    minima = [{"rms_ete_px": 0.0979191, "cost": 0.846576}, {"rms_ete_px": 0.350286, "cost": 10.8351}]
    payload = sequence_payload(Record(replace(estimates[0], statistics={"competing_minima": minima})), most_frames=8)
    assert payload["minima"] == {
        "columns": ["RMS ETE, px", "cost per pair (1 is expected)"],
        "rows": [["0.09792", "0.8466"], ["0.3503", "10.84"]],
    }


def test_no_pull_is_minus_nothing(sequences: list[tuple[Observation, Truth]]) -> None:
    truth = sequences[0][1]
    payload = sequence_payload(Record(made_up_estimate(*sequences[0], off=-0.001), None, truth), most_frames=8)
    assert {row["pull"] for row in payload["velocities"][0]["rows"][:6]} == {"0.0"}


def test_both_sides_of_an_impact_are_told_beside_the_true_one(
    sequences: list[tuple[Observation, Truth]], estimates: list[Estimate]
) -> None:
    (_, truth), estimate = sequences[0], estimates[0]
    assert estimate.start is not None
    assert estimate.middle is not None
    states = truth.motion
    time_s = float(states.times_s[3])
    sides = [replace(side, time_s=time_s) for side in (estimate.start, estimate.middle)]
    measured = ImpactEstimate(time_s, 2e-6, states.x_world[3], states.q_world_body[3], sides[0], sides[1], np.eye(18))
    true = replace(impact(time_s=time_s + 1e-5), v_before=sides[0].v_world + 0.01, omega_after=sides[1].omega_world + 1.0)
    record = Record(replace(estimate, impacts=(measured,)), None, replace(truth, impacts=(true, impact(time_s=9.0))))
    payload = sequence_payload(record, most_frames=8)
    when = with_sigma(1e3 * time_s, 2e-3)
    first, before, after, last = payload["velocities"]
    assert payload["impacts"] == [3.0]
    assert [first["heading"][:23], last["heading"][:24]] == ["Velocities at the start", "Velocities at the middle"]
    assert before["heading"] == f"Velocities right before impact 1 ({when} ms)"
    assert after["heading"] == "Velocities right after impact 1"
    assert [row["true"] for row in before["rows"][:3]] == pytest.approx(true.v_before.tolist())
    assert [row["true"] for row in after["rows"][3:6]] == pytest.approx(true.omega_after.tolist())
    assert "right before impact 1" in render([sequence_parts(record, most_frames=8)], title="t")
    said = impact_sentence(1, measured)
    assert when in said
    assert before["rows"][6]["text"] in said
    assert after["rows"][7]["text"] in said


def test_parameters_have_no_more_digits_than_their_spread(estimates: list[Estimate]) -> None:
    one = replace(estimates[0], values=np.array([1.23456789, -0.5]), covariance=np.diag([1e-6, 0.04]))
    payload = sequence_payload(Record(one), most_frames=8)
    assert payload["parameters"] == [["v_x", "1.2346", "0.0010"], ["v_y", "-0.50", "0.20"]]


def test_a_report_without_observation_and_truth_still_says_the_numbers(estimates: list[Estimate]) -> None:
    payload = sequence_payload(Record(estimates[0]), most_frames=8)
    assert payload["cameras"][0]["pictures"] == []
    assert payload["velocities"][1]["rows"][0]["true_text"] == ""
    assert "Infinity" not in render([sequence_parts(Record(estimates[0]), most_frames=8)], title="t")


def test_an_estimate_without_a_measurement_has_a_page() -> None:
    nothing = Estimate("lost", Status.NO_CONVERGENCE, "no start came below 1 px")
    payload = sequence_payload(Record(nothing), most_frames=8)
    assert payload["velocities"] == []
    assert "no start came below 1 px" in render([sequence_parts(Record(nothing), most_frames=8)], title="t")


def test_the_page_refers_to_nothing_outside(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    assert re.findall(r"""(?:src|href)\s*=\s*["'](?!data:|#)[^"']*""", text) == []
    assert "@import" not in text
    assert set(re.findall(r"https?://[^\s\"']+", text)) <= {"http://www.w3.org/2000/svg"}
    assert "<title>A &lt;report&gt; &amp; more</title>" in text


def test_nested_values_become_dotted_rows() -> None:
    assert flat({"a": {"b": 1.0, "c": [1, 2]}, "d": list(range(20))}) == [["a.b", "1"], ["a.c", "1, 2"], ["d", "20 entries"]]


def test_a_value_is_as_fine_as_its_uncertainty() -> None:
    assert with_sigma(1.23456, 0.0021) == "1.2346 ± 0.0021"
    assert with_sigma(123.456, 4.2) == "123.5 ± 4.2"
    assert with_sigma(1.5, float("nan")) == "1.5000 ± unknown"


@pytest.fixture(scope="module")
def browser(page: Path) -> Iterator[Tab]:
    with opened(page) as tab:
        yield tab


ESTIMATED = (0xD9, 0x48, 0x0F)
OBSERVED = (0x1C, 0x7E, 0xD6)
TEXTS = "(query) => [...document.querySelectorAll(query)].map((cell) => cell.textContent)"


def test_the_numbers_on_the_page_are_those_of_the_estimate(browser: Tab, estimates: list[Estimate]) -> None:
    browser.page.click('.pick[data-sequence="0"]')
    middle = estimates[0].middle
    assert middle is not None
    sigma = np.sqrt(np.diag(middle.covariance))
    expected = [with_sigma(value, s) for value, s in zip([*middle.v_world, *middle.omega_world], sigma, strict=True)]
    shown = browser.page.evaluate(TEXTS, "#velocities .scroll:nth-of-type(2) tbody tr td:nth-child(2)")
    assert shown[:6] == expected
    assert browser.page.inner_text("#status") == "converged"
    assert browser.page.evaluate(TEXTS, "#left-out td") == ["cut off by the picture's edge", "1", "2"]
    assert "171.5" in browser.page.inner_text("#minima")


def test_canvases_are_drawn_and_the_outline_can_be_switched_off(browser: Tab) -> None:
    browser.page.click('.pick[data-sequence="0"]')
    drawn = browser.colour_count("player", ESTIMATED)
    assert drawn > 500
    assert browser.colour_count("player", OBSERVED) > 200
    assert browser.colour_count("trajectory", ESTIMATED) > 50
    assert browser.colour_count("errors", ESTIMATED) > 50
    browser.page.uncheck("#show-estimated")
    assert browser.colour_count("player", ESTIMATED) < 0.2 * drawn
    browser.page.check("#show-estimated")


def test_frames_can_be_stepped_and_the_view_turned(browser: Tab) -> None:
    browser.page.click('.pick[data-sequence="0"]')
    picture = "(id) => document.getElementById(id).toDataURL()"
    first, view = (browser.page.evaluate(picture, name) for name in ("player", "trajectory"))
    browser.page.click("#forth")
    browser.page.click("#forth")
    assert "left out: cut off" in browser.page.inner_text("#frame-label")
    assert browser.page.evaluate(picture, "player") != first
    browser.page.focus("#trajectory")
    browser.page.keyboard.press("ArrowRight")
    assert browser.page.evaluate(picture, "trajectory") != view


def test_another_sequence_can_be_picked(browser: Tab, estimates: list[Estimate]) -> None:
    browser.page.click('.pick[data-sequence="1"]')
    assert browser.page.inner_text("#status") == "ambiguous"
    assert estimates[1].name in browser.page.inner_text("#verdict")


def test_the_page_asks_nothing_of_a_network_and_has_no_errors(browser: Tab, page: Path) -> None:
    assert [url for url in browser.requests if not url.startswith("data:")] == [page.as_uri()]
    assert browser.errors == []


def test_the_page_fits_a_phone(browser: Tab) -> None:
    browser.page.set_viewport_size({"width": 390, "height": 800})
    assert browser.page.evaluate("() => document.documentElement.scrollWidth") <= 390
    browser.page.set_viewport_size({"width": 1280, "height": 900})


def test_the_embedded_data_is_json(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    found = re.findall(r'<script type="application/json" id="([^"]*)">(.*?)</script>', text, re.DOTALL)
    known = {name: json.loads(content) for name, content in found}
    assert [known[f"sequence-{k}"]["status"] for k in range(2)] == ["converged", "ambiguous"]
    for name in TABLES:
        assert known[f"csv-{name}"] == (page.parent / f"{name}.csv").read_text(encoding="utf-8")


def test_the_surface_that_was_read_is_among_what_was_read(
    sequences: list[tuple[Observation, Truth]], estimates: list[Estimate], tmp_path: Path
) -> None:
    truth = sequences[0][1]
    path = tmp_path / "flight.estimate.json"
    write_estimate(replace(estimates[0], surface=SurfaceMesh(truth.mesh_vertices, truth.mesh_faces)), path)
    payload = {"estimate": str(path), "observations": {}, "truth": None, "particle": None, "most_frames": 1}
    assert [name for name, _ in report_item(payload)["shown"]["read"]] == ["flight.estimate.json", "flight.surface.ply"]
