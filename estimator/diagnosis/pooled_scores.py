"""What all sequences of a campaign together say of a force and a torque that the model lacks, ready for regression on laws.

The columns are the coefficients of :mod:`estimator.effects.empirical.force_curves` of every sequence, and the scores are taken where fitted
curves ``c0`` stand still in the model: there everything else is linear, however strong the force. The efficient scores ``g`` have mean
``-H (c - c0)`` for a true curve with coefficients ``c``, and covariance ``M``. A law with parameters theta gives, along the motion of the
flights, the coefficients ``c(theta)``; so ``W (H c0 - g) = W H c(theta) + noise`` with ``WᵀW = M⁻¹`` is a regression with white noise.

Why scores rather than the recovered curve: the curve's coefficients are ``-H⁻¹ g`` with covariance ``H⁻¹ M H⁻¹``, and generalised least
squares on them is the same up to H being inverted. Directions that the data hardly see (constant terms beside position and velocity) make
that inverse poor, and a prior would bend the curve; the scores need neither. Why not a column of its own for each term: to first order a
term's score is the combination of these columns that its curve makes, so nothing is lost as long as polynomials follow the curve, and
terms that are not linear (powers, places) cost a matrix product each rather than flights of their own.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import cast

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.score_tests import Candidates, EfficientScores, score_tests
from estimator.effects.empirical.force_curves import DEGREES, FreeForceCurve, FreeTorqueCurve, StandingForceCurve, StandingTorqueCurve
from estimator.effects.empirical.law_terms import Link, Term
from estimator.effects.link import EffectModel, Moment
from estimator.effects.model import Model
from estimator.fitting.campaigns.campaign import Campaign, CampaignFit, fit_campaign
from estimator.fitting.campaigns.forced_velocities import forced_states
from estimator.fitting.descent import Effort
from estimator.motion.flight import still
from estimator.motion.rigid_body import rotation_matrices

Array = NDArray[np.float64]
LINKS: dict[Link, EffectModel] = {"acceleration": FreeForceCurve(), "torque": FreeTorqueCurve()}
NODES = 24
"""Of the quadrature in time: exact for products of two of these curves' polynomials, and for laws as smooth."""


@dataclass(frozen=True)
class PooledScores:
    """White data ``y`` (r,), and what they are per coefficient, ``design`` [link] (r, sequence, degree, 3), per m/s² or rad/s², world axes.

    ``moments``: all flights at the nodes of a quadrature in time, sequence after sequence; ``projector`` (degree, node) makes coefficients
    of the values at a sequence's nodes.
    """

    y: Array
    design: dict[Link, Array]
    moments: Moment
    projector: Array
    sequences: int

    def columns(self, term: Term, shapes: Array) -> Array:
        """Columns (s, r, a) of a term's amplitudes, for shapes (s, k)."""
        s, a, n = len(shapes), term.amplitudes, len(self.moments.x)
        unit = np.broadcast_to(np.eye(a), (s, a, a))
        theta = np.concatenate([unit, np.broadcast_to(shapes[:, None], (s, a, shapes.shape[1]))], axis=2).reshape(s * a, -1)
        values = term.function(np.repeat(theta, n, axis=0), repeated(self.moments, s * a))
        curves = np.einsum("dk,mskx->msdx", self.projector, values.reshape(s * a, self.sequences, -1, 3))
        design = self.design[term.link]
        found = curves.reshape(s * a, -1) @ design.reshape(len(self.y), -1).T
        return np.asarray(np.swapaxes(found.reshape(s, a, -1), 1, 2))


def repeated(moments: Moment, times: int) -> Moment:
    """The same moments once more and again."""
    once = (moments.time_s, moments.x, moments.v, moments.omega, moments.L, moments.R)
    time_s, *others = (np.tile(a, (times, *([1] * (np.ndim(a) - 1)))) for a in once)
    return Moment(cast(float, time_s), *others)


def pooled_scores(campaign: Campaign, wide: CampaignFit) -> PooledScores:
    """Scores of a campaign fitted with the curves of :data:`LINKS` that it shows, as if they were not there."""
    frozen = {curve.entry.key: curve for curve in (StandingForceCurve(), StandingTorqueCurve())}
    model = Model(tuple(frozen.get(effect.entry.key, effect) for effect in wide.model.effects))
    standing = fit_campaign(campaign, wide.state, model, Effort(steps=0))
    on_trial = Candidates.of(campaign, LINKS.values())
    _, scores = score_tests(campaign, standing, on_trial)
    node, weight = np.polynomial.legendre.leggauss(NODES)
    powers = np.polynomial.legendre.legvander(node, DEGREES[-1])
    W = scores.whitener
    links = [link for each in on_trial.effects for link, curve in LINKS.items() if each.entry.key == curve.entry.key]
    design = _design(scores, W, len(campaign.sequences), links)
    parts = dict(zip(model.keys, model.slices, strict=True))
    fitted = {link: np.concatenate([theta[parts[LINKS[link].entry.key]] for theta in wide.state.theta]) for link in links}
    there = sum((design[link].reshape(len(W), -1) @ fitted[link] for link in links), np.zeros(len(W)))
    return PooledScores(
        y=there - W @ scores.g,
        design=design,
        moments=moments_along(campaign, wide, 0.5 * (node + 1.0)),
        projector=(2.0 * np.array(DEGREES) + 1.0)[:, None] / 2.0 * powers.T * weight,
        sequences=len(campaign.sequences),
    )


def _design(scores: EfficientScores, W: Array, sequences: int, links: Sequence[Link]) -> dict[Link, Array]:
    """By link; ``links`` of the effects on trial: a force is not where no positions are measured."""
    white = W @ scores.H
    design = {link: np.zeros((len(white), sequences, len(DEGREES), 3)) for link in LINKS}
    for i, column in enumerate(scores.columns):
        degree, axis = divmod(column.parameter, 3)
        design[links[column.effect]][:, column.sequence or 0, degree, axis] = white[:, i]
    return design


def moments_along(campaign: Campaign, fit: CampaignFit, shares: Array) -> Moment:
    """All flights at ``shares`` (n,), 0 to 1, of their sequences' time; the time is a column, as every other part has a row per flight."""
    parts = []
    for sequence, flight, theta in zip(campaign.sequences, fit.state.flights, fit.state.theta, strict=True):
        stamps = sequence.setting.times_s
        times = stamps[0] + shares * (stamps[-1] - stamps[0])
        reached, omega = forced_states(flight, still(flight), (fit.model, theta, sequence.setting), times)
        R = rotation_matrices(reached.q[:, 0])
        parts.append(((times - stamps[0])[:, None], reached.x[:, 0], reached.v[:, 0], omega[:, 0], reached.L[:, 0], R))
    time_s, *others = (np.concatenate(each) for each in zip(*parts, strict=True))
    return Moment(cast(float, time_s), *others)
