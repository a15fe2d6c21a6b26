"""What was found in the catalogue against one unknown in its place.

Effects that are free in every sequence, or several together, can imitate something that the catalogue lacks: a thrust that turns with the
body looks like another draught in every sequence. Empirical families (:mod:`estimator.effects.empirical`) therefore compete with the
last model for what each step of it had still to explain. All are refitted and compared by Schwarz's criterion [1978]: what the scores of
all effects and families say is left, less what chance leaves, plus a penalty per parameter (:func:`schwarz_penalty`) and
the surprise at values that nature hardly produces. Where none leaves what chance may, what they leave is counted in units of the least
(:func:`estimator.diagnosis.ranking.misfit_unit`). A family has to win by a margin, since it says less than an effect.
"""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.spatial import QhullError
from scipy.stats import chi2

from datasets.vocabulary.effects import Scope
from estimator.diagnosis.extending import fit_extended
from estimator.diagnosis.looks import Looks
from estimator.diagnosis.ranking import BEYOND, by_remainder, misfit_unit
from estimator.diagnosis.score_tests import ScoreTest
from estimator.diagnosis.unknown import ALPHA, Unknown
from estimator.effects.empirical import ForceField
from estimator.effects.link import EffectModel
from estimator.effects.model import Model
from estimator.effects.parameter_values import surprise
from estimator.effects.plane_field import PlaneField, plane_field_like
from estimator.fitting.campaign import Campaign, CampaignFit, CampaignState, fit_campaign
from estimator.fitting.campaign_covariance import CampaignCovariance, campaign_covariance
from estimator.fitting.following import following
from estimator.motion.flight import N_PARAMETERS
from estimator.side_by_side import each_of, width

Array = NDArray[np.float64]
MARGIN = 10.0
"""Of the criterion, by which an unknown must be better: very strong evidence [Kass and Raftery 1995]."""
WORTH_A_FIT = 0.5
"""Largest share of the misfit that a family may leave in a linear look and still be refitted: a look at a large effect is a poor one."""
FALLEN = 0.25
"""Share of the cost before to which a refitted family has to lower it for its flights to be followed."""
REFITTED = 2
LEAST_SPREAD, NEARLY_SINGULAR = 1e-9, 1e-12
"""Variances over those of errors: the least spread that is looked for, and what is added to errors that are one."""
UNFLYABLE = (ValueError, np.linalg.LinAlgError, QhullError)
"""What fits and tables raise of flights that lead out of the picture."""


@dataclass(frozen=True)
class Simpler:
    """An unknown that explains a campaign better than the catalogue: the fit it is added to, and the family.

    ``campaign``: as it is where the family was judged, perhaps at its own flights.
    """

    campaign: Campaign
    fit: CampaignFit
    unknown: Unknown


def better_unknown(
    campaign: Campaign, before: Sequence[CampaignFit], last: CampaignFit, looks: Looks, *, again: bool = False
) -> Simpler | None:
    """The best family in place of what was added after one of the fits ``before``, or ``None`` where the ``last`` fit is better.

    ``again``: fits ``before`` were made with other tables of outlines than those of the campaign.
    """
    if not before:
        return None
    own = _judged(campaign, last, looks)
    beaten = own.criterion(1.0) - MARGIN  # in any other unit it is less
    chance = min(own.left - own.columns, 0.0)  # what a model that is right may leave: noise is counted with caution
    found: list[tuple[_Judged, Simpler]] = []
    for known in before:
        penalty = schwarz_penalty(campaign, known)
        fit = fit_campaign(campaign, known.state, known.model) if again else known
        hopes = [
            (penalty + _least_penalty(campaign, test.effect) + min(chance, promised), Unknown(test, p, tests))
            for test, tests, p, promised in _likely(campaign, fit, looks)
            if p <= ALPHA
        ]
        new = _refitted(campaign, fit, hopes, beaten, looks)
        found += new
        beaten = min([beaten, *(judged.criterion(1.0) for judged, _ in new)])
    unit = misfit_unit((each.left, each.columns) for each in (own, *(judged for judged, _ in found)))
    best, simpler = min(found, key=lambda each: each[0].criterion(unit), default=(own, None))
    if simpler is None or best.criterion(unit) >= own.criterion(unit) - MARGIN:
        return None
    if simpler.campaign is campaign:
        return simpler
    return replace(simpler, fit=fit_campaign(simpler.campaign, simpler.fit.state, simpler.fit.model))


