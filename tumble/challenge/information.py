"""What one campaign knows of the size of an effect: the inverse of the covariance of the effect's one-step values."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.effects import EFFECTS, EffectEntry, Parameter, Scope, Stage
from estimator.diagnosis.score_tests import ScoreTest
from estimator.effects.defocus_growth import SMALLEST
from estimator.effects.link import EffectModel, Setting
from estimator.effects.model import Model
from estimator.fitting.campaign import Campaign, CampaignFit, CampaignState, sequence_equations
from estimator.fitting.stable_inverse import stable_inverse

Array = NDArray[np.float64]
POWERS = {"defocus_growth": 2, "trigger_jitter": 2}
"""Effects whose pictures change with the square of their size."""


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


class _ClockShift(EffectModel):
    """All frames taken later by one time."""

    entry = EffectEntry(
        "clock_shift",
        Stage.CLOCK,
        Scope.CAMPAIGN,
        (Parameter("shift", "s", (-1e-4, 1e-4), 1e-7, "true minus stated time"),),
        "true time = nominal time + shift",
        "Auxiliary: how outlines change with time",
    )

    def times(self, theta: Array, setting: Setting, times_s: Array) -> Array:
        """Later times."""
        del setting
        return times_s + theta[0]


def jitter_information(campaign: Campaign, fit: CampaignFit) -> Array:
    """Information (1, 1) on the square of the standard deviation of the frames' times (s^-4).

    A frame of which the outlines tell the time with the standard deviation ``tau`` tells the variance of its time's error with
    ``sqrt(2) tau²``.
    """
    model = Model((*fit.model.effects, _ClockShift()))
    state = CampaignState(fit.state.flights, tuple(np.append(theta, 0.0) for theta in fit.state.theta))
    total = 0.0
    for number in range(len(campaign.sequences)):
        equations = sequence_equations(campaign, number, state, model)
        per_frame = np.einsum("nks,nks->n", equations.frames.weighted[..., -1], equations.errors.J[..., -1])
        total += 0.5 * float(np.sum(per_frame**2))
    return np.array([[total]])


def all_information(campaign: Campaign, fit: CampaignFit, tests: Sequence[ScoreTest]) -> dict[str, Array]:
    """Information on every effect of the catalogue."""
    found = {test.effect.entry.key: information_of(test) for test in tests if test.columns}
    found["trigger_jitter"] = jitter_information(campaign, fit)
    return {key: found[key] for key in EFFECTS if key in found}
