"""From the observations of a campaign to its task and the free flights it starts from.

Recordings with the same calibrated views show one particle; its hull, start catalogue and the views' likeness are made once. A recording
with impacts gives a sequence for each of its flights. One that cannot be measured is left out and named, the rest goes on.
"""

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely
from numpy.typing import NDArray

from datasets.errors import InputError
from datasets.observation import CalibratedView, Observation
from estimator.appearance.model_errors import SequenceTask
from estimator.appearance.outline_tables import OutlineTables, with_tables
from estimator.appearance.rim import rim_of
from estimator.data.configuration import ALWAYS, Configuration
from estimator.data.fit_task import FitTask, restricted
from estimator.data.no_measurement import NoMeasurement
from estimator.data.views import Views
from estimator.effects.choosing import catalogue
from estimator.effects.instrument.uncertain_clock import uncertain_clocks
from estimator.effects.instrument.uncertain_lens import uncertain_lenses
from estimator.effects.link import Setting
from estimator.effects.model import Model
from estimator.fitting.campaigns.campaign import Campaign, CampaignState
from estimator.fitting.campaigns.registered import LeftOut, Registered
from estimator.fitting.side_by_side import each_of
from estimator.fitting.tasks import fit_task
from estimator.geometry.outline_shape import outline_shape
from estimator.impacts.chains import WEAK_RATIO, Seen
from estimator.likelihood.time_gaps import longest_stretch
from estimator.measurements.outlines.registration import by_samples
from estimator.measurements.silhouettes.flights_of_drops import FreeFlight, free_flights_of
from estimator.measurements.silhouettes.kind import SILHOUETTES
from estimator.measurements.silhouettes.stated_facts import stated_facts
from estimator.motion.flight import Flight
from estimator.outlines.result import OutlineTrack
from estimator.outlines.sightings import bias_pairs, pictures_of, tracks_of, usable_sightings
from estimator.particle.observed import observed_particle
from estimator.particle.particle import Particle, views_like
from estimator.search.candidate_flights import candidate_flights, first_pose
from estimator.search.clock_alignment import aligned
from estimator.search.rival_flights import few_views

Array = NDArray[np.float64]
HOPELESS_COST = 50.0
"""Cost per pair (1 is expected) of a free flight that no effect explains: one through an impact costs 200."""


def register(
    observations: Sequence[Observation], configuration: Configuration, *, told: Callable[[str], None] = lambda _: None
) -> Registered:
    """Find the particle in every sequence and fit free flights, each for itself.

    ``told`` is called with the name of each that is done.
    """
    keys = [_digest(observation.views) for observation in observations]
    particles: dict[str, tuple[int, Particle, Views | None]] = {}
    found: dict[int, _Found | LeftOut] = {}
    likened: list[int] = []
    for number, (key, observation) in enumerate(zip(keys, observations, strict=True)):
        if key in particles and particles[key][2] is not None:
            likened.append(number)
            continue
        found[number] = first = _found_first(observation, particles, key, configuration)
        told(observation.name)
        if isinstance(first, _Found):
            particles[key] = (*particles[key][:2], first.views)
    rest = each_of(
        lambda i: _found(observations[i], *particles[keys[i]][1:], configuration),
        likened,
        particles,
        observations,
        told=lambda i: told(observations[i].name),
    )
    found |= dict(zip(likened, rest, strict=True))
    cameras: dict[str, int] = {}
    right = [(i, each) for i in range(len(observations)) if isinstance(each := found[i], _Found)]
    flown = [(i, *flight) for i, each in right for flight in each.flights]
    clocks = uncertain_clocks((c.name, t) for i, _ in right for c, t in zip(observations[i].cameras, observations[i].clocks, strict=True))
    stated = (*clocks, *uncertain_lenses(camera for i, _ in right for camera in observations[i].cameras))
    campaign = Campaign(
        sequences=tuple(task for _, task, _ in flown),
        particle=tuple(particles[keys[i]][0] for i, _, _ in flown),
        camera=tuple(cameras.setdefault(repr(observations[i].cameras), len(cameras)) for i, _, _ in flown),
        floor_px=configuration.floor_px,
        body_noise_px=configuration.body_noise_px,
        kind=replace(SILHOUETTES, stated=stated),
        recording=tuple(observations[i].name for i, _, _ in flown) if any(each.has_impacts for _, each in right) else (),
        cameras=tuple(dict.fromkeys(camera.name for i, _ in right for camera in observations[i].cameras)),
        facts=stated_facts([observations[i] for i, _ in right]),
    )
    start = CampaignState(tuple(flight for _, _, flight in flown), tuple(np.zeros(0) for _ in flown))
    left_out = tuple(each for i in range(len(observations)) if isinstance(each := found[i], LeftOut))
    registered = Registered(campaign, start, tuple(p for _, p, _ in particles.values()), left_out)
    if _sampled(registered, configuration):
        return by_samples(registered, tuple(catalogue(campaign.cameras).values()), configuration, stated=stated)
    return replace(registered, campaign=replace(campaign, sequences=_tabled(registered)))