def _refitted(
    campaign: Campaign, fit: CampaignFit, hopes: Sequence[tuple[float, Unknown]], beaten: float, looks: Looks
) -> list[tuple["_Judged", Simpler]]:
    """Refits with families, each with the least criterion that it may have, judged; not of those that could not win.

    None could that would not if it left what chance does, nor if it left what a linear look says. What makes the cost fall deep, and yet
    leaves more than chance does, is judged once more where its own flights were followed: those of the last model were, and tables of
    other flights would speak for that.
    """
    found: list[tuple[_Judged, Simpler]] = []
    while hopes := [hope for hope in hopes if hope[0] < beaten]:
        at_once, hopes = hopes[: width()], hopes[width() :]
        refits = each_of(lambda hope: list(_of_family(campaign, fit, hope[1].test, looks)), at_once, campaign, fit)
        far = [each for there in refits for each, seen in there if each.cost < FALLEN * fit.cost and not seen.by_chance]
        followed = {id(each): at for each, at in zip(far, each_of(partial(_followed, campaign, looks), far, campaign, far), strict=True)}
        for (least, family), there in zip(at_once, refits, strict=True):
            if least < beaten:  # one beside it may have won
                found += [(judged, Simpler(campaign, fit, family)) for _, judged in there]
                own = [at for each, _ in there if (at := followed.get(id(each))) is not None]
                found += [(judged, Simpler(where, fit, family)) for where, judged in own]
                beaten = min([beaten, *(judged.criterion(1.0) for judged, _ in found)])
    return found


@dataclass(frozen=True)
class _Judged:
    """What the scores of all others say that a fit has ``left``, in how many ``columns``, and the ``penalty`` of its parameters.

    That holds what is surprising in their values, too.
    """

    left: float
    columns: int
    penalty: float

    def criterion(self, unit: float) -> float:
        """What is left, in units, less its degrees of freedom, plus the penalty."""
        return self.left / unit - self.columns + self.penalty

    @property
    def by_chance(self) -> bool:
        """Whether no more is left than chance leaves."""
        return bool(chi2.sf(self.left, max(self.columns, 1)) >= ALPHA)


def _judged(campaign: Campaign, fit: CampaignFit, looks: Looks) -> _Judged:
    (_, scores), _ = looks.at(campaign, fit).lasting
    left = by_remainder(scores, penalty=0.0)
    covariance = campaign_covariance(campaign, fit)
    return _Judged(left.nothing, left.columns, schwarz_penalty(campaign, fit, covariance) + surprise_in(campaign, fit, covariance))


def surprise_in(campaign: Campaign, fit: CampaignFit, covariance: CampaignCovariance) -> float:
    """Surprise at all values of the effects that are free: each sequence's own are draws of their own, and their surprises add up.

    An unknown in many sequences makes effects of nature take values that nature does not give them.
    """
    total = 0.0
    for effect, part in zip(fit.model.effects, fit.model.slices, strict=True):
        if effect.held is not None or effect.random:
            continue
        for sequence in sorted(set(campaign.sharing(effect.entry.scope))):
            variance = np.diag(covariance.of(sequence, N_PARAMETERS + np.arange(part.start, part.stop)))
            values = zip(effect.entry.parameters, fit.state.theta[sequence][part], np.sqrt(np.maximum(variance, 0.0)), strict=True)
            total += sum(surprise((v - BEYOND * sigma, v + BEYOND * sigma), p) for p, v, sigma in values if p.name in effect.entry.sizes)
    return total


def schwarz_penalty(campaign: Campaign, fit: CampaignFit, covariance: CampaignCovariance | None = None) -> float:
    """Penalty of the free parameters of a fit, whose ``covariance`` is made where it is needed and not given.

    ``ln n`` for each that all sequences share [Schwarz 1978]. Of an effect that every sequence has for itself, one such for the spread of
    its values and what that spread is worth (:func:`spread_worth`) [George and Foster 2000]; the logarithm of the sequence's own
    measurements for every value at most.
    """
    total = 0.0
    for effect, part in zip(fit.model.effects, fit.model.slices, strict=True):
        if effect.held is not None:
            continue
        most = _most_penalty(campaign, effect)
        if effect.entry.scope is Scope.SEQUENCE:
            covariance = covariance or campaign_covariance(campaign, fit)
            most = min(most, _spread_penalty(campaign, fit, covariance, part))
        total += most
    return total


def _spread_penalty(campaign: Campaign, fit: CampaignFit, covariance: CampaignCovariance, part: slice) -> float:
    """Penalty of the values of one effect, counted by their spread."""
    columns = N_PARAMETERS + np.arange(part.start, part.stop)
    values = [theta[part] for theta in fit.state.theta]
    return float(
        np.log(campaign.kind.independent(campaign)) + spread_worth(values, [covariance.of(s, columns) for s in range(len(values))])
    )


