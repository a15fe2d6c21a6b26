"""One sequence of a campaign of outlines, sample by sample: residuals against a model with effects, and their derivatives.

Residuals are how far outside of the outline that the surface casts the samples of each sector lie in the mean, less what effects displace
it by, over their standard deviation: (n, k) of n sightings and k sectors. The prediction is the chain that tangency errors use
(:mod:`estimator.appearance.model_errors`), ended with the samples themselves.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property

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
from estimator.appearance.outline_tables import MOST_TURNED_DEG, picture_motions, turned_deg
from estimator.appearance.prediction import Prediction, predict
from estimator.appearance.sector_shape import sector_shape
from estimator.data.fit_task import OUTWARD, Sightings, restricted
from estimator.effects.catalogue.segmentation.view_outline_offset import ViewOutlineOffset
from estimator.effects.instrument.surface_amplitudes import SurfaceAmplitudes
from estimator.effects.link import EffectModel, Places
from estimator.effects.model import Model, holds_of, overrides
from estimator.geometry.epipolar_tangency import PoseSet
from estimator.geometry.hollows import hollow_share
from estimator.geometry.outline_shape import OutlineShape
from estimator.likelihood.rows import Residuals, Rows
from estimator.measurements.outlines.contacts import MOVED_PX, SECTORS, Contacts, contacts_at
from estimator.motion.flight import N_PARAMETERS, OFFSET, Flight
from estimator.particle.particle import Particle
from estimator.surface.amplitudes import Amplitudes

Array = NDArray[np.float64]


Placed = tuple[Prediction, PoseSet]
"""What is predicted of a sequence, and the poses that its cameras see."""


@dataclass(frozen=True)
class OutlineTask(SequenceTask):
    """A sequence whose outlines are fitted sample by sample.

    ``particle`` it shows; ``contacts``: what the samples meet; ``sectors``: the shape of the outlines there; ``amplitudes`` of the
    particle's surface; ``own_px`` (n,) noise of each outline's samples; ``view_px_m``: m per px of the calibrated views, in the median;
    ``views_px``: by how much their outlines are drawn too large, as far as the surface knows; ``deviation`` (8,) of mass properties from
    the surface's; ``noise`` over what the outlines show; ``kept`` (n,) sightings in use;
    ``alike``: over how many frames noise is alike; ``under``: keys of the effects under which the surface was fitted to views and frames,
    ``None``: it was not.
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
    views_px: float = 0.0
    alike: float = 1.0
    under: tuple[str, ...] | None = None

    @property
    def variance(self) -> Array:
        """Variance (n, k) px² of the sectors' mean residuals."""
        return np.asarray((self.noise * self.own_px[:, None]) ** 2 / np.maximum(self.contacts.count, 1.0))

    @property
    def repeats(self) -> Array:
        """Over how many sightings the noise of each sector is alike (k,)."""
        return np.full(SECTORS, self.alike)

    def take(self, rows: NDArray[np.int64]) -> "OutlineTask":
        """With the sightings ``rows`` (k,), in ascending order, alone."""
        return replace(
            self,
            task=restricted(self.task, rows),
            setting=self.setting.take(rows),
            shape=self.shape.take(rows),
            made_at=None if self.made_at is None else self.made_at[rows],
            contacts=self.contacts.take(rows),
            own_px=self.own_px[rows],
            kept=self.kept[rows],
            sectors=self.sectors.take(rows),
        )


@dataclass(frozen=True)
class OutlineResiduals(Residuals):
    """Residuals with what the sectors are ``met`` at."""

    met: "_Met" = field(kw_only=True)

    @property
    def places(self) -> Places:
        """Of the sectors, (n, k, 1, ...)."""
        return self.met.places

    @property
    def left_px(self) -> Array:
        """What is left (s,) px of every sample: its distance with what effects do to its sector."""
        sector = self.e * np.sqrt(self.variance) - self.met.gap
        return np.asarray(self.met.gaps + sector.ravel()[self.met.sequence.contacts.cell])


@dataclass(frozen=True)
class OutlineErrors(OutlineResiduals, Rows):
    """Residuals and their derivatives."""


def outline_errors(sequence: OutlineTask, flight: Flight, model: Model, theta: Array) -> OutlineErrors:
    """Residuals and derivatives at a flight and effect parameters ``theta`` (q,)."""
    return linearised(outline_residuals(sequence, flight, model, theta), model, theta)


