"""Bodies and states for the tests of contact laws."""

import numpy as np
from scipy.spatial.transform import Rotation

from estimator.contact.solid import BodyState, Solid


def some_solid() -> Solid:
    """An uneven body of 5 mg."""
    R = Rotation.from_euler("xyz", [20, 40, 70], degrees=True).as_matrix()
    inertia = R @ np.diag([0.9e-12, 1.7e-12, 2.1e-12]) @ R.T
    return Solid(5e-6, 2e-9, 0.5 * (inertia + inertia.T))


def some_state(rng: np.random.Generator) -> BodyState:
    """A falling, spinning body."""
    R = Rotation.random(rng=rng).as_matrix()
    return BodyState(rng.normal(size=3) * 1e-3, R, np.array([0.4, -0.7, -2.0]), rng.normal(size=3) * 100.0)
