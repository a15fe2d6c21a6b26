"""The last fit of free flights with the surface as a nuisance: every outline sample of every picture and every view.

Unknown are the flights (12 numbers each), the body's mass properties that they share (8), and the surface's corners. Samples of views bear
on the surface alone, those of frames on both; corners are held by what is believed of surfaces (:mod:`estimator.surface.evenness`), the
mass properties by those of the surface.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimator.data.fit_task import Prior, Sightings
from estimator.effects.link import TAILS
from estimator.fitting.refinement import scaled_inverse
from estimator.motion.flight import N_PARAMETERS, OFFSET, Flight, moved
from estimator.particle.particle import Particle
from estimator.surface.arrow import Whole, eliminated, weighed
from estimator.surface.evenness import believed
from estimator.surface.frame_samples import samples_of_frames
from estimator.surface.mass import N_MASS, mass_response
from estimator.surface.samples import samples_of_views
from estimator.surface.shape import Shape, own_noise_px
from estimator.surface.star_surface import Surface

Array = NDArray[np.float64]
Index = NDArray[np.int64]
STATE = 12
"""Parameters that every flight has for itself: position, turn, velocity, spin."""
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
    """``flights`` with the ``covariance`` (p, p) of all their parameters, and the ``surface``; ``settled``: whether the steps became small.

    ``place``: of every flight, where its parameters (21,) lie; ``deviation`` (8,): standard deviations that the body's mass properties were
    found to have from those of its surface. ``noise_px``: effective noise that samples of views and of every flight's
    frames were found to have, ``outline_noise_px`` what their outlines show by themselves.
    """

    flights: tuple[Flight, ...]
    covariance: Array
    place: tuple[Index, ...]
    deviation: Array
    surface: Surface
    noise_px: tuple[float, ...]
    outline_noise_px: tuple[float, ...]
    settled: bool


def joint_fit(
    particle: Particle, seen: Sequence[Sightings], begin: tuple[Sequence[Flight], Shape], prior: Prior, *, huber: float, seed: int
) -> JointFit:
    """Surface and flights, from flights that the tangents gave and the shape that the views give, by steps that take all along.

    ``huber``: standard deviations beyond which a sample's influence stays constant; ``seed`` of the random signs.
    """
    flights, shape = _alike([replace(flight, offset_px=0.0) for flight in begin[0]]), begin[1]
    place, size = _places(len(flights))
    surface, rng = shape.surface, np.random.default_rng(seed)
    own = own_noise_px(particle.seen), *(own_noise_px(each.silhouettes) for each in seen)
    noise_px: tuple[float, ...] = (shape.noise_px, *own[1:])
    covariance, settled, gain, last = np.zeros((size, size)), False, 1.0, np.zeros(size)
    deviation = np.array([COM_SHARE * particle.extent_m] * 3 + [MOMENTS] * 2 + [PRODUCTS] * 3)
    for _ in range(MOST_ROUNDS):
        believe = believed(surface)
        views = samples_of_views(surface, particle.outlines, particle.calibrated, motions=0)
        frames = [samples_of_frames(surface, each, flight) for each, flight in zip(seen, flights, strict=True)]
        every = zip((views, *frames), noise_px, (np.arange(0), *place), strict=True)
        groups = [weighed(samples, believe, noise, huber, where) for samples, noise, where in every]
        rows = _mass_rows(surface, flights[0], deviation, size)
        fitted = eliminated(groups, believe, rows)
        step, covariance = _with_offset_considered(fitted.H, fitted.g, prior)
        deviation = deviation * _spread(rows, step, covariance)
        sizes = step / np.sqrt(np.diag(covariance))
        gain *= TURNED if last @ sizes < 0.0 else 1.0
        noise_px, last = fitted.noise(step, noise_px, rng), sizes
        surface = surface.moved(fitted.corners(gain * step))
        flights = [moved(flight, gain * step[where]) for flight, where in zip(flights, place, strict=True)]
        settled = bool(gain * np.max(np.abs(sizes)) < SETTLED)
        if settled:
            break
    return JointFit(tuple(flights), covariance, place, deviation, surface, noise_px, own, settled)


def _places(flights: int) -> tuple[tuple[Index, ...], int]:
    """Where the parameters (21,) of every flight lie, states first and then what all share, and how many all are."""
    shared = np.arange(STATE * flights, STATE * flights + N_PARAMETERS - STATE)
    place = tuple(np.concatenate([np.arange(STATE * i, STATE * (i + 1)), shared]) for i in range(flights))
    return place, STATE * flights + N_PARAMETERS - STATE


def _alike(flights: Sequence[Flight]) -> list[Flight]:
    """Flights of one body: with the mean of their mass properties."""
    com, inertia = (np.mean([getattr(flight, name) for flight in flights], axis=0) for name in ("com", "inertia"))
    return [replace(flight, com=com, inertia=inertia) for flight in flights]


def _mass_rows(surface: Surface, flight: Flight, deviation: Array, size: int) -> Whole:
    """The flights' mass properties are those of the surface within a ``deviation`` (8,); ``size`` of all parameters."""
    mass, now = mass_response(surface, flight.body), np.concatenate([flight.com, flight.inertia])
    by_flight = np.zeros((N_MASS, size))
    by_flight[:, size - 1 - N_MASS : size - 1] = np.diag(1.0 / deviation)
    return Whole((now - mass.values) / deviation, by_flight, mass.by_corner / deviation)


def _spread(rows: Whole, step: Array, covariance: Array) -> float:
    """By how much more than was thought mass properties are off, most probable after a ``step`` (p,): the scale of Student's prior.

    Hollows that no outline shows are in the mass properties alone, and a body has many or none [Lange, Little and Taylor 1989].
    """
    off, spread = rows.residual + rows.by_motion @ step, rows.by_motion @ covariance @ rows.by_motion.T
    return float(np.sqrt((TAILS + off @ off + np.trace(spread)) / (TAILS + len(off))))


def _with_offset_considered(H: Array, g: Array, prior: Prior) -> tuple[Array, Array]:
    """Step (p,) that leaves the outline offset, the last, alone, and the covariance (p, p) to which its prior adds [Schmidt, 1966].

    The offset is the size of the body over that of its outlines: estimated, it took up what the surface's shape is wrong by.
    """
    inverse = scaled_inverse(H[:-1, :-1])
    step = np.append(-inverse @ g[:-1], 0.0)
    by_offset = np.append(-inverse @ H[:-1, -1], 1.0)[:, None]
    covariance = np.zeros(H.shape)
    covariance[:-1, :-1] = inverse
    return step, covariance + by_offset @ by_offset.T / prior.precision[OFFSET]
