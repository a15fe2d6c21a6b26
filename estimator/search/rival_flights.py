"""Which of several fitted flights the outlines cannot refuse: more than one is *ambiguous*, never silently the cheapest.

The same two tests as for one picture (:mod:`estimator.poses.pose_competition`), for a whole sequence:

- *tangency*: a flight is refused when its mean squared error exceeds the 95% quantile of chi² over its degrees of freedom, at the noise
  expected or at the best flight's own where that is larger. Errors of pictures that show the body from nearly the same side are nearly
  the same errors, and an outline has about a dozen independent tangents. So the numbers that count are those of the distinct sides seen,
  not of the frames: a particle that hardly turns shows one side, and a hundred frames of it refuse no more than one does;
- *containment*: where views are few, an outline that reaches out of the visual hull's image refuses a flight that meets the tangencies.

Flights compete that were fitted: from several minima of one picture and, where views are few, of a picture of another side as well.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from estimator.appearance.flight_errors import particle_poses
from estimator.data.fit_task import FitTask
from estimator.data.views import Poses, Views
from estimator.fitting.levenberg_marquardt import Solution
from estimator.geometry.sphere import fibonacci_sphere
from estimator.motion.flight import Flight, flown
from estimator.particle.particle import Particle, hsv_spacing
from estimator.poses.pose_competition import CONFIDENCE, PROTRUSION_SIGMAS, own_protrusion_px, protrusion_px

Array = NDArray[np.float64]
FEW_VIEWS = 16
"""Up to so many views wrong poses meet the tangencies by chance; with 16 and more tangency alone found every one of 36 real views."""
SIDES = 48
"""Cells of the sphere of viewing directions, 29° across, that count as distinct sides."""
INDEPENDENT_TANGENTS = 12
"""Of one outline, roughly."""
CALIBRATION_FREEDOM = 6
"""Numbers that misplace one view: no more of its errors are independent where they come from its calibration."""
POSE, MOTION = 6, 12
"""Parameters that a fit of one side and of several takes from the errors."""
COMPARED = 7
"""Sightings in which a flight's outlines are compared with the hull."""


@dataclass(frozen=True)
class Standing:
    """The flights, the one to report first, and ``rivals`` among them that the outlines cannot refuse beside it.

    ``outside_px``: by how much the first one's outlines reach further out of the visual hull than noise and views explain; zero where they
    do not, or where views are many.
    """

    flights: tuple[Solution[Flight], ...]
    rivals: tuple[Solution[Flight], ...]
    outside_px: float


def few_views(particle: Particle) -> bool:
    """Whether tangency alone cannot be relied on."""
    return len(particle.calibrated) <= FEW_VIEWS


def standing(task: FitTask, particle: Particle, flights: Sequence[Solution[Flight]], *, ambiguity: float) -> Standing:
    """Order ``flights`` and find rivals; one whose cost is below ``ambiguity`` times that of the first is never refused by tangency."""
    flights = sorted(flights, key=lambda s: s.equations.cost)
    reach = np.array([_outside_px(task, particle, s.state) if few_views(particle) else 0.0 for s in flights])
    cost = np.array([s.equations.cost for s in flights]) / task.weight.size
    limits = [_limit(task, particle, s.state, c) for s, c in zip(flights, cost, strict=True)]
    contained = [i for i in range(len(flights)) if reach[i] <= 0.0 and cost[i] <= max(limits[i], ambiguity * cost[0])]
    first = contained[0] if contained else 0
    limit = max(_limit(task, particle, flights[first].state, cost[first], own=True), ambiguity * cost[first])
    near = [i for i in range(len(flights)) if i != first and cost[i] <= limit and (reach[i] <= 0.0 or not contained)]
    order = [first, *(i for i in range(len(flights)) if i != first)]
    return Standing(tuple(flights[i] for i in order), tuple(flights[i] for i in near), max(float(reach[first]), 0.0))


def _limit(task: FitTask, particle: Particle, flight: Flight, cost: float, *, own: bool = False) -> float:
    """Largest mean squared error, over the expected, that is not refused: at the expected noise or, with ``own``, at that of ``cost``."""
    sides = sides_seen(task, flight)
    numbers = sides * min(2 * len(task.views.silhouettes), INDEPENDENT_TANGENTS)
    if particle.disagreement.beyond_noise:
        numbers = min(numbers, CALIBRATION_FREEDOM * len(task.views.silhouettes))
    free = numbers - (POSE if sides == 1 else MOTION)
    if free <= 0:
        return float("inf")
    noise = max(1.0, cost * numbers / free if own else 0.0)
    return float(noise * chdtri(free, 1.0 - CONFIDENCE) / numbers)


def sides_seen(task: FitTask, flight: Flight) -> int:
    """How many distinct sides of the body the sightings show under a flight; opposite sides have the same outline."""
    return len(np.unique(np.argmax(np.abs(_viewing(task, flight) @ fibonacci_sphere(SIDES).T), axis=1)))


def _viewing(task: FitTask, flight: Flight) -> Array:
    """Viewing directions (n, 3) in particle axes."""
    return np.asarray(particle_poses(flight, flown(flight, task.sightings.times_s), task.sightings).R[:, 2])


def other_side(task: FitTask, flight: Flight, reference: int) -> int | None:
    """The whole sighting that shows the body from the side furthest from that of ``reference``; ``None`` where all show the same."""
    whole = np.flatnonzero(task.sightings.silhouettes.whole)
    if len(whole) == 0 or sides_seen(task, flight) == 1:
        return None
    viewing = _viewing(task, flight)
    return int(whole[np.argmin(np.abs(viewing[whole] @ viewing[reference]))])


def _outside_px(task: FitTask, particle: Particle, flight: Flight) -> float:
    """By how much (px, median of some sightings) outlines reach further out of the hull's image than noise and views explain."""
    whole = np.flatnonzero(task.sightings.silhouettes.whole)
    rows = whole[np.unique(np.linspace(0, len(whole) - 1, COMPARED).round().astype(np.int64))] if len(whole) else whole
    if len(rows) == 0:
        return 0.0
    seen = task.sightings.take(rows)
    placed = particle_poses(flight, flown(flight, seen.times_s), seen)
    centre = particle.body.com_particle
    at = Poses(placed.R, placed.R @ centre + placed.t, np.zeros(len(rows)))
    reach = protrusion_px(seen.silhouettes, at, particle.hull.vertices - centre)
    return float(np.median(reach)) - _allowed_px(particle, task)


def _allowed_px(particle: Particle, task: FitTask) -> float:
    """How far (px of the high-speed camera) right outlines may reach out of the hull's image."""
    first = task.sightings.silhouettes
    ratio = float(np.median(hsv_spacing(particle, first)))
    views = Views(particle.seen, particle.poses, particle.body.com_particle)
    own = max(float(own_protrusion_px(views, particle.hull.vertices).max()), 0.0)
    noise = np.hypot(float(np.median(first.noise_px[first.samples > 0])), particle.disagreement.rms_px / ratio)
    return float(PROTRUSION_SIGMAS * noise + own / ratio)
