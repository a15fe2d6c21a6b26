"""The whole instrument on a particle that falls on a plate: the impact measured, and every reason why there is none to measure."""

from dataclasses import replace

import numpy as np
import pytest

from datasets.estimate import Estimate, Status
from datasets.observation import Observation
from datasets.recipes.recipe import DropperRecipe, EffectRecipe, ParticleRecipe, PlateRecipe, Recipe, RigRecipe
from datasets.truth import Truth
from datasets.vocabulary.clock import Clock
from estimator.data.configuration import Configuration
from estimator.fitting.trajectory import fit
from estimator.impacts.chains import edge_kink
from estimator.impacts.impact_search import centroid_path, find_kinks
from estimator.measure import HEALTHY_MEAN_SQUARE, measure
from estimator.measuring.free_flight import estimate
from estimator.motion.rotation import rotation_from_vector
from estimator.outlines.sightings import tracks_of
from estimator.search import candidate_flights
from synth.sequence import build_silhouette_sequence
from synth.silhouette.exact_outline import exact_outline, outline_mesh
from synth.silhouette.noisy_outline import noisy_outline
from tests.estimator.measuring.test_free_flight import RECIPE as FREE

pytestmark = pytest.mark.long

RECIPE = Recipe(
    seed=9,
    particle=ParticleRecipe(family="cut_stone", irregularity=0.6, size_mm=(6.0, 6.0)),
    rig=RigRecipe(drops=4),
    plate=PlateRecipe(tilt_deg=(15.0, 25.0)),
    dropper=DropperRecipe(runs=1, height_mm=(80.0, 100.0), frames_before=(20, 20), frames_after=(16, 16)),
)


TWO_IMPACTS = replace(RECIPE, seed=7, dropper=replace(RECIPE.dropper, frames_before=(22, 22), frames_after=(22, 22)))
LYING_FRAMES = 60
QUICK = Configuration(momentum_starts=0, trajectory_candidates=1, surface_fit=0)


@pytest.fixture(scope="module")
def sequence() -> tuple[Observation, Truth]:
    return build_silhouette_sequence(RECIPE, 0)


@pytest.fixture(scope="module")
def measured(sequence: tuple[Observation, Truth]) -> Estimate:
    return measure(sequence[0], Configuration())


def part(observation: Observation, first: int, last: int) -> Observation:
    """The frames from ``first`` to ``last`` alone."""
    outlines = list(observation.recordings[0])  # type: ignore[call-overload]
    clock = Clock(observation.clock.times_s[first:last], observation.clock.exposure_s)
    return replace(observation, recordings=(tuple(outlines[first:last]),), clock=clock)


def test_time_and_velocities_are_right_and_inside_their_error_bars(sequence: tuple[Observation, Truth], measured: Estimate) -> None:
    observation, truth = sequence
    (true,) = truth.impacts
    assert measured.status is Status.CONVERGED
    assert "piecewise: 1 impact" in measured.message
    (found,) = measured.impacts
    frame_s = float(np.diff(observation.clock.times_s)[0])
    assert abs(found.time_s - true.time_s) < 0.1 * frame_s
    assert -4.0 * found.time_sigma_s < found.time_s - true.time_s < 4.0 * found.time_sigma_s + true.duration_s
    for velocity, v, omega in ((found.before, true.v_before, true.omega_before), (found.after, true.v_after, true.omega_after)):
        error = np.concatenate([velocity.v_world - v, velocity.omega_world - omega])
        assert np.all(np.abs(error) < 4.0 * np.sqrt(np.diag(velocity.covariance)))
    assert np.linalg.norm((found.after.v_world - true.v_after)[:2]) < 0.01 * np.linalg.norm(true.v_after)
    assert np.linalg.norm(found.after.omega_world - true.omega_after) < 0.05 * np.linalg.norm(true.omega_after)
    np.testing.assert_allclose(found.covariance[12:, 12:], found.after.covariance)
    first, second = measured.segments
    assert first.end_s == found.time_s == second.start_s


def test_the_stated_plate_agrees_with_the_impact(measured: Estimate) -> None:
    plate = measured.impacts[0].plate
    assert plate is not None
    assert plate.agrees
    assert abs(plate.gap_m) < 1e-4


