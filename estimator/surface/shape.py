"""Where fits of the particle's surface begin, and the rounds that all of them take."""

from dataclasses import dataclass

import numpy as np

from estimator.geometry.silhouettes import Silhouettes
from estimator.surface.evenness import BENT, LEAST_BEND, Believed, believed, slowed
from estimator.surface.star_surface import Surface

ALIGNED = 8
"""Rounds in which corners are drawn to edges, samples as noisy as their outlines show by themselves."""
FIRST_BEND, EVEN, SHARP = 0.1, 5, 14
"""Scale of bends in the first rounds, the usual bend of jagged bodies; rounds that keep it, and the round by which it has fallen to the
least. Falling from the first round on, edges formed that are none: samples of a stone's frames lay 0.26 px off, not 0.22."""


@dataclass(frozen=True)
class Shape:
    """A ``surface`` and the effective noise (px) of the samples that show it."""

    surface: Surface
    noise_px: float


def believed_in(surface: Surface, number: int) -> Believed:
    """What is believed of a surface in a round; corners of the hull that it begins as are no edges. Until it is sharp it bends slowly."""
    prior = believed(surface, scale_in(number), bent=BENT if number else np.inf)
    return slowed(prior, surface, FIRST_BEND) if number < SHARP else prior


def scale_in(number: int) -> float:
    """Scale of bends in a round: it falls by the same factor from round to round, so that creases which nothing needs can go one by one."""
    return float(FIRST_BEND * (LEAST_BEND / FIRST_BEND) ** np.clip((number - EVEN) / (SHARP - EVEN), 0.0, 1.0))


def own_noise_px(seen: Silhouettes) -> float:
    """Noise (px) that outlines show by themselves, in the median."""
    return float(np.median(seen.noise_px[seen.samples > 0]))
