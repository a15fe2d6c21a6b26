"""What is searched for at the fit without an effect is searched for again once the effect is in the model."""

from dataclasses import replace
from functools import cache

import numpy as np
from estimator.diagnosis.extending import fit_extended

from datasets.recipes.recipe import EffectRecipe
from estimator.configuration import Configuration
from estimator.diagnosis.adding import base_fit
from estimator.diagnosis.score_tests import Candidates, ScoreTest, score_tests
from estimator.effects.registry import MODELS
from estimator.fitting.campaign import Campaign, CampaignFit
from estimator.registration import register
from synth.sequence import build_silhouette_sequence
from tests.estimator.small_campaign import recipe

AFTER, COUNT = (9, 18), (2, 1)


@cache
def looked_at() -> tuple[Campaign, CampaignFit, ScoreTest]:
    """A campaign with a gap in each of its two recordings, its base fit, and the first look at gaps."""
    made = recipe(EffectRecipe("dropped_frames", {"count": COUNT, "after_frame": AFTER}))
    found = register([build_silhouette_sequence(made, i)[0] for i in range(2)], Configuration())
    fit = base_fit(found.campaign, found.start)
    (test,), _ = score_tests(found.campaign, fit, Candidates.of(found.campaign, [MODELS["dropped_frames"]]))
    return found.campaign, fit, test


def found_gaps(test: ScoreTest) -> list[tuple[int, int]]:
    """Frame before the gap and frames missing, of each sequence."""
    campaign, fit, _ = looked_at()
    new = fit_extended(campaign, fit, test)
    return [(round(theta[-1]), round(theta[-2])) for theta in new.state.theta]


def test_a_gap_that_the_first_look_missed_is_found() -> None:
    test = looked_at()[2]
    column = next(i for i, c in enumerate(test.columns) if c.sequence == 1)
    nothing = np.where(np.arange(len(test.theta)) == column, 0.0, test.theta)
    missed = replace(test, starts={**test.starts, 1: np.array([0.0, 24.0])}, theta=nothing)
    assert found_gaps(missed) == list(zip(AFTER, COUNT, strict=True))


def test_gaps_that_are_right_stay() -> None:
    assert found_gaps(looked_at()[2]) == list(zip(AFTER, COUNT, strict=True))
