"""The estimated outline of a frame: the visual hull of the calibrated views, seen in the estimated pose.

The hull's triangles are painted at a quarter of a pixel and the outer contour of the painted region is traced, so the outline is
within about 0.2 px of the hull's, which is fine for looking and is never measured with.
"""

from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from datasets.errors import InputError
from datasets.estimate import Estimate
from datasets.observation import Observation
from datasets.vocabulary.body import Body
from datasets.vocabulary.camera import HsvCamera
from datasets.vocabulary.state import Motion
from estimator.geometry.visual_hull import HullMesh, visual_hull
from estimator.outlines.recording import view_outlines_of

Array = NDArray[np.float64]
FINE = 4
"""Painted pixels per pixel."""
RESOLUTION = 40
SIMPLER_PX = 0.15


def estimated_outlines(estimate: Estimate, observation: Observation) -> tuple[tuple[Array | None, ...], ...]:
    """Per camera and frame, the outline (n, 2) px of the hull in the estimated pose; empty without a pose or a hull."""
    if estimate.motion is None or estimate.body is None:
        return ()
    hull = hull_of(estimate, observation)
    if hull is None:
        return ()
    return tuple(
        camera_outlines(hull, estimate.body, estimate.motion, with_measured_focal(camera, estimate)) for camera in observation.cameras
    )


def with_measured_focal(camera: HsvCamera, estimate: Estimate) -> HsvCamera:
    """The camera with the focal length that the estimate measured, if it did: its poses belong to that one."""
    measured = estimate.statistics.get("focal_length")
    if measured is None:
        return camera
    fx, fy = measured["focal_px"]
    return replace(camera, intrinsics=replace(camera.intrinsics, fx_px=float(fx), fy_px=float(fy)))


def hull_of(estimate: Estimate, observation: Observation) -> HullMesh | None:
    """The hull that the estimate carries, else that of the calibrated views that the estimate did not leave out, else ``None``."""
    vertices, faces = estimate.statistics.get("hull_vertices"), estimate.statistics.get("hull_faces")
    if vertices is not None and faces is not None:
        return HullMesh(np.asarray(vertices, dtype=np.float64), np.asarray(faces, dtype=np.int64))
    try:
        seen = view_outlines_of(observation.view_recording, observation.views)
        foreign = set(estimate.statistics.get("views_left_out", ()))
        pairs = enumerate(zip(seen.frames, observation.views, strict=True))
        used = [(frame.outline, view) for number, (frame, view) in pairs if frame.used and number not in foreign]
        return visual_hull([outline for outline, _ in used], [view for _, view in used], resolution=RESOLUTION)
    except InputError:
        return None


def camera_outlines(hull: HullMesh, body: Body, motion: Motion, camera: HsvCamera) -> tuple[Array | None, ...]:
    """The hull's outline in every pose of ``motion``."""
    in_body = (hull.vertices - body.com_particle) @ body.R_particle_body
    turned = Rotation.from_quat(motion.q_world_body).as_matrix()
    outlines = []
    for R_world_body, x_world in zip(turned, motion.x_world, strict=True):
        in_world = in_body @ R_world_body.T + x_world
        in_camera = in_world @ camera.R_cam_world.T + camera.t_cam_world
        outlines.append(_outline(camera.intrinsics.project(in_camera), hull.faces) if in_camera[:, 2].min() > 0 else None)
    return tuple(outlines)


def _outline(points_px: Array, faces: NDArray[np.int64]) -> Array | None:
    corner = np.floor(points_px.min(axis=0)) - 2
    size = ((np.ceil(points_px.max(axis=0)) + 3 - corner) * FINE).astype(int)
    if not np.all(np.isfinite(points_px)) or size.max() > 8192:
        return None
    mask = np.zeros((size[1], size[0]), dtype=np.uint8)
    corners = np.round((points_px - corner) * FINE).astype(np.int32)
    for triangle in corners[faces]:
        cv2.fillConvexPoly(mask, triangle, 255)
    contours, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    largest = max(contours, key=len)
    simple = cv2.approxPolyDP(largest, SIMPLER_PX * FINE, True)
    return np.asarray(simple, dtype=np.float64).reshape(-1, 2) / FINE + corner
