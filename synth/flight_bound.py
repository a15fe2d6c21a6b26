"""The Cramér-Rao bound of a flight: how well anybody could know its motion from the outlines of its frames.

For whoever knows the true body (mesh, centre of mass, inertia), the camera, the times and gravity, all that is unknown is the state at
mid-sequence: pose, linear and angular velocity, 12 numbers. Every sample of every outline says where the outline is along the sample's
normal, with the noise that :mod:`synth.silhouette.noisy_outline` adds; where along the outline a sample lies says nothing. With ``g``
(m, 12) the derivatives of the m samples of a frame along their normals and ``C`` (m, m) the noise's covariance, the information is the
sum of ``gᵀ C⁻¹ g`` over the frames. Its inverse bounds the covariance of every unbiased estimate [Rao 1945; Kay, Fundamentals of
Statistical Signal Processing, 1993, ch. 3].

An instrument has to learn the body from views and has a larger error. To first order in the noise, which is small against what an
outline shows but for its sharpest corners.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from datasets.recipes.recipe import NoiseRecipe
from datasets.truth import MotionBound, Truth
from datasets.vocabulary.body import Body
from datasets.vocabulary.camera import HsvCamera
from datasets.vocabulary.state import Motion
from synth.motion.free_flight import Start
from synth.motion.pose_sensitivity import N_STATE, SPIN, VELOCITY, mass_sensitivity, pose_sensitivity
from synth.plan import particle_poses_in_camera
from synth.silhouette.contour_points import ContourPoints, contour_points
from synth.silhouette.exact_outline import OutlineMesh, exact_outline, outline_mesh
from synth.silhouette.noisy_outline import noise_spectrum, samples_with_normals

Array = NDArray[np.float64]

PHASE = 0.5
"""Where along a step the first sample lies; the sequence's own are at random ones. Bounds of flights of 3 to 40 frames moved by at most
1.3% with it, those of a ball's facets by 4%."""
OPEN = 1e-12
"""Least eigenvalue, over the largest, of an information (scaled to a unit diagonal) that leaves no motion open: well above rounding."""


@dataclass(frozen=True)
class MassPrior:
    """How well a body's mass properties are known: standard deviations.

    ``com_m`` of the centre of mass along each axis; ``moments`` and ``products`` of the inertia tensor's entries on and off the diagonal in
    the principal axes, over the root of the product of the two moments.
    """

    com_m: float
    moments: float
    products: float

    @property
    def precision(self) -> Float[NDArray[np.float64], "9"]:
        """Of the numbers of :func:`synth.motion.pose_sensitivity.mass_sensitivity`."""
        return 1.0 / np.repeat([self.com_m, self.moments, self.products], 3) ** 2


def with_bound(truth: Truth, camera: HsvCamera, noise: NoiseRecipe) -> Truth:
    """The truth of a sequence with its bound, where it has one; ``camera`` and ``noise`` are those that its frames were made with."""
    return replace(truth, bound=flight_bound(truth, camera, noise))


def flight_bound(truth: Truth, camera: HsvCamera, noise: NoiseRecipe, *, mass: MassPrior | None = None) -> MotionBound | None:
    """The bound of the velocities at mid-sequence from the outlines of all frames; ``mass`` where mass properties are known only so well.

    ``None`` where the sequence is no free flight under the stated model alone (effects in force, a plate, a second particle), where several
    cameras filmed it, where outlines have no noise, and where they leave some motion open. Of a ball or another body of revolution it is
    what facets tell.
    """
    if "further_cameras" in truth.notes or truth.effects or truth.plate is not None or truth.impacts or noise.hsv_boundary_px == 0:
        return None
    start, middle_s = at_middle(truth.motion)
    times_s, moments, precision = truth.motion.times_s - middle_s, truth.inertia_kgm2, np.zeros(N_STATE)
    by_unknown = pose_sensitivity(start, moments, times_s)
    if mass is not None:
        by_unknown = np.concatenate([by_unknown, mass_sensitivity(start, moments, times_s)], axis=2)
        precision = np.concatenate([precision, mass.precision])
    information = np.einsum("fas,fab,fbt->st", by_unknown, frame_information(truth, camera, noise), by_unknown) + np.diag(precision)
    covariance, velocities = _inverse(information), np.r_[VELOCITY, SPIN]
    return None if covariance is None else MotionBound(middle_s, covariance[np.ix_(velocities, velocities)])


def at_middle(motion: Motion) -> tuple[Start, float]:
    """The state at the middle frame of a motion, and the time (s) of that frame."""
    k = (len(motion.times_s) - 1) // 2
    return Start(motion.x_world[k], motion.q_world_body[k], motion.v_world[k], motion.omega_world[k]), float(motion.times_s[k])


def frame_information(truth: Truth, camera: HsvCamera, noise: NoiseRecipe) -> Float[NDArray[np.float64], "frame 6 6"]:
    """Fisher information of every frame's pose: position of the centre of mass (m) and turn about it (rad), world frame."""
    mesh = outline_mesh(truth.mesh_vertices, truth.mesh_faces)
    poses = zip(*particle_poses_in_camera(truth.body, truth.motion, camera), strict=True)
    rows = (_rows(mesh, truth.body, camera, pose, noise.spacing_px) for pose in poses)
    return np.stack([_information(by_pose, noise) for by_pose in rows])


def _rows(mesh: OutlineMesh, body: Body, camera: HsvCamera, pose: tuple[Array, Array], spacing_px: float) -> Array:
    """Derivatives (m, 6) px of a frame's samples along their normals by its pose."""
    R, t = pose
    exact = exact_outline(mesh, camera.intrinsics, R, t)
    samples, outward = samples_with_normals(exact, spacing_px=spacing_px, phase=PHASE)
    seen = contour_points(mesh, camera.intrinsics, mesh.vertices @ R.T + t, samples, outward)
    return moves_by_pose(seen, body, camera, pose)


def moves_by_pose(seen: ContourPoints, body: Body, camera: HsvCamera, pose: tuple[Array, Array]) -> Float[NDArray[np.float64], "m 6"]:
    """How far (px) the outline moves along each sample's line: by position (m) and turn (rad) of the centre of mass, world frame.

    ``pose``: rotation (3, 3) and translation (3,) m from the particle's frame to the camera's.
    """
    R, t = pose
    arms = seen.points_cam - (R @ body.com_particle + t)
    in_world = (each @ camera.R_cam_world for each in (seen.move_by_point, np.cross(arms, seen.move_by_point)))
    return np.hstack(tuple(in_world))


def _information(by_pose: Array, noise: NoiseRecipe) -> Array:
    """Information (6, 6) of the rows (m, 6) of one outline; the noise is the same all along it, so that waves along it are independent."""
    count = len(by_pose)
    spectrum = noise_spectrum(count, sigma_px=noise.hsv_boundary_px, correlation_steps=noise.correlation_px / noise.spacing_px)
    waves = np.fft.fft(by_pose, axis=0)
    return np.asarray((waves.conj().T @ (waves / spectrum[:, None])).real / count)


def _inverse(information: Array) -> Array | None:
    """Inverse of the information, scaled first since its numbers are of different units; ``None`` where it has none."""
    size = np.sqrt(np.diag(information))
    if not np.all(size > 0):
        return None
    values, vectors = np.linalg.eigh(information / np.outer(size, size))
    if values[0] < OPEN * values[-1]:
        return None
    return np.asarray((vectors / values) @ vectors.T / np.outer(size, size))
