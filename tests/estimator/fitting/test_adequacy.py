"""``converged`` says whether the residuals are noise."""

import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from datasets.estimate import Status
from datasets.observation import Observation
from datasets.recipes.recipe import Recipe
from datasets.recipes.toml_files import recipe_from_dict
from estimator.data.configuration import Configuration
from estimator.fitting.adequacy import slow_errors
from estimator.measure import measure
from synth.sequence import build_silhouette_sequence

TUTORIAL = Path(__file__).parents[3] / "docs" / "tutorial_files" / "drag.toml"


def tutorial() -> Recipe:
    return recipe_from_dict(tomllib.loads(TUTORIAL.read_text(encoding="utf-8")), "drag.toml")


@pytest.fixture(scope="module")
def clean() -> Observation:
    return build_silhouette_sequence(replace(tutorial(), effects=()), 0)[0]


def test_the_drag_of_the_tutorial_is_missed() -> None:
    estimate = measure(build_silhouette_sequence(tutorial(), 1)[0], Configuration())
    assert estimate.status is Status.CONVERGED
    assert not estimate.statistics["adequacy"]["adequate"]
    assert "the model misses something" in estimate.message


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
