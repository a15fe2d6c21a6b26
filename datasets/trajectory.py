"""A trajectory as a measurement: what somebody else has tracked of a particle, and what a gyroscope in it says."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.body import Body

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Surroundings:
    """What is known beside the numbers of a trajectory.

    ``gravity_world`` (3,) m/s². ``body``: where the centre of mass and the principal axes lie in the tracked frame, and the inertia ratios;
    ``sigma_x_m``, ``sigma_theta_rad``, ``sigma_omega_rads``, ``sigma_gyro_rads``: standard deviations of each coordinate where they are
    known; ``sigma_length_scale``: that of all lengths, relative, as a calibration states it. ``spin_world`` (3,) rad/s: an angular velocity
    that was measured once in the flight, and ``sigma_spin`` (3,) of it.
    ``world`` and ``tracked`` name the two frames, ``particle`` the body, which trajectories of one name share.
    """

    gravity_world: Array
    body: Body
    sigma_x_m: float | None = None
    sigma_theta_rad: float | None = None
    sigma_omega_rads: float | None = None
    sigma_gyro_rads: float | None = None
    sigma_length_scale: float | None = None
    spin_world: Array | None = None
    sigma_spin: Array | None = None
    world: str = "world"
    tracked: str = "tracked"
    particle: str = ""


@dataclass(frozen=True)
class Trajectory:
    """Measured motion of the tracked point and frame; a value that is NaN was not measured.

    ``times_s`` (n,) counted from the first row, strictly increasing; ``x_world`` (n, 3) m; ``q_world_tracked`` (n, 4) unit quaternions
    (x, y, z, w), ``omega_world`` (n, 3) rad/s, world frame, and ``gyro`` (n, 3) rad/s, the angular velocity along the tracked frame's axes,
    where they were measured. ``sigma_x``, ``sigma_theta``, ``sigma_omega``, ``sigma_gyro`` (n, 3) standard deviations of each coordinate,
    where they are known; a rotation's is that of its rotation vector, world frame. ``notes``: what its reader found odd.
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
    gyro: Array | None = None
    sigma_gyro: Array | None = None
    notes: tuple[str, ...] = ()

    @property
    def whole(self) -> bool:
        """Whether position and orientation were measured in every row."""
        q = self.q_world_tracked
        return q is not None and bool(np.isfinite(q).all() and np.isfinite(self.x_world).all())

    def between(self, first: int, last: int) -> "Trajectory":
        """The rows from number ``first`` to before ``last``; a spin that was measured once in the flight is that of their middle row."""

        def cut(of_rows: Array | None) -> Array | None:
            return None if of_rows is None else of_rows[first:last]

        def cut_once(of_rows: Array | None) -> Array | None:
            told = np.zeros(0, dtype=np.int64) if of_rows is None else np.flatnonzero(np.isfinite(of_rows).any(axis=1))
            if of_rows is None or len(told) != 1 or first <= told[0] < last:
                return cut(of_rows)
            kept = np.full((last - first, 3), np.nan)
            kept[len(kept) // 2] = of_rows[told[0]]
            return kept

        return replace(
            self,
            times_s=self.times_s[first:last],
            x_world=self.x_world[first:last],
            q_world_tracked=cut(self.q_world_tracked),
            omega_world=cut_once(self.omega_world),
            sigma_x=cut(self.sigma_x),
            sigma_theta=cut(self.sigma_theta),
            sigma_omega=cut_once(self.sigma_omega),
            gyro=cut(self.gyro),
            sigma_gyro=cut(self.sigma_gyro),
        )
