import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from datasets.errors import InputError
from datasets.estimate import Estimate, Status
from datasets.estimate_files import read_estimate, write_estimate
from datasets.scoring.angles import rotation_angle
from datasets.scoring.efficiency import QUANTITIES, efficiency
from datasets.scoring.metrics import COMPONENTS, INSTANTS, METRICS, metric
from datasets.scoring.score import score, truth_as_estimate
from datasets.scoring.table import aggregate, coverage, ellipsoid_coverage, score_table, status_counts, worse_sequences
from datasets.truth import MotionBound
from datasets.truth_files import read_truth, write_truth

ERRORS = [entry.key for entry in METRICS if entry.key != "middle_sigma_over_bound"]


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10**6), frames=st.integers(3, 30))
def test_the_truth_itself_scores_exactly_zero(truth_of, seed, frames):
    truth = truth_of(seed=seed, frames=frames)
    row = score(truth_as_estimate(truth), truth)
    assert {key: row[key] for key in ERRORS} == dict.fromkeys(ERRORS, 0.0)
    for instant in INSTANTS:
        for name in COMPONENTS:
            assert row[f"{instant}_pull_{name}"] == 0.0
            assert row[f"{instant}_inside95_{name}"] == 1.0


def test_the_truth_scores_zero_through_files_and_with_symmetries(truth, tmp_path):
    turns = Rotation.from_rotvec(np.outer(np.arange(4) * np.pi / 2, [0, 0, 1])).as_matrix()
    write_truth(replace(truth, symmetries=turns), tmp_path / "t")
    write_estimate(truth_as_estimate(truth), tmp_path / "e.json")
    row = score(read_estimate(tmp_path / "e.json"), read_truth(tmp_path / "t"))
    assert all(row[key] == 0.0 for key in ERRORS)


def test_rounding_in_the_symmetries_does_not_show(truth):
    rounded = replace(truth, symmetries=(np.eye(3) + 1e-16 * np.array([[0, -1.3, -1.4], [-1.7, 0, -0.8], [-2.0, -1.5, 0]]))[None])
    assert score(truth_as_estimate(rounded), rounded)["orientation_max_deg"] == 0.0


def test_velocity_errors_are_what_was_added(truth, estimate_of):
    error = np.array([0.03, 0.04, -0.02, 1.0, 2.0, -2.0])
    row = score(estimate_of(truth, error, sigma=0.5), truth)
    speed, spin = np.linalg.norm(truth.motion.v_world[2]), np.linalg.norm(truth.motion.omega_world[2])
    assert row["middle_in_plane_ms"] == pytest.approx(0.05)
    assert row["middle_out_of_plane_ms"] == pytest.approx(0.02)
    assert row["middle_angular_rads"] == pytest.approx(3.0)
    assert row["middle_in_plane_percent"] == pytest.approx(5 / speed)
    assert row["middle_angular_percent"] == pytest.approx(300 / spin)
    assert row["middle_pull_vz"] == pytest.approx(-0.04)
    assert row["middle_pull_wy"] == pytest.approx(4.0)
    assert (row["middle_inside95_vz"], row["middle_inside95_wy"]) == (1.0, 0.0)
    assert row["middle_over_bound_wz"] == pytest.approx(4.4)
    assert row["middle_mahalanobis2"] == pytest.approx((error @ error) / 0.25)
    assert row["middle_sigma_over_bound"] == pytest.approx(1.1)
    assert (row["n_frames"], row["n_used"], row["n_views"], row["irregularity"]) == (5, 1, 60, 0.4)
    assert row["particle"] == "cut stone"


def test_an_instant_between_frames_uses_the_interpolated_truth(truth_of, estimate_of):
    truth = truth_of(frames=40)
    times = truth.motion.times_s
    wobble = 200 * np.column_stack([np.sin(300 * times), np.cos(300 * times), np.ones_like(times)])
    truth = replace(truth, motion=replace(truth.motion, omega_world=wobble))
    estimate = estimate_of(truth, np.zeros(6))
    instant = 0.5 * (times[19] + times[20])
    omega = 200 * np.array([np.sin(300 * instant), np.cos(300 * instant), 1.0])
    row = score(replace(estimate, middle=replace(estimate.middle, time_s=instant, omega_world=omega)), truth)
    assert 0 < row["middle_angular_rads"] < 1e-4


