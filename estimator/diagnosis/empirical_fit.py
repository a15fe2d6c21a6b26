"""When nothing in the catalogue fits: fit an empirical term, see what it removes and what shape it has, and propose a law.

The family that names the stage (:class:`estimator.diagnosis.diagnose.Unknown`) joins the model and everything is refitted; for forces and
torques that is a curve of each per sequence, where it shows (:mod:`estimator.effects.empirical.force_curves`). What it is worth is told by
what was not fitted: the share of the excess over the noise floor that it removes. A law for it (:mod:`estimator.diagnosis.law`) is fitted
in the curves' place, without terms that are compatible with zero; one that predicts no better than the model without it is none.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.effects import Stage
from estimator.diagnosis.diagnose import ALPHA, Unknown
from estimator.diagnosis.law import Law, find_law
from estimator.diagnosis.noise_floor import noise_floor
from estimator.diagnosis.pooled_scores import pooled_scores
from estimator.effects.empirical.families import LARGEST
from estimator.effects.empirical.force_curves import ForceCurve, TorqueCurve
from estimator.effects.empirical.law_effect import law_effect, shown_terms
from estimator.effects.empirical.law_terms import Term
from estimator.effects.link import EffectModel
from estimator.effects.model import Model
from estimator.fitting.campaigns.campaign import Campaign, CampaignFit, CampaignState, fit_campaign
from estimator.fitting.campaigns.campaign_covariance import CampaignCovariance, campaign_covariance
from estimator.fitting.campaigns.held_out import HeldOut, held_out
from estimator.fitting.campaigns.wald import zero_p
from estimator.fitting.campaigns.weighing_again import weighed_again
from estimator.fitting.descent import Effort

Array = NDArray[np.float64]
BOOTSTRAP_SEED = 20240229
"""Of the bootstrap of a noise floor: the same campaign gives the same interval."""
SUPERFLUOUS = 0.05
"""p-value of a law's term above which it is left out once the campaign is refitted with it; decision 47."""
LAW = "unknown_law"
CURVES: Mapping[str, EffectModel] = {"acceleration": ForceCurve(), "torque": TorqueCurve()}
"""What a force and a torque of no stated law are fitted with."""
Told = Callable[[str], None]


@dataclass(frozen=True)
class Removed:
    """What a model removes: held-out errors ``before`` and ``after``, and ``floor_px``, the RMS that noise and views alone would make."""

    before: HeldOut
    after: HeldOut
    floor_px: float

    @property
    def share(self) -> float:
        """Share of the excess of held-out squares over the floor that is gone, 0 to 1."""
        excess = self.before.rms_px**2 - self.floor_px**2
        gone = self.before.rms_px**2 - self.after.rms_px**2
        return float(np.clip(gone / excess, 0.0, 1.0)) if excess > 0.0 else float(gone > 0.0)


@dataclass(frozen=True)
class LawFit:
    """A law and the campaign fitted with it: the terms that stay, the fit (the law is its last effect) and covariance, what it removes."""

    law: Law
    terms: tuple[Term, ...]
    fit: CampaignFit
    covariance: CampaignCovariance
    removed: Removed


@dataclass(frozen=True)
class EmpiricalFit:
    """The model with empirical terms.

    ``terms`` the families in it, its fit and covariance, what they remove, and a law where they are forces or torques and one was found.
    """

    terms: tuple[EffectModel, ...]
    fit: CampaignFit
    covariance: CampaignCovariance
    removed: Removed
    law: LawFit | None

    @property
    def described(self) -> bool:
        """Whether a law says all that is known of it: curves of no law predict no sequence, nor all of them, better than by chance."""
        return self.law is not None and self.law.removed.after.worse_by_chance(self.removed.after) >= ALPHA


def fit_empirical(campaign: Campaign, fit: CampaignFit, left: Unknown, *, told: Told = lambda _sentence: None) -> EmpiricalFit:
    """Fit what a model leaves unexplained with the family that names its stage."""
    before = held_out(campaign, fit.state, fit.model)
    curves = tuple(curve for curve in CURVES.values() if campaign.kind.why_not(campaign, curve) is None)
    terms = curves if left.stage is Stage.DYNAMICS else (_held(left.test.effect),)
    wide = _with_terms(campaign, fit, terms)
    covariance = campaign_covariance(campaign, wide)
    floor = _floor(campaign, wide)
    removed = Removed(before, held_out(campaign, wide.state, wide.model), floor)
    told(f"empirical terms: held-out RMS {before.rms_px:.4f} -> {removed.after.rms_px:.4f} {campaign.kind.unit}")
    law = _law(campaign, fit, wide, (before, floor)) if left.stage is Stage.DYNAMICS else None
    if law is not None:
        told(f"law: held-out RMS {before.rms_px:.4f} -> {law.removed.after.rms_px:.4f} {campaign.kind.unit}")
    return EmpiricalFit(terms, wide, covariance, removed, law)


