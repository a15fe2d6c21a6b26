"""Tangency errors of a sequence under a model with effects, and their derivatives by every parameter.

The chain: corrected outline points (optics), poses (clock, body, forces, scale), tangency errors, minus the outline shifts (exposure,
segmentation). Only the errors in the high-speed camera's picture are used: those in the calibrated views' pictures are the same
measurements seen a second time.
"""

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from estimator.appearance.flight_errors import body_normals, particle_poses
from estimator.appearance.prediction import Prediction, predict
from estimator.appearance.rim import Rim
from estimator.data.fit_task import OUTWARD, FitTask, Sightings
from estimator.effects.link import Moving, Places, Setting
from estimator.effects.model import Model, overrides
from estimator.geometry.cast_outline import CastingMesh, cast_outline
from estimator.geometry.epipolar_tangency import PoseSet, TangencyErrors, tangency_errors
from estimator.geometry.outline_bias import without_bias
from estimator.geometry.outline_shape import OutlineShape
from estimator.geometry.silhouettes import Silhouettes
from estimator.motion.flight import N_PARAMETERS, OFFSET, Flight, flown

Array = NDArray[np.float64]


class TableMaker(Protocol):
    """Makes what is tabled of a sequence's outlines, the ``shape`` of those that are cast and their predicted bias, at a flight."""

    def followed(self, sequence: "SequenceTask", flight: Flight, prediction: Prediction) -> "SequenceTask":
        """The sequence with its tables made at ``prediction``; as it is where those are of nearly the same poses."""


@dataclass(frozen=True)
class SequenceTask:
    """One sequence of a campaign: its fit task, setting, the particle's rim, and the shape of the n outlines its hull casts.

    ``tables`` makes that shape and the bias in the task anew where a fit has left ``made_at``, the rotations (n, 3, 3) from particle to
    camera that they belong to; ``None``: they stay. ``hollow``: mean share of the outlines' convex hulls that is empty.
    ``number``: which flight of a recording with impacts it is, from 1; 0 where it is the whole recording.
    """

    name: str
    task: FitTask
    setting: Setting
    rim: Rim
    shape: OutlineShape
    tables: TableMaker | None = None
    made_at: Array | None = None
    hollow: float = 0.0
    number: int = 0

    @property
    def since_start(self) -> Array:
        """Stamps (n,) s of the sightings counted from the first frame of their camera."""
        return self.setting.since_start(self.task.sightings.seen, self.task.sightings.times_s)


@dataclass(frozen=True)
class ModelResiduals:
    """Residuals of a sequence, of which a cost can be told.

    ``e`` (n, k, 2) px in the high-speed camera's picture, zero where there is none;
    ``tangency`` the kernel's own answer, ``normals`` (n, k, 2, 3) outward normals and ``viewing`` (n, 3) directions, body axes; ``shift``
    (n, k, 2) px by which effects displace the outline; ``size`` (n,) of corrected silhouettes over recorded ones.
    """

    e: Array
    tangency: TangencyErrors
    normals: Array
    viewing: Array
    shift: Array
    places: Places
    prediction: Prediction
    size: Array

    @property
    def seen(self) -> NDArray[np.bool_]:
        """Where (n, k, 2) there is an error."""
        return np.repeat(self.tangency.valid[:, :, None], 2, axis=2)


@dataclass(frozen=True)
class ModelErrors(ModelResiduals):
    """Residuals and their derivatives ``J`` (n, k, 2, 21 + q), zero where there is no residual."""

    J: Array


def seen_outlines(task: FitTask, flight: Flight, mesh: CastingMesh) -> list[Array]:
    """Outlines (px) that a body's ``mesh``, particle frame, would cast under a free flight, hollows included."""
    placed = particle_poses(flight, flown(flight, task.sightings.times_s), task.sightings)
    return cast_outlines(task, placed, mesh)