def turned(estimate: Estimate, R: np.ndarray, com_shift=0.0) -> Estimate:
    """The estimate with every particle orientation turned by ``R`` in the particle frame."""
    body = replace(estimate.body, R_particle_body=R.T @ estimate.body.R_particle_body)
    return replace(estimate, body=body)


@pytest.mark.parametrize("degrees", [1e-7, 0.1, 4.0, 90.0, 179.0])
def test_orientation_is_the_geodesic_angle(truth, estimate_of, degrees):
    R = Rotation.from_rotvec(np.radians(degrees) * np.array([0.6, 0.0, 0.8])).as_matrix()
    row = score(turned(estimate_of(truth, np.zeros(6)), R), truth)
    assert row["orientation_median_deg"] == pytest.approx(degrees, rel=1e-6)
    assert row["orientation_max_deg"] == pytest.approx(degrees, rel=1e-6)


def test_orientation_does_not_depend_on_the_signs_of_principal_axes(truth, estimate_of):
    """Another choice of axes changes both the body and the quaternions; the particle's orientation stays."""
    flip = np.diag([-1.0, 1.0, -1.0])
    estimate = estimate_of(truth, np.zeros(6))
    body = replace(estimate.body, R_particle_body=estimate.body.R_particle_body @ flip)
    q = (Rotation.from_quat(estimate.motion.q_world_body) * Rotation.from_matrix(flip)).as_quat()
    row = score(replace(estimate, body=body, motion=replace(estimate.motion, q_world_body=q)), truth)
    assert row["orientation_max_deg"] < 1e-5


def test_orientation_of_a_symmetric_body(truth, estimate_of):
    turns = Rotation.from_rotvec(np.outer(np.arange(3) * 2 * np.pi / 3, [0, 1, 0])).as_matrix()
    estimate = turned(estimate_of(truth, np.zeros(6)), turns[1])
    assert score(estimate, truth)["orientation_median_deg"] == pytest.approx(120)
    assert score(estimate, replace(truth, symmetries=turns))["orientation_median_deg"] < 1e-5


def test_one_symmetry_serves_the_whole_sequence(truth, estimate_of):
    """A body that seems to jump between its symmetric orientations is wrong in part of the frames."""
    turns = Rotation.from_rotvec(np.outer([0, np.pi], [0, 0, 1])).as_matrix()
    estimate = estimate_of(truth, np.zeros(6))
    q = estimate.motion.q_world_body.copy()
    in_body = Rotation.from_matrix(truth.body.R_particle_body.T @ turns[1] @ truth.body.R_particle_body)
    q[3:] = (Rotation.from_quat(q[3:]) * in_body).as_quat()
    row = score(replace(estimate, motion=replace(estimate.motion, q_world_body=q)), replace(truth, symmetries=turns))
    assert row["orientation_median_deg"] < 1e-5
    assert row["orientation_max_deg"] == pytest.approx(180)


def test_position_in_millimetres(truth, estimate_of):
    estimate = estimate_of(truth, np.zeros(6))
    moved = replace(estimate.motion, x_world=estimate.motion.x_world + np.array([3e-4, 0.0, 4e-4]))
    row = score(replace(estimate, motion=moved), truth)
    assert row["position_median_mm"] == pytest.approx(0.5)


def test_poses_of_some_frames_only(truth, estimate_of):
    estimate = estimate_of(truth, np.zeros(6))
    some = replace(estimate.motion, **{name: value[1:4] for name, value in vars(estimate.motion).items()})
    assert score(replace(estimate, motion=some), truth)["position_max_mm"] == 0.0
    late = replace(some, times_s=some.times_s + 1e-4)
    with pytest.raises(InputError, match="expected poses at the frame times of the truth"):
        score(replace(estimate, motion=late), truth)


@pytest.mark.parametrize("status", [status for status in Status if status is not Status.CONVERGED])
def test_what_did_not_converge_is_never_a_number(truth, estimate_of, status):
    row = score(estimate_of(truth, np.zeros(6), status=status), truth)
    assert row["status"] == status.value
    assert all(math.isnan(row[entry.key]) for entry in METRICS)
    assert math.isnan(row["middle_inside95_vx"])


