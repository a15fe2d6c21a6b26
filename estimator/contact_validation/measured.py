"""One measured impact as contact models see it: the state before, the velocities after, their joint covariance, the plate and the body.

The corner that touches is the lowest of the hull towards the plate. Corners that lie higher than it by more than
:data:`CANDIDATE_SHARE` of the hull's extent can neither be the lowest within the uncertainty of pose, hull and plate, nor strike right
after it, and are dropped here.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from datasets.errors import InputError
from datasets.estimate import ImpactEstimate
from datasets.vocabulary.plate import Plate
from estimator.contact.solid import BodyState, SolidHull

Array = NDArray[np.float64]
CANDIDATE_SHARE = 0.35
"""Height above the lowest corner, over the extent, up to which corners are kept: none higher strikes within an impact. By judgement."""
HULL_SHARE = 0.003
"""Standard deviation of a corner's place, as a share of the hull's extent."""
X, TURN, V, OMEGA, V_AFTER, OMEGA_AFTER = (slice(k, k + 3) for k in range(0, 18, 3))
"""Where each part lies in the covariance of an impact."""


@dataclass(frozen=True, eq=False)
class MeasuredImpact:
    """An impact of ``run`` of ``experiment``, ``number`` (from 0) within the run.

    ``state`` (world frame) right before; ``after`` (6,): v (m/s) and omega (rad/s) right after; ``covariance`` (18, 18) as in
    :class:`datasets.estimate.ImpactEstimate`; ``plate`` at the time of the impact; ``particle`` in the body frame of the estimate;
    ``corner_sigma_m``: standard deviation of the place of a corner.
    """

    run: str
    experiment: str
    number: int
    state: BodyState
    after: Float[NDArray[np.float64], "6"]
    covariance: Float[NDArray[np.float64], "18 18"]
    plate: Plate
    particle: SolidHull
    corner_sigma_m: float

    @property
    def name(self) -> str:
        """The run, and which of its impacts where it has several."""
        return self.run if self.number == 0 else f"{self.run}, impact {self.number + 1}"

    @cached_property
    def extent_m(self) -> float:
        """Largest extent of the hull along a body axis."""
        return float(np.ptp(self.particle.vertices_body, axis=0).max())

    @cached_property
    def turning(self) -> Float[NDArray[np.float64], "3 3"]:
        """Inverse of inertia over mass, 1/m², world axes."""
        solid = self.particle.solid
        return np.asarray(np.linalg.inv(solid.inertia_world(self.state.R_world_body) / solid.mass_kg))

    @cached_property
    def low_corners(self) -> Float[NDArray[np.float64], "corner 3"]:
        """Corners (m, from the centre of mass, world axes) that may be the one that touches, or the next."""
        arms = self.particle.vertices_body @ self.state.R_world_body.T
        heights = arms @ self.plate.normal_world
        return np.asarray(arms[heights <= heights.min() + CANDIDATE_SHARE * self.extent_m])


def measured_impact(run: str, number: int, estimate: ImpactEstimate, particle: SolidHull, plate: Plate) -> MeasuredImpact:
    """The impact ``estimate`` of ``particle`` (body frame of the estimate) on ``plate``.

    Raises
    ------
    InputError
        Where the covariance is not a covariance.
    """
    covariance = np.asarray(estimate.covariance, dtype=np.float64)
    if covariance.shape != (18, 18) or not np.isfinite(covariance).all():
        raise InputError(f"{run}: covariance of impact {number + 1}: expected 18 x 18 finite numbers, got shape {covariance.shape}")
    state = BodyState(
        estimate.x_world, Rotation.from_quat(estimate.q_world_body).as_matrix(), estimate.before.v_world, estimate.before.omega_world
    )
    after = np.concatenate([estimate.after.v_world, estimate.after.omega_world])
    corners = particle.vertices_body[ConvexHull(particle.vertices_body).vertices]
    extent = float(np.ptp(corners, axis=0).max())
    hull = SolidHull(particle.solid, corners)
    return MeasuredImpact(run, experiment_of(run), number, state, after, covariance, plate, hull, HULL_SHARE * extent)


def experiment_of(run: str) -> str:
    """The experiment that a run belongs to: its name without a last ``-r`` and number."""
    stem, _, last = run.rpartition("-r")
    return stem if stem and last.isdigit() else run
