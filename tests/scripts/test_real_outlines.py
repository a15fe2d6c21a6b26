"""Real outlines: the tangency errors agree with an independent computation, and left-out views are found again."""

from pathlib import Path

import numpy as np
import pytest

from estimator.geometry.visual_hull import bounding_ball
from estimator.particle import view_poses
from scripts.real_outlines import dinosaur, left_out_errors_deg, pairwise_rms_px, stone, unsmoothed


@pytest.mark.parametrize(("name", "pairs", "independent_px"), [("uct_stone6", 15, 0.71), ("oxford_dino", 630, 0.43)])
def test_error_over_all_pairs(shared_data: Path, name: str, pairs: int, independent_px: float) -> None:
    outlines, views = (stone if name == "uct_stone6" else dinosaur)(shared_data / "silhouettes" / name)
    centre, _ = bounding_ball(outlines, views)
    rms, median, count = pairwise_rms_px(unsmoothed(outlines, views), view_poses(views), centre)
    assert count == pairs
    assert rms == pytest.approx(independent_px, rel=0.05)
    assert median < 0.7 * rms


def test_most_views_of_the_stone_are_found_from_five_others(shared_data: Path) -> None:
    angles = left_out_errors_deg(*stone(shared_data / "silhouettes" / "uct_stone6"))
    assert np.count_nonzero(np.array(angles) < 3.0) >= 4
