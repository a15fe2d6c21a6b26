"""Whose outline is whose: each run of outlines against each particle's calibrated views.

A few pictures of a run are searched for a pose of either particle, from nothing. The right particle's best pose leaves what noise leaves;
the wrong one's misses by pixels, unless the two are alike. The assignment that misses less is taken, and how much less is told.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.camera import HsvCamera
from estimator.data.configuration import Configuration
from estimator.data.views import Views
from estimator.geometry.silhouettes import Silhouettes, silhouettes
from estimator.outlines.result import FrameOutline, OutlineTrack
from estimator.pairs.apart import Run
from estimator.particle.particle import Particle, views_like
from estimator.poses.pose_search import SearchEffort, search_pose

Array = NDArray[np.float64]
LOOKED_AT = 3
"""Pictures of a run."""
NOWHERE_PX = 100.0
"""What a search that finds no pose misses by."""
LEAST_RATIO = 1.5
"""Of the squares that the other assignment leaves over those that the taken one leaves; below it the particles are too much alike."""


@dataclass(frozen=True)
class Sought:
    """A particle, its views in the likeness of the ``camera``'s outlines, whosever these are, and how hard to search."""

    particle: Particle
    views: Views
    camera: HsvCamera
    effort: SearchEffort


@dataclass(frozen=True)
class Assigned:
    """Which of a run's two followed outlines is the first particle's, and the ``ratio`` of what the other way round leaves to this."""

    first: int
    ratio: float


def sought(particle: Particle, track: OutlineTrack, camera: HsvCamera, configuration: Configuration) -> Sought:
    """A particle to be looked for among outlines like those of ``track``, of which at least one can be used."""
    used = np.flatnonzero(track.used)
    some = used[np.unique(np.linspace(0, len(used) - 1, LOOKED_AT).round().astype(int))]
    views = views_like(particle, _seen([track.frames[k] for k in some], camera), np.random.default_rng(configuration.seed))
    return Sought(particle, views, camera, SearchEffort(starts=configuration.pose_starts, candidates=2))


def assigned(run: Run, particles: tuple[Sought, Sought]) -> Assigned:
    """Decide a run."""
    misses = np.array([[_missed(outlines, particle) for outlines in run.outlines] for particle in particles])
    straight, crossed = misses[0, 0] + misses[1, 1], misses[0, 1] + misses[1, 0]
    first = 0 if straight <= crossed else 1
    return Assigned(first, float(max(straight, crossed) / max(min(straight, crossed), 1e-12)))


def _missed(outlines: tuple[FrameOutline, ...], particle: Sought) -> float:
    """Mean square (px²) that the best poses of a particle leave of some outlines."""
    chosen = np.unique(np.linspace(0, len(outlines) - 1, LOOKED_AT + 2).round().astype(int)[1:-1])
    return float(np.mean([best_miss_px(outlines[k], particle) ** 2 for k in chosen]))


def best_miss_px(outline: FrameOutline, particle: Sought) -> float:
    """RMS ETE (px) of the best pose of a particle for one outline."""
    seen = _seen([outline], particle.camera)
    found = search_pose(seen, particle.views, particle.particle.catalogue, particle.effort) if len(seen.xy) else None
    return float(found.rms_px[0]) if found is not None and len(found.rms_px) else NOWHERE_PX


def _seen(outlines: list[FrameOutline], camera: HsvCamera) -> Silhouettes:
    return silhouettes([o.outline for o in outlines], [camera.intrinsics] * len(outlines))
