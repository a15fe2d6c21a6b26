"""The flight of one particle as a function of its parameters: what the trajectory fit varies, and the poses that follow.

Parameters, about a reference state at a reference time, all in SI units and world axes unless said otherwise:

========  ==  ==============================================================================================
x          3  position of the centre of mass (m)
theta      3  rotation of the body about its centre of mass (rad)
v          3  velocity (m/s)
omega      3  angular velocity (rad/s)
com        3  shift of the centre of mass in the nominal body frame (m)
inertia    5  E in J = √D (1 + E) √D, D the nominal inertia ratios: E11, E22, E12, E13, E23 (E33 fixes the scale)
offset     1  outline offset of the HSV silhouettes (px), outwards
========  ==  ==============================================================================================

The hull over-estimates the volume, so centre of mass and inertia come with a bias; in force-free flight a shifted centre makes
the nominal one wobble, and wrong inertia ratios bend the spin's path. Hence both are fitted, held by a prior.
"""

from dataclasses import dataclass, replace
from typing import Protocol, Self

import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.body import Body, signed_axes
from datasets.vocabulary.effects import Scope
from estimator.motion.blocks import Block, Layout, State
from estimator.motion.rigid_body import (
    Rate,
    States,
    angular_momentum,
    angular_velocity,
    fall,
    inverted,
    propagate,
    quaternion_product,
    rotation_matrices,
)
from estimator.motion.rotation import quaternion_from_vector, rotation_vector
from estimator.motion.round_bodies import is_round, round_fall, round_flight

Array = NDArray[np.float64]

LAYOUT = Layout(
    (
        Block("x", ("x_m", "y_m", "z_m"), 1e-6),
        Block("theta", ("theta_x_rad", "theta_y_rad", "theta_z_rad"), 1e-5),
        Block("v", ("v_x_ms", "v_y_ms", "v_z_ms"), 1e-4),
        Block("omega", ("omega_x_rads", "omega_y_rads", "omega_z_rads"), 1e-3),
        Block("com", ("com_1_m", "com_2_m", "com_3_m"), 1e-6, scope=Scope.PARTICLE),
        Block("inertia", ("inertia_11", "inertia_22", "inertia_12", "inertia_13", "inertia_23"), 1e-4, scope=Scope.PARTICLE),
        Block("offset", ("outline_offset_px",), scope=Scope.CAMERA),
    )
)
"""Of a flight. Steps: truncation below 1e-8 and rounding below 1e-9 of each column."""
X, THETA, V, OMEGA, COM, INERTIA, OFFSET = LAYOUT.places.values()
N_PARAMETERS, NAMES, STEPS = LAYOUT.size, LAYOUT.labels, LAYOUT.steps
SYMMETRIC = ((0, 0), (1, 1), (0, 1), (0, 2), (1, 2))
"""Entries of the inertia matrix that are parameters: traceless diagonal, then products; the third moment follows."""


@dataclass(frozen=True)
class Flight:
    """A flight at its reference time.

    ``body`` is the nominal one, ``com`` (3,) m, ``inertia`` (5,) and ``offset_px`` as in the module's table.
    World frame: ``x`` (3,) m of the centre of mass, ``q`` (4,) from the body, scalar last, ``v`` (3,) m/s, ``omega`` (3,) rad/s,
    ``gravity_world`` (3,) m/s².
    """

    time_s: float
    x: Array
    q: Array
    v: Array
    omega: Array
    body: Body
    com: Array
    inertia: Array
    offset_px: float
    gravity_world: Array

    @property
    def first(self) -> "Flight":
        """Itself: there is no impact that another one follows."""
        return self

    @property
    def layout(self) -> Layout:
        """Of its parameters."""
        return LAYOUT

    @property
    def values(self) -> Array:
        """Parameters (21,); the rotation is the increment about its attitude, so zero."""
        return np.concatenate([self.x, np.zeros(3), self.v, self.omega, self.com, self.inertia, [self.offset_px]])

    def moved(self, step: Array) -> "Flight":
        """The flight after a parameter step (21,)."""
        return replace(
            self,
            x=self.x + step[X],
            q=_unit(quaternion_product(quaternion_from_vector(step[THETA]), self.q)),
            v=self.v + step[V],
            omega=self.omega + step[OMEGA],
            com=self.com + step[COM],
            inertia=self.inertia + step[INERTIA],
            offset_px=self.offset_px + float(step[OFFSET][0]),
        )

    def with_first(self, first: "Flight") -> "Flight":
        """Another one."""
        return first

    def states(self, steps: Array, times_s: Array) -> States:
        """See :func:`states`; ``steps`` (m, 21), ``times_s`` (f,)."""
        return states(self, steps, times_s)


