"""The quick gate: the committed baseline holds for the estimator as it is, on its first sequences made anew."""

from pathlib import Path

import numpy as np

from datasets.recipes.toml_files import load_recipe
from datasets.scoring.gate import compare, load_baseline
from datasets.scoring.score import score
from estimator.configuration import Configuration
from estimator.pipeline import estimate
from synth.sequence import build_silhouette_sequence

BASELINES = Path(__file__).resolve().parents[2] / "baselines"


def test_the_estimator_is_not_worse_than_its_baseline() -> None:
    recipe = load_recipe(BASELINES / "quick.toml", ())
    rows = []
    for index in range(recipe.sequences):
        observation, truth = build_silhouette_sequence(recipe, index)
        rows.append(score(estimate(observation, Configuration()), truth))
    result = compare(load_baseline(BASELINES / "quick.json"), rows, rng=np.random.default_rng(0))
    assert not result.worse, result.sentences
