"""Drops fitted to all samples: nearer to the truth than tangents, held by the same plate, none of what a plate hides among the samples."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
import pytest

from datasets.estimate import Estimate, Status
from datasets.observation import Observation
from datasets.scoring.impacts import score_impacts
from datasets.truth import Truth
from estimator.data.configuration import Configuration
from estimator.data.fit_task import Sightings
from estimator.impacts.chains import Seen, task_of
from estimator.impacts.impact_contacts import SeparatedContacts, separated_contacts
from estimator.measure import measure
from estimator.measuring import by_samples, with_impacts
from estimator.motion.piecewise import SHIFT, TIME, PiecewiseFlight, named
from estimator.motion.rigid_body import RanAway
from estimator.outlines.sightings import tracks_of
from estimator.particle.observed import observed_particle
from estimator.particle.particle import Particle
from estimator.surface import joint as joint_module
from estimator.surface.frame_samples import samples_of_frames
from estimator.surface.joint import JointFit, joint_fit
from estimator.surface.star_surface import star_surface
from synth.rig import miscalibrated
from synth.sequence import build_silhouette_sequence
from tests.estimator.outlines.test_behind_plate import BELOW
from tests.estimator.test_measure import QUICK, RECIPE

COARSE = 4
SAMPLES = replace(QUICK, surface_fit=2)
SEEDS = (9, 11)
OFF_PX, RADIUS_M = 1.0, 3e-3


@pytest.fixture(scope="module", autouse=True)
def coarse() -> Iterator[None]:
    """Surfaces of a quarter of the corners: a quarter of the time."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(joint_module, "star_surface", partial(star_surface, subdivisions=COARSE))
        yield


@dataclass(frozen=True)
class Fitted:
    """What the joint fit of a drop was given, what it found, and the estimate."""

    particle: Particle
    sightings: Sightings
    joint: JointFit[PiecewiseFlight]
    estimate: Estimate


def by_all_samples(observation: Observation, configuration: Configuration = SAMPLES) -> Fitted:
    given: list[Any] = []

    def fitted(*arguments: Any, **named: Any) -> JointFit[PiecewiseFlight]:
        given.extend([*arguments[:2], joint_fit(*arguments, **named)])
        return given[-1]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(by_samples, "joint_fit", fitted)
        estimate = measure(observation, configuration)
    return Fitted(*given, estimate)


@pytest.fixture(scope="module")
def drops() -> list[tuple[Observation, Truth]]:
    return [build_silhouette_sequence(replace(RECIPE, seed=seed), 0) for seed in SEEDS]


@pytest.fixture(scope="module")
def fitted(drops: list[tuple[Observation, Truth]]) -> list[Fitted]:
    return [by_all_samples(observation) for observation, _ in drops]


def test_drops_are_nearer_to_the_truth_than_by_tangents(drops: list[tuple[Observation, Truth]], fitted: list[Fitted]) -> None:
    """Velocities before the first impact and after the last, root mean squares over drops; pulls are what they should be."""
    found = [[score_impacts(each.estimate, truth) for each, (_, truth) in zip(fitted, drops, strict=True)]]
    found.append([score_impacts(measure(observation, QUICK), truth) for observation, truth in drops])
    for side, which in (("before", 0), ("after", -1)):
        for name in ("in_plane_ms", "out_of_plane_ms", "angular_rads"):
            samples, tangents = (np.sqrt(np.mean([rows[which][f"{side}_{name}"] ** 2 for rows in of])) for of in found)
            assert samples < tangents
    pulls = [
        rows[which][f"{side}_pull_{c}"] for rows in found[0] for side, which in (("before", 0), ("after", -1)) for c in ("vx", "wx", "vz")
    ]
    assert np.sqrt(np.mean(np.square(pulls))) < 2.0


def test_the_estimate_says_how_well_the_surface_meets_the_outlines(fitted: list[Fitted]) -> None:
    for each in fitted:
        assert each.estimate.status is Status.CONVERGED
        told = each.estimate.statistics["surface"]
        assert told["settled"]
        assert told["effective_noise_px"]["frames"] == pytest.approx(0.2, rel=0.4)
        assert each.estimate.covariance is not None
        assert len(each.estimate.parameters) == len(each.estimate.covariance)
        assert not any("shift" in label for label in each.estimate.parameters)


