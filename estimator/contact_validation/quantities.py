"""What one measured impact says of the contact, each number with its standard deviation: corner, normal, velocities, impulse, restitution.

The impulse over mass is the P that explains both jumps best, Δv = P and Δω = I⁻¹ (r × P), by least squares under their covariance; what is
left over, a chi-squared with three degrees of freedom, says whether the jumps can come from one contact at that corner. Stronge's e
is the one for which the rigid impulse at the fitted friction gives the normal impulse measured: its work of restitution is e² times
that of compression. Uncertainties come from joint draws of pose, velocities, corners and plate (:mod:`.spread`).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.stats import f as fisher

from estimator.contact.sliding_kernel import STRONGE, follow_many
from estimator.contact_validation.contacts import Contacts, drawn, nominal
from estimator.contact_validation.measured import CANDIDATE_SHARE, OMEGA_AFTER, V_AFTER, MeasuredImpact
from estimator.contact_validation.next_contacts import APART_SHARE
from estimator.contact_validation.spread import draws_of

Array = NDArray[np.float64]
BISECTIONS = 18
"""Of a restitution between 0 and 1.5: known to 6e-6."""
DRAWS = 200
"""Of pose, velocities, corners and plate, in pairs of opposite sign; standard deviations are known to 7% by them."""
LEFT = 3
"""Numbers that an impulse leaves of the six of a jump."""
ONE_CONTACT_P = 1e-4
"""Below it the jumps of velocity and spin do not belong to one contact at the corner that touched."""


@dataclass(frozen=True)
class Contact:
    """One impact as its measurement shows it.

    ``point_body`` (3,) m; ``corner_clearance_m``: how much higher the next place that might touch is. ``u_before`` and ``u_after`` (3,)
    m/s of the corner along two tangents and the normal (contact axes), ``u_before_sigma`` and ``u_after_sigma`` (3,) m/s.
    ``normal_impulse`` and ``tangential_impulse`` over mass (m/s), their ``ratio``, ``restitution``; ``angle_rad`` between the corner's
    velocity and the normal. ``one_contact_p``: of a misfit at least this large.
    """

    name: str
    point_body: Array
    corner_clearance_m: float
    u_before: Array
    u_before_sigma: Array
    u_after: Array
    u_after_sigma: Array
    normal_impulse: tuple[float, float]
    tangential_impulse: tuple[float, float]
    ratio: tuple[float, float]
    restitution: tuple[float, float]
    angle_rad: float
    one_contact_p: float


def contact_of(impact: MeasuredImpact, friction: float, rng: np.random.Generator) -> Contact:
    """The contact of one impact; ``friction`` that of the fitted impulse model."""
    draws = draws_of(impact, rng, DRAWS)
    here, there = nominal([impact]), drawn(impact, draws)
    jumps = _jump(impact.after[None], here)
    errors = np.concatenate([draws.errors[:, V_AFTER], draws.errors[:, OMEGA_AFTER]], axis=1)
    drawn_jumps = _jump(impact.after + errors, there)
    weight = np.asarray(np.linalg.inv(_spread_of_jumps(there, drawn_jumps, here, jumps)), dtype=np.float64)
    impulse, misfit = _impulses(here, jumps, weight)
    impulses, _ = _impulses(there, drawn_jumps, weight)
    e, es = restitutions(here, impulse, friction), restitutions(there, impulses, friction)
    u, us = here.velocities, there.velocities
    w, ws = _after(here, impulse), _after(there, impulses)
    tangential, tangentials = (np.linalg.norm(p[:, :2], axis=1) for p in (impulse, impulses))
    return Contact(
        name=impact.name,
        point_body=impact.state.R_world_body.T @ here.lever[0],
        corner_clearance_m=clearance_m(impact),
        u_before=u[0],
        u_before_sigma=_about(us, u[0]),
        u_after=w[0],
        u_after_sigma=_about(ws, w[0]),
        normal_impulse=_pair(impulse[0, 2], impulses[:, 2]),
        tangential_impulse=_pair(tangential[0], tangentials),
        ratio=_pair(tangential[0] / max(impulse[0, 2], 1e-12), tangentials / np.maximum(impulses[:, 2], 1e-12)),
        restitution=_pair(e[0], es),
        angle_rad=float(np.arctan2(np.linalg.norm(u[0, :2]), -u[0, 2])),
        one_contact_p=_one_contact_p(float(misfit[0])),
    )


def _one_contact_p(misfit: float) -> float:
    """Probability of a misfit of three numbers whose covariance is known from draws, in pairs of opposite sign [Hotelling 1931]."""
    known = DRAWS // 2
    return float(fisher.sf(misfit * (known - LEFT + 1) / (known * LEFT), LEFT, known - LEFT + 1))


def restitutions(contacts: Contacts, impulses: Array, friction: float) -> Float[NDArray[np.float64], " n"]:
    """Stronge's e (n,) for which rigid contacts at ``friction`` give the normal ones of ``impulses`` (n, 3) m/s, contact axes."""
    K, u = contacts.matrices, contacts.velocities
    low, high = np.zeros(len(u)), np.full(len(u), 1.5)
    struck = u[:, 2] < 0.0
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        after = np.zeros_like(u)
        after[struck] = follow_many(K[struck], u[struck], middle[struck], np.full(int(struck.sum()), friction), STRONGE)[:, :3]
        normal = np.linalg.solve(K, (after - u)[:, :, None])[:, 2, 0]
        more = normal < impulses[:, 2]
        low, high = np.where(more, middle, low), np.where(more, high, middle)
    return np.asarray(0.5 * (low + high))


