"""What an instrument says about one sequence: values, covariance, status, statistics, versions."""

from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.body import Body
from datasets.vocabulary.state import Motion
from datasets.vocabulary.surface_mesh import SurfaceMesh

Array = NDArray[np.float64]


class Status(StrEnum):
    """How a fit ended. Only ``CONVERGED`` is a measurement to rely on."""

    CONVERGED = "converged"
    AMBIGUOUS = "ambiguous"
    NOT_ENOUGH_FRAMES = "not enough frames"
    OUT_OF_VIEW = "out of view"
    NO_CONVERGENCE = "no convergence"
    IMPACT_AT_EDGE = "impact at the edge"
    SECOND_CONTACT = "second contact"
    RESTING = "resting or rolling"
    BROKEN = "broken"


@dataclass(frozen=True)
class FrameReport:
    """What became of one picture: used or not, its ETE (RMS, px in the HSV image; NaN where there is none) and whitened RMS.

    ``reason``: why it is left out or used in part; empty where it is used whole.
    """

    camera: int
    frame: int
    used: bool
    reason: str
    rms_ete_px: float
    rms_whitened: float


@dataclass(frozen=True)
class VelocityEstimate:
    """Velocities at one instant with their covariance.

    ``v_world`` (3,) m/s, ``omega_world`` (3,) rad/s (world frame); ``covariance`` and ``bound`` (6, 6) of (v, omega):
    the covariance reported and the instrument's own bound, the inverse information of what it fits. The true body's is the truth's.
    """

    time_s: float
    v_world: Array
    omega_world: Array
    covariance: Array
    bound: Array


@dataclass(frozen=True)
class SegmentEstimate:
    """A free flight between impacts, from ``start_s`` to ``end_s``, and the ``velocity`` at its middle."""

    start_s: float
    end_s: float
    velocity: VelocityEstimate


@dataclass(frozen=True)
class PlateGap:
    """Signed gap (m) between the particle's hull and the stated plate at an impact, its standard deviation, and whether they agree.

    ``deepest_m``: the lowest point of the hull over the plate in any frame, negative where it would be inside the plate.
    """

    gap_m: float
    sigma_m: float
    deepest_m: float
    agrees: bool


@dataclass(frozen=True)
class ImpactEstimate:
    """An impact at ``time_s`` (continuous, ``time_sigma_s``) with the one pose at it: ``x_world`` (3,) m, ``q_world_body`` (4,).

    ``before`` and ``after``: velocities right before and after. ``covariance`` (18, 18) of position (m), rotation (vector in the world
    frame, rad), v and omega before, v and omega after. ``plate``: what a stated plate says to it.
    """

    time_s: float
    time_sigma_s: float
    x_world: Array
    q_world_body: Array
    before: VelocityEstimate
    after: VelocityEstimate
    covariance: Array
    plate: PlateGap | None = None


@dataclass(frozen=True)
class Measured:
    """A number and its standard deviation, in one unit."""

    value: float
    sigma: float


@dataclass(frozen=True)
class CollisionEstimate:
    """What a collision of two particles was, from their motions and hulls at the one pose that each has at the impact.

    ``time_s`` (continuous, shared by both). ``point_world`` (3,) m and ``normal_world`` (3,), unit, into the first particle, with
    ``normal_sigma_rad`` about each of two axes: where the two hulls are nearest. ``gap_m``: between the hulls where the motions alone put
    them, negative where they overlap. Relative velocity of first against second at the point, along the normal: ``approach_ms`` (negative)
    and ``separation_ms``; ``restitution`` is minus their ratio. ``impulse_per_mass`` (3,) m/s: the impulse on the first over its mass;
    ``impulse_ratio``: its tangential over its normal part.

    ``mass_ratio``: first over second, by ``mass_source``: ``"weighed"``, or ``"volumes"`` of the hulls at equal density.
    ``momentum_mass_ratio`` is what the two jumps of velocity make of it. ``momentum_change_ms`` (3,) m/s with ``momentum_sigma_ms`` (3,):
    the pair's change of momentum over the second mass, gravity aside, and ``momentum_kept``: whether it is nought within its uncertainty.
    """

    time_s: float
    time_sigma_s: float
    point_world: Array
    normal_world: Array
    normal_sigma_rad: float
    gap_m: Measured
    approach_ms: Measured
    separation_ms: Measured
    restitution: Measured
    impulse_per_mass: Array
    impulse_ratio: Measured
    mass_ratio: Measured
    mass_source: str
    momentum_mass_ratio: Measured
    momentum_change_ms: Array
    momentum_sigma_ms: Array
    momentum_kept: bool


@dataclass(frozen=True)
class Estimate:
    """The result for one sequence.

    ``start`` and ``middle`` are the velocities at the first and at the middle time of the sequence.
    ``parameters`` names the rows of ``values`` (p,), ``covariance`` and ``bound`` (p, p).
    Everything that is a measurement is ``None`` when ``status`` says that there is none.
    ``segments`` and ``impacts``, in order of time, only where the motion has impacts. ``companion``: the same of a second particle in the
    pictures; ``collision``: that of the two, of which ``impacts`` are then the two sides. ``surface``: the particle's, where the fit
    found it.
    """

    name: str
    status: Status
    message: str
    body: Body | None = None
    motion: Motion | None = None
    start: VelocityEstimate | None = None
    middle: VelocityEstimate | None = None
    parameters: tuple[str, ...] = ()
    values: Array = field(default_factory=lambda: np.zeros(0))
    covariance: Array = field(default_factory=lambda: np.zeros((0, 0)))
    bound: Array = field(default_factory=lambda: np.zeros((0, 0)))
    frames: tuple[FrameReport, ...] = ()
    statistics: dict[str, Any] = field(default_factory=dict)
    configuration: dict[str, Any] = field(default_factory=dict)
    versions: dict[str, str] = field(default_factory=dict)
    segments: tuple[SegmentEstimate, ...] = ()
    impacts: tuple[ImpactEstimate, ...] = ()
    companion: "Estimate | None" = None
    collision: CollisionEstimate | None = None
    surface: SurfaceMesh | None = None
