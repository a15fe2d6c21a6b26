"""The outline of every frame of the high-speed camera, with the effects in force; without any, the exact one of the exposure's middle.

Where the outline is that of a picture that moved during its exposure, the silhouettes of many of its instants are drawn on a fine grid, and
the curve is drawn that as many of them enclose as the threshold's level says. Where the lens is out of focus, too, their mean is blurred,
and the curve is that of the level; the blur is wide against the grid's cells, which are a blur themselves.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.camera import Intrinsics
from synth.contact.chipping import Chip
from synth.pair_outlines import outlines_of_two
from synth.plan import SequencePlan, particle_poses_in_camera
from synth.plate_setting import beside_plate, plate_outline
from synth.row_by_row import LONGEST_EDGE_PX, refined, row_by_row_outline
from synth.silhouette import (
    Grid,
    OutlineMesh,
    blurred,
    exact_outline,
    grid_around,
    level_outline,
    mean_coverage,
    outline_mesh,
    quantile_coverage,
)

Array = NDArray[np.float64]

FEWEST_SUBFRAMES, MOST_SUBFRAMES = 16, 256
CELLS_PER_PX = 8
HALF = 0.5
MOST_CELLS = 2048
"""Along one side of a picture; larger particles get a coarser grid."""
REACH = 5.0
"""Standard deviations of the blur that the grid reaches beyond the particle."""


def frame_outlines(plan: SequencePlan, mesh: OutlineMesh) -> Iterator[Array]:
    """The outline (n, 2) px of every frame, as a segmentation without noise draws it; ``mesh`` is that of ``plan.vertices``.

    Where a plate hides part of the particle, its outline ends there; (0, 2) where nothing is seen. A chip is part of the outline of what it
    broke off as long as they are one in the picture.
    """
    scene, whole = _Scene(plan, mesh), len(plan.true_times_s)
    if plan.remnant is not None:
        broken = _Scene(plan, outline_mesh(plan.remnant.mesh_vertices, plan.faces))
        whole = int(np.searchsorted(plan.true_times_s, plan.remnant.time_s))
    chip = None if plan.chip is None else _scene_of_chip(plan, plan.chip)
    for number, time_s in enumerate(plan.true_times_s):
        outline = (scene if number < whole else broken).seen(number)
        if chip is not None and number >= whole:
            outline = outlines_of_two(outline, chip.seen(number))[0]
        segmented = plan.effects.segmented(outline, plan.true_camera)
        yield segmented if plan.setting is None else beside_plate(segmented, _plate_px(plan, float(time_s)))


def _scene_of_chip(plan: SequencePlan, chip: Chip) -> "_Scene":
    """The chip before the camera of a plan; frames before it broke off show it where it did."""
    motion = replace(chip.flight.at(np.maximum(plan.true_times_s, chip.from_s)), times_s=plan.motion.times_s)
    alone = replace(plan, body=chip.body.body, motion=motion, flight=chip.flight)
    return _Scene(alone, outline_mesh(chip.body.vertices, chip.faces))


def _plate_px(plan: SequencePlan, time_s: float) -> Array:
    """The plate's outline (px) in a frame's picture."""
    assert plan.setting is not None
    camera = plan.effects.camera_at(plan.true_camera, time_s)
    return plate_outline(plan.setting, plan.hsv, camera, time_s)


@dataclass(frozen=True)
class _Scene:
    """The particle of a plan before its true camera; ``after_s`` counts from the frame's true time."""

    plan: SequencePlan
    mesh: OutlineMesh

    @cached_property
    def fine_mesh(self) -> OutlineMesh:
        """The mesh for pictures whose rows are exposed one after the other."""
        nearest = float(self.depths_m.min())
        return refined(self.mesh, LONGEST_EDGE_PX * nearest / max(self.plan.true_camera.fx_px, self.plan.true_camera.fy_px))

    @cached_property
    def depths_m(self) -> Array:
        """Depth of the centre of mass in every frame."""
        hsv = self.plan.hsv
        return (self.plan.motion.x_world @ hsv.R_cam_world.T + hsv.t_cam_world)[:, 2]

    @cached_property
    def poses(self) -> tuple[Array, Array]:
        """Poses at the frames' true times."""
        return particle_poses_in_camera(self.plan.body, self.plan.motion, self.plan.hsv)

    def seen(self, number: int) -> Array:
        """The outline of frame ``number`` before segmentation."""
        return self.blurred_outline(number) if self.plan.effects.blurred else self.outline(number, 0.0)

    def outline(self, number: int, after_s: float) -> Array:
        """The outline of frame ``number`` before segmentation, as it is at one instant."""
        plan, stamp = self.plan, self.stamp(number) + after_s
        if plan.effects.rolling:

            def points_at(delays_s: Array) -> Array:
                R, t = self.pose(number, after_s + delays_s)
                return np.asarray(np.einsum("kij,vj->kvi", R, self.fine_mesh.vertices) + t[:, None])

            return row_by_row_outline(self.fine_mesh, plan.true_camera, points_at, plan.effects, stamp)
        R, t = self.pose(number, np.array([after_s]))
        return exact_outline(self.mesh, self.camera(stamp), R[0], t[0])

    def blurred_outline(self, number: int) -> Array:
        """The outline of the picture of a whole exposure, or of its middle where only the lens blurs."""
        plan, level = self.plan, self.plan.effects.level
        count = 1 if level is None else self.instants(number)
        after = plan.clock.exposure_s * ((np.arange(count) + 0.5) / count - 0.5)
        outlines = [self.outline(number, float(instant)) for instant in after]
        sigma = float(plan.effects.sigma_px(self.depths_m[[number]] - self.depths_m[0])[0])
        if count == 1 and sigma == 0:
            return outlines[0]
        grid = _grid(np.vstack(outlines), sigma)
        level = HALF if level is None else level
        if sigma == 0:
            return level_outline(quantile_coverage(outlines, grid, level), grid, HALF)
        return level_outline(blurred(mean_coverage(outlines, grid), sigma * grid.cells_per_px), grid, level)

    def instants(self, number: int) -> int:
        """So many that the particle moves by no more than a cell from one to the next."""
        half = self.plan.clock.exposure_s / 2
        R, t = self.pose(number, np.array([-half, half]))
        before, after = (self.plan.true_camera.project(self.mesh.vertices @ R[k].T + t[k]) for k in (0, 1))
        moved = float(np.linalg.norm(after - before, axis=1).max())
        return int(np.clip(np.ceil(moved * CELLS_PER_PX), FEWEST_SUBFRAMES, MOST_SUBFRAMES))

    def pose(self, number: int, after_s: Array) -> tuple[Array, Array]:
        """Poses at instants (n,) s."""
        if not after_s.any():
            return self.poses[0][[number]].repeat(len(after_s), axis=0), self.poses[1][[number]].repeat(len(after_s), axis=0)
        plan = self.plan
        return particle_poses_in_camera(plan.body, plan.flight.at(plan.true_times_s[number] + after_s), plan.hsv)

    def stamp(self, number: int) -> float:
        """The frame's time stamp (s) after the first one's."""
        return float(self.plan.clock.times_s[number] - self.plan.clock.times_s[0])

    def camera(self, stamp_s: float) -> Intrinsics:
        """The camera that shows the picture as it is shifted at one instant."""
        return self.plan.effects.camera_at(self.plan.true_camera, stamp_s)


def _grid(points_px: Array, sigma_px: float) -> Grid:
    """A grid that holds the blurred particle."""
    margin = REACH * sigma_px + 2
    extent = float(np.ptp(points_px, axis=0).max()) + 2 * margin
    return grid_around(points_px, margin, int(np.clip(MOST_CELLS // extent, 2, CELLS_PER_PX)))
