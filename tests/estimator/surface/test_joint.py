"""The joint fit of surface and flight on a small sequence of a smooth body: nearer to the truth than tangents, within its error bars."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from datasets.estimate import Estimate, Status
from datasets.observation import Observation
from datasets.recipes.recipe import MotionRecipe, ParticleRecipe, Recipe, RigRecipe
from datasets.scoring.metrics import COMPONENTS
from datasets.scoring.score import score
from datasets.truth import Truth
from datasets.vocabulary.outline import Outline
from datasets.vocabulary.surface_mesh import SurfaceMesh
from estimator.appearance.flight_errors import unbiased_errors
from estimator.data.configuration import Configuration
from estimator.data.fit_task import Sightings
from estimator.fitting.refinement import Refined
from estimator.fitting.stable_inverse import scaled_inverse
from estimator.measuring import by_samples, free_flight
from estimator.measuring.by_samples import unless_left
from estimator.motion.flight import COM, INERTIA, N_PARAMETERS, OFFSET, Flight, Motion, moved, poses
from estimator.particle.mass_properties import solid_of
from estimator.particle.particle import Particle
from estimator.reports.verdict import judge
from estimator.search.rival_flights import Standing
from estimator.surface import joint as joint_module
from estimator.surface.frame_samples import samples_of_frames, seen_under
from estimator.surface.joint import SURFACE_OFF, JointFit, Known, joint_fit, slow_misfit
from estimator.surface.samples import MovedViews, views_of
from estimator.surface.star_surface import star_surface
from estimator.surface.told import surface_sentence
from synth.rig import miscalibrated
from synth.sequence import build_silhouette_sequence

RECIPE = Recipe(
    seed=8,
    particle=ParticleRecipe(family="cut_stone", irregularity=0.2, size_mm=(6.0, 6.0)),
    motion=MotionRecipe(frames=24, speed_ms=(1.5, 2.5), spin_rads=(120.0, 200.0)),
    rig=RigRecipe(drops=3),
)
COARSE = 4
Array = NDArray[np.float64]


@pytest.fixture(scope="module")
def made() -> tuple[Observation, Truth]:
    return build_silhouette_sequence(RECIPE, 0)


@dataclass(frozen=True)
class Measured:
    """The joint fit, the flight of the tangents that it began with, and what it was given; the motion that was refined at last."""

    estimate: Estimate
    flight: Flight
    particle: Particle
    sightings: Sightings
    refined: Refined[Motion]
    joint: JointFit[Flight]


@pytest.fixture(scope="module")
def measured(made: tuple[Observation, Truth]) -> Measured:
    given: list[tuple[Any, ...]] = []

    def fitted(*arguments: Any, **named: Any) -> JointFit[Flight]:
        given.append((*arguments, joint := joint_fit(*arguments, **named)))
        return joint

    def kept(ranked: Standing, refined: Refined[Motion]) -> tuple[Status, str]:
        given.append((refined,))
        return judge(ranked, refined)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(joint_module, "star_surface", partial(star_surface, subdivisions=COARSE))
        patch.setattr(by_samples, "joint_fit", fitted)
        patch.setattr(free_flight, "judge", kept)
        estimate = free_flight.estimate(made[0], Configuration(surface_fit=2))
    (particle, sightings, flight, _, joint), (refined,) = given
    return Measured(replace(estimate, status=Status.CONVERGED), flight, particle, sightings, refined, joint)


def test_flat_faces_are_no_pillows_as_the_hull_s_are(made: tuple[Observation, Truth], measured: Measured) -> None:
    true = solid_of(SurfaceMesh(made[1].mesh_vertices, made[1].mesh_faces)).volume
    surfaces = star_surface(measured.particle, subdivisions=COARSE), measured.joint.surface
    hull, found = (solid_of(SurfaceMesh(s.vertices, s.sphere.mesh.faces)).volume / true - 1.0 for s in surfaces)
    assert hull > 0.015
    assert abs(found) < 0.6 * hull


def test_it_is_nearer_to_the_truth_than_the_estimate_of_tangents(made: tuple[Observation, Truth], measured: Measured) -> None:
    samples, tangents = score(measured.estimate, made[1]), score(free_flight.estimate(made[0], Configuration(surface_fit=0)), made[1])
    for error in ("middle_in_plane_ms", "middle_out_of_plane_ms", "middle_angular_rads"):
        assert samples[error] < 0.8 * tangents[error]


def test_the_estimate_says_how_well_the_surface_meets_the_outlines(measured: Measured) -> None:
    told = measured.estimate.statistics["surface"]
    for group in ("views", "frames"):
        assert told["effective_noise_px"][group] == pytest.approx(0.2, rel=0.4)
        assert told["outline_noise_px"][group] == pytest.approx(0.2, rel=0.4)
    assert not surface_sentence(replace(measured.joint, noise_px=(0.5, 1.5), outline_noise_px=(0.2, 0.2))), "noisy outlines are met, too"
    gone = surface_sentence(replace(measured.joint, noise_px=(581.7, 0.8)))
    assert gone == "The fit to all outline samples ran away from the views"


def test_its_error_bars_hold_the_truth(made: tuple[Observation, Truth], measured: Measured) -> None:
    scored = score(measured.estimate, made[1])
    assert max(abs(scored[f"middle_pull_{c}"]) for c in COMPONENTS) < 3.0


def test_the_tangency_errors_that_are_told_are_those_of_its_own_flight(measured: Measured) -> None:
    flight = measured.refined.flight.first
    there = unbiased_errors(measured.refined.at.task, flight, poses(flight, np.zeros((1, N_PARAMETERS)), measured.sightings.times_s))
    np.testing.assert_allclose(measured.refined.at.errors.error, there.error, atol=1e-9)
    assert np.abs(flight.omega - measured.flight.omega).max() > 1e-3


def test_derivatives_by_the_flight_are_differences(measured: Measured) -> None:
    surface = star_surface(measured.particle, subdivisions=COARSE)
    step = np.zeros(N_PARAMETERS)
    step[:12] = [2e-6, -2e-6, 4e-5, 5e-4, -5e-4, 5e-4, 1e-4, 1e-4, 2e-3, 0.02, -0.02, 0.02]
    at, after = (samples_of_frames(surface, measured.sightings, flight) for flight in (measured.flight, moved(measured.flight, step)))
    found, told = after.gap_px - at.gap_px, at.by_motion @ step
    assert np.median(np.abs(found - told)) < 0.05 * np.median(np.abs(told))


def test_what_is_left_is_noise_and_a_wrong_gravity_is_not(made: tuple[Observation, Truth], measured: Measured) -> None:
    left = slow_misfit(measured.joint)
    assert left is not None
    assert left.p > 0.01
    assert measured.estimate.statistics["adequacy"]["p"] == left.p
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(joint_module, "star_surface", partial(star_surface, subdivisions=COARSE))
        wrong = replace(made[0], gravity_world=made[0].gravity_world + np.array([30.0, 0.0, 0.0]))
        told = free_flight.estimate(wrong, Configuration(surface_fit=2)).statistics["adequacy"]
    assert told["p"] < 1e-3


def test_the_bound_is_that_of_a_surface_that_is_known(measured: Measured) -> None:
    joint = measured.joint
    assert np.all(np.linalg.eigvalsh(joint.covariance - joint.bound) > -1e-6 * np.diag(joint.covariance).min())
    np.testing.assert_array_equal(measured.refined.bound, joint.bound)


def test_the_surface_is_further_off_than_a_covariance_about_drawn_edges_says(measured: Measured) -> None:
    last = measured.joint.last
    said, bound = (np.diag(each)[:12] for each in (scaled_inverse(last.fitted.H + last.known.information), measured.joint.bound))
    added = np.diag(measured.joint.covariance)[:12] - bound
    np.testing.assert_allclose(added, (SURFACE_OFF * measured.joint.scale) ** 2 * (said - bound), rtol=0.4)


def test_frames_carve_the_hull_that_the_fit_begins_with(made: tuple[Observation, Truth], measured: Measured) -> None:
    true = solid_of(SurfaceMesh(made[1].mesh_vertices, made[1].mesh_faces)).volume
    hulls = (star_surface(measured.particle, further, COARSE) for further in ((), seen_under(measured.flight, measured.sightings)))
    views, both = (solid_of(SurfaceMesh(s.vertices, s.sphere.mesh.faces)).volume / true - 1.0 for s in hulls)
    assert abs(both) < 0.8 * views


def shifted(observation: Observation, numbers: Sequence[int], change: Callable[[np.ndarray], np.ndarray]) -> Observation:
    """The outlines ``numbers`` of the high-speed camera changed."""
    outlines = list(observation.recordings[0])
    for k in numbers:
        outlines[k] = Outline(change(outlines[k].points_px))
    return replace(observation, recordings=(tuple(outlines),))


def smaller(factor: float) -> Callable[[np.ndarray], np.ndarray]:
    return lambda points: points.mean(axis=0) + factor * (points - points.mean(axis=0))


@pytest.mark.parametrize(
    ("numbers", "change"),
    [
        (range(12, 24), lambda points: points + 120.0),
        ([9], lambda points: points + 60.0),
        ([9], smaller(0.8)),
    ],
)
def test_outlines_that_do_not_fit_end_with_a_status(
    made: tuple[Observation, Truth], numbers: Sequence[int], change: Callable[[np.ndarray], np.ndarray], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nothing runs away, and where no surface meets the outlines the estimate is that of tangents, which says so."""
    monkeypatch.setattr(joint_module, "star_surface", partial(star_surface, subdivisions=COARSE))
    wrong = shifted(made[0], numbers, change)
    samples, tangents = (free_flight.estimate(wrong, Configuration(surface_fit=on)) for on in (2, 0))
    assert "surface" in samples.statistics or samples.status is tangents.status
    if "surface" not in samples.statistics and tangents.middle is not None:
        assert samples.middle is not None
        np.testing.assert_array_equal(samples.middle.v_world, tangents.middle.v_world)
        assert "the estimate is that of tangents" in samples.message


