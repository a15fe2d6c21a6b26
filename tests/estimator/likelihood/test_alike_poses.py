"""Over how many pictures outlines are off alike, of made residuals."""

import numpy as np
import pytest
from numpy.polynomial.legendre import legvander
from scipy.signal import lfilter

from estimator.likelihood.alike_poses import OfPictures

PICTURES, SAMPLES = 120, 60
STARTS, AT = np.arange(0, (PICTURES + 1) * SAMPLES, SAMPLES), np.linspace(-1.0, 1.0, PICTURES)


def made(rng: np.random.Generator) -> tuple[OfPictures, np.ndarray]:
    """Pictures of a body that turns, and the columns of a path and a rotation that are linear in time."""
    by_pose = rng.normal(size=(PICTURES, SAMPLES, 6)) * np.array([1.0, 1.0, 0.1, 1e-3, 1e-3, 2e-3])
    by_pose[..., 0] *= (2.0 + np.sin(6.0 * AT))[:, None]
    return OfPictures(by_pose.reshape(-1, 6), STARTS), of_time(by_pose, legvander(AT, 1))


def of_time(by_pose: np.ndarray, basis: np.ndarray) -> np.ndarray:
    """By how much poses that are the ``basis`` (n, k) of time along every axis move the samples (m, 6 k)."""
    return np.einsum("nsa,nk->nsak", by_pose.reshape(PICTURES, SAMPLES, 6), basis).reshape(PICTURES * SAMPLES, -1)


def moved_by(pictures: OfPictures, poses: np.ndarray) -> np.ndarray:
    """What ``poses`` (n, 6), in their standard deviations, make of the samples."""
    rows = pictures.by_pose.reshape(PICTURES, SAMPLES, 6)
    return np.concatenate([F @ np.linalg.solve(np.linalg.cholesky(F.T @ F).T, pose) for F, pose in zip(rows, poses, strict=True)])


def test_white_noise_is_alike_over_one_picture() -> None:
    rng = np.random.default_rng(4)
    pictures, columns = made(rng)
    base = pictures.base(columns)
    found = [pictures.repeats(rng.normal(size=len(columns)), base) for _ in range(20)]
    assert 1.0 <= np.mean(found) < 1.15


@pytest.mark.parametrize(("fading", "size"), [(0.5, 2.0), (0.7, 1.0)])
def test_errors_that_come_back_count_as_often(fading: float, size: float) -> None:
    """Noise of variance one beside a process of variance ``size``² that fades: ``1 + 2 rho_1 / (1 - fading)``."""
    rng, found = np.random.default_rng(5), []
    pictures, columns = made(rng)
    for _ in range(12):
        drawn = lfilter([size * np.sqrt(1.0 - fading**2)], [1.0, -fading], rng.normal(size=(PICTURES + 200, 6)), axis=0)[200:]
        found.append(pictures.repeats(rng.normal(size=len(columns)) + moved_by(pictures, drawn), pictures.base(columns)))
    share = size**2 / (1.0 + size**2)
    assert np.median(found) == pytest.approx(1.0 + 2.0 * share * fading / (1.0 - fading), rel=0.3)


@pytest.mark.parametrize("segments", [1, 3])
def test_what_a_motion_lacks_is_taken_off_segment_by_segment(segments: int) -> None:
    rng = np.random.default_rng(6)
    pictures, columns = made(rng)
    of = np.arange(PICTURES) * segments // PICTURES
    within = 2.0 * (np.arange(PICTURES) - of * PICTURES / segments) * segments / PICTURES - 1.0
    basis = np.concatenate([np.where((of == k)[:, None], legvander(within, 4)[:, 2:], 0.0) for k in range(segments)], axis=1)
    slow = of_time(pictures.by_pose, basis)
    left = rng.normal(size=len(columns)) + slow @ (2.0 * rng.normal(size=slow.shape[1]))
    left -= columns @ np.linalg.lstsq(columns, left, rcond=None)[0]
    fitted, every = pictures.base(columns), pictures.base(np.column_stack([columns, slow]))
    assert pictures.repeats(left, fitted) > 3.0
    beside = pictures.beside(left, fitted, every)
    assert np.std(beside) == pytest.approx(1.0, abs=0.03)
    assert pictures.repeats(beside, every) < 1.3


def test_what_the_motion_takes_up_elsewhere_stays_in_what_is_left() -> None:
    """The other camera of two sees the body elsewhere: that is in this one's residuals, though its poses alone could be moved there."""
    rng = np.random.default_rng(8)
    pictures, columns = made(rng)
    left = rng.normal(size=len(columns)) + columns @ np.full(columns.shape[1], 3.0)
    every = np.column_stack([columns, of_time(pictures.by_pose, AT[:, None] ** 2)])
    np.testing.assert_allclose(pictures.beside(left, pictures.base(columns), pictures.base(every)) @ columns, left @ columns, rtol=1e-6)


def test_directions_that_no_sample_sees_and_pictures_without_samples_say_nothing() -> None:
    rng = np.random.default_rng(7)
    pictures, columns = made(rng)
    by_pose = pictures.by_pose.copy()
    by_pose[:, 5] = 0.0
    left = rng.normal(size=len(columns))
    blind = OfPictures(by_pose, np.append(STARTS, STARTS[-1]))
    assert 1.0 <= blind.repeats(left, blind.base(columns)) < 1.3
    assert OfPictures(by_pose[:0], np.zeros(3, dtype=np.int64)).repeats(left[:0], np.zeros((0, 6, 0))) == 1.0
    left[3] = np.nan
    assert pictures.repeats(left, pictures.base(columns)) == 1.0
