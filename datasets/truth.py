"""What really happened in a sequence. Closed to the estimator."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from datasets.observation import Frames
from datasets.vocabulary.body import Body
from datasets.vocabulary.state import Motion

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Truth:
    """Poses and velocities at the frame times, the body, its mesh, and the effects in force.

    ``mesh_vertices`` (v, 3) m in the particle frame, ``mesh_faces`` (f, 3). ``inertia_kgm2`` principal moments (3,).
    ``symmetries`` (s, 3, 3): rotations in the particle frame, about the centre of mass, that map the body on to itself
    (identity included). ``masks``: path-backed silhouettes of the rendered tier, or ``None``.
    """

    name: str
    motion: Motion
    body: Body
    mass_kg: float
    inertia_kgm2: Array
    mesh_vertices: Array
    mesh_faces: NDArray[np.int64]
    symmetries: Array = field(default_factory=lambda: np.eye(3)[None])
    descriptors: dict[str, float] = field(default_factory=dict)
    effects: dict[str, Any] = field(default_factory=dict)
    notes: dict[str, Any] = field(default_factory=dict)
    masks: Frames | None = None
