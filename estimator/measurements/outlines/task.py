"""One sequence of a campaign of outlines, sample by sample: residuals against a model with effects, and their derivatives.

Residuals are how far outside of the outline that the surface casts the samples of each sector lie in the mean, less what effects displace
it by, over their standard deviation: (n, k) of n sightings and k sectors. The prediction is the chain that tangency errors use
(:mod:`estimator.appearance.model_errors`), ended with the samples themselves.
"""

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from estimator.appearance.flight_errors import particle_poses
from estimator.appearance.model_errors import (
    Arms,
    SequenceTask,
    cast_outlines,
    centres_cam,
    corrected_points,
    moving_at,
    scaled_sensitivity,
)
from estimator.appearance.outline_tables import picture_motions
from estimator.appearance.prediction import Prediction, predict
from estimator.appearance.sector_shape import sector_shape
from estimator.data.fit_task import OUTWARD, Sightings
from estimator.effects.instrument.surface_amplitudes import SurfaceAmplitudes
from estimator.effects.link import Places
from estimator.effects.model import Model, overrides
from estimator.geometry.epipolar_tangency import PoseSet
from estimator.geometry.outline_shape import OutlineShape
from estimator.likelihood.rows import Rows
from estimator.measurements.outlines.contacts import SECTORS, Contacts, contacts_at
from estimator.motion.flight import N_PARAMETERS, OFFSET, Flight
from estimator.particle.particle import Particle
from estimator.surface.amplitudes import Amplitudes

Array = NDArray[np.float64]
MOVED_PX = 0.5
"""Root mean square by which points of the outlines may move before what samples meet is found anew: a radius of 30 px then bends away by
0.004 px."""


@dataclass(frozen=True)
class OutlineTask(SequenceTask):
    """A sequence whose outlines are fitted sample by sample.

    ``particle`` it shows; ``contacts``: what the samples meet; ``sectors``: the shape of the outlines there; ``amplitudes`` of the
    particle's surface; ``own_px`` (n,) noise of each outline's samples; ``view_px_m``: m per px of the calibrated views, in the median;
    ``deviation`` (8,) of mass properties from the surface's; ``noise`` over what the outlines show and
    ``view_noise_px``, effective, of the views; ``kept`` (n,) sightings in use.
    """

    particle: Particle = field(kw_only=True)
    contacts: Contacts = field(kw_only=True)
    amplitudes: Amplitudes = field(kw_only=True)
    own_px: Array = field(kw_only=True)
    view_px_m: float = field(kw_only=True)
    deviation: Array = field(kw_only=True)
    kept: NDArray[np.bool_] = field(kw_only=True)
    sectors: OutlineShape = field(kw_only=True)
    noise: float = 1.0
    view_noise_px: float = 0.0

    @property
    def variance(self) -> Array:
        """Variance (n, k) px² of the sectors' mean residuals."""
        return np.asarray((self.noise * self.own_px[:, None]) ** 2 / np.maximum(self.contacts.count, 1.0))

    @property
    def repeats(self) -> Array:
        """Over how many sightings the noise of each sector is alike (k,)."""
        return np.ones(SECTORS)


@dataclass(frozen=True)
class OutlineErrors(Rows):
    """Residuals with the ``places`` (n, k, 1, ...) of the sectors."""

    places: Places = field(kw_only=True)


def outline_errors(sequence: OutlineTask, flight: Flight, model: Model, theta: Array) -> OutlineErrors:
    """Residuals and derivatives at a flight and effect parameters ``theta`` (q,)."""
    sightings, contacts = sequence.task.sightings, sequence.contacts
    prediction = predict(flight, model, theta, sequence.setting, sightings.times_s, rows_px=sightings.rows_px)
    placed = particle_poses(flight, prediction.poses, sightings, scale=model.scale(theta))
    centre_cam = centres_cam(flight, placed)
    met = _met(sequence, model, theta, (placed, centre_cam))
    places = _places(sequence, prediction, met, centre_cam)
    shift = model.displaced(theta, places, sequence.setting)[..., 0]
    away = theta[amplitudes_in(model)] - contacts.amplitude
    e = met.gap + contacts.by_amplitude @ away - flight.offset_px - shift
    J = met.by_pose @ scaled_sensitivity(sightings, model, theta, prediction, centre_cam)
    J[..., OFFSET.start] -= 1.0
    J[..., N_PARAMETERS:][..., amplitudes_in(model)] += contacts.by_amplitude
    _add_image_columns(J, sequence, (model, theta), met, places)
    J[..., N_PARAMETERS + np.flatnonzero(model.frozen)] = 0.0
    rate = np.einsum("nka,na->nk", met.by_pose, np.hstack([prediction.velocity, prediction.omega]))
    seen = contacts.seen & sequence.kept[:, None] & np.isfinite(e) & np.isfinite(J).all(axis=-1)
    weight = np.where(seen, 1.0 / np.sqrt(sequence.variance), 0.0)
    e, J, rate = np.where(seen, e, 0.0) * weight, np.where(seen[..., None], J, 0.0) * weight[..., None], np.where(seen, rate, 0.0) * weight
    return OutlineErrors(e, J, seen, rate, sequence.variance, prediction, sequence.noise, places=places)


