"""Hertz–Mindlin as a model on trial: on a clump that fills the hull, or on one small sphere at the corner that touches.

The clump is what discrete element codes have; where it touches beside the true corner, its outline error is in the prediction. The sphere
at the corner has the impulse model's contact point, so that the two differ by the contact's physics alone. The stiffness of the materials
only sets how long a contact lasts: scaling every modulus leaves the rebound unchanged, so restitution and friction are what is fitted.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from datasets.vocabulary.plate import Plate
from estimator.contact.clump import Clump
from estimator.contact.clump_generator import generated_clump
from estimator.contact.hertz_mindlin import HertzMindlin
from estimator.contact_validation.contacts import nominal
from estimator.contact_validation.laws.models import ContactModel, FreeParameter
from estimator.contact_validation.laws.point_contact import SLOWEST_MS
from estimator.contact_validation.measured import MeasuredImpact

Array = NDArray[np.float64]
CORNER_SHARE = 0.02
"""Radius of the sphere at the corner over the hull's extent."""
SMALLEST_SHARE = 0.01
"""Smallest radius of a clump's spheres over the hull's extent."""
PARAMETERS = (FreeParameter("restitution", (0.6,), (0.05, 1.0)), FreeParameter("friction", (0.15, 0.6), (0.0, 2.0)))
ClumpOf = Callable[[MeasuredImpact], Clump]


@dataclass(frozen=True)
class Materials:
    """Young's moduli (Pa) and Poisson's ratios of particle and plate; diamond on steel where nothing else is said.

    Raises
    ------
    InputError
        Where a constant is impossible.
    """

    young_particle_pa: float = 1143e9
    poisson_particle: float = 0.069
    young_plate_pa: float = 210e9
    poisson_plate: float = 0.30

    def __post_init__(self) -> None:
        self.law(1.0, 0.0)  # refuses impossible constants

    def law(self, restitution: float, friction: float) -> HertzMindlin:
        """The law with these constants."""
        return HertzMindlin(
            self.young_particle_pa, self.poisson_particle, self.young_plate_pa, self.poisson_plate, float(restitution), float(friction)
        )


def hertz_mindlin_at_corner(materials: Materials) -> ContactModel:
    """Hertz–Mindlin on one small sphere at the corner that touches."""
    return _force_model("hertz_mindlin", "Hertz–Mindlin at the corner", materials, corner_sphere)


def hertz_mindlin_clump(materials: Materials, impacts: Sequence[MeasuredImpact], spheres: int) -> ContactModel:
    """Hertz–Mindlin on a clump of at most ``spheres`` spheres for each particle among ``impacts``.

    Raises
    ------
    InputError
        Where no clump can be made.
    """
    clumps = {impact: generated_clump(impact.particle, spheres, smallest_radius_m=SMALLEST_SHARE * impact.extent_m) for impact in impacts}
    return _force_model("hertz_mindlin_clump", f"Hertz–Mindlin, {spheres} spheres", materials, clumps.__getitem__)


def corner_sphere(impact: MeasuredImpact) -> Clump:
    """A sphere whose lowest point towards the plate is the corner that touches."""
    radius = CORNER_SHARE * impact.extent_m
    centre = nominal([impact]).lever[0] + radius * impact.plate.normal_world
    return Clump(impact.particle.solid, (impact.state.R_world_body.T @ centre)[None], np.array([radius]))


def _force_model(key: str, title: str, materials: Materials, clump_of: ClumpOf) -> ContactModel:
    def predict(impacts: Sequence[MeasuredImpact], values: Array) -> Float[NDArray[np.float64], "impact 6"]:
        law = materials.law(*values.tolist())
        return np.stack([_through(law, impact, clump_of(impact)) for impact in impacts])

    return ContactModel(key, title, PARAMETERS, predict)


def _through(law: HertzMindlin, impact: MeasuredImpact, clump: Clump) -> Array:
    state = impact.state
    if approach(clump, impact, impact.plate) > -SLOWEST_MS:
        return np.concatenate([state.v_world, state.omega_world])
    after = law.through(state, clump, impact.plate).after
    return np.concatenate([after.v_world, after.omega_world])


def approach(clump: Clump, impact: MeasuredImpact, plate: Plate) -> float:
    """Normal velocity (m/s) of the lowest sphere's lowest point as seen from the plate."""
    state, n = impact.state, plate.normal_world
    arms = clump.centres_body @ state.R_world_body.T - clump.radii[:, None] * n
    lever = arms[int(np.argmin(arms @ n))]
    return float((state.v_world + np.cross(state.omega_world, lever) - plate.velocity_world) @ n)
