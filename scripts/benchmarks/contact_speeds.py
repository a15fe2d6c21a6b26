"""What the speeds of the contact models are measured on: a stone of 50 faces' worth of corners, its clump, random contacts."""

import time
from collections.abc import Callable

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from datasets.vocabulary.plate import Plate
from datasets.vocabulary.surface_mesh import SurfaceMesh
from estimator.contact.clump_generator import generated_clump
from estimator.contact.hertz_mindlin import HertzMindlin
from estimator.contact.solid import BodyState, SolidHull, solid_hull_of
from estimator.contact.stronge_impulse import StrongeImpulse
from estimator.contact.support_point import support_point

Array = NDArray[np.float64]
FLAT = Plate(np.zeros(3), np.array([0.0, 0.0, 1.0]))
DIAMOND_ON_STEEL = HertzMindlin(1143e9, 0.069, 210e9, 0.30, 0.7, 0.12)
SMALLEST_RADIUS_M = 2e-5
IMPACTS, CLUMP_IMPACTS = 2000, 20


def stone(rng: np.random.Generator) -> SolidHull:
    """A convex stone of about 2 mm and 40 corners, of diamond."""
    points = rng.normal(size=(40, 3))
    points *= 1e-3 * np.array([1.2, 0.9, 0.7]) / np.linalg.norm(points, axis=1, keepdims=True)
    hull = trimesh.convex.convex_hull(points)
    return solid_hull_of(SurfaceMesh(np.asarray(hull.vertices), np.asarray(hull.faces)), 3515.0)


def dropped(rng: np.random.Generator) -> BodyState:
    """A stone about to strike at 2 m/s, turned and spinning at random."""
    R = Rotation.random(rng=rng).as_matrix()
    return BodyState(np.zeros(3), R, np.array([0.4, -0.2, -2.0]), rng.normal(size=3) * 50.0)


def random_contacts(rng: np.random.Generator, count: int) -> tuple[Array, Array]:
    """Collision matrices (n, 3, 3) 1/kg of ellipsoids struck anywhere, and velocities (n, 3) m/s that approach; contact axes."""
    mass, extent = rng.uniform(1e-6, 5e-5, count), 1e-3 * rng.uniform(0.3, 2.0, (count, 3))
    moments = mass[:, None] / 5.0 * ((extent**2).sum(axis=1, keepdims=True) - extent**2)
    R = Rotation.random(count, rng=rng).as_matrix()
    lever = np.einsum("nij,nj->ni", R, extent * rng.uniform(-1.0, 1.0, (count, 3)))
    across = np.cross(np.eye(3)[None], lever[:, None])
    inverse = np.einsum("nij,nj,nkj->nik", R, 1.0 / moments, R)
    u = rng.normal(size=(count, 3)) * np.array([0.6, 0.6, 1.5])
    u[:, 2] = -np.abs(u[:, 2]) - 1e-3
    return np.eye(3) / mass[:, None, None] + np.einsum("nia,nab,njb->nij", across, inverse, across), u


def impulses_per_second(rng: np.random.Generator) -> float:
    """Whole impacts of a stone under the impulse model, support point and all, one after another, per second of processor time."""
    body, law = stone(rng), StrongeImpulse(0.7, 0.12)
    states = [dropped(rng) for _ in range(IMPACTS)]

    def work() -> None:
        for state in states:
            law.strike(state, body.solid, support_point(state, body.vertices_body, FLAT), FLAT)

    law.strike(states[0], body.solid, support_point(states[0], body.vertices_body, FLAT), FLAT)
    return IMPACTS / _seconds(work)


def contacts_per_second(rng: np.random.Generator) -> float:
    """Contacts given by collision matrix and velocity, many in one call, per second of processor time."""
    K, u = random_contacts(rng, 10 * IMPACTS)
    law = StrongeImpulse(0.7, 0.12)
    law.follow(K[:1], u[:1])
    return 10 * IMPACTS / _seconds(lambda: law.follow(K, u))


def clump_seconds(rng: np.random.Generator) -> float:
    """Processor time (s) of one impact of a clump of 50 spheres, mean over several."""
    clump = generated_clump(stone(rng), 50, smallest_radius_m=SMALLEST_RADIUS_M)
    states = [dropped(rng) for _ in range(CLUMP_IMPACTS)]
    still = [BodyState(s.x_world, s.R_world_body, s.v_world, np.zeros(3)) for s in states]
    DIAMOND_ON_STEEL.through(still[0], clump, FLAT)
    return _seconds(lambda: [DIAMOND_ON_STEEL.through(state, clump, FLAT) for state in still]) / CLUMP_IMPACTS


def _seconds(work: Callable[[], object]) -> float:
    began = time.process_time()
    work()
    return time.process_time() - began
