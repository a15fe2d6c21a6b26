"""Rotation matrices as people publish them, rounded to a few digits, made orthonormal when they are read.

The nearest rotation (Frobenius norm) to R = U S V^T is U V^T [Higham 1986].
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from datasets.observation import CalibratedView, Observation
from datasets.vocabulary.frames import is_rotation

Array = NDArray[np.float64]

ROUNDED_ROTATION = 1e-3
"""How far R R^T may be from 1 for a matrix to be a rounded rotation: three decimals. What is further off is none."""


def nearest_rotation(R: Array) -> Array:
    """The rotation (3, 3) nearest to ``R``; ``R`` itself where it is one to within :func:`is_rotation`'s tolerance, or none at all."""
    if is_rotation(R) or not is_rotation(R, tolerance=ROUNDED_ROTATION):
        return R
    U, _, Vt = np.linalg.svd(R)
    return np.asarray(U @ Vt)


def with_rotations(obs: Observation, path: Path) -> Observation:
    """``obs``, which was read from ``path``, with rounded matrices made rotations, and a note that says so."""
    companion = obs.companion
    given = [
        *((f"$.cameras[{c}].R_cam_world", camera.R_cam_world) for c, camera in enumerate(obs.cameras)),
        *((f"$.views.cameras[{v}].R_cam_particle", view.R_cam_particle) for v, view in enumerate(obs.views)),
        *((f"$.companion.views.cameras[{v}].R_cam_particle", w.R_cam_particle) for v, w in enumerate(companion.views if companion else ())),
    ]
    rounded = [(place, R) for place, R in given if nearest_rotation(R) is not R]
    if not rounded:
        return obs
    worst = max(float(np.abs(R @ R.T - np.eye(3)).max()) for _, R in rounded)
    note = (
        f"{path}: at {rounded[0][0]}{f' (and {len(rounded) - 1} more)' if len(rounded) > 1 else ''}: rows miss orthonormality by "
        f"{worst:.1g} at most, as rounded numbers do; the nearest rotation is used."
    )
    return replace(
        obs,
        cameras=tuple(replace(camera, R_cam_world=nearest_rotation(camera.R_cam_world)) for camera in obs.cameras),
        views=_turned(obs.views),
        companion=None if companion is None else replace(companion, views=_turned(companion.views)),
        notes=(*obs.notes, note),
    )


def _turned(views: tuple[CalibratedView, ...]) -> tuple[CalibratedView, ...]:
    return tuple(replace(view, R_cam_particle=nearest_rotation(view.R_cam_particle)) for view in views)