def test_frames_that_do_not_show_the_middle_carve_nothing(measured: Measured) -> None:
    outline, view = seen_under(measured.flight, measured.sightings)[0]
    away = (Outline(outline.points_px + 500.0), view)
    alone, beside = (star_surface(measured.particle, further, COARSE).vertices for further in ((), (away,)))
    np.testing.assert_array_equal(beside, alone)


def test_slow_errors_that_few_times_cannot_show_are_not_tested(measured: Measured) -> None:
    few = replace(measured.joint, sightings=measured.sightings.take(np.array([3, 9, 20])))
    assert slow_misfit(few) is None


def test_offsets_are_held_until_the_mesh_follows_the_edges(measured: Measured) -> None:
    nothing = Known(measured.particle.body, np.r_[COM, INERTIA], np.zeros((N_PARAMETERS,) * 2), np.zeros(N_PARAMETERS), np.r_[OFFSET])
    assert np.flatnonzero(np.diag(nothing.held.information)).tolist() == np.r_[OFFSET].tolist()


def test_views_that_are_seen_elsewhere_are_found_and_cost_little(made: tuple[Observation, Truth], measured: Measured) -> None:
    """Each of 18 views displaced in its picture by as much as its outlines' noise is."""
    moves = 0.2 * np.random.default_rng(3).normal(size=(len(made[0].views), 2))
    moved_away = tuple(Outline(each.points_px + by) for each, by in zip(made[0].view_recording, moves, strict=True))
    joints: list[JointFit[Flight]] = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(joint_module, "star_surface", partial(star_surface, subdivisions=COARSE))
        patch.setattr(by_samples, "joint_fit", lambda *given, **named: joints.append(joint_fit(*given, **named)) or joints[-1])
        found = score(free_flight.estimate(replace(made[0], view_recording=moved_away), Configuration()), made[1])
    (joint,) = joints
    assert joint.views.sd_px == pytest.approx(0.2, rel=0.35)
    assert joint.noise_px[0] < 1.2 * measured.joint.noise_px[0]
    off = (joint.views.shift_px - moves).ravel()
    shared = np.concatenate([v.intrinsics.fx_px / v.t_cam_particle[2] * v.R_cam_particle[:2] for v in made[0].views])
    together = np.linalg.lstsq(shared, off, rcond=None)[0]  # a body elsewhere among all views looks the same
    assert np.std(off - shared @ together) < 0.3 * np.std(moves)
    assert max(abs(found[f"middle_pull_{c}"]) for c in COMPONENTS) < 3.0


