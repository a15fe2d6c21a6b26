"""Parameters as files tell them: what the instrument does to the body is in the body's own mass properties, not beside them.

The amplitudes of a surface mean nothing without it. Centre of mass and inertia of the body are linear in them, so values and covariance
follow with its derivatives: ``com + B a`` for ``com`` and ``a``. What positions wander by is noise, and left out: all else is uncertain by
it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimator.effects.model import Model, overrides
from estimator.fitting.campaigns.campaign import Campaign, CampaignFit
from estimator.fitting.campaigns.campaign_covariance import CampaignCovariance
from estimator.motion.flight import LAYOUT, Flight

Array = NDArray[np.float64]
BODY = LAYOUT.columns(["com", "inertia"])
"""Where mass properties lie among a flight's parameters."""


@dataclass(frozen=True)
class Told:
    """Parameters of every sequence: ``flights``, ``theta`` (q,) of the ``model``, and the ``covariance`` of all."""

    model: Model
    flights: tuple[Flight, ...]
    theta: tuple[Array, ...]
    covariance: CampaignCovariance

    @property
    def names(self) -> tuple[str, ...]:
        """Of a sequence's 21 + q parameters."""
        return self.model.layout.labels

    def values(self, number: int) -> Array:
        """Values (21 + q,) of sequence ``number``."""
        flight = self.flights[number]
        return np.concatenate([flight.values, self.theta[number]])


def told_parameters(campaign: Campaign, fit: CampaignFit, covariance: CampaignCovariance) -> Told:
    """Parameters of a fit with the ``covariance`` of all."""
    untold = Model(tuple(e for e in fit.model.effects if e.instrument and overrides(e, "body", "tracked")))
    if not untold.effects:
        return Told(fit.model, fit.state.flights, fit.state.theta, covariance)
    columns = fit.model.layout.columns(untold.keys)
    within = columns - LAYOUT.size
    other = np.delete(np.arange(fit.model.layout.size), columns)
    model = Model(tuple(e for e in fit.model.effects if e not in untold.effects))
    thetas = tuple(np.delete(each, within) for each in fit.state.theta)
    flights, with_bodies = _with_surfaces(campaign, fit, covariance)
    return Told(model, flights, thetas, _taken(with_bodies, [rows[other] for rows in covariance.place]))


def _with_surfaces(campaign: Campaign, fit: CampaignFit, covariance: CampaignCovariance) -> tuple[tuple[Flight, ...], Array]:
    """Flights of bodies with their surfaces, and the covariance (p, p) of all parameters then."""
    ours = Model(tuple(e for e in fit.model.effects if e.instrument and overrides(e, "body")))
    if not ours.effects:
        return fit.state.flights, covariance.covariance
    columns = fit.model.layout.columns(ours.keys)
    within = columns - LAYOUT.size
    G, flights = np.eye(len(covariance.covariance)), []
    for number, (sequence, flight, theta) in enumerate(zip(campaign.sequences, fit.state.flights, fit.state.theta, strict=True)):
        rows, change = covariance.place[number], ours.body(theta[within], sequence.setting)
        by_effect = [e.body_by(theta[within][part], sequence.setting) for e, part in zip(ours.effects, ours.slices, strict=True)]
        G[np.ix_(rows[BODY], rows[columns])] = np.hstack(by_effect)
        flights.append(replace(flight, com=flight.com + change.com, inertia=flight.inertia + change.inertia))
    return tuple(flights), np.asarray(G @ covariance.covariance @ G.T)


def _taken(covariance: Array, place: Sequence[NDArray[np.int64]]) -> CampaignCovariance:
    """The covariance of the parameters that sequences have at ``place`` alone."""
    kept = np.unique(np.concatenate(place))
    return CampaignCovariance(covariance[np.ix_(kept, kept)], tuple(np.searchsorted(kept, rows) for rows in place))
