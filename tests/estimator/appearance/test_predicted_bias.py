"""The calibration of predicted biases, and that they are those of outlines without noise."""

import dataclasses
from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray

from datasets.observation import Observation
from datasets.recipes.recipe import MotionRecipe, NoiseRecipe, ParticleRecipe, Recipe, RigRecipe
from estimator.appearance.predicted_bias import calibrated, with_predicted_bias
from estimator.data.configuration import Configuration
from estimator.data.fit_task import FitTask
from estimator.fitting import tasks
from estimator.geometry.outline_bias import Calibration, outward_directions, supports
from estimator.measuring import free_flight
from estimator.motion.flight import Flight
from estimator.outlines.pictures.pictured import Pictures
from estimator.particle.particle import LEAST_HOLLOW, Particle, hsv_spacing
from synth.sequence import build_silhouette_sequence

Array = NDArray[np.float64]
RECIPE = Recipe(
    seed=61, particle=ParticleRecipe(family="cut_stone", irregularity=0.5), motion=MotionRecipe(frames=24), rig=RigRecipe(drops=5)
)


@dataclass(frozen=True)
class Caught:
    """What the last refinement is given in a sequence's estimate."""

    observation: Observation
    task: FitTask
    particle: Particle
    flight: Flight


JAGGED = dataclasses.replace(RECIPE, particle=ParticleRecipe(family="jagged", irregularity=0.6), rig=RigRecipe(drops=7))


@pytest.fixture(scope="module")
def caught() -> Caught:
    """The first fit of a cut stone's flight."""
    return first_fit(RECIPE)


@pytest.fixture(scope="module")
def jagged() -> Caught:
    """The first fit of a jagged body's flight."""
    return first_fit(JAGGED)


def first_fit(recipe: Recipe) -> Caught:
    observation, _ = build_silhouette_sequence(recipe, 0)
    kept: list[Caught] = []

    def biased(
        seen: Observation, task: FitTask, particle: Particle, flight: Flight, _: Configuration, *, pictures: Pictures | None
    ) -> FitTask:
        assert pictures is None
        kept.append(Caught(seen, task, particle, flight))
        return task

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(free_flight, "biased_task", biased)
        free_flight.estimate(observation, Configuration(surface_fit=0))
    return kept[0]


def true_biases(recipe: Recipe, caught: Caught, task: FitTask) -> tuple[Array, Array]:
    """What the tangents of a task's sightings (n, 180) and of its views (k, 180) are off by, px."""
    exact = dataclasses.replace(recipe, noise=NoiseRecipe(hsv_boundary_px=1e-6, rig_boundary_px=1e-6, spacing_px=0.25))
    truth, _ = build_silhouette_sequence(exact, 0)
    frames, views = tuple(truth.recordings[0]), tuple(truth.view_recording)
    outward = outward_directions()
    in_frames = np.stack([(frames[int(f)].points_px @ outward.T).max(axis=0) for f in caught.task.sightings.frame])
    in_views = np.stack([(outline.points_px @ outward.T).max(axis=0) for outline in views])
    return supports(task.sightings.silhouettes) - in_frames, supports(task.views.silhouettes) - in_views


def predicted(caught: Caught, particle: Particle) -> FitTask:
    return with_predicted_bias(caught.task, particle, caught.flight, pairs=16, rng=np.random.default_rng(0))


def test_predicted_bias_is_that_of_the_noisy_outlines(caught: Caught) -> None:
    task = predicted(caught, caught.particle)
    seen, _ = true_biases(RECIPE, caught, task)
    assert task.bias is not None
    # One outline's tangents scatter by 0.15 px, correlated over some 15 degrees: the mean over 24 outlines of 180 directions by 0.006 px.
    assert task.bias.own.mean() == pytest.approx(seen.mean(), abs=0.02)
    slope = np.sum(task.bias.own * seen) / np.sum(task.bias.own**2)
    assert slope == pytest.approx(1.0, abs=0.35)
    assert np.mean((seen - task.bias.own) ** 2) < np.mean((seen - seen.mean()) ** 2)


def test_spikes_are_cut_as_predicted(jagged: Caught) -> None:
    task = predicted(jagged, jagged.particle)
    seen, seen_in_views = true_biases(JAGGED, jagged, task)
    assert task.bias is not None
    assert jagged.particle.hollow > 2.0 * LEAST_HOLLOW
    assert seen.mean() < -0.1
    # What the views' own prediction is off by goes into the calibrated level and out of the comparison of frames with views.
    spacing = float(np.median(hsv_spacing(jagged.particle, task.sightings.silhouettes)))
    off = (task.bias.own - seen).mean() - (task.bias.view - seen_in_views).mean() / spacing
    assert off == pytest.approx(0.0, abs=0.03)
    assert np.sum(task.bias.own * seen) / np.sum(task.bias.own**2) == pytest.approx(1.0, abs=0.2)
    rest = np.std(seen - task.bias.own)
    convex = dataclasses.replace(jagged.particle)
    convex.__dict__["casting_hull"] = convex.hull
    bridged = predicted(jagged, convex)
    assert bridged.bias is not None
    assert rest < 0.93 * np.std(seen - bridged.bias.own)


def test_views_are_used_as_they_were_seen(caught: Caught) -> None:
    task = with_predicted_bias(caught.task, caught.particle, caught.flight, pairs=2, rng=np.random.default_rng(0))
    assert task.views.silhouettes is caught.particle.seen
    assert caught.task.views.silhouettes is not caught.particle.seen


def test_no_draws_leave_the_task_as_it_is(caught: Caught) -> None:
    none = tasks.biased_task(caught.observation, caught.task, caught.particle, caught.flight, Configuration(bias_pairs=0))
    assert none is caught.task
    some = tasks.biased_task(caught.observation, caught.task, caught.particle, caught.flight, Configuration(bias_pairs=1))
    assert some.bias is not None


def test_calibration_recovers_level_and_slope() -> None:
    rng = np.random.default_rng(2)
    predicted = rng.normal(0.02, 0.06, (40, 180))
    measured = -0.015 + 0.7 * predicted + rng.normal(0.0, 0.03, predicted.shape)
    found = calibrated(predicted, measured)
    assert found.level == pytest.approx(-0.015, abs=2e-3)
    assert found.slope == pytest.approx(0.7, abs=0.03)


def test_predictions_that_do_not_differ_give_a_level_alone() -> None:
    found = calibrated(np.full((3, 180), 0.1), np.full((3, 180), 0.07))
    assert found == Calibration(pytest.approx(-0.03), 1.0)
