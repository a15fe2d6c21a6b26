"""Score tests of the effects that a fit lacks, from the campaign that was linearised for the evidence.

They answer the plain question whether noise alone would give scores as large as these; which effects belong into the model is for the
evidence to say.
"""

import numpy as np

from estimator.diagnosis.score_tests import EfficientScores, ScoreTest, test_of
from estimator.diagnosis.selection.linearised import Linearised
from estimator.fitting.stable_inverse import stable_inverse


def tests_beside(of: Linearised) -> tuple[ScoreTest, ...]:
    """Tests of all effects that the fit lacks, in the order of ``of.effects``."""
    scores = scores_beside(of)
    return tuple(test_of(scores, of.candidates, number, of.starts, of.jitter) for number in range(of.own, len(of.effects)))


def scores_beside(of: Linearised) -> EfficientScores:
    """Scores of the columns that the fit lacks, with the fit's own effects re-adjusted under their priors."""
    inside = np.array([i for i, c in enumerate(of.columns) if c.effect < of.own], dtype=np.int64)
    outside = np.array([i for i, c in enumerate(of.columns) if c.effect >= of.own], dtype=np.int64)
    if not len(inside):
        return of.scores
    g, H, M = of.scores.g, of.scores.H, of.scores.M
    prior = np.diag([_precision(of, int(i)) for i in inside])
    if of.stated is not None:
        prior = prior + of.stated[np.ix_(inside, inside)]
    B = stable_inverse(H[np.ix_(inside, inside)] + prior) @ H[np.ix_(inside, outside)]
    undone = B.T @ (M[np.ix_(inside, outside)] - 0.5 * (M[np.ix_(inside, inside)] + prior) @ B)
    noise = M[np.ix_(outside, outside)] - undone - undone.T
    free = np.where(np.diag(prior) > 0.0, 0.0, g[inside])  # under a prior the fit's own gradient is what the prior pulls
    information = H[np.ix_(outside, outside)] - H[np.ix_(outside, inside)] @ B
    columns = tuple(of.columns[i] for i in outside)
    return EfficientScores(columns, g[outside] - B.T @ free, 0.5 * (information + information.T), noise)


def _precision(of: Linearised, row: int) -> float:
    """Information of the prior that a fitted column has."""
    column = of.columns[row]
    held = of.effects[column.effect].held
    return 0.0 if held is None else held[column.parameter] ** -2.0
