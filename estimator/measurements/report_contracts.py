"""What effects of trackers and gyroscopes must keep: the contracts of :mod:`estimator.appearance.effect_contracts`, tried on rows.

Pictures know neither link, so a flight is taken as a trajectory that was measured without noise, positions and a gyroscope's readings, and
residuals are asked for in the way fits to trajectories ask for them. An effect that acts on pictures, too, is tried on both.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from datasets.errors import InputError
from estimator.appearance.effect_contracts import AGREE, NOTHING, Kept, plausible, smooth, zeros
from estimator.appearance.prediction import predict
from estimator.effects.link import EffectModel, Setting
from estimator.effects.model import Model, overrides
from estimator.likelihood.rows import Rows
from estimator.measurements.trajectories.task import TrajectoryTask, trajectory_errors
from estimator.motion.flight import N_PARAMETERS, Flight

Array = NDArray[np.float64]
OF_ROWS = ("tracked", "reading")
"""Links that only trajectories have."""
ROUNDING = 1e-9
"""Change of a residual (m or rad/s) that counts as none: rounding."""


def check_reports(effect: EffectModel, setting: Setting, flight: Flight) -> tuple[Kept, ...]:
    """The contracts of an effect's reports, on one flight; nothing of an effect that has none.

    Parameters
    ----------
    effect
        Of the catalogue or a plug-in.
    setting
        Time stamps (f,) s, gravity (3,) m/s², world frame, and inertia ratios of the flight.
    flight
        Near which the body moves.
    """
    if not overrides(effect, *OF_ROWS):
        return ()
    task = _measured(setting, flight)
    told = []
    for name, check in (("zero is no effect", _zero), ("the same twice", _pure), ("derivatives", _derivatives), ("it acts", _acts)):
        try:
            told.append(Kept(f"{name}, of rows", *check(effect, task, flight)))
        except InputError as error:
            told.append(Kept(f"{name}, of rows", False, str(error)))
    return tuple(told)


def _measured(setting: Setting, flight: Flight) -> TrajectoryTask:
    """What the flight shows without noise: residuals (m, rad/s) without effects are zero."""
    seen = predict(flight, Model(), np.zeros(0), setting, setting.times_s)
    x, axes = seen.poses.centre[:, 0], flight.body.R_particle_body @ np.swapaxes(seen.poses.R[:, 0], 1, 2)
    middle = x.mean(axis=0)
    reach = float(np.sqrt(np.mean(np.sum((x - middle) ** 2, axis=1))))
    return TrajectoryTask(
        name="as_seen",
        setting=replace(setting, middle_world=middle, reach_m=reach or 1.0),
        x_world=x,
        R_world_body=None,
        omega_world=None,
        sigma=np.ones((len(x), 6)),
        repeats=np.ones(6),
        kept=np.ones(len(x), dtype=np.bool_),
        freedom=np.ones(6),
        gyro=np.einsum("nij,nj->ni", axes, seen.omega),
    )


def _rows(effect: EffectModel, theta: Array, task: TrajectoryTask, flight: Flight) -> Rows:
    return trajectory_errors(task, flight, Model((effect,)), theta)


def _zero(effect: EffectModel, task: TrajectoryTask, flight: Flight) -> tuple[bool, str]:
    without = trajectory_errors(task, flight, Model(), np.zeros(0)).e
    largest = float(np.abs(_rows(effect, zeros(effect, task.setting), task, flight).e - without).max())
    return largest <= ROUNDING, f"at zero the residuals change by at most {largest:.1e} m or rad/s (allowed: {ROUNDING:.0e})"


def _pure(effect: EffectModel, task: TrajectoryTask, flight: Flight) -> tuple[bool, str]:
    theta = plausible(effect, task.setting)
    kept = theta.copy()
    first, again = (_rows(effect, theta, task, flight).e for _ in range(2))
    same = bool(np.array_equal(first, again) and np.array_equal(theta, kept))
    return same, "asked twice, it answers the same" if same else "asked twice, it answers differently, or it changes its arguments"


def _derivatives(effect: EffectModel, task: TrajectoryTask, flight: Flight) -> tuple[bool, str]:
    theta = plausible(effect, task.setting)
    there, worst, told = _rows(effect, theta, task, flight), -1.0, NOTHING
    for number, step in smooth(effect):
        change = np.zeros(len(theta))
        change[number] = step
        high, low = (_rows(effect, theta + sign * change, task, flight).e for sign in (1.0, -1.0))
        slope = (high - low) / (2.0 * step)
        size = float(np.sqrt(np.mean(slope**2))) + ROUNDING / step
        off = float(np.abs(there.J[..., N_PARAMETERS + number] - slope).max()) / size
        if off > worst:
            name = effect.entry.parameters[number].name
            worst, told = off, f"those by {name} are off finite differences by {off:.1%} (allowed: {AGREE:.0%})"
    return worst <= AGREE, told


def _acts(effect: EffectModel, task: TrajectoryTask, flight: Flight) -> tuple[bool, str]:
    without = trajectory_errors(task, flight, Model(), np.zeros(0)).e
    moved = float(np.sqrt(np.mean((_rows(effect, plausible(effect, task.setting), task, flight).e - without) ** 2)))
    return moved > ROUNDING, f"what is read moves by {moved:.2g} m or rad/s RMS"
