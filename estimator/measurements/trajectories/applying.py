"""Which effects a trajectory can show, found out by trying: what an effect's own links depend on is what must have been measured."""

from collections.abc import Iterator, Sequence

import numpy as np

from datasets.vocabulary.effects import FURTHER_ONLY
from estimator.effects.dependence import needs_attitude, needs_unequal_moments, of_body, of_force
from estimator.effects.link import EffectModel
from estimator.effects.model import overrides
from estimator.measurements.trajectories.task import TrajectoryTask, read_once

WITHOUT_PICTURES = ("times", "body", "air", "acceleration", "torque", "scale", "tracked", "reading")
PLAUSIBLE: dict[str, tuple[float, float]] = {"centre_of_mass": (-0.05, 0.05), "trigger_jitter": (0.0, 0.01)}
"""Ranges of values for things of up to a metre, tracked at a few frames per second and more; the catalogue's are for particles of
millimetres before a high-speed camera."""

OFTEN_WRONG = 1.0
"""Degrees of freedom of Student's prior of what spins that were read once are wrong by: right, or wrong by all of it, as many may be.

With 3, as of other values, lift is half as sure where 6 of 15 readings are those of other balls (docs/studies/real_trajectories.md)."""


def why_not(effect: EffectModel, tasks: Sequence[TrajectoryTask]) -> str | None:
    """Why an effect cannot show in trajectories; ``None``: it can.

    Each condition is a set of channels, one of which has to be measured. Without an attitude a gyroscope says nothing of the world's axes.
    """
    if effect.camera is not None or effect.entry.key in FURTHER_ONLY:
        return "it is a camera's, and trajectories have none"
    measured = frozenset[str]().union(*(task.measured for task in tasks))
    for channels, said in _conditions(effect, measured):
        if not measured & channels:
            return said
    if overrides(effect, "times") and not any(_moves_rows(effect, task) for task in tasks):
        return "it moves none of these time stamps"
    if effect.of_misread_spin and not all(read_once(task) for task in tasks):
        return "no spin was read once in a flight"
    if effect.of_unmeasured_spin and (measured & {"theta", "gyro"} or any(_spin_changes(task) for task in tasks)):
        return "the spin was measured throughout"
    if overrides(effect, "torque") and not measured & {"theta", "gyro"} and not any(_spin_changes(task) for task in tasks):
        return "it needs a spin that was measured more than once in a flight"
    if overrides(effect, "torque") and needs_unequal_moments(effect) and all(np.ptp(t.setting.inertia_ratios) == 0.0 for t in tasks):
        return "its body is stated with three equal moments of inertia"
    return None


def _conditions(effect: EffectModel, measured: frozenset[str]) -> Iterator[tuple[frozenset[str], str]]:
    """Channels of which one is needed, and what is said without; a force that comes with a torque shows only in positions."""
    if not effect.random and not overrides(effect, *WITHOUT_PICTURES):
        yield frozenset(), "it acts on pictures"
    if overrides(effect, "reading"):
        yield frozenset({"gyro"}), "it acts on a gyroscope's readings"
    if effect.random or overrides(effect, "times"):
        yield frozenset({"x", "theta"}), "it needs measured positions or orientations: a slowly changing spin tells no times"
    if overrides(effect, "scale", "tracked", "air") or (overrides(effect, "acceleration") and not overrides(effect, "torque")):
        yield frozenset({"x"}), "it needs measured positions"
    if overrides(effect, "body"):
        changed = of_body(effect)
        if "com" in changed:
            yield frozenset({"x"}), "it needs measured positions"
            yield frozenset({"theta"}), "it needs a measured orientation"
        yield frozenset({"theta", "gyro"}), "it needs a measured orientation"
    pushes = overrides(effect, "acceleration") and ("x" in measured or not overrides(effect, "torque"))
    on = of_force(effect) if pushes else frozenset()
    if "orientation" in on:
        yield frozenset({"theta"}), "it needs a measured orientation"
    if "spin" in on:
        yield frozenset({"theta", "omega"}), "it needs a measured orientation or spin"
    if overrides(effect, "torque"):
        if needs_unequal_moments(effect) or needs_attitude(effect):
            yield frozenset({"theta", "gyro"}), "it needs a measured orientation"
        yield frozenset({"theta", "omega", "gyro"}), "it needs a measured orientation or spin"


def _moves_rows(effect: EffectModel, task: TrajectoryTask) -> bool:
    """Whether an effect on the clock moves any of a trajectory's rows."""
    theta = effect.starts(task.setting)[:1] + np.array([p.step for p in effect.entry.parameters])
    return any((effect.times(each, task.setting, task.times_s) != task.times_s).any() for each in theta)


def _spin_changes(task: TrajectoryTask) -> bool:
    """Whether a spin was measured in more than one row."""
    return bool(task.seen("omega").any(axis=1).sum() > 1)


def with_plausible_values(effect: EffectModel) -> EffectModel:
    """The effect with the ranges of values that tracked things may have."""
    limits = PLAUSIBLE.get(effect.entry.key)
    return effect if limits is None else effect.within(limits)
