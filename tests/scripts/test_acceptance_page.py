"""The acceptance page is what its script writes from the committed results, and the summaries agree with the sequences beside them."""

import json
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from scripts.acceptance.acceptance_page import OTHER, PAGE, RENDERED, SILHOUETTE, another_seed, first_part, rewritten, slow_flights, within

ROOT = Path(__file__).parents[2]


def result_of(path: Path) -> tuple[dict[str, Any], pd.DataFrame]:
    return json.loads((ROOT / path).read_text(encoding="utf-8")), pd.read_csv((ROOT / path).with_suffix(".csv"))


@pytest.mark.parametrize("path", [SILHOUETTE, OTHER])
def test_summary_and_sequences_agree(path: Path) -> None:
    result, table = result_of(path)
    assert len(table) == result["sequences"]
    in_plane, angular = within(table)
    assert in_plane / len(table) == pytest.approx(result["share_in_plane_within_0.5_percent"], abs=1e-9)
    assert angular / len(table) == pytest.approx(result["share_angular_within_1_percent"], abs=1e-9)
    for key, value in result["median_percent"].items():
        assert table[f"middle_{key}_percent"].median() == pytest.approx(value, rel=1e-5)


def test_the_page_is_what_the_script_writes() -> None:
    (result, this), (other, that) = result_of(SILHOUETTE), result_of(OTHER)
    page = (ROOT / PAGE).read_text(encoding="utf-8")
    assert rewritten(page, first_part(result, pd.read_csv(ROOT / RENDERED)), another_seed(other, (this, that))) == page


def test_only_its_two_parts_are_rewritten() -> None:
    page = "old\nHow to make them again:\nkept\n## Another seed\nold\n## Diamond\nkept too\n"
    assert rewritten(page, "new\n", "## Another seed\nnew\n") == (
        "new\nHow to make them again:\nkept\n## Another seed\nnew\n## Diamond\nkept too\n"
    )


def test_slow_flights_are_slow_in_either_way() -> None:
    table = pd.DataFrame({"speed_ms": [0.2, 2.0, 2.0, 0.1], "spin_rads": [100.0, 40.0, 100.0, 10.0]})
    assert slow_flights(table) == 3
