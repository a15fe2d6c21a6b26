"""Rows of a picture that are exposed one after the other: strips of a few rows, each taken at its own instants.

A strip is so low that nothing moves by more than ``STEP_PX`` between the instants of its first and last row.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.camera import Intrinsics
from synth.plan import SequencePlan, particle_poses_in_camera
from synth.rendering.scene import Pose
from synth.rendering.window import Window

Array = NDArray[np.float64]

STEP_PX = 0.05


@dataclass(frozen=True)
class Strip:
    """Some rows of a picture; ``poses`` and ``cameras`` (none where the picture does not move) one per sub-frame."""

    window: Window
    poses: tuple[Pose, ...]
    cameras: tuple[Intrinsics, ...]


def poses_at(plan: SequencePlan, instants_s: Array) -> tuple[Pose, ...]:
    """Poses of the particle at instants (n,) s."""
    R, t = particle_poses_in_camera(plan.body, plan.flight.at(instants_s), plan.hsv)
    return tuple(zip(R, t, strict=True))


def cameras_at(plan: SequencePlan, stamps_s: Array) -> tuple[Intrinsics, ...]:
    """The cameras that show the moving picture at instants (n,) s after the first time stamp; none where it does not move."""
    if not plan.effects.moving:
        return ()
    return tuple(plan.effects.camera_at(plan.true_camera, float(stamp)) for stamp in stamps_s)


def strips(plan: SequencePlan, window: Window, hull: Array, instants_s: Array, stamps_s: Array) -> tuple[Strip, ...]:
    """The strips of a window; sub-frames are at instants and stamps (n,) s in the row without delay."""
    rows = _rows_per_strip(plan, window, hull, instants_s)
    found = []
    for y0 in range(window.y0, window.y0 + window.height, rows):
        height = min(rows, window.y0 + window.height - y0)
        delay = float(plan.effects.row_delays_s(np.array([y0 + (height - 1) / 2]), plan.true_camera)[0])
        part = Window(window.x0, y0, window.width, height)
        found.append(Strip(part, poses_at(plan, instants_s + delay), cameras_at(plan, stamps_s + delay)))
    return tuple(found)


def delays_in(plan: SequencePlan, window: Window) -> Array:
    """Delays (2,) s of the first and last row of a window."""
    return plan.effects.row_delays_s(np.array([window.y0, window.y0 + window.height - 1.0]), plan.true_camera)


def _rows_per_strip(plan: SequencePlan, window: Window, hull: Array, instants_s: Array) -> int:
    first, last = delays_in(plan, window)
    (R0, t0), (R1, t1) = poses_at(plan, np.array([instants_s[0] + first, instants_s[0] + last]))
    camera = plan.true_camera
    moved = float(np.linalg.norm(camera.project(hull @ R1.T + t1) - camera.project(hull @ R0.T + t0), axis=1).max())
    return max(1, int(window.height * min(1.0, STEP_PX / max(moved, 1e-12))))
