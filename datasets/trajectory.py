"""A trajectory as a measurement: poses, or positions with or without a measured spin, of a particle that somebody else has tracked."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.body import Body

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Surroundings:
    """What is known beside the numbers of a trajectory.

    ``gravity_world`` (3,) m/s². ``body``: where the centre of mass and the principal axes lie in the tracked frame, and the inertia ratios;
    ``sigma_x_m``, ``sigma_theta_rad``, ``sigma_omega_rads``: standard deviations of each coordinate where they are known.
    ``world`` and ``tracked`` name the two frames, ``particle`` the body, which trajectories of one name share.
    """

    gravity_world: Array
    body: Body
    sigma_x_m: float | None = None
    sigma_theta_rad: float | None = None
    sigma_omega_rads: float | None = None
    world: str = "world"
    tracked: str = "tracked"
    particle: str = ""


@dataclass(frozen=True)
class Trajectory:
    """Measured motion of the tracked point and frame.

    ``times_s`` (n,) counted from the first row, strictly increasing; ``x_world`` (n, 3) m; ``q_world_tracked`` (n, 4) unit quaternions
    (x, y, z, w) and ``omega_world`` (n, 3) rad/s, world frame, where they were measured. ``sigma_x``, ``sigma_theta``, ``sigma_omega``
    (n, 3) standard deviations of each coordinate, where they are known; a rotation's is that of its rotation vector, world frame.
    """

    name: str
    times_s: Array
    x_world: Array
    q_world_tracked: Array | None
    omega_world: Array | None
    sigma_x: Array | None
    sigma_theta: Array | None
    sigma_omega: Array | None
    surroundings: Surroundings
