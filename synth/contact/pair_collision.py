"""One collision of two rigid bodies in flight: from first touch until nothing touches any more.

The bodies are taken by their convex hulls (:mod:`synth.contact.polytopes`); every pair of features that may come together follows the law
of :mod:`synth.contact.law`, all at once (:mod:`synth.contact.pair_integration`). The step is chosen as in
:mod:`synth.contact.collision`. A corner's radius is that of the contact, whatever it meets.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from datasets.errors import InputError
from datasets.truth import Impact
from synth.contact import pair_integration as at
from synth.contact.collision import CREEP, LONGEST_S, RELAXATION, SLOWEST_MS, STEPS_PER_CONTACT, kinetic_energy
from synth.contact.law import ContactLaw
from synth.contact.polytopes import Polytope, polytope_of, signed_gap
from synth.contact.touching import Flight
from synth.effects.links import FlyingBody
from synth.motion.free_flight import Start

Array = NDArray[np.float64]
Two = tuple[FlyingBody, FlyingBody]
States = tuple[Start, Start]

SAMPLE_S = 5e-5
"""A touch that is over within such a time, deeper nowhere than ``w² r / 8 dt²`` (3 µm at 1000 rad/s), may be missed."""
LEAD_STEPS = 3.0
"""Before first touch, so that the contact begins within the integration."""
MARGIN_STEPS = 8.0
PART = 400
"""Steps after which the features near each other are looked for anew."""
REACH = 4.0
"""How much farther than both bodies can come in a part features are looked for."""


@dataclass(frozen=True)
class PairCollision:
    """The ``impacts`` as each body has them, and their states ``after`` (world frame) at ``parting_s``."""

    impacts: tuple[Impact, Impact]
    after: States
    parting_s: float


@dataclass(frozen=True)
class _Scale:
    """Length of a step (s), creep (m/s), the fastest that two points come together (m/s)."""

    step_s: float
    creep_ms: float
    speed_ms: float


def first_touch_of_pair(
    flights: tuple[Flight, Flight], polytopes: tuple[Polytope, Polytope], *, from_s: float, to_s: float
) -> float | None:
    """The first time (s) at which two flying bodies touch; ``None`` where they do not, ``from_s`` where they already do."""
    reach = sum(float(np.linalg.norm(p.vertices, axis=1).max()) for p in polytopes)
    times = np.append(np.arange(from_s, to_s, SAMPLE_S), to_s)
    motions = [flight.at(times) for flight in flights]
    near = np.linalg.norm(motions[0].x_world - motions[1].x_world, axis=1) <= reach
    before = from_s
    for time_s in times[near]:
        if gap_at(flights, polytopes, float(time_s)) <= 0:
            if time_s == from_s or gap_at(flights, polytopes, before) <= 0:
                return from_s
            return float(brentq(lambda t: gap_at(flights, polytopes, float(t)), before, time_s, xtol=1e-16))
        before = float(time_s)
    return None


def gap_at(flights: tuple[Flight, Flight], polytopes: tuple[Polytope, Polytope], time_s: float) -> float:
    """The signed gap (m) of two flying bodies."""
    motions = [flight.at(np.array([time_s])) for flight in flights]
    poses = [(Rotation.from_quat(m.q_world_body[0]).as_matrix(), m.x_world[0]) for m in motions]
    return float(signed_gap(polytopes[0], *poses[0], polytopes[1], *poses[1])[0])


def collide_pair(
    bodies: Two,
    touch: States,
    law: ContactLaw,
    *,
    time_s: float,
    gravity_world: Float[NDArray[np.float64], "3"],
    finer: float = 1.0,
) -> PairCollision:
    """Let two bodies, which touch in the states ``touch`` (world frame) at ``time_s``, collide; steps are ``finer`` times as fine.

    Raises
    ------
    InputError
        Where they do not approach one another at the point of touch, or do not part within a millisecond.
    """
    shapes = (polytope_of(bodies[0]), polytope_of(bodies[1]))
    scale = _scale(bodies, shapes, touch, law, finer)
    state = _packed(bodies, touch, LEAD_STEPS * scale.step_s)
    fixed = np.array([*(b.mass_kg for b in bodies), *bodies[0].inertia_kgm2, *bodies[1].inertia_kgm2, *gravity_world])
    passage = _passed(state, shapes, (_constants(bodies, law, scale.creep_ms), fixed), scale)
    duration = passage.duration_s - LEAD_STEPS * scale.step_s
    after = _unpacked(bodies, passage.state)
    return PairCollision(_impacts(bodies, touch, after, passage, (time_s, duration)), after, time_s + duration)


def _packed(bodies: Two, touch: States, lead_s: float) -> Array:
    """The state of the integration, ``lead_s`` before first touch."""
    state = np.zeros(at.SIZE)
    for part, body, start in zip((state[: at.BODY], state[at.BODY : 2 * at.BODY]), bodies, touch, strict=True):
        touching = Rotation.from_quat(start.q_world_body)
        turned = Rotation.from_rotvec(-lead_s * start.omega_world) * touching
        part[at.X : at.X + 3] = start.x_world - lead_s * start.v_world
        part[at.Q : at.Q + 4] = turned.as_quat()
        part[at.V : at.V + 3] = start.v_world
        part[at.L : at.L + 3] = touching.apply(body.inertia_kgm2 * touching.inv().apply(start.omega_world))
    return state


def _unpacked(bodies: Two, state: Array) -> States:
    found = []
    for part, body in zip((state[: at.BODY], state[at.BODY : 2 * at.BODY]), bodies, strict=True):
        turned = Rotation.from_quat(part[at.Q : at.Q + 4])
        omega = turned.apply(turned.inv().apply(part[at.L : at.L + 3]) / body.inertia_kgm2)
        found.append(Start(part[at.X : at.X + 3].copy(), turned.as_quat(), part[at.V : at.V + 3].copy(), omega))
    return found[0], found[1]


def _constants(bodies: Two, law: ContactLaw, creep_ms: float) -> Array:
    """Constants in the order of :mod:`synth.contact.integration`; those of one body and of a plate are not used."""
    mass = bodies[0].mass_kg * bodies[1].mass_kg / (bodies[0].mass_kg + bodies[1].mass_kg)
    surface = [law.stiffness, law.tangential_stiffness, law.friction, law.restitution**2, 0.5 * mass * law.yield_speed**2]
    return np.array([mass, *np.zeros(6), *surface, law.pull_off_n, law.reach_m, creep_ms, 0.0])


def _touching(shapes: tuple[Polytope, Polytope], states: States) -> tuple[Array, Array]:
    """Point and normal (into the first body) of the nearest features."""
    poses = [(Rotation.from_quat(s.q_world_body).as_matrix(), s.x_world) for s in states]
    _, kind, first, second = signed_gap(shapes[0], *poses[0], shapes[1], *poses[1])
    point, axes, _, sign = at.contact_axes(np.array([kind, first, second]), shapes[0], *poses[0], shapes[1], *poses[1])
    return point, sign * axes[2]


def _scale(bodies: Two, shapes: tuple[Polytope, Polytope], touch: States, law: ContactLaw, finer: float) -> _Scale:
    """Hertz's time of contact [Johnson 1985, eq. 11.24] at first touch, and what follows from it."""
    point, normal = _touching(shapes, touch)
    inverse, slippery, u = 0.0, 0.0, np.zeros(3)
    for body, start, sign in zip(bodies, touch, (1.0, -1.0), strict=True):
        R, arm = Rotation.from_quat(start.q_world_body).as_matrix(), point - start.x_world
        across = R.T @ np.cross(arm, normal)
        inverse += 1 / body.mass_kg + float(across @ (across / body.inertia_kgm2))
        slippery += 1 / body.mass_kg + float(arm @ arm) / float(body.inertia_kgm2.min())
        u += sign * (start.v_world + np.cross(start.omega_world, arm))
    if u @ normal >= 0:
        raise InputError("two particles that touch but do not approach one another; expected a collision.")
    speed, approach = max(float(np.linalg.norm(u)), SLOWEST_MS), max(abs(float(u @ normal)), SLOWEST_MS)
    overlap = (1.25 * approach**2 / inverse / law.stiffness) ** 0.4
    step = 2.9432752 * overlap / approach / STEPS_PER_CONTACT * max(law.restitution, 0.2)
    if law.friction > 0 and law.tangential_stiffness == 0:
        step = min(step, RELAXATION * CREEP * speed / (law.friction * law.stiffness * overlap**1.5 * slippery))
    return _Scale(step / finer, CREEP * speed, speed)


