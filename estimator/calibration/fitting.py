"""Cameras from sightings of a board: start, bundle adjustment, corners that do not fit, covariance, and the check by two halves."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from scipy.special import chdtrc

from datasets.errors import InputError
from datasets.vocabulary.board import Board
from datasets.vocabulary.calibration import CrossValidation
from estimator.calibration.bundle import Bundle, Rig, lens_prior, lens_vector, moved
from estimator.calibration.sighting import FEWEST_CORNERS, BoardSighting
from estimator.calibration.starting import start
from estimator.fitting.levenberg_marquardt import Descent, Outcome, minimise
from estimator.geometry.robust_scale import robust_sigma

Array = NDArray[np.float64]

OUTLIER_SIGMAS = 5.0
"""Corners farther off than this many robust standard deviations are left out: of noise alone one in a million is."""
NOISIEST = 3.0
"""Times the noise of all corners that a picture's may have: blurred and steep ones have twice; wrong corners bend a fit by more."""
DISHONEST_P = 0.01
"""Below it the halves differ by more than the stated uncertainty explains; one calibration in a hundred is widened without need."""
ROUNDS = 6
"""Of leaving out and fitting again, at most; two are usual. What fits again comes back: a wrong corner pulls its neighbours off."""
MOST_STEPS = 100
"""Steps of a bundle adjustment; one that takes more is told as not settled. By judgement."""
SMALLEST_NOISE_PX = 1e-6
"""Of corners without any noise, as tests have them: rounding."""
RANK = 1e-9
"""Share of the largest eigenvalue below which a scaled covariance has nothing but rounding in it."""


@dataclass(frozen=True)
class RigFit:
    """A fitted rig, what it was fitted to (with the noise), covariance of the cameras' parameters, corners left out.

    ``covariance`` (p, p) of lenses and poses.
    """

    rig: Rig
    bundle: Bundle
    covariance: Array
    left_out: int
    settled: bool

    @property
    def rms_px(self) -> float:
        """RMS residual of a coordinate (px)."""
        return float(np.sqrt(np.mean(np.concatenate([r.ravel() for r in self.bundle.residuals_px(self.rig)]) ** 2)))


def fit_rig(sightings: tuple[BoardSighting, ...], board: Board, sizes: tuple[tuple[int, int], ...]) -> RigFit:
    """Fit all cameras and placements to what was seen.

    Parameters
    ----------
    sightings
        Of all cameras; pictures of one number were taken at one instant, so that they show the board in one place.
    sizes
        Width and height (px) of each camera's pictures.

    Raises
    ------
    InputError
        Where a camera has too few pictures, or cameras share none (it names which).
    """
    rig = start(sightings, board, sizes)
    return fit_from(rig, sightings, board)


def fit_from(rig: Rig, sightings: tuple[BoardSighting, ...], board: Board) -> RigFit:
    """The same from a start, whose placements are the sightings' pictures in order."""
    placements = {picture: b for b, picture in enumerate(sorted({s.picture for s in sightings}))}
    bundle = Bundle(sightings, placements, board.corners_m, (1.0,) * len(sightings), lens_prior(rig))
    for round_number in range(ROUNDS):  # the first one is made as if noise were 1 px
        solution = minimise(Descent(bundle.cost, bundle.linearise, moved), rig, max_steps=MOST_STEPS)
        rig = solution.state
        kept = _without_outliers(replace(bundle, sightings=sightings), rig)
        before, bundle = _corners(bundle.sightings), replace(bundle, sightings=kept)
        bundle = replace(bundle, sigmas_px=_noise(bundle, rig))
        if _corners(kept) == before and round_number:
            break
    covariance = camera_covariance(bundle.linearise(rig).H, rig.camera_parameters)
    left = _corners(sightings) - _corners(bundle.sightings)
    return RigFit(rig, bundle, covariance, left, solution.outcome is Outcome.CONVERGED)


def _corners(sightings: tuple[BoardSighting, ...]) -> int:
    return sum(len(s.corners) for s in sightings)


