"""The bound is what the maximum-likelihood estimate of whoever knows the body reaches; it scales as information does."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from datasets.recipes.recipe import HsvRecipe, MotionRecipe, NoiseRecipe, ParticleRecipe, Recipe
from datasets.truth import MotionBound, Truth
from datasets.vocabulary.plate import Plate
from synth.flight_bound import MassPrior, flight_bound, with_bound
from synth.motion import Start, fly
from synth.motion.pose_sensitivity import INERTIA, STEP_RAD, mass_sensitivity, pose_sensitivity
from synth.plan import SequencePlan
from synth.sequence import build_silhouette_sequence, plan_sequence, truth_of
from synth.silhouette import noisy, outline_mesh
from tests.reference.true_body_oracle import Oracle

Array = NDArray[np.float64]

WHITE, CORRELATED = NoiseRecipe(), NoiseRecipe(correlation_px=3.0)
RECIPE = Recipe(
    seed=4,
    particle=ParticleRecipe(family="cut_stone"),
    motion=MotionRecipe(frames=5, frame_rate_hz=400.0, spin_rads=(150.0, 200.0)),
    hsv=HsvRecipe(distortion=(-0.2, 0.1, 1e-3, -1e-3, 0.0)),
)
TRIALS, ROUNDS = 40, 2


@cache
def planned() -> tuple[SequencePlan, Truth]:
    plan = plan_sequence(RECIPE, 0)
    return plan, truth_of(plan)


def bound_of(noise: NoiseRecipe) -> MotionBound:
    plan, truth = planned()
    bound = flight_bound(truth, plan.hsv, noise)
    assert bound is not None
    return bound


def deviations(noise: NoiseRecipe) -> Array:
    return np.sqrt(np.diag(bound_of(noise).covariance))


def middle_state(truth: Truth) -> Start:
    motion, middle = truth.motion, (len(truth.motion.times_s) - 1) // 2
    return Start(motion.x_world[middle], motion.q_world_body[middle], motion.v_world[middle], motion.omega_world[middle])


def oracle_errors(noise: NoiseRecipe, count: int, rng: np.random.Generator) -> Array:
    """Errors (count, 6) of v and omega of maximum-likelihood estimates from outlines with fresh noise."""
    plan, truth = planned()
    oracle = Oracle(truth, plan.hsv, noise, plan.gravity_world)
    exact = oracle.exact_outlines()
    trials = ([noisy(outline, noise, noise.hsv_boundary_px, rng).points_px for outline in exact] for _ in range(count))
    return np.array([oracle.error(seen, rounds=ROUNDS) for seen in trials])


@pytest.mark.parametrize("noise", [WHITE, CORRELATED], ids=["white", "correlated"])
def test_an_oracle_reaches_the_bound(noise: NoiseRecipe) -> None:
    """Four standard errors: of single deviations, and of the squared Mahalanobis distance of all six, which is chi-square."""
    errors, covariance = oracle_errors(noise, TRIALS, np.random.default_rng(3)), bound_of(noise).covariance
    ratio = np.sqrt(np.mean(errors**2, axis=0) / np.diag(covariance))
    assert ratio == pytest.approx(np.ones(6), abs=4 / np.sqrt(2 * TRIALS))
    distance = np.einsum("ti,ij,tj->t", errors, np.linalg.inv(covariance), errors)
    assert distance.mean() == pytest.approx(6.0, abs=4 * np.sqrt(12 / TRIALS))


def test_twice_the_noise_is_twice_the_bound() -> None:
    assert deviations(replace(WHITE, hsv_boundary_px=0.4)) == pytest.approx(2 * deviations(WHITE))


def test_samples_count_as_their_root() -> None:
    """Two times as many samples at other places on the outline; within what the places make."""
    assert deviations(replace(WHITE, spacing_px=0.5)) == pytest.approx(deviations(WHITE) / np.sqrt(2), rel=0.02)


def test_correlation_is_worth_the_samples_it_takes_away() -> None:
    """Slow waves along an outline, which motion makes, have the power of fewer samples: (1 + r) / (1 - r) of r = exp(-1/3)."""
    r = np.exp(-1 / 3)
    ratio = deviations(CORRELATED) / deviations(WHITE)
    assert np.all(ratio > 1.3)
    assert np.all(ratio < np.sqrt((1 + r) / (1 - r)))


def test_a_step_half_as_long_gives_the_same() -> None:
    _, truth = planned()
    times_s = truth.motion.times_s - truth.motion.times_s[2]
    full, half = (
        pose_sensitivity(middle_state(truth), truth.inertia_kgm2, times_s, step_rad=step_rad) for step_rad in (STEP_RAD, STEP_RAD / 2)
    )
    size = np.abs(full).max(axis=(0, 1))
    assert np.abs(half - full).max(axis=(0, 1)) / size == pytest.approx(np.zeros(12), abs=1e-7)


def test_mass_properties_that_are_known_well_cost_nothing_and_others_something() -> None:
    plan, truth = planned()

    def with_prior(*prior: float) -> Array:
        bound = flight_bound(truth, plan.hsv, WHITE, mass=MassPrior(*prior))
        assert bound is not None
        return np.sqrt(np.diag(bound.covariance))

    known = deviations(WHITE)
    assert with_prior(1e-12, 1e-9, 1e-9) == pytest.approx(known, rel=1e-6)
    usual, wide = with_prior(4e-6, 0.005, 0.002), with_prior(4e-5, 0.05, 0.02)
    assert np.all(known < usual)
    assert np.all(usual < wide)


def test_a_common_factor_of_the_moments_turns_nothing() -> None:
    _, truth = planned()
    by_mass = mass_sensitivity(middle_state(truth), truth.inertia_kgm2, truth.motion.times_s - truth.motion.times_s[2])
    moments = by_mass[:, 3:, INERTIA][:, :, :3]
    assert np.abs(moments).max() > 0.1
    assert np.abs(moments.sum(axis=2)).max() < 1e-6 * np.abs(moments).max()


def test_inertia_acts_as_that_of_a_flight_of_another_body() -> None:
    """A product of inertia turns the principal axes; the body is then seen as if it were turned in them."""
    _, truth = planned()
    start, moments = middle_state(truth), truth.inertia_kgm2
    times_s = truth.motion.times_s - truth.motion.times_s[2]
    turn = Rotation.from_rotvec([0.0, 0.0, 1e-6])  # of the axes: I_12 is (I_1 - I_2) times the angle
    q = (Rotation.from_quat(start.q_world_body) * turn).as_quat()
    span = {"earliest_s": times_s[0], "latest_s": times_s[-1]}
    other = Rotation.from_quat(fly(replace(start, q_world_body=q), moments, np.zeros(3), **span).at(times_s).q_world_body) * turn.inv()
    plain = Rotation.from_quat(fly(start, moments, np.zeros(3), **span).at(times_s).q_world_body)
    entry = 1e-6 * (moments[0] - moments[1]) / np.sqrt(moments[0] * moments[1])
    expected = mass_sensitivity(start, moments, times_s)[:, 3:, INERTIA.start + 5] * entry
    assert (other * plain.inv()).as_rotvec() == pytest.approx(expected, abs=1e-4 * np.abs(expected).max())


def test_a_camera_elsewhere_gives_the_same_bound_turned() -> None:
    """The world turned with the camera in it: nothing that is seen changes."""
    plan, truth = planned()
    turn, shift = Rotation.from_rotvec([0.4, -0.3, 0.8]), np.array([0.2, -0.1, 0.3])
    motion = replace(
        truth.motion,
        x_world=turn.apply(truth.motion.x_world) + shift,
        q_world_body=(turn * Rotation.from_quat(truth.motion.q_world_body)).as_quat(),
        v_world=turn.apply(truth.motion.v_world),
        omega_world=turn.apply(truth.motion.omega_world),
    )
    R = turn.inv().as_matrix()
    elsewhere = replace(plan.hsv, R_cam_world=R, t_cam_world=-R @ shift)
    bound = flight_bound(replace(truth, motion=motion), elsewhere, WHITE)
    assert bound is not None
    both = np.kron(np.eye(2), turn.as_matrix())
    expected = both @ bound_of(WHITE).covariance @ both.T
    scale = np.sqrt(np.diag(expected))
    assert bound.covariance / np.outer(scale, scale) == pytest.approx(expected / np.outer(scale, scale), abs=1e-5)


def test_the_outlines_are_those_that_the_frames_were_made_with() -> None:
    observation, truth = build_silhouette_sequence(RECIPE, 0)
    kept = outline_mesh(truth.mesh_vertices, truth.mesh_faces).outlines
    made = list(kept)
    assert with_bound(truth, observation.cameras[0], RECIPE.noise).bound is not None
    assert list(kept) == made


def test_what_is_no_free_flight_in_noise_has_no_bound() -> None:
    plan, truth = planned()
    assert with_bound(truth, plan.hsv, WHITE).bound is not None
    plate = Plate(np.zeros(3), np.array([0.0, -1.0, 0.0]))
    for other in (replace(truth, effects={"linear_drag": {"rate": 1.0}}), replace(truth, plate=plate)):
        assert with_bound(other, plan.hsv, WHITE).bound is None
    assert flight_bound(truth, plan.hsv, replace(WHITE, hsv_boundary_px=0.0)) is None


def test_a_motion_that_outlines_leave_open_has_no_bound() -> None:
    """One picture shows a pose and no velocity."""
    plan, truth = planned()
    once = replace(truth.motion, **{name: values[:1] for name, values in vars(truth.motion).items()})
    assert flight_bound(replace(truth, motion=once), plan.hsv, WHITE) is None
