"""The protocol of an effect: the links of the forward chain that it may touch.

``times, delays -> body -> air -> acceleration, torque -> scale -> (poses) -> correct -> (tangency errors) -> shift``; of trajectories,
whose rows know no pictures, ``... -> scale -> tracked`` (positions) and ``... -> torque -> reading`` (a gyroscope's).
An effect overrides the link it belongs to (a rolling shutter two: it delays outlines, and shears them); every other link is the identity.
Parameters come as an array in the order of the effect's entry in the catalogue; derivatives are central differences of the link alone, in
steps of the entry, so a plug-in needs none.
"""

from collections.abc import Callable, Mapping
from copy import copy
from dataclasses import dataclass, field, replace
from functools import cached_property
from types import MethodType
from typing import Any, ClassVar, Self

import numba
import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.camera import Intrinsics
from datasets.vocabulary.clock import Clock
from datasets.vocabulary.effects import EffectEntry, of_camera
from estimator.data.seen_by import SeenBy

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Setting:
    """What is known of a sequence beside its pictures.

    ``times_s`` (f,) time stamps of the frames, ``exposure_s``, ``gravity_world`` (3,) m/s², ``inertia_ratios`` (3,) of the nominal body;
    ``edge_px`` the standard deviation of the blur that edges at rest have in its pictures, (n,) of n sightings or one for all: a particle
    that comes nearer is seen less sharply; 0 where outlines are given as such. Of trajectories: ``middle_world`` (3,) m of all positions of
    the campaign and ``reach_m``, the root mean square of their distances from it. Of outlines sample by sample: ``mass`` (8, 1 + m), mass
    properties of the particle's surface and their derivatives by its amplitudes, nominal body axes. ``clocks`` of further
    cameras, by their names, where they are not the first one's. Of trajectories: ``scatter_s`` (f,), by how much later than its stamp each
    frame was if all of the campaign were taken at even times; ``misread``: whether the spin that was read once is that of another flight.
    """

    times_s: Array
    exposure_s: float
    gravity_world: Array
    inertia_ratios: Array
    edge_px: Array | float = 0.0
    middle_world: Array | float = 0.0
    reach_m: float = 1.0
    mass: Array | None = None
    clocks: Mapping[str, Clock] = field(default_factory=dict)
    scatter_s: Array | None = None
    misread: bool = False

    def of_clock(self, camera: str | None) -> "Setting":
        """The same by the stamps of a camera's own clock."""
        clock = None if camera is None else self.clocks.get(camera)
        return self if clock is None else replace(self, times_s=clock.times_s)

    def take(self, rows: NDArray[np.int64]) -> "Setting":
        """The same of the sightings ``rows`` (k,) alone."""
        return self if np.ndim(self.edge_px) == 0 else replace(self, edge_px=np.asarray(self.edge_px)[rows])

    def since_start(self, seen: SeenBy, times_s: Array) -> Array:
        """Stamps (n,) s of n sightings counted from the first frame of the camera that shows each."""
        first = [float(self.of_clock(camera.name).times_s[0]) for camera in seen.cameras]
        return np.asarray(times_s - np.array(first)[seen.number])

    def exposures_s(self, seen: SeenBy) -> Array:
        """How long each of n sightings was exposed (n,) s."""
        each = [self.clocks[c.name].exposure_s if c.name in self.clocks else self.exposure_s for c in seen.cameras]
        return np.array(each)[seen.number]

    @cached_property
    def interval_s(self) -> float:
        """The nominal time from one frame to the next (s)."""
        return float(np.median(np.diff(self.times_s)))


@dataclass(frozen=True)
class Moment:
    """m flights at one instant, world frame.

    ``x`` (m, 3) m, ``v`` (m, 3) m/s, ``omega`` (m, 3) rad/s, ``L`` (m, 3) rad/s per largest moment, ``R`` (m, 3, 3) world from nominal body
    axes, ``time_s`` since the first frame; ``air`` (m, 3) m/s the velocity of the air, ``None`` where it is still; ``lift`` (m, 3) m/s² the
    acceleration by all effects that lift, ``None`` where there is none.
    """

    time_s: float
    x: Array
    v: Array
    omega: Array
    L: Array
    R: Array
    air: Array | None = None
    lift: Array | None = None

    @property
    def through_air(self) -> Array:
        """Velocity (m, 3) m/s against the air."""
        return self.v if self.air is None else self.v - self.air


