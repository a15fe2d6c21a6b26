"""The particle's surface as its calibrated views alone show it: what every fit of a recording of it begins with."""

from dataclasses import dataclass

import numpy as np

from estimator.data.configuration import Configuration
from estimator.geometry.silhouettes import Silhouettes
from estimator.particle.made_once import FittedSurface
from estimator.particle.particle import Particle
from estimator.surface.arrow import Scales, eliminated, no_rows, weighed
from estimator.surface.evenness import BENT, believed
from estimator.surface.samples import samples_of_views
from estimator.surface.star_surface import SUBDIVISIONS, Surface, sphere_of, star_surface

ALIGNED, ROUNDS = 8, 12
"""Rounds in which corners are drawn to edges, samples as noisy as their outlines show by themselves, and rounds at all."""
FIRST_ROUGHNESS = 0.03
"""Bend over the length of an edge that is expected first. Fits ended at 0.04 for smooth and cut bodies and at 0.1 for stones and jagged
ones in trial runs."""


@dataclass(frozen=True)
class Shape:
    """A ``surface``, how rough it was found to be, and the effective noise (px) of the samples that show it."""

    surface: Surface
    roughness: float
    noise_px: float


def made_shape(particle: Particle, *, huber: float, seed: int) -> Shape:
    """The shape that a particle file keeps, where it does; else it is fitted."""
    kept = particle.made.surface
    if kept is None:
        return shape_of(particle, huber=huber, seed=seed)
    return Shape(Surface(sphere_of(len(kept.vertices)), kept.centre, kept.vertices), kept.roughness, kept.noise_px)


def fitted_surface(particle: Particle, configuration: Configuration) -> FittedSurface:
    """What a particle file keeps of the shape."""
    shape = shape_of(particle, huber=configuration.huber, seed=configuration.seed)
    return FittedSurface(shape.surface.vertices, shape.surface.centre, shape.roughness, shape.noise_px)


def shape_of(particle: Particle, *, huber: float, seed: int, subdivisions: int = SUBDIVISIONS) -> Shape:
    """The shape fitted to all samples of the views' outlines.

    ``huber``: standard deviations beyond which a sample's influence stays constant; ``seed`` of the random signs.
    """
    surface, rng = star_surface(particle, subdivisions), np.random.default_rng(seed)
    scales = Scales((own_noise_px(particle.seen),), FIRST_ROUGHNESS)
    alone = np.zeros(0)  # no motions
    for number in range(ROUNDS):
        prior = believed(surface, scales.roughness, bent=BENT if number else np.inf)
        samples = samples_of_views(surface, particle.outlines, particle.calibrated, motions=0)
        fitted = eliminated([weighed(samples, prior, scales.noise_px[0], huber)], prior, no_rows(len(surface.vertices)))
        found = fitted.scales(alone, scales, rng)
        surface = surface.moved(fitted.corners(alone))
        scales = Scales(found.noise_px if number >= ALIGNED else scales.noise_px, found.roughness)
    return Shape(surface, scales.roughness, scales.noise_px[0])


def own_noise_px(seen: Silhouettes) -> float:
    """Noise (px) that outlines show by themselves, in the median."""
    return float(np.median(seen.noise_px[seen.samples > 0]))
