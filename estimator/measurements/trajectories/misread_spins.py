"""Spins that were read once in a flight, and are those of another one: set aside as spoiled rows are, by the lifts that flights show.

A lift by the spin that was found stands for what readings are wrong by with a lift of every flight, which is small for most. About the lift
by a reading of the wrong sign it is no error of a lift at all, yet would have to be one: where readings are far more probably of another
flight (:mod:`estimator.likelihood.misread`) the flight counts as one whose spin nobody read.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.selection.groups import FACTOR
from estimator.effects.link import EffectModel, Moment, Setting
from estimator.fitting.campaigns.campaign import Campaign, CampaignFit
from estimator.fitting.stable_inverse import stable_inverse
from estimator.likelihood.misread import Lifts, probably_misread
from estimator.motion.flight import LAYOUT, Flight

Array = NDArray[np.float64]
Placed = tuple[EffectModel, slice]
"""An effect, and where its parameters lie among those of the model."""


def lift_of(flight: Flight, setting: Setting, effects: Sequence[Placed], theta: Array) -> Array:
    """What ``effects`` accelerate a flight by (3,) m/s², world frame, at its reference time; ``theta`` (q,) of the model."""
    v, omega = flight.v[None], flight.omega[None]
    moment = Moment(0.0, flight.x[None], v, omega, omega, np.eye(3)[None])
    total = np.zeros(3)
    for effect, part in effects:
        value = effect.acceleration(theta[part][None], moment, setting)
        total += 0.0 if value is None else value[0]
    return total


@dataclass(frozen=True)
class SetAside:
    """Flights whose reading is that of another one, by number, with their ``lifts`` (3,) 1/s, world frame; usual ``size`` (1/s) of all."""

    lifts: Mapping[int, Array]
    size: float


def misread_spins(campaign: Campaign, fit: CampaignFit) -> SetAside | None:
    """The readings of a campaign that are far more probably of another flight.

    ``None``: there are none, or most would be, or nothing was found by which a spin lifts.
    """
    lifting = [(effect, part) for effect, part in zip(fit.model.effects, fit.model.slices, strict=True) if effect.lifts]
    by_spin = [each for each in lifting if not each[0].of_unmeasured_spin]
    beside = [each for each in lifting if each[0].of_unmeasured_spin and each[0].noise]
    read = [i for i, task in enumerate(campaign.sequences) if task.seen("omega").any()]
    if not by_spin or not beside or not read:
        return None
    shown = zip(*(_shown(campaign, fit, i, by_spin, beside[0]) for i in read), strict=True)
    lifts = Lifts(*(np.array(each) for each in shown))
    aside = [i for i, probability in zip(read, probably_misread(lifts), strict=True) if probability > FACTOR / (1.0 + FACTOR)]
    if not aside or 2 * len(aside) > len(read):
        return None
    return SetAside({i: _lift(campaign, fit, i, by_spin, beside[0]) for i in aside}, lifts.size)


def _shown(
    campaign: Campaign, fit: CampaignFit, number: int, by_spin: Sequence[Placed], beside: Placed
) -> tuple[Array, Array, Array, float]:
    """What :class:`estimator.likelihood.misread.Lifts` has of flight ``number``, whose lift is that ``by_spin`` and one ``beside``.

    It is the lift that the flight's rows show, whatever is thought of it; what all flights share is as it was fitted.
    """
    task, v, theta, (effect, part) = campaign.sequences[number], fit.state.flights[number].first.v, fit.state.theta[number], beside
    information, pull = _beside_all_others(fit, number, LAYOUT.size + np.arange(part.start, part.stop))
    known = fit.model.precision_at(theta)[part]
    limit = np.array([max(map(abs, parameter.plausible)) for parameter in effect.entry.parameters])
    across = np.linalg.svd(v[None])[2][1:]
    covariance = np.linalg.inv(across @ (information - np.diag(known - limit**-2.0)) @ across.T)
    lift = across @ _lift(campaign, fit, number, by_spin, beside)
    shown = lift - covariance @ across @ (pull - known * theta[part])
    reading = task.omega_world[task.seen("omega").any(axis=1)][0]
    return shown, covariance, across @ reading, float(np.linalg.norm(reading) / np.linalg.norm(v))


def _lift(campaign: Campaign, fit: CampaignFit, number: int, by_spin: Sequence[Placed], beside: Placed) -> Array:
    """``w`` (3,) 1/s with ``w x v`` the lift of flight ``number``, that by its spin, across the flight, and what it has ``beside``."""
    flight, theta = fit.state.flights[number].first, fit.state.theta[number]
    lift = lift_of(flight, campaign.sequences[number].setting, by_spin, theta)
    return np.asarray(np.cross(flight.v, lift) / (flight.v @ flight.v) + theta[beside[1]])


def _beside_all_others(fit: CampaignFit, number: int, of: NDArray[np.int64]) -> tuple[Array, Array]:
    """Information (k, k) and gradient (k,) of parameters ``of`` (k,) of a flight beside all others that it has for itself."""
    H, g = fit.equations[number].H, fit.equations[number].g
    others = np.setdiff1d(fit.layout.local, of)
    back = H[np.ix_(of, others)] @ stable_inverse(H[np.ix_(others, others)])
    return np.asarray(H[np.ix_(of, of)] - back @ H[np.ix_(others, of)]), np.asarray(g[of] - back @ g[others])
