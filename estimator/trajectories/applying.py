"""Which effects a trajectory can show, found out by trying: what an effect's own links depend on is what must have been measured."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.effects import Parameter
from estimator.effects.link import EffectModel, Moment, Setting
from estimator.effects.model import overrides
from estimator.motion.rotation import rotation_from_vector

Array = NDArray[np.float64]
WITHOUT_PICTURES = ("times", "body", "acceleration", "torque", "scale")
PLAUSIBLE: dict[str, tuple[float, float]] = {"centre_of_mass": (-0.05, 0.05), "trigger_jitter": (0.0, 0.01)}
"""Ranges of values for things of up to a metre, tracked at a few frames per second and more; the catalogue's are for particles of
millimetres before a high-speed camera."""


def needs(effect: EffectModel) -> frozenset[str]:
    """What has to be measured for an effect to show, besides positions: "pictures", "orientation", "spin"."""
    if not effect.random and not overrides(effect, *WITHOUT_PICTURES):
        return frozenset({"pictures"})
    found = set()
    if overrides(effect, "body"):
        found.add("orientation")
    if overrides(effect, "torque"):
        found.add("spin")
    if overrides(effect, "acceleration"):
        found |= _of_force(effect)
    return frozenset(found)


def _of_force(effect: EffectModel) -> set[str]:
    """Which parts of a moment an acceleration depends on."""
    setting, moment = _somewhere()
    theta = effect.starts(setting)[:1] + np.array([[_something(p) for p in effect.entry.parameters]])
    turned = np.swapaxes(moment.R, 1, 2)
    changes: dict[str, Callable[[], Moment]] = {
        "orientation": lambda: replace(moment, R=turned),
        "spin": lambda: replace(moment, omega=2.0 * moment.omega[:, ::-1], L=3.0 * moment.L[:, ::-1]),
    }
    before = effect.acceleration(theta, moment, setting)
    after = {name: effect.acceleration(theta, change(), setting) for name, change in changes.items()}
    return {name for name, value in after.items() if value is not None and before is not None and not np.allclose(value, before)}


def _something(parameter: Parameter) -> float:
    """A value that is not zero."""
    low, high = parameter.plausible
    top = high if np.isfinite(high) and high > 0 else -low
    return float(0.3 * top) if np.isfinite(top) else 100.0 * parameter.step


def _somewhere() -> tuple[Setting, Moment]:
    """A flight at one instant, nothing of it zero."""
    setting = Setting(np.linspace(0.0, 0.5, 51), 0.0, np.array([0.3, -0.5, -9.8]), np.array([0.5, 0.8, 1.0]))
    row = np.array([[0.3, -0.2, 0.5]])
    R = rotation_from_vector(np.array([[0.4, 0.7, -0.3]]))
    return setting, Moment(0.2, row, np.array([[1.0, -2.0, 0.7]]), np.array([[5.0, 3.0, -7.0]]), np.array([[4.0, 2.5, -6.0]]), R)


def with_plausible_values(effect: EffectModel) -> EffectModel:
    """The effect with the ranges of values that tracked things may have."""
    limits = PLAUSIBLE.get(effect.entry.key)
    return effect if limits is None else _widened(type(effect), limits)()


def _widened(kind: type[EffectModel], limits: tuple[float, float]) -> type[EffectModel]:
    parameters = tuple(replace(p, plausible=limits) for p in kind.entry.parameters)
    return type(kind.__name__, (kind,), {"entry": replace(kind.entry, parameters=parameters), "__doc__": kind.__doc__})
