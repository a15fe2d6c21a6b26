"""A model is a base (camera, clock, body, free flight) and a tuple of effects; here the effects of one tuple act together.

Parameters of all effects lie side by side in one array ``theta`` in the order of the tuple. Each link of the chain is the composition
(clock, optics) or the sum (forces, body, shifts) of what the effects do to it.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.camera import HsvCamera
from estimator.data.seen_by import SeenBy
from estimator.effects.dependence import needs_attitude
from estimator.effects.link import BodyChange, EffectModel, Moment, Places, Setting
from estimator.motion.blocks import Block, Layout
from estimator.motion.flight import LAYOUT
from estimator.motion.rigid_body import Rate, States, rotation_matrices

Array = NDArray[np.float64]
Act = Callable[[Array, Moment, Setting], Array | None]
"""A force or torque (m, 3) of an effect with parameters (m, q), ``None`` where it has none."""


@dataclass(frozen=True)
class Model:
    """Effects in the order in which they were added."""

    effects: tuple[EffectModel, ...] = ()

    @cached_property
    def layout(self) -> Layout:
        """Of a flight's parameters, and then of those of the effects: 21 + q, as derivatives have them."""
        return Layout((*LAYOUT.blocks, *(_block(effect) for effect in self.effects)))

    @cached_property
    def slices(self) -> tuple[slice, ...]:
        """Where each effect's parameters lie."""
        ends = np.cumsum([0] + [len(e.entry.parameters) for e in self.effects])
        return tuple(slice(int(a), int(b)) for a, b in pairwise(ends))

    def touching(self, *links: str) -> tuple[tuple[EffectModel, slice], ...]:
        """The effects that touch one of some links, in their order, and where the parameters of each lie."""
        if links not in self._touching:
            pairs = zip(self.effects, self.slices, strict=True)
            self._touching[links] = tuple(pair for pair in pairs if overrides(pair[0], *links))
        return self._touching[links]

    @cached_property
    def _touching(self) -> dict[tuple[str, ...], tuple[tuple[EffectModel, slice], ...]]:
        """What :meth:`touching` has found."""
        return {}

    @property
    def size(self) -> int:
        """Number of parameters of all effects."""
        return sum(len(e.entry.parameters) for e in self.effects)

    @property
    def keys(self) -> tuple[str, ...]:
        """The effects' keys."""
        return tuple(e.entry.key for e in self.effects)

    def each_parameter(self, of_effects: Array) -> Array:
        """Values (q,) of parameters: each is that of its effect among ``of_effects`` (e,)."""
        return np.repeat(of_effects, [len(e.entry.parameters) for e in self.effects])

    @property
    def steps(self) -> Array:
        """Steps (q,) for central differences."""
        return np.array([p.step for e in self.effects for p in e.entry.parameters])

    @property
    def precision(self) -> Array:
        """Information (q,) that priors give; zero for free parameters."""
        return self.layout.precision[LAYOUT.size :].copy()

    @property
    def instrument_precision(self) -> Array:
        """Information (q,) on what is the instrument's own; nothing on effects that are asked for."""
        ours = [np.full(len(e.entry.parameters), float(e.instrument)) for e in self.effects]
        return self.precision * np.concatenate([np.zeros(0), *ours])

    def precision_at(self, theta: Array) -> Array:
        """Information (q,) that priors give at parameters ``theta`` (q,): less in the tails of those that have some."""
        precision = self.precision
        for effect, part in zip(self.effects, self.slices, strict=True):
            if effect.tails:
                size = float(np.sum(precision[part] * theta[part] ** 2))
                precision[part] *= (effect.freedom + np.count_nonzero(precision[part])) / (effect.freedom + size)
        return precision

    def prior_cost(self, theta: Array) -> Array:
        """Minus the logarithm (e,) of each effect's prior density at ``theta`` (q,), up to a constant."""
        precision, cost = self.precision, np.zeros(len(self.effects))
        for i, (effect, part) in enumerate(zip(self.effects, self.slices, strict=True)):
            size = float(np.sum(precision[part] * theta[part] ** 2))
            freedom = effect.freedom + np.count_nonzero(precision[part])
            cost[i] = 0.5 * freedom * np.log1p(size / effect.freedom) if effect.tails else 0.5 * size
        return cost

    @property
    def frozen(self) -> NDArray[np.bool_]:
        """Which parameters (q,) a fit leaves as they are."""
        return np.array([p.name in e.frozen for e in self.effects for p in e.entry.parameters], dtype=np.bool_)

    def random_sigma(self, theta: Array) -> float:
        """Standard deviation (s) of the frames' times; ``theta`` (q,) of the model."""
        return float(np.sqrt(sum(float(theta[part][0]) ** 2 for e, part in zip(self.effects, self.slices, strict=True) if e.random)))

    @property
    def names(self) -> tuple[str, ...]:
        """``key.parameter`` of every parameter."""
        return self.layout.labels[LAYOUT.size :]

    def times(self, theta: Array, setting: Setting, times_s: Array, seen: SeenBy | None = None) -> Array:
        """True times of frames with nominal times, ``seen`` by those cameras; ``None``: by none, or by the first one's clock."""
        for effect, part in self._acting("times", seen):
            moved = effect.times(theta[part], setting.of_clock(effect.camera), times_s)
            times_s = moved if seen is None else seen.only(effect.camera, moved, times_s)
        return times_s

    def delays(self, theta: Array, rows_px: Array, seen: SeenBy | None = None) -> Array:
        """Sum of the delays (n,) s of outlines, ``seen`` by those cameras."""
        total = np.zeros(len(rows_px))
        for effect, part in self._acting("delays", seen):
            delays = effect.delays(theta[part], rows_px)
            if delays is not None:
                total = total + (delays if seen is None else seen.only(effect.camera, delays))
        return total

    def _acting(self, link: str, seen: SeenBy | None) -> Iterator[tuple[EffectModel, slice]]:
        """Those that touch a link: without cameras, those of no camera alone."""
        return (pair for pair in self.touching(link) if seen is not None or pair[0].camera is None)

    def body(self, theta: Array, setting: Setting) -> BodyChange:
        """Sum of the changes to the body."""
        com, inertia = np.zeros(3), np.zeros(5)
        for effect, part in self.touching("body"):
            change = effect.body(theta[part], setting)
            com, inertia = com + change.com, inertia + change.inertia
        return BodyChange(com, inertia)

    def scale(self, theta: Array) -> float:
        """Product of the scales."""
        return float(np.prod([e.scale(theta[part]) for e, part in self.touching("scale")]))

    def tracked(self, theta: Array, x: Array, setting: Setting) -> Array:
        """Where a tracker sees points that are at ``x`` (n, 3) m."""
        for effect, part in self.touching("tracked"):
            x = effect.tracked(theta[part], x, setting)
        return x

    def tracked_by(self, theta: Array, x: Array, setting: Setting, step_m: float) -> Array:
        """Derivatives (n, 3, q) m of :meth:`tracked` by the parameters (q,); ``step_m``: for what later effects make of earlier ones."""
        found = np.zeros((*x.shape, len(theta)))
        for number, (effect, part) in enumerate(self.touching("tracked")):
            seen = partial(effect.tracked, theta[part], setting=setting)
            if number:
                found = slope_of(seen, x, step_m) @ found
            own = effect.tracked_by if holds_of(effect, "tracked_by", "tracked") else partial(EffectModel.tracked_by, effect)
            found[:, :, part] = own(theta[part], x, setting)
            x = seen(x)
        return found

    def reading(self, theta: Array, omega: Array) -> Array:
        """What a gyroscope reads (n, 3) rad/s of angular velocities (n, 3) along its axes."""
        for effect, part in self.touching("reading"):
            omega = effect.reading(theta[part], omega)
        return omega

    def correct(self, theta: Array, points_px: Array, camera: HsvCamera, times_s: Array) -> Array:
        """Points in a camera without the effects: the last effect of the tuple is undone first."""
        for effect, part in reversed(self.touching("correct")):
            if effect.camera in (None, camera.name):
                points_px = effect.correct(theta[part], points_px, camera.intrinsics, times_s)
        return points_px

    def shift(self, theta: Array, places: Places, setting: Setting) -> Array:
        """Sum of the outline displacements (n, k, 2) px."""
        each = (places.only(effect, effect.shift(theta[part], places, setting)) for effect, part in self.touching("shift"))
        return _summed(each, np.zeros(places.radius_px.shape))

    def displaced(self, theta: Array, places: Places, setting: Setting) -> Array:
        """Sum of the displacements (n, k, 1) px of the outlines' own points."""
        each = (places.only(effect, effect.displaced(theta[part], places, setting)) for effect, part in self.touching("shift"))
        return _summed(each, np.zeros(places.radius_px.shape))


