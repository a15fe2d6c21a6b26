"""An outline as a camera with a stated boundary noise would deliver it: the silhouette tier.

The exact outline is sampled at equal steps of arc length, and every sample is displaced along the outline's outward normal by
its own draw from N(0, sigma²): white boundary noise, the setting of the paper's simulations. Sampling does not keep corners, as
a camera does not either; a corner is cut by at most half a step.

Where the noise is correlated, samples a distance ``d`` apart along the outline have the covariance ``sigma² exp(-d / correlation)``:
that of a first-order autoregression closed to a ring. Its spectrum is nowhere zero; of a smoother covariance fast patterns along an
outline would be all but free of noise and say more than any camera shows.
"""

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from datasets.recipes.recipe import NoiseRecipe
from datasets.vocabulary.outline import Outline

Array = NDArray[np.float64]


def noisy_outline(
    exact: Float[NDArray[np.float64], "n 2"],
    *,
    spacing_px: float,
    sigma_px: float,
    rng: np.random.Generator,
    correlation_px: float = 0.0,
) -> Outline:
    """Sample ``exact`` (px, positive area) about every ``spacing_px`` and displace each sample along its normal by N(0, ``sigma_px``²).

    The first sample lies at a random place of the outline. ``correlation_px``: distance along the outline over which the correlation of the
    noise falls to 1/e; 0: white.
    """
    samples, normals = samples_with_normals(exact, spacing_px=spacing_px, phase=rng.random())
    displaced = rng.normal(0.0, sigma_px, size=(len(samples), 1))
    if correlation_px > 0:
        shape = np.sqrt(noise_spectrum(len(samples), sigma_px=1.0, correlation_steps=correlation_px / spacing_px))
        displaced = np.fft.ifft(np.fft.fft(displaced, axis=0) * shape[:, None], axis=0).real
    return Outline(samples + normals * displaced)


def noisy(exact: Float[NDArray[np.float64], "n 2"], noise: NoiseRecipe, sigma_px: float, rng: np.random.Generator) -> Outline:
    """The outline (px) with the sampling and the correlation of ``noise``, and ``sigma_px`` (px) of that camera."""
    return noisy_outline(exact, spacing_px=noise.spacing_px, sigma_px=sigma_px, rng=rng, correlation_px=noise.correlation_px)


def noise_spectrum(count: int, *, sigma_px: float, correlation_steps: float) -> Float[NDArray[np.float64], " m"]:
    """Eigenvalues (px²) of the noise's covariance along an outline of ``count`` samples, in the order of the discrete Fourier transform.

    ``correlation_steps``: distance over which the correlation falls to 1/e, in steps between samples; 0: white.
    """
    if correlation_steps == 0:
        return np.full(count, sigma_px**2)
    apart = np.minimum(np.arange(count), count - np.arange(count))
    return np.asarray(np.fft.fft(sigma_px**2 * np.exp(-apart / correlation_steps)).real)


def samples_with_normals(
    exact: Float[NDArray[np.float64], "n 2"], *, spacing_px: float, phase: float
) -> tuple[Float[NDArray[np.float64], "m 2"], Float[NDArray[np.float64], "m 2"]]:
    """Points at equal steps along ``exact``, the first at ``phase`` of a step, and unit outward normals.

    A normal is that of the chord between the two neighbouring samples, so it belongs to the scale of the sampling
    and not to single facets of the mesh.
    """
    closed = np.vstack([exact, exact[:1]])
    travelled = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(closed, axis=0), axis=1))])
    count = max(8, round(travelled[-1] / spacing_px))
    stops = (np.arange(count) + phase) * travelled[-1] / count
    samples = np.column_stack([np.interp(stops, travelled, closed[:, 0]), np.interp(stops, travelled, closed[:, 1])])
    chord = np.roll(samples, -1, axis=0) - np.roll(samples, 1, axis=0)
    normals = np.column_stack([chord[:, 1], -chord[:, 0]])
    return samples, normals / np.linalg.norm(normals, axis=1, keepdims=True)
