"""Calibrated views that have not been taken: the particle laid down anew before the same cameras, as often as it was.

The outlines are those of the convex hull of the visual hull, as noisy as the views' are in the median. What more views would do for the
hull itself, and so for what is believed of the body beforehand, is not counted.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimator.appearance.hull_outlines import like_noise, outline_of
from estimator.appearance.model_errors import SequenceTask
from estimator.data.views import Views
from estimator.geometry.epipolar_tangency import PoseSet
from estimator.geometry.silhouettes import Silhouettes
from estimator.particle.particle import Particle

Array = NDArray[np.float64]
TURN = Rotation.from_rotvec(1.2 * np.array([0.48, 0.6, 0.64]))
"""How the particle lies when it is laid down anew: an axis and an angle that no rig prefers."""


def with_more_views(sequence: SequenceTask, particle: Particle, corners: Array) -> SequenceTask:
    """The sequence with twice the calibrated views; ``corners`` (v, 3) m of the hull, nominal body axes about the centre of mass."""
    task, views = sequence.task, sequence.task.views
    more = _turned(views, particle, corners)
    bias = task.bias
    if bias is not None:
        bias = replace(bias, view=np.concatenate([bias.view, bias.view]))
    weight = np.hstack([task.weight, task.weight])
    return replace(sequence, task=replace(task, views=_together(views, more), weight=weight, bias=bias))


def _turned(views: Views, particle: Particle, corners: Array) -> Views:
    """Views of the particle turned about its centre of mass."""
    Q = TURN.as_matrix()
    centre = particle.body.com_particle
    R = views.poses.R @ Q
    t = views.poses.t + (views.poses.R - R) @ centre
    points = corners @ particle.body.R_particle_body.T + centre
    lenses = [view.intrinsics for view in particle.calibrated]
    polygons = [outline_of(points @ a.T + b, lens) for a, b, lens in zip(R, t, lenses, strict=True)]
    return Views(like_noise(polygons, lenses, views.silhouettes), PoseSet(np.ascontiguousarray(R), t), views.centre)


def _together(first: Views, second: Views) -> Views:
    poses = PoseSet(np.concatenate([first.poses.R, second.poses.R]), np.concatenate([first.poses.t, second.poses.t]))
    return Views(_joined(first.silhouettes, second.silhouettes), poses, first.centre)


def _joined(first: Silhouettes, second: Silhouettes) -> Silhouettes:
    return Silhouettes(
        xy=np.concatenate([first.xy, second.xy]),
        points_px=np.concatenate([first.points_px, second.points_px]),
        sigma_px=np.concatenate([first.sigma_px, second.sigma_px]),
        offsets=np.concatenate([first.offsets, first.offsets[-1] + second.offsets[1:]]),
        correlation_rad=np.concatenate([first.correlation_rad, second.correlation_rad]),
        noise_px=np.concatenate([first.noise_px, second.noise_px]),
        samples=np.concatenate([first.samples, second.samples]),
        focal_px=np.concatenate([first.focal_px, second.focal_px]),
    )
