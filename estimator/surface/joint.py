"""The last fit of a free flight with the surface as a nuisance: every outline sample of every picture and every view.

Unknown are the flight (21 numbers) and the surface's corners. Samples of views bear on the surface alone, those of frames on both; corners
are held by what is believed of surfaces (:mod:`estimator.surface.evenness`), the flight's mass properties by those of the surface. The
normal matrix is an arrow: its sparse part, of the surface, is factorised and eliminated [Triggs et al., Bundle adjustment, 2000, section
6], so that the covariance of the flight is marginal over the surface.

What is not known of scale is found from the data: how rough the surface is and how noisy samples are, both by the fixed point at which the
evidence is largest [MacKay, Neural Computation 4 (1992) 415]; traces of the large inverse by random signs [Hutchinson, Communications in
Statistics 18 (1989) 1059]. Samples whose residuals are alike along an outline count as that many fewer.
"""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array, csr_array
from scipy.sparse.linalg import SuperLU, splu
from scipy.special import erf

from estimator.data.fit_task import Prior, Sightings
from estimator.fitting.refinement import scaled_inverse
from estimator.motion.flight import COM, INERTIA, N_PARAMETERS, OFFSET, Flight, moved
from estimator.particle.particle import Particle
from estimator.surface.evenness import BENT, Believed, believed
from estimator.surface.likeness import alike_in_time
from estimator.surface.mass import N_MASS, MassResponse, mass_response
from estimator.surface.samples import Samples, samples_of_frames, samples_of_views
from estimator.surface.star_surface import SUBDIVISIONS, Surface, star_surface

Array = NDArray[np.float64]
ALIGNED, MOST_ROUNDS = 8, 14
"""Rounds in which corners are drawn to edges, samples as noisy as their outlines show by themselves, and rounds at most."""
SETTLED, TURNED = 0.3, 0.6
"""Share of the standard deviations that ends the fit. Samples that change the edge they meet throw it about by as much and more, so that
every step that turns back shortens all that follow by the second number: their mean is what is looked for."""
PROBES = 8
"""Vectors of random signs a trace is estimated with: within a few percent of itself, by judgement."""
FIRST_ROUGHNESS = 0.03
"""Bend over the length of an edge that is expected first. Fits ended at 0.04 for smooth and cut bodies and at 0.1 for stones and jagged
ones in trial runs."""
SAMPLE_HUBER = 1.345
"""Deviations beyond which a sample's influence stays constant: 95% efficient where noise is normal [Huber and Ronchetti, Robust
Statistics, 2009]. With the true mesh in six sequences of diamonds, spins were 20% better with 1 than with 4 and depths 10% worse; in six
of matte bodies both were within 4% (docs/studies/surface_fit.md)."""
TO_DEVIATION, LEAST_PX = 1.4826, 1e-9
"""A normal distribution's standard deviation over its median absolute value, and what rounding leaves of a residual."""
MOST_CHANGE = 3.0
"""A roughness changes by no more than this factor from round to round."""
COM_SHARE, MOMENTS, PRODUCTS = 0.0006, 0.005, 0.002
"""Standard deviations of what a uniform surface's centre of mass (over its extent) and inertia (relative) are off by. In trial runs with 60
views five scanned bodies were within 0.0007, 0.007 and 0.003; one with a hollow was off by 0.003, 0.009 and 0.005."""


@dataclass(frozen=True)
class JointFit:
    """``flight`` with its ``covariance`` (21, 21) and the ``surface``; ``settled``: whether the steps became small.

    ``noise_px``: effective noise that samples of views and of frames were found to have; ``roughness`` of the surface, as found.
    """

    flight: Flight
    covariance: Array
    surface: Surface
    noise_px: tuple[float, float]
    roughness: float
    settled: bool


@dataclass(frozen=True)
class _Scales:
    """Effective noise (px) of samples of views and of frames, and the surface's roughness."""

    noise_px: tuple[float, float]
    roughness: float


@dataclass(frozen=True)
class _Step:
    """A Gauss-Newton step of the flight (21,) and of the corners (n, 3) m, the flight's covariance, and the scales found on the way."""

    flight: Array
    corners: Array
    covariance: Array
    scales: _Scales