def test_the_row_has_the_same_columns_whatever_the_status(truth, estimate_of):
    full, empty = score(estimate_of(truth, np.ones(6)), truth), score(Estimate(truth.name, Status.OUT_OF_VIEW, "gone"), truth)
    assert full.keys() == empty.keys()


def test_a_resting_particle_has_no_relative_error_unless_there_is_an_error(truth, estimate_of):
    still = replace(truth, motion=replace(truth.motion, v_world=np.zeros((5, 3)), omega_world=np.zeros((5, 3))))
    assert score(truth_as_estimate(still), still)["middle_in_plane_percent"] == 0.0
    assert score(estimate_of(still, np.ones(6)), still)["middle_in_plane_percent"] == math.inf


def test_an_error_without_an_error_bar_is_infinitely_many_sigmas(truth, estimate_of):
    row = score(estimate_of(truth, np.ones(6), sigma=0.0), truth)
    assert row["middle_pull_vx"] == math.inf
    assert row["middle_mahalanobis2"] == math.inf
    assert row["middle_inside95_vx"] == 0.0


def test_a_negative_variance_is_no_error_bar(truth, estimate_of):
    estimate = estimate_of(truth, np.ones(6))
    row = score(replace(estimate, middle=replace(estimate.middle, covariance=-np.eye(6))), truth)
    assert math.isnan(row["middle_pull_vx"])
    assert row["middle_inside95_vx"] == 0.0
    assert row["middle_mahalanobis2"] == math.inf


def test_another_sequence_is_refused(truth, truth_of, estimate_of):
    with pytest.raises(InputError, match='the estimate is of sequence "other", the truth of "seq_0000"'):
        score(estimate_of(truth_of("other"), np.zeros(6)), truth)


def test_rotation_angle_near_half_a_turn():
    R = Rotation.from_rotvec([0, np.pi, 0]).as_matrix()
    assert rotation_angle(np.eye(3), R) == pytest.approx(np.pi)


def many_rows(truth_of, estimate_of, count=40, sigma=0.01):
    rng = np.random.default_rng(3)
    rows = []
    for k in range(count):
        truth = truth_of(f"seq_{k:04d}", seed=k, descriptors={"irregularity": k / count})
        rows.append(score(estimate_of(truth, rng.normal(scale=sigma, size=6), sigma=sigma), truth))
    return rows


def test_aggregates(truth_of, estimate_of):
    rows = many_rows(truth_of, estimate_of)
    table = score_table(reversed(rows))
    assert list(table["sequence"]) == sorted(row["sequence"] for row in rows)
    overall = aggregate(table).set_index("metric")
    values = [row["middle_out_of_plane_ms"] for row in rows]
    assert overall.loc["middle_out_of_plane_ms", "median"] == pytest.approx(np.median(values))
    assert overall.loc["middle_out_of_plane_ms", "inside_tolerance"] == pytest.approx(np.mean(np.array(values) <= 0.02))
    assert 0.85 < overall.loc["middle_in_plane_ms", "coverage"] <= 1.0
    assert set(overall["n"]) == {40}
    binned = aggregate(table, by="irregularity")
    assert set(binned["group"]) == {"0-0.1", "0.1-0.2", "0.2-0.3", "0.3-0.4", "0.4-0.6", "0.6-0.8", "0.8-inf"}
    assert binned[binned["metric"] == "middle_mahalanobis2"]["n"].sum() == 40
    assert set(aggregate(table, by="n_views")["group"]) == {"60"}


def test_what_did_not_converge_counts_against_the_share(truth_of, estimate_of):
    rows = many_rows(truth_of, estimate_of, count=3, sigma=1e-9)
    truth = truth_of("lost", seed=9)
    rows.append(score(estimate_of(truth, np.zeros(6), status=Status.AMBIGUOUS), truth))
    overall = aggregate(score_table(rows)).set_index("metric")
    assert overall.loc["middle_in_plane_percent", "inside_tolerance"] == 0.75
    assert tuple(overall.loc["middle_in_plane_percent", ["n", "n_converged"]]) == (4, 3)
    counts = status_counts(score_table(rows))
    assert dict(zip(counts["status"], counts["n"], strict=True)) == {"ambiguous": 1, "converged": 3}


