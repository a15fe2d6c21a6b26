"""The links of the chain from motion to outline, and the form in which an effect hooks into each.

``values`` are an effect's parameters by name, in the catalogue's units. An effect hooks into one link only; what it does there is a pure
function, and the order of evaluation is that of the stages and, within one, of the catalogue.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from datasets.vocabulary.body import Body
from datasets.vocabulary.camera import Intrinsics

Array = NDArray[np.float64]
Values = Mapping[str, float]


@dataclass(frozen=True)
class FlyingBody:
    """The body that flies: ``vertices`` (v, 3) m and ``body`` in the particle frame, mass, principal moments ``inertia_kgm2`` (3,).

    ``uniform_kgm2`` (3,): those of the uniform body, where an effect has changed them.
    """

    vertices: Float[NDArray[np.float64], "v 3"]
    body: Body
    mass_kg: float
    inertia_kgm2: Float[NDArray[np.float64], "3"]
    uniform_kgm2: Float[NDArray[np.float64], "3"] | None = None


@dataclass(frozen=True)
class FlightState:
    """A body at one instant: ``x_world`` m, ``v_world`` m/s, ``R_world_body``, ``omega_body`` rad/s (body frame).

    ``ratios`` (3,) are its principal moments over the largest, ``mass_over_moment`` (1/m²) its mass over the largest moment;
    ``lift_world`` m/s² the acceleration by lift, ``None`` where there is none.
    """

    time_s: float
    x_world: Float[NDArray[np.float64], "3"]
    v_world: Float[NDArray[np.float64], "3"]
    R_world_body: Float[NDArray[np.float64], "3 3"]
    omega_body: Float[NDArray[np.float64], "3"]
    ratios: Float[NDArray[np.float64], "3"]
    mass_over_moment: float
    air_world: Float[NDArray[np.float64], "3"] | None = None
    lift_world: Float[NDArray[np.float64], "3"] | None = None

    @property
    def through_air(self) -> Float[NDArray[np.float64], "3"]:
        """Velocity (m/s) against the air, world frame; ``air_world`` is that of the air, ``None`` where it is still."""
        return self.v_world if self.air_world is None else np.asarray(self.v_world - self.air_world)

    @property
    def omega_world(self) -> Float[NDArray[np.float64], "3"]:
        """Angular velocity (rad/s), world frame."""
        return np.asarray(self.R_world_body @ self.omega_body)


@dataclass(frozen=True)
class Sway:
    """How the picture moves at given instants: it grows by ``scale`` (n,) about the principal point, then moves by ``shift_px`` (n, 2)."""

    scale: Float[NDArray[np.float64], " n"]
    shift_px: Float[NDArray[np.float64], "n 2"]


@dataclass(frozen=True)
class Clockwork:
    """True times (frame,) s from time stamps (frame,) s or from the times that an earlier effect made of them."""

    true_times: Callable[[Array, Values, np.random.Generator], Array]


@dataclass(frozen=True)
class BodyChange:
    """The body that flies from the one that the calibrated views show."""

    change: Callable[[FlyingBody, Values], FlyingBody]


def no_torque(_state: FlightState, _values: Values) -> Array:
    """No torque."""
    return np.zeros(3)


@dataclass(frozen=True)
class Dynamics:
    """Acceleration (3,) m/s² in the world frame; torque over the largest principal moment (3,) rad/s² in the body frame.

    ``lifts``: whether the acceleration is a lift.
    """

    acceleration: Callable[[FlightState, Values], Array]
    torque_body: Callable[[FlightState, Values], Array] = no_torque
    lifts: bool = False


@dataclass(frozen=True)
class Wind:
    """Velocity of the air (3,) m/s, world frame."""

    velocity: Callable[[Values], Array]


@dataclass(frozen=True)
class Gyroscope:
    """What a gyroscope reads (n, 3) rad/s of angular velocities (n, 3) along its axes."""

    read: Callable[[Array, Values], Array]


@dataclass(frozen=True)
class Tracker:
    """Positions (n, 3) m that a tracker reports of points at (n, 3) m, about the middle (3,) m of a volume of a size in m."""

    seen: Callable[[Array, Array, float, Values], Array]


@dataclass(frozen=True)
class Lens:
    """The true camera from the stated one."""

    change: Callable[[Intrinsics, Values], Intrinsics]


@dataclass(frozen=True)
class PictureMotion:
    """Motion of the picture at instants (n,) s counted from the first frame's time stamp."""

    sway: Callable[[Array, Values], Sway]


@dataclass(frozen=True)
class Blur:
    """Standard deviation (px) of a Gaussian blur at depths (n,) m beyond the focal plane."""

    sigma_px: Callable[[Array, Values], Array]


@dataclass(frozen=True)
class Threshold:
    """The level of darkness, between 0 and 1, at which the outline of a picture taken over the whole exposure is drawn."""

    level: Callable[[Values], float]


@dataclass(frozen=True)
class RowClock:
    """When the pixel rows ``y_px`` (n,) of a picture are exposed (s), against the frame's time."""

    delays_s: Callable[[Array, Intrinsics, Values], Array]


@dataclass(frozen=True)
class Segmentation:
    """The outline (n, 2) px that is drawn in a frame from that of the silhouette."""

    reshape: Callable[[Array, Intrinsics, Values], Array]


@dataclass(frozen=True)
class ViewSegmentation:
    """The same in the calibrated views."""

    reshape: Callable[[Array, Intrinsics, Values], Array]


Link = (
    Clockwork
    | BodyChange
    | Dynamics
    | Wind
    | Lens
    | PictureMotion
    | Blur
    | Threshold
    | RowClock
    | Segmentation
    | ViewSegmentation
    | Gyroscope
    | Tracker
)
