"""Two particles that collide once in flight, before one camera.

Drawn are the orientations, spins and relative velocity that both would have when they meet, and how far from one another their centres'
paths would pass; the bodies are moved together along the relative velocity until they touch. From there each is flown back to the first
frame, and the first touch is looked for from the first frame on, since turning bodies may meet earlier. Then comes the collision and each
flies on. A draw is thrown away where the bodies miss one another, meet more than a few frames from where they should, touch again, or leave
the picture.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from datasets.errors import InputError
from datasets.recipes.effects import hidden_in_contact
from datasets.recipes.recipe import PairRecipe, Recipe
from datasets.truth import Impact
from datasets.vocabulary.camera import Intrinsics
from synth.contact.law import contact_law
from synth.contact.pair_collision import Two, collide_pair, first_touch_of_pair
from synth.contact.polytopes import Polytope, polytope_of, signed_gap
from synth.contact.touching import Flight
from synth.effects.links import FlyingBody
from synth.motion import Start, fly
from synth.motion.free_flight import FreeFlight
from synth.motion.piecewise_flight import Leg, PiecewiseFlight
from synth.motion.random_flight import Stage, ball_in_view, isotropic

Array = NDArray[np.float64]

DRAWS = 60
LATEST_FRAMES = 8.0
"""How many frames from where it should be a collision may lie."""
NEARER = 200
"""Steps in which bodies are moved together until they overlap."""
LEAVES = "one leaves the picture; lower pair.closing_ms, pair.drift_ms, pair.frames_before or pair.frames_after"


@dataclass(frozen=True)
class FlownPair:
    """The flights of both over the recording and the collision as each has it."""

    flights: tuple[PiecewiseFlight, PiecewiseFlight]
    impacts: tuple[Impact, Impact]


@dataclass(frozen=True)
class PairCourse:
    """What decides a pair besides what is drawn: bodies, time stamps (frame,) s, the camera, and when they are to collide (s)."""

    bodies: Two
    stamps_s: Array
    camera: Intrinsics
    impact_s: float


def pair_frames(recipe: PairRecipe, rng: np.random.Generator) -> tuple[int, int]:
    """Whole frames before and after the collision."""
    return int(rng.integers(*recipe.frames_before, endpoint=True)), int(rng.integers(*recipe.frames_after, endpoint=True))


def planned_pair(recipe: Recipe, course: PairCourse, rng: np.random.Generator) -> FlownPair:
    """Draw a pair that collides once and stays in the picture.

    Raises
    ------
    InputError
        Where none does.
    """
    shapes = (polytope_of(course.bodies[0]), polytope_of(course.bodies[1]))
    reasons: list[str] = []
    for _ in range(DRAWS):
        found = _drawn(recipe, course, shapes, rng)
        if isinstance(found, FlownPair):
            return found
        reasons.append(found)
    commonest = max(set(reasons), key=reasons.count)
    raise InputError(f"no pair of {DRAWS} can be recorded: in {reasons.count(commonest)} of them {commonest}.")


def _drawn(recipe: Recipe, course: PairCourse, shapes: tuple[Polytope, Polytope], rng: np.random.Generator) -> FlownPair | str:
    """A pair, or why a draw is none."""
    meeting = _meeting(recipe, course, shapes, rng)
    if meeting is None:
        return "the two miss one another; lower pair.impact_parameter"
    gravity, frame_s = np.array(recipe.motion.gravity_ms2), 1 / recipe.motion.frame_rate_hz
    margin, end_s = recipe.hsv.exposure_us * 1e-6, float(course.stamps_s[-1])
    before = tuple(
        fly(start, body.inertia_kgm2, gravity, earliest_s=-course.impact_s - margin, latest_s=LATEST_FRAMES * frame_s)
        for start, body in zip(meeting, course.bodies, strict=True)
    )
    early = course.stamps_s[course.stamps_s <= course.impact_s]
    if not all(_in_view(course, flight, body, early - course.impact_s) for flight, body in zip(before, course.bodies, strict=True)):
        return LEAVES
    touch = first_touch_of_pair((before[0], before[1]), shapes, from_s=-course.impact_s, to_s=LATEST_FRAMES * frame_s)
    if touch is None or abs(touch) > LATEST_FRAMES * frame_s:
        return "they meet at another time, since they turn; lower motion.spin_rads"
    states = (_state_at(before[0], touch), _state_at(before[1], touch))
    law = contact_law(recipe.contact, recipe.contact, hidden_in_contact(recipe.contact_physics))
    try:
        struck = collide_pair(course.bodies, states, law, time_s=course.impact_s + touch, gravity_world=gravity)
    except InputError as error:
        return str(error).rstrip(".")
    span = (-(struck.parting_s - course.impact_s - touch) - margin, max(end_s + margin - struck.parting_s, 1e-6))
    after = tuple(
        fly(start, body.inertia_kgm2, gravity, earliest_s=span[0], latest_s=span[1])
        for start, body in zip(struck.after, course.bodies, strict=True)
    )
    if first_touch_of_pair((after[0], after[1]), shapes, from_s=0.0, to_s=span[1]) is not None:
        return "they touch again; raise contact.restitution or pair.closing_ms, or lower pair.frames_after"
    flights = tuple(_two_legs(course, (before[k], after[k]), (course.impact_s + touch, struck.parting_s), course.bodies[k]) for k in (0, 1))
    if not all(_in_view(course, flight, body, course.stamps_s) for flight, body in zip(flights, course.bodies, strict=True)):
        return LEAVES
    return FlownPair((flights[0], flights[1]), struck.impacts)


def _meeting(recipe: Recipe, course: PairCourse, shapes: tuple[Polytope, Polytope], rng: np.random.Generator) -> tuple[Start, Start] | None:
    """States of both as they would touch if they did not turn; ``None`` where they would pass."""
    assert recipe.pair is not None
    turned = [Rotation.random(rng=rng) for _ in range(2)]
    spins = [isotropic(rng) * rng.uniform(*recipe.motion.spin_rads) for _ in range(2)]
    towards = _direction(recipe.pair, rng)
    across = np.cross(towards, isotropic(rng))
    across /= np.linalg.norm(across)
    radii = sum(float(np.linalg.norm(shape.vertices, axis=1).mean()) for shape in shapes)
    aside = across * rng.uniform(*recipe.pair.impact_parameter) * radii
    closing = rng.uniform(*recipe.pair.closing_ms) * towards
    drift = isotropic(rng) * rng.uniform(*recipe.pair.drift_ms)
    distance = _touching_distance(shapes, turned, towards, aside)
    if distance is None:
        return None
    masses = np.array([body.mass_kg for body in course.bodies])
    share = masses[1] / masses.sum()
    apart = aside + distance * towards
    camera = course.camera
    pixels = np.array([(camera.width_px - 1) / 2 - camera.cx_px, (camera.height_px - 1) / 2 - camera.cy_px, 0.0])
    centre = np.array([0.0, 0.0, recipe.hsv.distance_m]) + pixels * recipe.hsv.distance_m / camera.fx_px
    places, velocities = (centre - share * apart, centre + (1 - share) * apart), (drift + share * closing, drift - (1 - share) * closing)
    first, second = (Start(p, r.as_quat(), v, w) for p, r, v, w in zip(places, turned, velocities, spins, strict=True))
    return first, second


def _direction(recipe: PairRecipe, rng: np.random.Generator) -> Array:
    """From the first to the second, unit, at an angle to the picture."""
    tilt = np.deg2rad(rng.uniform(*recipe.out_of_plane_deg)) * rng.choice([-1.0, 1.0])
    angle = rng.uniform(0, 2 * np.pi)
    return np.array([np.cos(tilt) * np.cos(angle), np.cos(tilt) * np.sin(angle), np.sin(tilt)])


def _touching_distance(shapes: tuple[Polytope, Polytope], turned: list[Rotation], towards: Array, aside: Array) -> float | None:
    R = [r.as_matrix() for r in turned]

    def gap(distance: float) -> float:
        return float(signed_gap(shapes[0], R[0], np.zeros(3), shapes[1], R[1], aside + distance * towards)[0])

    farthest = sum(float(np.linalg.norm(shape.vertices, axis=1).max()) for shape in shapes) + 1e-6
    steps = np.linspace(farthest, 0.0, NEARER)
    for outer, inner in pairwise(steps):
        if gap(float(inner)) <= 0:
            return float(brentq(gap, inner, outer, xtol=1e-9))
    return None


def _state_at(flight: FreeFlight, time_s: float) -> Start:
    motion = flight.at(np.array([time_s]))
    return Start(motion.x_world[0], motion.q_world_body[0], motion.v_world[0], motion.omega_world[0])


def _two_legs(course: PairCourse, flights: tuple[FreeFlight, FreeFlight], when: tuple[float, float], body: FlyingBody) -> PiecewiseFlight:
    """One flight of both legs; the contact from first touch to parting, ``when``, is halved between them."""
    legs = (Leg(-np.inf, course.impact_s, flights[0], body.body), Leg(sum(when) / 2, when[1], flights[1], body.body))
    return PiecewiseFlight(legs, body.body)


def _in_view(course: PairCourse, flight: Flight, body: FlyingBody, times_s: Array) -> bool:
    radius = float(np.linalg.norm(body.vertices - body.body.com_particle, axis=1).max())
    return ball_in_view(flight.at(times_s).x_world, Stage(course.camera, 0.0, radius, times_s))
