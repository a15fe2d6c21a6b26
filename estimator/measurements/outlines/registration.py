"""A campaign of tangency errors as one of outlines sample by sample: the same sequences, particles and flights."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array, diags_array

from datasets.observation import CalibratedView
from estimator.appearance.flight_errors import particle_poses
from estimator.appearance.model_errors import SequenceTask, centres_cam
from estimator.appearance.prediction import predict
from estimator.data.configuration import Configuration
from estimator.effects.link import EffectModel
from estimator.effects.model import Model
from estimator.fitting.campaigns.campaign import CampaignState
from estimator.fitting.campaigns.registered import Registered
from estimator.geometry.sector_shape import sector_shape
from estimator.measurements.outlines.contacts import SECTORS, contacts_at
from estimator.measurements.outlines.kind import Outlines
from estimator.measurements.outlines.task import OutlineTask, outline_errors, with_sectors
from estimator.motion.flight import N_PARAMETERS, Flight
from estimator.particle.particle import Particle
from estimator.surface.amplitudes import Amplitudes, Felt, amplitudes_of
from estimator.surface.joint import JointFit, joint_fit
from estimator.surface.mass import N_MASS
from estimator.surface.shape import Shape, made_shape, own_noise_px

Array = NDArray[np.float64]


def by_samples(registered: Registered, effects: Sequence[EffectModel], configuration: Configuration) -> Registered:
    """The campaign with every sample of its outlines in use; its surfaces answer to whatever ``effects`` may be asked for."""
    campaign = registered.campaign
    model = Model(tuple(each for each in effects if campaign.kind.why_not(campaign, each) is None and not each.random))
    found: dict[int, tuple[OutlineTask, Flight]] = {}
    for number, particle in enumerate(registered.particles):
        rows = [i for i, p in enumerate(campaign.particle) if p == number]
        flights = [registered.start.flights[i] for i in rows]
        of_one = _of_particle(particle, [campaign.sequences[i] for i in rows], flights, model, configuration)
        found |= dict(zip(rows, of_one, strict=True))
    count = max(task.amplitudes.count for task, _ in found.values())
    every = [found[i] for i in range(len(campaign.sequences))]
    return replace(
        registered,
        campaign=replace(campaign, sequences=tuple(_padded(task, count) for task, _ in every), kind=Outlines(count)),
        start=CampaignState(tuple(flight for _, flight in every), tuple(np.zeros(0) for _ in every)),
    )


def _of_particle(
    particle: Particle, sequences: Sequence[SequenceTask], flights: Sequence[Flight], model: Model, configuration: Configuration
) -> list[tuple[OutlineTask, Flight]]:
    """The sequences of one particle and their flights, whose mass properties are deviations from those of its surface."""
    huber, seed = configuration.huber, configuration.seed
    begin = flights, made_shape(particle, huber=huber, seed=seed)
    joint = joint_fit(particle, [s.task.sightings for s in sequences], begin, sequences[0].task.prior, huber=huber, seed=seed)
    shape = Shape(joint.surface, joint.noise_px[0])
    bare = [_with_contacts(sequence, particle, joint, k) for k, sequence in enumerate(sequences)]
    felt = [_felt(sequence, flight, model) for sequence, flight in zip(bare, joint.flights, strict=True)]
    amplitudes, here = amplitudes_of(particle, flights[0].body, shape, felt, huber=huber)
    mass = amplitudes.mass[:, 0] + amplitudes.mass[:, 1:] @ here
    return [
        (_with_amplitudes(task, amplitudes, here), replace(flight, com=flight.com - mass[:3], inertia=flight.inertia - mass[3:]))
        for task, flight in zip(bare, joint.flights, strict=True)
    ]


def _with_contacts(sequence: SequenceTask, particle: Particle, joint: JointFit, number: int) -> OutlineTask:
    """The sequence of flight ``number`` of a joint fit with the samples' contacts there, with a surface that nothing moves."""
    flight, noise = joint.flights[number], joint.noise_px[1 + number] / joint.outline_noise_px[1 + number]
    none = Amplitudes(joint.surface, np.zeros((joint.surface.vertices.size, 0)), np.zeros((N_MASS, 1)))
    sightings = sequence.task.sightings
    prediction = predict(flight, Model(), np.zeros(0), sequence.setting, sightings.times_s, rows_px=sightings.rows_px)
    placed = particle_poses(flight, prediction.poses, sightings)
    contacts = contacts_at(none, np.zeros(0), sightings, placed, np.concatenate(sightings.outlines_px))
    task = OutlineTask(
        **{name: getattr(sequence, name) for name in SequenceTask.__dataclass_fields__},
        contacts=contacts,
        amplitudes=none,
        own_px=np.full(len(sightings), own_noise_px(sightings.silhouettes)),
        view_px_m=float(np.median([_px_m(view, particle.body.com_particle) for view in particle.calibrated])),
        deviation=joint.deviation,
        kept=np.ones(len(sightings), dtype=np.bool_),
        sectors=sector_shape([], np.zeros((0, 3, 2)), SECTORS),
        noise=noise,
    )
    return with_sectors(task, prediction, centres_cam(flight, placed))


def _px_m(view: CalibratedView, place: Array) -> float:
    """Size (m) of a view's pixel at a ``place`` (3,) m, particle frame."""
    return float(np.linalg.norm(view.R_cam_particle @ place + view.t_cam_particle) / view.intrinsics.fx_px)


def _with_amplitudes(task: OutlineTask, amplitudes: Amplitudes, here: Array) -> OutlineTask:
    contacts = task.contacts.with_amplitudes(amplitudes, here)
    return replace(task, contacts=contacts, amplitudes=amplitudes, setting=replace(task.setting, mass=amplitudes.mass))


def _padded(task: OutlineTask, count: int) -> OutlineTask:
    """With amplitudes that move nothing, up to a ``count``."""
    here = np.pad(task.contacts.amplitude, (0, count - task.amplitudes.count))
    return _with_amplitudes(task, task.amplitudes.padded(count), here)


def _felt(sequence: OutlineTask, flight: Flight, model: Model) -> Felt:
    """What the sequence's residuals feel: by the corners, and by the flight and all effects of a model."""
    theta = _tried(model)
    errors = outline_errors(sequence, flight, model, theta)
    weight = np.where(errors.seen, 1.0 / np.sqrt(errors.variance), 0.0)
    by_corner = csr_array(diags_array(weight.ravel()) @ sequence.contacts.by_corner)
    return Felt(by_corner, errors.J.reshape(-1, N_PARAMETERS + model.size))


def _tried(model: Model) -> Array:
    """Parameters of a model at which every effect shows: those that are searched for at their first start, all sizes small."""
    return np.concatenate([np.zeros(0), *(model.steps[part] for part in model.slices)])
