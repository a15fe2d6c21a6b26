"""A second particle through the files of observations, truths and estimates, and a collision beside the truth."""

import json
from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

from datasets.errors import InputError
from datasets.estimate import CollisionEstimate, Estimate, Measured
from datasets.estimate_files import read_estimate, write_estimate
from datasets.observation import Companion, Observation
from datasets.observation_files import read_observation, write_observation
from datasets.scoring.collisions import collision_summary, score_collision
from datasets.scoring.impacts import impact_table
from datasets.truth import Impact, Truth
from datasets.truth_files import read_truth, write_truth
from datasets.vocabulary.outline import Outline
from tests.datasets.test_measured_entries import impact_at, with_impact

NORMAL = np.array([0.6, 0.8, 0.0])
APPROACH, SEPARATION, RATIO = -2.0, 1.2, 0.5


def collision(**changes: object) -> CollisionEstimate:
    """The true one of :func:`struck`."""
    found = CollisionEstimate(
        time_s=5e-4,
        time_sigma_s=1e-6,
        point_world=np.array([0.001, 0.0, 0.6]),
        normal_world=NORMAL,
        normal_sigma_rad=0.05,
        gap_m=Measured(-1e-5, 2e-5),
        approach_ms=Measured(APPROACH, 0.02),
        separation_ms=Measured(SEPARATION, 0.03),
        restitution=Measured(0.6, 0.02),
        impulse_per_mass=np.array([1.0, 2.0, 3.0]),
        impulse_ratio=Measured(0.75, 0.1),
        mass_ratio=Measured(RATIO, 0.01),
        mass_source="volumes",
        momentum_mass_ratio=Measured(RATIO, 0.003),
        momentum_change_ms=np.array([1e-3, 0.0, 0.0]),
        momentum_sigma_ms=np.array([1e-3, 1e-3, 1e-1]),
        momentum_kept=True,
    )
    return replace(found, **changes)  # type: ignore[arg-type]


def struck(truth: Truth) -> Truth:
    """Two particles without spin; the first is hit with an impulse of 0.75 of its normal part along the other direction."""
    along = np.array([0.0, 0.0, 1.0])
    still = {"omega_before": np.zeros(3), "omega_after": np.zeros(3), "point_world": np.array([0.001, 0.0, 0.6]), "normal_world": NORMAL}
    first: Impact = replace(
        impact_at(truth, 5e-4), **still, v_before=APPROACH * NORMAL, v_after=np.zeros(3), impulse_world=2.0 * NORMAL + 1.5 * along
    )
    second = replace(first, normal_world=-NORMAL, v_before=np.zeros(3), v_after=-SEPARATION * NORMAL, impulse_world=-first.impulse_world)
    other = replace(truth, mass_kg=truth.mass_kg / RATIO, impacts=(second,))
    return replace(truth, impacts=(first,), companion=other)


@pytest.fixture
def pair(outline_observation: Observation) -> Observation:
    outlines = list(outline_observation.recordings[0])
    smaller = tuple(
        Outline(0.5 * o.points_px + 20.0) if k % 2 and not o.empty else Outline(np.zeros((0, 2))) for k, o in enumerate(outlines)
    )
    companion = Companion(outline_observation.views[:1], outline_observation.view_recording[:1], 2e-4)  # type: ignore[index]
    return replace(outline_observation, companion=companion, further_recordings=(smaller,))


def test_observation_round_trip(pair: Observation, tmp_path: Path) -> None:
    write_observation(pair, tmp_path / "seq")
    found = read_observation(tmp_path / "seq")
    assert found.companion is not None
    assert found.companion.mass_kg == 2e-4
    assert len(found.companion.views) == 1
    for mine, theirs in zip(found.further_recordings[0], pair.further_recordings[0], strict=True):
        assert np.array_equal(mine.points_px, theirs.points_px)  # type: ignore[union-attr]
    document = json.loads((tmp_path / "seq" / "observation.json").read_text())
    assert document["cameras"][0]["further_recording"]["file"] == "further_outlines_hsv.npz"


def test_one_particle_is_written_as_ever(outline_observation: Observation, tmp_path: Path) -> None:
    write_observation(outline_observation, tmp_path / "seq")
    assert "companion" not in (tmp_path / "seq" / "observation.json").read_text()
    assert "further" not in (tmp_path / "seq" / "observation.json").read_text()
    assert read_observation(tmp_path / "seq").further_recordings == ()


