"""What fitted empirical terms look like: curves in time, a field over the picture, an offset over directions, with standard deviations.

Every family is linear in its coefficients, so a value is ``A c`` with covariance ``A C Aᵀ``. Forces and torques are told in world axes and
in axes that turn with the body: a thrust that is fixed to the body is a constant there.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from estimator.appearance.model_errors import SequenceTask
from estimator.diagnosis.empirical_fit import EmpiricalFit
from estimator.diagnosis.pooled_scores import moments_along
from estimator.effects.empirical.families import BodyOutline, ImageWarp, SmoothForce, SmoothTimeShift, SmoothTorque, ZoomInTime, harmonics
from estimator.effects.empirical.force_curves import basis
from estimator.effects.empirical.law_effect import shown_terms
from estimator.effects.empirical.law_terms import body_fixed
from estimator.effects.link import EffectModel
from estimator.fitting.campaigns.campaign import Campaign
from estimator.geometry.sphere import fibonacci_sphere

Array = NDArray[np.float64]
IN_TIME, GRID, DIRECTIONS = 21, 9, 60
"""Instants of a curve, places along each side of a field, and directions of an outline that are drawn: they decide nothing."""


@dataclass(frozen=True)
class Shape:
    """One recovered curve or field.

    ``of``: what it is, ``unit``; ``over``: names of the coordinates; ``axes``: names of its components; ``sequence``: its number, ``None``
    where sequences share it; ``place`` (n, p), ``value`` (n, k) and ``sigma`` (n, k) standard deviations.
    """

    of: str
    unit: str
    over: tuple[str, ...]
    axes: tuple[str, ...]
    sequence: int | None
    place: Array
    value: Array
    sigma: Array


def empirical_shapes(campaign: Campaign, found: EmpiricalFit) -> tuple[Shape, ...]:
    """The shapes of all terms of a fit."""
    shapes: list[Shape] = []
    turned = any(term.function is body_fixed for term in shown_terms(partial(campaign.kind.why_not, campaign)))
    R = moments_along(campaign, found.fit, np.linspace(0.0, 1.0, IN_TIME)).R.reshape(-1, IN_TIME, 3, 3) if turned else None
    slices = found.fit.model.slices[-len(found.terms) :]
    for effect, part in zip(found.terms, slices, strict=True):
        own = effect.entry.scope.own
        for number in sorted(set(campaign.sharing(effect.entry.scope))) if own else (0,):
            columns = found.fit.model.layout.columns([effect.entry.key])
            coefficients = found.fit.state.theta[number][part], found.covariance.of(number, columns)
            shapes += _shapes(effect, (campaign, R, number if own else None), coefficients)
    return tuple(shapes)


Coefficients = tuple[Array, Array]
Where = tuple[Campaign, Array | None, int | None]
"""A campaign, how its bodies are turned (s, t, 3, 3) at the instants of curves, where that is told, and the number of a sequence."""


def _shapes(effect: EffectModel, where: Where, coefficients: Coefficients) -> list[Shape]:
    campaign, _, number = where
    sequence = campaign.sequences[number or 0]
    if isinstance(effect, SmoothForce):
        return _pushes("force", "m/s2", where, coefficients)
    if isinstance(effect, SmoothTorque):
        return _pushes("torque", "rad/s2", where, coefficients)
    if isinstance(effect, SmoothTimeShift):
        return [_time_shift(effect, number, sequence, coefficients)]
    if isinstance(effect, ZoomInTime):
        return [_zoom(effect, sequence, coefficients)]
    if isinstance(effect, ImageWarp):
        return [_warp(effect, sequence, coefficients)]
    if isinstance(effect, BodyOutline):
        n = fibonacci_sphere(DIRECTIONS)
        return [_shape(_Names("outline offset", "px", ("n1", "n2", "n3"), ("outwards",)), n, harmonics(n)[:, None], coefficients)]
    return []


@dataclass(frozen=True)
class _Names:
    """What a shape is called: as in :class:`Shape`."""

    of: str
    unit: str
    over: tuple[str, ...]
    axes: tuple[str, ...]
    sequence: int | None = None


def _shape(names: _Names, place: Array, A: Array, c: Coefficients) -> Shape:
    """A shape of which ``A`` (n, k, q) makes the values out of coefficients."""
    value, covariance = c
    sigma = np.sqrt(np.maximum(np.einsum("nkp,pq,nkq->nk", A, covariance, A), 0.0))
    return Shape(names.of, names.unit, names.over, names.axes, names.sequence, place, A @ value, sigma)


def _pushes(of: str, unit: str, where: Where, coefficients: Coefficients) -> list[Shape]:
    """A curve in world axes and, where measurements show how it is turned, in axes that turn with the body."""
    campaign, R, number = where
    assert number is not None
    setting = campaign.sequences[number].setting
    times = np.linspace(0.0, 1.0, IN_TIME) * float(setting.times_s[-1] - setting.times_s[0])
    A = np.einsum("nd,kx->nkdx", basis(times, setting), np.eye(3)).reshape(IN_TIME, 3, -1)
    axes = [("world", "xyz", A), *([] if R is None else [("body", "123", np.einsum("nxk,nxq->nkq", R[number], A))])]
    told = ((_Names(f"{of}, {which} axes", unit, ("time_s",), tuple(names), number), along) for which, names, along in axes)
    return [_shape(names, times[:, None], along, coefficients) for names, along in told]


def _time_shift(effect: SmoothTimeShift, number: int | None, sequence: SequenceTask, coefficients: Coefficients) -> Shape:
    stamps, q = sequence.setting.times_s, len(coefficients[0])
    times = np.linspace(stamps[0], stamps[-1], IN_TIME)
    A = np.stack([effect.times(unit_vector, sequence.setting, times) - times for unit_vector in np.eye(q)], axis=1)
    return _shape(_Names("time shift", "s", ("time_s",), ("later",), number), (times - stamps[0])[:, None], A[:, None], coefficients)


def _zoom(effect: ZoomInTime, sequence: SequenceTask, coefficients: Coefficients) -> Shape:
    stamps = sequence.setting.times_s
    times = np.linspace(0.0, stamps[-1] - stamps[0], IN_TIME)
    A = effect.growth(times)[:, None]
    return _shape(_Names("magnification minus 1", "1", ("time_s",), ("larger",)), times[:, None], A, coefficients)


def _warp(effect: ImageWarp, sequence: SequenceTask, coefficients: Coefficients) -> Shape:
    camera = sequence.task.sightings.cameras[0].intrinsics
    x, y = np.meshgrid(np.linspace(0, camera.width_px - 1, GRID), np.linspace(0, camera.height_px - 1, GRID))
    points = np.column_stack([x.ravel(), y.ravel()])
    zero = np.zeros(len(points))
    A = np.stack([points - effect.correct(e, points, camera, zero) for e in np.eye(len(coefficients[0]))], axis=2)
    return _shape(_Names("displacement in the picture", "px", ("x_px", "y_px"), ("x", "y")), points, A, coefficients)
