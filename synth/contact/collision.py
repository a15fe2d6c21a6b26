"""One collision of a rigid body with a plate: from first touch until no corner touches any more.

The body's own vertices near the plane are its possible corners; each follows the law of :mod:`synth.contact.law`, all at once
(:mod:`synth.contact.integration`). The step is a small part of Hertz's time of contact, and short against the relaxation of rigid friction.
"""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from datasets.errors import InputError
from datasets.truth import Impact
from datasets.vocabulary.plate import Plate
from synth.contact import integration as at
from synth.contact.law import ContactLaw
from synth.contact.touching import places_of
from synth.effects.links import FlyingBody
from synth.motion.free_flight import Start

Array = NDArray[np.float64]

STEPS_PER_CONTACT = 2000
"""Of Hertz's time: energy is kept to about 1e-8 where nothing is lost."""
RELAXATION = 0.7
"""Steps of rigid friction's relaxation, at most; Runge and Kutta's method is stable up to 2.78."""
CREEP = 5e-4
"""Speed at which rigid friction holds a corner, over the speed of the impact."""
SLOWEST_MS = 1e-3
PART = 0.25
"""Of Hertz's time, after which the corners near the plate are looked for anew."""
LONGEST_S = 1e-3


@dataclass(frozen=True)
class Collision:
    """What happened, and the state ``after`` (world frame) at ``parting_s``."""

    impact: Impact
    after: Start
    parting_s: float


@dataclass(frozen=True)
class _Scale:
    """Length of a step and of a part (steps), creep (m/s)."""

    step_s: float
    part: int
    creep_ms: float


def collide(
    body: FlyingBody,
    touch: Start,
    plate: Plate,
    law: ContactLaw,
    *,
    time_s: float,
    gravity_world: Float[NDArray[np.float64], "3"],
    finer: float = 1.0,
) -> Collision:
    """Let ``body``, which touches ``plate`` in the state ``touch`` (world frame) at ``time_s``, collide; steps are ``finer`` times as fine.

    Raises
    ------
    InputError
        Where it does not part from the plate within a millisecond.
    """
    to_plate, origin = _plate_axes(plate.normal_world), plate.point_world + plate.velocity_world * time_s
    places, state = places_of(body), _state(body, touch, to_plate, origin, plate.velocity_world)
    scale = _scale(body, state, places, law, finer)
    passage = _passed(state, places, _constants(body, law, to_plate @ gravity_world, scale.creep_ms), scale)
    after = _world(body, passage.state, to_plate, origin + plate.velocity_world * passage.duration_s, plate.velocity_world)
    impulses = passage.impulses @ to_plate
    points = touch.x_world + Rotation.from_quat(touch.q_world_body).apply(places)
    touched = np.flatnonzero(np.linalg.norm(impulses, axis=1) > 0)
    if len(touched) == 0:
        touched = np.array([np.argmin(points @ plate.normal_world)])
    impact = Impact(
        time_s=time_s,
        duration_s=passage.duration_s,
        x_world=touch.x_world,
        q_world_body=touch.q_world_body,
        point_world=_mean(points[touched], np.abs(impulses[touched] @ plate.normal_world)),
        points_world=points[touched],
        impulses_world=impulses[touched],
        normal_world=plate.normal_world,
        plate_velocity_world=plate.velocity_world,
        v_before=touch.v_world,
        omega_before=touch.omega_world,
        v_after=after.v_world,
        omega_after=after.omega_world,
        impulse_world=impulses.sum(axis=0),
        compression_work_J=passage.least_work_J,
        normal_work_J=float(passage.state[at.NORMAL_WORK]),
        tangential_work_J=float(passage.state[at.TANGENTIAL_WORK]),
        energy_lost_J=kinetic_energy(body, touch) - kinetic_energy(body, after),
        deepest_m=passage.deepest_m,
    )
    return Collision(impact, after, time_s + passage.duration_s)


def kinetic_energy(body: FlyingBody, state: Start) -> float:
    """Kinetic energy (J)."""
    w = Rotation.from_quat(state.q_world_body).inv().apply(state.omega_world)
    return 0.5 * float(body.mass_kg * state.v_world @ state.v_world + body.inertia_kgm2 @ w**2)


def _plate_axes(normal: Array) -> Array:
    """Rows: two directions along the plate and its normal; maps world to plate directions."""
    along = np.eye(3)[np.argmin(np.abs(normal))]
    first = np.cross(along, normal)
    first /= np.linalg.norm(first)
    return np.array([first, np.cross(normal, first), normal])


def _state(body: FlyingBody, touch: Start, to_plate: Array, origin: Array, plate_velocity: Array) -> Array:
    turned = Rotation.from_matrix(to_plate) * Rotation.from_quat(touch.q_world_body)
    state = np.zeros(at.SIZE)
    state[at.X : at.X + 3] = to_plate @ (touch.x_world - origin)
    state[at.Q : at.Q + 4] = turned.as_quat()
    state[at.V : at.V + 3] = to_plate @ (touch.v_world - plate_velocity)
    state[at.L : at.L + 3] = turned.apply(body.inertia_kgm2 * turned.inv().apply(to_plate @ touch.omega_world))
    return state


