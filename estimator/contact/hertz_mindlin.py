"""Hertz–Mindlin without slip on a clump of spheres: the simplified force law of commercial discrete element codes.

With depth δ, radius R of the touching sphere (the plate is flat), total tangential displacement s:

    Fₙ = 4/3 E*√R δ^1.5,  F_t = -8 G*√(Rδ) s,  damping 2√(5/6) β √(S m*) times the velocity in both directions,
    Sₙ = 2E*√(Rδ),  S_t = 8G*√(Rδ),  Fₙ ≥ 0,  |F_t| ≤ μFₙ for spring and damper together, S_t |s| ≤ μFₙ,
    1/E* = Σ(1-ν²)/E,  1/G* = Σ 2(2-ν)(1+ν)/E.

Keeping Fₙ ≥ 0 changes the restitution that comes out to exp[-2β arccos(β)/√(1-β²)] (arcosh and √(β²-1) past β = 1), so β is found from the
restitution asked for. m* of sphere i is 1/Σⱼ K_ij over the spheres that touch, K_ij the normal velocity that a unit normal impulse at j
gives to i (and at most m): that is 1/Kₙₙ for one eccentric contact and m/N where N share a level landing, so that both deliver the
restitution asked for.

The contact point is the lowest point of the undeformed sphere, R below its centre.

Limits: S_t changes with δ while s stays, so the tangential spring alone does not quite keep energy; no slip inside the contact area
[Mindlin & Deresiewicz 1953 have it]; e the same at every speed; no adhesion; gravity, 1e-5 of the contact forces, is left out.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from datasets.errors import InputError, TumbleError
from datasets.vocabulary.plate import Plate
from estimator.contact.clump import Clump
from estimator.contact.clump_kernel import SLIP, push
from estimator.contact.collision_matrix import collision_matrix, contact_axes
from estimator.contact.constants import require_friction, require_poisson, require_positive, require_restitution, require_young
from estimator.contact.laws import Pushed
from estimator.contact.rigid_impulses import require_approach
from estimator.contact.solid import BodyState

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Integration:
    """How the contact is followed.

    ``step_s``: 0 for adaptive steps, else every step is that long. ``energy_tolerance``: what the energy balance may be off, over the
    energy before. ``quiet_s``: how long no sphere has to touch until the impact is over.
    """

    step_s: float = 0.0
    energy_tolerance: float = 1e-4
    quiet_s: float = 0.0

    def __post_init__(self) -> None:
        require_positive(self.energy_tolerance, "energy tolerance", "of the energy before")
        for value, what in ((self.step_s, "time step"), (self.quiet_s, "time without contact")):
            if not math.isfinite(value) or value < 0.0:
                raise InputError(f"{what}: expected a number from 0 s upwards, got {value:g}")


@dataclass(frozen=True)
class HertzMindlin:
    """Young's moduli (Pa; infinite for a rigid plate), Poisson's ratios, the restitution delivered (above 0, to 1), Coulomb's friction."""

    young_particle_pa: float
    poisson_particle: float
    young_plate_pa: float
    poisson_plate: float
    restitution: float
    friction: float

    def __post_init__(self) -> None:
        require_young(self.young_particle_pa, "particle")
        require_young(self.young_plate_pa, "plate", rigid_allowed=True)
        require_poisson(self.poisson_particle, "particle")
        require_poisson(self.poisson_plate, "plate")
        require_restitution(self.restitution, lowest_allowed=False)
        require_friction(self.friction)

    @property
    def name(self) -> str:
        """The law in a few words."""
        return "Hertz–Mindlin, no slip"

    @property
    def effective_young_pa(self) -> float:
        """E* (Pa)."""
        soft = (1.0 - self.poisson_particle**2) / self.young_particle_pa
        return 1.0 / (soft + (1.0 - self.poisson_plate**2) / self.young_plate_pa)

    @property
    def effective_shear_pa(self) -> float:
        """G* (Pa)."""
        soft = 2.0 * (2.0 - self.poisson_particle) * (1.0 + self.poisson_particle) / self.young_particle_pa
        return 1.0 / (soft + 2.0 * (2.0 - self.poisson_plate) * (1.0 + self.poisson_plate) / self.young_plate_pa)

    def elastic_force_n(self, depth_m: float, radius_m: float) -> float:
        """Normal force (N) of the spring alone."""
        return 4.0 / 3.0 * self.effective_young_pa * math.sqrt(radius_m) * depth_m**1.5

    def through(self, state: BodyState, clump: Clump, plate: Plate, integration: Integration | None = None) -> Pushed:
        """Set the lowest sphere onto the plate, integrate until none touches, and report the state in the world again.

        Raises
        ------
        InputError
            Where the lowest sphere does not approach, or the energy balance shows that the time step is too large.
        """
        integration, axes = integration or Integration(), contact_axes(plate.normal_world)
        centres = np.ascontiguousarray(clump.centres_body @ state.R_world_body.T @ axes.T)
        inertia = axes @ clump.solid.inertia_world(state.R_world_body) @ axes.T
        y = np.zeros(SLIP + 2 * len(clump.radii))
        lowest = int(np.argmin(centres[:, 2] - clump.radii))
        y[2], y[3] = clump.radii[lowest] - centres[lowest, 2], 1.0
        y[7:10], omega = axes @ (state.v_world - plate.velocity_world), axes @ state.omega_world
        y[10:13] = inertia @ omega
        lever = np.array([centres[lowest, 0], centres[lowest, 1], -y[2]])
        arriving = y[7:10] + np.cross(omega, lever)
        require_approach(arriving[None])
        scale = _scales(self, clump, inertia, lever, arriving)
        start = y[:3].copy()
        body = (
            np.array([self.effective_young_pa, self.effective_shear_pa, damping_for(self.restitution), self.friction]),
            clump.solid.mass_kg,
            np.linalg.inv(inertia),
            centres,
            np.ascontiguousarray(clump.radii, dtype=np.float64),
        )
        reach = float((np.linalg.norm(centres, axis=1) + clump.radii).max() / np.linalg.eigvalsh(inertia)[0])
        left, deepest, off, steps, most, ended = push(
            y, body, scale, 1e-3 * scale[0] / -arriving[2], integration.step_s, integration.quiet_s, reach
        )
        _require_balance(float(off), integration, ended=bool(ended))
        turn = Rotation.from_quat(y[3:7], scalar_first=True).as_matrix()
        spin = turn @ np.linalg.solve(inertia, turn.T @ y[10:13])
        after = BodyState(
            state.x_world + axes.T @ (y[:3] - start) + plate.velocity_world * left,
            axes.T @ turn @ axes @ state.R_world_body,
            axes.T @ y[7:10] + plate.velocity_world,
            axes.T @ spin,
        )
        return Pushed(after, float(left), float(deepest), float(off), int(steps), int(most))


