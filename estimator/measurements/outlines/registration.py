"""A campaign of tangency errors as one of outlines sample by sample: the same sequences, particles and flights."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from datasets.observation import CalibratedView
from estimator.appearance.model_errors import SequenceTask
from estimator.appearance.sector_shape import sector_shape
from estimator.data.configuration import Configuration
from estimator.effects.instrument.surface_amplitudes import SurfaceAmplitudes
from estimator.effects.link import EffectModel
from estimator.effects.model import Model
from estimator.effects.registry import MODELS
from estimator.fitting.campaigns.campaign import CampaignState, layout_of
from estimator.fitting.campaigns.registered import Registered
from estimator.fitting.campaigns.weighing_again import UNFLYABLE
from estimator.measurements.outlines.contacts import SECTORS, contacts_at
from estimator.measurements.outlines.frame_noise import whole, with_frame_noise
from estimator.measurements.outlines.kind import Outlines
from estimator.measurements.outlines.surfaces import Flown, about_joint_surface, hull_shape, with_surface
from estimator.measurements.outlines.task import OutlineTask, placed_at
from estimator.motion.flight import Flight
from estimator.particle.particle import Particle
from estimator.surface.amplitudes import Amplitudes
from estimator.surface.joint import usual_deviation
from estimator.surface.shape import own_noise_px
from estimator.surface.star_surface import SUBDIVISIONS, Surface

Array = NDArray[np.float64]
NONE = np.zeros(0)
"""Parameters (0,) of a model without effects."""
PUSHED = (MODELS["uniform_acceleration"],)
"""Under which surfaces are made first: whatever pushes flights, or measures their times wrong, is to bend no surface."""


def by_samples(
    registered: Registered,
    effects: Sequence[EffectModel],
    configuration: Configuration,
    *,
    stated: tuple[EffectModel, ...] = (),
    subdivisions: int = SUBDIVISIONS,
) -> Registered:
    """The campaign with every sample of its outlines in use, about the surfaces that views and frames show together in free flights.

    About the hulls of the views where flights run away. The surfaces, of so many ``subdivisions``, answer to all ``effects``;
    ``stated``: clocks and lenses that are stated to be uncertain.
    """
    campaign = registered.campaign
    possible = tuple(each for each in effects if campaign.kind.why_not(campaign, each) is None and not each.random)
    kind, free = Outlines(0, possible, configuration.huber, configuration.seed, stated), Model((*stated, *PUSHED))
    found: dict[int, Flown] = {}
    right = whole(registered)
    for number, particle in enumerate(registered.particles):
        rows = [i for i, p in enumerate(campaign.particle) if p == number]
        if not rows:
            continue
        hull, layout = hull_shape(particle, subdivisions), layout_of(campaign.part(rows), free)
        flights = [replace(registered.start.flights[i], offset_px=0.0) for i in rows]
        both = zip(rows, flights, strict=True)
        bare = [_bare(campaign.sequences[i], flight, particle, hull.surface, kept=right[i]) for i, flight in both]
        flown = [Flown(task, flight, free, np.zeros(free.size), at) for task, flight, at in zip(bare, flights, layout.places, strict=True)]
        try:
            made = about_joint_surface(flown, layout.p, kind)
        except UNFLYABLE:
            made = with_surface(flown, hull, kind)
        found |= dict(zip(rows, made, strict=True))
    count = max(each.task.amplitudes.count for each in found.values())
    every = [found[i].padded(count) for i in range(len(campaign.sequences))]
    sequences, wide = [_as_of_free_flight(each.task) for each in every], Model((SurfaceAmplitudes(count), *free.effects))
    at = [(each.flight, wide, np.concatenate([each.task.contacts.amplitude, each.theta])) for each in every]
    return replace(
        registered,
        campaign=replace(campaign, sequences=tuple(with_frame_noise(sequences, at)), kind=replace(kind, amplitudes=count)),
        start=CampaignState(tuple(each.flight for each in every), tuple(NONE for _ in every)),
    )


def _as_of_free_flight(task: OutlineTask) -> OutlineTask:
    """The task with a surface that free flight is fitted about as it is, unless flights ran away where it was to be made."""
    return replace(task, under=None if task.under is None else ())


def _bare(sequence: SequenceTask, flight: Flight, particle: Particle, surface: Surface, *, kept: NDArray[np.bool_]) -> OutlineTask:
    """The sequence with the samples' contacts at a free flight, with a surface that nothing moves, its outlines' shapes not tabled."""
    none = Amplitudes.none(surface)
    sightings = sequence.task.sightings
    _, placed = placed_at(sequence, flight, Model(), NONE)
    return OutlineTask(
        **{name: getattr(sequence, name) for name in SequenceTask.__dataclass_fields__ if name != "made_at"},
        particle=particle,
        contacts=contacts_at(none, NONE, sightings, placed, np.concatenate(sightings.outlines_px)),
        sectors=sector_shape([np.zeros((0, 2))] * len(sightings), np.zeros((len(sightings), 3, 2)), SECTORS),
        amplitudes=none,
        own_px=np.full(len(sightings), own_noise_px(sightings.silhouettes)),
        view_px_m=float(np.median([_px_m(view, particle.body.com_particle) for view in particle.calibrated])),
        deviation=usual_deviation(particle),
        kept=kept,
    )


def _px_m(view: CalibratedView, place: Array) -> float:
    """Size (m) of a view's pixel at a ``place`` (3,) m, particle frame."""
    return float(np.linalg.norm(view.R_cam_particle @ place + view.t_cam_particle) / view.intrinsics.fx_px)
