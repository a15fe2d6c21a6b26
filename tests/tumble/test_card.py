"""The card of a campaign's page is green only where there is nothing left to do."""

from copy import deepcopy
from typing import Any

import pytest

from tumble.reports.campaign_page import _nothing_to_do

DONE: dict[str, Any] = {
    "diagnosis": {"missing": [], "probability": 0.97},
    "unknown": None,
    "steps": [{"established": True}],
    "settled": True,
    "verdict": {"kind": "found"},
    "noise_floor": {"explainable": False},
}
LEFT = [
    ({"diagnosis": {"missing": ["gravity"], "probability": 0.97}}, "something is missing"),
    ({"diagnosis": {"missing": [], "probability": 0.3}}, "something is probably missing"),
    ({"unknown": {"stage": "dynamics"}}, "something unknown is there"),
    ({"steps": [{"established": False}]}, "one effect is suspected"),
    ({"names": [{"names": [{"probability": 0.4, "unknown": False}, {"probability": 0.6, "unknown": True}]}]}, "it is rather unknown"),
    ({"settled": False}, "the fit did not settle"),
    ({"verdict": {"kind": "judged"}}, "it was judged by hand"),
    ({"noise_floor": {"explainable": True}}, "residuals are larger than noise"),
]


def test_nothing_is_left_to_do() -> None:
    assert _nothing_to_do(DONE)
    assert _nothing_to_do({**DONE, "noise_floor": None, "steps": None})


@pytest.mark.parametrize(("change", "why"), LEFT, ids=[why for _, why in LEFT])
def test_something_is(change: dict[str, Any], why: str) -> None:
    assert not _nothing_to_do({**deepcopy(DONE), **change}), why
