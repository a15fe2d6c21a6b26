"""A flight in legs, one from each contact to the next, told as the motion of one body frame.

During a contact (microseconds) the leg before goes on to its middle, and the leg after begins there: positions jump by less than the
overlap. A leg may be that of a part of the body (after it broke); its motion is told as that of the whole body's frame, carried along.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from datasets.vocabulary.body import Body
from datasets.vocabulary.state import Motion
from synth.motion.free_flight import FreeFlight
from synth.motion.pushed_flight import PushedFlight

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Leg:
    """``flight`` of a body with axes and centre of ``body``, valid from ``begins_s``; its own time zero is ``zero_s`` of the whole."""

    begins_s: float
    zero_s: float
    flight: FreeFlight | PushedFlight
    body: Body


@dataclass(frozen=True)
class PiecewiseFlight:
    """``legs`` in order; the first is valid from any earlier time. ``whole``: the body in whose frame the motion is told."""

    legs: tuple[Leg, ...]
    whole: Body

    def at(self, times_s: Float[NDArray[np.float64], " n"]) -> Motion:
        """The motion at ``times_s`` (s).

        Raises
        ------
        ValueError
            Where a time lies outside the span that was integrated.
        """
        t = np.asarray(times_s, dtype=np.float64)
        number = np.searchsorted([leg.begins_s for leg in self.legs[1:]], t, side="right")
        found = Motion(t, np.empty((len(t), 3)), np.empty((len(t), 4)), np.empty((len(t), 3)), np.empty((len(t), 3)))
        for k, leg in enumerate(self.legs):
            mine = number == k
            if not mine.any():
                continue
            part = _carried(leg.flight.at(t[mine] - leg.zero_s), leg.body, self.whole)
            found.x_world[mine], found.q_world_body[mine] = part.x_world, part.q_world_body
            found.v_world[mine], found.omega_world[mine] = part.v_world, part.omega_world
        return found


def _carried(motion: Motion, part: Body, whole: Body) -> Motion:
    """The motion of the frame of ``whole`` that moves rigidly with ``part``."""
    if part is whole:
        return motion
    to_world = Rotation.from_quat(motion.q_world_body) * Rotation.from_matrix(part.R_particle_body.T)
    arm = to_world.apply(whole.com_particle - part.com_particle)
    q = (to_world * Rotation.from_matrix(whole.R_particle_body)).as_quat()
    v = motion.v_world + np.cross(motion.omega_world, arm)
    return Motion(motion.times_s, motion.x_world + arm, q, v, motion.omega_world)
