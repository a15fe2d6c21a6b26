"""The stated uncertainty of camera and gravity is in that of the velocities, and is said where it limits them."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from datasets.errors import InputError
from datasets.estimate import Estimate, Status
from datasets.observation import Observation
from datasets.observation_files import read_observation, write_observation
from datasets.recipes.recipe import MotionRecipe, ParticleRecipe, Recipe, RigRecipe
from datasets.vocabulary.camera import HsvCamera
from estimator import measure as measuring
from estimator.data.configuration import Configuration
from estimator.fitting import tasks
from estimator.fitting.calibration_share import NOT_CONSIDERED, calibration_share, widened, with_what_is_missing
from estimator.measuring.free_flight import estimate
from estimator.motion.piecewise import PiecewiseFlight
from synth.sequence import build_silhouette_sequence

RECIPE = Recipe(
    seed=5,
    particle=ParticleRecipe(family="cut_stone", irregularity=0.6, size_mm=(6.0, 6.0)),
    motion=MotionRecipe(frames=20, speed_ms=(1.5, 2.5), spin_rads=(120.0, 200.0)),
    rig=RigRecipe(drops=2),
)
TANGENTS = Configuration(surface_fit=0)
TALLER = 0.01
GRAVITY_MS2 = 0.4


@pytest.fixture(scope="module")
def seen() -> Observation:
    return build_silhouette_sequence(RECIPE, 0)[0]


def lens_errors(seen: Observation) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """Pixels longer one way: it falls faster by as much."""
    return np.array([0.0, TALLER * seen.cameras[0].intrinsics.fy_px, 0, 0, 0, 0, 0, 0, 0])


def with_lens(camera: HsvCamera, error: np.ndarray[tuple[int], np.dtype[np.float64]]) -> HsvCamera:
    return replace(camera, intrinsics=camera.intrinsics.with_numbers(camera.intrinsics.numbers + error))


@pytest.fixture(scope="module")
def plain(seen: Observation) -> Estimate:
    return estimate(seen, TANGENTS)


@pytest.fixture(scope="module")
def stated(seen: Observation) -> Estimate:
    """One whose focal length along y is known to a hundredth, and gravity to 0.4 m/s2 along x."""
    error = lens_errors(seen)
    camera = replace(seen.cameras[0], lens_covariance=np.outer(error, error))
    return estimate(replace(seen, cameras=(camera,), gravity_covariance=np.diag([GRAVITY_MS2**2, 0.0, 0.0])), TANGENTS)


def test_the_flight_is_the_same_and_its_error_bars_are_wider(plain: Estimate, stated: Estimate) -> None:
    assert plain.start is not None
    assert stated.start is not None
    np.testing.assert_array_equal(plain.values, stated.values)
    assert "calibration" not in plain.statistics
    assert np.all(np.diag(stated.covariance) >= np.diag(plain.covariance))
    assert "The stated calibration, not the outlines, limits v" in stated.message


def velocities(seen: Observation) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    found = estimate(seen, TANGENTS)
    assert found.status is Status.CONVERGED
    assert found.start is not None
    return np.concatenate([found.start.v_world, found.start.omega_world])


def test_they_are_wider_by_as_much_as_a_wrong_camera_moves_the_estimate(seen: Observation, plain: Estimate) -> None:
    """Measured again with a tenth of a standard deviation either way; what noise makes of that is a part of the noise itself."""
    error, share = lens_errors(seen), 0.1
    camera = seen.cameras[0]
    both = [velocities(replace(seen, cameras=(with_lens(camera, sign * share * error),))) for sign in (1.0, -1.0)]
    expected = np.abs(both[0] - both[1]) / (2.0 * share)
    stated = estimate(replace(seen, cameras=(replace(camera, lens_covariance=np.outer(error, error)),)), TANGENTS)
    assert stated.start is not None
    assert plain.start is not None
    sigma = np.sqrt(np.diag(plain.start.covariance))
    added = np.sqrt(np.diag(stated.start.covariance - plain.start.covariance))
    assert expected[1] > 1.5 * sigma[1]
    np.testing.assert_allclose(added[:3], expected[:3], rtol=0.15)
    assert np.all(np.abs(added - expected)[3:] < 0.5 * sigma[3:])


def test_they_are_wider_by_as_much_as_a_wrong_gravity_moves_the_estimate(seen: Observation, plain: Estimate) -> None:
    """At the start, and in the middle, where the flight knows its own velocity."""
    off = np.array([GRAVITY_MS2, 0.0, 0.0])
    moved = estimate(replace(seen, gravity_world=seen.gravity_world + off), TANGENTS)
    stated = estimate(replace(seen, gravity_covariance=np.outer(off, off)), TANGENTS)
    for with_it, without, there in ((stated.start, plain.start, moved.start), (stated.middle, plain.middle, moved.middle)):
        assert with_it is not None
        assert without is not None
        assert there is not None
        added = np.sqrt((with_it.covariance - without.covariance)[0, 0])
        assert added == pytest.approx(abs(there.v_world[0] - without.v_world[0]), abs=0.02 * np.sqrt(without.covariance[0, 0]))


def larger(seen: Observation, factor: float) -> Observation:
    """The same views of a particle that is larger by a factor, seen from as much farther away."""
    return replace(seen, views=tuple(replace(view, t_cam_particle=factor * view.t_cam_particle) for view in seen.views))


def test_they_are_wider_by_as_much_as_a_larger_particle_moves_the_estimate(seen: Observation, plain: Estimate) -> None:
    """Velocities take the factor, but for what falls: gravity is what it is."""
    sigma, share = 0.05, 0.1
    moved = [velocities(larger(seen, 1.0 + sign * share * sigma)) for sign in (1.0, -1.0)]
    expected = np.abs(moved[0] - moved[1])[:3] / (2.0 * share)
    stated = estimate(replace(seen, sigma_length_scale=sigma), TANGENTS)
    assert plain.start is not None
    assert stated.start is not None
    added = np.sqrt(np.diag(stated.start.covariance - plain.start.covariance)[:3])
    noise = np.sqrt(np.diag(plain.start.covariance)[:3])
    assert np.any(expected > 5.0 * noise)
    np.testing.assert_allclose(added, expected, atol=0.3 * noise.max(), rtol=0.02)


def test_a_flight_without_an_impact_is_widened_as_a_free_one(seen: Observation, monkeypatch: pytest.MonkeyPatch) -> None:
    error = lens_errors(seen)
    stated = replace(seen, cameras=(replace(seen.cameras[0], lens_covariance=np.outer(error, error)),), gravity_covariance=0.1 * np.eye(3))
    found: list[Any] = []
    refine = tasks.refine
    monkeypatch.setattr(tasks, "refine", lambda *given: found.append(refine(*given)) or found[-1])
    estimate(stated, TANGENTS)
    (refined,) = found
    free, whole = (
        calibration_share(flight, refined.at, refined.inverse, stated) for flight in (refined.flight, PiecewiseFlight(refined.flight, ()))
    )
    assert free is not None
    assert whole is not None
    scale = np.sqrt(np.diag(refined.covariance))[:, None]
    np.testing.assert_allclose(whole.parameters / scale, free.parameters / scale, rtol=5e-3, atol=0.02)
    np.testing.assert_allclose(widened(refined, free).covariance, refined.covariance + free.parameters @ free.parameters.T)
    cameras = tuple(replace(camera, lens_covariance=None) for camera in refined.sightings.cameras)
    unstated = replace(refined.at, task=replace(refined.at.task, sightings=replace(refined.sightings, cameras=cameras)))
    assert calibration_share(refined.flight, unstated, refined.inverse, seen) is None


def written(seen: Observation, folder: Path) -> Path:
    write_observation(seen, folder)
    return folder


def test_it_is_written_and_read(seen: Observation, tmp_path_factory: pytest.TempPathFactory) -> None:
    folder = tmp_path_factory.mktemp("stated")
    spread = np.diag(np.arange(1.0, 10.0))
    told = replace(
        seen, cameras=(replace(seen.cameras[0], lens_covariance=spread),), gravity_covariance=np.eye(3), sigma_length_scale=0.002
    )
    write_observation(told, folder)
    back = read_observation(folder)
    assert back.cameras[0].lens_covariance is not None
    assert back.gravity_covariance is not None
    np.testing.assert_array_equal(back.cameras[0].lens_covariance, spread)
    np.testing.assert_array_equal(back.gravity_covariance, np.eye(3))
    assert back.sigma_length_scale == told.sigma_length_scale
    assert read_observation(written(seen, tmp_path_factory.mktemp("unstated"))).sigma_length_scale is None


def test_what_is_no_covariance_is_refused(seen: Observation, tmp_path_factory: pytest.TempPathFactory) -> None:
    folder = tmp_path_factory.mktemp("refused")
    told = replace(seen, gravity_covariance=np.diag([1.0, -1.0, 1.0]))
    with pytest.raises(InputError, match=r"gravity_covariance: expected a covariance"):
        write_observation(told, folder)
    assert not (folder / "observation.json").exists()


@pytest.mark.parametrize(
    ("spread", "said"),
    [
        (np.array([[1.0, 5.0], [5.0, 1.0]]), "expected a covariance"),
        (np.array([[0.0, 1.0], [1.0, 1.0]]), "expected a covariance"),
        (np.diag([1e12, 1.0]), r"expected focal lengths known to less than themselves, got 6000 ± 1e\+06 px"),
    ],
    ids=["indefinite", "varies with what does not vary", "larger than the focal length"],
)
def test_lenses_that_nobody_can_have_measured_are_refused(seen: Observation, tmp_path: Path, spread: np.ndarray, said: str) -> None:  # type: ignore[type-arg]
    covariance = np.zeros((9, 9))
    covariance[:2, :2] = spread
    with pytest.raises(InputError, match=f"lens_covariance: {said}"):
        write_observation(replace(seen, cameras=(replace(seen.cameras[0], lens_covariance=covariance),)), tmp_path)


def test_a_singular_covariance_rounded_to_six_digits_is_one(seen: Observation, tmp_path: Path) -> None:
    error = np.array([1.0, 1.0 / 3.0, 0.7, 0.1, 1e-3, 1e-2, 1e-4, 1e-5, 17.3])
    rounded = np.vectorize(lambda value: float(f"{value:.6g}"))(np.outer(error, error))
    write_observation(replace(seen, cameras=(replace(seen.cameras[0], lens_covariance=rounded),)), tmp_path)


def test_error_bars_without_it_say_so(seen: Observation, plain: Estimate, stated: Estimate, monkeypatch: pytest.MonkeyPatch) -> None:
    """Pairs and measured focal lengths do not consider a calibration: ``plain`` stands for one of those."""
    told = replace(seen, cameras=(replace(seen.cameras[0], lens_covariance=np.eye(9)),))
    exact = replace(seen, cameras=(replace(seen.cameras[0], lens_covariance=np.zeros((9, 9))),), gravity_covariance=np.zeros((3, 3)))
    assert NOT_CONSIDERED in with_what_is_missing(plain, told).message
    for estimate_, observation in ((plain, seen), (plain, exact), (stated, told)):
        assert with_what_is_missing(estimate_, observation) is estimate_
    assert NOT_CONSIDERED not in with_what_is_missing(replace(plain, middle=None), told).message
    monkeypatch.setattr(measuring, "_measured", lambda *_: plain)
    assert NOT_CONSIDERED in measuring.measure(told, TANGENTS).message
