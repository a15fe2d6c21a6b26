"""What a collision was: contact point and normal from the hulls at the shared pose, restitution, impulse, and whether momentum was kept.

With ``r`` the mass ratio, first over second, the jumps of velocity are ``D_1 = J / m_1`` and ``D_2 = -r J / m_1``; both together, by their
covariance, give the impulse, and ``r D_1 + D_2`` is nought where momentum is kept. The least-squares ``r`` of that is the mass ratio that
momentum itself shows. Along the normal ``n`` at the contact point the relative velocity is ``u``, and ``e = -u_n after / u_n before``.

Which corner, edge or face met which is a choice among few, and the fit that holds the hulls together has made one. So values and
uncertainties of what depends on it are those of states drawn from the joint covariance of the motions *without* that hold, each counted
by how well its hulls touch: ``exp(-gap² / 2 sigma²)``. Medians, and half of what the middle 68.3% cover; of the impulse the means.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from datasets.estimate import CollisionEstimate, Measured
from datasets.observation import Observation
from estimator.motion.piecewise import Touch, touch_and_sensitivity
from estimator.motion.rotation import rotation_from_vector
from estimator.pairs.nearest import Nearest
from estimator.pairs.pair_fit import SHARED, PairRefined
from estimator.pairs.touching import Hulls, nearest_at
from estimator.particle.mass_properties import solid_of
from estimator.particle.particle import Particle

Array = NDArray[np.float64]
DRAWS = 600
"""Of both states; a half of the middle 68.3% is known to 5% by them."""
STATE = 18
"""Of one particle: position, rotation, v and omega before, v and omega after."""
VOLUME_SHARE = 0.02
"""Standard deviation of the ratio of two hulls' volumes, relative: each is too large by a few per cent, much alike."""
FACE_RAD = np.radians(0.7)
"""That of the direction of a hull's face about each of two axes; six collisions of cut stones gave errors of 0.0 to 1.3 degrees."""
WEIGHED_SHARE = 1e-3
"""Relative standard deviation of a ratio of weighed masses. By judgement."""
ACROSS = ("across_x", "across_y", "across_z")
KEPT_PROBABILITY = 0.999
"""A change of momentum as large as the observed one, or larger, is rarer than one in a thousand where it is none."""


@dataclass(frozen=True)
class _At:
    """Both at the impact: their touches, velocities ``state`` (24,) (v, omega before, then after, of each), ``covariance`` (36, 36)."""

    refined: PairRefined
    touches: tuple[Touch, Touch]
    state: Array
    covariance: Array


@dataclass(frozen=True)
class _Drawn:
    """Drawn collisions (d): ``weight`` adds to one, normals and points (d, 3), and numbers by name (d,)."""

    weight: Array
    normal: Array
    point: Array
    numbers: dict[str, Array]

    def measured(self, name: str) -> Measured:
        """Median and half of the middle 68.3% by weight."""
        low, middle, high = _quantiles(self.numbers[name], self.weight, (0.1587, 0.5, 0.8413))
        return Measured(middle, 0.5 * (high - low))


def collision_of(
    free: PairRefined, held: PairRefined, hulls: Hulls, particles: tuple[Particle, Particle], observation: Observation
) -> CollisionEstimate:
    """The collision of two refined flights; ``held`` are those whose hulls are held together at the impact, ``free`` are not."""
    ratio, source = mass_ratio(particles, observation)
    loose, tied = _at(free), _at(held)
    drawn, gaps = _draw(loose, hulls, ratio)
    normal = drawn.weight @ drawn.normal
    normal /= np.linalg.norm(normal)
    change, spread = _momentum(tied, ratio)
    return CollisionEstimate(
        time_s=held.state.first.bounces[0].time_s,
        time_sigma_s=float(np.sqrt(held.covariance[held.state.layout[SHARED]][:, held.state.layout[SHARED]].item())),
        point_world=drawn.weight @ drawn.point,
        normal_world=normal,
        normal_sigma_rad=_turn(normal, drawn),
        gap_m=Measured(_nearest(loose, hulls, np.zeros(2 * STATE)).gap_m, float(np.std(gaps))),
        approach_ms=drawn.measured("approach"),
        separation_ms=drawn.measured("separation"),
        restitution=drawn.measured("restitution"),
        impulse_per_mass=_impulse(tied.state, tied.covariance, ratio.value),
        impulse_ratio=_impulse_ratio(drawn),
        mass_ratio=ratio,
        mass_source=source,
        momentum_mass_ratio=Measured(_momentum_ratio(tied.state, tied.covariance), drawn.measured("momentum_ratio").sigma),
        momentum_change_ms=change,
        momentum_sigma_ms=np.sqrt(np.diag(spread)),
        momentum_kept=bool(change @ np.linalg.solve(spread, change) <= chdtri(3, 1.0 - KEPT_PROBABILITY)),
    )


