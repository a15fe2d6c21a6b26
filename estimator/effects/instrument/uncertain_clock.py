"""A further camera's clock that is stated to be uncertain: its offset and its rate against the first one's in every recording.

Not an effect that is asked for but an unknown of the instrument, always in the model, with the stated standard deviations as its prior:
with stamp ``t`` a frame was taken at ``t + offset + rate (t - t_0)``, ``t_0`` the camera's first stamp, as in single estimates
(:mod:`estimator.motion.clocked`). Valid for a clock whose rate stays during a recording.
"""

from collections.abc import Iterable

import numpy as np

from datasets.vocabulary.clock import Clock
from datasets.vocabulary.effects import EffectEntry, Parameter, Scope, Stage, of_camera
from estimator.effects.instrument.surface_amplitudes import STEP, WIDEST
from estimator.effects.link import Array, EffectModel, Setting


class UncertainClock(EffectModel):
    """Offset (s) and rate of a camera's clock, those of both that are not known."""

    instrument = True

    def __init__(self, camera: str, offset_sigma_s: float, rate_sigma: float) -> None:
        told = (("offset", "s", offset_sigma_s, "later than stamped"), ("rate", "1", rate_sigma, "longer intervals, over stamped ones"))
        free = [each for each in told if each[2] > 0.0]
        self.camera = self.name = camera
        self.held: tuple[float, ...] = tuple(sigma for _, _, sigma, _ in free)
        self.entry = EffectEntry(
            of_camera("uncertain_clock", camera),
            Stage.CLOCK,
            Scope.RECORDING,
            tuple(Parameter(name, unit, (-WIDEST * s, WIDEST * s), STEP * s, meaning) for name, unit, s, meaning in free),
            "true time = stamp + offset + rate (stamp - first stamp)",
            "Triggs et al., Bundle adjustment, 2000, section 6",
        )

    def times(self, theta: Array, setting: Setting, times_s: Array) -> Array:
        """Times by the first camera's clock."""
        value = dict(zip(self.entry.names, theta, strict=True))
        return np.asarray(times_s + value.get("offset", 0.0) + value.get("rate", 0.0) * (times_s - setting.times_s[0]))


def uncertain_clocks(clocks: Iterable[tuple[str, Clock]]) -> tuple[UncertainClock, ...]:
    """Of every camera whose clock some recording states to be uncertain, by name: as uncertain as any states it."""
    sigmas: dict[str, tuple[float, float]] = {}
    for name, clock in clocks:
        if not clock.known:
            offset, rate = sigmas.get(name, (0.0, 0.0))
            sigmas[name] = (max(offset, clock.offset_sigma_s), max(rate, clock.rate_sigma))
    return tuple(UncertainClock(name, *each) for name, each in sigmas.items())