def outline_residuals(sequence: OutlineTask, flight: Flight, model: Model, theta: Array, at: Placed | None = None) -> OutlineResiduals:
    """Residuals at a flight and effect parameters ``theta`` (q,); ``at``: where those place the body, if that is known."""
    contacts, (prediction, placed) = sequence.contacts, at or placed_at(sequence, flight, model, theta)
    met = _met(sequence, (model, theta), prediction, (placed, centres_cam(flight, placed)))
    e = met.gap + contacts.by_amplitude @ (theta[amplitudes_in(model)] - contacts.amplitude) - flight.offset_px
    e += sequence.views_px * met.view_ratio[:, None]
    if model.touching("shift"):
        e -= model.displaced(theta, met.places, sequence.setting)[..., 0]
    seen = contacts.seen & sequence.kept[:, None] & np.isfinite(e)
    e = np.where(seen, e, 0.0) / np.sqrt(sequence.variance)
    return OutlineResiduals(e, seen, sequence.variance, prediction, sequence.noise, model.random_sigma(theta), met=met)


def linearised(at: OutlineResiduals, model: Model, theta: Array) -> OutlineErrors:
    """Residuals with their derivatives, which take longer than they do themselves; ``theta`` (q,) of the model."""
    met, prediction, amplitudes = at.met, at.prediction, amplitudes_in(model)
    sequence, weight = met.sequence, at.seen / np.sqrt(at.variance)
    J = (met.by_pose * weight[..., None]) @ scaled_sensitivity(sequence.task.sightings, model, theta, prediction, met.centre_cam)
    J[..., OFFSET.start] -= weight
    J[..., N_PARAMETERS + amplitudes.start : N_PARAMETERS + amplitudes.stop] += sequence.contacts.by_amplitude * weight[..., None]
    _add_image_columns(J, (model, theta), met, weight)
    J[..., N_PARAMETERS + np.flatnonzero(model.frozen)] = 0.0
    e, rate, seen = at.e, rate_of(at), at.seen
    if not np.isfinite(J.ravel() @ J.ravel()):
        there = np.isfinite(J).all(axis=-1) & np.isfinite(rate)
        J[~there] = 0.0
        e, rate, seen = np.where(there, e, 0.0), np.where(there, rate, 0.0), seen & there
    return OutlineErrors(e, seen, at.variance, prediction, at.noise, at.jitter_s, met=met, rate=rate, J=J)


def rate_of(at: OutlineResiduals) -> Array:
    """Rate (n, k) 1/s of residuals by the time of their row."""
    weight = at.seen / np.sqrt(at.variance)
    return np.asarray(np.einsum("nka,na->nk", at.met.by_pose, np.hstack([at.prediction.velocity, at.prediction.omega])) * weight)


def amplitudes_in(model: Model) -> slice:
    """Where the surface's amplitudes lie among a model's parameters."""
    for effect, part in zip(model.effects, model.slices, strict=True):
        if isinstance(effect, SurfaceAmplitudes):
            return part
    return slice(0, 0)


def drawn_too_large_px(model: Model, theta: Array) -> float:
    """By how many px outlines of the calibrated views are drawn too large under a model at ``theta`` (q,)."""
    offsets = (float(theta[part][0]) for e, part in zip(model.effects, model.slices, strict=True) if isinstance(e, ViewOutlineOffset))
    return sum(offsets, start=0.0)


def placed_at(sequence: SequenceTask, flight: Flight, model: Model, theta: Array) -> Placed:
    """The prediction under a model at ``theta`` (q,), and the poses that the cameras see."""
    sightings = sequence.task.sightings
    prediction = predict(flight, model, theta, sequence.setting, sightings.times_s, rows_px=sightings.rows_px, seen=sightings.seen)
    return prediction, particle_poses(flight, prediction.poses, sightings, scale=model.scale(theta))


def with_contacts(sequence: OutlineTask, flight: Flight, model: Model, theta: Array) -> OutlineTask:
    """The sequence with its contacts and tables made at a flight; as it is where that hardly moves its outlines; ``theta`` (q,)."""
    prediction, placed = at = placed_at(sequence, flight, model, theta)
    amplitude = theta[amplitudes_in(model)]
    if moved_px(sequence, placed, amplitude) < MOVED_PX:
        return sequence
    if moved_px(sequence, sequence.contacts.placed, amplitude) > MOVED_PX:
        sequence = replace(sequence, made_at=None)  # the surface itself has moved
    return with_sectors(with_contacts_at(sequence, at, model, theta), prediction, centres_cam(flight, placed))