def cast_outlines(task: FitTask, placed: PoseSet, mesh: CastingMesh) -> list[Array]:
    """Those that it would cast at poses of the sightings."""
    cameras = [task.sightings.cameras[int(c)].intrinsics for c in task.sightings.camera]
    return [cast_outline(mesh, camera, R, t) for camera, R, t in zip(cameras, placed.R, placed.t, strict=True)]


def model_errors(sequence: SequenceTask, flight: Flight, model: Model, theta: Array) -> ModelErrors:
    """Residuals and derivatives at a flight and effect parameters ``theta`` (q,)."""
    return linearised(sequence, model_residuals(sequence, flight, model, theta), model, theta)


def model_residuals(sequence: SequenceTask, flight: Flight, model: Model, theta: Array) -> ModelResiduals:
    """Residuals at a flight and effect parameters ``theta`` (q,).

    They are errors of the corrected picture in pixels of the recorded one: an effect that shrinks the picture explains nothing by that.
    """
    task, setting = sequence.task, sequence.setting
    sightings = task.sightings
    prediction = predict(flight, model, theta, setting, sightings.times_s, rows_px=sightings.rows_px, seen=sightings.seen)
    scale = model.scale(theta)
    first = _corrected(sequence, model, theta)
    placed = particle_poses(flight, prediction.poses, task.sightings, scale=scale)
    centre_cam = centres_cam(flight, placed)
    errors = tangency_errors(
        first,
        placed,
        task.views.silhouettes,
        task.views.poses,
        pivot_particle=flight.body.com_particle,
        axes=task.sightings.R_cam_world,
        weight=task.weight,
        offset_px=-flight.offset_px,
    )
    R_cam_body = task.sightings.R_cam_world @ prediction.poses.R[:, 0]
    normals, viewing = body_normals(task.sightings, R_cam_body, errors), R_cam_body[:, 2]
    places = _places(sequence, prediction, errors, (normals, centre_cam, first))
    size = _size(task.sightings.silhouettes, first.points_px)
    shift = model.shift(theta, places, setting)
    e = without_bias(errors, task.bias).error[:, :, :2] / size[:, None, None] - shift
    e, shift = (np.where(errors.valid[:, :, None], values, 0.0) for values in (e, shift))
    return ModelResiduals(e, errors, normals, viewing, shift, places, prediction, size)


def linearised(sequence: SequenceTask, at: ModelResiduals, model: Model, theta: Array) -> ModelErrors:
    """Residuals with their derivatives, which take longer than they do themselves; ``theta`` (q,) of the model."""
    J = _jacobian(sequence.task, model, theta, at)
    _add_image_columns(J, sequence, model, theta, at)
    J[..., N_PARAMETERS + np.flatnonzero(model.frozen)] = 0.0
    J[~at.tangency.valid] = 0.0
    return ModelErrors(**vars(at), J=J)


def _owner(silhouettes: Silhouettes) -> NDArray[np.int64]:
    """The sighting (v,) of each vertex."""
    return np.repeat(np.arange(len(silhouettes), dtype=np.int64), np.diff(silhouettes.offsets))


def _corrected(sequence: SequenceTask, model: Model, theta: Array) -> Silhouettes:
    """Silhouettes in a camera without the optical effects."""
    silhouettes = sequence.task.sightings.silhouettes
    owner = _owner(silhouettes)
    points = corrected_points(sequence, model, theta, silhouettes.points_px, owner)
    if points is silhouettes.points_px:
        return silhouettes
    cameras, camera = sequence.task.sightings.cameras, sequence.task.sightings.camera
    xy = np.empty_like(points)
    for c, hsv in enumerate(cameras):
        rows = camera[owner] == c
        xy[rows] = hsv.intrinsics.normalise(points[rows])
    return replace(silhouettes, points_px=points, xy=np.ascontiguousarray(xy))


