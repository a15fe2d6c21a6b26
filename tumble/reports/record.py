"""What a report knows of one sequence: the estimate, and what else is at hand."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from datasets.estimate import Estimate
from datasets.observation import Observation
from datasets.truth import Truth
from datasets.vocabulary.surface_mesh import SurfaceMesh
from estimator.outlines.result import OutlineTrack
from tumble.reports.residuals import Residuals, outline_residuals

Polygon = NDArray[np.float64]


@dataclass(frozen=True)
class Record:
    """One sequence of a report.

    ``observation`` and ``truth`` are ``None`` where they are not at hand. ``outlines_px[c][i]``: the estimated outline (n, 2), px, of
    frame ``i`` of camera ``c``, ``None`` where there is none. ``tracks[c]``: what was seen by camera ``c``. ``surface``: the body's.
    ``read``: names of the files that this was read from, and their SHA-256.
    """

    estimate: Estimate
    observation: Observation | None = None
    truth: Truth | None = None
    outlines_px: tuple[Sequence[Polygon | None], ...] = ()
    tracks: tuple[OutlineTrack, ...] = ()
    surface: SurfaceMesh | None = None
    read: tuple[tuple[str, str], ...] = ()

    def estimated(self, camera: int, frame: int) -> Polygon | None:
        """The estimated outline (n, 2) px of a frame."""
        return self.outlines_px[camera][frame] if camera < len(self.outlines_px) and frame < len(self.outlines_px[camera]) else None

    def seen(self, camera: int, frame: int) -> Polygon | None:
        """The outline (n, 2) px that was seen in a frame, left out or not."""
        points = self.tracks[camera].frames[frame].outline.points_px if camera < len(self.tracks) else ()
        return np.asarray(points, dtype=np.float64) if len(points) else None

    def residuals(self, camera: int, frame: int) -> Residuals | None:
        """How far the one lies from the other; ``None`` where either is missing or two particles are in the pictures."""
        seen, estimated = self.seen(camera, frame), self.estimated(camera, frame)
        if seen is None or estimated is None or self.estimate.companion is not None:
            return None
        return outline_residuals(seen, estimated, self.tracks[camera].frames[frame].unsure)
