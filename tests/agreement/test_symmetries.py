"""Symmetries that the forward chain keeps with every effect of the registry: none knows where time begins or how the world is turned.

Nature has them by construction, so a model that breaks one could agree with nature only where it was tried.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from estimator.appearance.model_errors import ModelErrors, SequenceTask, model_errors
from estimator.appearance.prediction import Prediction, predict
from estimator.effects.model import Model
from estimator.effects.registry import MODELS
from estimator.motion.flight import Flight
from tests.agreement.exact_sequences import Array, Made, made, setting_of, task_of, theta_of, true_flight
from tests.agreement.sizes import SIZES

LATER_S = 3.7
ROUNDING = 5e-5
"""Errors (px, or share of the largest) that may differ: between the stages of a Runge-Kutta step quaternions are not of unit length, which
the truncation of a turned world shows."""
TURN = Rotation.from_rotvec([0.4, -1.1, 0.7])
VECTORS = ("gravity", "uniform_acceleration")
"""Effects whose three parameters are a vector in the world frame."""


def of(key: str) -> tuple[SequenceTask, Flight, Array]:
    """A sequence with the effect, its true flight, and two thirds of the effect's sizes, so that errors are left to compare."""
    sequence = made(key, SIZES[key])
    shares = {n: v if n not in MODELS[key].entry.sizes else 2 / 3 * v for n, v in SIZES[key].items()}
    return task_of(sequence), true_flight(sequence, 0.0), theta_of(key, shares)


def errors(key: str, task: SequenceTask, flight: Flight, theta: Array) -> ModelErrors:
    return model_errors(task, flight, Model((MODELS[key],)), theta)


def same(first: ModelErrors, second: ModelErrors) -> None:
    assert np.abs(first.e[first.seen]).max() > 1e-2
    np.testing.assert_allclose(second.e, first.e, atol=ROUNDING * max(1.0, float(np.abs(first.e).max())))


@pytest.mark.parametrize("key", SIZES)
def test_time_has_no_origin(key: str) -> None:
    """Time stamps that begin elsewhere: the first frame's is what effects count from."""
    task, flight, theta = of(key)
    sightings = replace(task.task.sightings, times_s=task.task.sightings.times_s + LATER_S)
    later = replace(
        task, task=replace(task.task, sightings=sightings), setting=replace(task.setting, times_s=task.setting.times_s + LATER_S)
    )
    same(errors(key, task, flight, theta), errors(key, later, replace(flight, time_s=LATER_S), theta))


@pytest.mark.parametrize("key", SIZES)
def test_the_world_has_no_direction(key: str) -> None:
    """World axes turned, with the camera, the flight, gravity and the effects' vectors in them."""
    task, flight, theta = of(key)
    Q = TURN.as_matrix()
    cameras = tuple(replace(c, R_cam_world=c.R_cam_world @ Q.T) for c in task.task.sightings.cameras)
    sightings = replace(task.task.sightings, cameras=cameras)
    turned = replace(flight, **{name: Q @ getattr(flight, name) for name in ("x", "v", "omega", "gravity_world")})
    turned = replace(turned, q=(TURN * Rotation.from_quat(flight.q)).as_quat())
    setting = replace(task.setting, gravity_world=Q @ task.setting.gravity_world)
    moved = replace(task, task=replace(task.task, sightings=sightings), setting=setting)
    same(errors(key, task, flight, theta), errors(key, moved, turned, Q @ theta if key in VECTORS else theta))


@pytest.mark.parametrize("key", ["linear_drag", "quadratic_drag", "magnus_lift", "spin_damping", "inertia_ratios", "centre_of_mass"])
def test_mirror_images_fly_as_mirror_images(key: str) -> None:
    """In a world mirrored in x, velocities are mirrored as vectors and spins as axial vectors; a lift that is even in both would not be."""
    sequence = made(key, SIZES[key])
    flight, theta = true_flight(sequence, 0.0), theta_of(key, SIZES[key])
    M = np.diag([-1.0, 1.0, 1.0])
    mirrored = replace(flight, x=M @ flight.x, v=M @ flight.v, omega=-M @ flight.omega, gravity_world=M @ flight.gravity_world)
    R = Rotation.from_quat(flight.q).as_matrix()
    mirrored = replace(mirrored, q=Rotation.from_matrix(M @ R @ M).as_quat())
    other = M @ theta if key == "centre_of_mass" else theta
    there, mirror = (predicted(key, sequence, f, t) for f, t in ((flight, theta), (mirrored, other)))
    np.testing.assert_allclose(mirror.poses.centre, there.poses.centre @ M, atol=1e-12)
    np.testing.assert_allclose(mirror.poses.R, M @ there.poses.R @ M, atol=1e-9)


def predicted(key: str, sequence: Made, flight: Flight, theta: Array) -> Prediction:
    return predict(flight, Model((MODELS[key],)), theta, setting_of(sequence), sequence.plan.clock.times_s)
