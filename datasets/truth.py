"""What really happened in a sequence. Closed to the estimator."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from datasets.observation import Frames
from datasets.vocabulary.body import Body
from datasets.vocabulary.plate import Plate
from datasets.vocabulary.state import Motion

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Impact:
    """One contact with the plate, or with another particle, from first touch to parting; world frame, at the centre of mass.

    The body is the one that flies at the time: after it broke, what is left, about its own centre and axes.

    ``time_s``, ``x_world``, ``q_world_body``: the first touch. ``point_world`` (3,) m: where the normal force acted, averaged over
    the impulse; ``points_world`` (p, 3) and ``impulses_world`` (p, 3) N s: each corner that touched. ``normal_world``,
    ``plate_velocity_world``: the plate's. ``before`` at the first touch, ``after`` at parting. ``impulse_world`` (3,) N s is that of the
    contact, gravity not counted. Work (J) is that of the contact's forces along the velocity relative to the plate:
    ``compression_work_J`` (negative) that of the normal forces at its least, ``normal_work_J`` and ``tangential_work_J`` at parting.
    ``energy_lost_J``: of the kinetic energy, against a plate at rest what the works took less what gravity gave. ``deepest_m``: the
    largest overlap of body and undeformed plate.

    Of a collision each particle has its own: ``normal_world`` points into it, ``plate_velocity_world`` is that of the other one at
    ``point_world`` at first touch, the works are those of the pair's forces, the energy its own.
    """

    time_s: float
    duration_s: float
    x_world: Array
    q_world_body: Array
    point_world: Array
    points_world: Array
    impulses_world: Array
    normal_world: Array
    plate_velocity_world: Array
    v_before: Array
    omega_before: Array
    v_after: Array
    omega_after: Array
    impulse_world: Array
    compression_work_J: float
    normal_work_J: float
    tangential_work_J: float
    energy_lost_J: float
    deepest_m: float

    @property
    def restitution(self) -> float:
        """Stronge's coefficient: the root of the share of the compression's work that the normal forces gave back."""
        return float(np.sqrt(max(0.0, 1 - self.normal_work_J / self.compression_work_J)))


AT_ONCE_FRAMES = 1.0
"""Contacts that follow one another in fewer frames are one impact to whoever sees pictures."""


def at_once(impacts: list[Impact], apart_s: float) -> list[list[Impact]]:
    """Contacts in order of time, those that follow one another in less than ``apart_s`` together."""
    events: list[list[Impact]] = []
    for impact in impacts:
        if events and impact.time_s - events[-1][-1].time_s < apart_s:
            events[-1].append(impact)
        else:
            events.append([impact])
    return events


@dataclass(frozen=True)
class Remnant:
    """What is left of a particle from ``time_s`` on, where it broke: (v, 3) m in the particle frame, the faces (f, 3) those of the truth.

    ``body``, ``mass_kg``, ``inertia_kgm2`` are its own; the motion of the truth goes on with the frame of the whole body.
    """

    time_s: float
    mesh_vertices: Array
    body: Body
    mass_kg: float
    inertia_kgm2: Array


@dataclass(frozen=True)
class MotionBound:
    """The Cramér-Rao bound of a flight: what nobody can be more accurate than without a bias, however good the instrument.

    ``covariance`` (6, 6) of linear velocity (m/s) and angular velocity (rad/s), world frame, at ``time_s``, the frame in the middle, for
    whoever knows the body, the camera, the times and gravity, from all samples of all outlines with their stated noise.
    """

    time_s: float
    covariance: Array


@dataclass(frozen=True)
class Truth:
    """Poses and velocities at the frame times, the body, its mesh, and the effects in force.

    ``mesh_vertices`` (v, 3) m in the particle frame, ``mesh_faces`` (f, 3). ``inertia_kgm2`` principal moments (3,).
    ``symmetries`` (s, 3, 3): rotations in the particle frame, about the centre of mass, that map the body on to itself
    (identity included). ``masks``: path-backed silhouettes of the rendered tier, or ``None``. ``plate``: the true plate; ``impacts``: every
    contact with it, in order; ``remnant``: the particle after it broke. ``companion``: the same of a second particle in the pictures, with
    which the first collides; then ``impacts`` are their collisions. ``bound``: of free flights in outlines of a stated noise.
    """

    name: str
    motion: Motion
    body: Body
    mass_kg: float
    inertia_kgm2: Array
    mesh_vertices: Array
    mesh_faces: NDArray[np.int64]
    symmetries: Array = field(default_factory=lambda: np.eye(3)[None])
    descriptors: dict[str, float] = field(default_factory=dict)
    effects: dict[str, Any] = field(default_factory=dict)
    notes: dict[str, Any] = field(default_factory=dict)
    masks: Frames | None = None
    plate: Plate | None = None
    impacts: tuple[Impact, ...] = ()
    remnant: Remnant | None = None
    companion: "Truth | None" = None
    bound: MotionBound | None = None