class Motion(State, Protocol):
    """What a fit moves: a free flight, flights that meet at impacts, or either with more parameters."""

    @property
    def first(self) -> Flight:
        """The flight that begins it, whose body, outline offset and gravity are those of all."""

    def with_first(self, first: Flight) -> Self:
        """The same with another flight that begins it."""

    def states(self, steps: Array, times_s: Array) -> States:
        """States (f, m, ·) at ``times_s`` (f,) of the motions reached by the parameter steps (m, p)."""


class Forces(Protocol):
    """What acts besides gravity, on m flights side by side; the same as a :data:`Rate` with the rows of parameters kept inside."""

    def acceleration(self, time_s: float, state: States, omega: Array) -> Array:
        """Acceleration (m, 3) m/s², world frame."""

    @property
    def torque(self) -> Rate | None:
        """Torque per largest moment (m, 3) rad/s², world frame; ``None`` where there is none."""

    @property
    def of_attitude(self) -> bool:
        """Whether any of them depends on the attitude."""

    @property
    def constant(self) -> bool:
        """Whether all are forces, and the same at every moment of a flight."""


@dataclass(frozen=True)
class FlightPoses:
    """Poses at f times of m flights.

    ``centre`` (f, m, 3) m where the *nominal* centre of mass lies, world frame; ``R`` (f, m, 3, 3) world from nominal body axes.
    """

    centre: Array
    R: Array


moved = Flight.moved


def inertia_matrix(flight: Flight, inertia: Array) -> Array:
    """Inertia (m, 3, 3) per nominal largest moment, nominal body axes, of perturbations ``inertia`` (m, 5)."""
    E = np.zeros((len(inertia), 3, 3))
    for column, (i, j) in enumerate(SYMMETRIC):
        E[:, i, j] = inertia[:, column]
        E[:, j, i] = inertia[:, column]
    root = np.sqrt(flight.body.inertia_ratios)
    return np.asarray(root[:, None] * (np.eye(3) + E) * root[None, :])


def states(flight: Flight, steps: Array, times_s: Array, forces: Forces | None = None) -> States:
    """States (f, m, ·) at ``times_s`` of the flights reached by the parameter steps (m, 21)."""
    q = quaternion_product(quaternion_from_vector(steps[:, THETA]), np.broadcast_to(flight.q, (len(steps), 4)))
    inertia = inertia_matrix(flight, flight.inertia + steps[:, INERTIA])
    start = States(
        x=flight.x + steps[:, X],
        q=q,
        v=flight.v + steps[:, V],
        L=angular_momentum(q, flight.omega + steps[:, OMEGA], inertia),
    )
    gravity, at_start = flight.gravity_world, {"start_time_s": flight.time_s}
    if forces is None or forces.constant:
        pushed = gravity if forces is None else gravity + forces.acceleration(flight.time_s, start, start.L)
        if is_round(inertia):
            return round_fall(start, times_s, gravity=pushed, **at_start)
        return fall(start, inverted(inertia), times_s, start_time_s=flight.time_s, gravity=pushed)

    def acceleration(time_s: float, state: States, omega: Array) -> Array:
        return gravity + forces.acceleration(time_s, state, omega)

    if is_round(inertia) and not forces.of_attitude:
        return round_flight(start, times_s, acceleration=acceleration, torque=forces.torque, **at_start)
    return propagate(start, inverted(inertia), times_s, start_time_s=flight.time_s, acceleration=acceleration, torque=forces.torque)


def poses(motion: Motion, steps: Array, times_s: Array) -> FlightPoses:
    """Poses at ``times_s`` (f,) of the motions reached by the parameter steps (m, p)."""
    reached = motion.states(steps, times_s)
    R = rotation_matrices(reached.q)
    com = motion.first.com + steps[:, COM]
    return FlightPoses(centre=reached.x - np.einsum("fmij,mj->fmi", R, com), R=R)


