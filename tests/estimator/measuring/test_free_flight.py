"""The whole instrument on small silhouette sequences: a measurement, its error bars, and every way of having none."""

import json
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from datasets.estimate import Estimate, Status
from datasets.observation import Observation
from datasets.recipes.recipe import MotionRecipe, ParticleRecipe, Recipe, RigRecipe
from datasets.truth import Truth
from datasets.vocabulary.camera import HsvCamera
from datasets.vocabulary.outline import Outline
from estimator.data.configuration import Configuration, configuration_from_dict
from estimator.data.views import Poses
from estimator.fitting import tasks
from estimator.fitting.levenberg_marquardt import NormalEquations, Outcome, Solution
from estimator.measuring import free_flight
from estimator.measuring.free_flight import estimate
from estimator.motion.rotation import rotation_from_vector
from estimator.poses.pose_search import FoundPoses
from estimator.search import candidate_flights
from synth.sequence import build_silhouette_sequence
from synth.silhouette.exact_outline import exact_outline, outline_mesh
from synth.silhouette.noisy_outline import noisy_outline

pytestmark = pytest.mark.long

FRAMES = 30
RECIPE = Recipe(
    seed=5,
    particle=ParticleRecipe(family="cut_stone", irregularity=0.6, size_mm=(6.0, 6.0)),
    motion=MotionRecipe(frames=FRAMES, speed_ms=(1.5, 2.5), spin_rads=(120.0, 200.0)),
    rig=RigRecipe(drops=4),
)
EMPTY = Outline(np.zeros((0, 2)))


@pytest.fixture(scope="module")
def sequence() -> tuple[Observation, Truth]:
    return build_silhouette_sequence(RECIPE, 0)


@pytest.fixture(scope="module")
def measured(sequence: tuple[Observation, Truth]) -> Estimate:
    return estimate(sequence[0], Configuration())


def test_velocities_are_right_and_inside_their_error_bars(sequence: tuple[Observation, Truth], measured: Estimate) -> None:
    truth = sequence[1].motion
    assert measured.status is Status.CONVERGED
    for velocity in (measured.start, measured.middle):
        assert velocity is not None
        frame = int(np.argmin(np.abs(truth.times_s - velocity.time_s)))
        error = np.concatenate([velocity.v_world - truth.v_world[frame], velocity.omega_world - truth.omega_world[frame]])
        sigma = np.sqrt(np.diag(velocity.covariance))
        assert np.all(np.abs(error) < 5.0 * sigma)
        assert np.linalg.norm(error[:2]) < 0.01 * np.linalg.norm(truth.v_world[frame])
        assert np.linalg.norm(error[3:]) < 0.03 * np.linalg.norm(truth.omega_world[frame])
        assert np.all(np.diag(velocity.bound) <= np.diag(velocity.covariance) * 1.5)