@dataclass(frozen=True)
class BodyChange:
    """Displacement ``com`` (3,) m of the centre of mass in nominal body axes, and ``inertia`` (5,) as in :mod:`estimator.motion.flight`."""

    com: Array
    inertia: Array


@dataclass(frozen=True, eq=False)
class Moving:
    """The body in n sightings, camera axes: where it is, how it moves, and which of its points an outline shows.

    ``furthest``: points (..., 3) m that lie furthest along normals (..., 3), body axes about the centre of mass; ``R_cam_body`` (n, 3, 3),
    ``centre_cam`` (n, 3) m, ``v_cam`` (n, 3) m/s, ``omega_cam`` (n, 3) rad/s.
    """

    furthest: Callable[[Array], Array]
    R_cam_body: Array
    centre_cam: Array
    v_cam: Array
    omega_cam: Array

    def arms(self, normals_body: Array) -> Array:
        """From the centre to the points (n, ..., 3) m of the outline whose outward normals are ``normals_body`` (n, ..., 3)."""
        found = self.furthest(normals_body)
        return np.asarray((found.reshape(len(found), -1, 3) @ self.R_cam_body.transpose(0, 2, 1)).reshape(found.shape))

    def arms_towards(self, u: Array) -> Array:
        """From the centre to the points (n, a, 3) m of the outline that lie furthest along directions ``u`` (a, 2) in the picture."""
        return self.arms(u @ self.R_cam_body[:, :2])

    def velocity_px(self, arms: Array, focal_px: Array) -> Array:
        """Velocity (n, ..., 2) px/s of the body's points at the ends of ``arms`` (n, ..., 3) m, camera axes, in the picture.

        ``focal_px`` (n, 2) or (2,): the camera's focal lengths.
        """
        n = len(arms)
        flat = np.ascontiguousarray(arms).reshape(n, -1, 3)
        found = _velocities_px(flat, self.centre_cam, self.v_cam, self.omega_cam, np.ascontiguousarray(np.broadcast_to(focal_px, (n, 2))))
        return np.asarray(found.reshape(*arms.shape[:-1], 2))


@numba.njit(cache=True, error_model="numpy")
def _velocities_px(arms, centre, v, omega, focal):  # type: ignore[no-untyped-def]
    """``v + omega x arm`` (n, m, 2) px/s in the picture, of the ends of ``arms`` (n, m, 3) m from ``centre`` (n, 3) m."""
    found = np.empty((*arms.shape[:2], 2))
    for i in range(len(arms)):
        wx, wy, wz = omega[i]
        for j in range(arms.shape[1]):
            x, y, z = arms[i, j]
            vx, vy, vz = v[i, 0] + (wy * z - wz * y), v[i, 1] + (wz * x - wx * z), v[i, 2] + (wx * y - wy * x)
            depth = centre[i, 2] + z
            found[i, j, 0] = focal[i, 0] * (vx - (centre[i, 0] + x) / depth * vz) / depth
            found[i, j, 1] = focal[i, 1] * (vy - (centre[i, 1] + y) / depth * vz) / depth
    return found