def _held(effect: EffectModel) -> EffectModel:
    """A family under its prior."""
    size = LARGEST.get(effect.entry.key)
    return effect if size is None else effect.held_by((size,) * len(effect.entry.parameters))


def _with_terms(campaign: Campaign, fit: CampaignFit, terms: tuple[EffectModel, ...]) -> CampaignFit:
    """The campaign with families added, from zero: they are linear there."""
    model = Model((*fit.model.effects, *terms))
    start = tuple(np.concatenate([theta, np.zeros(model.size - fit.model.size)]) for theta in fit.state.theta)
    return fit_campaign(campaign, CampaignState(fit.state.flights, start), model)


def _floor(campaign: Campaign, fit: CampaignFit) -> float:
    """RMS (px) that remains where nothing is missing: noise of the frames, and what calibrated views and hulls may bring."""
    found = noise_floor(campaign, fit, np.random.default_rng(BOOTSTRAP_SEED))
    return float(np.sqrt(min(found.allowed * found.floor_px**2, found.rms_px**2)))


def _law(campaign: Campaign, fit: CampaignFit, wide: CampaignFit, at: tuple[HeldOut, float]) -> LawFit | None:
    """The law that predicts better than nothing, looked for in the noise that curves leave: about ``fit`` a strong one counts as noise."""
    quiet, wide = weighed_again(campaign, wide)
    law = find_law(pooled_scores(quiet, wide), terms=shown_terms(partial(campaign.kind.why_not, campaign)))
    if law is None:
        return None
    without, terms = fit_campaign(quiet, fit.state, fit.model), with_amplitudes(law)
    while True:
        refitted = fit_terms(quiet, without, terms, wide)
        if refitted is None:
            return None
        covariance = campaign_covariance(quiet, refitted)
        weakest = int(np.argmax(p_values := _wald(quiet, refitted, covariance, terms)))
        if len(terms) == 1 or p_values[weakest] <= SUPERFLUOUS:
            break
        terms = tuple(t for i, t in enumerate(terms) if i != weakest)
    removed = Removed(at[0], held_out(campaign, refitted.state, refitted.model), at[1])
    if not removed.after.rms_px < removed.before.rms_px:
        return None
    return LawFit(law, tuple(t for t, _ in terms), refitted, covariance, removed)


MOST_LAW_STEPS = 60
"""Steps of the fit of a law, four times those of a campaign: powers bend. By judgement."""
LAW_DAMPINGS = (1e-4, 1e-3, 1e-2, 0.1, 1.0, 10.0)
"""Powers bend: where a law is far from linear, steps are short, and many, and the direction of the undamped one may lead nowhere."""
Valued = tuple[Term, Array]
"""A term and values of all its parameters."""


def with_amplitudes(law: Law) -> tuple[Valued, ...]:
    """The terms of a law with the values of its regression."""
    terms, place = [], 0
    for each in law.best.terms:
        a = each.term.amplitudes
        terms.append((each.term, np.concatenate([law.best.amplitudes[place : place + a], each.shape])))
        place += a
    return tuple(terms)


def fit_terms(campaign: Campaign, fit: CampaignFit, terms: tuple[Valued, ...], free: CampaignFit) -> CampaignFit | None:
    """The campaign fitted with a law beside the effects of ``fit``.

    It starts from the values of the ``terms``, which belong to the flights of the fit with ``free`` forces: flights of ``fit`` have made up
    for the lack of a force, and the way back may be long. Where that does not settle, it starts from ``fit`` as well, with amplitudes of
    zero. The better of both; none where neither explains more than ``fit``.
    """
    effect = law_effect(LAW, tuple(t for t, _ in terms), tuple(values[t.amplitudes :] for t, values in terms))
    model = Model((*fit.model.effects, effect))
    full = np.concatenate([values for _, values in terms])
    silent = np.concatenate([np.where(np.arange(len(values)) < t.amplitudes, 0.0, values) for t, values in terms])
    found: list[CampaignFit] = []
    for flights, values in ((free.state.flights, full), (fit.state.flights, silent)):
        start = CampaignState(flights, tuple(np.concatenate([theta, values]) for theta in fit.state.theta))
        try:
            found.append(fit_campaign(campaign, start, model, Effort(MOST_LAW_STEPS, dampings=LAW_DAMPINGS)))
        except (ValueError, np.linalg.LinAlgError):  # flights under it run away
            continue
        if found[-1].settled:
            break
    return min((each for each in found if each.cost < fit.cost), key=lambda each: each.cost, default=None)


def _wald(campaign: Campaign, fit: CampaignFit, covariance: CampaignCovariance, terms: tuple[Valued, ...]) -> list[float]:
    """p-value of each term's amplitudes being zero, of all particles."""
    starts = fit.model.slices[-1].start + np.cumsum([0, *(len(values) for _, values in terms[:-1])])
    columns = [np.arange(start, start + term.amplitudes) for start, (term, _) in zip(starts, terms, strict=True)]
    return [zero_p(campaign, fit, covariance, fit.model.effects[-1].entry.scope, each) for each in columns]