def joint_fit(
    particle: Particle,
    sightings: Sightings,
    flight: Flight,
    prior: Prior,
    *,
    seed: int,
    huber: float = SAMPLE_HUBER,
    subdivisions: int = SUBDIVISIONS,
) -> JointFit:
    """Surface and flight from a flight that the tangents gave, by steps that take both along.

    ``huber``: standard deviations beyond which a sample's influence stays constant; ``seed`` of the random signs.
    """
    surface = star_surface(particle, subdivisions)
    extent = particle.extent_m
    deviation = np.array([COM_SHARE * extent] * 3 + [MOMENTS] * 2 + [PRODUCTS] * 3)
    flight = replace(flight, offset_px=0.0)
    scales = _Scales(_own_noise(particle, sightings), FIRST_ROUGHNESS)
    rng = np.random.default_rng(seed)
    covariance, settled, gain, last = np.zeros((N_PARAMETERS, N_PARAMETERS)), False, 1.0, np.zeros(N_PARAMETERS)
    for number in range(MOST_ROUNDS):
        groups = (samples_of_views(surface, particle.outlines, particle.calibrated), samples_of_frames(surface, sightings, flight))
        held = _Held(deviation, prior, mass_response(surface, flight.body), huber)
        prior_of_surface = believed(surface, scales.roughness, bent=BENT if number else np.inf)
        step = _stepped((flight, prior_of_surface), groups, scales, held, rng)
        aligned = number >= ALIGNED
        sizes = step.flight / np.sqrt(np.diag(step.covariance))
        gain *= TURNED if aligned and last @ sizes < 0.0 else 1.0
        surface, flight = surface.moved(gain * step.corners), moved(flight, gain * step.flight)
        covariance, last = step.covariance, sizes
        views, frames = step.scales.noise_px
        found = views, frames * float(np.sqrt(alike_in_time(groups[1].gap_px, sightings.outlines_px, sightings.camera)))
        scales = replace(step.scales, noise_px=found if aligned else scales.noise_px)
        settled = bool(aligned and gain * np.max(np.abs(sizes)) < SETTLED)
        if settled:
            break
    return JointFit(flight, covariance, surface, scales.noise_px, scales.roughness, settled)


def _own_noise(particle: Particle, sightings: Sightings) -> tuple[float, float]:
    """Noise (px) that the outlines of views and of frames show by themselves."""
    seen = particle.seen, sightings.silhouettes
    views, frames = (float(np.median(s.noise_px[s.samples > 0])) for s in seen)
    return views, frames


@dataclass(frozen=True)
class _Held:
    """What holds the flight: mass properties are those of the surface within a ``deviation`` (8,), the outline offset is near zero.

    And ``huber``, what holds samples that lie far off.
    """

    deviation: Array
    prior: Prior
    mass: MassResponse
    huber: float

    def rows(self, flight: Flight) -> tuple[Array, Array, Array]:
        """Residuals (8,) in standard deviations, their derivatives by the flight (8, 21) and, less their sign, by the corners (3 n, 8)."""
        now = np.concatenate([flight.com, flight.inertia])
        by_flight = np.zeros((N_MASS, N_PARAMETERS))
        by_flight[:3, COM] = np.diag(1.0 / self.deviation[:3])
        by_flight[3:, INERTIA] = np.diag(1.0 / self.deviation[3:])
        return (now - self.mass.values) / self.deviation, by_flight, self.mass.by_corner / self.deviation


def _stepped(at: tuple[Flight, Believed], groups: tuple[Samples, Samples], scales: _Scales, held: _Held, rng: np.random.Generator) -> _Step:
    """One step of flight and surface, from the samples of views and of frames and from what is believed of the surface."""
    flight, prior = at
    rows, values = prior.rows, prior.values
    weights = [_weights(group, noise, held.huber) for group, noise in zip(groups, scales.noise_px, strict=True)]
    J = [csr_array(group.by_corner.multiply(w[:, None])) @ prior.basis for group, w in zip(groups, weights, strict=True)]
    F = [group.by_flight * w[:, None] for group, w in zip(groups, weights, strict=True)]
    r = [group.gap_px * w for group, w in zip(groups, weights, strict=True)]
    factor = _factorised(csc_array(sum((j.T @ j for j in J), start=rows.T @ rows)))
    residual, by_flight, by_corner = held.rows(flight)
    by_surface = prior.basis.T @ by_corner
    border = sum(j.T @ f for j, f in zip(J, F, strict=True)) - by_surface @ by_flight
    gradient = sum(j.T @ e for j, e in zip(J, r, strict=True)) + rows.T @ values - by_surface @ residual
    solved = _with_mass(factor, by_surface, np.column_stack([border, gradient]))
    H = sum((f.T @ f for f in F), start=by_flight.T @ by_flight) - border.T @ solved[:, :-1]
    g = sum((f.T @ e for f, e in zip(F, r, strict=True)), start=by_flight.T @ residual) - border.T @ solved[:, -1]
    step, covariance = _with_offset_considered(H, g, held.prior)
    unknowns = -(solved[:, -1] + solved[:, :-1] @ step)
    left = [e + j @ unknowns + f @ step for e, j, f in zip(r, J, F, strict=True)]
    noise_px = tuple(
        noise * _noise_of(group, z, _taken(factor, j, rng), held.huber)
        for noise, group, z, j in zip(scales.noise_px, groups, left, J, strict=True)
    )
    roughness = scales.roughness * _roughness_of(np.asarray(prior.bend + prior.bends @ unknowns), _taken(factor, prior.bends, rng))
    return _Step(step, (prior.basis @ unknowns).reshape(-1, 3), covariance, _Scales((noise_px[0], noise_px[1]), roughness))


