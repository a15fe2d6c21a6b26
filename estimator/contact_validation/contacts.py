"""Where and how many bodies touch: contact axes, levers, collision matrices and contact velocities, side by side in arrays.

Everything is per unit mass of the body, which drops out of impulse laws. Axes are (tangent, tangent, normal), the normal pointing into the
particle. A *draw* of an impact moves its turn, velocities, corners and plate by what their uncertainties allow.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimator.contact.collision_matrix import contact_axes
from estimator.contact_validation.measured import OMEGA, TURN, MeasuredImpact, V

Array = NDArray[np.float64]
VIEWING = np.array([0.0, 0.0, 1.0])
"""Of the first camera, whose frame the world frame is."""
UNTILTED = (0.0, 0.0)
"""Tilt (rad) about either axis of a plate that stands as stated."""
FOLLOWING, BEFORE = [1, 2, 0], [2, 0, 1]
"""Of each coordinate, the next and the one before."""


@dataclass(frozen=True)
class Draws:
    """s draws of one impact: ``errors`` (s, 18) as its covariance has them, ``corners`` (s, c, 3) m, ``normal`` (s, 2) rad."""

    errors: Float[NDArray[np.float64], "draw 18"]
    corners: Float[NDArray[np.float64], "draw corner 3"]
    normal: Float[NDArray[np.float64], "draw 2"]

    @cached_property
    def turns(self) -> Float[NDArray[np.float64], "draw 3 3"]:
        """What each draw turns the body by, world axes."""
        return np.asarray(Rotation.from_rotvec(self.errors[:, TURN]).as_matrix())


@dataclass(frozen=True)
class Contacts:
    """n contacts: ``axes`` (n, 3, 3) rows; ``lever`` (n, 3) m; ``turning`` (n, 3, 3) 1/m², inverse of inertia over mass, world axes.

    ``v`` and ``omega`` (n, 3) before, ``plate_velocity`` (n, 3).
    """

    axes: Float[NDArray[np.float64], "n 3 3"]
    lever: Float[NDArray[np.float64], "n 3"]
    turning: Float[NDArray[np.float64], "n 3 3"]
    v: Float[NDArray[np.float64], "n 3"]
    omega: Float[NDArray[np.float64], "n 3"]
    plate_velocity: Float[NDArray[np.float64], "n 3"]

    def __len__(self) -> int:
        return len(self.v)

    @cached_property
    def matrices(self) -> Float[NDArray[np.float64], "n 3 3"]:
        """Collision matrices, contact axes: what an impulse over mass adds to the contact's velocity."""
        across = crossed(self.lever[:, None, :], self.axes)
        return np.eye(3) + np.einsum("nia,nab,njb->nij", across, self.turning, across)

    @cached_property
    def velocities(self) -> Float[NDArray[np.float64], "n 3"]:
        """Velocity of the contact point as seen from the plate, contact axes."""
        return np.einsum("nij,nj->ni", self.axes, self.v + crossed(self.omega, self.lever) - self.plate_velocity)

    def after(self, impulses: Float[NDArray[np.float64], "n 3"]) -> Float[NDArray[np.float64], "n 6"]:
        """V and omega after ``impulses`` over mass (m/s, contact axes)."""
        push = np.einsum("nij,ni->nj", self.axes, impulses)
        turn = np.einsum("nij,nj->ni", self.turning, crossed(self.lever, push))
        return np.concatenate([self.v + push, self.omega + turn], axis=1)

    def responses(self) -> Float[NDArray[np.float64], "n 6 3"]:
        """What an impulse over mass, world axes, adds to v and omega: ``[1; I⁻¹ [r]ₓ]``."""
        across = crossed(self.lever[:, None, :], np.eye(3)[None])
        return np.concatenate([np.broadcast_to(np.eye(3), self.turning.shape), np.einsum("nij,nkj->nik", self.turning, across)], axis=1)