def mass_ratio(particles: tuple[Particle, Particle], observation: Observation) -> tuple[Measured, str]:
    """First mass over second: as weighed, or as the hulls' volumes where both are taken to be of one density."""
    second = observation.companion.mass_kg if observation.companion is not None else None
    if observation.mass_kg is not None and second is not None:
        ratio = observation.mass_kg / second
        return Measured(ratio, WEIGHED_SHARE * ratio), "weighed"
    ratio = float(solid_of(particles[0].hull).volume / solid_of(particles[1].hull).volume)
    return Measured(ratio, VOLUME_SHARE * ratio), "volumes"


def _at(refined: PairRefined) -> _At:
    found = [touch_and_sensitivity(flight, 0) for flight in refined.state.both]
    J = np.zeros((2 * STATE, refined.state.layout.size))
    for k, ((_, own), place) in enumerate(zip(found, refined.state.places, strict=True)):
        J[STATE * k : STATE * (k + 1), place] = own
    touches = (found[0][0], found[1][0])
    state = np.concatenate([np.concatenate([t.before[0], t.after[0]]) for t in touches])
    return _At(refined, touches, state, J @ refined.covariance @ J.T)


def _nearest(at: _At, hulls: Hulls, shift: Array) -> Nearest:
    """The nearest features for poses shifted and turned by ``shift`` (36,)."""
    places = [t.x[0] + shift[STATE * k : STATE * k + 3] for k, t in enumerate(at.touches)]
    turns = [rotation_from_vector(shift[None, STATE * k + 3 : STATE * k + 6])[0] @ t.R[0] for k, t in enumerate(at.touches)]
    return nearest_at(at.refined.state, hulls, places, turns)


def _draw(at: _At, hulls: Hulls, ratio: Measured) -> tuple[_Drawn, Array]:
    """Collisions of drawn states, and the gaps (d,) m of all."""
    rng = np.random.default_rng(DRAWS)
    root = _root(at.covariance)
    rates = np.r_[6:STATE, STATE + 6 : 2 * STATE]
    shifts = [root @ rng.standard_normal(2 * STATE) for _ in range(DRAWS)]
    near = [_nearest(at, hulls, shift) for shift in shifts]
    gaps = np.array([n.gap_m for n in near])
    log_weight = -0.5 * gaps**2 / float(hulls.sigma_m @ hulls.sigma_m)
    weight = np.exp(log_weight - log_weight.max())
    normals = [rotation_from_vector(FACE_RAD * rng.standard_normal((1, 3)))[0] @ n.normal for n in near]
    ratios = ratio.value + ratio.sigma * rng.standard_normal(DRAWS)
    rows = [
        _numbers(at, shift, (n, normal), (at.state + shift[rates], float(r)))
        for shift, n, normal, r in zip(shifts, near, normals, ratios, strict=True)
    ]
    numbers = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    return _Drawn(weight / weight.sum(), np.array(normals), np.array([n.point for n in near]), numbers), gaps


