"""The surfaces of a campaign's particles, as views and frames show them together.

They are made with free flights, and anew where a search has ended with another model; about them they are amplitudes of what is
fitted. Each begins as the hull of the views again: edges and creases that formed without the frames, or under another model, do not go. By
how much the views' outlines are drawn too large under the model counts where their samples lie; from there on effects displace the frames'
outlines by as much as their parameters have changed.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array, diags_array

from estimator.appearance.model_errors import centres_cam
from estimator.effects.link import EffectModel
from estimator.effects.model import Model
from estimator.fitting.campaigns.campaign import Campaign, CampaignFit, CampaignState, layout_of
from estimator.measurements.outlines.contacts import MOVED_PX
from estimator.measurements.outlines.task import (
    OutlineTask,
    amplitudes_in,
    drawn_too_large_px,
    linearised,
    outline_errors,
    outline_residuals,
    placed_at,
    with_contacts_at,
    with_sectors,
)
from estimator.measurements.silhouettes.imagined import rows_of
from estimator.motion.flight import COM, INERTIA, N_PARAMETERS, OFFSET, Flight, moved
from estimator.particle.particle import Particle
from estimator.surface.amplitudes import Amplitudes, Felt, amplitudes_of
from estimator.surface.joint import HELD, Known, free_from, joined
from estimator.surface.samples import MovedViews, Samples
from estimator.surface.shape import SHARP, Shape, own_noise_px
from estimator.surface.star_surface import Surface, star_surface

Array = NDArray[np.float64]
Index = NDArray[np.int64]
DRAWN = 20
"""Outlines of each sequence that edges are drawn with; all of them from then on. v and omega of six controls were no further off than with
all from the start, and rounds take 0.6 of the CPU (notebook 66)."""


class Asked(Protocol):
    """What a kind says of its surfaces: the ``effects`` that they answer to, Huber's limit ``huber`` and the ``seed`` of random signs."""

    @property
    def effects(self) -> tuple[EffectModel, ...]:
        """Whatever may be asked for."""

    @property
    def huber(self) -> float:
        """Standard deviations beyond which a sample's influence stays constant."""

    @property
    def seed(self) -> int:
        """Of random signs."""


@dataclass(frozen=True)
class Flown:
    """A sequence's ``task`` with its ``flight`` and the effects ``model`` and parameters ``theta`` (q,), without amplitudes.

    ``place`` (21 + q,): where its parameters lie among those of all sequences of the particle. Without amplitudes the flight's mass
    properties are the body's, with them what those are off the surface's.
    """

    task: OutlineTask
    flight: Flight
    model: Model
    theta: Array
    place: Index = field(default_factory=lambda: np.arange(N_PARAMETERS))

    @property
    def own_px(self) -> float:
        """Noise that the outlines show by themselves."""
        return float(np.median(self.task.own_px))

    @property
    def mass(self) -> Array:
        """Mass properties (8,) of the body."""
        return np.concatenate([self.flight.com, self.flight.inertia])

    def samples(self, surface: Surface) -> Samples:
        """Every sample; motions move those of a sector by as much."""
        at = placed_at(self.task, self.flight, self.model, self.theta)
        task = with_contacts_at(replace(self.task, amplitudes=Amplitudes.none(surface)), at, self.model, self.theta)
        errors = linearised(outline_residuals(task, self.flight, self.model, self.theta, at), self.model, self.theta)
        contacts, by_motion = task.contacts, errors.J * np.sqrt(errors.variance)[..., None]
        seen = np.flatnonzero(errors.seen.ravel()[contacts.cell])
        starts = np.searchsorted(contacts.sighting[seen], np.arange(len(contacts.count) + 1))
        by_motion = by_motion.reshape(-1, by_motion.shape[-1])[contacts.cell[seen]]
        return Samples(errors.left_px[seen], starts, csr_array(contacts.by_sample[seen]), by_motion)

    @property
    def few(self) -> "Flown":
        """With so few outlines as edges are drawn with."""
        used = np.flatnonzero(self.task.kept)
        return replace(self, task=self.task.take(used[rows_of(len(used), DRAWN)]))

    def moved(self, step: Array) -> "Flown":
        """After a ``step`` (21 + q,)."""
        return replace(self, flight=moved(self.flight, step[:N_PARAMETERS]), theta=self.theta + step[N_PARAMETERS:])

    def padded(self, count: int) -> "Flown":
        """With amplitudes that move nothing, up to a ``count``."""
        task = self.task
        here = np.pad(task.contacts.amplitude, (0, count - task.amplitudes.count))
        return replace(self, task=_with_amplitudes(task, task.amplitudes.padded(count), here))


