"""A campaign linearised in the parameters of every effect at once, about a fit that may already have some of them.

With ``theta`` the amplitudes of all effects, counted from "no effect", and everything else (flights, body, camera) re-adjusted, the
logarithm of the likelihood is quadratic: ``log L = -S/2``, ``S(theta) = S(0) - 2 bᵀ theta + thetaᵀ G theta``. The efficient scores ``g`` at
the fitted values ``theta*`` have mean ``-H (theta - theta*)`` and covariance ``M`` [Neyman 1959], so that

- where scores vary as the information says, ``M = H``: ``G = H``, ``b = H theta* - g``, and ``S`` is the fit's own sum of squares;
- where noise repeats, ``M ≠ H`` (tangents of one outline, calibrated views in every frame): the scores themselves are the data, with
  their dependence: ``G = H M⁻¹ H``, ``b = H M⁻¹ (H theta* - g)``, ``S(0) = (H theta* - g)ᵀ M⁻¹ (H theta* - g)``
  [Chandler and Bate 2007; Pauli, Racugno and Ventura 2011 on likelihoods adjusted for dependence].

Effects that are in the fit are on trial like all others: the same quadratic says what the likelihood would be without them. Valid as far as
signatures are linear over the differences between the sets that are compared; :mod:`estimator.diagnosis.selection.path` linearises
again wherever the set changes.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.effects import Scope
from estimator.diagnosis.score_tests import Candidates, Column, EfficientScores, arranged, candidate_equations, efficient_scores
from estimator.effects.link import EffectModel, Setting
from estimator.effects.model import Model
from estimator.fitting.campaigns.campaign import Campaign, CampaignFit, CampaignState, SequenceEquations, layout_of, own_cost
from estimator.likelihood.rows import AtFit
from estimator.likelihood.time_shifts import JitterTest, jitter_test
from estimator.motion.flight import OMEGA, V, X

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Linearised:
    """The quadratic log likelihood of all effects' amplitudes about one fit.

    ``effects`` on trial, those of the fit first, and how many of them are its ``own``; ``scores`` of the c amplitudes, each of an effect, a
    parameter and a sequence, about the fitted values; ``information`` G (c, c) and ``pull`` b (c,), units of one over each parameter's,
    squared and plain; ``misfit`` ``S(0)``, weighted sum of squares where every amplitude is zero; ``count``: how many independent numbers
    that sum has, where its noise is known up to one factor, ``None`` where each sequence's noise is; ``residuals``: the density of all
    residuals, noise that a fit has drawn anew in every frame in its weights; ``candidates``: the effects with the starts that were tried of
    each; ``starts``: (effect, sequence or None) to the number of the start that its columns belong to, the value of what is searched for;
    ``jitter``: what the residuals say of an effect drawn anew in every frame; ``longest``: what is known of the longest sequence, whose
    starts are tried, ``None``: starts are those of the candidates; ``stated``: the part (c, c) of ``information`` that facts give, which
    the scores do not have, ``None``: there are no facts.
    """

    effects: tuple[EffectModel, ...]
    own: int
    scores: EfficientScores
    information: Array
    pull: Array
    misfit: float
    count: float | None
    residuals: AtFit
    candidates: Candidates
    starts: Mapping[tuple[int, int | None], int]
    jitter: JitterTest
    longest: Setting | None = None
    stated: Array | None = None

    @property
    def columns(self) -> tuple[Column, ...]:
        """The amplitudes."""
        return self.scores.columns

    @property
    def keys(self) -> tuple[str, ...]:
        """The effects' keys."""
        return tuple(e.entry.key for e in self.effects)

    def gain(self, effect: int) -> float:
        """Log likelihood (nats) that an effect drawn anew in every frame gains; 0 for all others."""
        return 0.5 * self.jitter.gain if self.effects[effect].random else 0.0

    def tried(self, effect: int) -> int:
        """Starts that were tried of an effect, or had been before the fit had it."""
        if self.longest is None:
            return len(self.candidates.starts[effect])
        return max(len(self.effects[effect].starts(self.longest)), 1)

    def start(self, effect: int, sequence: int | None) -> Array:
        """The start (q,) that explains most."""
        best = self.starts.get((effect, sequence), 0)
        return self.candidates.starts[effect][best]

    def rows(self, effect: int) -> NDArray[np.int64]:
        """Columns of one effect."""
        return np.array([i for i, column in enumerate(self.columns) if column.effect == effect], dtype=np.int64)


