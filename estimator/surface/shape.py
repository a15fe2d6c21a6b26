"""The particle's surface as its calibrated views alone show it: where fits of campaigns begin, and the rounds of all fits."""

from dataclasses import dataclass

import numpy as np

from estimator.data.configuration import Configuration
from estimator.geometry.silhouettes import Silhouettes
from estimator.particle.made_once import FittedSurface
from estimator.particle.particle import Particle
from estimator.surface.arrow import eliminated, no_rows, weighed
from estimator.surface.evenness import BENT, LEAST_BEND, Believed, believed
from estimator.surface.samples import samples_of_views
from estimator.surface.star_surface import SUBDIVISIONS, Surface, sphere_of, star_surface

ALIGNED, ROUNDS = 8, 16
"""Rounds in which corners are drawn to edges, samples as noisy as their outlines show by themselves, and rounds at all."""
FIRST_BEND, EVEN, SHARP = 0.1, 5, 14
"""Scale of bends in the first rounds, the usual bend of jagged bodies; rounds that keep it, and the round by which it has fallen to the
least. Falling from the first round on, edges formed that are none: samples of a stone's frames lay 0.26 px off, not 0.22."""


@dataclass(frozen=True)
class Shape:
    """A ``surface`` and the effective noise (px) of the samples that show it."""

    surface: Surface
    noise_px: float


def made_shape(particle: Particle, *, huber: float, seed: int) -> Shape:
    """The shape that a particle file keeps, where it does, of the settings that it is made with; else it is fitted."""
    kept, usual = particle.made.surface, Configuration()
    if kept is None or (huber, seed) != (usual.huber, usual.seed):
        return shape_of(particle, huber=huber, seed=seed)
    return Shape(Surface(sphere_of(len(kept.vertices)), kept.centre, kept.vertices), kept.noise_px)


def fitted_surface(particle: Particle) -> FittedSurface:
    """What a particle file keeps of the shape: fitted with the settings that are usual."""
    usual = Configuration()
    shape = shape_of(particle, huber=usual.huber, seed=usual.seed)
    return FittedSurface(shape.surface.vertices, shape.surface.centre, shape.noise_px)


def shape_of(particle: Particle, *, huber: float, seed: int, subdivisions: int = SUBDIVISIONS) -> Shape:
    """The shape fitted to all samples of the views' outlines.

    ``huber``: standard deviations beyond which a sample's influence stays constant; ``seed`` of the random signs.
    """
    surface, rng = star_surface(particle, subdivisions=subdivisions), np.random.default_rng(seed)
    noise_px: tuple[float, ...] = (own_noise_px(particle.seen),)
    alone = np.zeros(0)  # no motions
    for number in range(ROUNDS):
        prior = believed_in(surface, number)
        samples = samples_of_views(surface, particle.outlines, particle.calibrated)
        fitted = eliminated([weighed(samples, prior, noise_px[0], huber)], prior, no_rows(len(surface.vertices)))
        noise_px = fitted.noise(alone, noise_px, rng) if number >= ALIGNED else noise_px
        surface = surface.moved(fitted.corners(alone))
    return Shape(surface, noise_px[0])


def believed_in(surface: Surface, number: int) -> Believed:
    """What is believed of a surface in a round; corners of the hull that it begins as are no edges."""
    return believed(surface, scale_in(number), bent=BENT if number else np.inf)


def scale_in(number: int) -> float:
    """Scale of bends in a round: it falls by the same factor from round to round, so that creases which nothing needs can go one by one."""
    return float(FIRST_BEND * (LEAST_BEND / FIRST_BEND) ** np.clip((number - EVEN) / (SHARP - EVEN), 0.0, 1.0))


def own_noise_px(seen: Silhouettes) -> float:
    """Noise (px) that outlines show by themselves, in the median."""
    return float(np.median(seen.noise_px[seen.samples > 0]))