def test_coverage_tells_honest_error_bars_from_optimistic_ones(truth_of, estimate_of):
    honest = coverage(score_table(many_rows(truth_of, estimate_of)))
    assert honest["coverage"].mean() == pytest.approx(0.95, abs=0.05)
    assert honest["pull_rms"].mean() == pytest.approx(1.0, abs=0.15)
    assert honest["rmse_over_bound"].mean() == pytest.approx(1.1, abs=0.15)


HALF_TURN = np.diag([-1.0, -1.0, 1.0])


@pytest.fixture
def poor_row(truth_of, estimate_of):
    """A row with an error along x (m/s), about z (rad/s), and a standard deviation of the same for both kinds of velocity."""

    def row(name, error=0.0, angular=0.0, *, sigma=1e-3, speed=2.0, turn=None, symmetries=None, **changes):
        truth = truth_of(name, seed=5)
        v, omega = np.tile([speed, 0.0, 0.0], (5, 1)), np.tile([0.0, 0.0, 100.0], (5, 1))
        truth = replace(truth, motion=replace(truth.motion, v_world=v, omega_world=omega))
        truth = replace(truth, symmetries=truth.symmetries if symmetries is None else symmetries)
        estimate = replace(estimate_of(truth, np.array([error, 0, 0, 0, 0, angular]), sigma=sigma), **changes)
        return score(estimate if turn is None else turned(estimate, turn), truth)

    return row


def causes(*rows):
    worse = worse_sequences(score_table(rows))
    return dict(zip(worse["sequence"], worse["cause"], strict=True))


def test_each_poor_sequence_has_its_cause(poor_row):
    found = causes(
        poor_row("fine", 0.001),
        poor_row("slow", 0.001, speed=0.01),
        poor_row("wrong", 0.1, turn=HALF_TURN),
        poor_row("lost", status=Status.AMBIGUOUS),
        poor_row("short", status=Status.NOT_ENOUGH_FRAMES),
        poor_row("noisy", 0.1),
    )
    assert found == {
        "lost": "ambiguous",
        "noisy": "noise or model",
        "short": "not enough frames",
        "slow": "slow",
        "wrong": "wrong minimum",
    }


@pytest.mark.parametrize(
    ("sigma", "error", "cause"),
    [
        (0.010, 0.020, "slow"),  # sigma 0.7% of the speed, error 1.4 sigma
        (0.010, 0.041, "slow"),  # 2.9 sigma
        (0.010, 0.043, "noise or model"),  # 3.04 sigma: more than the error bar admits
        (0.006, 0.011, "noise or model"),  # sigma 0.42% of the speed: inside the tolerance, so speed alone does not explain it
        (1.000, 4.000, "slow"),
    ],
)
def test_slow_means_that_the_sequences_own_error_bar_explains_the_error(poor_row, sigma, error, cause):
    (found,) = causes(poor_row("seq", error, sigma=sigma)).values()
    assert found == cause


def test_slow_has_to_hold_for_every_metric_that_is_outside(poor_row):
    assert causes(poor_row("seq", 0.02, 0.0, sigma=0.010)) == {"seq": "slow"}
    assert causes(poor_row("seq", 0.02, 3.0, sigma=0.010)) == {"seq": "noise or model"}


def test_a_bound_that_promises_more_than_the_error_bar_does_not_decide(poor_row):
    row = poor_row("seq", 0.02, sigma=0.010)
    assert causes({**row, "middle_bound_in_plane_percent": 1e-6}) == {"seq": "slow"}


def test_an_estimate_that_says_its_residuals_are_no_noise_is_not_called_slow(poor_row):
    row = poor_row("seq", 0.02, sigma=0.010)
    assert causes({**row, "misfit": True}) == {"seq": "model misses something"}
    assert causes({**row, "misfit": False}) == {"seq": "slow"}
    assert causes({**poor_row("seq", 0.1, turn=HALF_TURN), "misfit": True}) == {"seq": "wrong minimum"}


