"""The study's figures are of the sequences that both fits measured, and its table has a line per class and quantity."""

from typing import Any

import numpy as np
import pytest

from datasets.scoring.metrics import COMPONENTS
from scripts.study_surface_fit import ELLIPSOIDS, FITS, summary, table

BOUND = {"vx": 1e-4, "vy": 1e-4, "vz": 2e-3, "wx": 0.05, "wy": 0.05, "wz": 0.05}


def row(ratio: float, status: str = "converged") -> dict[str, Any]:
    """Scores of one fit whose errors are ``ratio`` times the bound and two standard deviations."""
    told: dict[str, Any] = {"status": status, "converged": status == "converged", "cpu_s": 2.0, **dict.fromkeys(ELLIPSOIDS, 1.0)}
    for name in COMPONENTS:
        told |= {f"middle_pull_{name}": 2.0, f"middle_true_bound_{name}": BOUND[name], f"middle_over_true_bound_{name}": ratio}
    return told


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