def slope_of(report: Callable[[Array], Array], true: Array, step: float) -> Array:
    """Derivatives (n, 3, 3) of reports by ``true`` values (n, 3) m or rad/s along any axes, central differences over a ``step``."""
    return np.stack([(report(true + d) - report(true - d)) / (2.0 * step) for d in step * np.eye(3)], axis=-1)


def _block(effect: EffectModel) -> Block:
    """An effect's parameters."""
    entry, held = effect.entry, 0.0 if effect.held is None else np.array(effect.held) ** -2.0
    steps = np.array([p.step for p in entry.parameters])
    return Block(entry.key, tuple(f"{entry.key}.{p.name}" for p in entry.parameters), steps, held, entry.scope)


def _summed(shifts: Iterable[Array | None], total: Array) -> Array:
    """The sum of what effects displace, beginning with a ``total`` (n, k, 2) px."""
    for shift in shifts:
        total = total if shift is None else total + shift
    return total


def overrides(effect: EffectModel, *links: str) -> bool:
    """Whether an effect touches one of the links."""
    return any(effect.touches(link) for link in links)


def holds_of(effect: EffectModel, word: str, *links: str) -> bool:
    """Whether what a class says of its links holds: not where a class below has overridden one of them without saying it again."""
    classes = type(effect).__mro__
    said, made = (min(i for i, each in enumerate(classes) if set(names) & set(vars(each))) for names in ((word,), links))
    return said <= made