def spread_worth(values: Sequence[Array], covariances: Sequence[Array]) -> float:
    """What the spread of ``values`` [sequence] (q,) of ``covariances`` (q, q) is worth: ``sum_s ln det(1 + C_s⁻¹ T)``.

    ``T``, diagonal, is the variance of the values themselves for which those are likeliest. Of values that are uncorrelated it is ``ln z²``
    for each, z² their mean square over that of their errors, or nothing where that is below 1. Of coefficients that only together are well
    known, each for itself might be nothing; their spread is that of what is known.
    """
    known = [np.flatnonzero(np.diag(C) > 0.0) for C in covariances]  # those that are searched for have no error
    size = np.sqrt([np.mean([C[j, j] for C, k in zip(covariances, known, strict=True) if j in k] or [1.0]) for j in range(len(values[0]))])
    z = [(a / size)[k] for a, k in zip(values, known, strict=True)]
    R = [(C / np.outer(size, size))[np.ix_(k, k)] + NEARLY_SINGULAR * np.eye(len(k)) for C, k in zip(covariances, known, strict=True)]

    def unlikely(log_T: Array) -> tuple[float, Array]:
        """Minus twice the logarithm of the values' likelihood, and its gradient."""
        total, slope, T = 0.0, np.zeros(len(log_T)), np.exp(log_T)
        for each, errors, k in zip(z, R, known, strict=True):
            V = np.linalg.inv(np.diag(T[k]) + errors)
            total += float(each @ V @ each) - float(np.linalg.slogdet(V)[1])
            slope[k] += T[k] * (np.diag(V) - (V @ each) ** 2)
        return total, slope

    start = np.log(np.maximum(np.mean([np.bincount(k, e**2, len(size)) for e, k in zip(z, known, strict=True)], axis=0), LEAST_SPREAD))
    T = np.exp(minimize(unlikely, start, jac=True, method="L-BFGS-B", bounds=[(np.log(LEAST_SPREAD), None)] * len(size)).x)
    grown = (np.linalg.slogdet(np.diag(T[k]) + errors)[1] - np.linalg.slogdet(errors)[1] for errors, k in zip(R, known, strict=True))
    return float(sum(grown))


def _most_penalty(campaign: Campaign, effect: EffectModel | type[EffectModel]) -> float:
    """Penalty of an effect, each of whose values is counted for itself."""
    n, sequences, count = campaign.kind.independent(campaign), len(campaign.sequences), len(effect.entry.parameters)
    own = effect.entry.scope is Scope.SEQUENCE
    return float(sequences * count * np.log(n / sequences) if own else count * np.log(n))


def _least_penalty(campaign: Campaign, family: EffectModel) -> float:
    """The least that a family may cost, or the narrower one that may stand for it."""
    if family.entry.scope is Scope.SEQUENCE:
        return float(np.log(campaign.kind.independent(campaign)))
    return _most_penalty(campaign, PlaneField if isinstance(family, ForceField) else family)


def _of_family(campaign: Campaign, fit: CampaignFit, test: ScoreTest, looks: Looks) -> Iterator[tuple[CampaignFit, _Judged]]:
    """Refits with a family, judged; none of what cannot be flown. A field of force is tried also as one that points one way."""
    try:
        refitted = fit_extended(campaign, fit, test)
        yield refitted, _judged(campaign, refitted, looks)
    except UNFLYABLE:
        return
    if isinstance(test.effect, ForceField):
        with suppress(*UNFLYABLE):
            narrow = _one_way(campaign, fit, refitted, test.effect)
            yield narrow, _judged(campaign, narrow, looks)


def _followed(campaign: Campaign, looks: Looks, refitted: CampaignFit) -> tuple[Campaign, _Judged] | None:
    """The campaign where a refit's own flights were followed, and the refit judged there; nothing where that cannot be flown."""
    with suppress(*UNFLYABLE):
        there, again = following(campaign, refitted)
        return there, _judged(there, again, looks)
    return None


def _one_way(campaign: Campaign, fit: CampaignFit, refitted: CampaignFit, field: ForceField) -> CampaignFit:
    """The refit with a plane field in place of a field that is linear in the place."""
    place = np.concatenate([each.errors.prediction.poses.centre[:, 0] for each in refitted.equations])
    theta = refitted.state.theta[0][refitted.model.slices[-1]]
    plane, values = plane_field_like(field.force(np.tile(theta, (len(place), 1)), place), place)
    own = refitted.model.slices[-1].start
    state = CampaignState(refitted.state.flights, tuple(np.concatenate([t[:own], values]) for t in refitted.state.theta))
    return fit_campaign(campaign, state, Model((*fit.model.effects, plane)))


def criterion_of(campaign: Campaign, fit: CampaignFit, looks: Looks) -> float:
    """What is left at a fit, less its degrees of freedom, plus the penalty of the model's parameters."""
    return _judged(campaign, fit, looks).criterion(1.0)


def _likely(campaign: Campaign, fit: CampaignFit, looks: Looks) -> list[tuple[ScoreTest, tuple[ScoreTest, ...], float, float]]:
    """The families that explain most of a misfit in a linear look.

    Each with all families' tests, its corrected p-value, and what it would leave less its degrees of freedom.
    """
    (tests, scores), known = looks.at(campaign, fit).lasting
    ranking, wide = by_remainder(scores, penalty=0.0), tuple(tests[known:])
    worth = [h for h in ranking.hypotheses if h.effect >= known and h.remainder < WORTH_A_FIT * ranking.nothing + ranking.columns]
    worth.sort(key=lambda h: h.criterion + _most_penalty(campaign, tests[h.effect].effect))
    return [
        (tests[h.effect], wide, min(1.0, tests[h.effect].p * len(wide)), h.remainder - (ranking.columns - h.parameters))
        for h in worth[:REFITTED]
    ]