def _near(state: Array, shapes: tuple[Polytope, Polytope], reach: float) -> NDArray[np.int64]:
    """Keys (n, 3) of the pairs of features nearer to one another than ``reach`` (m)."""
    R = [Rotation.from_quat(state[at.BODY * k + at.Q : at.BODY * k + at.Q + 4]).as_matrix() for k in (0, 1)]
    x = [state[at.BODY * k : at.BODY * k + 3] for k in (0, 1)]
    keys: list[tuple[int, int, int]] = []
    for kind, (own, other) in enumerate(((0, 1), (1, 0))):
        places = (shapes[own].vertices @ R[own].T + x[own] - x[other]) @ R[other]
        heights = places @ shapes[other].normals.T - shapes[other].offsets
        for corner in np.flatnonzero(heights.max(axis=1) < reach):
            keys += [
                (kind, int(corner), int(f)) if own == 0 else (kind, int(f), int(corner)) for f in np.flatnonzero(heights[corner] > -reach)
            ]
    keys += _near_edges(shapes, (R[0], R[1]), (x[0], x[1]), reach)
    return np.array(sorted(keys), dtype=np.int64).reshape(-1, 3)


def _near_edges(
    shapes: tuple[Polytope, Polytope], R: tuple[Array, Array], x: tuple[Array, Array], reach: float
) -> list[tuple[int, int, int]]:
    """Pairs of edges that a common normal may separate, nearer than ``reach``; both within ``reach`` of the other body."""
    ends = [(shape.vertices @ turn.T + place)[shape.ends] for shape, turn, place in zip(shapes, R, x, strict=True)]
    sides = [shape.sides @ turn.T for shape, turn in zip(shapes, R, strict=True)]
    near = []
    for own, other in ((0, 1), (1, 0)):
        heights = (ends[own] - x[other]) @ R[other] @ shapes[other].normals.T - shapes[other].offsets
        near.append(np.flatnonzero(np.minimum(heights[:, 0], heights[:, 1]).max(axis=1) < reach))
    i, j = (grid.ravel() for grid in np.meshgrid(*near, indexing="ij"))
    da, db = ends[0][i, 1] - ends[0][i, 0], ends[1][j, 1] - ends[1][j, 0]
    n = np.cross(da, db)
    size = np.linalg.norm(n, axis=1)
    sound = size > 1e-9 * np.linalg.norm(da, axis=1) * np.linalg.norm(db, axis=1)
    n = n / np.maximum(size, 1e-300)[:, None]
    n *= np.where(np.einsum("ki,ksi->k", n, sides[1][j]) < 0, -1.0, 1.0)[:, None]
    gap = np.einsum("ki,ki->k", n, ends[0][i, 0] - ends[1][j, 0])
    separating = _in_arc(n, sides[1][j]) & _in_arc(-n, sides[0][i])
    kept = np.flatnonzero(sound & separating & (np.abs(gap) < reach))
    return [(2, int(i[k]), int(j[k])) for k in kept]