def amplitudes_in(model: Model) -> slice:
    """Where the surface's amplitudes lie among a model's parameters."""
    for effect, part in zip(model.effects, model.slices, strict=True):
        if isinstance(effect, SurfaceAmplitudes):
            return part
    return slice(0, 0)


def placed_at(sequence: SequenceTask, flight: Flight, model: Model, theta: Array) -> tuple[Prediction, PoseSet]:
    """The prediction under a model at ``theta`` (q,), and the poses that the cameras see."""
    sightings = sequence.task.sightings
    prediction = predict(flight, model, theta, sequence.setting, sightings.times_s, rows_px=sightings.rows_px)
    return prediction, particle_poses(flight, prediction.poses, sightings, scale=model.scale(theta))


def with_contacts(sequence: OutlineTask, flight: Flight, model: Model, theta: Array) -> OutlineTask:
    """The sequence with its contacts and tables made at a flight; as it is where that hardly moves its outlines; ``theta`` (q,)."""
    prediction, placed = placed_at(sequence, flight, model, theta)
    if moved_px(sequence, placed, theta[amplitudes_in(model)]) < MOVED_PX:
        return sequence
    return with_sectors(with_contacts_at(sequence, flight, model, theta), prediction, centres_cam(flight, placed))


def with_contacts_at(sequence: OutlineTask, flight: Flight, model: Model, theta: Array) -> OutlineTask:
    """The sequence with its contacts made at a flight; ``theta`` (q,)."""
    sightings, (_, placed) = sequence.task.sightings, placed_at(sequence, flight, model, theta)
    samples = corrected_points(sequence, model, theta, np.concatenate(sightings.outlines_px), sequence.contacts.sighting)
    return replace(sequence, contacts=contacts_at(sequence.amplitudes, theta[amplitudes_in(model)], sightings, placed, samples))


def with_sectors(sequence: OutlineTask, prediction: Prediction, centre_cam: Array) -> OutlineTask:
    """The sequence with the shape of the outlines that its surface casts where its contacts were found.

    ``centre_cam`` (n, 3) m of the body, camera axes.
    """
    surface = sequence.amplitudes.surface_at(sequence.contacts.amplitude)
    outlines = cast_outlines(sequence.task, sequence.contacts.placed, replace(surface.sphere.mesh, vertices=surface.vertices))
    motions = picture_motions(sequence, moving_at(sequence, prediction, centre_cam))
    return replace(sequence, sectors=sector_shape(outlines, motions, SECTORS))


def moved_px(sequence: OutlineTask, placed: PoseSet, amplitude: Array) -> float:
    """Root mean square (px) by which the points that samples meet have moved in the pictures since they were found.

    ``placed``: poses (n,) of the body now, camera axes; ``amplitude`` (m,) of the surface.
    """
    contacts, sightings = sequence.contacts, sequence.task.sightings
    now, before = (_pixels(contacts, sightings, each)[1] for each in (placed, contacts.placed))
    surface = contacts.by_amplitude @ (amplitude - contacts.amplitude)
    return float(np.sqrt(np.mean(np.sum((now - before) ** 2, axis=1)) + np.mean(surface[contacts.seen] ** 2)))


@dataclass(frozen=True)
class _Met:
    """The sectors at a pose.

    ``gap`` (n, k) px and its derivative ``by_pose`` (n, k, 6) by translation (m) and left rotation vector (rad), world frame; ``size`` (n,)
    of corrected outlines over recorded ones; ``plane`` (n, k, 3) outward along planes that touch the body, ``arm`` (n, k, 3) m from its
    centre, camera axes; ``point_px`` (n, k, 2) and outward ``normal`` (n, k, 2) in the picture, of the recorded samples.
    """

    gap: Array
    by_pose: Array
    size: Array
    plane: Array
    arm: Array
    point_px: Array
    normal: Array


