"""What may be there though a fit does not have it: effects whose uncertainty widens that of everything fitted.

A consider parameter ``p`` has a covariance ``P`` about none and is not estimated [Schmidt 1966; Bierman 1977, ch. 8]. What is fitted takes
part of it up: with normal matrix ``H`` of the fitted parameters ``x``, their priors in it, and cross terms ``H_xp``, the errors are
``x̂ - x = A p``, ``A = H⁻¹ H_xp``, and ``p̂ - p = -p``, so that

    C_xx + A P Aᵀ,   -A P;   -P Aᵀ,   P

is the covariance of both, and that of a velocity follows from its derivatives by both. Valid where the fit is linear over ``P``.

A surface is further off than its covariance says (:data:`estimator.effects.instrument.surface_amplitudes.FURTHER_OFF`): what it adds to
the covariance of everything else, ``C_xa (C_aa)⁻¹ C_ax``, counts that many times in deviations.

An effect ``d`` that the fit has, though it may as well not be there, is the other way round: with the probability ``1 - w`` that it is
not, its value is not ``d`` but none, and what is fitted beside it moves by ``(H⁻¹)_xd (H⁻¹)_dd⁻¹ d``. Both together are the variance over
models, with and without each [Hoeting et al. 1999, Bayesian model averaging], about the values of the fit.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.effects.link import EffectModel
from estimator.effects.model import Model
from estimator.fitting.campaigns.campaign import Campaign, CampaignFit, CampaignState, layout_of, sequence_equations, shared_prior
from estimator.fitting.campaigns.campaign_covariance import CampaignCovariance, campaign_covariance
from estimator.fitting.campaigns.facts import Fact
from estimator.fitting.stable_inverse import inverse_of_all, stable_inverse
from estimator.fitting.system import System

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Possible:
    """An effect that may be there: its ``covariance`` (q, q) about none, the square of a value that it may have in it."""

    effect: EffectModel
    covariance: Array


@dataclass(frozen=True)
class Considered:
    """A fit with possible effects beside its own.

    Attributes
    ----------
    model : Model
        The fit's effects, then the possible ones.
    theta : tuple of Array
        Parameters (q + r,) of every sequence, those of possible effects zero.
    covariance : CampaignCovariance
        Of all parameters of both.
    own : int
        How many of a sequence's parameters are fitted: 21 + q.
    plain : CampaignCovariance
        Of the fitted ones, were nothing else possible.
    """

    model: Model
    theta: tuple[Array, ...]
    covariance: CampaignCovariance
    own: int
    plain: CampaignCovariance

    @property
    def fitted(self) -> CampaignCovariance:
        """Of the fitted parameters, widened by what is possible."""
        place = [rows[: self.own] for rows in self.covariance.place]
        x = np.unique(np.concatenate(place)) if place else np.zeros(0, dtype=np.int64)
        return CampaignCovariance(self.covariance.covariance[np.ix_(x, x)], tuple(np.searchsorted(x, rows) for rows in place))


@dataclass(frozen=True)
class Doubt:
    """An effect that may not be there: its ``rows`` (q,) among all p parameters of a fit, and the ``shift`` (p,) of all left in doubt."""

    rows: NDArray[np.int64]
    shift: Array

    @property
    def of_others(self) -> Array:
        """The shift (p,), given that the effect is there for its own values."""
        return np.where(np.isin(np.arange(len(self.shift)), self.rows), 0.0, self.shift)


@dataclass(frozen=True)
class Uncertain:
    """A fit with its uncertainty: ``at`` of what it measures, ``of_values`` of its effects' values, given that their names are right."""

    fit: CampaignFit
    at: Considered
    of_values: CampaignCovariance


def uncertain(
    campaign: Campaign,
    fit: CampaignFit,
    candidates: Mapping[str, EffectModel],
    names: Sequence[Possible] = (),
    doubtful: Mapping[str, float] | None = None,
) -> Uncertain:
    """A fit with what is stated of effects that it lacks and other ``names`` of what it has considered.

    ``doubtful``: effects of the fit that may not be there, with the probability that they are; values of effects are given that they are.
    """
    covariance, doubts = further_off(campaign_covariance(campaign, fit), fit), doubts_of(campaign, fit, doubtful or {})
    stated = stated_possible(campaign.facts, fit.model, candidates)
    of_values = considered(campaign, fit, widened(covariance, [doubt.of_others for doubt in doubts]), stated)
    at = considered(campaign, fit, widened(covariance, [doubt.shift for doubt in doubts]), _with(names, stated))
    return Uncertain(fit, at, of_values.fitted)


