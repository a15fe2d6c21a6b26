"""Random impacts for the tests of contact laws."""

import numpy as np
from scipy.spatial.transform import Rotation

from datasets.vocabulary.plate import Plate
from estimator.contact.solid import BodyState, Solid

FLAT = Plate(np.zeros(3), np.array([0.0, 0.0, 1.0]))


def random_contacts(rng: np.random.Generator, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Collision matrices (n, 3, 3) of bodies with mm levers and possible inertias, and velocities (n, 3) that approach."""
    mass = rng.uniform(1e-6, 5e-5, count)
    extent = 1e-3 * rng.uniform(0.3, 2.0, (count, 3))
    squares = extent**2
    moments = mass[:, None] / 5.0 * (squares.sum(axis=1, keepdims=True) - squares)
    R = Rotation.random(count, rng=rng).as_matrix()
    lever = np.einsum("nij,nj->ni", R, extent * rng.uniform(-1.0, 1.0, (count, 3)))
    inverse = np.einsum("nij,nj,nkj->nik", R, 1.0 / moments, R)
    across = np.cross(np.eye(3)[None], lever[:, None])
    K = np.eye(3) / mass[:, None, None] + np.einsum("nia,nab,njb->nij", across, inverse, across)
    u = rng.normal(size=(count, 3)) * np.array([0.6, 0.6, 1.5])
    u[:, 2] = -np.abs(u[:, 2]) - 1e-3
    return K, u


def some_solid() -> Solid:
    """An uneven body of 5 mg."""
    R = Rotation.from_euler("xyz", [20, 40, 70], degrees=True).as_matrix()
    inertia = R @ np.diag([0.9e-12, 1.7e-12, 2.1e-12]) @ R.T
    return Solid(5e-6, 2e-9, 0.5 * (inertia + inertia.T))


def some_state(rng: np.random.Generator) -> BodyState:
    """A falling, spinning body."""
    R = Rotation.random(rng=rng).as_matrix()
    return BodyState(rng.normal(size=3) * 1e-3, R, np.array([0.4, -0.7, -2.0]), rng.normal(size=3) * 100.0)
