"""Charts of campaigns: what is measured is drawn where its numbers are, and ticks are read as numbers."""

import re
from xml.etree import ElementTree

import pytest

from tumble.reports.campaign_charts import autocorrelation_chart, ladder_chart
from tumble.reports.drawing import HEIGHT, WIDTH, frame_about, range_of, ticks_in
from tumble.reports.map_charts import BAD, MEASURED, map_chart

LINE = {
    "name": "speed",
    "kind": "along_v",
    "unit": "m/s",
    "second": None,
    "centre": [1.0, 2.0, 4.0],
    "mean_px": [0.1, -0.2, 0.8],
    "sigma_px": [0.1, 0.1, 0.1],
}
PLANE = {**LINE, "name": "place", "kind": "offset", "unit": "px", "centre": [10.0, 400.0, 700.0], "second": [5.0, 300.0, 20.0]}


def drawn(entry: dict[str, object]) -> ElementTree.Element:
    return ElementTree.fromstring(map_chart(entry).split("<details")[0].replace("&nbsp;", " "))


def circles(entry: dict[str, object]) -> list[tuple[float, float, float, str]]:
    every = drawn(entry).iter("{http://www.w3.org/2000/svg}circle")
    return [(*(float(c.attrib[key]) for key in ("cx", "cy", "r")), c.attrib["fill"]) for c in every]


def test_points_lie_where_their_numbers_are() -> None:
    (a, b, c) = circles(LINE)
    assert (c[0] - b[0]) == pytest.approx(2.0 * (b[0] - a[0]), abs=0.05)
    assert (b[1] - a[1]) / (a[1] - c[1]) == pytest.approx(0.3 / 0.7, abs=0.01)
    assert [each[3] for each in (a, b, c)] == [MEASURED, MEASURED, BAD]
    assert all(0.0 < x < WIDTH and 0.0 < y < HEIGHT for x, y, _, _ in (a, b, c))


def test_a_picture_has_one_scale_and_grows_downwards() -> None:
    (a, b, _) = circles(PLANE)
    assert (b[0] - a[0]) / 390.0 == pytest.approx((b[1] - a[1]) / 295.0, rel=1e-2)
    assert b[2] == pytest.approx(a[2] * 2.0**0.5, abs=0.01)


def test_what_is_no_number_is_not_drawn() -> None:
    assert len(circles({**LINE, "sigma_px": [0.1, float("inf"), 0.1], "mean_px": [0.1, float("nan"), 0.8]})) == 2
    assert circles({**LINE, "sigma_px": [float("inf")] * 3}) == []


@pytest.mark.parametrize(
    ("ends", "expected"), [((-0.031, 0.024), (-0.03, -0.02, -0.01, 0.0, 0.01, 0.02)), ((0.0, 1e6), (0.0, 2e5, 4e5, 6e5, 8e5, 1e6))]
)
def test_ticks_are_round_numbers(ends: tuple[float, float], expected: tuple[float, ...]) -> None:
    assert ticks_in(*ends, 6) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("values", [[3.0], [0.0, 0.0], [1e-14, 2.5e-14], [-2e7, 3e7], [99.99, 100.01]])
def test_labels_are_the_ticks(values: list[float]) -> None:
    frame = frame_about(range_of(values), range_of(values), ("x", "y"))
    said = [text.replace("−", "-") for text in re.findall(r"<text[^>]*>([^<]*)</text>", frame.drawn([], "")) if text not in "xy"]
    assert list(map(float, said)) == pytest.approx([*frame.x.ticks, *frame.y.ticks], rel=1e-6, abs=1e-30)
    assert 2 <= len(frame.x.ticks) <= 6


def rung(held: float) -> dict[str, object]:
    return {"added": "linear_drag", "effects": ["linear_drag"], "held_out": {"rms_px": held}, "fitted_rms_px": 0.5}


def test_a_ladder_falls_and_survives_a_flight_that_ran_away() -> None:
    whole = ElementTree.fromstring(ladder_chart([rung(2.0), rung(1.0), rung(float("inf"))], 0.8))
    held = [c for c in whole.iter("{http://www.w3.org/2000/svg}circle") if c.attrib["fill"] == MEASURED]
    heights = [float(c.attrib["cy"]) for c in held]
    assert heights[2] < heights[0] < heights[1]
    assert "1.0000" in [text.text for text in whole.iter("{http://www.w3.org/2000/svg}text")]


def test_likeness_without_a_number_is_not_drawn() -> None:
    chart = autocorrelation_chart({"lags": [1, 2, 5], "autocorrelation": [0.2, "NaN", -0.3]}).split("<details")[0]
    assert len(list(ElementTree.fromstring(chart).iter("{http://www.w3.org/2000/svg}circle"))) == 2
