"""What the uncertainty of the cameras' calibration, and of measured gravity, moves a joint fit of surface and motion by.

Considered, as of tangents (:mod:`estimator.fitting.calibration_share`): each error of the calibration moves the frames' outlines where
samples meet them, and the surface answers to that before the motion does.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from estimator.appearance.flight_errors import particle_poses
from estimator.data.fit_task import FitTask
from estimator.fitting.calibration_share import STEP, CalibrationShare, Other, errors_of
from estimator.fitting.problem import M
from estimator.fitting.stable_inverse import scaled_inverse
from estimator.motion.flight import flown
from estimator.particle.particle import Particle
from estimator.surface.arrow import weights
from estimator.surface.contact import Picture, contacts_of
from estimator.surface.joint import JointFit, linearised_end

Array = NDArray[np.float64]


def calibration_share_of(
    particle: Particle, joint: JointFit[M], task: FitTask, gravity_covariance: Array | None, *, huber: float
) -> CalibrationShare | None:
    """The share of a calibration in the motion of a joint fit; ``None`` where no uncertainty is stated.

    ``gravity_covariance`` (3, 3) m²/s⁴, world frame.
    """
    others, gravity = errors_of(task, joint.motion, gravity_covariance)
    if not others:
        return None
    fitted, _, about = linearised_end(particle, joint, huber=huber)
    frames = fitted.groups[1]
    weight = weights(frames.samples.gap_px, joint.noise_px[1], huber)
    change = weight[:, None] * _changes(joint, others)
    gradient = frames.F.T @ change - fitted.solved[:, :-1].T @ (frames.J.T @ change)
    return CalibrationShare(-scaled_inverse(fitted.H + about.information) @ gradient, gravity)


def _changes(joint: JointFit[M], others: Sequence[Other]) -> Array:
    """By how much each of c errors of the calibration changes the samples' residuals (m, c) px, what they meet being the same."""
    sightings, first = joint.sightings, joint.motion.first
    placed = particle_poses(first, flown(joint.motion, sightings.times_s), sightings)
    cameras = [sightings.cameras[int(k)].intrinsics for k in sightings.camera]
    met = contacts_of(joint.surface, [Picture(lens, placed.R[k], placed.t[k], sightings.sure_px(k)) for k, lens in enumerate(cameras)])
    changes = np.zeros((sum(len(each.gap_px) for each in met), len(others)))
    for column, other in enumerate(others):
        for sign in (1.0, -1.0):
            task, motion = other(sign * STEP)
            moved = particle_poses(motion.first, flown(motion, sightings.times_s), sightings)
            lenses = [task.sightings.cameras[int(k)].intrinsics for k in sightings.camera]
            points = (((m.point - placed.t[k]) @ placed.R[k]) @ moved.R[k].T + moved.t[k] for k, m in enumerate(met))
            shown = [np.sum(m.normal * lens.project(p), axis=1) for m, lens, p in zip(met, lenses, points, strict=True)]
            changes[:, column] -= sign * np.concatenate(shown) / (2.0 * STEP)
    return changes
