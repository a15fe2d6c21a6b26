"""A fitted model with more effects: where its fit starts."""

import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.effects import Scope
from estimator.diagnosis.score_tests import ScoreTest
from estimator.effects.model import Model
from estimator.fitting.campaign import CampaignFit, CampaignState


def extended(fit: CampaignFit, *tests: ScoreTest) -> tuple[Model, CampaignState]:
    """The model with the tested effects, and where its fit starts: their best starts moved by the one-step values."""
    model = Model((*fit.model.effects, *(test.effect for test in tests)))
    thetas = [np.concatenate([theta, *(_first(test, i) for test in tests)]) for i, theta in enumerate(fit.state.theta)]
    return model, CampaignState(fit.state.flights, tuple(thetas))


def _first(test: ScoreTest, sequence: int) -> NDArray[np.float64]:
    """Parameters of a tested effect in a sequence."""
    key = sequence if test.effect.entry.scope is Scope.SEQUENCE else None
    value = test.starts.get(key, next(iter(test.starts.values()))).copy()
    for column, size in zip(test.columns, test.theta[: len(test.columns)], strict=True):
        if column.sequence == key:
            value[column.parameter] += size
    return test.effect.first_guess(value)