def _world(body: FlyingBody, state: Array, to_plate: Array, origin: Array, plate_velocity: Array) -> Start:
    turned = Rotation.from_quat(state[at.Q : at.Q + 4])
    omega = turned.apply(turned.inv().apply(state[at.L : at.L + 3]) / body.inertia_kgm2)
    return Start(
        x_world=to_plate.T @ state[at.X : at.X + 3] + origin,
        q_world_body=(Rotation.from_matrix(to_plate.T) * turned).as_quat(),
        v_world=to_plate.T @ state[at.V : at.V + 3] + plate_velocity,
        omega_world=to_plate.T @ omega,
    )


def _constants(body: FlyingBody, law: ContactLaw, gravity: Array, creep_ms: float) -> Array:
    work = 0.5 * body.mass_kg * law.yield_speed**2
    surface = [law.stiffness, law.tangential_stiffness, law.friction, law.restitution**2, work, law.pull_off_n, law.reach_m, creep_ms]
    return np.array([body.mass_kg, *body.inertia_kgm2, *gravity, *surface, law.inverse_plate_mass])


def _scale(body: FlyingBody, state: Array, places: Array, law: ContactLaw, finer: float) -> _Scale:
    """Hertz's time of contact [Johnson 1985, eq. 11.24] of the lowest corner, and what follows from it."""
    turned = Rotation.from_quat(state[at.Q : at.Q + 4])
    arms = turned.apply(places)
    arm = arms[np.argmin(arms[:, 2])]
    inverse_inertia = turned.as_matrix() @ np.diag(1 / body.inertia_kgm2) @ turned.as_matrix().T
    across = np.cross(arm, [0.0, 0.0, 1.0])
    inverse_mass = 1 / body.mass_kg + float(across @ inverse_inertia @ across) + law.inverse_plate_mass
    u = state[at.V : at.V + 3] + np.cross(inverse_inertia @ state[at.L : at.L + 3], arm)
    speed, approach = max(float(np.linalg.norm(u)), SLOWEST_MS), max(abs(float(u[2])), SLOWEST_MS)
    overlap = (1.25 * approach**2 / inverse_mass / law.stiffness) ** 0.4
    contact_s = 2.9432752 * overlap / approach
    step = contact_s / STEPS_PER_CONTACT * max(law.restitution, 0.2)
    if law.friction > 0 and law.tangential_stiffness == 0:
        slippery = 1 / body.mass_kg + float(arm @ arm) / float(body.inertia_kgm2.min())
        rate = law.friction * law.stiffness * overlap**1.5 * slippery / (CREEP * speed)
        step = min(step, RELAXATION / rate)
    step /= finer
    return _Scale(step, max(at.FEWEST + 1, math.ceil(PART * contact_s / step)), CREEP * speed)


def _near(state: Array, places: Array, constants: Array, scale: _Scale) -> NDArray[np.bool_]:
    """Which vertices may come to the plate within the next part."""
    turned = Rotation.from_quat(state[at.Q : at.Q + 4])
    arms = turned.apply(places)
    omega = turned.inv().apply(state[at.L : at.L + 3]) / constants[at.MOMENTS : at.MOMENTS + 3]
    speed = float(np.linalg.norm(state[at.V : at.V + 3])) + float(np.linalg.norm(omega)) * float(np.linalg.norm(arms, axis=1).max())
    return np.asarray(state[at.X + 2] + arms[:, 2] - state[at.RECOIL] < 4 * speed * scale.part * scale.step_s)


def _mean(points: Array, weights: Array) -> Array:
    return np.asarray(weights @ points / weights.sum() if weights.sum() > 0 else points.mean(axis=0))


@dataclass(frozen=True)
class _Passage:
    """The state at parting, plate axes; impulses (v, 3) N s on each vertex; the least work of normal forces; the largest overlap."""

    state: Array
    impulses: Array
    duration_s: float
    least_work_J: float
    deepest_m: float


def _passed(start: Array, places: Array, constants: Array, scale: _Scale) -> _Passage:
    """Integrate from the state of first touch to parting."""
    state, corners, deepest = start.copy(), np.zeros((len(places), 5)), np.zeros(len(places))
    duration, least, largest, parted = 0.0, 0.0, 0.0, False
    while not parted:
        if duration > LONGEST_S:
            raise InputError(f"the particle stays on the plate for {1e3 * duration:.1f} ms; expected one that leaves it.")
        near = _near(state, places, constants, scale) | (deepest > 0)
        some, some_deepest = corners[near], deepest[near]
        steps, parted, low, deep = at.advance(state, some, places[near], some_deepest, constants, scale.step_s, scale.part)
        corners[near], deepest[near] = some, some_deepest
        duration, least, largest = duration + steps * scale.step_s, min(least, low), max(largest, deep)
    return _Passage(state, corners[:, at.IMPULSE :], duration, least, largest)