def test_a_wrong_first_pose_is_left_for_other_sightings(
    sequence: tuple[Observation, Truth], measured: Estimate, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A pose that is no minimum of this body: its trajectory misses by far, and the search goes on elsewhere in the sequence."""
    search = candidate_flights.first_pose

    def turned(*arguments: Any) -> tuple[FoundPoses, int]:
        found, reference = search(*arguments)
        best = found.poses.take(np.array([0]))
        away = rotation_from_vector(np.array([[1.2, 0.9, 0.0]])) @ best.R
        return FoundPoses(Poses(away, best.centre_cam, best.cost), found.rms_px[:1]), reference

    monkeypatch.setattr(free_flight, "first_pose", turned)
    result = estimate(sequence[0], replace(Configuration(), momentum_starts=0))
    assert result.status is Status.CONVERGED
    assert result.middle is not None
    assert measured.middle is not None
    sigma = np.sqrt(np.diag(measured.middle.covariance))
    assert np.all(np.abs(result.middle.omega_world - measured.middle.omega_world) < 0.5 * sigma[3:])


@pytest.mark.parametrize(("share", "taken"), [(0.6, True), (0.9995, False), (1.2, False)])
def test_starts_elsewhere_are_tried_for_good_solutions_too(share: float, taken: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Another minimum is taken, the same one reached from elsewhere is not."""

    def solution(name: str, cost: float) -> Solution[Any]:
        return Solution(SimpleNamespace(name=name), NormalEquations(np.eye(1), np.zeros(1), cost), Outcome.CONVERGED, 1)

    cost = candidate_flights.GOOD_COST  # of a task with ten pairs: a tenth of what counts as poor
    task = SimpleNamespace(weight=np.ones((2, 5)))
    monkeypatch.setattr(candidate_flights, "starts_along", lambda *_: ["elsewhere"])
    monkeypatch.setattr(candidate_flights, "best_start", lambda _task, starts: starts[0])
    monkeypatch.setattr(candidate_flights, "fit_growing", lambda _task, start: solution(start, share * cost))
    monkeypatch.setattr(candidate_flights, "at_time", lambda flight, _time: flight)
    monkeypatch.setattr(candidate_flights, "fit", lambda _task, flight: solution(flight.name, share * cost))
    first = (SimpleNamespace(body=None, gravity_world=None, time_s=0.0), solution("here", cost))
    found = candidate_flights._from_other_starts(task, None, first, Configuration(), np.random.default_rng(0))
    assert found.state.name == ("elsewhere" if taken else "here")


def test_momenta_are_given_for_a_weighed_particle(sequence: tuple[Observation, Truth], measured: Estimate) -> None:
    observation, truth = sequence
    assert observation.mass_kg is not None
    momenta = measured.statistics["momenta"]
    middle = truth.motion.v_world[(FRAMES - 1) // 2]
    assert measured.middle is not None
    np.testing.assert_allclose(momenta["P_world_kgms"], observation.mass_kg * measured.middle.v_world, rtol=1e-9)
    np.testing.assert_allclose(momenta["P_world_kgms"][:2], observation.mass_kg * middle[:2], atol=1e-2 * observation.mass_kg)
    assert np.linalg.norm(momenta["L_world_kgm2s"]) > 0
    assert "momenta" not in estimate(replace(observation, mass_kg=None), Configuration()).statistics
    json.dumps(measured.statistics)


def test_too_few_frames_are_no_measurement(sequence: tuple[Observation, Truth]) -> None:
    observation = sequence[0]
    few = tuple(o if i < 4 else EMPTY for i, o in enumerate(observation.recordings[0]))  # type: ignore[arg-type]
    result = estimate(replace(observation, recordings=(few,)), Configuration())
    assert result.status is Status.OUT_OF_VIEW
    assert result.middle is None
    assert "4 usable pictures" in result.message
    assert estimate(observation, Configuration(minimum_frames=50)).status is Status.NOT_ENOUGH_FRAMES


def test_gaps_are_bridged_and_reported(sequence: tuple[Observation, Truth]) -> None:
    observation, truth = sequence
    gappy = tuple(EMPTY if 8 <= i < 12 else o for i, o in enumerate(observation.recordings[0]))  # type: ignore[arg-type]
    result = estimate(replace(observation, recordings=(gappy,)), Configuration())
    assert result.status is Status.CONVERGED
    assert [f.frame for f in result.frames if not f.used] == [8, 9, 10, 11]
    assert all(f.reason for f in result.frames if not f.used)
    assert result.middle is not None
    v = truth.motion.v_world[(FRAMES - 1) // 2]
    assert np.linalg.norm(result.middle.v_world[:2] - v[:2]) < 0.01 * np.linalg.norm(v)


def test_an_outline_without_area_is_reported_and_moves_no_other_frame(sequence: tuple[Observation, Truth], measured: Estimate) -> None:
    outlines = list(sequence[0].recordings[0])  # type: ignore[arg-type]
    middle = outlines[5].points_px.mean(axis=0)
    outlines[5] = Outline(middle + np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]]))
    result = estimate(replace(sequence[0], recordings=(tuple(outlines),)), Configuration())
    assert (result.frames[5].used, result.frames[5].reason) == (False, "outline without area")
    rms = np.array([[f.rms_ete_px for f in e.frames] for e in (result, measured)])
    others = np.arange(len(rms[0])) != 5
    assert np.abs(rms[0] - rms[1])[others].max() < 0.3 * np.ptp(rms[1])
    assert rms[0][others].min() > 0.0


