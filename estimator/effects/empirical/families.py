"""Empirical terms: wide families of smooth misfit, one for each stage, that say where an unknown effect sits and what shape it has.

They are not effects of nature. They compete with the effects of the catalogue for a place in the model, one at a time
(:mod:`estimator.diagnosis.selection`); one that is in the most probable set names the stage. ``P_j`` are Legendre polynomials of the
time within a sequence, or of image coordinates, scaled to [-1, 1].
"""

from collections.abc import Sequence
from functools import lru_cache
from weakref import WeakKeyDictionary

import numpy as np
from numpy.polynomial import legendre
from scipy.special import sph_harm_y

from datasets.vocabulary.camera import Intrinsics
from datasets.vocabulary.effects import EFFECTS, EffectEntry, Parameter, Scope, Stage
from estimator.effects.link import Array, EffectModel, Moment, Places, Setting

REFERENCE = "Kennedy and O'Hagan, J. R. Stat. Soc. B 63 (2001) 425: model discrepancy as a smooth function"
LARGEST = {"smooth_time_shift": 5e-4, "image_warp": 5.0, "zoom_in_time": 0.1, "body_outline": 1.0, "volume_warp": 0.1}
"""Standard deviation of a prior on every coefficient of the families that are not pushes, in their units: larger than any such thing is,
so that it speaks only where the data do not."""


def phase(time_s: Array | float, setting: Setting) -> Array:
    """Time since the first frame, scaled to [-1, 1] over the sequence; ``time_s`` (n,) or one."""
    length = max(float(setting.times_s[-1] - setting.times_s[0]), 1e-12)
    return np.asarray(2.0 * np.asarray(time_s) / length - 1.0)


def curves(name: str, unit: str, degrees: range, step: float) -> tuple[Parameter, ...]:
    """Coefficients of three curves in time, degree by degree."""
    return tuple(
        Parameter(f"{name}_{axis}{degree}", unit, (-np.inf, np.inf), step, f"coefficient of P_{degree} along {axis}")
        for degree in degrees
        for axis in "xyz"
    )


@lru_cache(maxsize=4096)
def _values(at: float, degree: int) -> Array:
    """Polynomials (degree + 1,) at one phase: every derivative of a flight asks for them at the same moments."""
    return np.asarray(legendre.legvander(at, degree).ravel())


