"""The estimated outline of a frame: the particle's surface, seen in the estimated pose.

It is the surface that the last fit found, or where there is none the visual hull of the calibrated views. The hull is the polyhedron that
the cones of the views have in common, which keeps edges as sharp as the views show them; where noise keeps the cones apart it is carved
from a grid. Its outline is exact to a few hundredths of a pixel, so that a residual of a tenth can be seen
(:mod:`estimator.geometry.cast_outline`).
"""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from datasets.errors import InputError
from datasets.estimate import Estimate
from datasets.observation import CalibratedView, Frames, Observation, Recording
from datasets.vocabulary.body import Body
from datasets.vocabulary.camera import HsvCamera
from datasets.vocabulary.outline import Outline
from datasets.vocabulary.state import Motion
from datasets.vocabulary.surface_mesh import SurfaceMesh
from estimator.geometry.cast_outline import cast_outline, casting_mesh
from estimator.geometry.visual_hull import visual_hull
from estimator.outlines.recording import view_outlines_of
from estimator.particle.exact_hull import exact_hull
from estimator.particle.particle import MINIMUM_VIEWS, TOLERANCE_PX
from tumble.reports.camera_poses import motion_in_frames

Array = NDArray[np.float64]
RESOLUTION = 64
"""Voxels along an edge of the grid, where the hull is carved; the estimator's own."""
KEPT_HULLS = 8
"""Hulls that a process keeps: sequences of a dataset share their views, and outlines of views cost seconds."""


def estimated_outlines(estimate: Estimate, observation: Observation) -> tuple[tuple[Array | None, ...], ...]:
    """Per camera and frame, the outline (n, 2) px of the surface in the estimated pose; empty without a pose or a surface."""
    if estimate.motion is None or estimate.body is None:
        return ()
    surface = surface_of(estimate, observation)
    if surface is None:
        return ()
    motions = (motion_in_frames(estimate.motion, estimate, observation, number) for number in range(len(observation.cameras)))
    return tuple(
        camera_outlines(surface, estimate.body, motion, with_measured_focal(camera, estimate))
        for motion, camera in zip(motions, observation.cameras, strict=True)
    )


def with_measured_focal(camera: HsvCamera, estimate: Estimate) -> HsvCamera:
    """The camera with the focal length that the estimate measured, if it did: its poses belong to that one."""
    measured = estimate.statistics.get("focal_length")
    if measured is None:
        return camera
    fx, fy = measured["focal_px"]
    return replace(camera, intrinsics=replace(camera.intrinsics, fx_px=float(fx), fy_px=float(fy)))


def surface_of(estimate: Estimate, observation: Observation) -> SurfaceMesh | None:
    """The surface that the fit found, or the hull of the calibrated views that it did not leave out; ``None`` where they have none."""
    if estimate.surface is not None:
        return estimate.surface
    left_out = tuple(int(number) for number in estimate.statistics.get("views_left_out", ()))
    digest = _digest(observation.views, observation.view_recording)
    return _hull(_Views(digest, left_out, observation.views, observation.view_recording))


@dataclass(frozen=True)
class _Views:
    """Calibrated views and what they recorded; two with the same digest are the same."""

    digest: str
    left_out: tuple[int, ...]
    views: tuple[CalibratedView, ...] = field(compare=False)
    recording: Recording = field(compare=False)


@lru_cache(maxsize=KEPT_HULLS)
def _hull(given: _Views) -> SurfaceMesh | None:
    try:
        frames = view_outlines_of(given.recording, given.views).frames
        pairs = enumerate(zip(frames, given.views, strict=True))
        used = [(frame.outline, view) for number, (frame, view) in pairs if frame.used and number not in given.left_out]
        return _carved([outline for outline, _ in used], [view for _, view in used]) if len(used) >= MINIMUM_VIEWS else None
    except InputError:
        return None


def _carved(outlines: Sequence[Outline], views: Sequence[CalibratedView]) -> SurfaceMesh:
    try:
        return exact_hull(outlines, views, tolerance_px=TOLERANCE_PX)
    except InputError:
        return visual_hull(outlines, views, resolution=RESOLUTION)


def _digest(views: Sequence[CalibratedView], recording: Recording) -> str:
    found = hashlib.sha256()
    for view in views:
        pose = np.column_stack([view.R_cam_particle, view.t_cam_particle]).astype(np.float64)
        found.update(repr((view.intrinsics, view.drop, view.camera)).encode() + pose.tobytes())
    for k in range(len(recording)):
        found.update(recording.read(k).tobytes() if isinstance(recording, Frames) else recording[k].points_px.tobytes())
    return found.hexdigest()


def camera_outlines(surface: SurfaceMesh, body: Body, motion: Motion, camera: HsvCamera) -> tuple[Array | None, ...]:
    """The surface's outline in every pose of ``motion``; ``None`` where it reaches behind the camera or far out of its picture."""
    mesh, lens = casting_mesh(surface), camera.intrinsics
    farthest_px = 4.0 * max(lens.width_px, lens.height_px)
    outlines: list[Array | None] = []
    for R_world_body, x_world in zip(Rotation.from_quat(motion.q_world_body).as_matrix(), motion.x_world, strict=True):
        R = camera.R_cam_world @ R_world_body @ body.R_particle_body.T
        t = camera.R_cam_world @ x_world + camera.t_cam_world - R @ body.com_particle
        in_camera = surface.vertices @ R.T + t
        shown = in_camera[:, 2].min() > 0 and np.abs(lens.project(in_camera)).max() < farthest_px
        outlines.append(cast_outline(mesh, lens, R, t) if shown else None)
    return tuple(outlines)
