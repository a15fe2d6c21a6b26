"""The outline of every frame of the high-speed camera, with the effects in force; without any, the exact one of the exposure's middle."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from synth.plan import SequencePlan, particle_poses_in_camera
from synth.silhouette import OutlineMesh, exact_outline

Array = NDArray[np.float64]


def frame_outlines(plan: SequencePlan, mesh: OutlineMesh) -> Iterator[Array]:
    """The outline (n, 2) px of every frame, as a segmentation without noise draws it; ``mesh`` is that of ``plan.vertices``."""
    scene = _Scene(plan, mesh)
    for number in range(len(plan.true_times_s)):
        yield plan.effects.segmented(scene.outline(number), plan.true_camera)


@dataclass(frozen=True)
class _Scene:
    plan: SequencePlan
    mesh: OutlineMesh

    @cached_property
    def poses(self) -> tuple[Array, Array]:
        """Poses at the frames' true times."""
        return particle_poses_in_camera(self.plan.body, self.plan.motion, self.plan.hsv)

    def outline(self, number: int) -> Array:
        """The outline of frame ``number`` before segmentation."""
        plan, (R, t) = self.plan, self.poses
        stamp = float(plan.clock.times_s[number] - plan.clock.times_s[0])
        return exact_outline(self.mesh, plan.effects.camera_at(plan.true_camera, stamp), R[number], t[number])