def _noise(bundle: Bundle, rig: Rig) -> tuple[float, ...]:
    """Standard deviation (px) of a coordinate in each sighting: steep boards and smaller squares have noisier corners.

    Every sighting's mean square is raised by the same share for the numbers that the fit has determined.
    """
    squares = [float((r**2).mean()) for r in bundle.residuals_px(rig)]
    count = 2 * _corners(bundle.sightings)
    share = count / max(count - rig.board_slice(len(rig.t_board)).start, 1)
    return tuple(max(float(np.sqrt(square * share)), SMALLEST_NOISE_PX) for square in squares)


def _without_outliers(bundle: Bundle, rig: Rig) -> tuple[BoardSighting, ...]:
    """The bundle's sightings without corners that are off by the measure of their own picture."""
    residuals = bundle.residuals_px(rig)
    usual = float(robust_sigma(np.concatenate([residual.ravel() for residual in residuals])))
    kept = []
    for sighting, residual in zip(bundle.sightings, residuals, strict=True):
        scale = min(float(robust_sigma(residual.ravel())), NOISIEST * usual)
        good = np.abs(residual).max(axis=1) < OUTLIER_SIGMAS * max(scale, SMALLEST_NOISE_PX)
        if np.count_nonzero(good) < FEWEST_CORNERS:
            good[:] = True  # a whole picture that is off must not vanish without a word
        kept.append(replace(sighting, corners=sighting.corners[good], points_px=sighting.points_px[good]))
    return tuple(kept)


def camera_covariance(H: Array, cameras: int) -> Array:
    """Covariance of the first ``cameras`` parameters, the others (placements, six by six) being unknown too.

    ``H`` (p, p): normal matrix of all parameters.
    """
    scale = 1 / np.sqrt(np.maximum(np.diag(H), 1e-300))
    scaled = H * scale[:, None] * scale[None, :]
    inverse = np.linalg.pinv(scaled, rcond=1e-14, hermitian=True)[:cameras, :cameras]
    return np.asarray(inverse * scale[:cameras, None] * scale[None, :cameras])


def difference(one: Rig, other: Rig) -> Array:
    """Parameters of ``one``'s cameras minus those of ``other``, poses as small turns and shifts."""
    off = np.zeros(one.camera_parameters)
    for c, (lens, same) in enumerate(zip(one.lenses, other.lenses, strict=True)):
        off[one.lens_slice(c)] = lens_vector(lens) - lens_vector(same)
        if c:
            turn = Rotation.from_matrix(one.R_cam[c] @ other.R_cam[c].T).as_rotvec()
            off[one.pose_slice(c)] = np.concatenate([turn, one.t_cam[c] - other.t_cam[c]])
    return off


def cross_validate(fit: RigFit, board: Board, sizes: tuple[tuple[int, int], ...]) -> CrossValidation | None:
    """Fit every other picture apart; ``None`` where a half is too small to be fitted."""
    pictures = sorted({s.picture for s in fit.bundle.sightings})
    halves = [set(pictures[first::2]) for first in (0, 1)]
    try:
        one, other = (fit_rig(tuple(s for s in fit.bundle.sightings if s.picture in half), board, sizes) for half in halves)
    except InputError:
        return None
    return consistency(difference(one.rig, other.rig), _expected(one.covariance, other.covariance, lens_prior(fit.rig)))


def _expected(one: Array, other: Array, prior: Array) -> Array:
    """Covariance of the difference of two fits that share the prior P.

    A fit is off by ``C (noise - P theta)`` with noise of covariance ``C^-1 - P``; theta is drawn from the prior once for both.
    """
    apart = one - other
    return one - one @ prior @ one + other - other @ prior @ other + apart @ prior @ apart


def consistency(off: Array, covariance: Array) -> CrossValidation:
    """Whether a difference is as large as its covariance says, in the directions in which it may differ at all.

    ``off`` (p,): the difference, ``covariance`` (p, p).
    """
    scale = 1 / np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    values, vectors = np.linalg.eigh(covariance * scale[:, None] * scale)
    free = values > RANK * values[-1]
    along = vectors[:, free].T @ (off * scale)
    size, count = float((along**2 / values[free]).sum()), int(np.count_nonzero(free))
    p_value = float(chdtrc(count, size))
    honest = p_value >= DISHONEST_P
    return CrossValidation(size, count, p_value, honest, 1.0 if honest else float(np.sqrt(size / count)))
