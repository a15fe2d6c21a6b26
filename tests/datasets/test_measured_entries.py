"""Segments and impacts through an estimate's file, and files from before there were any."""

import json
from dataclasses import replace

import numpy as np
import pytest

from datasets.errors import InputError
from datasets.estimate import Estimate, ImpactEstimate, PlateGap, SegmentEstimate
from datasets.estimate_files import read_estimate, write_estimate
from datasets.scoring.impacts import impact_summary, impact_table, score_impacts
from datasets.truth import Impact, Truth
from tests.datasets.test_estimate_files import assert_equal


def impact_at(truth: Truth, time_s: float) -> Impact:
    zero = np.zeros(3)
    return Impact(
        time_s=time_s,
        duration_s=1e-5,
        x_world=zero,
        q_world_body=np.array([0.0, 0.0, 0.0, 1.0]),
        point_world=zero,
        points_world=zero[None],
        impulses_world=zero[None],
        normal_world=np.array([0.0, -1.0, 0.0]),
        plate_velocity_world=zero,
        v_before=truth.motion.v_world[0],
        omega_before=truth.motion.omega_world[0],
        v_after=-truth.motion.v_world[0],
        omega_after=-truth.motion.omega_world[0],
        impulse_world=zero,
        compression_work_J=-1.0,
        normal_work_J=-0.5,
        tangential_work_J=0.0,
        energy_lost_J=0.5,
        deepest_m=0.0,
    )


def with_impact(estimate: Estimate, impact: Impact, *, late_s: float = 0.0) -> Estimate:
    """An estimate whose impact is the true one, ``late_s`` too late and with its velocities a thousandth too large."""
    assert estimate.middle is not None
    before = replace(estimate.middle, v_world=1.001 * impact.v_before, omega_world=1.001 * impact.omega_before)
    after = replace(estimate.middle, v_world=1.001 * impact.v_after, omega_world=1.001 * impact.omega_after)
    found = ImpactEstimate(
        impact.time_s + late_s, 1e-6, impact.x_world, impact.q_world_body, before, after, np.eye(18), PlateGap(1e-5, 2e-5, -1e-5, True)
    )
    segments = (SegmentEstimate(0.0, found.time_s, before), SegmentEstimate(found.time_s, 1.0, after))
    return replace(estimate, segments=segments, impacts=(found,))


def test_round_trip_with_and_without_a_plate(truth, estimate_of, tmp_path):
    estimate = with_impact(estimate_of(truth, np.zeros(6)), impact_at(truth, 0.0005))
    for each in (estimate, replace(estimate, impacts=(replace(estimate.impacts[0], plate=None),))):
        write_estimate(each, tmp_path / "e.json")
        assert_equal(each, read_estimate(tmp_path / "e.json"))


def test_a_file_without_impacts_does_not_name_them(truth, estimate_of, tmp_path):
    write_estimate(estimate_of(truth, np.zeros(6)), tmp_path / "e.json")
    assert {"segments", "impacts"}.isdisjoint(json.loads((tmp_path / "e.json").read_text()))
    assert read_estimate(tmp_path / "e.json").impacts == ()


def test_an_impact_without_its_time_is_named(truth, estimate_of, tmp_path):
    write_estimate(with_impact(estimate_of(truth, np.zeros(6)), impact_at(truth, 0.0005)), tmp_path / "e.json")
    document = json.loads((tmp_path / "e.json").read_text())
    del document["impacts"][0]["time_s"], document["sha256"]
    (tmp_path / "e.json").write_text(json.dumps(document))
    with pytest.raises(InputError, match=r"e\.json.*impacts.*time_s"):
        read_estimate(tmp_path / "e.json")


def test_impacts_are_scored_one_by_one(truth, estimate_of):
    true = replace(truth, impacts=(impact_at(truth, 0.0005), impact_at(truth, 0.0009), impact_at(truth, 99.0)))
    rows = score_impacts(with_impact(estimate_of(truth, np.zeros(6)), true.impacts[0], late_s=5e-6), true)
    assert [row["found"] for row in rows] == [True, False]
    speed = np.linalg.norm(true.impacts[0].v_after)
    assert rows[0]["time_error_frames"] == pytest.approx(0.02)
    assert rows[0]["time_inside95"] == 1.0
    assert rows[0]["after_in_plane_percent"] == pytest.approx(0.1 * np.hypot(*true.impacts[0].v_after[:2]) / speed)
    assert rows[0]["before_angular_percent"] == pytest.approx(0.1)
    summary = impact_summary(impact_table(rows))
    assert (summary["impacts"], summary["found"]) == (2, 1)
    assert summary["median_after_angular_percent"] == pytest.approx(0.1)


def test_an_impact_estimated_elsewhere_is_not_found(truth, estimate_of):
    true = replace(truth, impacts=(impact_at(truth, 0.0005),))
    rows = score_impacts(with_impact(estimate_of(truth, np.zeros(6)), true.impacts[0], late_s=3e-4), true)
    assert [row["found"] for row in rows] == [False]
    assert [row["unmatched"] for row in rows] == [1]
    assert impact_summary(impact_table(rows)) == {"impacts": 1, "found": 0}
    assert impact_summary(impact_table([])) == {"impacts": 0, "found": 0}


def test_contacts_within_a_frame_are_one_impact(truth, estimate_of):
    """Velocities are those before the first and after the last; a time between them is right."""
    first, last = impact_at(truth, 0.0005), replace(impact_at(truth, 0.00058), v_after=np.array([0.3, -0.2, 0.1]))
    true = replace(truth, impacts=(first, last))
    between = with_impact(estimate_of(truth, np.zeros(6)), replace(last, v_before=first.v_before), late_s=-3e-5)
    (row,) = score_impacts(between, true)
    assert (row["found"], row["contacts"]) == (True, 2)
    assert row["time_error_frames"] == 0.0
    assert row["after_in_plane_percent"] == pytest.approx(0.1 * np.hypot(0.3, 0.2) / np.linalg.norm(last.v_after))
    (late,) = score_impacts(with_impact(estimate_of(truth, np.zeros(6)), last, late_s=5e-6), true)
    assert late["time_error_frames"] == pytest.approx(0.02)
    apart = replace(estimate_of(truth, np.zeros(6)), impacts=(*between.impacts, *with_impact(between, last).impacts))
    assert (score_impacts(apart, true)[0]["found"], score_impacts(apart, true)[0]["unmatched"]) == (True, 0)
    assert score_impacts(apart, replace(true, impacts=(last,)))[0]["unmatched"] == 1
    assert [row["contacts"] for row in score_impacts(between, replace(true, impacts=(first, replace(last, time_s=0.00076))))] == [1, 1]