@dataclass(frozen=True, eq=False)
class Places:
    """Where on the picture and on the outline the tangencies lie: n sightings, k views, two tangencies each.

    ``point_px`` (n, k, 2, 2), ``normal`` (n, k, 2, 2) outward unit normals and ``normal_body``
    (n, k, 2, 3) those of the tangent planes in body axes, ``velocity_px`` (n, k, 2, 2) px/s of the body's point there,
    ``radius_px`` (n, k, 2) radius of curvature of the outline, ``mean_radius_px`` (n,) its mean over directions,
    ``sharpness`` (n, k, 2) px⁻¹ recession of the tangents under a blur of a pixel over its square, ``recession`` (n, k, 2, S) of
    tangents as seen under a blur over the blur, at the tabled blurs, ``erosion`` (n, k, 2, D) that of an inner parallel curve over its
    depth, ``dilation`` (n, k, 2, D) the advance of that of an outer one, ``leak`` (n, k, 2, D) the recession under a leak of light over
    its loss, all three at the tabled depths, ``smear``
    (n, k, 2, L) px that of a picture smeared during its exposure beyond what the tangent's own movement says, at the tabled levels;
    ``outline_px`` (n, a, 2) the points of the outline that lie furthest along ``outward`` (a, 2), ``rows_px`` (n,) the middle of its rows
    below the camera's middle row; ``depth_m`` (n,) of the particle, ``first_depth_m`` (n,) in its camera's first frame; ``view_ratio``
    (n, k, 2) px of error per px of a view's outline; ``seen`` by which camera, ``times_s`` (n,) since its first frame; ``moving`` the
    body's movement.
    """

    point_px: Array
    normal: Array
    normal_body: Array
    velocity_px: Array
    radius_px: Array
    mean_radius_px: Array
    sharpness: Array
    recession: Array
    erosion: Array
    dilation: Array
    leak: Array
    smear: Array
    outline_px: Array
    outward: Array
    rows_px: Array
    depth_m: Array
    first_depth_m: Array
    view_ratio: Array
    seen: SeenBy
    times_s: Array
    moving: Moving

    def only(self, effect: "EffectModel", displacement: Array | None) -> Array | None:
        """What an effect displaces, ``displacement`` (n, ...) px: nothing in the pictures of other cameras than its own."""
        return None if displacement is None else self.seen.only(effect.camera, displacement)

    @cached_property
    def outline_velocity_px(self) -> Array:
        """Velocity (n, a, 2) px/s in the picture of the body's points at the outline's."""
        moving, focal, middle = self.moving, self.seen.focal_px, self.seen.principal_px
        depth = moving.centre_cam[:, None, 2:] + moving.arms_towards(self.outward)[..., 2:]
        place = np.concatenate([(self.outline_px - middle[:, None]) / focal[:, None] * depth, depth], axis=-1)
        return moving.velocity_px(place - moving.centre_cam[:, None], focal)


LEAST_COUNT = 0.4
"""Less than a half, since a linear step falls short of the number it steps to (notebook 37)."""
NEARLY_WHOLE = 0.25
"""A fitted count this near a whole number is that; one further off is reported as it is, for it counts nothing (notebook 18)."""


TAILS = 3.0
"""Degrees of freedom of Student's prior of values of which a few sequences' may stand out by far (decision 47)."""


HOLLOW_THROUGHOUT = 0.05
"""Share of outlines' convex hulls that is empty, from which on a body counts as one with hollows throughout."""


