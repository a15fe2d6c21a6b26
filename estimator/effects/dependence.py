"""What an effect's force depends on, found out by trying: the attitude of the body, its spin, whether its moments differ, the air."""

from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.effects import Parameter
from estimator.effects.link import EffectModel, Moment, Setting
from estimator.motion.rotation import rotation_from_vector

Array = NDArray[np.float64]


@lru_cache(maxsize=256)
def of_force(effect: EffectModel) -> frozenset[str]:
    """Which of "orientation" and "spin" the acceleration of an effect depends on."""
    return _changed_by(effect, "acceleration") - {"air"}


@lru_cache(maxsize=256)
def needs_attitude(effect: EffectModel) -> bool:
    """Whether the acceleration or the torque of an effect depends on the attitude."""
    return any("orientation" in _changed_by(effect, link) for link in ("acceleration", "torque"))


@lru_cache(maxsize=256)
def feels_air(effect: EffectModel) -> bool:
    """Whether the acceleration or the torque of an effect depends on how the air moves."""
    return any("air" in _changed_by(effect, link) for link in ("acceleration", "torque"))


def idle(effect: EffectModel, beside: Iterable[EffectModel]) -> bool:
    """Whether an effect does nothing ``beside`` these: a wind that nothing feels, a drag by lift without one.

    Nor does a wrong reading of a spin where nothing acts by the spin: such noise is what those would do with the right one.
    """
    others = tuple(each for each in beside if not each.noise)
    if effect.noise and effect.of_unmeasured_spin:
        return not any("spin" in of_force(each) for each in others)
    lifted = any(each.lifts for each in others)
    felt = any(feels_air(each) for each in others if lifted or not each.of_lift)
    return (moves_air_alone(effect) and not felt) or (effect.of_lift and not lifted)


@lru_cache(maxsize=256)
def moves_air_alone(effect: EffectModel) -> bool:
    """Whether all that an effect does is to move the air: nothing, without another that feels it."""
    theta, moment, setting = _tried(effect)
    pushed = effect.acceleration(theta, moment, setting), effect.torque(theta, moment, setting)
    return effect.air(theta) is not None and pushed == (None, None)


@lru_cache(maxsize=256)
def of_body(effect: EffectModel) -> frozenset[str]:
    """Which of "com" and "inertia" of the body an effect changes."""
    setting, _ = _somewhere()
    theta = effect.starts(setting)[0]
    before, after = (effect.body(theta + np.array([size * _something(p) for p in effect.entry.parameters]), setting) for size in (0.0, 1.0))
    return frozenset(name for name in ("com", "inertia") if (getattr(before, name) != getattr(after, name)).any())


@lru_cache(maxsize=256)
def needs_unequal_moments(effect: EffectModel) -> bool:
    """Whether the torque of an effect vanishes where angular momentum and spin have one direction, whatever the spin."""
    theta, moment, setting = _tried(effect)
    uneven, even = (effect.torque(theta, each, setting) for each in (moment, replace(moment, L=moment.omega)))
    return uneven is not None and even is not None and bool(np.allclose(even, 0.0) and not np.allclose(uneven, 0.0))


def _changed_by(effect: EffectModel, link: str) -> frozenset[str]:
    """Which parts of a moment a link depends on."""
    theta, moment, setting = _tried(effect)
    turned = np.swapaxes(moment.R, 1, 2)
    changes: dict[str, Callable[[], Moment]] = {
        "orientation": lambda: replace(moment, R=turned),
        "spin": lambda: replace(moment, omega=2.0 * moment.omega[:, ::-1], L=3.0 * moment.L[:, ::-1]),
        "air": lambda: replace(moment, air=moment.v[:, ::-1]),
    }
    before = getattr(effect, link)(theta, moment, setting)
    after = {name: getattr(effect, link)(theta, change(), setting) for name, change in changes.items()}
    return frozenset(name for name, value in after.items() if value is not None and before is not None and not np.allclose(value, before))


def _tried(effect: EffectModel) -> tuple[Array, Moment, Setting]:
    """Parameters (3, q) of an effect that are not zero, the same for three flights at one instant."""
    setting, moment = _somewhere()
    theta = effect.starts(setting)[:1] + np.array([[_something(p) for p in effect.entry.parameters]])
    return np.repeat(theta, len(moment.x), axis=0), moment, setting


def _something(parameter: Parameter) -> float:
    """A value that is not zero."""
    low, high = parameter.plausible
    top = high if np.isfinite(high) and high > 0 else -low
    return float(0.3 * top) if np.isfinite(top) else 100.0 * parameter.step


def _somewhere() -> tuple[Setting, Moment]:
    """A slow, a slower and a fast flight at one instant, nothing of them zero."""
    setting = Setting(np.linspace(0.0, 0.5, 51), 0.0, np.array([0.3, -0.5, -9.8]), np.array([0.5, 0.8, 1.0]))
    sizes = np.array([[1.0], [0.1], [10.0]])
    v, omega, L = (sizes * np.array(row) for row in ([1.0, -2.0, 0.7], [5.0, 3.0, -7.0], [4.0, 2.5, -6.0]))
    R = np.repeat(rotation_from_vector(np.array([[0.4, 0.7, -0.3]])), len(sizes), axis=0)
    return setting, Moment(0.2, np.repeat([[0.3, -0.2, 0.5]], len(sizes), axis=0), v, omega, L, R, lift=v[:, ::-1])
