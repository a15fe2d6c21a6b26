"""Figures of fits beside one another are of sequences of which all found every impact; the truth has no error of contact."""

from typing import Any

import numpy as np
import pandas as pd
import pytest

from datasets.estimate import ImpactEstimate, VelocityEstimate
from datasets.scoring.metrics import COMPONENTS
from datasets.truth import Impact
from scripts.acceptance.impact_figures import compared_figures, compared_table, contact_errors
from synth.sequence import build_silhouette_sequence
from tests.estimator.test_measure import RECIPE


@pytest.fixture(scope="module")
def impact() -> Impact:
    return build_silhouette_sequence(RECIPE, 0)[1].impacts[0]


def measured(true: Impact, after_ms: float) -> ImpactEstimate:
    """The true impact, its velocity after it along the normal off by so much."""
    none = np.eye(6)
    before = VelocityEstimate(true.time_s, true.v_before, true.omega_before, none, none)
    after = VelocityEstimate(true.time_s, true.v_after + after_ms * true.normal_world, true.omega_after, none, none)
    return ImpactEstimate(true.time_s, 1e-6, true.x_world, true.q_world_body, before, after, np.eye(18))


def test_an_impact_as_it_was_has_no_error_of_contact(impact: Impact) -> None:
    assert contact_errors(measured(impact, 0.0), impact) == {"restitution_error": 0.0, "impulse_ratio_error": 0.0}
    off = contact_errors(measured(impact, 0.01), impact)
    came = (impact.v_before + np.cross(impact.omega_before, impact.point_world - impact.x_world)) @ impact.normal_world
    assert off["restitution_error"] == pytest.approx(-0.01 / came)
    assert off["impulse_ratio_error"] < 0.0


def row(sequence: str, number: int, size: float, *, found: bool = True) -> dict[str, Any]:
    told: dict[str, Any] = {"sequence": sequence, "impact": number, "found": found, "status": "converged", "cpu_s": 2.0}
    for side in ("before", "after"):
        told |= {f"{side}_{name}": size for name in ("in_plane_ms", "out_of_plane_ms", "angular_rads")}
        told |= {f"{side}_ellipsoid95_{name}": 1.0 for name in ("v", "omega")} | {f"{side}_pull_{name}": 1.0 for name in COMPONENTS}
    return told | {"restitution_error": size, "impulse_ratio_error": np.nan}


def test_what_not_every_fit_found_counts_for_none() -> None:
    """Errors are those before the first impact and after the last one."""
    tangents = pd.DataFrame([row("a", 1, 2.0), row("a", 2, 4.0), row("b", 1, 9.0)])
    samples = pd.DataFrame([row("a", 1, 1.0), row("a", 2, 3.0), row("b", 1, 9.0, found=False)])
    told = compared_figures({"tangents": tangents, "samples": samples})
    assert (told["sequences"], told["found_by_all"]) == (2, 1)
    assert told["samples"]["errors"]["depth v, mm/s before"]["rmse"] == pytest.approx(1e3)
    assert told["tangents"]["errors"]["omega, rad/s after"]["rmse"] == pytest.approx(4.0 / np.sqrt(3.0))
    assert told["samples"]["errors"]["restitution"]["rmse"] == pytest.approx(1.0)
    assert "impulse_ratio" not in told["samples"]["errors"]
    lines = compared_table({"cut": told}, ("tangents", "samples")).splitlines()
    assert len(lines) == 2 + 6 + 1
    assert {line.count("|") for line in lines} == {lines[0].count("|")}