def clamped_restitution(damping: float) -> float:
    """Restitution that comes out at a ``damping`` ratio β when the force is kept from pulling."""
    if damping < 1.0:
        return math.exp(-2.0 * damping * math.acos(damping) / math.sqrt(1.0 - damping * damping))
    beyond = math.sqrt(damping * damping - 1.0)
    return math.exp(-2.0 * damping * (math.acosh(damping) / beyond if beyond > 0.0 else 1.0))


def damping_for(restitution: float) -> float:
    """β that delivers ``restitution`` (above 0, to 1)."""
    if restitution >= 1.0:
        return 0.0
    return float(brentq(lambda beta: clamped_restitution(beta) - restitution, 0.0, 1.0 + 1.0 / math.sqrt(restitution), xtol=1e-15))


def _scales(law: HertzMindlin, clump: Clump, inertia: Array, lever: Array, arriving: Array) -> Array:
    """What counts as one of each state variable: the depth a sphere reaches, the speed of the contact point, and what follows."""
    effective = 1.0 / collision_matrix(clump.solid.mass_kg, inertia, lever)[2, 2]
    radius = float(clump.radii.max())
    depth = (15.0 * effective * arriving[2] ** 2 / (16.0 * law.effective_young_pa * math.sqrt(radius))) ** 0.4
    speed, size = float(np.linalg.norm(arriving)), float(np.linalg.norm(lever))
    scale = np.full(SLIP + 2 * len(clump.radii), depth)
    scale[3:7] = depth / size
    scale[7:10] = speed
    scale[10:13] = float(np.trace(inertia)) / 3.0 * speed / size
    scale[13] = clump.solid.mass_kg * speed**2
    return scale


def _require_balance(off: float, integration: Integration, *, ended: bool) -> None:
    if ended and off <= integration.energy_tolerance:
        return
    if integration.step_s > 0.0:
        raise InputError(
            f"time step {integration.step_s:g} s is too large for this contact: expected the energy balance to hold to "
            f"{integration.energy_tolerance:g} of the energy before, got {off:.3g}"
        )
    raise TumbleError(f"contact not followed to its end: energy balance off by {off:.3g} of the energy before")
