"""Whether a flight is held to a plate, and to which: the stated one, or one that the impacts themselves show.

``keep_out_of_plate`` requires that the particle does not reach into the plate; ``estimate_plate`` takes every impact for a touch and
measures the plane along with the flight, from what is stated of it or, where nothing is, from a guess: friction bends an impulse away from
the normal by ``atan mu`` at most, so the sum of the impulses' directions is the normal to :data:`FRICTION_RAD`. Where a camera sees the
plate, the nearest edge of its outline lies in the plane, to :data:`EDGE_RAD`, which leaves only the lean towards the camera to impulses.

One impact pins the plane's place along its normal, no tilt; two pin a tilt along the line between them.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from datasets.errors import InputError
from datasets.observation import Observation
from datasets.vocabulary.plate import Plate
from estimator.data.configuration import Configuration
from estimator.impacts.piecewise_fit import PiecewiseRefined
from estimator.impacts.plate_contact import PlateTask, held_by_plate, stated_spread, tangents
from estimator.impacts.plate_edge import EDGE_RAD, edge_direction
from estimator.impacts.plate_gap import HULL_SHARE, hull_in_body
from estimator.motion.piecewise import touch_and_sensitivity
from estimator.particle.particle import Particle

Array = NDArray[np.float64]
FRICTION_RAD = 0.15
"""Standard deviation of an impulse's direction about the plate's normal: friction of 0.15 on both sides. By judgement."""
UNKNOWN_M = 1.0
"""Standard deviation of the place of a plate of which nothing is known."""


@dataclass(frozen=True)
class PlateEstimate:
    """A plate's plane measured by impacts: ``point_world`` (3,) m at the first frame, ``normal_world`` (3,) unit.

    ``covariance`` (4, 4) of its place along the normal (m) and of the normal's three components.
    """

    point_world: Array
    normal_world: Array
    covariance: Array


def check_plate_settings(observation: Observation, configuration: Configuration) -> None:
    """Refuse to keep a particle out of a plate that nobody stated and that is not to be estimated."""
    if configuration.keep_out_of_plate and not configuration.estimate_plate and observation.plate is None:
        raise InputError(f"{observation.name}: expected a stated plate where keep_out_of_plate is set, got none; set estimate_plate=1.")


def plate_task(observation: Observation, particle: Particle, refined: PiecewiseRefined, configuration: Configuration) -> PlateTask | None:
    """The plate to hold the flight to; ``None`` where the configuration does not ask for it."""
    if not (configuration.keep_out_of_plate or configuration.estimate_plate):
        return None
    stated, began = observation.plate, float(observation.clock.times_s[0])
    vertices = hull_in_body(particle)
    plate, spread = (stated, stated_spread(stated)) if stated is not None else guessed_plate(observation, refined, vertices)
    return PlateTask(
        plate=plate,
        began_s=began,
        spread=spread,
        vertices=vertices,
        sigma_m=HULL_SHARE * particle.extent_m,
        kept_out=bool(configuration.keep_out_of_plate),
        touched=bool(configuration.estimate_plate),
    )


def guessed_plate(observation: Observation, refined: PiecewiseRefined, vertices: Array) -> tuple[Plate, Array]:
    """A plate through the first touch, across the impulses, and its ``spread`` (3, 3).

    ``vertices`` (v, 3) m of the hull, nominal body axes.
    """
    flight = refined.flight
    touches = [touch_and_sensitivity(flight, number)[0] for number in range(len(flight.bounces))]
    jumps = np.array([t.after[0, :3] - t.before[0, :3] for t in touches])
    normal = np.sum(jumps / np.linalg.norm(jumps, axis=1, keepdims=True), axis=0)
    normal /= np.linalg.norm(normal)
    edge = edge_direction(observation.cameras, observation.plate_outlines, touches[0].x[0])
    if edge is not None:
        normal = normal - (normal @ edge) * edge
        normal /= np.linalg.norm(normal)
    arms = (vertices - flight.first.com) @ touches[0].R[0].T
    place = touches[0].x[0] + arms[int(np.argmin(arms @ normal))]
    plate = Plate(place, normal)
    return plate, _guessed_spread(normal, edge, FRICTION_RAD / np.sqrt(len(jumps)))


def _guessed_spread(normal: Array, edge: Array | None, friction_rad: float) -> Array:
    """Turns about the edge are as loose as friction leaves them, turns of the edge out of the plane are not."""
    spread = np.diag([UNKNOWN_M, friction_rad, friction_rad])
    if edge is None:
        return spread
    along = tangents(normal) @ edge
    across = np.array([-along[1], along[0]])
    spread[1:, 1:] = np.column_stack([friction_rad * along, EDGE_RAD * across])
    return spread


def estimated_plate(task: PlateTask, refined: PiecewiseRefined) -> PlateEstimate | None:
    """The plate where the fit has it, with its covariance; ``None`` where it was not measured."""
    if not task.touched:
        return None
    held = held_by_plate(task, refined.flight, refined.sightings.times_s)
    inverse = np.linalg.inv(held.precision)
    through = inverse @ held.coupling
    covariance = inverse + through @ refined.covariance @ through.T
    off = task.spread @ held.u
    nominal = task.plate
    turned = np.cross(tangents(nominal.normal_world), nominal.normal_world)
    normal = nominal.normal_world + off[1:] @ turned
    normal /= np.linalg.norm(normal)
    shape = np.zeros((4, 3))
    shape[0, 0], shape[1:, 1:] = 1.0, turned.T
    shape = shape @ task.spread
    return PlateEstimate(nominal.point_world + off[0] * nominal.normal_world, normal, shape @ covariance @ shape.T)


def plate_told(task: PlateTask | None, refined: PiecewiseRefined, statistics: dict[str, Any]) -> tuple[tuple[str, ...], dict[str, Any]]:
    """What to say of a flight that was held to a plate, and statistics with the plate where it was measured."""
    if task is None:
        return (), statistics
    estimate = estimated_plate(task, refined)
    if estimate is None:
        return ("The particle was kept out of the stated plate.",), statistics
    return (_words(task, estimate),), {**statistics, "plate": {name: value.tolist() for name, value in vars(estimate).items()}}


def _words(task: PlateTask, estimate: PlateEstimate) -> str:
    tilts = np.degrees(np.sqrt(np.maximum(np.linalg.eigvalsh(estimate.covariance[1:, 1:])[1:], 0.0)))
    n = ", ".join(f"{x:+.3f}" for x in estimate.normal_world)
    kept = " The particle was kept out of it." if task.kept_out else ""
    return f"The plate's normal is ({n}), known to {tilts[0]:.1f}° and {tilts[1]:.1f}° about two axes.{kept}"
