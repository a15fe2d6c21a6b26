"""Measured impacts made without nature: a law of the estimator's own, a stone, and errors of a known size."""

import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

from datasets.vocabulary.plate import Plate
from datasets.vocabulary.surface_mesh import SurfaceMesh
from estimator.contact.solid import BodyState, SolidHull, solid_hull_of
from estimator.contact_validation.laws.point_contact import PointContact
from estimator.contact_validation.measured import MeasuredImpact
from estimator.contact_validation.next_contacts import shared_by_corners

SIGMAS = np.concatenate(
    [np.full(3, 1e-5), np.full(3, 1e-3), np.full(3, 1e-3), np.full(3, 0.2), np.full(3, 1.5e-3), np.full(3, 0.5)],
)


def stone() -> SolidHull:
    """A stone of some 5 mm with few, sharp corners."""
    points = np.random.default_rng(3).normal(size=(14, 3))
    points *= 1e-3 * np.array([3.0, 2.4, 1.9]) / np.linalg.norm(points, axis=1, keepdims=True)
    hull = trimesh.convex.convex_hull(points)
    return solid_hull_of(SurfaceMesh(np.asarray(hull.vertices), np.asarray(hull.faces)), 2650.0)


def made_impacts(law: PointContact, count: int, seed: int, *, corner_sigma_m: float = 2e-6, noise: float = 1.0) -> list[MeasuredImpact]:
    """``count`` runs of one impact at one corner: ``law`` is what happens, ``noise`` times :data:`SIGMAS` errs what is measured."""
    rng, particle = np.random.default_rng(seed), stone()
    found: list[MeasuredImpact] = []
    while len(found) < count:
        tilt = np.deg2rad(rng.uniform(-30.0, 30.0))
        plate = Plate(np.zeros(3), np.array([np.sin(tilt), -np.cos(tilt), 0.0]))
        R = Rotation.random(rng=rng).as_matrix()
        v, omega = np.array([0.1, rng.uniform(0.8, 2.2), 0.05]) + 0.1 * rng.normal(size=3), 20.0 * rng.normal(size=3)
        true = _impact(f"stone-e00-r{len(found):02d}", BodyState(np.zeros(3), R, v, omega), np.zeros(6), plate, particle, corner_sigma_m)
        heights = np.sort(true.low_corners @ plate.normal_world)
        if (len(heights) > 1 and heights[1] - heights[0] < 1e-4) or shared_by_corners([true], law)[0]:
            continue
        after = law.after([true])[0]
        errors = noise * SIGMAS * rng.normal(size=18)
        turned = Rotation.from_rotvec(errors[3:6]).as_matrix() @ R
        state = BodyState(errors[:3], turned, v + errors[6:9], omega + errors[9:12])
        found.append(_impact(true.run, state, after + errors[12:], plate, particle, corner_sigma_m))
    return found


def _impact(run: str, state: BodyState, after: np.ndarray, plate: Plate, particle: SolidHull, corner_sigma_m: float) -> MeasuredImpact:
    return MeasuredImpact(run, "stone-e00", 0, state, after, np.diag(SIGMAS**2), plate, particle, corner_sigma_m)
