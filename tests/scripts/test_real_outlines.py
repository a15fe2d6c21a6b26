"""Real outlines: the tangency errors agree with an independent computation, and left-out views are found again."""

from pathlib import Path

import pytest

from datasets.estimate import Status
from estimator.geometry.visual_hull import bounding_ball
from estimator.particle.particle import view_poses
from scripts.real.real_outlines import dinosaur, left_out_pose, pairwise_rms_px, stone, told, unsmoothed


@pytest.mark.parametrize(("name", "pairs", "independent_px"), [("uct_stone6", 15, 0.71), ("oxford_dino", 630, 0.43)])
def test_error_over_all_pairs(shared_data: Path, name: str, pairs: int, independent_px: float) -> None:
    outlines, views = (stone if name == "uct_stone6" else dinosaur)(shared_data / "silhouettes" / name)
    centre, _ = bounding_ball(outlines, views)
    rms, median, count = pairwise_rms_px(unsmoothed(outlines, views), view_poses(views), centre)
    assert count == pairs
    assert rms == pytest.approx(independent_px, rel=0.05)
    assert median < 0.7 * rms


def test_every_view_of_the_stone_is_found_from_five_others_and_what_competes_is_told(shared_data: Path) -> None:
    outlines, views = stone(shared_data / "silhouettes" / "uct_stone6")
    found = [left_out_pose(outlines, views, i, [j for j in range(6) if j != i]) for i in range(6)]
    assert max(f.chosen_deg for f in found) < 3.0
    assert max(f.by_tangency_deg for f in found) > 90.0
    assert found[2].competition.status is Status.AMBIGUOUS
    assert len(found[2].competition.rows) == 2


def test_told_minima_of_the_fifth_view_show_the_cheaper_wrong_one_refused(shared_data: Path) -> None:
    outlines, views = stone(shared_data / "silhouettes" / "uct_stone6")
    fifth = told(left_out_pose(outlines, views, 4, [0, 1, 2, 3, 5]), 5)
    wrong = fifth["minima"][0]
    assert wrong["from_given_deg"] > 90.0
    assert not wrong["stands"]
    assert wrong["rms_ete_px"] < fifth["given_pose"]["rms_ete_px"]
    assert wrong["protrusion_px"] > 2.0 * fifth["allowed"]["protrusion_px"]
    assert sum(m["stands"] for m in fifth["minima"]) == 1