def clearance_m(impact: MeasuredImpact) -> float:
    """How much higher (m) than the corner that touches the next place of the hull is, one well away from it."""
    heights = impact.low_corners @ impact.plate.normal_world
    lowest = int(np.argmin(heights))
    away = np.linalg.norm(impact.low_corners - impact.low_corners[lowest], axis=1) > APART_SHARE * impact.extent_m
    return float(heights[away].min() - heights[lowest]) if away.any() else CANDIDATE_SHARE * impact.extent_m


def inconsistent(contacts: Sequence[Contact]) -> tuple[str, ...]:
    """Names of impacts whose jumps do not belong to one contact."""
    return tuple(c.name for c in contacts if c.one_contact_p < ONE_CONTACT_P)


def _jump(after: Array, contacts: Contacts) -> Array:
    return np.asarray(after - np.concatenate([contacts.v, contacts.omega], axis=1))


def _spread_of_jumps(there: Contacts, drawn_jumps: Array, here: Contacts, jumps: Array) -> Array:
    """Covariance (6, 6) of jumps less what the best impulse makes of them at each drawn corner."""
    push = jumps[:, :3]
    off = drawn_jumps - jumps - np.einsum("nij,nj->ni", there.responses() - here.responses(), np.repeat(push, len(there), axis=0))
    matrix = off.T @ off / len(off)
    return np.asarray(matrix + 1e-9 * np.diag(np.diag(matrix)))


def _impulses(contacts: Contacts, jumps: Array, weight: Array) -> tuple[Array, Array]:
    """Impulses over mass (n, 3), contact axes, that explain ``jumps`` (n, 6) best, and chi-squared of what is left."""
    response = contacts.responses()
    normal_matrix = np.einsum("nia,ij,njb->nab", response, weight, response)
    push = np.linalg.solve(normal_matrix, np.einsum("nia,ij,nj->na", response, weight, jumps)[:, :, None])[:, :, 0]
    left = jumps - np.einsum("nia,na->ni", response, push)
    return np.einsum("nij,nj->ni", contacts.axes, push), np.einsum("ni,ij,nj->n", left, weight, left)


def _after(contacts: Contacts, impulses: Array) -> Array:
    return np.asarray(contacts.velocities + np.einsum("nij,nj->ni", contacts.matrices, impulses))


def _about(values: Array, centre: Array) -> Array:
    return np.sqrt(np.mean((values - centre) ** 2, axis=0))


def _pair(value: float, values: Array) -> tuple[float, float]:
    return float(value), float(np.sqrt(np.mean((values - value) ** 2)))