def with_contacts_at(sequence: OutlineTask, at: Placed, model: Model, theta: Array) -> OutlineTask:
    """The sequence with its contacts made where a model at ``theta`` (q,) places the body."""
    sightings, (_, placed) = sequence.task.sightings, at
    samples = corrected_points(sequence, model, theta, np.concatenate(sightings.outlines_px), sequence.contacts.sighting)
    return replace(sequence, contacts=contacts_at(sequence.amplitudes, theta[amplitudes_in(model)], sightings, placed, samples))


def with_sectors(sequence: OutlineTask, prediction: Prediction, centre_cam: Array) -> OutlineTask:
    """The sequence with the shape of the outlines that its surface casts where its contacts were found, as of nearly the same rotations.

    An outline that has only moved in the picture keeps its shape. ``centre_cam`` (n, 3) m of the body, camera axes.
    """
    placed = sequence.contacts.placed
    if turned_deg(sequence.made_at, placed.R) < MOST_TURNED_DEG:
        return sequence
    surface = sequence.amplitudes.surface_at(sequence.contacts.amplitude)
    outlines = cast_outlines(sequence.task, placed, replace(surface.sphere.mesh, vertices=surface.vertices))
    motions = picture_motions(sequence, moving_at(sequence, prediction, centre_cam))
    return replace(sequence, sectors=sector_shape(outlines, motions, SECTORS), made_at=placed.R, hollow=hollow_share(outlines))


def moved_px(sequence: OutlineTask, placed: PoseSet, amplitude: Array) -> float:
    """Root mean square (px) by which the points that samples meet have moved in the pictures since they were found.

    ``placed``: poses (n,) of the body now, camera axes; ``amplitude`` (m,) of the surface.
    """
    contacts, sightings = sequence.contacts, sequence.task.sightings
    now, before = (_pixels(contacts, sightings, each)[1] for each in (placed, contacts.placed))
    surface = contacts.by_amplitude @ (amplitude - contacts.amplitude)
    return float(np.sqrt(np.mean(np.sum((now - before) ** 2, axis=1)) + np.mean(surface[contacts.seen] ** 2)))


@dataclass(frozen=True, eq=False)
class _Met:
    """The sectors of a ``sequence`` at a ``prediction``.

    ``gap`` (n, k) px, of every sample ``gaps`` (s,); ``centre_cam`` (n, 3) m of the body and ``point`` (s, 3) m of it that samples meet,
    camera axes; ``focal`` (n, 2) px over the ``size`` (n,) of corrected outlines over recorded ones.
    """

    sequence: OutlineTask
    prediction: Prediction
    gap: Array
    gaps: Array
    centre_cam: Array
    point: Array
    focal: Array
    size: Array

    @cached_property
    def by_pose(self) -> Array:
        """Derivatives (n, k, 6) of the gap by translation (m) and left rotation vector (rad), world frame."""
        R = self.sequence.task.sightings.R_cam_world
        return -np.concatenate([self._across @ R, self.sequence.contacts.mean(np.cross(self._arms, self._each)) @ R], axis=2)

    @cached_property
    def _recorded(self) -> tuple[Array, Arms]:
        """The recorded samples (s, 2) px, and from where outlines grow."""
        sightings, row = self.sequence.task.sightings, self.sequence.contacts.sighting
        recorded = np.concatenate(sightings.outlines_px)
        return recorded, Arms.of(recorded, row, len(sightings))

    def corrected(self, effect: EffectModel, up: Array, down: Array) -> Array:
        """By how much (n, k) px the gap is wider where samples are corrected with an effect's parameters ``up`` than with ``down`` (q,)."""
        sequence, contacts, (recorded, arms) = self.sequence, self.sequence.contacts, self._recorded
        times = sequence.since_start
        told = holds_of(effect, "picture_moves", "correct")
        further, back = (effect.picture_moves(each, times) if told else None for each in (up, down))
        if further is not None and back is not None:
            moved = sequence.task.sightings.seen.only(effect.camera, back - further)
            return np.asarray(np.einsum("nkx,nx->nk", contacts.mean_normal, moved) / self.size[:, None])
        high, low = (corrected_points(sequence, Model((effect,)), each, recorded, contacts.sighting) for each in (up, down))
        along = contacts.mean(np.sum((high - low) * contacts.normal, axis=1)) - self.gap * arms.growth(high - low)[:, None]
        return np.asarray(along / self.size[:, None])

    @cached_property
    def _arms(self) -> Array:
        """From the body's centre (s, 3) m to where samples meet it, camera axes."""
        return np.asarray(self.point - self.centre_cam[self.sequence.contacts.sighting])

    @cached_property
    def _each(self) -> Array:
        """Where (s, 3) px/m the outline moves most with the body at each sample, camera axes: outward along planes that touch the body."""
        contacts, point = self.sequence.contacts, self.point
        u, v = (contacts.normal * self.focal[contacts.sighting]).T
        return np.column_stack([u, v, -(u * point[:, 0] + v * point[:, 1]) / point[:, 2]]) / point[:, 2:]

    @cached_property
    def _across(self) -> Array:
        return self.sequence.contacts.mean(self._each)

    @property
    def view_ratio(self) -> Array:
        """Px (n,) of error per px by which outlines of the calibrated views are off."""
        focal = self.sequence.task.sightings.silhouettes.focal_px
        return np.asarray(-self.sequence.view_px_m * focal.mean(axis=1) / self.centre_cam[:, 2])

    @cached_property
    def places(self) -> Places:
        """What effects on pictures know of the sectors, which count as one tangency (n, k, 1) each."""
        sequence, contacts, centre_cam, there = self.sequence, self.sequence.contacts, self.centre_cam, self.sequence.sectors
        sightings = sequence.task.sightings
        moving = moving_at(sequence, self.prediction, centre_cam)
        focal = sightings.silhouettes.focal_px
        return Places(
            point_px=contacts.mean(np.concatenate(sightings.outlines_px))[:, :, None],
            normal=_unit(contacts.mean_normal)[:, :, None],
            normal_body=(_unit(self._across) @ (sightings.R_cam_world @ self.prediction.poses.R[:, 0]))[:, :, None],
            velocity_px=moving.velocity_px(contacts.mean(self._arms), focal)[:, :, None],
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
            first_depth_m=centre_cam[sightings.first, 2],
            view_ratio=np.broadcast_to(self.view_ratio[:, None, None], (*there.radius_px.shape, 1)),
            seen=sightings.seen,
            times_s=sequence.since_start,
            moving=moving,
        )


