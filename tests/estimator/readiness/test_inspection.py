"""What is seen of a recording before any fit: odd steps, standing particles, masks, the fall, the promise."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from datasets.observation import Observation
from datasets.recipes.recipe import MotionRecipe, NoiseRecipe, ParticleRecipe, Recipe, RigRecipe
from datasets.vocabulary.camera import HsvCamera, Intrinsics
from datasets.vocabulary.outline import Outline
from estimator.data.configuration import Configuration
from estimator.impacts.impact_search import wobble_of
from estimator.outlines.masks import outline_of_mask
from estimator.outlines.pictures.occupancy import Departure, plain_occupancy
from estimator.outlines.recording import outlines_of
from estimator.outlines.standing import ghost_px
from estimator.particle.particle import Particle, particle_of
from estimator.readiness import Inspection, Promise, depth_of, fall_of, inspect_recording, promise_of
from synth.sequence import build_silhouette_sequence

ANGLES = np.linspace(0.0, 2.0 * np.pi, 40, endpoint=False)
ROUND = 12.0 * np.column_stack([np.cos(ANGLES), np.sin(ANGLES)])
TIMES = np.arange(20) / 4000.0


def seen(centres: NDArray[np.float64], times_s: NDArray[np.float64] | None = TIMES) -> Inspection:
    return inspect_recording([Outline(ROUND + centre) for centre in centres], (640, 480), times_s=times_s, exposure_s=1e-5)


def path(step_px: float) -> NDArray[np.float64]:
    k = np.arange(20.0)
    return np.column_stack([100.0 + step_px * k, 100.0 + 0.02 * k**2])


def test_an_even_path_has_no_odd_step() -> None:
    inspection = seen(path(3.0))
    assert inspection.odd_steps == ()
    assert inspection.step_px == pytest.approx(3.03, abs=0.05)
    assert inspection.bend_px < 1e-6
    assert inspection.smear_px == pytest.approx(3.03 * 4000.0 * 1e-5, abs=2e-3)
    assert np.all(np.isnan(inspection.saturated))


LOST = {
    "a lost picture": (lambda centres: centres[[*range(9), *range(10, 20), 19]][:19], (8, 9), 2.0),
    "a picture that is there twice": (lambda centres: centres[[*range(9), 8, *range(9, 19)]], (8, 9), 0.0),
}


@pytest.mark.parametrize("what", list(LOST))
def test_a_picture_lost_or_there_twice_is_one_odd_step(what: str) -> None:
    change, pair, times = LOST[what]
    centres = change(path(3.0))
    (step,) = seen(centres, TIMES[: len(centres)]).odd_steps
    assert (step.first, step.second) == pair
    assert step.times == pytest.approx(times, abs=0.05)


def test_right_times_make_a_gap_no_odd_step() -> None:
    kept = [*range(9), *range(11, 20)]
    assert seen(path(3.0)[kept], TIMES[kept]).odd_steps == ()
    (step,) = seen(path(3.0)[kept], TIMES[: len(kept)]).odd_steps
    assert step.times == pytest.approx(3.0, abs=0.1)


def test_an_impact_is_no_odd_step() -> None:
    k = np.arange(20.0)
    centres = np.column_stack([100.0 + np.where(k < 10, 4.0 * k, 40.0 + 1.0 * (k - 10)), np.full(20, 100.0)])
    assert seen(centres).odd_steps == ()


def disc(centre: tuple[float, float], *, inside: int = 200, outside: int = 3000, seed: int = 0) -> NDArray[np.uint16]:
    y, x = np.mgrid[:80, :120]
    noise = np.random.default_rng(seed).normal(scale=8.0, size=(80, 120))
    within = np.hypot(x - centre[0], y - centre[1]) < 8.0
    return np.round(np.where(within, inside, outside) + noise).astype(np.uint16)


@pytest.mark.parametrize("levels", [{}, {"inside": 3000, "outside": 200}], ids=["dark particle", "bright particle"])
def test_a_particle_that_stood_still_is_a_ghost_in_the_background(levels: dict[str, int]) -> None:
    flight = [disc((20.0 + 9.0 * k, 40.0), seed=k, **levels) for k in range(10)]
    ghost = ghost_px(disc((20.0, 40.0), seed=99, **levels), flight)
    assert ghost is not None
    np.testing.assert_allclose(ghost, [20.0, 40.0], atol=1.0)
    assert ghost_px(disc((-99.0, 0.0), seed=99, **levels), flight) is None


def test_dust_that_went_is_no_ghost() -> None:
    flight = [disc((20.0 + 9.0 * k, 40.0), seed=k) for k in range(10)]
    background = disc((-99.0, 0.0), seed=99)
    background[60:67, 60:67] = 200
    assert ghost_px(background, flight) is None


def test_a_particle_that_comes_to_rest_is_no_ghost() -> None:
    flight = [disc((20.0 + 9.0 * min(k, 4), 40.0), seed=k) for k in range(12)]
    assert ghost_px(disc((-99.0, 0.0), seed=99), flight) is None


@pytest.mark.parametrize("full", [1, 255, 65535])
def test_a_mask_is_outlined_at_half_of_its_value(full: int) -> None:
    mask = np.zeros((30, 40), np.uint16)
    mask[10:20, 5:25] = full
    mask[2, 2] = full
    points = outline_of_mask(mask).points_px
    np.testing.assert_array_equal(points.min(axis=0), [4.5, 9.5])
    np.testing.assert_array_equal(points.max(axis=0), [24.5, 19.5])
    assert outline_of_mask(np.zeros_like(mask)).empty


def test_a_mask_at_the_pictures_edge_ends_there() -> None:
    mask = np.zeros((30, 40), np.uint16)
    mask[10:20, 30:] = 255
    points = outline_of_mask(mask).points_px
    assert points[:, 0].max() == 39.5
    assert not outlines_of([Outline(points)], Intrinsics(40, 30, 1.0, 1.0, 0.0, 0.0)).used.any()


RECIPE = Recipe(
    seed=3,
    particle=ParticleRecipe(irregularity=0.5, size_mm=(6.0, 6.0)),
    motion=MotionRecipe(frames=40, speed_ms=(0.5, 1.0), spin_rads=(100.0, 150.0)),
    rig=RigRecipe(drops=2),
)
Known = tuple[Observation, Particle]


@pytest.fixture(scope="module")
def known() -> Known:
    observation = build_silhouette_sequence(RECIPE, 0)[0]
    outlines = [Outline(outline.points_px) for outline in observation.view_recording]  # type: ignore[union-attr]
    return observation, particle_of(outlines, observation.views, Configuration(hull_resolution=32, directions=50))


def looked(observation: Observation, *, times: float = 1.0) -> Inspection:
    lens = observation.cameras[0].intrinsics
    return inspect_recording(observation.recordings[0], (lens.width_px, lens.height_px), times_s=times * observation.clock.times_s)


def test_the_depth_is_read_off_the_outlines_area(known: Known) -> None:
    observation, particle = known
    assert depth_of(particle, looked(observation), observation.cameras[0].intrinsics) == pytest.approx(0.6, rel=0.1)


def falling(share: float, rng: np.random.Generator) -> tuple[Inspection, HsvCamera]:
    """The look at a ball that flies 25 ms under ``share`` of gravity."""
    lens = Intrinsics(1024, 1024, 6000.0, 6000.0, 511.5, 511.5)
    times = np.arange(100) / 4000.0
    v = rng.normal(scale=0.5, size=3)
    X = np.array([0.0, 0.0, 0.6]) + np.outer(times - times.mean(), v) + 0.5 * np.outer((times - times.mean()) ** 2, [0, 9.81 * share, 0])
    centres = lens.project(X) + rng.normal(scale=0.02, size=(100, 2))
    inspection = inspect_recording([Outline(ROUND + c) for c in centres], (1024, 1024), times_s=times)
    return inspection, HsvCamera("hsv", lens, np.eye(3), np.zeros(3))


@pytest.mark.parametrize("share", [1.0, 0.01, 4.0, -1.0])
def test_the_fall_says_by_how_much_times_are_wrong(share: float) -> None:
    """Over 20 flights: the share within its own uncertainty, and so the false alarms few."""
    rng = np.random.default_rng(7)
    found = [fall_of(*falling(share, rng), np.array([0.0, 9.81, 0.0]), depth_m=0.6, wobble_m=2e-5) for _ in range(20)]
    z = np.array([(fall.share - share) / fall.sigma for fall in found if fall is not None])
    assert len(z) == 20
    assert np.mean(np.abs(z) < 2.0) >= 0.95
    if share != 1.0:
        assert all(abs(fall.share - 1.0) > 3.0 * fall.sigma for fall in found if fall is not None)


def test_a_drop_on_to_a_plate_is_judged_by_its_longest_flight() -> None:
    rng = np.random.default_rng(3)
    lens = Intrinsics(1024, 1024, 6000.0, 6000.0, 511.5, 511.5)
    times = np.arange(120) / 4000.0
    t = times - times[40]
    fall_m = np.where(t < 0, 0.8 * t, -0.3 * t) + 0.5 * 9.81 * t**2
    centres = lens.project(np.column_stack([0.1 * t, fall_m, np.full(120, 0.6)])) + rng.normal(scale=0.02, size=(120, 2))
    inspection = inspect_recording([Outline(ROUND + c) for c in centres], (1024, 1024), times_s=times)
    assert inspection.odd_steps == ()
    (kink,) = inspection.kinks
    assert kink == pytest.approx(40.0, abs=0.2)
    assert (inspection.free.frame[0], inspection.free.frame[-1]) == (44, 119)
    fall = fall_of(inspection, HsvCamera("hsv", lens, np.eye(3), np.zeros(3)), np.array([0.0, 9.81, 0.0]), depth_m=0.6, wobble_m=2e-5)
    assert fall is not None
    assert abs(fall.share - 1.0) < 2.0 * fall.sigma
    assert fall.sigma < 0.3


def test_gravity_along_the_line_of_sight_is_not_seen() -> None:
    inspection, camera = falling(1.0, np.random.default_rng(0))
    assert fall_of(inspection, camera, np.array([0.0, 0.0, 9.81]), depth_m=0.6, wobble_m=1e-5) is None


def test_the_wobble_is_small_against_the_particle(known: Known) -> None:
    particle = known[1]
    wobble = wobble_of(particle, np.random.default_rng(0))
    assert 0.0 < wobble < 0.05 * particle.extent_m


def promised(observation: Observation, particle: Particle) -> Promise:
    inspection = looked(observation)
    found = promise_of(observation, (inspection.track,), inspection, particle, Configuration())
    assert found is not None
    return found


def changed(change: Callable[[Recipe], Recipe]) -> Observation:
    return build_silhouette_sequence(change(RECIPE), 0)[0]


def test_noisier_and_shorter_recordings_promise_less(known: Known) -> None:
    observation, particle = known
    usual = promised(observation, particle)
    assert usual.depth_m == pytest.approx(0.6, rel=0.1)
    assert np.all(usual.v_ms[:2] < 0.01)
    assert usual.v_ms[2] > 3.0 * usual.v_ms[:2].max()
    noisy = promised(changed(lambda recipe: Recipe(**{**vars(recipe), "noise": NoiseRecipe(hsv_boundary_px=0.4)})), particle)
    assert np.median(noisy.omega_rads / usual.omega_rads) > 1.5
    motion = MotionRecipe(**{**vars(RECIPE.motion), "frames": 20})
    short = promised(changed(lambda recipe: Recipe(**{**vars(recipe), "motion": motion})), particle)
    assert np.median(short.v_ms / usual.v_ms) > 1.5


def test_too_little_seen_promises_nothing(known: Known) -> None:
    observation, particle = known
    few = Observation(**{**vars(observation), "recordings": (observation.recordings[0][:5],)})  # type: ignore[index]
    inspection = inspect_recording(few.recordings[0], (1024, 1024), times_s=observation.clock.times_s[:5])
    assert promise_of(few, (inspection.track,), inspection, particle, Configuration()) is None


def test_a_bubble_as_bright_inside_as_its_background_has_no_level_of_its_own() -> None:
    y, x = np.mgrid[:60, :60]
    radius = np.hypot(x - 30, y - 30)
    ring = np.where(np.abs(radius - 18) < 2, 900.0, 0.0).astype(np.float32)
    occupancy = plain_occupancy(Departure(ring, 5.0), radius < 20)
    assert np.all(np.isfinite(occupancy))


def test_the_promise_has_the_stated_calibration_in_it(known: Known) -> None:
    """A focal length along y known to a hundredth makes v and omega uncertain by as much, whatever outlines say."""
    observation, particle = known
    camera = observation.cameras[0]

    def with_sigma(share: float) -> Observation:
        off = np.zeros(9)
        off[1] = share * camera.intrinsics.fy_px
        return replace(observation, cameras=(replace(camera, lens_covariance=np.outer(off, off)),))

    usual, sure, unsure = promised(observation, particle), promised(with_sigma(1e-9), particle), promised(with_sigma(0.01), particle)
    np.testing.assert_allclose(sure.v_ms, usual.v_ms, rtol=1e-6)
    assert np.all(unsure.v_ms[:2] > 1.3 * usual.v_ms[:2])
    assert unsure.v_ms[2] > usual.v_ms[2]
    assert np.all(unsure.omega_rads > 1.1 * usual.omega_rads)