def _in_arc(n: Array, sides: Array) -> NDArray[np.bool_]:
    """Whether unit vectors (k, 3), normal to edges, lie between the normals (k, 2, 3) of the faces on either side, or nearly so."""
    middle = sides.sum(axis=1)
    middle /= np.linalg.norm(middle, axis=1, keepdims=True)
    widest = np.einsum("ki,ki->k", middle, sides[:, 0])
    return np.asarray(np.einsum("ki,ki->k", middle, n) > widest - ARC_SLACK)


ARC_SLACK = 1e-3


@dataclass(frozen=True)
class _Passage:
    """The state at parting; contacts (n, :) that touched, in the columns of the integration; least work; largest overlap."""

    state: Array
    contacts: Array
    duration_s: float
    least_work_J: float
    deepest_m: float


def _passed(start: Array, shapes: tuple[Polytope, Polytope], constants: tuple[Array, Array], scale: _Scale) -> _Passage:
    """Integrate from before first touch to parting."""
    state, known = start.copy(), dict[tuple[int, ...], tuple[Array, float, bool]]()
    duration, least, largest, parted = 0.0, 0.0, 0.0, False
    while not parted:
        if duration > LONGEST_S:
            raise InputError(f"the particles stay together for {1e3 * duration:.1f} ms; expected two that part.")
        keys = _near(state, shapes, REACH * scale.speed_ms * PART * scale.step_s)
        held = [key for key, value in known.items() if value[1] > 0]
        keys = np.array(sorted({*map(tuple, keys.tolist()), *held}), dtype=np.int64).reshape(-1, 3)
        rows = [known.get(tuple(key), (np.zeros(at.WIDTH), 0.0, False)) for key in keys.tolist()]
        contacts, deepest = np.array([r[0] for r in rows]).reshape(-1, at.WIDTH), np.array([r[1] for r in rows])
        armed = np.array([r[2] for r in rows], dtype=np.bool_)
        margin = MARGIN_STEPS * scale.speed_ms * scale.step_s
        steps, parted, low, deep = at.advance(state, contacts, keys, deepest, armed, shapes, constants, scale.step_s, margin, PART)
        known |= {tuple(k): (contacts[n], float(deepest[n]), bool(armed[n])) for n, k in enumerate(keys.tolist())}
        duration, least, largest = duration + steps * scale.step_s, min(least, low), max(largest, deep)
    touched = [value[0] for value in known.values() if value[0][at.NORMAL_IMPULSE] > 0]
    return _Passage(state, np.array(touched), duration, least, largest)


