"""What the uncertainty of the cameras' calibration, of lengths, and of measured gravity moves a joint fit of surface and motion by.

Considered, as of tangents (:mod:`estimator.fitting.calibration_share`): each error of the calibration moves the frames' outlines where
samples meet them, and the surface answers to that before the motion does.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from datasets.observation import Observation
from estimator.appearance.flight_errors import flown_in, particle_poses
from estimator.data.fit_task import FitTask
from estimator.fitting.calibration_share import STEP, CalibrationShare, Other, errors_of
from estimator.fitting.problem import M
from estimator.fitting.stable_inverse import scaled_inverse
from estimator.surface.contact import contacts_of
from estimator.surface.frame_samples import pictures_of
from estimator.surface.joint import JointFit

Array = NDArray[np.float64]


def calibration_share_of(joint: JointFit[M], task: FitTask, stated: Observation) -> CalibrationShare | None:
    """The share of a calibration in the motion of a joint fit; ``None`` where no uncertainty is ``stated``."""
    errors = errors_of(task, joint.motion, stated)
    others = errors.others
    if not others:
        return None
    fitted, information = joint.last.fitted, joint.last.known.information
    frames, gradient = fitted.groups[1:], np.zeros((len(information), len(others)))
    ends = np.cumsum([len(group.r) for group in frames])
    for group, change in zip(frames, np.split(_changes(joint, others), ends[:-1]), strict=True):
        weighed = group.weight[:, None] * change
        gradient -= fitted.solved[:, :-1].T @ (group.J.T @ weighed)
        gradient[group.place] += group.F.T @ weighed
    response = -scaled_inverse(fitted.H + information) @ gradient
    return errors.share(response[frames[0].place])


def _changes(joint: JointFit[M], others: Sequence[Other]) -> Array:
    """By how much each of c errors of the calibration changes the samples' residuals (m, c) px, what they meet being the same."""
    sightings, first = joint.sightings, joint.motion.first
    placed = particle_poses(first, flown_in(joint.motion, sightings), sightings)
    met = contacts_of(joint.surface, pictures_of(sightings, placed)).parts()
    changes = np.zeros((sum(len(each.gap_px) for each in met), len(others)))
    for column, other in enumerate(others):
        for sign in (1.0, -1.0):
            task, motion = other(sign * STEP)
            moved = pictures_of(task.sightings, particle_poses(motion.first, flown_in(motion, sightings), sightings))
            points = (
                ((m.point - placed.t[k]) @ placed.R[k]) @ seen.R_cam_particle.T + seen.t_cam_particle
                for k, (m, seen) in enumerate(zip(met, moved, strict=True))
            )
            shown = [np.sum(m.outward * seen.camera.project(p), axis=1) for m, seen, p in zip(met, moved, points, strict=True)]
            changes[:, column] -= sign * np.concatenate(shown) / (2.0 * STEP)
    return changes
