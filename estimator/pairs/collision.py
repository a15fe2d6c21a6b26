"""What a collision was: contact point and normal from the hulls at the shared pose, restitution, impulse, and whether momentum was kept.

With ``r`` the mass ratio, first over second: the jumps of velocity are ``D_1 = J / m_1`` and ``D_2 = -J / m_2``, so ``D_1 - D_2 = (1 + r)
J / m_1`` gives the impulse, and ``r D_1 + D_2`` is nought where momentum is kept. The least-squares ``r`` of that is the mass ratio that
momentum itself shows. Along the normal ``n`` at the contact point the relative velocity is ``u``, and ``e = -u_n after / u_n before``.

Every uncertainty comes from states drawn from the joint covariance of both motions, hulls and all: the nearest features of two polytopes
change with the pose, and no derivative tells how.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from datasets.estimate import CollisionEstimate, Measured
from datasets.observation import Observation
from estimator.fitting.pair_fit import TIME, PairFlight, PairRefined, parameter_maps
from estimator.geometry.mass_properties import solid_of
from estimator.motion.piecewise import Touch, touch_and_sensitivity
from estimator.motion.rotation import rotation_from_vector
from estimator.pairs.nearest import Nearest
from estimator.pairs.touching import Hulls, hulls_of, nearest_at
from estimator.particle import Particle

Array = NDArray[np.float64]
DRAWS = 100
STATE = 18
"""Of one particle: position, rotation, v and omega before, v and omega after."""
VOLUME_SHARE = 0.02
"""Standard deviation of the ratio of two hulls' volumes, relative: each is too large by a few per cent, much alike."""
WEIGHED_SHARE = 1e-3
KEPT_PROBABILITY = 0.999
"""A change of momentum as large as the observed one, or larger, is rarer than one in a thousand where it is none."""


@dataclass(frozen=True)
class _Struck:
    """One state of both at the impact: the nearest features and what follows from them."""

    near: Nearest
    approach: float
    separation: float
    impulse: Array

    @property
    def restitution(self) -> float:
        return -self.separation / self.approach

    @property
    def impulse_ratio(self) -> float:
        along = float(self.impulse @ self.near.normal)
        return float(np.linalg.norm(self.impulse - along * self.near.normal)) / abs(along)


def collision_of(refined: PairRefined, particles: tuple[Particle, Particle], observation: Observation) -> CollisionEstimate:
    """The collision of two refined flights."""
    touches, J = _touches(refined)
    ratio, source = mass_ratio(particles, observation)
    bodies = hulls_of(particles)
    pair = PairFlight(refined.first.flight, refined.second.flight)
    state = np.concatenate([np.concatenate([t.before[0], t.after[0]]) for t in touches])
    struck = _struck((pair, touches), bodies, (np.zeros(2 * STATE), state), ratio.value)
    covariance = J @ refined.covariance @ J.T
    drawn, ratios = _drawn((pair, touches), bodies, (covariance, state), ratio)
    kept = _momentum(state, covariance, ratio)
    return CollisionEstimate(
        time_s=refined.first.flight.bounces[0].time_s,
        time_sigma_s=float(np.sqrt(refined.covariance[TIME, TIME])),
        point_world=struck.near.point,
        normal_world=struck.near.normal,
        normal_sigma_rad=_turn(struck.near.normal, [d.near.normal for d in drawn]),
        gap_m=Measured(struck.near.gap_m, _spread([d.near.gap_m for d in drawn])),
        approach_ms=Measured(struck.approach, _spread([d.approach for d in drawn])),
        separation_ms=Measured(struck.separation, _spread([d.separation for d in drawn])),
        restitution=Measured(struck.restitution, _spread([d.restitution for d in drawn])),
        impulse_per_mass=struck.impulse,
        impulse_ratio=Measured(struck.impulse_ratio, _spread([d.impulse_ratio for d in drawn])),
        mass_ratio=ratio,
        mass_source=source,
        momentum_mass_ratio=Measured(_momentum_ratio(state, covariance), _spread(ratios)),
        momentum_change_ms=kept[0],
        momentum_sigma_ms=np.sqrt(np.diag(kept[1])),
        momentum_kept=bool(kept[0] @ np.linalg.solve(kept[1], kept[0]) <= chi2.ppf(KEPT_PROBABILITY, 3)),
    )


def mass_ratio(particles: tuple[Particle, Particle], observation: Observation) -> tuple[Measured, str]:
    """First mass over second: as weighed, or as the hulls' volumes where both are taken to be of one density."""
    second = observation.companion.mass_kg if observation.companion is not None else None
    if observation.mass_kg is not None and second is not None:
        ratio = observation.mass_kg / second
        return Measured(ratio, WEIGHED_SHARE * ratio), "weighed"
    ratio = float(solid_of(particles[0].hull).volume / solid_of(particles[1].hull).volume)
    return Measured(ratio, VOLUME_SHARE * ratio), "volumes"


