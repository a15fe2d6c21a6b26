"""What an impact at one point does under whatever physics is in the model: the reduced laws that the ladder is made of.

The base is the rigid impulse with Coulomb friction and Stronge's restitution. Each addition is one number that is nothing at 0:

* ``compliance``: normal over tangential stiffness of the contact (Mindlin's springs: 2 (1-ν) / (2-ν) inverted, about 1.15).
* ``slowing``: e falls with the power ``-slowing`` of the speed √(2 |W_c| / m) of compression (fully plastic contact: 1/4).
* ``adhesion`` (m²/s²): energy over mass that parting costs, taken by a pull along the normal after restitution, without friction.
* ``recoil``: mass of the particle over that of a plate which gives way along its normal as a free mass.
* ``tilt``, ``tilt_across`` (rad): turn of the plate against what is stated of it, the same about the axes of every plate.

The work of compression W_c does not depend on e; it is found first, then e follows from it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from datasets.errors import InputError, TumbleError
from estimator.contact.constants import require_friction, require_restitution
from estimator.contact.sliding_kernel import STRONGE, follow_many
from estimator.contact_validation.contacts import Contacts, nominal
from estimator.contact_validation.laws.lumped_kernel import MOST_STEPS, spring_many
from estimator.contact_validation.measured import MeasuredImpact

Array = NDArray[np.float64]
REFERENCE_SPEED_MS = 1.0
"""Speed of compression at which ``restitution`` is stated."""
STIFFEST = 0.02
"""Tangential compliance below which springs are too stiff to be integrated; from there to the rigid contact at 0 goes a straight line.

See notebook 24."""
SLOWEST_MS = 1e-6
"""Speed of approach below which nothing is struck: rounding."""


@dataclass(frozen=True)
class PointContact:
    """The constants of an impact at one point; what is left at 0 is not there.

    Raises
    ------
    InputError
        Where a constant is impossible.
    """

    restitution: float
    friction: float = 0.0
    compliance: float = 0.0
    slowing: float = 0.0
    adhesion: float = 0.0
    recoil: float = 0.0
    tilt: float = 0.0
    tilt_across: float = 0.0

    def __post_init__(self) -> None:
        require_restitution(self.restitution)
        require_friction(self.friction)
        for name in ("compliance", "adhesion", "recoil"):
            if not getattr(self, name) >= 0.0:
                raise InputError(f"{name}: expected a number from 0 upwards, got {getattr(self, name):g}")

    def after(self, impacts: Sequence[MeasuredImpact]) -> Float[NDArray[np.float64], "impact 6"]:
        """V and omega after each impact, world frame, from the state measured before it."""
        return self.after_contacts(nominal(impacts, (self.tilt, self.tilt_across)))

    def after_contacts(self, contacts: Contacts) -> Float[NDArray[np.float64], "n 6"]:
        """The same for contacts that are given; a point that leaves the plate is not struck."""
        return contacts.after(self.impulses(contacts))

    def impulses(self, contacts: Contacts) -> Float[NDArray[np.float64], "n 3"]:
        """Impulses over mass (m/s), contact axes."""
        K, u = contacts.matrices.copy(), contacts.velocities
        K[:, 2, 2] += self.recoil
        struck = np.flatnonzero(u[:, 2] < -SLOWEST_MS)
        impulses = np.zeros((len(contacts), 3))
        if struck.size:
            K, u = np.ascontiguousarray(K[struck]), np.ascontiguousarray(u[struck])
            change = self.parted(K, self._velocities_after(K, u)) - u
            impulses[struck] = np.linalg.solve(K, change[:, :, None])[:, :, 0]
        return impulses

    def parted(self, K: Array, u: Array) -> Float[NDArray[np.float64], "n 3"]:
        """Velocities (n, 3) of contacts that had ``u`` at the end of restitution, once adhesion has let go; at rest where it does not.

        ``K`` (n, 3, 3) of bodies of unit mass; ``u`` (n, 3) m/s, contact axes, normal last.
        """
        if self.adhesion == 0.0:
            return u
        left = np.sqrt(np.maximum(u[:, 2] ** 2 - 2.0 * self.adhesion * K[:, 2, 2], 0.0))
        pull = np.where(u[:, 2] > 0.0, (left - u[:, 2]) / K[:, 2, 2], 0.0)
        return np.asarray(u + K[:, :, 2] * pull[:, None])

    def _velocities_after(self, K: Array, u: Array) -> Array:
        e = np.full(len(u), self.restitution) if self.slowing == 0.0 else self.restitutions(compression_work(K, u, self.friction))
        if self.compliance >= STIFFEST:
            return _sprung(K, u, e, self.friction, 1.0 / self.compliance)
        rigid = np.asarray(follow_many(K, u, e, np.full(len(u), self.friction), STRONGE)[:, :3])
        if self.compliance == 0.0:
            return rigid
        stiffest = _sprung(K, u, e, self.friction, 1.0 / STIFFEST)
        return rigid + self.compliance / STIFFEST * (stiffest - rigid)

    def restitutions(self, work: Array) -> Float[NDArray[np.float64], " n"]:
        """Stronge's e of contacts whose compression took ``work`` (n,) over mass, m²/s², above 0."""
        speed = np.sqrt(2.0 * work)
        return np.minimum(self.restitution * (speed / REFERENCE_SPEED_MS) ** -self.slowing, 1.0)


def _sprung(K: Array, u: Array, e: Array, friction: float, stiffness: float) -> Array:
    after = np.asarray(spring_many(K, u, e, friction, stiffness))
    unending = np.flatnonzero(~np.isfinite(after).all(axis=1))
    if unending.size:
        raise TumbleError(
            f"contact {unending[0]} on springs of {stiffness:g}, friction {friction:g}, restitution {e[unending[0]]:g}: "
            f"expected that it parts within {MOST_STEPS} steps; it did not."
        )
    return after


def compression_work(K: Array, u: Array, friction: float) -> Float[NDArray[np.float64], " n"]:
    """Work over mass (m²/s², above 0) that rigid contacts (n, 3, 3), (n, 3) take up to their greatest compression.

    ``K`` (n, 3, 3) of bodies of unit mass; ``u`` (n, 3) m/s, contact axes, normal last.
    """
    followed = follow_many(K, u, np.zeros(len(u)), np.full(len(u), friction), STRONGE)
    return np.maximum(-followed[:, 3], 1e-12)


def point_contact(values: Mapping[str, float]) -> PointContact:
    """The constants by name; those left out are 0."""
    known = {f.name for f in fields(PointContact)}
    unknown = sorted(set(values) - known)
    if unknown:
        raise InputError(f"contact constants: expected some of {', '.join(sorted(known))}, got {', '.join(unknown)}")
    return PointContact(**values)
