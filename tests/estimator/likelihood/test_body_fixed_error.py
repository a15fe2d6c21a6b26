"""The body-fixed error: its covariance over places, and its size from products of errors of different sightings."""

import numpy as np
import pytest

from estimator.likelihood.body_fixed_error import (
    FINE,
    BodyPlaces,
    body_noise,
    body_places,
    correlation,
    field_covariance,
    measured_variance,
)

SIGHTINGS, VIEWS, NOISE_PX, FIELD_PX = 240, 20, 0.15, 0.06


def directions(rng: np.random.Generator, *shape: int) -> np.ndarray:
    u = rng.normal(size=(*shape, 3))
    return u / np.linalg.norm(u, axis=-1, keepdims=True)


def places(rng: np.random.Generator) -> BodyPlaces:
    return body_places(directions(rng, SIGHTINGS, VIEWS, 2), directions(rng, SIGHTINGS))


def field(rng: np.random.Generator, where: BodyPlaces) -> np.ndarray:
    """The field drawn in all cells."""
    by_normal, by_viewing = correlation(np.arange(FINE.normals) * FINE.viewing, FINE), correlation(np.arange(FINE.viewing), FINE)
    drawn = np.linalg.cholesky(by_normal + 1e-9 * np.eye(FINE.normals)) @ rng.normal(size=(FINE.normals, FINE.viewing))
    drawn = drawn @ np.linalg.cholesky(by_viewing + 1e-9 * np.eye(FINE.viewing)).T
    return np.asarray(drawn[where.normal, where.viewing[:, None, None]])


def test_the_view_from_behind_is_the_same_place() -> None:
    rng = np.random.default_rng(1)
    normals, viewing = directions(rng, 5, 3, 2), directions(rng, 5)
    np.testing.assert_array_equal(body_places(normals, viewing).cell, body_places(normals, -viewing).cell)
    assert (body_places(normals, viewing).cell != body_places(-normals, viewing).cell).all()


def test_kernels_give_the_covariance_that_places_have() -> None:
    rng = np.random.default_rng(2)
    cells, influence = rng.integers(0, FINE.normals * FINE.viewing, 60), rng.normal(size=(60, 3))
    np.testing.assert_allclose(field_covariance(cells, influence), influence.T @ correlation(cells, FINE) @ influence, rtol=1e-10)


def test_only_valid_pairs_count() -> None:
    rng = np.random.default_rng(3)
    where, weighted = places(rng), rng.normal(size=(SIGHTINGS, VIEWS, 2, 2))
    valid = rng.random((SIGHTINGS, VIEWS)) < 0.5
    kept = np.where(valid[..., None, None], weighted, 0.0)
    everything = body_noise(np.ones_like(valid), kept, where, sigma_px=FIELD_PX)
    np.testing.assert_allclose(body_noise(valid, weighted, where, sigma_px=FIELD_PX), everything, rtol=1e-10)


def test_size_of_a_drawn_field() -> None:
    rng = np.random.default_rng(4)
    found = []
    for _ in range(12):
        where = places(rng)
        e = FIELD_PX * field(rng, where) + rng.normal(0.0, NOISE_PX, where.cell.shape)
        valid, weight = np.ones((SIGHTINGS, VIEWS), dtype=bool), np.full(e.shape, NOISE_PX**-2)
        found.append(measured_variance((valid, e, weight), where, np.arange(SIGHTINGS) // 20))
    assert np.mean(found) == pytest.approx(FIELD_PX**2, abs=4 * np.std(found) / np.sqrt(len(found)))
    assert np.std(found) / np.sqrt(len(found)) < 0.15 * FIELD_PX**2


def test_noise_of_single_silhouettes_is_no_field() -> None:
    rng = np.random.default_rng(5)
    found = []
    for _ in range(12):
        where = places(rng)
        # A common error of each sighting is the strongest dependence that a silhouette's own noise can have.
        e = rng.normal(0.0, NOISE_PX, where.cell.shape) + rng.normal(0.0, NOISE_PX, (SIGHTINGS, 1, 1))
        valid, weight = np.ones((SIGHTINGS, VIEWS), dtype=bool), np.full(e.shape, NOISE_PX**-2)
        found.append(measured_variance((valid, e, weight), where, np.arange(SIGHTINGS) // 20))
    assert abs(np.mean(found)) < 4 * np.std(found) / np.sqrt(len(found))
    assert np.std(found) < 0.3 * FIELD_PX**2


def test_blocks_without_common_places_tell_nothing() -> None:
    rng = np.random.default_rng(6)
    where, e = places(rng), rng.normal(size=(SIGHTINGS, VIEWS, 2))
    assert measured_variance((np.ones((SIGHTINGS, VIEWS), dtype=bool), e, np.ones(e.shape)), where, np.zeros(SIGHTINGS, dtype=int)) == 0.0