def _touches(refined: PairRefined) -> tuple[tuple[Touch, Touch], Array]:
    """Both at the impact, and the derivative (36, p) of their states by the pair's parameters."""
    found = [touch_and_sensitivity(part.flight, 0) for part in refined.both]
    J = np.vstack([J @ M for (_, J), M in zip(found, parameter_maps(), strict=True)])
    return (found[0][0], found[1][0]), J


def _struck(found: tuple[PairFlight, tuple[Touch, Touch]], hulls: Hulls, at: tuple[Array, Array], ratio: float) -> _Struck:
    """The collision for poses shifted and turned by ``at[0]`` (36,) and velocities ``at[1]`` (24,)."""
    (shift, v), (pair, touches) = at, found
    places = [t.x[0] + shift[STATE * k : STATE * k + 3] for k, t in enumerate(touches)]
    turns = [rotation_from_vector(shift[None, STATE * k + 3 : STATE * k + 6])[0] @ t.R[0] for k, t in enumerate(touches)]
    near = nearest_at(pair, hulls, places, turns)
    rates = [[v[12 * k + 6 * s : 12 * k + 6 * s + 6] for k in (0, 1)] for s in (0, 1)]
    moving = [[r[:3] + np.cross(r[3:], near.point - x) for r, x in zip(side, places, strict=True)] for side in rates]
    approach, separation = (float((side[0] - side[1]) @ near.normal) for side in moving)
    jumps = [v[12 * k + 6 : 12 * k + 9] - v[12 * k : 12 * k + 3] for k in (0, 1)]
    return _Struck(near, approach, separation, np.asarray((jumps[0] - jumps[1]) / (1.0 + ratio)))


def _drawn(
    found: tuple[PairFlight, tuple[Touch, Touch]], hulls: Hulls, about: tuple[Array, Array], ratio: Measured
) -> tuple[list[_Struck], list[float]]:
    """Collisions of drawn states, and the mass ratio that each one's momentum shows."""
    covariance, state = about
    rng = np.random.default_rng(DRAWS)
    root = _root(covariance)
    rates = np.r_[6:STATE, STATE + 6 : 2 * STATE]
    drawn, ratios = [], []
    for _ in range(DRAWS):
        shift = root @ rng.standard_normal(2 * STATE)
        swollen = [b * (1.0 + s * rng.standard_normal() / np.abs(b).max()) for b, s in zip(hulls.vertices, hulls.sigma_m, strict=True)]
        v = state + shift[rates]
        drawn.append(
            _struck(found, Hulls((swollen[0], swollen[1]), hulls.sigma_m), (shift, v), ratio.value + ratio.sigma * rng.standard_normal())
        )
        ratios.append(_momentum_ratio(v, covariance))
    return drawn, ratios


def _root(covariance: Array) -> Array:
    """A square root of a covariance whose parameters have units far apart."""
    scale = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    values, vectors = np.linalg.eigh(covariance / scale[:, None] / scale)
    return np.asarray(scale[:, None] * vectors * np.sqrt(np.maximum(values, 0.0)))


def _jump_maps() -> tuple[Array, Array]:
    """The jumps of velocity (3, 36) of both from the states."""
    maps = []
    for k in (0, 1):
        D = np.zeros((3, 2 * STATE))
        D[:, STATE * k + 6 : STATE * k + 9] = -np.eye(3)
        D[:, STATE * k + 12 : STATE * k + 15] = np.eye(3)
        maps.append(D)
    return maps[0], maps[1]


def _momentum(state: Array, covariance: Array, ratio: Measured) -> tuple[Array, Array]:
    """The change of momentum (3,) over the second mass and its covariance (3, 3)."""
    first, second = (state[12 * k + 6 : 12 * k + 9] - state[12 * k : 12 * k + 3] for k in (0, 1))
    one, other = _jump_maps()
    D = ratio.value * one + other
    return ratio.value * first + second, np.asarray(D @ covariance @ D.T + ratio.sigma**2 * np.outer(first, first))


def _momentum_ratio(state: Array, covariance: Array) -> float:
    """The mass ratio by which momentum is kept best, in the metric of the second jump's covariance."""
    first, second = (state[12 * k + 6 : 12 * k + 9] - state[12 * k : 12 * k + 3] for k in (0, 1))
    other = _jump_maps()[1]
    weighed = np.linalg.solve(other @ covariance @ other.T, first)
    return -float(weighed @ second) / float(weighed @ first)


def _spread(values: list[float]) -> float:
    """Half of what the middle 68.3% of drawn values cover: ratios have long tails."""
    low, high = np.percentile(values, [15.87, 84.13])
    return 0.5 * float(high - low)


def _turn(normal: Array, drawn: list[Array]) -> float:
    """Root mean square of the drawn normals' turn, about each of two axes."""
    cosines = np.clip(np.array(drawn) @ normal, -1.0, 1.0)
    return float(np.sqrt(0.5 * np.mean(np.arccos(cosines) ** 2)))
