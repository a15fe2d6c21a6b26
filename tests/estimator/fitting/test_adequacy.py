"""``converged`` says whether the residuals are noise."""

import tomllib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from datasets.estimate import Status
from datasets.observation import Observation
from datasets.recipes.recipe import DropperRecipe, ParticleRecipe, PlateRecipe, Recipe
from datasets.recipes.toml_files import recipe_from_dict
from datasets.scoring.impacts import score_impacts
from datasets.scoring.score import score
from datasets.vocabulary.body import Body
from estimator.data.configuration import Configuration
from estimator.fitting.adequacy import Misfit, drifting, misfit_of, slow_scales, widened, with_slow_errors
from estimator.fitting.refinement import Refined
from estimator.measure import measure
from estimator.motion.flight import LAYOUT, N_PARAMETERS, Flight, V, X
from estimator.motion.piecewise import Bounce, PiecewiseFlight
from estimator.motion.rigid_body import rotation_matrices
from estimator.motion.slow_errors import AXES, ORDERS, SlowErrors, slow_errors
from synth.sequence import build_silhouette_sequence

pytestmark = pytest.mark.long

Array = NDArray[np.float64]
TIMES_S = np.linspace(0.0, 0.02, 41)
TUTORIAL = Path(__file__).parents[3] / "docs" / "tutorial_files" / "drag.toml"


def tutorial() -> Recipe:
    return recipe_from_dict(tomllib.loads(TUTORIAL.read_text(encoding="utf-8")), "drag.toml")


@pytest.fixture(scope="module")
def clean() -> Observation:
    return build_silhouette_sequence(replace(tutorial(), effects=()), 0)[0]


def test_the_drag_of_the_tutorial_is_missed_and_error_bars_contain_it() -> None:
    """They were too narrow by 13 standard deviations of one component."""
    observation, truth = build_silhouette_sequence(tutorial(), 1)
    estimate = measure(observation, Configuration())
    assert estimate.status is Status.CONVERGED
    assert not estimate.statistics["adequacy"]["adequate"]
    assert "the model misses something" in estimate.message
    row = score(estimate, truth)
    assert max(abs(row[f"middle_pull_{name}"]) for name in ("vx", "vy", "vz", "wx", "wy", "wz")) < 4.0


def test_a_drag_is_missed_in_a_drop_that_meets_a_plate() -> None:
    """Such estimates were converged without a word, v before the impact off by up to 15 standard deviations."""
    drag = replace(tutorial().effects[0], values={"per_length": 4.0})
    particle, fall = ParticleRecipe(family="cut_stone", size_mm=(4.0, 7.0)), DropperRecipe(runs=1, height_mm=(60.0, 150.0))
    recipe = Recipe(seed=4242, sequences=3, particle=particle, plate=PlateRecipe(tilt_deg=(10.0, 30.0)), dropper=fall, effects=(drag,))
    observation, truth = build_silhouette_sequence(recipe, 2)
    estimate = measure(observation, Configuration())
    assert estimate.status is Status.CONVERGED
    assert not estimate.statistics["adequacy"]["adequate"]
    assert "The model misses something" in estimate.message
    (row,) = score_impacts(estimate, truth)
    assert max(abs(value) for name, value in row.items() if "pull" in name) < 3.0  # 3.5 without what the slow errors are in velocity


def test_a_clean_sequence_is_adequate(clean: Observation) -> None:
    estimate = measure(clean, Configuration())
    assert estimate.status is Status.CONVERGED
    assert estimate.statistics["adequacy"]["adequate"]
    assert estimate.message == "converged."


def flight(times_s: Array) -> Flight:
    body = Body(np.zeros(3), np.eye(3), np.ones(3))
    still = np.zeros(3)
    return Flight(times_s[0], still, np.array([0.0, 0.0, 0.0, 1.0]), still, still, body, still, np.zeros(5), 0.0, still)


def bouncing(times_s: Array, impacts_s: Sequence[float]) -> PiecewiseFlight:
    return PiecewiseFlight(flight(times_s), tuple(Bounce(time_s, np.zeros(3), np.zeros(3)) for time_s in impacts_s))


def test_slow_errors_are_none_of_the_flight() -> None:
    basis = slow_errors(TIMES_S, flight(TIMES_S)).basis
    assert basis.shape == (41, 6, 18)
    line = np.column_stack([np.ones(41), np.linspace(0.0, 0.02, 41)])
    left = basis[:, 0, :3] - line @ np.linalg.lstsq(line, basis[:, 0, :3], rcond=None)[0]
    np.testing.assert_allclose(np.linalg.norm(left, axis=0), np.linalg.norm(basis[:, 0, :3], axis=0), rtol=0.02)
    assert not basis[:, 1, :3].any()


def test_segments_of_few_frames_have_no_slow_errors() -> None:
    """Two impacts with a frame between them: the others still have theirs, each of its own frames."""
    slow = slow_errors(TIMES_S, bouncing(TIMES_S, (0.0101, 0.0109)))
    assert slow.segments == (0, 2)
    assert slow.basis.shape == (41, 6, 36)
    assert not slow.basis[20:, :, :18].any(axis=(1, 2))[2:].any()
    assert slow.basis[23:, 0, 18:21].any()
    assert not slow_errors(TIMES_S[:4], flight(TIMES_S)).segments


