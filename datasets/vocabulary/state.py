"""The motion of a rigid body sampled at frame times; all vectors in the world frame, SI units."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray


@dataclass(frozen=True)
class Motion:
    """Positions of the centre of mass, orientations and velocities at ``times_s``.

    ``x_world`` m; ``q_world_body`` unit quaternions (x, y, z, w); ``v_world`` m/s; ``omega_world`` rad/s, world frame.
    """

    times_s: Float[NDArray[np.float64], " frame"]
    x_world: Float[NDArray[np.float64], "frame 3"]
    q_world_body: Float[NDArray[np.float64], "frame 4"]
    v_world: Float[NDArray[np.float64], "frame 3"]
    omega_world: Float[NDArray[np.float64], "frame 3"]