def corrected_points(sequence: SequenceTask, model: Model, theta: Array, points: Array, owner: NDArray[np.int64]) -> Array:
    """Where ``points`` (v, 2) px of the sightings ``owner`` (v,) would be in a camera without the model's effects; ``theta`` (q,) of it."""
    sightings = sequence.task.sightings
    if not any(overrides(effect, "correct") for effect in model.effects):
        return points
    times = sequence.since_start[owner]
    if len(sightings.cameras) == 1:
        return model.correct(theta, points, sightings.cameras[0], times)
    corrected = points.copy()
    for c, hsv in enumerate(sightings.cameras):
        rows = sightings.camera[owner] == c
        corrected[rows] = model.correct(theta, points[rows], hsv, times[rows])
    return corrected


def _places(sequence: SequenceTask, prediction: Prediction, errors: TangencyErrors, at: tuple[Array, Array, Silhouettes]) -> Places:
    normals, centre_cam, first = at
    sightings = sequence.task.sightings
    vertex = np.maximum(first.offsets[:-1, None, None] + errors.tangency[:, :, :2], 0)
    point = sightings.silhouettes.points_px[vertex]
    u = errors.direction[:, :, :2]
    there = sequence.shape.towards(u)
    moving = moving_at(sequence, prediction, centre_cam)
    return Places(
        point_px=point,
        normal=u,
        normal_body=normals,
        velocity_px=moving.velocity_px(moving.arms(normals), sightings.silhouettes.focal_px),
        radius_px=there.radius_px,
        mean_radius_px=np.maximum(sequence.shape.radius_px.mean(axis=1), 1e-6),
        sharpness=there.sharpness,
        recession=there.recession,
        erosion=there.erosion,
        dilation=there.dilation,
        leak=there.leak,
        smear=there.smear,
        outline_px=sightings.furthest_px,
        outward=OUTWARD,
        rows_px=sightings.rows_px,
        depth_m=centre_cam[:, 2],
        first_depth_m=centre_cam[sightings.first, 2],
        view_ratio=errors.jacobian[:, :, :2, 7],
        seen=sightings.seen,
        times_s=sequence.since_start,
        moving=moving,
    )


def centres_cam(flight: Flight, placed: PoseSet) -> Array:
    """The nominal centre of mass (n, 3) m in every sighting, camera axes."""
    return np.asarray(placed.t + placed.R @ flight.body.com_particle)


def moving_at(sequence: SequenceTask, prediction: Prediction, centre_cam: Array) -> Moving:
    """How the body moves in every sighting; ``centre_cam`` (n, 3) m of the body."""
    R_cw = sequence.task.sightings.R_cam_world
    return Moving(
        sequence.rim.furthest,
        R_cw @ prediction.poses.R[:, 0],
        centre_cam,
        np.einsum("nij,nj->ni", R_cw, prediction.velocity),
        np.einsum("nij,nj->ni", R_cw, prediction.omega),
    )


def _jacobian(task: FitTask, model: Model, theta: Array, at: ModelResiduals) -> Array:
    """Derivatives through the poses and the outline offset."""
    errors, S = at.tangency, scaled_sensitivity(task.sightings, model, theta, at.prediction, at.places.moving.centre_cam)
    n, k = errors.valid.shape
    J = (errors.jacobian[:, :, :2, :6].reshape(n, 2 * k, 6) @ S).reshape(n, k, 2, -1)
    J[..., OFFSET.start] -= errors.jacobian[:, :, :2, 6]
    return np.asarray(J)


def scaled_sensitivity(sightings: Sightings, model: Model, theta: Array, prediction: Prediction, centre_cam: Array) -> Array:
    """Derivatives (n, 6, 21 + q) of the poses that cameras see, which lengths wrong by a factor divide.

    ``theta`` (q,) of the model; ``centre_cam`` (n, 3) m of the body, camera axes.
    """
    scale, steps = model.scale(theta), model.steps
    S = prediction.sensitivity.copy()
    S[:, :3] /= scale
    for _, part in model.touching("scale"):
        for column in range(part.start, part.stop):
            up, down = theta.copy(), theta.copy()
            up[column], down[column] = up[column] + steps[column], down[column] - steps[column]
            growth = (model.scale(up) - model.scale(down)) / (2.0 * steps[column])
            S[:, :3, N_PARAMETERS + column] -= np.einsum("nji,nj->ni", sightings.R_cam_world, centre_cam) * growth / scale
    return np.asarray(S)