def misfit_about(moved: Array, b: Array, motion: Flight | PiecewiseFlight) -> Misfit:
    """Coefficients of covariance one that move the motion by what their inverse says."""
    p, k = motion.layout.size, len(b)
    inverse = np.eye(p + k)
    inverse[:p, p:] = np.outer(moved, b) / (b @ b)
    found = misfit_of((b, np.eye(k)), inverse, slow_errors(TIMES_S, motion), motion.layout, noise_ratio=1.0)
    assert found is not None
    return found


def coefficients(motion: Flight | PiecewiseFlight, at: int) -> Array:
    b = np.zeros(slow_errors(TIMES_S, motion).basis.shape[2])
    b[at] = 20.0
    return b


def test_what_a_slow_error_moves_the_flight_by_is_in_its_covariance() -> None:
    moved, motion = np.random.default_rng(1).normal(size=N_PARAMETERS), flight(TIMES_S)
    tested = misfit_about(moved, coefficients(motion, 0), motion)
    np.testing.assert_allclose(tested.moved, moved)
    beside = with_slow_errors(np.eye(N_PARAMETERS), LAYOUT, tested) - np.outer(moved, moved)
    expected = np.ones(N_PARAMETERS)
    expected[[X.start, V.start]] = (10.0 + 400.0) / (10.0 + len(ORDERS))
    np.testing.assert_allclose(beside, np.diag(expected), atol=1e-9)


def test_what_shows_after_an_impact_is_of_the_velocities_after_it() -> None:
    """And neither of those before it, nor is anything else of the segment in which nothing shows."""
    motion = bouncing(TIMES_S, (0.0101,))
    layout, moved = motion.layout, np.zeros(motion.layout.size)
    moved[layout["impact_1_v"]], moved[layout["v"]] = 3.0, 0.001
    tested = misfit_about(moved, coefficients(motion, 18 + 3), motion)
    assert (tested.segment, AXES[tested.component]) == (1, "path along y")
    np.testing.assert_allclose(tested.velocity_shift, [3.0, 3.0, 3.0, 0.0, 0.0, 0.0])
    variance = np.diag(with_slow_errors(np.eye(layout.size), layout, replace(tested, moved=np.zeros(layout.size))))
    assert np.flatnonzero(variance > 1.0).tolist() == [layout["impact_1_v"].start + 1]
    assert drifting(tested, 0.0101, 1, np.zeros(3))[1, 1] > 0.0
    assert not drifting(tested, 0.0101, 0, np.zeros(3)).any()


def test_noise_leaves_a_flight_as_it_is() -> None:
    refined = cast(Refined[Flight], SimpleNamespace(covariance=np.eye(N_PARAMETERS), flight=flight(TIMES_S)))
    b = np.random.default_rng(2).normal(size=18)
    assert widened(refined, misfit_about(np.ones(N_PARAMETERS), b, flight(TIMES_S))) is refined
    assert widened(refined, None) is refined


def test_what_slow_errors_are_in_velocity_is_how_much_faster_the_moved_body_flies() -> None:
    """Of a body that spins: turned by phi(t) more, it turns by phi x omega more beside dphi/dt."""
    slow, b = slow_errors(TIMES_S, flight(TIMES_S)), 1e-5 * np.random.default_rng(4).normal(size=18)
    omega = np.array([150.0, -40.0, 90.0])
    h, at = 1e-6, TIMES_S[20] + 1e-4

    def turned(time_s: float) -> Rotation:
        there = slow_errors(np.sort([*TIMES_S, time_s]), flight(TIMES_S))
        phi = (there.basis @ b)[np.searchsorted(TIMES_S, time_s), 3:]
        return Rotation.from_rotvec(phi) * Rotation.from_rotvec(omega * time_s)

    faster = (turned(at + h) * turned(at - h).inv()).as_rotvec() / (2.0 * h) - omega
    np.testing.assert_allclose(slow.velocities(b, at, 0, omega)[3:], faster, rtol=1e-3, atol=1e-6)


def test_polynomials_go_no_further_than_the_frames() -> None:
    slow, b = slow_errors(TIMES_S, flight(TIMES_S)), np.ones(18)
    np.testing.assert_array_equal(slow.velocities(b, 0.03, 0, np.zeros(3)), slow.velocities(b, TIMES_S[-1], 0, np.zeros(3)))


def test_the_axes_of_the_world_do_not_matter() -> None:
    random = np.random.default_rng(3)
    root = random.normal(size=(3, 3))
    C, R = root @ root.T, rotation_matrices(np.array([[0.5, 0.5, 0.5, 0.5]]))[0] @ rotation_matrices(np.array([[0.6, 0.0, 0.0, 0.8]]))[0]
    b = 5.0 * random.normal(size=(3, len(ORDERS)))
    alone = SlowErrors(np.zeros((0, 6, 9)), (0,), ((0.0, 1.0),))
    at, turned = (
        slow_scales((x.ravel(), np.kron(of, np.eye(len(ORDERS)))), alone, range(3), 0) for x, of in ((b, C), (R @ b, R @ C @ R.T))
    )
    np.testing.assert_allclose(turned, R @ at @ R.T, rtol=1e-9)
