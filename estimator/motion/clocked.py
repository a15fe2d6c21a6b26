"""A motion seen by cameras whose clocks are not known exactly: offset and rate of each such clock beside the motion's own parameters.

With stamp ``t`` a camera's frame was taken at ``t + offset + rate (t - t_0)`` by the first camera's clock, ``t_0`` its own first stamp.
A frame's pose moves with its time as the body does, so the derivative of a pose by either parameter is the pose's own rate times that
of the time. The rate of all clocks together is not seen (free flight knows no second but gravity's); that between two of them is.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Generic, TypeVar

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from datasets.vocabulary.effects import Scope
from estimator.motion.blocks import Block, Layout
from estimator.motion.flight import Flight, FlightPoses, Motion, poses_and_sensitivity, rates, still
from estimator.motion.rigid_body import States

Array = NDArray[np.float64]
M_co = TypeVar("M_co", bound=Motion, covariant=True)


@dataclass(frozen=True)
class CameraClock:
    """What is thought of the clock of camera number ``camera``: standard deviations of offset (s) and rate about zero, 0: known.

    ``first_s``: its first stamp, from which the rate counts.
    """

    camera: int
    name: str
    first_s: float
    offset_sigma_s: float
    rate_sigma: float

    @property
    def block(self) -> Block:
        """Its parameters: those of offset and rate that are not known."""
        told = [(OFFSET_S, self.offset_sigma_s), (RATE, self.rate_sigma)]
        free = [(named(self.name, label), sigma) for label, sigma in told if sigma > 0.0]
        return Block(named(self.name, "clock"), tuple(label for label, _ in free), 0.0, np.array([s**-2 for _, s in free]), Scope.CAMERA)

    def moves(self, camera: NDArray[np.int64], stamps_s: Array) -> Array:
        """By how much (n, c) times of frames ``stamps_s`` (n,) s move with each of its parameters; not those of another ``camera`` (n,)."""
        columns = [np.ones(len(stamps_s))] if self.offset_sigma_s > 0.0 else []
        columns += [stamps_s - self.first_s] if self.rate_sigma > 0.0 else []
        return np.where((camera == self.camera)[:, None], np.stack(columns, axis=1), 0.0)


OFFSET_S, RATE = "clock_offset_s", "clock_rate"


def named(camera: str, what: str) -> str:
    """The name of a parameter, or of the block, of a camera's clock."""
    return f"{camera}.{what}"


@dataclass(frozen=True)
class ClockedMotion(Generic[M_co]):
    """A ``motion`` and the ``offsets`` (k,) of the parameters of all ``clocks`` that are not known, in their order."""

    motion: M_co
    clocks: tuple[CameraClock, ...]
    offsets: Float[NDArray[np.float64], " k"]

    @property
    def first(self) -> Flight:
        """Of the motion."""
        return self.motion.first

    @cached_property
    def layout(self) -> Layout:
        """The motion's blocks and those of the clocks."""
        return Layout((*self.motion.layout.blocks, *(clock.block for clock in self.clocks)))

    @property
    def values(self) -> Array:
        """Parameters (p + k,)."""
        return np.concatenate([self.motion.values, self.offsets])

    def moved(self, step: Array) -> "ClockedMotion[M_co]":
        """After a parameter step (p + k,)."""
        own = self.motion.layout.size
        return replace(self, motion=self.motion.moved(step[:own]), offsets=self.offsets + step[own:])

    def with_first(self, first: Flight) -> "ClockedMotion[M_co]":
        """With another flight that begins it."""
        return replace(self, motion=self.motion.with_first(first))

    def states(self, steps: Array, times_s: Array) -> States:
        """Those of the motion; ``steps`` (m, p + k), ``times_s`` (f,) by the first camera's clock."""
        return self.motion.states(steps[:, : self.motion.layout.size], times_s)

    def time_moves(self, camera: NDArray[np.int64], stamps_s: Array) -> Array:
        """By how much (n, k) the times of frames ``stamps_s`` (n,) s of each ``camera`` (n,) move with each parameter of the clocks."""
        return np.concatenate([clock.moves(camera, stamps_s) for clock in self.clocks], axis=1)


def true_times(motion: Motion, camera: NDArray[np.int64], stamps_s: Float[NDArray[np.float64], " n"]) -> Float[NDArray[np.float64], " n"]:
    """Times (n,) s by the first camera's clock of frames ``stamps_s`` (n,) s of each ``camera`` (n,)."""
    if not isinstance(motion, ClockedMotion):
        return stamps_s
    return np.asarray(stamps_s + motion.time_moves(camera, stamps_s) @ motion.offsets)


def frames_and_sensitivity(
    motion: Motion, camera: NDArray[np.int64], stamps_s: Float[NDArray[np.float64], " n"]
) -> tuple[FlightPoses, Float[NDArray[np.float64], "n 6 p"]]:
    """Poses (m = 1) and their sensitivity (n, 6, p) in frames ``stamps_s`` (n,) s of each ``camera`` (n,).

    Those of :func:`estimator.motion.flight.poses_and_sensitivity`, of clocks that are not known too.
    """
    times = true_times(motion, camera, stamps_s)
    predicted, sensitivity = poses_and_sensitivity(motion, times)
    if isinstance(motion, ClockedMotion):
        by_time = _pose_rates(motion, predicted, times)[:, :, None] * motion.time_moves(camera, stamps_s)[:, None, :]
        sensitivity[:, :, motion.motion.layout.size :] = by_time
    return predicted, sensitivity


def _pose_rates(motion: Motion, predicted: FlightPoses, times_s: Array) -> Array:
    """How fast (n, 6) the nominal body moves (m/s) and turns (rad/s, left rotation vector), world frame, at times (n,) s."""
    velocity, omega = np.split(rates(motion, still(motion), times_s)[:, 0], 2, axis=1)
    lever = predicted.centre[:, 0] - motion.states(still(motion), times_s).x[:, 0]
    return np.concatenate([velocity + np.cross(omega, lever), omega], axis=1)
