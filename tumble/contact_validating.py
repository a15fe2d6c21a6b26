"""Measured impacts from a folder of estimates and the observations they were made from, and what could not be used, named.

An estimate has poses and velocities, not the particle's shape: that comes from the calibrated views of its observation (or from a mesh),
and so does the plate. A run is left out where its estimate is not a converged one with impacts, where no plate is known, and where
the pictures after an impact fit the particle worse than those before it: then it broke.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from datasets.errors import InputError
from datasets.estimate import Estimate, Status
from datasets.estimate_files import read_estimate
from datasets.observation import Observation
from datasets.observation_files import read_observation
from datasets.vocabulary.plate import Plate
from estimator.contact.constants import require_positive
from estimator.contact.solid import Solid, SolidHull, solid_hull_of
from estimator.contact_validation.contacts import nominal
from estimator.contact_validation.measured import MeasuredImpact, measured_impact
from estimator.data.configuration import configuration_from_dict
from estimator.impacts.breakage import worse_after
from estimator.impacts.impact_contacts import CLEAR_CHI_SQUARE
from estimator.particle.observed import observed_particle
from tumble.reasons import grouped
from tumble.reporting import source_of
from tumble.result_files import estimates_in, observations_in
from tumble.tracked_bodies import read_mesh

Array = NDArray[np.float64]
DIAMOND_KG_M3 = 3515.0


ObservationOf = Callable[[str], Observation | None]


@dataclass(frozen=True)
class Known:
    """What is stated on the command line: the plate's ``normal_world``, ``density_kg_m3`` where nothing was weighed, a ``mesh`` file."""

    normal_world: tuple[float, ...] | None = None
    density_kg_m3: float = DIAMOND_KG_M3
    mesh: Path | None = None

    @property
    def enough(self) -> bool:
        """Whether shape and plate are stated, so that no observation is needed: trajectories have none."""
        return self.mesh is not None and self.normal_world is not None

    def __post_init__(self) -> None:
        require_positive(self.density_kg_m3, "density", "kg/m³")
        if self.normal_world is not None and not np.linalg.norm(self.normal_world) > 0.0:
            raise InputError(f"--plate: expected the plate's normal, not all zero, got {self.normal_world}")


@dataclass(frozen=True)
class Collected:
    """Impacts that can be used, and why runs are left out."""

    impacts: tuple[MeasuredImpact, ...]
    left_out: Mapping[str, str] = field(default_factory=dict)
    broken: tuple[str, ...] = ()


MOST_AWAY = 0.5
"""Share of the impacts that may not strike the plate; turned tangents and errors make some of them."""


def collected(estimates: Path, observations: Path | None, known: Known) -> Collected:
    """Impacts of every estimate.

    Raises
    ------
    InputError
        Where there are no estimates, no observations beside them, or no impact in any of them.
    """
    source = observations if observations is not None else source_of(estimates)
    if source is None and not known.enough:
        raise InputError(
            f"{estimates}: expected --observations FOLDER, the observations that the estimates were made from; came none. Estimates of "
            "trajectories have none: give --mesh FILE and --plate=X,Y,Z."
        )
    folders = {} if source is None else {folder.name: folder for folder in observations_in(source)}

    def observation_of(name: str) -> Observation | None:
        return read_observation(folders[name]) if name in folders else None

    found = collected_from(((read_estimate(path), observation_of) for path in estimates_in(estimates)), known)
    if not found.impacts and not found.broken:
        reasons = "\n".join(f"  {who}: {reason}" for who, reason in grouped(found.left_out))
        raise InputError(f"{estimates}: expected estimates with impacts on a plate, got none that can be used:\n{reasons}")
    _refuse_the_other_side(found.impacts, known)
    return found


def _refuse_the_other_side(impacts: Sequence[MeasuredImpact], known: Known) -> None:
    """Refuse a plate from whose other side the particles come.

    Raises
    ------
    InputError
        Where most impacts do not strike it.
    """
    if not impacts:
        return
    approaching = nominal(impacts).velocities[:, 2] < 0.0
    pushed = np.array([(i.after[:3] - i.state.v_world) @ i.plate.normal_world > 0.0 for i in impacts])
    missing = int(np.sum(~(approaching & pushed)))
    if missing > MOST_AWAY * len(impacts):
        way = "--plate" if known.normal_world is not None else "the plate of the observations"
        normal = ", ".join(f"{x:.3g}" for x in impacts[0].plate.normal_world)
        raise InputError(
            f"{way}: expected a normal that points to the side from which particles come, away from the plate, got ({normal}): "
            f"in {missing} of {len(impacts)} impacts the particle moves away from the plate before, or into it after. The world's y axis "
            "points down."
        )


def collected_from(runs: Iterable[tuple[Estimate, ObservationOf]], known: Known) -> Collected:
    """Impacts of estimates, each with what finds an observation by its name."""
    found = Collected((), {}, ())
    shapes: dict[bytes, SolidHull] = {}
    for estimate, observation_of in runs:
        found = _with(found, estimate, observation_of, (known, shapes))
    return found


