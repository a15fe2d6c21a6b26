"""The collision matrix of one contact and the velocities there.

``u = v + ω × r`` and ``K = 1/m - [r]ₓ I⁻¹ [r]ₓ``, so that an impulse P at the contact changes u by K P [Mirtich 1996, section 3.2].
Everything in a contact frame is ordered (tangent, tangent, normal), the normal pointing into the particle.
"""

import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.plate import Plate
from estimator.contact.solid import BodyState, Solid

Array = NDArray[np.float64]


def skew(r: Array) -> Array:
    """``[r]ₓ`` (3, 3), with ``[r]ₓ a = r × a``; ``r`` (3,), any unit and frame."""
    return np.array([[0.0, -r[2], r[1]], [r[2], 0.0, -r[0]], [-r[1], r[0], 0.0]])


def collision_matrix(mass_kg: float, inertia: Array, lever: Array) -> Array:
    """K (3, 3) in 1/kg for a contact at ``lever`` (3,) m from the centre of mass; same axes as ``inertia`` (3, 3) kg m²."""
    across = skew(lever)
    return np.asarray(np.eye(3) / mass_kg - across @ np.linalg.solve(inertia, across))


def contact_axes(normal: Array) -> Array:
    """Rows (3, 3): two tangents and the unit ``normal``, right-handed; the first tangent as close to an axis as the normal allows.

    ``normal`` (3,), world frame.
    """
    n = normal / np.linalg.norm(normal)
    first = np.eye(3)[int(np.argmin(np.abs(n)))]
    first = first - (first @ n) * n
    first = first / np.linalg.norm(first)
    return np.stack([first, np.cross(n, first), n])


def contact_velocity(state: BodyState, lever: Array, plate: Plate) -> Array:
    """Velocity (3,) m/s, world frame, of the particle's contact point as seen from the plate.

    ``lever`` (3,) m from the centre of mass, world frame.
    """
    return np.asarray(state.v_world + np.cross(state.omega_world, lever) - plate.velocity_world)


def after_impulse(state: BodyState, solid: Solid, lever: Array, impulse_world: Array) -> BodyState:
    """The state just after ``impulse_world`` (3,) N s at ``lever`` (3,) m from the centre of mass, world frame; pose unchanged."""
    turned = np.linalg.solve(solid.inertia_world(state.R_world_body), np.cross(lever, impulse_world))
    return BodyState(state.x_world, state.R_world_body, state.v_world + impulse_world / solid.mass_kg, state.omega_world + turned)
