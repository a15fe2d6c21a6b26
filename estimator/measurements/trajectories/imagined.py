"""Trajectories that have not been measured: rows of positions, orientations and spins, as many and as noisy as a measured sequence has."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.imagined_sequences import Drop, Imagined, about
from estimator.effects.model import Model
from estimator.fitting.campaigns.campaign import SequenceEquations
from estimator.fitting.campaigns.forced_velocities import body_under, forced_states
from estimator.measurements.trajectories.task import TrajectoryTask
from estimator.motion.flight import Flight, still
from estimator.motion.rigid_body import rotation_matrices

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Tracks:
    """Trajectories as a measured sequence has them; ``model`` and ``theta`` (q,) are those of the fit."""

    sequence: TrajectoryTask
    flight: Flight
    model: Model
    theta: Array

    @property
    def camera(self) -> None:
        """There is none."""
        return

    @property
    def recorded(self) -> Drop:
        """The measured drop, its rows laid about the flight's reference time."""
        nominal = self.sequence.setting
        return Drop(self.flight, about(self.flight.time_s, len(nominal.times_s), nominal.interval_s), ())

    def imagined(self, drop: Drop) -> Imagined:
        """Rows where the drop would be, each as noisy as the measured ones are in the median."""
        task, setting = self.sequence, replace(self.sequence.setting, times_s=drop.times_s, scatter_s=None)
        at, rows = (self.model, self.theta, setting), len(drop.times_s)
        reached, omega = forced_states(drop.flight, still(drop.flight), at, drop.times_s)
        R = rotation_matrices(reached.q[:, 0])
        centre = reached.x[:, 0] - R @ body_under(drop.flight, *at).com
        made = replace(
            task,
            name="imagined",
            setting=setting,
            x_world=centre / self.model.scale(self.theta),
            R_world_body=None if task.R_world_body is None else R,
            omega_world=None if task.omega_world is None else omega[:, 0],
            gyro=None if task.gyro is None else np.einsum("ij,nkj,nk->ni", drop.flight.body.R_particle_body, R, omega[:, 0]),
            sigma=np.tile(np.median(task.sigma, axis=0), (rows, 1)),
            kept=np.ones(rows, dtype=np.bool_),
        )
        return Imagined(drop, made, rows)

    def thinned(self, sequence: TrajectoryTask, most: int) -> tuple[TrajectoryTask, float]:
        """The sequence itself: rows cost little."""
        del most
        return sequence, 1.0

    def silent(self, equations: SequenceEquations) -> SequenceEquations:
        """The equations themselves: their noise is stated."""
        return equations

    def more_views(self, sequence: TrajectoryTask, particle: object) -> TrajectoryTask:
        """The sequence itself: there are no views."""
        del particle
        return sequence