OFF_PX = 1.0


def test_views_that_are_misplaced_are_found_and_measured_beside(made: tuple[Observation, Truth]) -> None:
    """Twelve views off by five times what outlines explain; without turns the surface left them, and orientations were 2 to 8° off."""
    rng, centre = np.random.default_rng(4), made[1].body.com_particle
    radius_m = 0.5 * float(np.ptp(made[1].mesh_vertices, axis=0).max())
    views = tuple(miscalibrated(view, centre, radius_m, OFF_PX, rng) for view in made[0].views[:12])
    observation = replace(made[0], views=views, view_recording=made[0].view_recording[:12])
    joints: list[JointFit[Flight]] = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(joint_module, "star_surface", partial(star_surface, subdivisions=COARSE))
        patch.setattr(by_samples, "joint_fit", lambda *given, **named: joints.append(joint_fit(*given, **named)) or joints[-1])
        estimate = free_flight.estimate(observation, Configuration())
    (joint,), found = joints, score(replace(estimate, status=Status.CONVERGED), made[1])
    assert joint.views.sd_px == pytest.approx(OFF_PX, rel=0.35)
    assert joint.noise_px[0] < 3.0 * joint.outline_noise_px[0]
    assert "surface" in estimate.statistics
    assert found["orientation_median_deg"] < 2.0
    assert max(abs(found[f"middle_pull_{c}"]) for c in COMPONENTS) < 3.0


