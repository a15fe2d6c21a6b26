"""A fitted model with one effect more: where its fit starts."""

import numpy as np

from datasets.vocabulary.effects import Scope
from estimator.diagnosis.score_tests import ScoreTest
from estimator.effects.model import Model
from estimator.fitting.campaign import CampaignFit, CampaignState


def extended(fit: CampaignFit, test: ScoreTest) -> tuple[Model, CampaignState]:
    """The model with the tested effect, and where its fit starts: its best starts moved by the one-step values."""
    model = Model((*fit.model.effects, test.effect))
    own = test.effect.entry.scope is Scope.SEQUENCE
    thetas = []
    for number, theta in enumerate(fit.state.theta):
        key = number if own else None
        value = test.starts.get(key, next(iter(test.starts.values()))).copy()
        for column, size in zip(test.columns, test.theta[: len(test.columns)], strict=True):
            if column.sequence == key:
                value[column.parameter] += size
        thetas.append(np.concatenate([theta, test.effect.first_guess(value)]))
    return model, CampaignState(fit.state.flights, tuple(thetas))