def _weights(group: Samples, noise_px: float, huber: float) -> Array:
    """Square roots (m,) of the samples' weights. How far off a sample lies is told by the spread of all, not by the effective noise."""
    size = np.abs(group.gap_px)
    z = size / max(TO_DEVIATION * float(np.median(size)), LEAST_PX)
    return np.asarray(np.sqrt(huber / np.maximum(z, huber)) / noise_px)


def _factorised(A: csc_array) -> SuperLU:
    return splu(A, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})


def _with_mass(factor: SuperLU, by_surface: Array, right: Array) -> Array:
    """Solutions for the factorised matrix plus the mass properties' rows, which would fill it [Woodbury's identity]."""
    solved = factor.solve(np.column_stack([right, by_surface]))
    plain, through = solved[:, : right.shape[1]], solved[:, right.shape[1] :]
    small = np.eye(N_MASS) + by_surface.T @ through
    return np.asarray(plain - through @ np.linalg.solve(small, by_surface.T @ plain))


def _taken(factor: SuperLU, rows: csr_array, rng: np.random.Generator) -> float:
    """How many of the weighted ``rows`` (m, n) the surface's unknowns take up: trace of ``rows A^-1 rows^T``."""
    signs = rng.choice([-1.0, 1.0], size=(rows.shape[0], PROBES))
    towards = rows.T @ signs
    return float(np.mean(np.sum(towards * factor.solve(towards), axis=0)))


def _noise_of(group: Samples, left: Array, taken: float, huber: float) -> float:
    """Noise over that assumed, of residuals (m,) left in its units, Huber's weights in them; alike neighbours count as fewer samples.

    Of normal residuals Huber's weights leave ``erf(huber / sqrt(2))`` of the mean square.
    """
    m = len(left)
    size = np.sqrt(left @ left / max(m - taken, 1.0) / erf(huber / np.sqrt(2.0)))
    return float(size * np.sqrt(_alike(left, group.starts)))


def _alike(left: Array, starts: NDArray[np.int64]) -> float:
    """One and twice the sum of the residuals' correlations along outlines up to the first that is none [Geyer, Stat. Sci. 7 (1992) 473]."""
    outlines = [left[a:b] for a, b in pairwise(starts.tolist())]
    square, total = float(left @ left), 1.0
    for lag in range(1, int(np.diff(starts).min()) // 2):
        rho = sum(float(z @ np.roll(z, lag)) for z in outlines) / square
        if rho <= 0.0:
            break
        total += 2.0 * rho
    return total


def _roughness_of(bent: Array, taken: float) -> float:
    """Roughness over that assumed; ``taken`` of its rows the prior itself determines."""
    found = float(np.sqrt(bent @ bent / max(len(bent) - taken, 1.0)))
    return float(np.clip(found, 1.0 / MOST_CHANGE, MOST_CHANGE))


def _with_offset_considered(H: Array, g: Array, prior: Prior) -> tuple[Array, Array]:
    """Step (21,) that leaves the outline offset alone, and the covariance (21, 21) to which its prior adds [Schmidt, 1966].

    The offset is the size of the body over that of its outlines: estimated, it took up what the surface's shape is wrong by.
    """
    free = np.arange(N_PARAMETERS)[: OFFSET.start]
    inverse = scaled_inverse(H[np.ix_(free, free)])
    step, covariance = np.zeros(N_PARAMETERS), np.zeros((N_PARAMETERS, N_PARAMETERS))
    step[free] = -inverse @ g[free]
    by_offset = np.zeros((N_PARAMETERS, 1))
    by_offset[free] = -inverse @ H[free, OFFSET]
    by_offset[OFFSET] = 1.0
    covariance[np.ix_(free, free)] = inverse
    return step, covariance + by_offset @ by_offset.T / prior.precision[OFFSET]