def still(motion: Motion) -> Array:
    """No step (1, p)."""
    return np.zeros((1, motion.layout.size))


def flown(motion: Motion, times_s: Array) -> FlightPoses:
    """Poses (m = 1) at ``times_s`` (f,) s."""
    return poses(motion, still(motion), times_s)


def perturbations(layout: Layout) -> tuple[NDArray[np.int64], Array, Array]:
    """The w parameters that are varied, steps (1 + 2 w, p): none, then each of them forth and back, and how far these are apart (w,)."""
    varied = np.flatnonzero(layout.steps).astype(np.int64)
    each, none = np.diag(layout.steps)[varied], np.zeros((1, layout.size))
    return varied, np.concatenate([none, np.stack([each, -each], axis=1).reshape(-1, layout.size)]), 2.0 * layout.steps[varied]


def poses_and_sensitivity(motion: Motion, times_s: Array) -> tuple[FlightPoses, Array]:
    """Poses (m = 1) and their sensitivity (f, 6, p): translation and left rotation vector of the nominal body, by central differences.

    ``times_s`` (f,).
    """
    varied, steps, widths = perturbations(motion.layout)
    every = poses(motion, steps, times_s)
    sensitivity = np.zeros((len(times_s), 6, motion.layout.size))
    sensitivity[:, :, varied] = pose_differences(every, widths)
    return FlightPoses(centre=every.centre[:, :1], R=every.R[:, :1]), sensitivity


def pose_differences(every: FlightPoses, widths: Array) -> Array:
    """Central differences (f, 6, w) of poses: the first flight is the unperturbed one, then come pairs that are ``widths`` (w,) apart."""
    plus, minus = slice(1, None, 2), slice(2, None, 2)
    S = np.empty((len(every.R), 6, len(widths)))
    with np.errstate(over="ignore", invalid="ignore"):  # of trial steps that run away
        S[:, :3] = np.swapaxes((every.centre[:, plus] - every.centre[:, minus]) / widths[None, :, None], 1, 2)
        turned = every.R[:, plus] @ np.swapaxes(every.R[:, minus], -1, -2)
        vectors = rotation_vector(turned.reshape(-1, 3, 3)).reshape(len(every.R), len(widths), 3)
        S[:, 3:] = np.swapaxes(vectors / widths[None, :, None], 1, 2)
    return S


def rates(motion: Motion, steps: Array, times_s: Array) -> Array:
    """Velocity and angular velocity (f, m, 6), world frame, at ``times_s`` (f,); ``steps`` (m, p)."""
    reached = motion.states(steps, times_s)
    inverse = inverted(inertia_matrix(motion.first, motion.first.inertia + steps[:, INERTIA]))
    omega = np.stack([angular_velocity(q, L, inverse) for q, L in zip(reached.q, reached.L, strict=True)])
    return np.concatenate([reached.v, omega], axis=2)


def velocities(motion: Motion, steps: Array, time_s: float) -> tuple[Array, Array]:
    """Velocity and angular velocity (m, 3) each, world frame, at one time; ``steps`` (m, p)."""
    both = rates(motion, steps, np.array([time_s]))[0]
    return both[:, :3], both[:, 3:]


def velocity_sensitivity(motion: Motion, time_s: float) -> Array:
    """Derivative (6, p) of (v, omega) at one time by the parameters."""
    varied, steps, widths = perturbations(motion.layout)
    values = rates(motion, steps, np.array([time_s]))[0]
    result = np.zeros((6, motion.layout.size))
    result[:, varied] = ((values[1::2] - values[2::2]) / widths[:, None]).T
    return result


def fitted_body(flight: Flight) -> Body:
    """The body with its fitted centre of mass and inertia, principal axes anew."""
    moments, axes = np.linalg.eigh(inertia_matrix(flight, flight.inertia[None])[0])
    axes = signed_axes(axes)
    nominal = flight.body
    return Body(
        com_particle=nominal.com_particle + nominal.R_particle_body @ flight.com,
        R_particle_body=nominal.R_particle_body @ axes,
        inertia_ratios=moments / moments[2],
    )


def _unit(q: Array) -> Array:
    return np.asarray(q / np.linalg.norm(q))