def _moved(sequence: SequenceTask, alone: Model, thetas: tuple[Array, Array], of: tuple[Array, NDArray[np.int64]]) -> Array:
    """Where points of sightings are under the first parameters (q,) of a model of one effect, less where under the second (v, 2) px."""
    high, low = (corrected_points(sequence, alone, theta, *of) for theta in thetas)
    return np.asarray(high - low)


def _add_image_columns(J: Array, sequence: SequenceTask, model: Model, theta: Array, at: ModelResiduals) -> None:
    """Add the derivatives through corrected points, whose ``size`` turns errors into recorded pixels, and through outline shifts."""
    errors, places, size = at.tangency, at.places, at.size
    J /= size[:, None, None, None]
    first = sequence.task.sightings.silhouettes
    owner = _owner(first)
    vertex = np.maximum(first.offsets[:-1, None, None] + errors.tangency[:, :, :2], 0)
    arms = Arms.of(first.points_px, owner, len(first))
    for effect, part in zip(model.effects, model.slices, strict=True):
        alone, corrects, silent = Model((effect,)), overrides(effect, "correct"), effect.silent(theta[part])
        for number, step in enumerate(alone.steps):
            if silent[number]:
                continue
            up, down = effect.slope_at(theta[part]).copy(), effect.slope_at(theta[part]).copy()
            up[number], down[number] = up[number] + step, down[number] - step
            column = N_PARAMETERS + part.start + number
            moved = _moved(sequence, alone, (up, down), (first.points_px, owner)) if corrects else None
            if moved is not None and moved.any():
                growth = arms.growth(moved) / size
                along = places.normal[..., 0] * moved[vertex, 0] + places.normal[..., 1] * moved[vertex, 1]
                J[..., column] += along / (2.0 * step * size[:, None, None])
                J[..., column] -= errors.error[:, :, :2] * (growth / (2.0 * step * size))[:, None, None]
            high, low = effect.shift(up, places, sequence.setting), effect.shift(down, places, sequence.setting)
            if high is not None and low is not None:
                J[..., column] -= places.seen.only(effect.camera, high - low) / (2.0 * step)


def _size(recorded: Silhouettes, corrected_px: Array) -> Array:
    """How many times larger (n,) each corrected silhouette is than the recorded one."""
    if corrected_px is recorded.points_px:
        return np.ones(len(recorded))
    return 1.0 + Arms.of(recorded.points_px, _owner(recorded), len(recorded)).growth(corrected_px - recorded.points_px)


@dataclass(frozen=True)
class Arms:
    """Points ``arm`` (v, 2) px of outlines from the middle of their own, the sighting ``owner`` (v,) of each, and sums ``square`` (n,)."""

    arm: Array
    owner: NDArray[np.int64]
    square: Array

    @classmethod
    def of(cls, points_px: Array, owner: NDArray[np.int64], n: int) -> "Arms":
        """Those of ``points_px`` (v, 2) of n sightings, ``owner`` (v,) the sighting of each."""
        count = np.maximum(np.bincount(owner, minlength=n), 1)
        middle = np.column_stack([np.bincount(owner, points_px[:, a], n) / count for a in range(2)])
        arm = points_px - middle[owner]
        return cls(arm, owner, np.maximum(np.bincount(owner, np.sum(arm**2, axis=1), n), 1e-12))

    def growth(self, moved: Array) -> Array:
        """Growth (n,) of each outline under a displacement ``moved`` (v, 2) px of its points: the isotropic part of the best affine map."""
        along = self.arm[:, 0] * moved[:, 0] + self.arm[:, 1] * moved[:, 1]
        return np.asarray(np.bincount(self.owner, along, len(self.square)) / self.square)