def refitted_surfaces(campaign: Campaign, fit: CampaignFit, kind: Asked) -> tuple[Campaign, CampaignState]:
    """The campaign about the surfaces that views and frames show together under a fit's model, and the state there."""
    part, amplitudes = amplitudes_in(fit.model), fit.model.effects[0]
    model = Model(tuple(each for each in fit.model.effects if each is not amplitudes))
    sequences, flights, thetas = list(campaign.sequences), list(fit.state.flights), list(fit.state.theta)
    for number in sorted(set(campaign.particle)):
        rows = [i for i, p in enumerate(campaign.particle) if p == number]
        layout = layout_of(campaign.part(rows), model)
        flown = [_without_amplitudes(campaign, fit, i, model, place) for i, place in zip(rows, layout.places, strict=True)]
        count = part.stop - part.start
        for i, new in zip(rows, about_joint_surface(flown, layout.p, kind, most=count), strict=True):
            padded = new.padded(count)
            sequences[i], flights[i] = padded.task, padded.flight
            thetas[i] = np.concatenate([padded.task.contacts.amplitude, padded.theta])
    return replace(campaign, sequences=tuple(sequences)), CampaignState(tuple(flights), tuple(thetas))


def about_joint_surface(flown: Sequence[Flown], size: int, kind: Asked, *, most: int | None = None) -> list[Flown]:
    """Sequences of one particle, of ``size`` parameters in all, about the surface that views and frames show together under their model.

    Edges are drawn with few frames, and come to rest with all of them. Views that disagree are moved and turned meanwhile (decision 78),
    and count from then on as calibrated there.
    """
    first = flown[0].task
    hull, known = hull_shape(first.particle, first.amplitudes.surface.sphere.subdivisions), partial(_known, size=size)
    asked: dict[str, Any] = {"huber": kind.huber, "seed": kind.seed, "views_px": first.views_px}
    if first.particle.disagreement.beyond_noise:
        asked["shifted"] = free_from(first.particle)
    drawn = joined(first.particle, hull, [each.few for each in flown], known, first=0, end=SHARP, **asked)
    flown = [replace(each, flight=by.flight, theta=by.theta) for each, by in zip(flown, drawn.recorded, strict=True)]
    placed = _with_views(first.particle, drawn.views)
    found = joined(placed, Shape(drawn.surface, drawn.noise_px[0]), flown, known, **asked)
    placed = _with_views(placed, found.views)
    noise = [each / own for each, own in zip(found.noise_px[1:], found.outline_noise_px[1:], strict=True)]
    ended = [
        replace(each, task=replace(each.task, particle=placed, noise=by, under=each.model.keys))
        for each, by in zip(found.recorded, noise, strict=True)
    ]
    return with_surface(ended, Shape(found.surface, found.noise_px[0]), kind, most=most)


def _with_views(particle: Particle, views: MovedViews) -> Particle:
    """The particle with its views calibrated where a fit has moved them to; as it is where it has not."""
    return replace(particle, calibrated=views.placed, recalibrated_px=views.sd_px) if views.moved_px.any() else particle


def hull_shape(particle: Particle, subdivisions: int) -> Shape:
    """The hull of a particle's views, as noisy as they show by themselves."""
    return Shape(star_surface(particle, subdivisions=subdivisions), own_noise_px(particle.seen))


def _without_amplitudes(campaign: Campaign, fit: CampaignFit, number: int, model: Model, place: Index) -> Flown:
    """Sequence ``number`` of a fit, its surface where the amplitudes have it."""
    task, theta = campaign.sequences[number], fit.state.theta[number]
    amplitude = theta[amplitudes_in(fit.model)]
    mass = task.amplitudes.mass[:, 0] + task.amplitudes.mass[:, 1:] @ amplitude
    flight = fit.state.flights[number]
    flight = replace(flight, com=flight.com + mass[:3], inertia=flight.inertia + mass[3:])
    none, views_px = Amplitudes.none(task.amplitudes.surface_at(amplitude)), drawn_too_large_px(fit.model, theta)
    bare = replace(task, amplitudes=none, setting=replace(task.setting, mass=None), views_px=views_px)
    return Flown(bare, flight, model, theta[amplitudes_in(fit.model).stop :], place)


