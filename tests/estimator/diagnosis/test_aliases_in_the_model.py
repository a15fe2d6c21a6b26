"""An effect whose alias is in the model already leaves rounding only, and rounding is no evidence."""

from functools import cache

import numpy as np
import pytest

from estimator.diagnosis import score_tests as module
from estimator.diagnosis.adding import with_effect
from estimator.diagnosis.ranking import whitener
from estimator.diagnosis.score_tests import Candidates, EfficientScores, arranged, candidate_equations, efficient_scores
from estimator.effects.choosing import catalogue
from estimator.fitting.campaign import Campaign, CampaignFit
from tests.estimator.small_campaign import fitted, registered


@cache
def with_frame_rate() -> tuple[Campaign, CampaignFit]:
    return with_effect(registered().campaign, fitted(), catalogue()["frame_rate"])


def scores_beside_frame_rate() -> EfficientScores:
    campaign, fit = with_frame_rate()
    candidates = Candidates.of(campaign, [catalogue()[k] for k in ("length_scale", "gravity", "linear_drag")])
    return efficient_scores(campaign, fit, arranged(campaign, candidate_equations(campaign, fit, candidates), fit.model, candidates))[0]


def left(scores: EfficientScores) -> float:
    """All scores together, chi-squared where nothing is missing."""
    return float(np.sum((whitener(scores.M) @ scores.g) ** 2))


def test_what_is_left_of_an_alias_does_not_count() -> None:
    scores = scores_beside_frame_rate()
    assert np.all(np.diag(scores.M) > module.LEAST_NOISE * np.diag(scores.H))
    assert {c.effect for c in scores.columns} >= {1, 2}
    assert left(scores) < 100.0


def test_a_score_without_noise_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    plain, noise = len(scores_beside_frame_rate().columns), module._noise

    def first_without_noise(*given: object) -> np.ndarray:
        M = noise(*given)
        M[0, 0] = -1e-20
        return M

    monkeypatch.setattr(module, "_noise", first_without_noise)
    scores = scores_beside_frame_rate()
    assert len(scores.columns) == plain - 1
    assert left(scores) < 100.0
