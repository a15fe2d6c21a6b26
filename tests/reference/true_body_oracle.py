"""Maximum likelihood for whoever knows the true body: what the Cramér-Rao bound promises, done.

Gauss-Newton steps from the true state on the distances of all outline samples from the outline that the true mesh casts, whitened by
the noise's true covariance along each outline. Unknown are the pose and the velocities at mid-sequence, 12 numbers; mass properties,
camera, times and gravity are given. No instrument can do this: it is the check that the bound (:mod:`synth.flight_bound`) is right.
"""

from collections.abc import Sequence

import numpy as np
import shapely
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from datasets.recipes.recipe import NoiseRecipe
from datasets.truth import Truth
from datasets.vocabulary.camera import HsvCamera
from synth.flight_bound import at_middle, moves_by_pose
from synth.motion import Start, fly
from synth.motion.pose_sensitivity import POSITION, SPIN, TURN, VELOCITY, pose_sensitivity
from synth.plan import particle_poses_in_camera
from synth.silhouette import exact_outline, outline_mesh
from synth.silhouette.contour_points import contour_points
from synth.silhouette.noisy_outline import noise_spectrum

Array = NDArray[np.float64]
Pose = tuple[Array, Array]

AHEAD_PX = 1e-3
"""How far along an outline its direction is read: less than any facet's length."""


class Oracle:
    """The body, the camera and the noise of one sequence, known; ``gravity_world`` (3,) m/s²."""

    def __init__(self, truth: Truth, camera: HsvCamera, noise: NoiseRecipe, gravity_world: Array) -> None:
        self.true, middle_s = at_middle(truth.motion)
        self._truth, self._camera, self._noise, self._gravity = truth, camera, noise, gravity_world
        self._mesh = outline_mesh(truth.mesh_vertices, truth.mesh_faces)
        self._times_s = truth.motion.times_s - middle_s
        self._by_state = pose_sensitivity(self.true, truth.inertia_kgm2, self._times_s)

    def error(self, samples_px: Sequence[Array], *, rounds: int) -> Float[NDArray[np.float64], "6"]:
        """Error of (v, omega) at mid-sequence (m/s, rad/s) after ``rounds`` steps, from the samples (m, 2) px of every frame."""
        state = self.true
        for _ in range(rounds):
            state = _moved(state, self._step(state, samples_px))
        return np.concatenate([state.v_world - self.true.v_world, state.omega_world - self.true.omega_world])

    def exact_outlines(self) -> list[Array]:
        """The outline (n, 2) px of every frame without noise."""
        return [self._outline(pose) for pose in self._poses(self.true)]

    def _poses(self, state: Start) -> list[Pose]:
        first, last = float(self._times_s[0]), float(self._times_s[-1])
        flight = fly(state, self._truth.inertia_kgm2, self._gravity, earliest_s=first, latest_s=last)
        return list(zip(*particle_poses_in_camera(self._truth.body, flight.at(self._times_s), self._camera), strict=True))

    def _outline(self, pose: Pose) -> Array:
        return exact_outline(self._mesh, self._camera.intrinsics, *pose)

    def _step(self, state: Start, samples_px: Sequence[Array]) -> Array:
        rows, gaps = [], []
        for k, (pose, samples) in enumerate(zip(self._poses(state), samples_px, strict=True)):
            gap, by_pose = self._gaps(pose, samples)
            rows.append(self._whitened(by_pose @ self._by_state[k]))
            gaps.append(self._whitened(gap[:, None]))
        J = np.vstack(rows)
        scale = np.linalg.norm(J, axis=0)
        return np.asarray(np.linalg.lstsq(J / scale, np.concatenate(gaps)[:, 0], rcond=None)[0] / scale)

    def _whitened(self, along: Array) -> Array:
        """Rows (m, k) along an outline with independent errors of size one."""
        steps = self._noise.correlation_px / self._noise.spacing_px
        spectrum = noise_spectrum(len(along), sigma_px=self._noise.hsv_boundary_px, correlation_steps=steps)
        return np.asarray(np.fft.ifft(np.fft.fft(along, axis=0) / np.sqrt(spectrum)[:, None], axis=0).real)

    def _gaps(self, pose: Pose, samples: Array) -> tuple[Array, Array]:
        """How far (m,) px samples lie outside of the outline, and how far a pose's six numbers move it there (m, 6)."""
        R, t = pose
        ring = shapely.linearrings(self._outline(pose))
        place = shapely.line_locate_point(ring, shapely.points(samples))
        foot, ahead = (shapely.get_coordinates(shapely.line_interpolate_point(ring, place + d)) for d in (0.0, AHEAD_PX))
        outward = np.column_stack([(ahead - foot)[:, 1], (foot - ahead)[:, 0]]) / AHEAD_PX
        seen = contour_points(self._mesh, self._camera.intrinsics, self._mesh.vertices @ R.T + t, foot, outward)
        gap = np.sign(np.sum((samples - foot) * outward, axis=1)) * np.linalg.norm(samples - foot, axis=1)
        return gap, moves_by_pose(seen, self._truth.body, self._camera, pose)


def _moved(start: Start, step: Array) -> Start:
    q = (Rotation.from_rotvec(step[TURN]) * Rotation.from_quat(start.q_world_body)).as_quat()
    return Start(start.x_world + step[POSITION], q, start.v_world + step[VELOCITY], start.omega_world + step[SPIN])