class EffectModel:
    """An effect as the estimator sees it: an entry of the catalogue and the link it touches.

    Instances are not changed once made: another prior or another range is another instance. Throughout, ``theta`` (q,) holds the effect's
    parameters and ``variance`` (q,) theirs.
    """

    entry: EffectEntry
    held: tuple[float, ...] | None = None
    """Standard deviations of a normal prior about zero, one for each parameter; ``None``: free."""
    tails: bool = False
    """Whether that prior has tails: Student's, of ``freedom``, for values of every sequence of which a few stand out."""
    freedom: float = TAILS
    """Degrees of freedom of Student's prior of values of every sequence: the fewer, the more of them may stand out, and the further."""
    camera: str | None = None
    """Name of the only high-speed camera that has the effect; ``None``: it is of no camera, or alike in all."""
    instrument: ClassVar[bool] = False
    """Whether the effect is the instrument's own known discrepancy: part of every model, and never part of an answer."""

    def starts(self, setting: Setting) -> Array:
        """Parameters (s, q) at which a search begins, every amplitude at zero: more than one where a parameter is searched for."""
        del setting
        return np.zeros((1, len(self.entry.parameters)))

    def held_by(self, sigma: tuple[float, ...] | None, *, tails: bool = False) -> Self:
        """The same effect under a prior about zero of standard deviations ``sigma`` (q,), perhaps with ``tails``; ``None``: free."""
        return self._changed(held=sigma, tails=tails)

    def as_noise(self, freedom: float) -> Self:
        """The same effect as noise of what was measured; ``freedom``: of the prior of its values of every sequence."""
        return self._changed(noise=True, freedom=freedom)

    def within(self, plausible: tuple[float, float]) -> Self:
        """The same effect, all of whose parameters may have values within another plausible range."""
        parameters = tuple(replace(parameter, plausible=plausible) for parameter in self.entry.parameters)
        return self._changed(entry=replace(self.entry, parameters=parameters))

    def of_camera(self, name: str) -> Self:
        """The same effect in one high-speed camera alone, with the key that says so."""
        return self._changed(entry=replace(self.entry, key=of_camera(self.entry.key, name)), camera=name)

    def touches(self, link: str) -> bool:
        """Whether the effect acts at a link: whether its class overrides it."""
        return getattr(type(self), link) is not getattr(EffectModel, link)

    def _changed(self, **values: Any) -> Self:
        """A copy with other values; methods that are bound to this instance are bound to the copy."""
        same = copy(self)
        bound = {key: value.__func__ for key, value in vars(self).items() if isinstance(value, MethodType) and value.__self__ is self}
        vars(same).update(values, **{key: MethodType(function, same) for key, function in bound.items()})
        return same

    def silent(self, theta: Array) -> NDArray[np.bool_]:
        """Parameters (q,) without an effect: those that are searched for, a frequency or a place, while every amplitude is zero."""
        sized = np.array([name in self.entry.sizes for name in self.entry.names])
        return np.asarray(~sized & (not theta[sized].any()))

    constant: ClassVar[bool] = False
    """Whether it is a force that is the same at every moment of a flight."""
    noise: bool = False
    """Whether it is noise of what was measured: where effects are searched for (``explain``) it is in every set in which it does something,
    as large as the evidence has it, and in no answer."""
    lifts: ClassVar[bool] = False
    """Whether its acceleration is a lift, across the velocity through the air."""
    of_lift: ClassVar[bool] = False
    """Whether its acceleration goes with the lift of others, and is none without."""
    of_unmeasured_spin: ClassVar[bool] = False
    """Whether the effect stands for a spin that was not measured throughout."""
    of_misread_spin: ClassVar[bool] = False
    """Whether it stands for no more than what a spin that was read once in a flight is wrong by."""
    frozen: tuple[str, ...] = ()
    """Parameters that a search finds and a fit leaves as they are."""
    whole: ClassVar[tuple[str, ...]] = ()
    """Parameters that count something: where a test finds all of them below ``LEAST_COUNT``, it found nothing."""
    accuracy: ClassVar[float] = 0.0
    """How far the reduced model's sizes are off nature's: a standard deviation as a share of the size, beside that of noise. Bounded by
    the share of an effect that its model leaves on bodies with corners, ``tests/agreement/test_corners.py``."""
    further_off: ClassVar[float] = 1.0
    """How many times further than their covariance says its parameters move whatever is fitted beside them."""
    accuracy_at_spikes: ClassVar[float] = 0.0
    """What is added in squares on bodies with hollows, whose corners a carved hull shows in part
    (``scripts/trials/study_sizes_at_spikes.py``)."""
    contains: ClassVar[tuple[str, ...]] = ()
    """Keys of effects of fewer parameters that this one can be, too: where they explain as much, they are what is there."""
    random: bool = False
    """Whether the effect is drawn anew in every frame: its one parameter is a standard deviation, known to the fit as variance."""

    def slope_at(self, theta: Array) -> Array:
        """Where derivatives of the image links are taken: elsewhere than at ``theta`` only for an effect that is flat at zero."""
        return theta

    def first_guess(self, theta: Array) -> Array:
        """Where a fit starts, given the values of one linear step."""
        return theta

    def accuracy_on(self, hollow: float) -> float:
        """The accuracy on bodies of whose outlines' convex hulls the share ``hollow`` is empty."""
        return float(np.hypot(self.accuracy, self.accuracy_at_spikes * min(hollow / HOLLOW_THROUGHOUT, 1.0)))

    def reported(self, theta: Array, variance: Array, hollow: float = 0.0) -> tuple[Array, Array]:
        """Values and standard deviations (q,) to report of fitted ones: counts as the whole number they are near, accuracy included."""
        counts = np.array([name in self.whole for name in self.entry.names])
        near = np.abs(theta - np.round(theta)) < NEARLY_WHOLE
        sized = np.array([name in self.entry.sizes for name in self.entry.names])
        off = np.where(sized & ~counts, self.accuracy_on(hollow) * theta, 0.0)
        return np.where(counts & near, np.round(theta), theta), np.sqrt(np.maximum(variance, 0.0) + off**2)

    def times(self, theta: Array, setting: Setting, times_s: Array) -> Array:
        """True times (f,) s of frames whose nominal times are ``times_s`` (f,) s."""
        del theta, setting
        return times_s

    def delays(self, theta: Array, rows_px: Array) -> Array | None:
        """How much later (n,) s than its stamp an outline is seen whose middle is ``rows_px`` (n,) below the middle row; ``None``: not."""
        del theta, rows_px
        return None

    def body(self, theta: Array, setting: Setting) -> BodyChange:
        """What the effect does to the body."""
        del theta, setting
        return BodyChange(np.zeros(3), np.zeros(5))

    def body_by(self, theta: Array, setting: Setting) -> Array:
        """Derivatives (8, q) of centre of mass (m) and inertia by the parameters, central differences."""
        return self._by_differences(lambda at: np.concatenate([(of := self.body(at, setting)).com, of.inertia]), theta)

    def acceleration(self, theta: Array, moment: Moment, setting: Setting) -> Array | None:
        """Acceleration (m, 3) m/s² beside gravity, ``theta`` (m, q); ``None``: none."""
        del theta, moment, setting
        return None

    def torque(self, theta: Array, moment: Moment, setting: Setting) -> Array | None:
        """Torque per largest moment (m, 3) rad/s²; ``theta`` (m, q); ``None``: none."""
        del theta, moment, setting
        return None

    def air(self, theta: Array) -> Array | None:
        """Velocity of the air (m, 3) m/s, world frame, for drag and lift; ``theta`` (m, q); ``None``: still."""
        del theta
        return None

    def scale(self, theta: Array) -> float:
        """Size of the particle in flight over its size in the calibrated views."""
        del theta
        return 1.0

    def tracked(self, theta: Array, x: Array, setting: Setting) -> Array:
        """Where a tracker sees points that are at ``x`` (n, 3) m, world frame."""
        del theta, setting
        return x

    def tracked_by(self, theta: Array, x: Array, setting: Setting) -> Array:
        """Derivatives (n, 3, q) m of :meth:`tracked` at ``x`` (n, 3) m, world frame, by the parameters, central differences."""
        return self._by_differences(lambda at: self.tracked(at, x, setting), theta)

    def reading(self, theta: Array, omega: Array) -> Array:
        """What a gyroscope reads (n, 3) rad/s of angular velocities ``omega`` (n, 3) rad/s along its axes."""
        del theta
        return omega

    def _by_differences(self, says: Callable[[Array], Array], theta: Array) -> Array:
        """Derivatives (..., q) of what an effect ``says`` at parameters, about ``theta`` (q,)."""
        steps = np.diag([p.step for p in self.entry.parameters])
        return np.stack([(says(theta + d) - says(theta - d)) / (2.0 * d.sum()) for d in steps], axis=-1)

    def correct(self, theta: Array, points_px: Array, camera: Intrinsics, times_s: Array) -> Array:
        """Where ``points_px`` (v, 2) seen at ``times_s`` (v,) would be in a camera without the effect."""
        del theta, camera, times_s
        return points_px

    def picture_moves(self, theta: Array, times_s: Array) -> Array | None:
        """How far (n, 2) px pictures at ``times_s`` (n,) are moved as a whole, by an effect that does no more; ``None``: it does."""
        del theta, times_s
        return None

    def shift(self, theta: Array, places: Places, setting: Setting) -> Array | None:
        """Displacement of the outline along its outward normals (n, k, 2) px; ``None``: none."""
        del theta, places, setting
        return None

    def displaced(self, theta: Array, places: Places, setting: Setting) -> Array | None:
        """Displacement of the outline's own points along their outward normals (n, k, 1) px; ``None``: none.

        That of its tangents, unless an effect knows better: a tangent touches another point once the outline is displaced.
        """
        return self.shift(theta, places, setting)
