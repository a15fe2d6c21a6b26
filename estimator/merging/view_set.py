"""One drop: calibrated silhouettes of the particle at one instant, in a frame of their own.

The set's frame is that of the rig in which it was taken. Where the particle lies in another set's frame is what merging finds.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from datasets.errors import InputError
from datasets.observation import CalibratedView
from datasets.vocabulary.outline import Outline
from datasets.vocabulary.surface_mesh import SurfaceMesh
from estimator.data.views import Views
from estimator.geometry.epipolar_tangency import PoseSet
from estimator.geometry.silhouettes import Silhouettes, silhouettes
from estimator.particle.view_faults import agreed_hull

Array = NDArray[np.float64]
MINIMUM_VIEWS = 3
"""Views that make a hull."""
NO_HULL = SurfaceMesh(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64))
COARSE_RESOLUTION = 48
"""Voxels along an edge of a single set's hull, which only says where the particle is and whether others' outlines lie within it."""


@dataclass(frozen=True)
class ViewSet:
    """A set of k views of one instant.

    ``views`` (k) map the set's own frame to their cameras; ``seen`` and ``poses`` are the same, packed. ``hull``: their visual hull (m, the
    set's frame), ``centre`` (3,) m its middle; fewer than three views have no hull (one without vertices) and no known middle.
    ``numbers`` (k,): the views' numbers in what was given.
    """

    name: str
    outlines: tuple[Outline, ...]
    views: tuple[CalibratedView, ...]
    seen: Silhouettes
    poses: PoseSet
    hull: SurfaceMesh
    centre: Array
    numbers: tuple[int, ...]

    def __len__(self) -> int:
        return len(self.views)

    @property
    def extent_m(self) -> float:
        """Largest extent (m) of the hull along the axes of the set's frame; that of a set without a hull is not known: NaN."""
        if self.is_small:
            return float("nan")
        return float(np.ptp(self.hull.vertices, axis=0).max())

    @property
    def is_small(self) -> bool:
        """Whether the views are too few for a hull: such a set is only placed against others."""
        return len(self.views) < MINIMUM_VIEWS

    @property
    def as_views(self) -> Views:
        """The views as a pose search uses them."""
        return Views(self.seen, self.poses, self.centre)


def view_set(name: str, outlines: Sequence[Outline], views: Sequence[CalibratedView]) -> ViewSet:
    """The set of those ``views`` that have an outline.

    Raises
    ------
    InputError
        Where none has one, or three and more leave no body.
    """
    present = [i for i, outline in enumerate(outlines) if not outline.empty]
    kept, posed = [outlines[i] for i in present], [views[i] for i in present]
    if not present:
        raise InputError(f"{name}: expected a view with a usable outline, got none")
    small = len(present) < MINIMUM_VIEWS
    hull = NO_HULL if small else agreed_hull(kept, posed, resolution=COARSE_RESOLUTION)
    return ViewSet(
        name=name,
        outlines=tuple(kept),
        views=tuple(posed),
        seen=silhouettes(kept, [v.intrinsics for v in posed]),
        poses=PoseSet(np.stack([v.R_cam_particle for v in posed]).astype(float), np.stack([v.t_cam_particle for v in posed]).astype(float)),
        hull=hull,
        centre=np.full(3, np.nan)
        if small
        else np.asarray(hull.vertices.mean(axis=0)),  # a hull of three views may be open: it has no volume to weigh
        numbers=tuple(present),
    )