@dataclass(frozen=True)
class ModelForces:
    """The forces of a model on m flights side by side, each with its own row of ``theta`` (m, q)."""

    model: Model
    theta: Array
    setting: Setting

    def acceleration(self, time_s: float, state: States, omega: Array) -> Array:
        """Sum of the effects' accelerations (m, 3): of those that lift first, since drag may go with it."""
        moment = self._moment(time_s, state, omega)
        lift = self._sum("lift", moment)
        others = self._sum("acceleration", moment if lift is None else replace(moment, lift=lift))
        parts = [part for part in (lift, others) if part is not None]
        return sum(parts[1:], start=parts[0]) if parts else np.zeros(moment.x.shape)

    @property
    def torque(self) -> Rate | None:
        """Sum of the effects' torques, ``None`` where no effect has one."""
        return self._torque if self.model.touching("torque") else None

    @cached_property
    def of_attitude(self) -> bool:
        """Whether a force or torque depends on the attitude."""
        return any(needs_attitude(e) for e, _ in self.model.touching("acceleration", "torque"))

    @cached_property
    def constant(self) -> bool:
        """Whether all are forces, and the same at every moment."""
        forces = ("acceleration", "torque")
        return all(e.constant and holds_of(e, "constant", *forces) for e, _ in self.model.touching(*forces))

    def _torque(self, time_s: float, state: States, omega: Array) -> Array:
        torque = self._sum("torque", self._moment(time_s, state, omega))
        return np.zeros(state.x.shape) if torque is None else torque

    def _moment(self, time_s: float, state: States, omega: Array) -> Moment:
        return Moment(time_s - float(self.setting.times_s[0]), state.x, state.v, omega, state.L, rotation_matrices(state.q), self._air)

    @cached_property
    def _air(self) -> Array | None:
        """Velocity of the air (m, 3); ``None`` where it is still."""
        winds = [effect.air(self.theta[:, part]) for effect, part in self.model.touching("air")]
        moving = [wind for wind in winds if wind is not None]
        return np.asarray(sum(moving)) if moving else None

    def _sum(self, kind: str, moment: Moment) -> Array | None:
        """What effects of a kind do together (m, 3); ``None``: nothing."""
        total = None
        for act, theta in self._acting[kind]:
            value = act(theta, moment, self.setting)
            if value is not None:
                total = value if total is None else total + value
        return None if total is None else np.asarray(total, dtype=np.float64)

    @cached_property
    def _acting(self) -> dict[str, list[tuple[Act, Array]]]:
        """What effects do, with their parameters (m, q): lifts apart from other accelerations."""
        acting: dict[str, list[tuple[Act, Array]]] = {"lift": [], "acceleration": [], "torque": []}
        for link in ("acceleration", "torque"):
            for effect, part in self.model.touching(link):
                kind = "lift" if link == "acceleration" and effect.lifts else link
                acting[kind].append((getattr(effect, link), self.theta[:, part]))
        return acting