def curve_at(theta: Array, moment: Moment, setting: Setting) -> Array:
    """Those curves (m, 3) at a moment; ``theta`` (m, 3 d)."""
    basis = _values(float(phase(moment.time_s, setting)), theta.shape[1] // 3 - 1)
    return np.asarray(np.einsum("mjk,j->mk", theta.reshape(len(theta), -1, 3), basis))


FORCE_DEGREES, TORQUE_DEGREES, TIME_DEGREES, WARP_DEGREE = range(4), range(3), range(2, 6), 3
"""Degrees of the polynomials in time (forces, torques, times) and in the place (warp).

A time shift begins at 2: flights take up the rest. By judgement."""
ZOOM_DEGREES = range(1, 8)
"""Enough to follow a relaxation whose time constant is a seventh of the recording within a thousandth (notebook 17)."""


class SmoothForce(EffectModel):
    """A force of its own in every sequence, smooth in time."""

    entry = EffectEntry(
        "smooth_force", Stage.DYNAMICS, Scope.SEQUENCE, curves("a", "m/s2", FORCE_DEGREES, 1e-3), "dv/dt = g + sum a_j P_j(t)", REFERENCE
    )

    def acceleration(self, theta: Array, moment: Moment, setting: Setting) -> Array | None:
        """The curve at the moment."""
        return curve_at(theta, moment, setting)


class SmoothTorque(EffectModel):
    """A torque of its own in every sequence, smooth in time, per largest moment."""

    entry = EffectEntry(
        "smooth_torque", Stage.DYNAMICS, Scope.SEQUENCE, curves("m", "rad/s2", TORQUE_DEGREES, 1e-1), "dL/dt = sum m_j P_j(t)", REFERENCE
    )

    def torque(self, theta: Array, moment: Moment, setting: Setting) -> Array | None:
        """The curve at the moment."""
        return curve_at(theta, moment, setting)


class BodyThrust(EffectModel):
    """A force and a torque that are fixed to the body."""

    entry = EffectEntry(
        "body_thrust",
        Stage.DYNAMICS,
        Scope.PARTICLE,
        (
            *(Parameter(f"a{i}", "m/s2", (-np.inf, np.inf), 1e-3, f"acceleration along body axis {i}") for i in (1, 2, 3)),
            *(Parameter(f"m{i}", "rad/s2", (-np.inf, np.inf), 1e-1, f"torque per largest moment about body axis {i}") for i in (1, 2, 3)),
        ),
        "dv/dt = g + R_world_body a; dL/dt = R_world_body m",
        REFERENCE,
    )

    def acceleration(self, theta: Array, moment: Moment, setting: Setting) -> Array | None:
        """The force, turned with the body."""
        del setting
        return np.asarray(np.einsum("mij,mj->mi", moment.R, theta[:, :3]))

    def torque(self, theta: Array, moment: Moment, setting: Setting) -> Array | None:
        """The torque, turned with the body."""
        del setting
        return np.asarray(np.einsum("mij,mj->mi", moment.R, theta[:, 3:]))


_PAIRS = ("xx", "yy", "zz", "xy", "xz", "yz")


class ForceField(EffectModel):
    """A force that depends on the place in the room: the first terms of any field that has a potential."""

    entry = EffectEntry(
        "force_field",
        Stage.DYNAMICS,
        Scope.CAMPAIGN,
        (
            *(Parameter(f"a_{axis}", "m/s2", (-np.inf, np.inf), 1e-3, f"acceleration in the middle, along {axis}") for axis in "xyz"),
            *(Parameter(f"g_{pair}", "1/s2", (-np.inf, np.inf), 1e-2, f"its gradient, component {pair}") for pair in _PAIRS),
        ),
        "dv/dt = g + a + G (x - x0), G symmetric",
        REFERENCE,
    )

    def __init__(self, middle: Array | None = None) -> None:
        self.middle = np.zeros(3) if middle is None else middle

    def about(self, middle: Array) -> "ForceField":
        """The same about another point ``middle`` (3,) m, world frame."""
        return ForceField(middle)

    def acceleration(self, theta: Array, moment: Moment, setting: Setting) -> Array | None:
        """The field where the bodies are."""
        del setting
        return self.force(theta, moment.x)

    def force(self, theta: Array, x: Array) -> Array:
        """The acceleration (m, 3) m/s² at places ``x`` (m, 3) m, world frame.

        ``theta`` (m, 9): the force at the middle, then its gradient.
        """
        G = theta[:, [[3, 6, 7], [6, 4, 8], [7, 8, 5]]]
        return np.asarray(theta[:, :3] + np.einsum("mij,mj->mi", G, x - self.middle))


class SmoothTimeShift(EffectModel):
    """Time stamps that go wrong smoothly within every sequence; a constant and a rate are position and velocity."""

    entry = EffectEntry(
        "smooth_time_shift",
        Stage.CLOCK,
        Scope.RECORDING,
        tuple(Parameter(f"t{j}", "s", (-np.inf, np.inf), 1e-7, f"coefficient of P_{j}") for j in TIME_DEGREES),
        "true time = nominal time + sum t_j P_j(t)",
        REFERENCE,
    )

    def times(self, theta: Array, setting: Setting, times_s: Array) -> Array:
        """Times moved by the curve."""
        basis = legendre.legvander(phase(times_s - setting.times_s[0], setting), TIME_DEGREES[-1])[:, TIME_DEGREES[0] :]
        return np.asarray(times_s + basis @ theta)


_POWERS = tuple((i, j) for i in range(WARP_DEGREE + 1) for j in range(WARP_DEGREE + 1 - i) if i + j >= 2)


class ImageWarp(EffectModel):
    """A smooth warp of the picture, the same in all frames; affine ones are the camera's and the pose's business."""

    entry = EffectEntry(
        "image_warp",
        Stage.OPTICS,
        Scope.CAMERA,
        tuple(
            Parameter(f"{axis}{i}{j}", "px", (-np.inf, np.inf), 1e-2, f"displacement along {axis} by P_{i}(x) P_{j}(y)")
            for axis in "xy"
            for i, j in _POWERS
        ),
        "the picture is displaced by sum w_ij P_i(x) P_j(y), 2 <= i + j <= 3",
        REFERENCE,
    )

    def correct(self, theta: Array, points_px: Array, camera: Intrinsics, times_s: Array) -> Array:
        """Points with the warp taken off."""
        del times_s
        half = 0.5 * np.array([camera.width_px, camera.height_px])
        x, y = ((points_px - half) / half).T
        in_x, in_y = legendre.legvander(x, WARP_DEGREE), legendre.legvander(y, WARP_DEGREE)
        basis = np.stack([in_x[:, i] * in_y[:, j] for i, j in _POWERS], axis=1)
        return np.asarray(points_px - np.column_stack([basis @ part for part in np.split(theta, 2)]))


WARPED = EFFECTS["position_distortion"].parameters[0].plausible
"""Coefficients of a warp that are plausible, as of the catalogue's distortion: all have one size, whatever the data see of each."""


class VolumeWarp(EffectModel):
    """A smooth warp of the volume that positions are measured in, the same in all rows; affine ones are lengths' and gravity's business.

    All of second order, and of third order what has no direction of its own: a stretch and a twist that grow with the distance squared.
    """

    entry = EffectEntry(
        "volume_warp",
        Stage.TRACKING,
        Scope.CAMPAIGN,
        (
            *(
                Parameter(f"{axis}_{pair}", "1", WARPED, 1e-4, f"displacement along {axis}, over R, by u_{pair[0]} u_{pair[1]}")
                for axis in "xyz"
                for pair in _PAIRS
            ),
            Parameter("stretch", "1", WARPED, 1e-4, "radial displacement, over R, by |u|^3"),
            *(Parameter(f"twist_{axis}", "1", WARPED, 1e-4, f"turn about {axis} by |u|^2, rad") for axis in "xyz"),
        ),
        "x + R (Q u u + |u|^2 (k u + t x u)), u = (x - c) / R, c and R the middle and the size of all positions",
        REFERENCE,
    )

    def tracked(self, theta: Array, x: Array, setting: Setting) -> Array:
        """The positions, warped."""
        return np.asarray(x + self.tracked_by(theta, x, setting) @ theta)

    def tracked_by(self, theta: Array, x: Array, setting: Setting) -> Array:
        """What a coefficient of one moves (n, 3, 22) m, whatever the others."""
        u = (x - setting.middle_world) / setting.reach_m
        products, turned = np.hstack([u**2, u[:, [0, 0, 1]] * u[:, [1, 2, 2]]]), u * np.sum(u**2, axis=1, keepdims=True)
        moved = np.zeros((*u.shape, len(theta)))
        for axis in range(3):
            after, last = (axis + 1) % 3, (axis + 2) % 3
            moved[:, axis, 6 * axis : 6 * axis + 6] = products
            moved[:, axis, 18] = turned[:, axis]
            moved[:, after, 19 + axis], moved[:, last, 19 + axis] = -turned[:, last], turned[:, after]
        return setting.reach_m * moved


class ZoomInTime(EffectModel):
    """A magnification about the picture's centre that changes within the recording, the same way in all sequences."""

    entry = EffectEntry(
        "zoom_in_time",
        Stage.OPTICS,
        Scope.CAMERA,
        tuple(Parameter(f"z{j}", "1", (-np.inf, np.inf), 1e-5, f"coefficient of P_{j}") for j in ZOOM_DEGREES),
        "the picture is magnified by 1 + sum z_j (P_j(t) - P_j(0)) about its principal point, t from the first frame of each sequence",
        REFERENCE,
    )
    length_s = 0.02
    """Time (s) over which the polynomials are scaled to [-1, 1]; the zoom stands still after it."""

    def over(self, length_s: float) -> "ZoomInTime":
        """The same over another time (s): that of the longest sequence."""
        return self._changed(length_s=length_s)

    def growth(self, times_s: Array) -> Array:
        """What each coefficient adds (n, 7) to the magnification at ``times_s`` (n,) s."""
        share = np.concatenate([[0.0], np.clip(times_s / self.length_s, 0.0, 1.0)])
        basis = legendre.legvander(2.0 * share - 1.0, ZOOM_DEGREES[-1])[:, ZOOM_DEGREES[0] :]
        return np.asarray(basis[1:] - basis[0])

    def correct(self, theta: Array, points_px: Array, camera: Intrinsics, times_s: Array) -> Array:
        """Points with the magnification taken off."""
        centre = np.array([camera.cx_px, camera.cy_px])
        return np.asarray(centre + (points_px - centre) / (1.0 + self.growth(times_s) @ theta)[:, None])


_HARMONICS = tuple((d, m) for d in (2, 3) for m in range(-d, d + 1))
_KNOWN_HARMONICS: WeakKeyDictionary[Places, Array] = WeakKeyDictionary()
"""Harmonics at places, which every derivative asks for again."""


def harmonics(directions: Array) -> Array:
    """Real spherical harmonics (..., 12) of mean square 1, degrees 2 and 3, of unit vectors ``directions`` (..., 3), body axes."""
    polar, azimuth = np.arccos(np.clip(directions[..., 2], -1.0, 1.0)), np.arctan2(directions[..., 1], directions[..., 0])
    columns = []
    for degree, order in _HARMONICS:
        harmonic = sph_harm_y(degree, abs(order), polar, azimuth)
        part = harmonic.real if order >= 0 else harmonic.imag
        columns.append(np.sqrt(4.0 * np.pi * (1.0 if order == 0 else 2.0)) * part)
    return np.stack(columns, axis=-1)


class BodyOutline(EffectModel):
    """An outline offset that belongs to places on the body: spherical harmonics of the outward normal, degrees 2 and 3."""

    entry = EffectEntry(
        "body_outline",
        Stage.SEGMENTATION,
        Scope.PARTICLE,
        tuple(Parameter(f"b{d}{m:+d}", "px", (-np.inf, np.inf), 1e-2, f"coefficient of Y_{d},{m}") for d, m in _HARMONICS),
        "delta = sum b_lm Y_lm(n), n the outward normal in body axes, Y real and of mean square 1",
        REFERENCE,
    )

    def shift(self, theta: Array, places: Places, setting: Setting) -> Array | None:
        """The offset at the tangencies."""
        del setting
        if places not in _KNOWN_HARMONICS:
            _KNOWN_HARMONICS[places] = harmonics(places.normal_body)
        return np.asarray(_KNOWN_HARMONICS[places] @ theta)


_FORCES = (SmoothForce(), SmoothTorque(), BodyThrust(), ForceField())
_INSTRUMENT = (SmoothTimeShift(), ImageWarp(), ZoomInTime(), BodyOutline(), VolumeWarp())
EMPIRICAL: dict[str, EffectModel] = {model.entry.key: model for model in (*_FORCES, *_INSTRUMENT)}
"""The families by key; each entry's stage is what it stands for."""


def families(middles: Sequence[Array], times_s: Sequence[Array]) -> tuple[EffectModel, ...]:
    """The families of a campaign: the field of force about the middle of its flights, the zoom over its longest sequence.

    ``middles`` (3,) m of every flight, world frame; ``times_s`` (n,) of every sequence.
    """
    middle, longest = np.mean(middles, axis=0), max(float(np.ptp(each)) for each in times_s)

    def adapted(family: EffectModel) -> EffectModel:
        if isinstance(family, ForceField):
            return family.about(middle)
        return family.over(longest) if isinstance(family, ZoomInTime) else family

    return tuple(adapted(family) for family in EMPIRICAL.values())
