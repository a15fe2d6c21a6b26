"""Bodies with few corners, plates and states that the tests of the contact share."""

import numpy as np
from scipy.spatial.transform import Rotation

from datasets.vocabulary.body import Body
from datasets.vocabulary.plate import Plate
from synth.effects.links import FlyingBody
from synth.motion import Start

FLAT = Plate(np.zeros(3), np.array([0.0, 0.0, 1.0]))
NO_GRAVITY = np.zeros(3)


def one_corner(arm: np.ndarray, mass_kg: float, inertia: np.ndarray) -> tuple[FlyingBody, Rotation]:
    """A body with ``inertia`` (3, 3) kg m² whose corner at ``arm`` (m) from its centre is the only one that can touch; and its axes."""
    moments, axes = np.linalg.eigh(inertia)
    axes[:, 2] *= np.sign(np.linalg.det(axes))
    others = np.array([[1e-4, 0, 0], [0, 1e-4, 0], [0, 0, 1e-4]]) - 0.3 * arm
    return FlyingBody(np.vstack([arm, others]), Body(np.zeros(3), axes, moments / moments.max()), mass_kg, moments), Rotation.from_matrix(
        axes
    )


def ball(radius_m: float, mass_kg: float) -> FlyingBody:
    """A ball that touches at one point, below its centre when it is not turned."""
    body, _ = one_corner(np.array([0.0, 0.0, -radius_m]), mass_kg, np.eye(3) * 0.4 * mass_kg * radius_m**2)
    return body


def dropped(v: tuple[float, float, float], omega: tuple[float, float, float] = (0.0, 0.0, 0.0), *, height_m: float) -> Start:
    """A body that is not turned, its centre at ``height_m``."""
    return Start(np.array([0.0, 0.0, height_m]), np.array([0.0, 0.0, 0.0, 1.0]), np.array(v, dtype=float), np.array(omega, dtype=float))
