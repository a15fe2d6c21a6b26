"""How far the particle is above a stated plate at an impact, and whether plate and motion agree.

A plate stated with a wrong tilt is contradicted by the gap where the particle hits away from the point the plane is stated at: 10° are
0.9 mm at 5 mm. Turned about the very point of contact it only touches another corner first, and one impact may not show it.
"""

import numpy as np
from numpy.typing import NDArray

from datasets.estimate import ImpactEstimate, PlateGap
from datasets.observation import Observation
from datasets.vocabulary.plate import Plate
from estimator.impacts.piecewise_fit import PiecewiseRefined
from estimator.motion.flight import flown
from estimator.motion.piecewise import Touch, touch_and_sensitivity
from estimator.particle.particle import Particle

Array = NDArray[np.float64]
HULL_SHARE = 0.005
"""Standard deviation of the hull's surface at the point of contact, as a share of the particle's extent.

Gaps over true plates were within 0.02 mm (root mean square) for stones of 6 mm.
"""
MOST_SIGMAS = 3.5
"""A gap, or a depth inside the plate, beyond so many standard deviations contradicts the plate."""


def hull_in_body(particle: Particle) -> Array:
    """Vertices (v, 3) m of the hull in nominal body axes, from the nominal centre."""
    body = particle.body
    return np.asarray((particle.convex_vertices - body.com_particle) @ body.R_particle_body)


def plate_gaps(refined: PiecewiseRefined, observation: Observation, particle: Particle) -> list[PlateGap | None]:
    """What a stated plate says to each impact; nothing where none is stated."""
    flight, plate = refined.flight, observation.plate
    if plate is None:
        return [None for _ in flight.bounces]
    gaps: list[PlateGap | None] = []
    for number, bounce in enumerate(flight.bounces):
        touch, J = touch_and_sensitivity(flight, number)
        at = (touch, spread_by(J, refined.covariance))
        gaps.append(plate_gap(refined, at, bounce.time_s, plate, (observation, particle)))
    return gaps


def spread_by(J: Array, matrix: Array) -> Array:
    """Covariance of what depends on parameters by ``J``, symmetric to the last bit; ``J`` (m, p), ``matrix`` (p, p)."""
    result = J @ matrix @ J.T
    return np.asarray(0.5 * (result + result.T))


def plate_gap(
    refined: PiecewiseRefined, at: tuple[Touch, Array], time_s: float, plate: Plate, seen: tuple[Observation, Particle]
) -> PlateGap:
    """How far the lowest point of the hull is above the plate at the impact, and at worst; ``at``: the impact and its covariance.

    The covariance of ``at`` is (18, 18): pose, velocities before and after.
    """
    (touch, covariance), (observation, particle), flight = at, seen, refined.flight
    n, vertices = plate.normal_world, hull_in_body(particle)
    began = float(observation.clock.times_s[0])
    arms = (vertices - flight.first.com) @ touch.R[0].T
    lowest = int(np.argmin(arms @ n))
    place = touch.x[0] + arms[lowest]
    J = np.concatenate([n, np.cross(arms[lowest], n)])
    lever = place - plate.point_world - plate.velocity_world * (time_s - began)
    sideways = float(np.linalg.norm(lever - (lever @ n) * n))
    variance = float(J @ covariance[:6, :6] @ J) + plate.offset_sigma_m**2 + (plate.normal_sigma_rad * sideways) ** 2
    sigma = float(np.sqrt(variance + (HULL_SHARE * particle.extent_m) ** 2))
    gap = float(plate.height_m(place, time_s - began))
    every = flown(flight, refined.sightings.times_s)
    heights = [
        float(plate.height_m(c + vertices @ R.T, t - began).min())
        for c, R, t in zip(every.centre[:, 0], every.R[:, 0], refined.sightings.times_s, strict=True)
    ]
    deepest = min([gap, *heights])
    return PlateGap(gap, sigma, deepest, bool(abs(gap) <= MOST_SIGMAS * sigma and deepest >= -MOST_SIGMAS * sigma))


def plate_sentences(impacts: tuple[ImpactEstimate, ...]) -> list[str]:
    """What to say of a plate that the motion contradicts."""
    return [
        f"the stated plate contradicts impact {number + 1}: the particle's lowest point is {1e3 * i.plate.gap_m:+.2f} ± "
        f"{1e3 * i.plate.sigma_m:.2f} mm above it there, and {1e3 * i.plate.deepest_m:+.2f} mm at the lowest in any frame."
        for number, i in enumerate(impacts)
        if i.plate is not None and not i.plate.agrees
    ]