def disagreeing(measured: Measured) -> MovedViews:
    """Views that are free to move and turn; their standard deviation is known."""
    disagreement = replace(measured.particle.disagreement, calibration_px=1.0)
    return views_of(replace(measured.particle, disagreement=disagreement, recalibrated_px=1.0), 0.0)


def test_samples_of_views_change_as_their_moves_say(made: tuple[Observation, Truth], measured: Measured) -> None:
    views = disagreeing(measured)
    assert views.moved_px.shape == (18, 5)
    step = 1e-4 * np.random.default_rng(6).normal(size=views.moved_px.size)
    there, back = (views.moved(sign * step, np.zeros(0)).samples(measured.joint.surface).gap_px for sign in (1.0, -1.0))
    told = views.samples(measured.joint.surface).by_motion @ (2.0 * step)
    off = there - back - told
    assert np.median(np.abs(off)) < 0.05 * np.median(np.abs(told))  # turns are told along normals over a pixel


def test_views_are_calibrated_where_they_are_moved_to(made: tuple[Observation, Truth], measured: Measured) -> None:
    """Campaigns go on with views that are calibrated so: their samples are those of the moved views."""
    surface = measured.joint.surface
    views = disagreeing(measured)
    moved_views = views.moved(np.random.default_rng(7).normal(size=views.moved_px.size), np.zeros(0))
    before, there = (replace(views, calibrated=each).samples(surface).gap_px for each in (views.calibrated, moved_views.placed))
    off = there - moved_views.samples(surface).gap_px
    assert np.sqrt(np.mean(off**2)) < 0.02 * np.sqrt(np.mean((there - before) ** 2))


def test_a_flight_beside_which_no_surface_meets_views_that_disagree_is_no_measurement(measured: Measured) -> None:
    """Of a sequence with six views off by 2 px the poses were 92° off, and it was converged."""
    off = replace(measured.particle, disagreement=replace(measured.particle.disagreement, calibration_px=1.0))
    left = f"{surface_sentence(replace(measured.joint, noise_px=(581.7, 0.8)))}; {by_samples.OF_TANGENTS}"
    converged = (Status.CONVERGED, "converged.")
    assert unless_left(converged, off, left) == (Status.AMBIGUOUS, by_samples.NO_SURFACE)
    assert unless_left(converged, measured.particle, left) == converged
    assert unless_left(converged, off, "") == converged
    assert unless_left((Status.NO_CONVERGENCE, ""), off, left) == (Status.NO_CONVERGENCE, "")
