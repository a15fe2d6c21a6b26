"""How the noise of the outlines' samples enters the tangency errors: an explicit silhouette-noise model.

A tangency point is a smoothed hull vertex; along the tangent line's outward normal ``u`` it moves by ``u · sum_j response_j z_j``, where ``z`` are
independent unit noises of the outline's samples. Tangencies that share samples are correlated, within a silhouette only. For sighting
``i`` the errors ``e`` seen in its picture thus have ``Σ_i = Z Zᵀ + D``: ``Z`` (error, sample) its own outline's part, ``D`` the diagonal part of the
views' outlines (magnified by the ratio of pixel sizes) and of what the model of the outline leaves out.
"""

import numpy as np
from numpy.typing import NDArray

from estimator.geometry.epipolar_tangency import TangencyErrors
from estimator.geometry.silhouettes import Silhouettes

Array = NDArray[np.float64]


def sample_response(silhouettes: Silhouettes, index: int, vertices: NDArray[np.int64], directions: Array) -> Array:
    """``Z`` (error, sample) px: how unit noise of each outline sample of silhouette ``index`` moves its tangency points outwards."""
    rows = silhouettes.slice_of(index)
    along = np.einsum("ewc,ec->ew", silhouettes.response[rows][vertices], directions)
    n, window = int(silhouettes.n_samples[index]), along.shape[1]
    columns = (silhouettes.first_sample[rows][vertices][:, None] + np.arange(window)) % n
    Z = np.zeros((len(vertices), n))
    np.add.at(Z, (np.arange(len(vertices))[:, None], columns), along)
    return Z


def tangency_variance(silhouettes: Silhouettes, tangency: Array, directions: Array, floor_px: float) -> Array:
    """Variance (k,) px² of one tangency point in each of k silhouettes along ``directions`` (k, 2)."""
    vertices = silhouettes.offsets[:-1] + tangency
    along = np.einsum("kwc,kc->kw", silhouettes.response[vertices], directions)
    return np.asarray(np.sum(along**2, axis=1) + floor_px**2)


def own_noise(errors: TangencyErrors, first: Silhouettes, index: int) -> tuple[Array, NDArray[np.int64]]:
    """``Z`` of sighting ``index`` over its valid errors, and these errors' places (error, 2): view, upper or lower."""
    places = np.argwhere(np.repeat(errors.valid[index][:, None], 2, axis=1))
    view, side = places.T
    return sample_response(first, index, errors.tangency[index, view, side], errors.direction[index, view, side]), places


def views_noise(errors: TangencyErrors, second: Silhouettes, index: int, places: NDArray[np.int64], floor_px: float) -> Array:
    """Diagonal of ``D`` (error,) px²: the views' noise magnified into the sighting's picture."""
    view, side = places.T
    rows = second.offsets[view] + errors.tangency[index, view, 2 + side]
    along = np.einsum("ewc,ec->ew", second.response[rows], errors.direction[index, view, 2 + side])
    ratio = errors.jacobian[index, view, side, 7]
    return np.asarray(ratio**2 * np.sum(along**2, axis=1) + floor_px**2)