def _with(found: Collected, estimate: Estimate, observation_of: ObservationOf, by: tuple[Known, dict[bytes, SolidHull]]) -> Collected:
    """What was collected, and one run more."""
    reason = unusable(estimate)
    observation = observation_of(estimate.name) if reason is None or may_have_broken(estimate) else None
    if reason is None and observation is None and not by[0].enough:
        reason = "its observation is not beside the others"
    broken = found.broken
    if estimate.status is Status.BROKEN and not estimate.impacts:
        broken = (*broken, estimate.name)
    if observation is not None:
        worse = worse_after(estimate, observation.clock.times_s)
        if worse is not None:
            reason, broken = worse, (*broken, estimate.name)
    if reason is None:
        try:
            return replace(found, impacts=(*found.impacts, *impacts_of(estimate, observation, *by)))
        except InputError as error:
            reason = str(error)
    return replace(found, left_out={**found.left_out, estimate.name: reason or ""}, broken=broken)


def unusable(estimate: Estimate) -> str | None:
    """Why an estimate has no impact to use; ``None`` where it has."""
    if estimate.status is not Status.CONVERGED:
        return f"{estimate.status.value}: {estimate.message}"
    if not estimate.impacts:
        return "there is no impact in it"
    if estimate.collision is not None:
        return "two particles collide in it, and none hits a plate"
    return None


def may_have_broken(estimate: Estimate) -> bool:
    """Whether the estimate has impacts and no more than a second contact speaks against it: a chipped particle often looks like one."""
    return bool(estimate.impacts) and estimate.status in {Status.CONVERGED, Status.SECOND_CONTACT, Status.BROKEN}


def impacts_of(
    estimate: Estimate, observation: Observation | None, known: Known, shapes: dict[bytes, SolidHull]
) -> tuple[MeasuredImpact, ...]:
    """The impacts of one estimate; ``shapes`` keeps particles that several runs share. Without an observation ``known`` is enough.

    Raises
    ------
    InputError
        Where no plate is known, the particle has no volume, or no impact was a single contact.
    """
    if known.normal_world is None and (observation is None or observation.plate is None):
        raise InputError("no plate is stated; give its normal with --plate=X,Y,Z")
    key = b"" if observation is None else _key(observation)
    if key not in shapes:
        shapes[key] = shape_of(observation, estimate, known)
    hull = fitted_hull(shapes[key], estimate)
    single = [number for number in range(len(estimate.impacts)) if not several_contacts(estimate, number)]
    if not single:
        raise InputError("each of its impacts was more than one contact")
    chosen = [(number, estimate.impacts[number]) for number in single]
    return tuple(measured_impact(estimate.name, k, impact, hull, _plate(observation, known, impact.x_world)) for k, impact in chosen)


def several_contacts(estimate: Estimate, number: int) -> bool:
    """Whether an impact was measured to be more than one contact, of which a contact model says nothing."""
    told = estimate.statistics.get("impacts", [])
    return number < len(told) and (told[number].get("chi_square", 0.0) > CLEAR_CHI_SQUARE or not told[number].get("clear", True))


def _plate(observation: Observation | None, known: Known, place: Array) -> Plate:
    stated = None if observation is None else observation.plate
    if known.normal_world is None:
        assert stated is not None
        return stated
    normal = np.array(known.normal_world) / np.linalg.norm(known.normal_world)
    return Plate(place, normal) if stated is None else replace(stated, normal_world=normal)


def _key(observation: Observation) -> bytes:
    """The same for observations with the same calibrated views, whose shape is made once."""
    outlines = observation.view_recording
    parts = [v.t_cam_particle.tobytes() for v in observation.views]
    if isinstance(outlines, tuple | list):
        parts += [np.asarray(o.points_px).tobytes() for o in outlines]
    else:
        parts.append(observation.name.encode())
    return b"".join(parts)


def shape_of(observation: Observation | None, estimate: Estimate, known: Known) -> SolidHull:
    """The particle in its own frame (vertices in the particle frame): the mesh, or what the calibrated views show."""
    if known.mesh is not None:
        mesh = read_mesh(known.mesh)
        vertices = np.asarray(mesh.vertices)
    else:
        assert observation is not None
        particle = observed_particle(observation, configuration_from_dict(estimate.configuration))
        mesh, vertices = particle.hull, particle.convex_vertices
    filled = solid_hull_of(mesh, known.density_kg_m3)
    scale = 1.0 if observation is None or observation.mass_kg is None else observation.mass_kg / filled.solid.mass_kg
    solid = Solid(filled.solid.mass_kg * scale, filled.solid.volume_m3, filled.solid.inertia_body * scale)
    return SolidHull(solid, vertices)


def fitted_hull(shape: SolidHull, estimate: Estimate) -> SolidHull:
    """``shape`` (vertices in the particle frame) in the body frame of the estimate, with the inertia ratios that the flight showed."""
    body = estimate.body
    assert body is not None
    largest = float(np.linalg.eigvalsh(shape.solid.inertia_body)[2])
    solid = Solid(shape.solid.mass_kg, shape.solid.volume_m3, np.diag(largest * body.inertia_ratios))
    return SolidHull(solid, (shape.vertices_body - body.com_particle) @ body.R_particle_body)
