"""How far prediction and measurement may lie apart although the model is right: the covariance of the residual of each impact.

The state before an impact is measured, so a prediction has the uncertainty of that measurement, sent through the law; the velocities after
it have their own, and both belong to one fit and are correlated. Corners of the hull and the plate's normal are uncertain, too. All of
it is drawn jointly and sent through the contact, so that another corner that may have touched, first or right after the first, or a
contact that may have stuck, counts.

One law carries the uncertainty for all models that are compared: no model can buy itself slack by being wild. That is the rigid impulse
with friction, until held-out impacts accept another; what more may be missing is judged under the uncertainty which that one carries. A
contact that springs back along the plate makes more of an error of its corner than one that sticks.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from estimator.contact_validation.contacts import Draws, drawn, drawn_corners
from estimator.contact_validation.fitting import Fitted, Impacts, fit
from estimator.contact_validation.laws.models import RIGID
from estimator.contact_validation.laws.point_contact import PointContact, point_contact
from estimator.contact_validation.measured import OMEGA_AFTER, V_AFTER, MeasuredImpact
from estimator.contact_validation.next_contacts import next_contacts

Array = NDArray[np.float64]
DRAWS = 160
"""Of errors of one impact, in pairs of opposite sign; standard deviations are known to 8% by them."""
ALIKE_SHARE = 0.1
"""Part of the hull's extent over which errors of its corners are alike."""
WAVES = 24
"""Random waves that make a smooth field of errors over the hull [Rahimi and Recht 2007]."""
SMALL_CHANGE = 0.01
"""Change of restitution for a difference quotient."""
ROUNDS = 2
"""Of fitting a law and the uncertainty that it carries in turn."""
START = PointContact(0.6, 0.2)
"""Constants that carry the uncertainty before any are fitted."""
FLOOR = 1e-9
"""Over the largest variance of a residual's component, so that no direction counts as known exactly."""


def draws_of(impact: MeasuredImpact, rng: np.random.Generator, count: int = DRAWS) -> Draws:
    """Errors of one impact as its covariance has them, in pairs of opposite sign."""
    values, vectors = np.linalg.eigh(impact.covariance)
    half = count // 2
    errors = rng.normal(size=(half, 18)) * np.sqrt(np.maximum(values, 0.0)) @ vectors.T
    corners = impact.corner_sigma_m * smooth_fields(impact.low_corners / (ALIKE_SHARE * impact.extent_m), half, rng)
    normal = impact.plate.normal_sigma_rad * rng.normal(size=(half, 2))
    return Draws(*(np.concatenate([part, -part]) for part in (errors, corners, normal)))


def smooth_fields(places: Array, count: int, rng: np.random.Generator) -> Float[NDArray[np.float64], "count place 3"]:
    """``count`` random vector fields of variance one, alike within a length of one, at ``places`` (n, 3), units of that, any frame.

    Neighbouring corners of a hull are off together: they were carved by the same views [Rahimi & Recht 2007].
    """
    waves = rng.normal(size=(3, WAVES))
    features = np.concatenate([np.cos(places @ waves), np.sin(places @ waves)], axis=1) / np.sqrt(WAVES)
    return np.einsum("pw,cwk->cpk", features, rng.normal(size=(count, 2 * WAVES, 3)))


def residual_covariances(
    impacts: Sequence[MeasuredImpact], law: PointContact, rng: np.random.Generator
) -> Float[NDArray[np.float64], "impact 6 6"]:
    """Covariance of measured less predicted (v, omega) after each impact, if ``law`` were nature's."""
    return np.stack([_covariance(residual_draws(impact, law, draws_of(impact, rng))) for impact in impacts])


def scattering_of(impacts: Sequence[MeasuredImpact], law: PointContact) -> Float[NDArray[np.float64], "impact 6"]:
    """What a restitution that is higher by one does to v and omega after each impact, by a difference."""
    low = max(0.0, min(law.restitution, 1.0 - SMALL_CHANGE) - SMALL_CHANGE)
    lower, higher = (replace(law, restitution=e).after(impacts) for e in (low, low + 2.0 * SMALL_CHANGE))
    return np.asarray((higher - lower) / (2.0 * SMALL_CHANGE))


def prepared(impacts: Sequence[MeasuredImpact], rng_seed: int) -> Impacts:
    """Impacts with their whitening, under the rigid impulse with friction that fits them best."""
    law = START
    for _ in range(ROUNDS):
        ready = _under(impacts, law, rng_seed)
        law = PointContact(*fit(ready, RIGID).values.tolist())
    return ready


def carried(impacts: Impacts, fitted: Fitted, rng_seed: int) -> tuple[Impacts, Fitted]:
    """The impacts with their whitening under an impulse model with additions, and its fit to them.

    What a tilt of the plate changes of the uncertainty (another corner, a contact that sticks) is neglected.
    """
    for _ in range(ROUNDS):
        law = replace(point_contact(fitted.by_name), tilt=0.0, tilt_across=0.0)
        impacts = _under(impacts.measured, law, rng_seed)
        fitted = fit(impacts, fitted.model, known=(fitted.values,), scatter=fitted.scatter)
    return impacts, fitted


def _under(impacts: Sequence[MeasuredImpact], law: PointContact, rng_seed: int) -> Impacts:
    """Impacts with the whitening that a law gives them."""
    whitening = np.linalg.inv(np.linalg.cholesky(residual_covariances(impacts, law, np.random.default_rng(rng_seed))))
    return Impacts(tuple(impacts), whitening, np.einsum("nij,nj->ni", whitening, scattering_of(impacts, law)))


def predicted_covariance(impact: MeasuredImpact, law: PointContact, draws: Draws) -> Float[NDArray[np.float64], "6 6"]:
    """Covariance of what ``law`` predicts, from the uncertainty of the state before, the corners and the plate alone."""
    return _covariance(_predicted(impact, law, draws) - law.after([impact])[0])


def residual_draws(impact: MeasuredImpact, law: PointContact, draws: Draws) -> Float[NDArray[np.float64], "draw 6"]:
    """Errors of what is measured after the impact less those of what is predicted."""
    predicted = _predicted(impact, law, draws)
    measured = np.concatenate([draws.errors[:, V_AFTER], draws.errors[:, OMEGA_AFTER]], axis=1)
    return np.asarray(measured - (predicted - law.after([impact])[0]))


def _predicted(impact: MeasuredImpact, law: PointContact, draws: Draws) -> Float[NDArray[np.float64], "draw 6"]:
    """V and omega after the impact of each draw: of one contact, and of the next where it follows at once."""
    first = drawn(impact, draws)
    after = law.after_contacts(first)
    following = next_contacts(first, after, drawn_corners(impact, draws), impact.extent_m)
    after[following.struck] = law.after_contacts(following.contacts)
    return after


def _covariance(draws: Array) -> Array:
    """About zero: where another corner may have touched the mean of the draws is off, and that is uncertainty, too."""
    matrix = draws.T @ draws / len(draws)
    scale = np.sqrt(np.diag(matrix))
    return np.asarray(matrix + FLOOR * np.diag(scale**2))
