"""The last fit of a free flight with the surface as a nuisance: every outline sample of every picture and every view.

Unknown are the flight (21 numbers) and the surface's corners. Samples of views bear on the surface alone, those of frames on both; corners
are held by what is believed of surfaces (:mod:`estimator.surface.evenness`), the flight's mass properties by those of the surface.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimator.data.fit_task import Prior, Sightings
from estimator.fitting.refinement import scaled_inverse
from estimator.motion.flight import COM, INERTIA, N_PARAMETERS, OFFSET, Flight, moved
from estimator.particle.particle import Particle
from estimator.surface.arrow import Whole, eliminated, weighed
from estimator.surface.evenness import believed
from estimator.surface.mass import N_MASS, mass_response
from estimator.surface.samples import samples_of_frames, samples_of_views
from estimator.surface.shape import Shape
from estimator.surface.star_surface import Surface

Array = NDArray[np.float64]
MOST_ROUNDS = 12
"""After which a fit that has not settled is given up: fits of trial runs settled within two to six, one in nine, of a stone that the mesh
cannot follow."""
SETTLED, TURNED = 0.3, 0.6
"""Share of the standard deviations that ends the fit. Samples that change the edge they meet throw it about by as much and more, so that
every step that turns back shortens all that follow by the second number: their mean is what is looked for."""
COM_SHARE, MOMENTS, PRODUCTS = 0.0006, 0.005, 0.002
"""Standard deviations of what a uniform surface's centre of mass (over its extent) and inertia (relative) are off by. In trial runs with 60
views five scanned bodies were within 0.0007, 0.007 and 0.003; one with a hollow was off by 0.003, 0.009 and 0.005."""


@dataclass(frozen=True)
class JointFit:
    """``flight`` with its ``covariance`` (21, 21) and the ``surface``; ``settled``: whether the steps became small.

    ``noise_px``: effective noise that samples of views and of frames were found to have.
    """

    flight: Flight
    covariance: Array
    surface: Surface
    noise_px: tuple[float, ...]
    settled: bool


def joint_fit(particle: Particle, sightings: Sightings, begin: tuple[Flight, Shape], prior: Prior, *, huber: float, seed: int) -> JointFit:
    """Surface and flight, from a flight that the tangents gave and the shape that the views give, by steps that take both along.

    ``huber``: standard deviations beyond which a sample's influence stays constant; ``seed`` of the random signs.
    """
    flight, shape = replace(begin[0], offset_px=0.0), begin[1]
    surface, rng = shape.surface, np.random.default_rng(seed)
    frames = float(np.median(sightings.silhouettes.noise_px[sightings.silhouettes.samples > 0]))
    noise_px: tuple[float, ...] = (shape.noise_px, frames)
    covariance, settled, gain, last = np.zeros((N_PARAMETERS, N_PARAMETERS)), False, 1.0, np.zeros(N_PARAMETERS)
    for _ in range(MOST_ROUNDS):
        believe = believed(surface)
        samples = samples_of_views(surface, particle.outlines, particle.calibrated), samples_of_frames(surface, sightings, flight)
        groups = [weighed(s, believe, noise, huber) for s, noise in zip(samples, noise_px, strict=True)]
        fitted = eliminated(groups, believe, _mass_rows(surface, flight, particle.extent_m))
        step, covariance = _with_offset_considered(fitted.H, fitted.g, prior)
        sizes = step / np.sqrt(np.diag(covariance))
        gain *= TURNED if last @ sizes < 0.0 else 1.0
        noise_px, last = fitted.noise(step, noise_px, rng), sizes
        surface, flight = surface.moved(fitted.corners(gain * step)), moved(flight, gain * step)
        settled = bool(gain * np.max(np.abs(sizes)) < SETTLED)
        if settled:
            break
    return JointFit(flight, covariance, surface, noise_px, settled)


def _mass_rows(surface: Surface, flight: Flight, extent_m: float) -> Whole:
    """The flight's mass properties are those of the surface within what a uniform one is off by."""
    deviation = np.array([COM_SHARE * extent_m] * 3 + [MOMENTS] * 2 + [PRODUCTS] * 3)
    mass, now = mass_response(surface, flight.body), np.concatenate([flight.com, flight.inertia])
    by_flight = np.zeros((N_MASS, N_PARAMETERS))
    by_flight[:3, COM] = np.diag(1.0 / deviation[:3])
    by_flight[3:, INERTIA] = np.diag(1.0 / deviation[3:])
    return Whole((now - mass.values) / deviation, by_flight, mass.by_corner / deviation)


def _with_offset_considered(H: Array, g: Array, prior: Prior) -> tuple[Array, Array]:
    """Step (21,) that leaves the outline offset alone, and the covariance (21, 21) to which its prior adds [Schmidt, 1966].

    The offset is the size of the body over that of its outlines: estimated, it took up what the surface's shape is wrong by.
    """
    free = np.arange(N_PARAMETERS)[: OFFSET.start]
    inverse = scaled_inverse(H[np.ix_(free, free)])
    step, covariance = np.zeros(N_PARAMETERS), np.zeros((N_PARAMETERS, N_PARAMETERS))
    step[free] = -inverse @ g[free]
    by_offset = np.zeros((N_PARAMETERS, 1))
    by_offset[free] = -inverse @ H[free, OFFSET]
    by_offset[OFFSET] = 1.0
    covariance[np.ix_(free, free)] = inverse
    return step, covariance + by_offset @ by_offset.T / prior.precision[OFFSET]