def _known(flown: Sequence[Flown], size: int) -> Known:
    """Priors of the effects' parameters and of the outline offset, and that what moves outlines in pictures is held with that."""
    first = flown[0]
    precision, pull, within = np.zeros(size), np.zeros(size), np.full(size, np.inf)
    for each in flown:
        own = each.model.precision_at(each.theta)
        precision[each.place[N_PARAMETERS:]], pull[each.place[N_PARAMETERS:]] = own + _still(each.model), own * each.theta
        offset, held = each.place[OFFSET.start], each.task.task.prior.precision[OFFSET][0]
        precision[offset], pull[offset] = held, held * each.flight.offset_px
        within[offset] = HELD
        for effect, part in each.model.touching("correct", "shift"):
            if not effect.instrument:  # a lens has its own prior
                within[each.place[N_PARAMETERS:][part]] = HELD * each.model.steps[part]
    rows = np.flatnonzero(np.isfinite(within))
    return Known(first.flight.body, first.place[np.r_[COM, INERTIA]], np.diag(precision), pull, rows, within[rows])


def _still(model: Model) -> Array:
    """One (q,) for each parameter of a model that no step changes: numbers of frames, and the size of what is drawn anew in every frame."""
    still = model.frozen.astype(np.float64)
    for effect, part in zip(model.effects, model.slices, strict=True):
        still[part] += float(effect.random)
    return still


def with_surface(flown: Sequence[Flown], shape: Shape, kind: Asked, *, most: int | None = None) -> list[Flown]:
    """Sequences of one particle about a surface: their contacts, its amplitudes, and mass properties that are off those of the surface."""
    met = [replace(each, task=_met(each, shape.surface)) for each in flown]
    first = met[0]
    felt = [_felt(each, kind.effects) for each in met]
    particle, views_px = first.task.particle, first.task.views_px
    found, here = amplitudes_of(particle, first.flight.body, shape, felt, huber=kind.huber, views_px=views_px, most=most)
    mass = found.mass[:, 0] + found.mass[:, 1:] @ here
    made = []
    for each in met:
        flight = replace(each.flight, com=each.flight.com - mass[:3], inertia=each.flight.inertia - mass[3:])
        made.append(replace(each, task=_with_amplitudes(each.task, found, here), flight=flight))
    return made


def _met(flown: Flown, surface: Surface) -> OutlineTask:
    """What samples meet of a ``surface`` that nothing moves."""
    if flown.task.amplitudes.surface is surface and flown.task.made_at is not None:
        return flown.task
    moves = (surface.vertices - flown.task.amplitudes.surface.vertices).ravel()
    far = np.sqrt(np.mean((flown.task.contacts.by_sample @ moves) ** 2)) > MOVED_PX
    task = replace(flown.task, amplitudes=Amplitudes.none(surface), made_at=None if far else flown.task.made_at)
    prediction, placed = at = placed_at(task, flown.flight, flown.model, flown.theta)
    return with_sectors(with_contacts_at(task, at, flown.model, flown.theta), prediction, centres_cam(flown.flight, placed))


def _with_amplitudes(task: OutlineTask, amplitudes: Amplitudes, here: Array) -> OutlineTask:
    contacts = task.contacts.with_amplitudes(amplitudes, here)
    return replace(task, contacts=contacts, amplitudes=amplitudes, setting=replace(task.setting, mass=amplitudes.mass))


def _felt(flown: Flown, effects: Sequence[EffectModel]) -> Felt:
    """What the sequence's residuals feel: by the corners, and by the flight and all ``effects``, those of its model where they are.

    As noisy as outlines show by themselves: what is more may be an effect that is still to be found, about this same surface.
    """
    others = Model(tuple(each for each in effects if each.entry.key not in flown.model.keys))
    theta = np.concatenate([flown.theta, others.steps])  # every effect acts, those that are searched for at a small size
    model = Model((*flown.model.effects, *others.effects))
    errors = outline_errors(replace(flown.task, noise=1.0), flown.flight, model, theta)
    weight = np.where(errors.seen, 1.0 / np.sqrt(errors.variance), 0.0)
    contacts = flown.task.contacts
    by_corner = csr_array(diags_array(weight.ravel()) @ contacts.by_corner)
    of_samples = weight.ravel()[contacts.cell] / np.sqrt(np.maximum(contacts.count.ravel()[contacts.cell], 1.0))
    return Felt(by_corner, errors.J.reshape(-1, N_PARAMETERS + model.size), csr_array(diags_array(of_samples) @ contacts.by_sample))
