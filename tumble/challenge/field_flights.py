"""Flies the flights of a field case with synth's motion, and measures them: noise with heavy tails, alike over rows, and rows far off."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from datasets.trajectory import Surroundings, Trajectory
from datasets.vocabulary.body import Body
from datasets.vocabulary.state import Motion
from synth.effects import EffectsInForce, FlyingBody
from synth.motion import Start, fly, fly_pushed
from tumble.challenge.field_case import CHANNELS, FieldCase, FlightPlan
from tumble.challenge.field_noise import far_off, heavy_tailed

Array = NDArray[np.float64]
GRAVITY = np.array([0.0, 0.0, -9.81])
STATED_S = 1e-3
"""To what time stamps are rounded."""
DENSE = 4
"""Rows of the true motion that is kept, per measured row."""
RADIUS_M, MASS_KG = 0.02, 0.03
"""Of the body: they matter to a vent's torque alone."""


@dataclass(frozen=True)
class Flown:
    """True motion of the centre of mass at ``nominal_s`` (what a perfect recorder's stamps would be), and the tracked ``x`` (n, 3).

    Attitudes are those of the tracked frame, along the axes of the uniform body.
    """

    nominal_s: Array
    motion: Motion
    x: Array


def nominal_times(plan: FlightPlan, per_row: int = 1) -> Array:
    """Times of rows (s) by the recorder's clock, before they are rounded."""
    return np.arange((plan.rows - 1) * per_row + 1) / (plan.rate_hz * per_row)


def flown(case: FieldCase, number: int, per_row: int = 1) -> Flown:
    """One flight as it happens.

    Raises
    ------
    InputError
        Where no body flies like that.
    ArithmeticError
        Where the motion cannot be integrated.
    """
    plan, nominal = case.flights[number], nominal_times(case.flights[number], per_row)
    values = case.values(number)
    length = 1.0 + values.pop("length_scale", {}).get("relative", 0.0)
    force = EffectsInForce({key: each for key, each in values.items() if any(each.values())})
    ratios = np.array(case.ratios)
    inertia = ratios * 0.4 * MASS_KG * RADIUS_M**2
    body = force.flying_body(FlyingBody(np.zeros((1, 3)), Body(np.zeros(3), np.eye(3), ratios), MASS_KG, inertia))
    times = force.true_times(nominal, np.random.default_rng(0))
    axes = Rotation.from_matrix(body.body.R_particle_body)
    attitude = (Rotation.from_quat(plan.q_world_body) * axes).as_quat()
    start = Start(np.zeros(3), attitude, *(np.array(each) for each in (plan.v_world, plan.omega_world)))
    if force.push:
        motion = fly_pushed(start, body, GRAVITY, force, span_s=(0.0, float(times[-1]))).at(times)
    else:
        motion = fly(start, body.inertia_kgm2, GRAVITY, earliest_s=0.0, latest_s=float(times[-1])).at(times)
    motion = replace(motion, q_world_body=(Rotation.from_quat(motion.q_world_body) * axes.inv()).as_quat())
    tracked = motion.x_world - Rotation.from_quat(motion.q_world_body).apply(body.body.com_particle)
    return Flown(nominal, motion, tracked / length)


def measured(case: FieldCase, number: int) -> Trajectory:
    """What is measured of one flight; the noise depends on the case's seed and the flight's number alone."""
    return exact_with_noise(case, number, flown(case, number))


def exact_with_noise(case: FieldCase, number: int, flight: Flown) -> Trajectory:
    """Noise added to a flight."""
    rng = np.random.default_rng([case.seed, number])
    noise, n = case.noise, len(flight.nominal_s)
    q = Rotation.from_quat(flight.motion.q_world_body)
    far = rng.random(n) < noise.outliers
    drawn = {channel: heavy_tailed(rng, n, 3, noise.repeats) + far_off(rng, far, 3) for channel in CHANNELS[case.measured]}
    errors = {channel: noise.sigma[channel] * each for channel, each in drawn.items()}
    times = np.round(flight.nominal_s / STATED_S) * STATED_S if noise.rounded else flight.nominal_s
    omega, gyro = flight.motion.omega_world, q.inv().apply(flight.motion.omega_world)
    force = EffectsInForce({key: each for key, each in case.values(number).items() if key.startswith("gyroscope") and any(each.values())})
    stated = {channel: np.full((n, 3), noise.sigma[channel]) for channel in errors} if noise.stated else {}
    none = np.full((n, 3), np.nan)
    return Trajectory(
        case.flights[number].name,
        times,
        flight.x + errors["x"] if "x" in errors else none,
        (Rotation.from_rotvec(errors["theta"]) * q).as_quat() if "theta" in errors else None,
        omega + errors["omega"] if "omega" in errors else None,
        stated.get("x"),
        stated.get("theta"),
        stated.get("omega"),
        surroundings(case),
        force.gyroscope(gyro) + errors["gyro"] if "gyro" in errors else None,
        stated.get("gyro"),
    )


def surroundings(case: FieldCase) -> Surroundings:
    """What is said beside the numbers."""
    body = Body(np.zeros(3), np.eye(3), np.array(case.ratios))
    return Surroundings(np.zeros(3) if case.measured == "gyroscope" else GRAVITY, body, particle="thing")


def without_effects(case: FieldCase) -> FieldCase:
    """The same case with its noise alone."""
    return replace(case, hidden={}, mess={}, outside={})
