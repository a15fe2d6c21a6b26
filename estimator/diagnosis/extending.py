"""A fitted model with more effects: where its fit starts, and a second look at what is searched for rather than fitted.

The place of a gap in a recording is found by trying all places at the fit without the effect. Where gaps in several sequences and all
that they share are off together, that look may miss one; once the others are in the model it is taken again.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from datasets.vocabulary.effects import Scope
from estimator.diagnosis.score_tests import Candidates, ScoreTest, score_tests
from estimator.effects.model import Model
from estimator.fitting.campaign import Campaign, CampaignFit, CampaignState, cost_like, fit_campaign
from estimator.motion.rigid_body import RanAway

ALPHA = 1e-3
"""Corrected p-value of a sequence's test below which its place is moved, if that lowers the cost."""
ROUNDS = 3
PROMISE = 0.25
"""Of the fall of the cost that a test lets expect: a fit that has less found another minimum."""
SHARES = (1.0, 0.0)
"""Of one-step values at which a fit starts; an effect that leaves a larger cost than no effect at all was not found from there."""


def extended(fit: CampaignFit, *tests: ScoreTest, share: float = 1.0) -> tuple[Model, CampaignState]:
    """The model with the tested effects, and where its fit starts: their best starts moved by a ``share`` of the one-step values."""
    model = Model((*fit.model.effects, *(test.effect for test in tests)))
    thetas = [np.concatenate([theta, *(_first(test, i, share) for test in tests)]) for i, theta in enumerate(fit.state.theta)]
    return model, CampaignState(fit.state.flights, tuple(thetas))


def fit_extended(campaign: Campaign, fit: CampaignFit, *tests: ScoreTest) -> CampaignFit:
    """The fit with the tested effects, whose places are searched for again.

    A step that led astray, to a larger cost or to one that fell by much less than the tests promise, is taken again, shorter; the least
    cost counts, or the last one where none is less than before.
    """
    promised = PROMISE * 0.5 * max(test.explained for test in tests)
    found: list[tuple[float, CampaignFit]] = []
    for share in SHARES:
        model, start = extended(fit, *tests, share=share)
        try:
            new = fit_campaign(campaign, start, model)
        except RanAway:
            if share == SHARES[-1] and not found:
                raise
            continue
        found.append((cost_like(campaign, new, fit), new))
        if found[-1][0] <= fit.cost - promised:
            break
    lower = [each for each in found if each[0] <= fit.cost]
    new = min(lower, key=lambda each: each[0])[1] if lower else found[-1][1]
    model = new.model
    for number in range(len(fit.model.effects), len(model.effects)):
        effect = model.effects[number]
        if effect.entry.scope is Scope.SEQUENCE and set(effect.entry.searched) & set(effect.frozen):
            new = _searched_again(campaign, new, number)
    return new


def _searched_again(campaign: Campaign, fit: CampaignFit, number: int) -> CampaignFit:
    """The fit with effect ``number`` moved, in one sequence after the other, to where another one like it would explain most."""
    for _ in range(ROUNDS):
        (test,), _ = score_tests(campaign, fit, Candidates.of(campaign, (fit.model.effects[number],)))
        before = fit.cost
        for sequence in _worth_moving(test):
            thetas = [theta.copy() for theta in fit.state.theta]
            thetas[sequence][fit.model.slices[number]] = _first(test, sequence)
            moved = fit_campaign(campaign, CampaignState(fit.state.flights, tuple(thetas)), fit.model)
            fit = moved if moved.cost < fit.cost else fit
        if fit.cost == before:
            break
    return fit


def _worth_moving(test: ScoreTest) -> list[int]:
    """Sequences in which one more effect like the tested one is missing, the clearest first."""
    variance = np.diag(test.covariance)
    found = {
        column.sequence: value**2 / variance[i]
        for i, (column, value) in enumerate(zip(test.columns, test.theta[: len(test.columns)], strict=True))
        if column.sequence is not None and variance[i] > 0.0
    }
    level = chi2.isf(ALPHA / len(test.columns), 1) if test.columns else np.inf
    return sorted((sequence for sequence in found if found[sequence] > level), key=lambda sequence: -found[sequence])


def _first(test: ScoreTest, sequence: int, share: float = 1.0) -> NDArray[np.float64]:
    """Parameters of a tested effect in a sequence, at a ``share`` of the one-step values."""
    key = test.owner(sequence)
    value = test.starts.get(key, next(iter(test.starts.values()))).copy()
    for column, size in zip(test.columns, test.theta[: len(test.columns)], strict=True):
        if column.sequence == key:
            value[column.parameter] += share * size
    return test.effect.first_guess(value)