def test_a_plate_stated_ten_degrees_off_is_contradicted(sequence: tuple[Observation, Truth]) -> None:
    """Its plane is stated at a point of the plate 6 mm from where the particle hits."""
    observation = sequence[0]
    plate = observation.plate
    assert plate is not None
    along = np.cross(plate.normal_world, [0.0, 0.0, 1.0])
    along /= np.linalg.norm(along)
    turn = rotation_from_vector(np.array([[0.0, 0.0, np.radians(10.0)]]))[0]
    wrong = replace(plate, point_world=plate.point_world + 6e-3 * along, normal_world=turn @ plate.normal_world)
    result = measure(replace(observation, plate=wrong), QUICK)
    told = result.impacts[0].plate
    assert told is not None
    assert not told.agrees
    assert abs(told.gap_m) > 5e-4
    assert "the stated plate contradicts impact 1" in result.message


def test_a_second_impact_hidden_by_wobble_is_found_by_tracked_poses() -> None:
    """Twelve frames after the first, which left the body with 590 rad/s: the path of its centroid hardly shows it."""
    observation, truth = build_silhouette_sequence(TWO_IMPACTS, 0)
    found = measure(observation, QUICK)
    assert len(truth.impacts) == len(found.impacts) == 2
    assert found.status is Status.CONVERGED
    for true, impact in zip(truth.impacts, found.impacts, strict=True):
        assert abs(impact.time_s - true.time_s) < 2.5e-5
        assert np.linalg.norm((impact.after.v_world - true.v_after)[:2]) < 0.03 * np.linalg.norm(true.v_after)
        assert np.linalg.norm(impact.after.omega_world - true.omega_after) < 0.15 * np.linalg.norm(true.omega_after)


def test_kinks_of_the_path_too_near_to_fly_between_lead_to_the_impacts_all_the_same() -> None:
    """Two impacts 2.4 frames apart, whose centroids show kinks 1.6 frames apart and a frame late: with no flight between them at first."""
    particle, plate = ParticleRecipe(irregularity=0.5, size_mm=(4.0, 7.0)), PlateRecipe(tilt_deg=(10.0, 30.0))
    dropper = DropperRecipe(runs=1, height_mm=(60.0, 150.0))
    recipe = Recipe(seed=56215390, sequences=100, particle=particle, plate=plate, dropper=dropper)
    observation, truth = build_silhouette_sequence(recipe, 9)
    kinks = find_kinks(centroid_path(tracks_of(observation)[0]))
    first, second = kinks
    assert second.frame - first.frame < 2.0
    found = measure(observation, QUICK)
    assert (found.status, len(found.impacts)) == (Status.CONVERGED, 2)
    frame_s = float(np.diff(observation.clock.times_s)[0])
    for true, impact in zip(truth.impacts, found.impacts, strict=True):
        assert abs(impact.time_s - true.time_s) < 0.2 * frame_s


@pytest.mark.parametrize(("seed", "apart", "impacts"), [(132, 1.05, 2), (109, 0.55, 1)])
def test_contacts_less_than_two_frames_apart_are_told(seed: int, apart: float, impacts: int) -> None:
    """One by one where a picture lies between them, as one impact that was more than a contact otherwise; what comes after is right."""
    observation, truth = build_silhouette_sequence(replace(RECIPE, seed=seed), 0)
    first, last = truth.impacts[:2]
    frame_s = float(np.diff(observation.clock.times_s)[0])
    assert (last.time_s - first.time_s) / frame_s == pytest.approx(apart, abs=0.01)
    found = measure(observation, QUICK)
    assert (found.status, len(found.impacts)) == (Status.CONVERGED, impacts)
    assert ("was more than one contact" in found.message) == (impacts == 1)
    assert ("frames apart; velocities between them are loose" in found.message) == (impacts == 2)
    assert len(found.statistics["impacts"]) == impacts
    for velocity, v, omega in (
        (found.impacts[0].before, first.v_before, first.omega_before),
        (found.impacts[-1].after, last.v_after, last.omega_after),
    ):
        error = np.concatenate([velocity.v_world - v, velocity.omega_world - omega])
        assert np.all(np.abs(error) < 4.0 * np.sqrt(np.diag(velocity.covariance)))
    assert np.linalg.norm(found.impacts[-1].after.omega_world - last.omega_after) < 0.1 * np.linalg.norm(last.omega_after)


