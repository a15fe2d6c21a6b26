"""The flight of one sequence: drawn at random, flown with whatever effects are in force, and kept if it stays in the picture.

Flights are drawn as if no effect were in force, so that a sequence with an effect starts as the one without it. Where an effect carries the
particle out of the true camera's picture, another start is drawn.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from datasets.errors import InputError
from datasets.recipes.recipe import Recipe
from datasets.vocabulary.camera import Intrinsics
from synth.effects import EffectsInForce, FlyingBody
from synth.further_cameras import Filming
from synth.motion import Start, fly, fly_pushed, random_start
from synth.motion.random_flight import Stage, ball_in_view
from synth.plan import Flight

Array = NDArray[np.float64]

STARTS = 100


@dataclass(frozen=True)
class Course:
    """What decides a flight besides its start: stated and true times (frame,) s and cameras, the nominal body and the one that flies.

    ``further``: other cameras that film it.
    """

    stamps_s: Array
    true_times_s: Array
    stated_camera: Intrinsics
    true_camera: Intrinsics
    nominal: FlyingBody
    flying: FlyingBody
    effects: EffectsInForce
    further: tuple[Filming, ...] = ()

    @property
    def all_times_s(self) -> Array:
        """True times (n,) s of the frames of all cameras."""
        return np.concatenate([self.true_times_s, *(each.true_times_s for each in self.further)])


def planned_flight(recipe: Recipe, course: Course, rng: np.random.Generator) -> Flight:
    """Draw a flight that stays in the picture.

    Raises
    ------
    InputError
        Where none does.
    """
    stage = Stage(course.stated_camera, recipe.hsv.distance_m, _radius(course.nominal), course.stamps_s)
    for _ in range(STARTS):
        flight = _flown(recipe, course, random_start(recipe.motion, stage, rng))
        if not (course.effects.values or course.further) or _in_view(course, flight):
            return flight
    names = ", ".join(course.effects.values) or "none"
    where = "the picture" if not course.further else f"the pictures of all {1 + len(course.further)} cameras"
    raise InputError(
        f"no flight of {STARTS} stays in {where} with the effects {names}; expected weaker effects, fewer frames or slower flights."
    )


def _flown(recipe: Recipe, course: Course, start: Start) -> Flight:
    gravity = np.array(recipe.motion.gravity_ms2)
    times, margin = course.all_times_s, _longest_exposure_s(recipe, course) + _longest_delay_s(course)
    earliest, latest = min(times.min(), 0.0) - margin, times.max() + margin
    if course.effects.push:
        return fly_pushed(start, course.flying, gravity, course.effects, span_s=(earliest, latest))
    return fly(start, course.flying.inertia_kgm2, gravity, earliest_s=earliest, latest_s=latest)


def _longest_exposure_s(recipe: Recipe, course: Course) -> float:
    return max(recipe.hsv.exposure_us * 1e-6, *(each.clock.exposure_s for each in course.further), 0.0)


def _longest_delay_s(course: Course) -> float:
    """How far rows may be exposed from their frame's time, those of a picture's height beyond the picture included."""
    seen = ((course.true_camera, course.effects), *((each.true_camera, each.effects) for each in course.further))
    delays = (effects.row_delays_s(np.array([-1.0, 2.0]) * camera.height_px, camera) for camera, effects in seen)
    return max(float(np.abs(each).max()) for each in delays)


def _in_view(course: Course, flight: Flight) -> bool:
    radius = _radius(course.flying)
    return ball_in_view(flight.at(course.true_times_s).x_world, Stage(course.true_camera, 0.0, radius, course.stamps_s)) and all(
        _in_view_of(each, flight, radius) for each in course.further
    )


def _in_view_of(filming: Filming, flight: Flight, radius_m: float) -> bool:
    there = flight.at(filming.true_times_s).x_world @ filming.hsv.R_cam_world.T + filming.hsv.t_cam_world
    before = bool(np.all(there[:, 2] > 2.0 * radius_m))
    return before and ball_in_view(there, Stage(filming.true_camera, 0.0, radius_m, filming.clock.times_s))


def _radius(body: FlyingBody) -> float:
    return float(np.linalg.norm(body.vertices - body.body.com_particle, axis=1).max())