def _met(sequence: OutlineTask, model: Model, theta: Array, at: tuple[PoseSet, Array]) -> _Met:
    """The sectors under a model at poses with centres (n, 3) m, camera axes."""
    (placed, centre_cam), sightings, contacts = at, sequence.task.sightings, sequence.contacts
    row, recorded = contacts.sighting, np.concatenate(sightings.outlines_px)
    samples = corrected_points(sequence, model, theta, recorded, row)
    size = np.ones(len(sightings))
    if samples is not recorded:
        size += Arms.of(recorded, row, len(sightings)).growth(samples - recorded)
    point, pixels, focal = _pixels(contacts, sightings, placed)
    gap = np.sum((samples - pixels) * contacts.normal, axis=1) / size[row]
    u, v = (contacts.normal * focal[row]).T / size[row]
    across = np.column_stack([u, v, -(u * point[:, 0] + v * point[:, 1]) / point[:, 2]]) / point[:, 2:]
    arm, R = point - centre_cam[row], sightings.R_cam_world[row]
    world = np.einsum("sj,sji->si", across, R)
    turned = np.cross(np.einsum("sj,sji->si", arm, R), world)
    by_pose = -contacts.mean(np.hstack([world, turned]))
    mean_normal = _unit(contacts.mean(contacts.normal))
    return _Met(contacts.mean(gap), by_pose, size, _unit(contacts.mean(across)), contacts.mean(arm), contacts.mean(recorded), mean_normal)


def _pixels(contacts: Contacts, sightings: Sightings, placed: PoseSet) -> tuple[Array, Array, Array]:
    """The points that samples meet, (s, 3) m in camera axes and (s, 2) px, and focal lengths (n, 2) px."""
    row, lenses = contacts.sighting, [camera.intrinsics for camera in sightings.cameras]
    focal, middle = (
        np.array(each)[sightings.camera] for each in ([[c.fx_px, c.fy_px] for c in lenses], [[c.cx_px, c.cy_px] for c in lenses])
    )
    point = np.einsum("sij,sj->si", placed.R[row], contacts.point) + placed.t[row]
    return point, point[:, :2] / point[:, 2:] * focal[row] + middle[row], focal


def _unit(vectors: Array) -> Array:
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-300))


def _places(sequence: OutlineTask, prediction: Prediction, met: _Met, centre_cam: Array) -> Places:
    """What effects on pictures know of the sectors, which count as one tangency (n, k, 1) each."""
    sightings = sequence.task.sightings
    moving = moving_at(sequence, prediction, centre_cam)
    there = sequence.sectors
    focal = sightings.silhouettes.focal_px
    nearest = int(np.argmin(sightings.times_s))
    ratio = -sequence.view_px_m * focal.mean(axis=1) / centre_cam[:, 2]
    return Places(
        point_px=met.point_px[:, :, None],
        normal=met.normal[:, :, None],
        normal_body=(met.plane @ (sightings.R_cam_world @ prediction.poses.R[:, 0]))[:, :, None],
        velocity_px=moving.velocity_px(met.arm, focal)[:, :, None],
        radius_px=there.radius_px[:, :, None],
        mean_radius_px=np.maximum(there.radius_px.mean(axis=1), 1e-6),
        sharpness=there.sharpness[:, :, None],
        recession=there.recession[:, :, None],
        erosion=there.erosion[:, :, None],
        dilation=there.dilation[:, :, None],
        leak=there.leak[:, :, None],
        smear=there.smear[:, :, None],
        outline_px=sightings.furthest_px,
        outward=OUTWARD,
        rows_px=sightings.rows_px,
        depth_m=centre_cam[:, 2],
        first_depth_m=float(centre_cam[nearest, 2]),
        view_ratio=np.broadcast_to(ratio[:, None, None], (*there.radius_px.shape, 1)),
        camera=sightings.cameras[0].intrinsics,
        times_s=sightings.times_s - sequence.setting.times_s[0],
        moving=moving,
    )


def _add_image_columns(J: Array, sequence: OutlineTask, under: tuple[Model, Array], met: _Met, places: Places) -> None:
    """Add the derivatives through corrected samples and through outline shifts."""
    (model, theta), contacts, row = under, sequence.contacts, sequence.contacts.sighting
    recorded = np.concatenate(sequence.task.sightings.outlines_px)
    arms = Arms.of(recorded, row, len(J))
    for effect, part in model.touching("correct", "shift"):
        alone, silent = Model((effect,)), effect.silent(theta[part])
        for number in np.flatnonzero(~silent):
            column, step = N_PARAMETERS + part.start + int(number), float(alone.steps[number])
            up, down = effect.slope_at(theta[part]).copy(), effect.slope_at(theta[part]).copy()
            up[number], down[number] = up[number] + step, down[number] - step
            if overrides(effect, "correct"):
                high, low = (corrected_points(sequence, alone, each, recorded, row) for each in (up, down))
                along = contacts.mean(np.sum((high - low) * contacts.normal, axis=1)) / met.size[:, None]
                J[..., column] += (along - met.gap * (arms.growth(high - low) / met.size)[:, None]) / (2.0 * step)
            high_px, low_px = (effect.displaced(each, places, sequence.setting) for each in (up, down))
            if high_px is not None and low_px is not None:
                J[..., column] -= (high_px - low_px)[..., 0] / (2.0 * step)