def _met(sequence: OutlineTask, under: tuple[Model, Array], prediction: Prediction, at: tuple[PoseSet, Array]) -> _Met:
    """The sectors under a model at poses with centres (n, 3) m, camera axes."""
    (placed, centre_cam), sightings, contacts = at, sequence.task.sightings, sequence.contacts
    row, recorded = contacts.sighting, np.concatenate(sightings.outlines_px)
    samples = corrected_points(sequence, *under, recorded, row)
    size = np.ones(len(sightings))
    if samples is not recorded:
        size += Arms.of(recorded, row, len(sightings)).growth(samples - recorded)
    point, pixels, focal = _pixels(contacts, sightings, placed)
    gaps = np.sum((samples - pixels) * contacts.normal, axis=1) / size[row]
    return _Met(sequence, prediction, contacts.mean(gaps), gaps, centre_cam, point, focal / size[:, None], size)


def _pixels(contacts: Contacts, sightings: Sightings, placed: PoseSet) -> tuple[Array, Array, Array]:
    """The points that samples meet, (s, 3) m in camera axes and (s, 2) px, and focal lengths (n, 2) px."""
    row, lenses = contacts.sighting, [camera.intrinsics for camera in sightings.cameras]
    point = np.einsum("sij,sj->si", placed.R[row], contacts.point) + placed.t[row]
    pixels = np.empty((len(point), 2))
    for number, lens in enumerate(lenses):
        mine = sightings.camera[row] == number
        pixels[mine] = lens.project(point[mine])
    return point, pixels, np.array([[c.fx_px, c.fy_px] for c in lenses])[sightings.camera]


def _unit(vectors: Array) -> Array:
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-300))


def _add_image_columns(J: Array, under: tuple[Model, Array], met: _Met, weight: Array) -> None:
    """Add the derivatives through corrected samples and through outline shifts, times a ``weight`` (n, k)."""
    model, theta = under
    for effect, part in model.touching("correct", "shift"):
        steps, silent = Model((effect,)).steps, effect.silent(theta[part])
        for number in np.flatnonzero(~silent):
            up, down = effect.slope_at(theta[part]).copy(), effect.slope_at(theta[part]).copy()
            up[number], down[number] = up[number] + steps[number], down[number] - steps[number]
            column, share = N_PARAMETERS + part.start + int(number), weight / (2.0 * steps[number])
            if overrides(effect, "correct"):
                J[..., column] += met.corrected(effect, up, down) * share
            if not overrides(effect, "shift"):
                continue
            high, low = (effect.displaced(each, met.places, met.sequence.setting) for each in (up, down))
            if high is not None and low is not None:
                J[..., column] -= met.places.seen.only(effect.camera, high - low)[..., 0] * share