def _tabled(registered: Registered) -> tuple[SequenceTask, ...]:
    """The sequences with their tables made where they begin, what all of a particle need with the first one's."""
    sequences, flights = registered.campaign.sequences, registered.start.flights
    first = [registered.campaign.particle.index(number) for number in sorted(set(registered.campaign.particle))]
    rest = [i for i in range(len(sequences)) if i not in first]

    def made(i: int) -> SequenceTask:
        return with_tables(sequences[i], flights[i], Model(), np.zeros(0))

    found = {i: made(i) for i in first} | dict(zip(rest, each_of(made, rest, registered), strict=True))
    return tuple(found[i] for i in range(len(sequences)))


def _sampled(registered: Registered, configuration: Configuration) -> bool:
    """Whether a campaign is fitted sample by sample: where that is asked for, of particles that many views show or always."""
    wanted, seen = configuration.campaign_surface_fit, [registered.particles[i] for i in set(registered.campaign.particle)]
    return bool(seen) and (wanted == ALWAYS or (wanted > 0 and not any(few_views(each) for each in seen)))


@dataclass(frozen=True)
class _Found:
    """The task and the free flight of each sequence of a recording, and the views' likeness that they were found with."""

    flights: tuple[tuple[SequenceTask, Flight], ...]
    views: Views
    has_impacts: bool = False


def _found_first(
    observation: Observation, particles: dict[str, tuple[int, Particle, Views | None]], key: str, configuration: Configuration
) -> _Found | LeftOut:
    """A sequence with which the likeness of its views is made, and the particle, too, where it is not among the ``particles`` yet."""
    if key not in particles:
        try:
            particles[key] = (len(particles), observed_particle(observation, configuration), None)
        except (NoMeasurement, InputError) as failure:
            return LeftOut(observation.name, str(failure))
    return _found(observation, *particles[key][1:], configuration)


def _found(observation: Observation, particle: Particle, views: Views | None, configuration: Configuration) -> _Found | LeftOut:
    """The particle in one sequence, or why there is none."""
    try:
        return _one(observation, particle, views, configuration)
    except (NoMeasurement, InputError) as failure:
        return LeftOut(observation.name, str(failure))


def _one(observation: Observation, particle: Particle, views: Views | None, configuration: Configuration) -> _Found:
    tracks = tracks_of(observation)
    sightings = usable_sightings(observation, tracks, configuration)
    pictures = pictures_of(observation, tracks, sightings)
    if views is None:
        views = views_like(particle, sightings.silhouettes, np.random.default_rng(configuration.seed), pictures)
    task = fit_task(observation, particle, sightings, views, configuration)
    found = _flown(Seen(observation, tracks, particle), aligned(observation, task, particle, configuration), views, configuration)
    flights = [replace(each, task=_as_stamped(each.task, observation)) for each in found]
    made = tuple((_sequence(each, (observation, tracks), particle, configuration), each.flight) for each in flights)
    return _Found(made, views, has_impacts=flights[0].number > 0)