def test_another_particle_is_not_measured(sequence: tuple[Observation, Truth]) -> None:
    other, _ = build_silhouette_sequence(replace(RECIPE, particle=replace(RECIPE.particle, family="jagged", irregularity=0.8), seed=9), 0)
    mixed = replace(sequence[0], views=other.views, view_recording=other.view_recording)
    result = estimate(mixed, Configuration())
    assert result.status is Status.NO_CONVERGENCE
    assert result.middle is None
    assert result.motion is None


def test_a_foreign_view_is_named_and_left_out(sequence: tuple[Observation, Truth], measured: Estimate) -> None:
    observation = sequence[0]
    other, _ = build_silhouette_sequence(replace(RECIPE, seed=21), 0)
    outlines = list(observation.view_recording)  # type: ignore[arg-type]
    outlines[7] = other.view_recording[7]  # type: ignore[index]
    result = estimate(replace(observation, view_recording=tuple(outlines)), Configuration())
    assert result.statistics["views_left_out"] == [7]
    assert "view 7" in result.message
    assert result.status is Status.CONVERGED
    assert measured.statistics["views_left_out"] == []


def test_two_cameras_see_depth_better(sequence: tuple[Observation, Truth], measured: Estimate) -> None:
    observation, truth = sequence
    turn = np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
    middle = truth.motion.x_world[FRAMES // 2]
    camera = HsvCamera("side", observation.cameras[0].intrinsics, turn, np.array([0.0, 0.0, 0.6]) - turn @ middle)

    mesh = outline_mesh(truth.mesh_vertices, truth.mesh_faces)
    rng = np.random.default_rng(8)
    seen = []
    for q, x in zip(truth.motion.q_world_body, truth.motion.x_world, strict=True):
        R_world_body = Rotation.from_quat(q).as_matrix()
        R = turn @ R_world_body @ truth.body.R_particle_body.T
        t = turn @ x + camera.t_cam_world - R @ truth.body.com_particle
        seen.append(noisy_outline(exact_outline(mesh, camera.intrinsics, R, t), spacing_px=1.0, sigma_px=0.2, rng=rng))
    both = replace(observation, cameras=(*observation.cameras, camera), recordings=(*observation.recordings, tuple(seen)))
    result = estimate(both, Configuration())
    assert result.status is Status.CONVERGED
    assert result.middle is not None
    assert measured.middle is not None
    assert result.middle.covariance[2, 2] < 0.1 * measured.middle.covariance[2, 2]
    v = truth.motion.v_world[(FRAMES - 1) // 2]
    assert np.linalg.norm(result.middle.v_world - v) < 0.005 * np.linalg.norm(v)


def test_configuration_names_what_is_wrong() -> None:
    with pytest.raises(Exception, match="did you mean floor_px"):
        configuration_from_dict({"flor_px": 0.1})
    with pytest.raises(Exception, match="of type int"):
        configuration_from_dict({"pose_starts": 1.5})
    assert configuration_from_dict({"floor_px": 1}).floor_px == 1.0


def test_priors_of_the_hull_widen_where_views_are_few() -> None:
    """12 cut stones: products of inertia are off by 0.012 with six views, four times what is believed of 60."""

    def prior_of(views: int) -> Any:
        observation, particle = SimpleNamespace(recordings=()), SimpleNamespace(extent_m=1.0, hollow=0.0)
        seen = SimpleNamespace(silhouettes=[None] * views)
        return tasks.fit_task(observation, particle, [None], seen, Configuration()).prior  # type: ignore[arg-type]

    six, sixty = prior_of(6), prior_of(60)
    assert (sixty.com_m, sixty.inertia, sixty.inertia_products) == (0.0025, 0.015, 0.003)
    assert (six.com_m, six.inertia, six.inertia_products) == pytest.approx((0.0039, 0.019, 0.012))
