"""Whether further pictures of a board agree with a calibration, as sure as it says it is.

Places of the board are fitted with the cameras held; the slope of the cost along the cameras' parameters, whose covariance is ``S + S C S``
for information S of the pictures and covariance C of the calibration, is a score test of all of them at once [Rao 1948].
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from datasets.errors import InputError
from datasets.vocabulary.board import Board
from datasets.vocabulary.calibration import CrossValidation
from datasets.vocabulary.camera import HsvCamera
from estimator.calibration.bundle import Bundle, Rig, moved
from estimator.calibration.fitting import consistency, fit_from
from estimator.calibration.sighting import BoardSighting
from estimator.calibration.starting import pose_of
from estimator.fitting.levenberg_marquardt import Descent, NormalEquations, minimise

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Agreement:
    """RMS residual (px) with cameras as calibrated (``held_px``) and fitted to the same pictures (``free_px``), and the score test."""

    held_px: float
    free_px: float
    test: CrossValidation


def agreement(
    sightings: tuple[BoardSighting, ...], board: Board, cameras: tuple[HsvCamera, ...], covariance: Array | None
) -> tuple[Agreement, Rig, Bundle]:
    """Compare pictures with cameras; beside it what the pictures give with the cameras held.

    ``covariance`` (p, p) of the cameras' parameters, as they are stated.

    Raises
    ------
    InputError
        Where pictures are too few to say how noisy corners are.
    """
    rig = _placed(sightings, board, cameras)
    refitted = fit_from(rig, sightings, board)
    n = rig.camera_parameters
    bundle = replace(refitted.bundle, prior=np.zeros((n, n)))
    held = minimise(Descent(bundle.cost, lambda r: _boards_alone(bundle.linearise(r), n), _boards_moved), rig).state
    equations = bundle.linearise(held)
    inner = np.linalg.pinv(equations.H[n:, n:], hermitian=True)
    S = equations.H[:n, :n] - equations.H[:n, n:] @ inner @ equations.H[n:, :n]
    slope = equations.g[:n] - equations.H[:n, n:] @ inner @ equations.g[n:]
    C = np.zeros((n, n)) if covariance is None else covariance
    rms = float(np.sqrt(np.mean(np.concatenate([r.ravel() for r in bundle.residuals_px(held)]) ** 2)))
    return Agreement(rms, refitted.rms_px, consistency(slope, S + S @ C @ S)), held, bundle


def _placed(sightings: tuple[BoardSighting, ...], board: Board, cameras: tuple[HsvCamera, ...]) -> Rig:
    """The calibrated cameras with the places of the board that the first camera to see each says."""
    if not sightings:
        raise InputError("expected pictures that show the board, got none.")
    seen: dict[int, tuple[Array, Array]] = {}
    for s in sightings:
        if s.picture not in seen:
            R, t = pose_of(s, board, cameras[s.camera].intrinsics)
            R_cam, t_cam = cameras[s.camera].R_cam_world, cameras[s.camera].t_cam_world
            seen[s.picture] = (R_cam.T @ R, R_cam.T @ (t - t_cam))
    order = sorted(seen)
    R_all, t_all = (np.stack([getattr(c, name) for c in cameras]) for name in ("R_cam_world", "t_cam_world"))
    R_board, t_board = np.stack([seen[p][0] for p in order]), np.stack([seen[p][1] for p in order])
    return Rig(tuple(c.intrinsics for c in cameras), R_all, t_all, R_board, t_board)


def _boards_alone(equations: NormalEquations, cameras: int) -> NormalEquations:
    return NormalEquations(equations.H[cameras:, cameras:], equations.g[cameras:], equations.cost)


def _boards_moved(rig: Rig, step: Array) -> Rig:
    return moved(rig, np.concatenate([np.zeros(rig.camera_parameters), step]))