def linearised(campaign: Campaign, fit: CampaignFit, catalogue: Mapping[str, EffectModel]) -> Linearised:
    """Linearise a campaign about a fit, in the effects of the fit and of a ``catalogue``."""
    base, own = _base_and_own(campaign, fit)
    others = Candidates.of(campaign, [e for key, e in catalogue.items() if key not in fit.model.keys])
    dummies = tuple(np.zeros((1, len(e.entry.parameters))) for e in own)
    candidates = Candidates((*own, *others.effects), (*dummies, *others.starts))
    equations = candidate_equations(campaign, replace(fit, model=_free(fit.model)), others)
    state = CampaignState(fit.state.flights, tuple(theta[: base.size] for theta in fit.state.theta))
    bare = replace(fit, model=base, layout=layout_of(campaign, base), state=state)
    scores, chosen = efficient_scores(campaign, bare, arranged(campaign, equations, base, candidates))
    scores = _amplitudes(scores, candidates)
    current = np.array([_current(fit, base.size, column, own) for column in scores.columns])
    known = campaign.kind.noise_scales(campaign, equations) is not None
    squares = campaign.kind.squares(equations) if known else None
    priors = 2.0 * _cost_of_base(campaign, bare)
    jitter = jitter_test(campaign.time_shifts(equations))
    density = campaign.kind.density(campaign, equations)
    if known:
        density = replace(density, constant=density.constant - _log_volume(bare, equations))
    return Linearised(
        candidates.effects,
        len(own),
        scores,
        *_quadratic(scores, current, None if squares is None else squares + priors),
        AtFit(density, squares or 0.0, priors, 0.5 * jitter.gain * any(e.random for e in own)),
        candidates,
        chosen,
        jitter,
        max((each.setting for each in campaign.sequences), key=lambda each: len(each.times_s)),
    )


def _log_volume(fit: CampaignFit, equations: Sequence[SequenceEquations]) -> float:
    """What the integral over flights takes (nats) of a density: their information, in units of how far and fast all are.

    By a density of flights that no unit enters, a power of their sizes [Jaynes 1968]: lengths or a clock that are wrong by
    a factor change all flights' by it, which says nothing for them. What the base model ``fit`` has of every sequence's own is part of it,
    in units of its prior.
    """
    of_sequences = np.array([effect.entry.scope is Scope.SEQUENCE for effect in fit.model.effects], dtype=np.float64)
    held = np.flatnonzero(fit.model.each_parameter(of_sequences))
    volume = sum(each.half_log_det_of_flight(held) for each in equations)
    volume -= 0.5 * len(equations) * float(np.sum(np.log(fit.model.precision[held])))
    for part in (X, V, OMEGA):
        both = zip(fit.state.flights, equations, strict=True)
        own = np.concatenate([np.zeros(0), *(flight.values[part][np.diag(each.H)[part] > 0.0] for flight, each in both)])
        size = float(own @ own)
        volume += 0.5 * len(own) * float(np.log(size)) if size > 0.0 else 0.0
    return volume


def _cost_of_base(campaign: Campaign, bare: CampaignFit) -> float:
    """What the priors of the instrument and of the body cost (nats) where a fit has those: a set that needs less of it fits better."""
    return bare.system(replace(campaign, facts=())).known.cost + own_cost(campaign, bare.model, bare.state)


def _base_and_own(campaign: Campaign, fit: CampaignFit) -> tuple[Model, tuple[EffectModel, ...]]:
    """The kind's base model, and the effects that a fit has beside it."""
    base = campaign.kind.base
    if fit.model.keys[: len(base.keys)] != base.keys:
        raise ValueError(f"expected a model that begins with {base.keys}, got {fit.model.keys}")
    return base, fit.model.effects[len(base.effects) :]


def _free(model: Model) -> Model:
    """The model with the priors of its effects left to the evidence."""
    return Model(tuple(e if e.instrument else e.held_by(None) for e in model.effects))


def _amplitudes(scores: EfficientScores, candidates: Candidates) -> EfficientScores:
    """The columns of amplitudes alone: what is searched for is held at its start."""
    kept = [i for i, c in enumerate(scores.columns) if _is_size(candidates.effects[c.effect], c.parameter)]
    return scores.take(np.array(kept, dtype=np.int64))


def _is_size(effect: EffectModel, parameter: int) -> bool:
    return effect.entry.parameters[parameter].name in effect.entry.sizes


def _current(fit: CampaignFit, before: int, column: Column, own: Sequence[EffectModel]) -> float:
    """Value that a column has in the fit."""
    if column.effect >= len(own):
        return 0.0
    first = before + sum(len(e.entry.parameters) for e in own[: column.effect])
    return float(fit.state.theta[column.sequence or 0][first + column.parameter])


def _quadratic(scores: EfficientScores, current: Array, squares: float | None) -> tuple[Array, Array, float, float | None]:
    """``G``, ``b``, ``S(0)`` and the count of :class:`Linearised`; ``squares`` where scores vary as the information says."""
    H, score = scores.H, scores.H @ current - scores.g
    if squares is not None:
        return H, score, float(squares - 2.0 * scores.g @ current + current @ H @ current), None
    if not len(score):
        return H, score, 0.0, 1.0
    white = scores.whitener
    X, y = white @ H, white @ score
    return X.T @ X, X.T @ y, float(y @ y), float(len(y))
