"""The derivatives of a trajectory's residuals by effects' parameters, held to central differences."""

from dataclasses import replace

import numpy as np

from datasets.trajectory import Trajectory
from datasets.vocabulary.effects import EFFECTS
from estimator.effects.catalogue.clock.stamp_scatter import to_even_times
from estimator.effects.model import Model
from estimator.effects.registry import MODELS
from estimator.measurements.trajectories.registering import task_of
from estimator.measurements.trajectories.starting import first_flight
from estimator.measurements.trajectories.task import trajectory_errors


def held_to_central_differences(trajectory: Trajectory, sizes: dict[str, dict[str, float]]) -> None:
    """Near the flight that a fit of the trajectory starts from, with the effects of ``sizes`` at nine tenths of theirs."""
    task, model = task_of(trajectory), Model(tuple(MODELS[key] for key in sizes))
    task = replace(task, setting=replace(task.setting, scatter_s=to_even_times([task.times_s])[0]))
    flight = first_flight(task, trajectory.surroundings.body)
    flight = replace(flight, omega=flight.omega + 0.1)
    theta = 0.9 * np.concatenate([[values[name] for name in EFFECTS[key].names] for key, values in sizes.items()])
    J = trajectory_errors(task, flight, model, theta).J
    for column, step in enumerate(model.steps):
        change = np.zeros(len(theta))
        change[column] = 5.0 * step
        high, low = (trajectory_errors(task, flight, model, theta + sign * change).e for sign in (1.0, -1.0))
        difference = (high - low) / (10.0 * step)
        assert np.abs(difference).max() > 0.0
        assert np.abs(J[..., 21 + column] - difference).max() < 2e-3 * np.abs(difference).max()