def further_off(covariance: CampaignCovariance, fit: CampaignFit) -> CampaignCovariance:
    """A covariance in which effects of the fit whose parameters are further off than it says move everything by as much more."""
    C = covariance.covariance
    for effect in fit.model.effects:
        if effect.further_off == 1.0 or not effect.entry.parameters:
            continue
        part = fit.model.layout[effect.entry.key]
        rows = np.unique(np.concatenate([place[part] for place in covariance.place]))
        by = covariance.covariance[:, rows]
        C = C + (effect.further_off**2 - 1.0) * by @ stable_inverse(by[rows]) @ by.T
    return CampaignCovariance(C, covariance.place)


def doubts_of(campaign: Campaign, fit: CampaignFit, doubtful: Mapping[str, float]) -> tuple[Doubt, ...]:
    """What would be without each of the ``doubtful`` effects of a fit, which are there with the probabilities stated."""
    inverse, places = inverse_of_all(fit.system(campaign).H) if doubtful else np.zeros((0, 0)), fit.layout.places
    found = []
    for key, probability in doubtful.items():
        part = fit.model.layout[key]
        rows, first = np.unique(np.concatenate([place[part] for place in places]), return_index=True)
        d = np.concatenate([values[part] for values in fit.state.values])[first]
        moved = inverse[:, rows] @ stable_inverse(inverse[np.ix_(rows, rows)]) @ d
        found.append(Doubt(rows, np.sqrt(1.0 - probability) * moved))
    return tuple(found)


def widened(covariance: CampaignCovariance, shifts: Sequence[Array]) -> CampaignCovariance:
    """A covariance with those of ``shifts`` (p,) each that may be there or not, one standard deviation each."""
    return CampaignCovariance(sum((np.outer(shift, shift) for shift in shifts), covariance.covariance), covariance.place)


def _with(possible: Sequence[Possible], more: Sequence[Possible]) -> tuple[Possible, ...]:
    """What is possible, and of ``more`` what is not among it."""
    keys = {each.effect.entry.key for each in possible}
    return (*possible, *(each for each in more if each.effect.entry.key not in keys))


def stated_rows(facts: Sequence[Fact], key: str) -> Array:
    """What facts say of one effect alone: weights (k, q) of its parameters over the standard deviation of each, one over their units."""
    return np.array([np.array(fact.weights[0][1]) / fact.sigma for fact in facts if fact.effects == (key,)])


def stated_possible(facts: Sequence[Fact], model: Model, candidates: Mapping[str, EffectModel]) -> tuple[Possible, ...]:
    """What facts say of effects that a model lacks: their uncertainty, and how far they are from none."""
    keys = dict.fromkeys(fact.effects[0] for fact in facts if len(fact.effects) == 1 and fact.effects[0] not in model.keys)
    found = []
    for key in keys:
        about, W = [fact for fact in facts if fact.effects == (key,)], stated_rows(facts, key)
        spread = np.asarray(np.linalg.pinv(W.T @ W, hermitian=True), dtype=np.float64)
        mean = spread @ W.T @ np.array([fact.value / fact.sigma for fact in about])
        found.append(Possible(candidates[key].held_by(None), spread + np.outer(mean, mean)))
    return tuple(found)


def considered(
    campaign: Campaign,
    fit: CampaignFit,
    covariance: CampaignCovariance,
    possible: Sequence[Possible],
) -> Considered:
    """The covariance of a fit under effects that are possible; as it is where none are."""
    model = Model((*fit.model.effects, *(each.effect for each in possible)))
    none = np.zeros(model.size - fit.model.size)
    theta = tuple(np.concatenate([each, none]) for each in fit.state.theta)
    own = fit.model.layout.size
    if not len(none):
        return Considered(model, theta, covariance, own, covariance)
    state, layout = CampaignState(fit.state.flights, theta), layout_of(campaign, model)
    known, place, size = shared_prior(campaign, layout, model, state), layout.places, layout.p
    told = tuple(sequence_equations(campaign, i, state, model) for i in range(len(place)))
    H = System(told, layout, known, fit.cost).H
    x = np.unique(np.concatenate([rows[:own] for rows in place]))
    p = np.unique(np.concatenate([rows[own:] for rows in place]))
    P, C, there = *np.zeros((2, size, size)), np.empty(len(x), dtype=np.int64)
    for rows, before in zip(place, covariance.place, strict=True):
        there[before] = rows[:own]
        for each in possible:
            part = rows[model.layout[each.effect.entry.key]]
            P[np.ix_(part, part)] = each.covariance
    P = P[np.ix_(p, p)]
    A = inverse_of_all(H[np.ix_(x, x)]) @ H[np.ix_(x, p)]
    C[np.ix_(there, there)] = covariance.covariance
    C[np.ix_(x, x)] += A @ P @ A.T
    C[np.ix_(x, p)], C[np.ix_(p, x)], C[np.ix_(p, p)] = -A @ P, -P @ A.T, P
    return Considered(model, theta, CampaignCovariance(C, place), own, covariance)
