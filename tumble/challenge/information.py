"""What one campaign knows of the size of an effect: the inverse of the covariance of the effect's one-step values."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.effects import PICTURED
from estimator.diagnosis.diagnose import ALPHA
from estimator.diagnosis.score_tests import ScoreTest
from estimator.effects.catalogue.optics.defocus_growth import SMALLEST
from estimator.fitting.campaigns.campaign import Campaign, CampaignFit
from estimator.fitting.stable_inverse import stable_inverse
from estimator.likelihood.time_shifts import jitter_found_with
from tumble.challenge.limits import noncentrality

Array = NDArray[np.float64]
POWERS = {"defocus_growth": 2, "trigger_jitter": 2}
"""Effects whose pictures change with the square of their size."""
FOUND = 0.95


def information_of(test: ScoreTest) -> Array:
    """Information (q, q) on the sizes of an effect, to the power of ``POWERS``; of the average sequence where each has sizes of its own."""
    entry = test.effect.entry
    wanted = [entry.names.index(name) for name in entry.sizes]
    full = stable_inverse(test.covariance)
    blocks = []
    for sequence in sorted({c.sequence for c in test.columns}, key=lambda s: -1 if s is None else s):
        block = np.zeros((len(wanted), len(wanted)))
        rows = [(i, wanted.index(c.parameter)) for i, c in enumerate(test.columns) if c.sequence == sequence and c.parameter in wanted]
        for i, a in rows:
            for j, b in rows:
                block[a, b] = full[i, j]
        blocks.append(block)
    return np.asarray(np.mean(blocks, axis=0)) * _unit_change(entry.key)


def _unit_change(key: str) -> float:
    """A blur's linear value stands for its square over twice the blur at which the slope was taken."""
    return (2.0 * SMALLEST) ** -2 if key == "defocus_growth" else 1.0


def jitter_information(campaign: Campaign, fit: CampaignFit) -> Array:
    """Information (1, 1) on the square of the standard deviation of the frames' times (s^-4), as the test has it.

    A weighted mean of squares has heavier tails than what the table's effects are tested by, and spreads the wider the more jitter there
    is: kept is the information that a table needs to have the test's own limit at 95%.
    """
    shifts = campaign.time_shifts(fit.equations)
    level = ALPHA / len(PICTURED)
    return np.array([[noncentrality(level, 1, FOUND) / jitter_found_with(shifts, level, FOUND) ** 4]])


def all_information(campaign: Campaign, fit: CampaignFit, tests: Sequence[ScoreTest]) -> dict[str, Array]:
    """Information on every effect of the catalogue."""
    found = {test.effect.entry.key: information_of(test) for test in tests if test.columns}
    found["trigger_jitter"] = jitter_information(campaign, fit)
    return {key: found[key] for key in PICTURED if key in found}
