"""The study's figures are of the sequences that both fits measured, and its table has a line per class and quantity."""

from typing import Any

import numpy as np
import pytest

from datasets.scoring.metrics import COMPONENTS
from scripts.study_surface_fit import ELLIPSOIDS, FITS, summary, table, together

BOUND = {"vx": 1e-4, "vy": 1e-4, "vz": 2e-3, "wx": 0.05, "wy": 0.05, "wz": 0.05}


def row(ratio: float, status: str = "converged", *, bounded: bool = True) -> dict[str, Any]:
    """Scores of one fit whose errors are ``ratio`` times the bound and two standard deviations; ``bounded``: the bound is known."""
    told: dict[str, Any] = {"status": status, "converged": status == "converged", "cpu_s": 2.0, **dict.fromkeys(ELLIPSOIDS, 1.0)}
    for name in COMPONENTS:
        known = (BOUND[name], ratio) if bounded else (np.nan, np.nan)
        told |= {f"middle_pull_{name}": 2.0, f"middle_true_bound_{name}": known[0], f"middle_over_true_bound_{name}": known[1]}
    sizes = (("in_plane_ms", 1e-4 * 2**0.5), ("out_of_plane_ms", 2e-3), ("angular_rads", 0.05 * 3**0.5))
    told |= {f"middle_{name}": ratio * size for name, size in sizes}
    return told | {f"middle_{name}_percent": 0.1 * ratio for name in ("in_plane", "out_of_plane", "angular")}


def test_figures_are_of_what_both_measured() -> None:
    rows = [{"tangents": row(4.0), "surface": row(1.5)}, {"tangents": row(4.0), "surface": row(np.nan, "ambiguous")}]
    told = summary(rows)
    assert (told["sequences"], told["both_converged"]) == (2, 1)
    depth = told["surface"]["depth v, mm/s"]
    assert depth["rmse"] == pytest.approx(3.0)
    assert (depth["rms_bound"], depth["rmse_over_bound"], depth["pull_rms"], depth["inside_95"]) == pytest.approx((2.0, 1.5, 2.0, 0.0))
    assert told["tangents"]["omega, rad/s"]["rmse_over_bound"] == pytest.approx(4.0)
    assert told["tangents"]["v_ellipsoids"] == 1.0
    lines = table({"cut": told, "jagged": summary(rows[1:])})
    assert len(lines) == 1 + 4 + 1
    assert all(len(line) == len(lines[0]) for line in lines[1:5])
    assert set(FITS) <= {word.strip(":") for word in lines[0].split()}


def test_pictures_have_no_bound_and_all_other_figures() -> None:
    told = summary([{"tangents": row(4.0, bounded=False), "surface": row(1.5, bounded=False)}])
    in_plane = told["surface"]["in-plane v, mm/s"]
    assert (in_plane["rmse"], in_plane["median_percent"], in_plane["pull_rms"]) == pytest.approx((0.15, 0.15, 2.0))
    assert "rmse_over_bound" not in in_plane
    assert len(table({"cut": told})) == 1 + 4


def test_results_of_two_seeds_are_those_of_all_sequences() -> None:
    rows = [{"tangents": row(4.0), "surface": row(ratio)} for ratio in (1.5, 0.5, 1.0)]
    both, whole = together([{"cut": summary(rows[:2])}, {"cut": summary(rows[2:])}]), summary(rows)
    for key in ("rmse", "rms_bound", "rmse_over_bound", "rms_of_ratios", "pull_rms", "inside_95"):
        assert both["cut"]["surface"]["omega, rad/s"][key] == pytest.approx(whole["surface"]["omega, rad/s"][key])
    assert both["cut"]["both_converged"] == 3