def test_an_impact_in_the_last_three_frames_is_named(sequence: tuple[Observation, Truth]) -> None:
    observation, truth = sequence
    at = int(np.searchsorted(observation.clock.times_s, truth.impacts[0].time_s))
    late = measure(part(observation, 0, at + 2), QUICK)
    assert (late.status, late.motion) == (Status.IMPACT_AT_EDGE, None)
    assert "2 usable frames after" in late.message


def test_an_impact_in_the_first_three_frames_is_named(sequence: tuple[Observation, Truth]) -> None:
    observation, truth = sequence
    at = int(np.searchsorted(observation.clock.times_s, truth.impacts[0].time_s))
    tracks = tracks_of(part(observation, at - 2, len(observation.clock.times_s)))
    kinks = find_kinks(centroid_path(tracks[0]))
    assert "2 usable frames before" in str(edge_kink(tracks, kinks))


def test_a_particle_that_lies_still_is_refused(sequence: tuple[Observation, Truth]) -> None:
    observation = sequence[0]
    outlines = list(observation.recordings[0])  # type: ignore[call-overload]
    lying = tuple(outlines[k % 5] for k in range(LYING_FRAMES))
    clock = Clock(np.arange(LYING_FRAMES) / 4000.0, observation.clock.exposure_s)
    still = tuple(replace(o, points_px=o.points_px - o.points_px.mean(axis=0) + 500.0) for o in lying)
    result = measure(replace(observation, recordings=(still,), clock=clock), QUICK)
    assert result.status is Status.RESTING
    assert "rests or rolls" in result.message
    assert result.motion is None


def test_a_particle_that_rolls_is_refused(sequence: tuple[Observation, Truth]) -> None:
    """Down a slope at a constant speed, turning as it goes."""
    observation, truth = sequence
    mesh, rng = outline_mesh(truth.mesh_vertices, truth.mesh_faces), np.random.default_rng(3)
    times = np.arange(LYING_FRAMES) / 4000.0
    seen = []
    for t in times:
        R = rotation_from_vector(np.array([[0.0, 0.0, 130.0 * t]]))[0]
        place = np.array([0.4 * t, 0.1 * t, 0.6]) - R @ truth.body.com_particle
        exact = exact_outline(mesh, observation.cameras[0].intrinsics, R, place)
        seen.append(noisy_outline(exact, spacing_px=1.0, sigma_px=0.2, rng=rng))
    rolling = replace(
        observation, recordings=(tuple(seen),), clock=Clock(times, observation.clock.exposure_s), plate=None, plate_outlines=()
    )
    result = measure(rolling, QUICK)
    assert (result.status, result.motion) == (Status.RESTING, None)


def test_a_particle_that_drags_so_much_that_it_hardly_falls_is_measured() -> None:
    """Nothing is told of the drag, and the free flight leaves large errors: which is what the user then wants to have explained."""
    recipe = replace(
        FREE, motion=replace(FREE.motion, frames=60), effects=(EffectRecipe("gravity", {"dg_x": 0.0, "dg_y": -9.9, "dg_z": 0.0}),)
    )
    observation = build_silhouette_sequence(recipe, 0)[0]
    result = measure(observation, QUICK)
    assert result.statistics["noise_mean_square"] > HEALTHY_MEAN_SQUARE
    assert result.status is Status.CONVERGED


def test_fits_that_all_run_away_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """As happened to a particle that lost a corner: no flight of the whole one fits, and fits may end anywhere."""
    monkeypatch.setattr(candidate_flights, "fit_growing", lambda _task, start: fit(_task, replace(start, omega=np.full(3, 1e7))))
    result = measure(build_silhouette_sequence(FREE, 0)[0], QUICK)
    assert (result.status, result.motion) == (Status.NO_CONVERGENCE, None)
    assert "ran away" in result.message


def test_a_sequence_without_an_impact_is_measured_as_before() -> None:
    observation = build_silhouette_sequence(FREE, 0)[0]
    whole, again = estimate(observation, Configuration()), measure(observation, Configuration())
    assert again.impacts == ()
    np.testing.assert_array_equal(whole.covariance, again.covariance)
    np.testing.assert_array_equal(whole.values, again.values)