def nominal(impacts: Sequence[MeasuredImpact], tilt: tuple[float, float] = UNTILTED) -> Contacts:
    """The contacts as measured, on plates turned by ``tilt`` (rad, see :func:`tilted`) against what is stated of them."""
    return _nominal(tuple(impacts), tilt)


@lru_cache(maxsize=64)
def _nominal(impacts: tuple[MeasuredImpact, ...], tilt: tuple[float, float]) -> Contacts:
    return joined([_one(impact, tilt) for impact in impacts])


def drawn(impact: MeasuredImpact, draws: Draws) -> Contacts:
    """One contact per draw."""
    turns, axes = draws.turns, _turned_axes(impact, draws.normal)
    arms = drawn_corners(impact, draws)
    lowest = np.einsum("sci,si->sc", arms, axes[:, 2]).argmin(axis=1)
    state, count = impact.state, len(turns)
    inverse = impact.turning
    return Contacts(
        axes=axes,
        lever=arms[np.arange(count), lowest],
        turning=turns @ inverse @ np.swapaxes(turns, 1, 2),
        v=state.v_world + draws.errors[:, V],
        omega=state.omega_world + draws.errors[:, OMEGA],
        plate_velocity=np.tile(impact.plate.velocity_world, (count, 1)),
    )


def drawn_corners(impact: MeasuredImpact, draws: Draws) -> Float[NDArray[np.float64], "draw corner 3"]:
    """The low corners of each draw, m from its centre of mass, world axes."""
    return np.asarray(np.einsum("sij,scj->sci", draws.turns, impact.low_corners + draws.corners))


def joined(parts: Sequence[Contacts]) -> Contacts:
    """Contacts one after another."""
    return Contacts(*(np.concatenate([getattr(p, name) for p in parts]) for name in Contacts.__dataclass_fields__))


def tilted(normal: Array, tilt: tuple[float, float]) -> Float[NDArray[np.float64], "3"]:
    """``normal`` (3,) turned by two small angles: about the plate's direction away from the camera, and about its direction across."""
    if tilt == UNTILTED:
        return normal
    across = np.cross(normal, VIEWING)
    if np.linalg.norm(across) < 1e-6:
        across = np.array([1.0, 0.0, 0.0])
    across = across / np.linalg.norm(across)
    along = np.cross(across, normal)
    return np.asarray(Rotation.from_rotvec(tilt[0] * along).apply(Rotation.from_rotvec(tilt[1] * across).apply(normal)))


def crossed(a: Array, b: Array) -> Float[NDArray[np.float64], "*batch 3"]:
    """``a × b`` along the last axis, without the generality of NumPy's; ``a``, ``b`` (..., 3), any units, one frame."""
    return np.asarray(a[..., FOLLOWING] * b[..., BEFORE] - a[..., BEFORE] * b[..., FOLLOWING])


def _turned_axes(impact: MeasuredImpact, turns: Array) -> Array:
    """Contact axes (s, 3, 3) of the plate turned by small angles (s, 2) about its tangents."""
    axes = contact_axes(impact.plate.normal_world)
    vectors = turns[:, :1] * axes[0] + turns[:, 1:] * axes[1]
    return np.asarray(np.einsum("ij,skj->sik", axes, Rotation.from_rotvec(vectors).as_matrix()))


@lru_cache(maxsize=4096)
def _one(impact: MeasuredImpact, tilt: tuple[float, float]) -> Contacts:
    axes = _axes_of(tuple(impact.plate.normal_world.tolist()), tilt)
    corners = impact.low_corners
    lever = corners[int(np.argmin(corners @ axes[2]))]
    state = impact.state
    rows = (axes, lever, impact.turning, state.v_world, state.omega_world, impact.plate.velocity_world)
    return Contacts(*(np.asarray(row, dtype=np.float64)[None] for row in rows))


@lru_cache(maxsize=4096)
def _axes_of(normal: tuple[float, ...], tilt: tuple[float, float]) -> Array:
    """Contact axes of a plate, the same for all impacts on it."""
    return contact_axes(tilted(np.array(normal), tilt))
