"""Which high-speed camera shows each of n sightings, and what follows from it: lenses, pictures, and whose effects act.

What belongs to one camera, its lens or its clock, does nothing in the pictures of another.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.camera import HsvCamera

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class SeenBy:
    """``number`` (n,) of the one among ``cameras`` that shows each of n sightings."""

    cameras: tuple[HsvCamera, ...]
    number: NDArray[np.int64]

    @cached_property
    def focal_px(self) -> Array:
        """Focal lengths (n, 2) px along x and y."""
        return self._each([[c.intrinsics.fx_px, c.intrinsics.fy_px] for c in self.cameras])

    @cached_property
    def principal_px(self) -> Array:
        """Principal points (n, 2) px."""
        return self._each([[c.intrinsics.cx_px, c.intrinsics.cy_px] for c in self.cameras])

    @cached_property
    def middle_px(self) -> Array:
        """Middles (n, 2) px of the pictures."""
        return self._each([[(c.intrinsics.width_px - 1) / 2, (c.intrinsics.height_px - 1) / 2] for c in self.cameras])

    def by(self, camera: str | None) -> NDArray[np.bool_]:
        """Which (n,) a camera of that name shows; all of them for ``None``."""
        return np.array([camera in (None, c.name) for c in self.cameras], dtype=np.bool_)[self.number]

    def only(self, camera: str | None, changed: Array, unchanged: Array | float = 0.0) -> Array:
        """What is ``changed`` (n, ...) where a camera of that name shows it, ``unchanged`` (n, ...) or one number elsewhere."""
        if camera is None:
            return changed
        mine = self.by(camera).reshape(-1, *(1,) * (changed.ndim - 1))
        return np.where(mine, changed, unchanged)

    def _each(self, of_cameras: list[list[float]]) -> Array:
        return np.array(of_cameras, dtype=np.float64)[self.number]
