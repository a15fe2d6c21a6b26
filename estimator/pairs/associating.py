"""Whose outline is whose: each run of outlines against each particle's calibrated views.

A few pictures of a run are searched for a pose of either particle, from nothing. The right particle's best pose leaves what noise leaves;
the wrong one's misses by pixels, unless the two are alike. The assignment that misses less is taken, and how much less is told.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.camera import HsvCamera
from estimator.configuration import Configuration
from estimator.fitting.pose_search import SearchEffort, search_pose
from estimator.geometry.silhouettes import silhouettes
from estimator.outlines.result import FrameOutline
from estimator.pairs.apart import Run
from estimator.particle import Particle, views_like

Array = NDArray[np.float64]
LOOKED_AT = 3
"""Pictures of a run."""
NOWHERE_PX = 100.0
"""What a search that finds no pose misses by."""
LEAST_RATIO = 1.5
"""Of the squares that the other assignment leaves over those that the taken one leaves; below it the particles are too much alike."""


@dataclass(frozen=True)
class Assigned:
    """Which of a run's two followed outlines is the first particle's, and the ``ratio`` of what the other way round leaves to this."""

    first: int
    ratio: float


def assigned(run: Run, particles: tuple[Particle, Particle], camera: HsvCamera, configuration: Configuration) -> Assigned:
    """Decide a run."""
    misses = np.array([[_missed(outlines, particle, camera, configuration) for outlines in run.outlines] for particle in particles])
    straight, crossed = misses[0, 0] + misses[1, 1], misses[0, 1] + misses[1, 0]
    first = 0 if straight <= crossed else 1
    return Assigned(first, float(max(straight, crossed) / max(min(straight, crossed), 1e-12)))


def _missed(outlines: tuple[FrameOutline, ...], particle: Particle, camera: HsvCamera, configuration: Configuration) -> float:
    """Mean square (px²) that the best poses of a particle leave of some outlines."""
    chosen = np.unique(np.linspace(0, len(outlines) - 1, LOOKED_AT + 2).round().astype(int)[1:-1])
    return float(np.mean([best_miss_px(outlines[k], particle, camera, configuration) ** 2 for k in chosen]))


def best_miss_px(outline: FrameOutline, particle: Particle, camera: HsvCamera, configuration: Configuration) -> float:
    """RMS ETE (px) of the best pose of a particle for one outline."""
    seen = silhouettes([outline.outline], [camera.intrinsics])
    if len(seen.xy) == 0:
        return NOWHERE_PX
    views = views_like(particle, seen, np.random.default_rng(configuration.seed))
    found = search_pose(seen, views, particle.catalogue, SearchEffort(starts=configuration.pose_starts, candidates=2))
    return float(found.rms_px[0]) if len(found.rms_px) else NOWHERE_PX