def test_derivatives_by_impacts_are_differences(fitted: list[Fitted]) -> None:
    """By the time of an impact, the velocities after it, and what its pose may be off by."""
    one = fitted[0]
    surface, flight = star_surface(one.particle, subdivisions=COARSE), one.joint.motion
    layout = flight.layout
    at = samples_of_frames(surface, one.sightings, flight)
    for part, size in ((TIME, 2e-6), ("v", 1e-3), ("omega", 0.2), (SHIFT, 2e-6), ("theta", 1e-4)):
        place = layout["theta" if part == "theta" else named(part, 0)]
        step = np.zeros(layout.size)
        step[place] = size * np.linspace(1.0, -0.5, place.stop - place.start)
        after, before = (samples_of_frames(surface, one.sightings, flight.moved(sign * step)) for sign in (1.0, -1.0))
        differences, told = 0.5 * (after.gap_px - before.gap_px), at.by_motion @ step
        moved = np.abs(told) > 0.2 * np.abs(told).max()
        assert np.median(np.abs(differences - told)[moved]) < 0.05 * np.median(np.abs(told[moved]))


def test_a_plate_that_is_stated_too_high_is_among_what_is_known(drops: list[tuple[Observation, Truth]]) -> None:
    """By 0.06 mm: the flight is asked to give way, upwards."""
    observation = drops[0][0]
    assert observation.plate is not None
    plate = observation.plate
    high = replace(observation, plate=replace(plate, point_world=plate.point_world + 6e-5 * plate.normal_world))
    free, kept = (by_all_samples(high, replace(SAMPLES, keep_out_of_plate=on)) for on in (0, 1))
    assert "kept out of the stated plate" in kept.estimate.message
    place = kept.joint.motion.layout["x"]
    asked = [-(each.joint.last.known.pull[place] @ plate.normal_world) for each in (free, kept)]
    told = [float(plate.normal_world @ each.joint.last.known.information[place, place] @ plate.normal_world) for each in (free, kept)]
    assert (asked[0], told[0]) == (0.0, 0.0)
    assert asked[1] > 0.0
    assert told[1] > 0.0


def test_samples_that_a_plate_may_hide_are_left_out() -> None:
    observation, truth = build_silhouette_sequence(BELOW, 0)
    seen = Seen(observation, tracks_of(observation), observed_particle(observation, Configuration()))
    sightings = task_of(seen, Configuration(), in_part=True).sightings
    left = [len(sightings.outlines_px[k]) - len(sightings.sure_px(k)) for k in range(len(sightings))]
    hidden = [int(unsure.sum()) for unsure in sightings.unsure]
    assert any(hidden)
    assert all(out > some if some else out == 0 for out, some in zip(left, hidden, strict=True))
    taken = sightings.take(np.arange(1, len(sightings)))
    assert len(taken.sure_px(0)) == len(sightings.sure_px(1))
    (row,) = score_impacts(by_all_samples(observation).estimate, truth)
    assert row["after_in_plane_percent"] < 0.3


def test_contacts_that_only_widen_the_intervals_stay_with_tangents(
    drops: list[tuple[Observation, Truth]], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Their flight is held to a pose that outlines contradict: samples would be sure of it."""

    def widened(*arguments: Any, **named: Any) -> SeparatedContacts:
        return replace(separated_contacts(*arguments, **named), widened=True)

    monkeypatch.setattr(with_impacts, "separated_contacts", widened)
    assert "surface" not in measure(drops[0][0], SAMPLES).statistics


def test_a_drop_beside_which_no_surface_meets_views_that_disagree_is_ambiguous(drops: list[tuple[Observation, Truth]]) -> None:
    """As of a flight without impacts: a wrong pose may meet the tangents of such views by chance."""
    rng, observation = np.random.default_rng(12), drops[0][0]
    off = tuple(miscalibrated(view, np.zeros(3), RADIUS_M, OFF_PX, rng) for view in observation.views)

    def ran_away(*_arguments: Any, **_named: Any) -> JointFit[PiecewiseFlight]:
        raise RanAway("it left")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(by_samples, "joint_fit", ran_away)
        found, agreeing = (measure(replace(observation, views=views), SAMPLES) for views in (off, observation.views))
    assert (found.status, found.message.startswith(by_samples.NO_SURFACE)) == (Status.AMBIGUOUS, True)
    assert agreeing.status in (Status.CONVERGED, Status.SECOND_CONTACT)