def _numbers(at: _At, shift: Array, contact: tuple[Nearest, Array], moving: tuple[Array, float]) -> dict[str, float]:
    """What follows from one state: velocities ``moving[0]`` (24,), mass ratio ``moving[1]``."""
    (near, n), (v, ratio) = contact, moving
    arms = [near.point - t.x[0] - shift[STATE * k : STATE * k + 3] for k, t in enumerate(at.touches)]
    before, after = (
        [v[12 * k + 6 * side : 12 * k + 6 * side + 3] + np.cross(v[12 * k + 6 * side + 3 : 12 * k + 6 * side + 6], arms[k]) for k in (0, 1)]
        for side in (0, 1)
    )
    approach, separation = float((before[0] - before[1]) @ n), float((after[0] - after[1]) @ n)
    impulse = _impulse(v, at.covariance, ratio)
    along = float(impulse @ n)
    across = dict(zip(ACROSS, (impulse - along * n).tolist(), strict=True))
    return {
        "approach": approach,
        "separation": separation,
        "restitution": -separation / approach,
        "along": along,
        **across,
        "momentum_ratio": _momentum_ratio(v, at.covariance),
    }


def _impulse_ratio(drawn: _Drawn) -> Measured:
    """Tangential over normal impulse: of the mean vectors, since the mean of a loose vector's length is too long."""
    across = np.array([drawn.numbers[name] for name in ACROSS])
    along, mean = float(drawn.weight @ drawn.numbers["along"]), across @ drawn.weight
    length = float(np.linalg.norm(mean))
    spread = (mean / max(length, 1e-300)) @ across - length
    return Measured(length / abs(along), float(np.sqrt(drawn.weight @ spread**2)) / abs(along))


def _root(covariance: Array) -> Array:
    """A square root of a covariance whose parameters have units far apart."""
    scale = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    values, vectors = np.linalg.eigh(covariance / scale[:, None] / scale)
    return np.asarray(scale[:, None] * vectors * np.sqrt(np.maximum(values, 0.0)))


def _jump_map() -> Array:
    """The jumps of velocity (6, 36) of both from the states."""
    D = np.zeros((6, 2 * STATE))
    for k in (0, 1):
        D[3 * k : 3 * k + 3, STATE * k + 6 : STATE * k + 9] = -np.eye(3)
        D[3 * k : 3 * k + 3, STATE * k + 12 : STATE * k + 15] = np.eye(3)
    return D


def _jumps(v: Array) -> tuple[Array, Array]:
    return v[6:9] - v[:3], v[18:21] - v[12:15]


def _impulse(v: Array, covariance: Array, ratio: float) -> Array:
    """The impulse on the first over its mass (3,) m/s from both jumps, by least squares."""
    D = _jump_map()
    A = np.vstack([np.eye(3), -ratio * np.eye(3)])
    W = np.linalg.solve(D @ covariance @ D.T, A)
    return np.asarray(np.linalg.solve(A.T @ W, W.T @ np.concatenate(_jumps(v))))


def _momentum(at: _At, ratio: Measured) -> tuple[Array, Array]:
    """The change of momentum (3,) over the second mass and its covariance (3, 3)."""
    first, second = _jumps(at.state)
    D = np.hstack([ratio.value * np.eye(3), np.eye(3)]) @ _jump_map()
    return ratio.value * first + second, np.asarray(D @ at.covariance @ D.T + ratio.sigma**2 * np.outer(first, first))


def _momentum_ratio(v: Array, covariance: Array) -> float:
    """The mass ratio by which momentum is kept best, in the metric of the second jump's covariance."""
    first, second = _jumps(v)
    D = _jump_map()[3:]
    weighed = np.linalg.solve(D @ covariance @ D.T, first)
    return -float(weighed @ second) / float(weighed @ first)


def _quantiles(values: Array, weight: Array, shares: tuple[float, ...]) -> list[float]:
    order = np.argsort(values)
    reached = np.cumsum(weight[order]) - 0.5 * weight[order]
    return [float(np.interp(share, reached, values[order])) for share in shares]


def _turn(normal: Array, drawn: _Drawn) -> float:
    """Root mean square of the drawn normals' turn, about each of two axes."""
    angle = np.arccos(np.clip(drawn.normal @ normal, -1.0, 1.0))
    return float(np.sqrt(0.5 * drawn.weight @ angle**2))