def _as_stamped(task: FitTask, observation: Observation) -> FitTask:
    """The task with the stamps of all cameras as they are: what their clocks are off by is the model's business."""
    sightings = task.sightings
    stamps = [observation.clock_of(int(c)).times_s[f] for c, f in zip(sightings.camera, sightings.frame, strict=True)]
    return replace(task, sightings=replace(sightings, times_s=np.array(stamps)))


def _flown(seen: Seen, task: FitTask, views: Views, configuration: Configuration) -> tuple[FreeFlight, ...]:
    """The flights of a recording with impacts, or the one free flight that it is, number 0.

    Where that misses as a flight through an impact does, weaker kinks may be impacts, as where two follow one another closely.
    """
    pieces = free_flights_of(seen, task, views, configuration)
    if pieces:
        return pieces
    stretch = _without_jump(task)
    start = first_pose(stretch, seen.particle, configuration)
    best = candidate_flights(seen.observation, stretch, seen.particle, start, configuration)[0].solution
    if best.equations.cost > HOPELESS_COST * stretch.weight.size:
        pieces = free_flights_of(seen, task, views, configuration, least_ratio=WEAK_RATIO)
    return pieces or (FreeFlight(0, task, best.state),)


def _sequence(
    flown: FreeFlight, recorded: tuple[Observation, tuple[OutlineTrack, ...]], particle: Particle, configuration: Configuration
) -> SequenceTask:
    """A flight as a sequence without tables."""
    number, task, (observation, tracks) = flown.number, flown.task, recorded
    pictures = pictures_of(observation, tracks, task.sightings)
    names = [camera.name for camera in observation.cameras]
    setting = Setting(
        times_s=observation.clock.times_s,
        exposure_s=observation.clock.exposure_s,
        gravity_world=np.asarray(observation.gravity_world, dtype=np.float64),
        inertia_ratios=particle.body.inertia_ratios,
        clocks={} if not observation.camera_clocks else dict(zip(names[1:], observation.clocks[1:], strict=True)),
        edge_px=pictures.edge_px(task.sightings.camera) if pictures is not None else 0.0,
    )
    tables = OutlineTables(particle, task.views, bias_pairs(observation, configuration), configuration.seed, pictures)
    name = flight_name(observation.name, number) if number else observation.name
    rim = rim_of((particle.hull.vertices - particle.body.com_particle) @ particle.body.R_particle_body)
    return SequenceTask(name, task, setting, rim, outline_shape([np.zeros((0, 2))] * len(task.sightings)), tables, number=number)


def flight_name(recording: str, number: int) -> str:
    """What flight ``number`` (from 1) of a recording with impacts is called among the sequences of a campaign."""
    return f"{recording} flight {number}"


def _without_jump(task: FitTask) -> FitTask:
    """The task without the sightings beyond a jump; those of several cameras are left as they are."""
    sightings = task.sightings
    if len(sightings.cameras) > 1:
        return task
    silhouettes = sightings.silhouettes
    centres = np.array([_centre_px(silhouettes.points_px[silhouettes.slice_of(i)]) for i in range(len(sightings))])
    rows = longest_stretch(centres, sightings.times_s)
    return task if rows == slice(0, len(sightings)) else restricted(task, np.arange(len(sightings))[rows])


def _centre_px(polygon: Array) -> tuple[float, float]:
    centre = shapely.Polygon(polygon).centroid
    return float(centre.x), float(centre.y)


def _digest(views: Sequence[CalibratedView]) -> str:
    digest = hashlib.sha256()
    for view in views:
        digest.update(repr(view.intrinsics).encode())
        digest.update(np.ascontiguousarray(view.R_cam_particle).tobytes())
        digest.update(np.ascontiguousarray(view.t_cam_particle).tobytes())
    return digest.hexdigest()
