"""What an instrument may see of a sequence: pictures or outlines, cameras, clock, gravity and calibrated views."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.camera import HsvCamera, Intrinsics
from datasets.vocabulary.clock import Clock
from datasets.vocabulary.outline import Outline
from datasets.vocabulary.plate import Plate

Array = NDArray[np.float64]


COMPANION = " (companion)"
"""What follows a sequence's name in tables, in the rows of its second particle."""


@runtime_checkable
class Frames(Protocol):
    """Pictures read lazily, one at a time."""

    @property
    def bit_depth(self) -> int:
        """Bits that carry signal; full scale is ``2**bit_depth - 1``."""
        ...

    def __len__(self) -> int: ...

    def read(self, index: int) -> NDArray[np.uint16]:
        """Picture ``index``, (height, width)."""
        ...

    def background(self) -> NDArray[np.uint16] | None:
        """A picture without the particle, (height, width), or ``None`` where none was taken."""
        ...

    def background_of(self, index: int) -> NDArray[np.uint16] | None:
        """The background that belongs to picture ``index`` (views of several rig cameras have one each), else :meth:`background`."""
        ...


@runtime_checkable
class Made(Protocol):
    """What was made once of a particle's views, kept in a file."""

    def load(self, of: str) -> Mapping[str, NDArray[np.generic]] | None:
        """The arrays that were made from what has the digest ``of``; ``None`` where the file holds those of something else."""
        ...


Recording = Frames | Sequence[Outline]
"""What one camera recorded: frames (rendered tier, real video) or outlines (silhouette tier)."""


@dataclass(frozen=True)
class CalibratedView:
    """One calibrated view of the particle at rest; ``R_cam_particle, t_cam_particle`` map particle to camera coordinates (m).

    ``drop`` numbers the placement of the particle in the rig, ``camera`` the rig camera (views of one rig camera share its background).
    """

    intrinsics: Intrinsics
    R_cam_particle: Array
    t_cam_particle: Array
    drop: int = 0
    camera: int = 0


@dataclass(frozen=True)
class Companion:
    """A second particle in the same pictures: its calibrated ``views``, their recording, and its mass (kg) where it was weighed."""

    views: tuple[CalibratedView, ...]
    view_recording: Recording
    mass_kg: float | None = None


@dataclass(frozen=True)
class Observation:
    """Everything an estimator gets.

    ``recordings[c]`` belongs to ``cameras[c]`` and has one entry per time of its clock: that is ``clock``, the first camera's, unless
    ``camera_clocks`` has one for every camera, of which the first is ``clock``.
    ``view_recording`` has one entry per view. ``gravity_world`` in m/s². ``mass_kg`` only where it was weighed.
    ``gravity_covariance`` (3, 3): where it was measured with one. ``sigma_length_scale``: how well the calibration of the views knows
    lengths, relative, one factor for all: a board that was printed too large makes every particle as much too large.
    ``plate``: the plate that the particle falls on, where its plane was measured. ``plate_outlines``: where the plate is seen in each
    camera's background (one per camera, ``None`` where it is not; no entries:
    nowhere); within it no outline can be told.

    ``companion``: a second particle. Pictures then show two outlines where the two are apart and one where they are not:
    ``further_recordings[c]`` has the smaller outline of each picture of ``recordings[c]``, empty where there is but one. Whose an outline
    is, is not told.

    ``particle``: the folder of the particle file that the views are from, where it is known; ``made``: what is kept there.

    ``notes``: what a reader changed, in sentences for a person.
    """

    name: str
    cameras: tuple[HsvCamera, ...]
    recordings: tuple[Recording, ...]
    clock: Clock
    gravity_world: Array
    views: tuple[CalibratedView, ...]
    view_recording: Recording
    mass_kg: float | None = None
    plate: Plate | None = None
    plate_outlines: tuple[Outline | None, ...] = ()
    companion: Companion | None = None
    further_recordings: tuple[Recording, ...] = ()
    gravity_covariance: Array | None = None
    sigma_length_scale: float | None = None
    particle: Path | None = None
    made: Made | None = None
    notes: tuple[str, ...] = ()
    camera_clocks: tuple[Clock, ...] = ()

    def clock_of(self, camera: int) -> Clock:
        """The clock of a camera, by its number."""
        return self.camera_clocks[camera] if self.camera_clocks else self.clock

    @property
    def clocks(self) -> tuple[Clock, ...]:
        """Of every camera."""
        return self.camera_clocks or (self.clock,) * len(self.cameras)
