"""Detection limits in one field campaign: how large an effect must be there to be found.

They come from the Fisher information of the campaign flown with its noise alone. The score test of an effect of the size ``theta`` has
the noncentrality ``theta' I theta``, ``I`` the information after flights and the campaign's other hidden effects were adjusted; the limit
is where the test passes its corrected level in 95% of cases, as in :mod:`tumble.challenge.limits`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from datasets.errors import InputError
from datasets.vocabulary.effects import EffectEntry
from estimator.data.configuration import Configuration
from estimator.diagnosis.diagnose import ALPHA
from estimator.diagnosis.selection.linearised import Linearised, linearised
from estimator.effects.choosing import catalogue
from estimator.effects.model import Model
from estimator.fitting.campaigns.base_model import base_fit
from estimator.fitting.campaigns.campaign import Campaign, CampaignFit, CampaignState, fit_campaign
from estimator.fitting.campaigns.registered import Registered
from estimator.fitting.stable_inverse import stable_inverse
from estimator.measurements.silhouettes.registration import register
from estimator.measurements.trajectories.registering import register_trajectories, task_of
from tumble.challenge.field_case import FieldCase
from tumble.challenge.field_flights import STATED_S, exact_with_noise, flown, measured, without_effects
from tumble.challenge.field_silhouettes import observed
from tumble.challenge.limits import noncentrality

Array = NDArray[np.float64]
FOUND = 0.95
LEFT_DEGREES = 6
"""Degrees of freedom of what is left of a force outside of the catalogue: a force and a torque."""


@dataclass(frozen=True)
class Known:
    """What a campaign with its noise alone says of every effect; ``pictures``: whether it was measured in pictures."""

    campaign: Campaign
    fit: CampaignFit
    of: Linearised
    pictures: bool

    def entry(self, key: str) -> EffectEntry:
        """The effect with the ranges that are plausible in these measurements."""
        return self.of.effects[self.of.keys.index(key)].entry

    @property
    def level(self) -> float:
        """The p-value that the test of one effect has to pass."""
        return ALPHA / max(len(self.of.keys), 1)


def known(case: FieldCase) -> Known:
    """Fly a campaign with its noise alone, fit it and look at the information on every effect."""
    registered = registered_case(without_effects(case))
    fit = _fitted(case, registered)
    return Known(registered.campaign, fit, linearised(registered.campaign, fit, catalogue()), case.scene is not None)


def _fitted(case: FieldCase, registered: Registered) -> CampaignFit:
    """Free flight; in pictures whose stamps are rounded beside random times of that size, which are no noise of outlines."""
    campaign, start = registered.campaign, registered.start
    if case.scene is None or not case.noise.rounded:
        return base_fit(campaign, start)
    base, jitter = campaign.kind.base, catalogue()["trigger_jitter"]
    values = np.append(np.zeros(base.size), STATED_S / np.sqrt(12.0))
    state = CampaignState(start.flights, tuple(values for _ in start.flights))
    return fit_campaign(campaign, state, Model((*base.effects, jitter)))


def registered_case(case: FieldCase) -> Registered:
    """A campaign as the solver would register it.

    Raises
    ------
    InputError
        Where a flight cannot be measured.
    """
    if case.scene is None:
        return register_trajectories([measured(case, number) for number in range(len(case.flights))])
    registered = register(observed(case), Configuration())
    if registered.left_out:
        raise InputError(f"{registered.left_out[0].name}: expected flights that can be measured, got {registered.left_out[0].reason}")
    return registered


def limit_along(of: Known, key: str, sizes: Array, beside: Sequence[str] = ()) -> float:
    """What ``sizes`` (flights or 1, q) must be multiplied with to be found ``beside`` other effects; infinite where nothing shows."""
    rows, direction = _rows(of, key, sizes)
    others = [row for other in beside if other in of.of.keys and other != key for row in of.of.rows(of.of.keys.index(other))]
    G = of.of.information
    own = G[np.ix_(rows, rows)]
    if others:
        cross = G[np.ix_(rows, others)]
        own = own - cross @ stable_inverse(G[np.ix_(others, others)]) @ cross.T
    strength = float(direction @ own @ direction)
    least = 1e-9 * float(direction @ G[np.ix_(rows, rows)] @ direction)
    if not strength > max(least, 0.0):
        return float("inf")
    return float(np.sqrt(noncentrality(of.level, len(rows), FOUND) / strength))


def _rows(of: Known, key: str, sizes: Array) -> tuple[list[int], Array]:
    """Columns of an effect and the sizes (c,) there."""
    number, entry = of.of.keys.index(key), of.entry(key)
    rows = [int(row) for row in of.of.rows(number)]
    columns = [of.of.columns[row] for row in rows]
    own = entry.scope.own
    order = [entry.sizes.index(entry.names[column.parameter]) for column in columns]
    return rows, np.array([sizes[(column.sequence or 0) if own else 0, i] for column, i in zip(columns, order, strict=True)])


def left_of(of: Known, case: FieldCase) -> float:
    """Noncentrality of what the best effect that flights share leaves of a case's effects, flown without noise."""
    tasks = []
    for number, like in enumerate(of.campaign.sequences):
        task = task_of(exact_with_noise(_silent(case), number, flown(case, number)))
        tasks.append(replace(task, sigma=like.sigma, repeats=like.repeats))
    campaign = replace(of.campaign, sequences=tuple(tasks))
    fit = base_fit(campaign, CampaignState(of.fit.state.flights, of.fit.state.theta))
    looked = linearised(campaign, fit, catalogue())
    return max(_left(looked), 0.0)


def left_in_pictures(of: Known, case: FieldCase) -> float:
    """The same of silhouettes: flown with its noise, what is left beyond what is left of the campaign with its noise alone."""
    registered = registered_case(case)
    looked = linearised(registered.campaign, _fitted(case, registered), catalogue())
    return max(_left(looked) - _left(of.of), 0.0)


def _left(looked: Linearised) -> float:
    """What the best effect that flights share leaves of the misfit."""
    gains = [0.0]
    for number, effect in enumerate(looked.effects):
        rows = looked.rows(number)
        if len(rows) and not effect.entry.scope.own:
            gains.append(float(looked.pull[rows] @ stable_inverse(looked.information[np.ix_(rows, rows)]) @ looked.pull[rows]))
    return looked.misfit - max(gains)


def _silent(case: FieldCase) -> FieldCase:
    """The case without noise, its time stamps as they are."""
    return replace(case, noise=replace(case.noise, sigma=dict.fromkeys(case.noise.sigma, 0.0), outliers=0.0, rounded=False))


def left_at_limit(of: Known) -> float:
    """The noncentrality at which what is left of something outside of the catalogue is found."""
    return noncentrality(of.level, LEFT_DEGREES, FOUND)