def _impacts(bodies: Two, touch: States, after: States, passage: _Passage, when: tuple[float, float]) -> tuple[Impact, Impact]:
    """What happened, as the first and as the second body has it."""
    contacts = passage.contacts
    weights = contacts[:, at.NORMAL_IMPULSE]
    points = contacts[:, at.POINT : at.POINT + 3] / weights[:, None]
    impulses = contacts[:, at.IMPULSE : at.IMPULSE + 3]
    point = weights @ points / weights.sum()
    normal = _touching((polytope_of(bodies[0]), polytope_of(bodies[1])), touch)[1]
    first = Impact(
        time_s=when[0],
        duration_s=when[1],
        x_world=touch[0].x_world,
        q_world_body=touch[0].q_world_body,
        point_world=point,
        points_world=points,
        impulses_world=impulses,
        normal_world=normal,
        plate_velocity_world=_velocity_at(touch[1], point),
        v_before=touch[0].v_world,
        omega_before=touch[0].omega_world,
        v_after=after[0].v_world,
        omega_after=after[0].omega_world,
        impulse_world=impulses.sum(axis=0),
        compression_work_J=passage.least_work_J,
        normal_work_J=float(passage.state[at.NORMAL_WORK]),
        tangential_work_J=float(passage.state[at.TANGENTIAL_WORK]),
        energy_lost_J=kinetic_energy(bodies[0], touch[0]) - kinetic_energy(bodies[0], after[0]),
        deepest_m=passage.deepest_m,
    )
    second = replace(
        first,
        x_world=touch[1].x_world,
        q_world_body=touch[1].q_world_body,
        impulses_world=-impulses,
        normal_world=-normal,
        plate_velocity_world=_velocity_at(touch[0], point),
        v_before=touch[1].v_world,
        omega_before=touch[1].omega_world,
        v_after=after[1].v_world,
        omega_after=after[1].omega_world,
        impulse_world=-first.impulse_world,
        energy_lost_J=kinetic_energy(bodies[1], touch[1]) - kinetic_energy(bodies[1], after[1]),
    )
    return first, second


def _velocity_at(state: Start, point: Array) -> Array:
    return np.asarray(state.v_world + np.cross(state.omega_world, point - state.x_world))
