"""The law of force at one corner that touches the plate.

Only vertices of a polyhedron touch a plane; every one is taken as rounded with one radius ``R``. With ``d`` the overlap of vertex and
undeformed plate:

* normal, loading: ``N = 4/3 E* sqrt(R) d^1.5`` [Hertz 1882]. Unloading from the deepest overlap ``d_m`` runs to zero at
  ``d_p = (1 - e²) d_m``: ``N = 4/3 E* sqrt(R) d_e^1.5``, ``d_e = (d - d_p) / e²`` [in the manner of Walton and Braun, J. Rheol. 30 (1986)
  949]. So a corner gives back ``e²`` of the work of its compression at any speed and for any mass behind it: Stronge's ``e``.
* flow: where the work of compression exceeds ``W_yield``, ``e² (W / W_yield)^(-1/4)`` stands for ``e²`` [Johnson 1985, eq. 11.47].
* friction, rigid: ``-mu N u_t / max(|u_t|, u_0)``, with a creep ``u_0`` of a few ten-thousandths of the impact's speed.
* friction, compliant: ``dT = -S du_t dt``, ``S = ratio 8 G* sqrt(R d_e)``, ``T`` falling with ``S`` in unloading, ``|T| <= mu N``
  [Mindlin 1949; Thornton, Cummins and Cleary, Powder Technol. 233 (2013) 30: a spring that makes no energy].
* adhesion: on its way out from ``d_p`` a corner is held by ``4 F (s / reach)(1 - s / reach)``, ``s = d_p - d``.

Valid for small overlaps and slow impacts (no waves). That a rounded corner's centre lies inside of the vertex is left out.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from datasets.recipes.recipe import ContactRecipe, PlateRecipe


@dataclass(frozen=True)
class ContactLaw:
    """``stiffness`` (N/m^1.5), ``tangential_stiffness`` (N/m^1.5, of ``S / sqrt(d)``; 0: rigid friction), ``restitution``, ``friction``.

    ``yield_speed`` (m/s; infinite: none), ``pull_off_n`` (N) and ``reach_m`` (m), ``inverse_plate_mass`` (1/kg; 0: immovable).
    """

    stiffness: float
    restitution: float
    friction: float
    tangential_stiffness: float = 0.0
    yield_speed: float = math.inf
    pull_off_n: float = 0.0
    reach_m: float = 0.0
    inverse_plate_mass: float = 0.0


def contact_law(contact: ContactRecipe, other: PlateRecipe | ContactRecipe, hidden: Mapping[str, Mapping[str, float]]) -> ContactLaw:
    """The law of a recipe, with what is ``hidden`` in it (``datasets/vocabulary/contact_physics.py``: key, parameters).

    ``other`` is what is hit: the plate, or a particle of the same make.
    """
    root = math.sqrt(contact.corner_radius_mm * 1e-3)
    normal = sum((1 - side.poisson**2) / (side.youngs_gpa * 1e9) for side in (contact, other))
    shear = sum(2 * (2 - side.poisson) * (1 + side.poisson) / (side.youngs_gpa * 1e9) for side in (contact, other))
    adhesion = hidden.get("adhesion", {})
    return ContactLaw(
        stiffness=4 / 3 * root / normal,
        restitution=contact.restitution,
        friction=contact.friction,
        tangential_stiffness=hidden.get("tangential_compliance", {}).get("ratio", 0.0) * 8 * root / shear,
        yield_speed=hidden.get("velocity_dependent_restitution", {}).get("yield_speed", math.inf),
        pull_off_n=adhesion.get("pull_off", 0.0),
        reach_m=adhesion.get("reach", 0.0),
        inverse_plate_mass=hidden.get("yielding_plate", {}).get("inverse_mass", 0.0),
    )
