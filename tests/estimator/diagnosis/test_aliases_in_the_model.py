"""An effect whose alias is in the model already leaves rounding only, and rounding is no evidence."""

from functools import cache

import numpy as np
import pytest

from estimator.diagnosis import score_tests as module
from estimator.diagnosis.adding import with_effect
from estimator.diagnosis.score_tests import Candidates, Column, EfficientScores, arranged, candidate_equations, efficient_scores
from estimator.effects.choosing import catalogue
from estimator.fitting.campaigns.campaign import Campaign, CampaignFit
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
    return float(np.sum((scores.whitener @ scores.g) ** 2))


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


def test_scores_that_say_the_same_count_once() -> None:
    """Two columns that are alike hold one number: a chi-squared of their scores has one degree of freedom."""
    rng = np.random.default_rng(3)
    A = rng.standard_normal((6, 3))
    A = np.column_stack([A, A[:, 0]])
    M = A.T @ A
    columns = tuple(Column(0, 0, i, None) for i in range(4))
    scores = EfficientScores(columns, A.T @ rng.standard_normal(6), M, M)
    white = scores.whitener
    assert white.shape == (3, 4)
    assert white @ M @ white.T == pytest.approx(np.eye(3), abs=1e-9)
    assert scores.information == pytest.approx(M, abs=1e-9)
