"""``converged`` says whether the residuals are noise."""

import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from datasets.estimate import Status
from datasets.observation import Observation
from datasets.recipes.recipe import Recipe
from datasets.recipes.toml_files import recipe_from_dict
from datasets.scoring.score import score
from estimator.data.configuration import Configuration
from estimator.fitting.adequacy import AXES, ORDERS, Misfit, misfit_of, slow_errors, slow_scales, widened
from estimator.measure import measure
from estimator.motion.flight import N_PARAMETERS, V, X
from estimator.motion.rigid_body import rotation_matrices
from synth.sequence import build_silhouette_sequence

Array = NDArray[np.float64]
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


def test_a_clean_sequence_is_adequate(clean: Observation) -> None:
    estimate = measure(clean, Configuration())
    assert estimate.status is Status.CONVERGED
    assert estimate.statistics["adequacy"]["adequate"]
    assert estimate.message == "converged."


def test_slow_errors_are_none_of_the_flight() -> None:
    basis = slow_errors(np.linspace(0.0, 0.02, 41))
    assert basis.shape == (41, 6, 18)
    line = np.column_stack([np.ones(41), np.linspace(0.0, 0.02, 41)])
    left = basis[:, 0, :3] - line @ np.linalg.lstsq(line, basis[:, 0, :3], rcond=None)[0]
    np.testing.assert_allclose(np.linalg.norm(left, axis=0), np.linalg.norm(basis[:, 0, :3], axis=0), rtol=0.02)
    assert not basis[:, 1, :3].any()


TIMES_S = np.linspace(0.0, 0.02, 41)


def misfit_about(step: Array) -> Misfit:
    found = misfit_of(step, np.eye(len(AXES) * len(ORDERS)), slow_errors(TIMES_S), 1.0)
    assert found is not None
    return found


def test_what_a_slow_error_moves_the_flight_by_is_in_its_covariance() -> None:
    moved = np.random.default_rng(1).normal(size=N_PARAMETERS)
    b = np.zeros(len(AXES) * len(ORDERS))
    b[0] = 20.0
    C = widened(np.eye(N_PARAMETERS), misfit_about(np.r_[moved, b]))
    beside = C - np.outer(moved, moved)
    expected = np.ones(N_PARAMETERS)
    expected[[X.start, V.start]] = (10.0 + 400.0) / (10.0 + len(ORDERS))
    np.testing.assert_allclose(beside, np.diag(expected), atol=1e-9)


def test_noise_leaves_the_covariance_as_it_is() -> None:
    step = np.random.default_rng(2).normal(size=N_PARAMETERS + len(AXES) * len(ORDERS))
    np.testing.assert_array_equal(widened(np.eye(N_PARAMETERS), misfit_about(step)), np.eye(N_PARAMETERS))


def test_the_axes_of_the_world_do_not_matter() -> None:
    random = np.random.default_rng(3)
    root = random.normal(size=(3, 3))
    C, R = root @ root.T, rotation_matrices(np.array([[0.5, 0.5, 0.5, 0.5]]))[0] @ rotation_matrices(np.array([[0.6, 0.0, 0.0, 0.8]]))[0]
    b = 5.0 * random.normal(size=(3, len(ORDERS)))
    at, turned = (slow_scales(x.ravel(), np.kron(of, np.eye(len(ORDERS))), range(3)) for x, of in ((b, C), (R @ b, R @ C @ R.T)))
    np.testing.assert_allclose(turned, R @ at @ R.T, rtol=1e-9)
