"""The effects that are in force in one sequence, and what they make of each link of the chain."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import reduce
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from datasets.recipes.effects import KNOWN, values_in_sequence
from datasets.recipes.recipe import EffectRecipe
from datasets.vocabulary.camera import Intrinsics
from synth.effects.links import (
    Blur,
    BodyChange,
    Clockwork,
    Dynamics,
    FlightState,
    FlyingBody,
    Gyroscope,
    Lens,
    Link,
    PictureMotion,
    RowClock,
    Segmentation,
    Sway,
    Threshold,
    Tracker,
    Values,
    ViewSegmentation,
    Wind,
)
from synth.effects.registry import REALISATIONS

Array = NDArray[np.float64]
Kind = TypeVar("Kind", bound=Link)


@dataclass(frozen=True)
class EffectsInForce:
    """Effects by key with their values in one sequence, in the order of evaluation; effects of no size are left out.

    Each method is one link of the chain; where no effect hooks into it, it returns what it was given.
    """

    values: dict[str, Values] = field(default_factory=dict)

    def true_times(self, stamps_s: Array, rng: np.random.Generator) -> Array:
        """True times (frame,) s of frames with time stamps (frame,) s."""
        return reduce(lambda times, hook: hook[0].true_times(times, hook[1], rng), self._of(Clockwork), stamps_s)

    def flying_body(self, nominal: FlyingBody) -> FlyingBody:
        """The body that flies."""
        return reduce(lambda body, hook: hook[0].change(body, hook[1]), self._of(BodyChange), nominal)

    @property
    def push(self) -> bool:
        """Whether anything but the stated gravity acts in flight."""
        return bool(self._of(Dynamics))

    def acceleration(self, state: FlightState) -> Array:
        """What is added to the stated gravity (3,) m/s², world frame."""
        winds = [link.velocity(values) for link, values in self._of(Wind)]
        state = replace(state, air_world=np.sum(winds, axis=0)) if winds else state
        lifts = [link.acceleration(state, values) for link, values in self._of(Dynamics) if link.lifts]
        state = replace(state, lift_world=np.sum(lifts, axis=0)) if lifts else state
        return np.sum([link.acceleration(state, values) for link, values in self._of(Dynamics)], axis=0)

    def torque_body(self, state: FlightState) -> Array:
        """Torque over the largest principal moment (3,) rad/s², body frame."""
        return np.sum([link.torque_body(state, values) for link, values in self._of(Dynamics)], axis=0)

    def gyroscope(self, omega_tracked: Array) -> Array:
        """What a gyroscope reads (n, 3) rad/s of angular velocities (n, 3) along its axes."""
        return reduce(lambda omega, hook: hook[0].read(omega, hook[1]), self._of(Gyroscope), omega_tracked)

    def tracked(self, x_world: Array, middle: Array, reach_m: float) -> Array:
        """Positions (n, 3) m that a tracker reports of points (n, 3) m, about the middle of its volume."""
        return reduce(lambda x, hook: hook[0].seen(x, middle, reach_m, hook[1]), self._of(Tracker), x_world)

    def lens(self, stated: Intrinsics) -> Intrinsics:
        """The true camera, at rest."""
        return reduce(lambda camera, hook: hook[0].change(camera, hook[1]), self._of(Lens), stated)

    def sway(self, stamps_s: Array) -> Sway:
        """How the picture moves at instants (n,) s counted from the first frame's time stamp."""
        parts = [link.sway(stamps_s, values) for link, values in self._of(PictureMotion)]
        scale = np.prod([np.ones(len(stamps_s)), *(part.scale for part in parts)], axis=0)
        return Sway(scale, np.sum([np.zeros((len(stamps_s), 2)), *(part.shift_px for part in parts)], axis=0))

    def camera_at(self, true: Intrinsics, stamp_s: float) -> Intrinsics:
        """The camera that shows the moving picture at one instant (s); ``true`` is the one at rest."""
        if not self.moving:
            return true
        sway = self.sway(np.array([stamp_s]))
        scale, (dx, dy) = float(sway.scale[0]), sway.shift_px[0].tolist()
        return replace(true, fx_px=true.fx_px * scale, fy_px=true.fy_px * scale, cx_px=true.cx_px + dx, cy_px=true.cy_px + dy)

    @property
    def moving(self) -> bool:
        """Whether the picture moves."""
        return bool(self._of(PictureMotion))

    @property
    def blurred(self) -> bool:
        """Whether an outline is that of a blurred picture."""
        return bool(self._of(Blur) or self._of(Threshold))

    def sigma_px(self, beyond_focus_m: Array) -> Array:
        """Standard deviation (px) of the blur at depths (n,) m beyond the focal plane."""
        squares = [link.sigma_px(beyond_focus_m, values) ** 2 for link, values in self._of(Blur)]
        return np.asarray(np.sqrt(np.sum([np.zeros(len(beyond_focus_m)), *squares], axis=0)))

    @property
    def level(self) -> float | None:
        """The level at which the outline of a whole exposure is drawn; ``None``: an outline is that of the exposure's middle."""
        levels = [link.level(values) for link, values in self._of(Threshold)]
        return levels[0] if levels else None

    @property
    def rolling(self) -> bool:
        """Whether rows are exposed one after the other."""
        return bool(self._of(RowClock))

    def row_delays_s(self, y_px: Array, camera: Intrinsics) -> Array:
        """When rows (n,) px are exposed, s, against the frame's time."""
        return np.sum([np.zeros(len(y_px)), *(link.delays_s(y_px, camera, values) for link, values in self._of(RowClock))], axis=0)

    @property
    def redraws_frames(self) -> bool:
        """Whether outlines of frames are drawn beside the silhouette."""
        return bool(self._of(Segmentation))

    @property
    def redraws_views(self) -> bool:
        """Whether outlines of calibrated views are drawn beside the silhouette."""
        return bool(self._of(ViewSegmentation))

    def segmented(self, outline_px: Array, camera: Intrinsics) -> Array:
        """The outline that is drawn in a frame."""
        return reduce(lambda outline, hook: hook[0].reshape(outline, camera, hook[1]), self._of(Segmentation), outline_px)

    def view_segmented(self, outline_px: Array, camera: Intrinsics) -> Array:
        """The outline that is drawn in a calibrated view."""
        return reduce(lambda outline, hook: hook[0].reshape(outline, camera, hook[1]), self._of(ViewSegmentation), outline_px)

    def _of(self, kind: type[Kind]) -> list[tuple[Kind, Values]]:
        return [(link, self.values[key]) for key, link in REALISATIONS.items() if key in self.values and isinstance(link, kind)]


def effects_in_force(effects: Sequence[EffectRecipe], index: int) -> EffectsInForce:
    """The effects of a recipe in sequence ``index``; those whose sizes are all 0 change nothing and are left out."""
    resolved = {effect.key: values_in_sequence(effect, index) for effect in effects}
    return EffectsInForce({key: values for key, values in resolved.items() if any(values[name] for name in KNOWN[key].sizes)})