def test_too_few_further_outlines(pair: Observation, tmp_path: Path) -> None:
    short = replace(pair, further_recordings=(pair.further_recordings[0][:-1],))  # type: ignore[index]
    with pytest.raises(InputError, match='camera "hsv", further outlines: expected 5 recorded entries, got 4'):
        write_observation(short, tmp_path / "seq")


def test_views_of_the_companion_are_checked(pair: Observation, tmp_path: Path) -> None:
    assert pair.companion is not None
    mirrored = replace(pair.companion.views[0], R_cam_particle=np.diag([1.0, 1.0, -1.0]))
    with pytest.raises(InputError, match=r"at \$\.companion\.views\.cameras\[0\]\.R_cam_particle: expected a rotation"):
        write_observation(replace(pair, companion=replace(pair.companion, views=(mirrored,))), tmp_path / "seq")


def test_truth_round_trip(truth: Truth, tmp_path: Path) -> None:
    write_truth(struck(truth), tmp_path / "seq")
    found = read_truth(tmp_path / "seq")
    assert found.companion is not None
    assert found.companion.mass_kg == truth.mass_kg / RATIO
    assert np.array_equal(found.impacts[0].impulse_world, -found.companion.impacts[0].impulse_world)
    (tmp_path / "seq" / "companion" / "truth.json").unlink()
    with pytest.raises(InputError, match=r"companion/truth\.json: there is no such file"):
        read_truth(tmp_path / "seq")


def measured(truth: Truth, estimate_of: Callable[..., Estimate]) -> Estimate:
    pair = struck(truth)
    assert pair.companion is not None
    first, second = (with_impact(estimate_of(t, np.zeros(6)), t.impacts[0]) for t in (pair, pair.companion))
    return replace(first, companion=second, collision=collision())


def test_estimate_round_trip(truth: Truth, estimate_of: Callable[..., Estimate], tmp_path: Path) -> None:
    write_estimate(measured(truth, estimate_of), tmp_path / "e.json")
    found = read_estimate(tmp_path / "e.json")
    assert found.companion is not None
    assert found.companion.impacts[0].time_s == found.impacts[0].time_s
    assert found.collision is not None
    for field in fields(CollisionEstimate):
        assert np.array_equal(getattr(found.collision, field.name), getattr(collision(), field.name)), field.name
    first = (tmp_path / "e.json").read_bytes()
    write_estimate(found, tmp_path / "e.json")
    assert (tmp_path / "e.json").read_bytes() == first


def test_a_companion_that_does_not_fit_the_schema(truth: Truth, estimate_of: Callable[..., Estimate], tmp_path: Path) -> None:
    write_estimate(measured(truth, estimate_of), tmp_path / "e.json")
    document = json.loads((tmp_path / "e.json").read_text())
    del document["sha256"], document["companion"]["status"]
    (tmp_path / "e.json").write_text(json.dumps(document))
    with pytest.raises(InputError, match=r"at \$\.companion: expected"):
        read_estimate(tmp_path / "e.json")


def test_the_true_collision_scores_perfectly(truth: Truth, estimate_of: Callable[..., Estimate]) -> None:
    (row,) = score_collision(measured(truth, estimate_of), struck(truth))
    assert row["found"]
    assert row["normal_error_deg"] == pytest.approx(0.0, abs=1e-5)
    assert row["point_error_mm"] == 0.0
    for name in ("approach_ms", "separation_ms", "restitution", "impulse_ratio", "mass_ratio"):
        assert row[name] == pytest.approx(row[f"{name}_true"], rel=1e-12)
        assert row[f"{name}_inside95"] == 1.0
    summary = collision_summary(impact_table([row, {"sequence": "other", "found": False}]))
    assert (summary["collisions"], summary["found"], summary["momentum_kept"]) == (2, 1, 1)
    assert summary["median_restitution_error"] == pytest.approx(0.0, abs=1e-12)


def test_errors_beyond_their_intervals_are_told(truth: Truth, estimate_of: Callable[..., Estimate]) -> None:
    off = replace(
        measured(truth, estimate_of), collision=collision(restitution=Measured(0.66, 0.02), normal_world=np.array([0.8, 0.6, 0.0]))
    )
    (row,) = score_collision(off, struck(truth))
    assert row["restitution_inside95"] == 0.0
    assert row["normal_error_deg"] == pytest.approx(np.degrees(np.arccos(0.96)), rel=1e-6)
