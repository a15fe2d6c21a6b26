"""Two cameras of which one's clock is off: offset and motion are found together, and the report draws the body where it is in each."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from datasets.estimate import Estimate, Status
from datasets.observation import Observation
from datasets.recipes.recipe import FurtherHsvRecipe, MotionRecipe, ParticleRecipe, Recipe, RigRecipe
from datasets.truth import Truth
from estimator.data.configuration import Configuration
from estimator.measuring.free_flight import estimate
from estimator.reports.clock_reporting import with_clocks_as_stamped
from estimator.search.clock_alignment import unknown_clocks
from synth.sequence import build_silhouette_sequence
from tumble.reports.camera_poses import frame_times, motion_in_frames

INTERVAL_S = 1.0 / 4000.0
RECIPE = Recipe(
    seed=5,
    particle=ParticleRecipe(family="cut_stone", irregularity=0.6, size_mm=(6.0, 6.0)),
    motion=MotionRecipe(frames=30, speed_ms=(1.5, 2.5), spin_rads=(120.0, 200.0)),
    rig=RigRecipe(drops=4),
    further_hsv=(FurtherHsvRecipe(focal_mm=80.0, hidden_offset_frames=(0.5, 0.5), offset_sigma_frames=0.5),),
)


@pytest.fixture(scope="module")
def sequence() -> tuple[Observation, Truth]:
    return build_silhouette_sequence(RECIPE, 0)


@pytest.fixture(scope="module")
def measured(sequence: tuple[Observation, Truth]) -> Estimate:
    return estimate(sequence[0], Configuration())


def test_half_a_frame_is_found_to_a_fiftieth(measured: Estimate) -> None:
    assert measured.status is Status.CONVERGED
    told = measured.statistics["clocks"]["hsv_2"]
    assert told["offset_s"] == pytest.approx(0.5 * INTERVAL_S, abs=0.02 * INTERVAL_S)
    assert abs(told["offset_s"] - 0.5 * INTERVAL_S) < 4.0 * told["offset_s_sigma"]
    assert told["offset_s_stated_sigma"] == pytest.approx(0.5 * INTERVAL_S)
    assert "Frames of hsv_2 were taken 12" in measured.message
    assert "hsv_2.clock_offset_s" in measured.parameters


def test_depth_is_known_as_well_as_the_plane(sequence: tuple[Observation, Truth], measured: Estimate) -> None:
    truth, middle = sequence[1].motion, measured.middle
    assert middle is not None
    frame = int(np.argmin(np.abs(truth.times_s - middle.time_s)))
    error = np.concatenate([middle.v_world - truth.v_world[frame], middle.omega_world - truth.omega_world[frame]])
    sigma = np.sqrt(np.diag(middle.covariance))
    assert np.all(np.abs(error) < 4.0 * sigma)
    assert sigma[2] < 2.0 * sigma[:2].max()


def test_every_camera_has_a_noise_of_its_own(measured: Estimate) -> None:
    noise = measured.statistics["surface"]["effective_noise_px"]
    assert list(noise) == ["views", "frames of hsv", "frames of hsv_2"]


def test_a_report_has_the_body_where_it_is_in_every_frame(sequence: tuple[Observation, Truth], measured: Estimate) -> None:
    observation, truth = sequence
    assert measured.motion is not None
    assert motion_in_frames(measured.motion, measured, observation, 0) is measured.motion
    assert frame_times(measured, observation, 1) == pytest.approx(truth.notes["further_cameras"][0]["true_times_s"], abs=0.02 * INTERVAL_S)
    there = motion_in_frames(measured.motion, measured, observation, 1)
    x, t = measured.motion.x_world, measured.motion.times_s
    expected = np.stack([np.polynomial.Polynomial.fit(t, x[:, axis], 2)(there.times_s) for axis in range(3)], axis=1)
    assert there.x_world == pytest.approx(expected, abs=2e-6)


def test_clocks_that_are_known_are_no_parameters(sequence: tuple[Observation, Truth]) -> None:
    (found,) = unknown_clocks(sequence[0])
    assert (found.camera, found.name, found.rate_sigma) == (1, "hsv_2", 0.0)
    recipe = Recipe(seed=5, motion=MotionRecipe(frames=4), rig=RigRecipe(drops=1), further_hsv=(FurtherHsvRecipe(),))
    assert unknown_clocks(build_silhouette_sequence(recipe, 0)[0]) == ()


def test_with_impacts_stamps_are_taken_as_they_are(sequence: tuple[Observation, Truth], measured: Estimate) -> None:
    observation = sequence[0]
    assert with_clocks_as_stamped(measured, observation) is measured
    impact = SimpleNamespace()
    told = with_clocks_as_stamped(replace(measured, impacts=(impact,)), observation)  # type: ignore[arg-type]
    assert "The stamps of hsv_2 were taken as they are" in told.message