def test_a_symmetric_body_on_the_wrong_side_is_ambiguous(poor_row):
    third = Rotation.from_rotvec([0.0, 0.0, 2 * np.pi / 3]).as_matrix()
    symmetries = np.array([np.eye(3), third, third.T])
    assert causes(poor_row("seq", 0.1, turn=np.diag([1.0, -1.0, -1.0]), symmetries=symmetries)) == {"seq": "ambiguous"}


def test_the_table_of_poor_sequences_shows_the_error_bars(poor_row):
    (row,) = worse_sequences(score_table([poor_row("seq", 0.02, sigma=0.010)])).to_dict("records")
    assert row["in_plane_percent"] == pytest.approx(1.0)
    assert row["sigma_in_plane_percent"] == pytest.approx(np.sqrt(2) * 0.5)
    assert row["sigma_angular_percent"] == pytest.approx(np.sqrt(3) * 0.01)


def test_metrics_are_named_once():
    keys = [entry.key for entry in METRICS]
    assert len(set(keys)) == len(keys)
    with pytest.raises(KeyError, match="no metric 'speed'"):
        metric("speed")


BOUND = np.array([1e-4, 2e-4, 3e-3, 0.05, 0.06, 0.07])


def bounded(truth_of, name="seq_0000"):
    truth = truth_of(name)
    return replace(truth, bound=MotionBound(float(truth.motion.times_s[2]), np.diag(BOUND**2)))


def test_errors_are_held_against_the_bound_of_the_true_body(truth_of, estimate_of, tmp_path):
    write_truth(bounded(truth_of), tmp_path / "t")
    truth = read_truth(tmp_path / "t")
    row = score(estimate_of(truth, BOUND * [1, -2, 3, -4, 5, 6]), truth)
    assert [row[f"middle_true_bound_{name}"] for name in COMPONENTS] == pytest.approx(BOUND)
    assert [row[f"middle_over_true_bound_{name}"] for name in COMPONENTS] == pytest.approx([1, 2, 3, 4, 5, 6], rel=1e-4)


def test_a_truth_without_a_bound_scores_without_it(truth, estimate_of):
    row = score(estimate_of(truth, np.zeros(6)), truth)
    assert not any("true_bound" in key for key in row)
    assert efficiency(score_table([row])).empty


def test_efficiency_is_of_what_converged_and_has_a_bound(truth_of, estimate_of):
    errors = BOUND * np.random.default_rng(5).normal(0.0, 1.5, size=(200, 6))
    rows = [score(estimate_of(bounded(truth_of, f"s{k}"), error), bounded(truth_of, f"s{k}")) for k, error in enumerate(errors)]
    lost, unbounded = bounded(truth_of, "lost"), truth_of("unbounded")
    rows.append(score(estimate_of(lost, np.full(6, 9.0), status=Status.OUT_OF_VIEW), lost))
    rows.append(score(estimate_of(unbounded, np.full(6, 9.0)), unbounded))
    told = efficiency(score_table(rows)).set_index("quantity")
    assert list(told["n"]) == [200] * 3
    for quantity, columns in zip(QUANTITIES, ([0, 1], [2], [3, 4, 5]), strict=True):
        found = told.loc[quantity.name]
        assert found["rmse"] == pytest.approx(quantity.per_si * np.sqrt(np.mean(errors[:, columns] ** 2)), rel=1e-6)
        assert found["rms_bound"] == pytest.approx(quantity.per_si * np.sqrt(np.mean(BOUND[columns] ** 2)))
        assert found["rmse_over_bound"] == pytest.approx(found["rmse"] / found["rms_bound"])
        assert found["rms_of_ratios"] == pytest.approx(np.sqrt(np.mean((errors / BOUND)[:, columns] ** 2)), rel=1e-6)


def test_whole_ellipsoids_hold_the_truth_as_often_as_they_say(truth_of, estimate_of):
    rows = many_rows(truth_of, estimate_of, count=400)
    told = ellipsoid_coverage(score_table(rows))
    assert list(told["vector"]) == ["v", "omega"] * 2
    assert np.all(told["n"] == 400)
    assert told["coverage"].to_numpy() == pytest.approx(np.full(4, 0.95), abs=4 * np.sqrt(0.95 * 0.05 / 400))
