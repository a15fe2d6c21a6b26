"""``tumble calibrate camera`` and ``rig``: pictures of a board -> fit, checks, calibration."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from datasets.errors import InputError
from datasets.names import file_name
from datasets.vocabulary.board import Board
from datasets.vocabulary.calibration import Calibration, CalibrationFit
from datasets.vocabulary.camera import HsvCamera
from estimator.calibration.fitting import RigFit, cross_validate, fit_rig
from estimator.calibration.sighting import BoardSighting
from tumble.calibrating.pictures import Target, sightings_of, targets_in

WORST_RMS_PX = 2.0
"""Corners are found to a tenth of a pixel; a board of other sizes, a bent one or a wrong pairing of pictures is off by more than this."""
LARGEST_FOCAL_SHARE = 0.01
"""Standard deviation of a focal length over itself: beyond it the boards were not tilted against each other, and depths are unknown."""


@dataclass(frozen=True)
class Calibrated:
    """A calibration with the fit that it is from, and the names of each camera's pictures."""

    calibration: Calibration
    fit: RigFit
    pictures: tuple[tuple[str, ...], ...]


def calibrate_camera(paths: Sequence[Path], board: Board) -> Calibrated:
    """One camera from pictures of a board.

    Raises
    ------
    InputError
        Naming the picture, what was expected and what came.
    """
    targets = targets_in(paths)
    sightings, without = sightings_of(targets, board)
    alone = [target.name for target in targets if target.alone and target.name in without]
    if alone:
        raise InputError(f"{alone[0]}: expected a picture of the board {board.words}, got one without it; leave it out.")
    return _calibrated(sightings, board, [targets], ["hsv"], _left_out(without))


def calibrate_rig(paths: Sequence[Path], board: Board) -> Calibrated:
    """Several cameras, a folder or recording each; pictures of one number were taken at one instant.

    Raises
    ------
    InputError
        Naming the camera or picture, what was expected and what came.
    """
    every = [targets_in([path]) for path in paths]
    for path, targets in zip(paths, every, strict=True):
        if len(targets) != len(every[0]):
            raise InputError(
                f"{path}: expected {len(every[0])} pictures as {paths[0]} has, got {len(targets)}; those of one number are of one instant."
            )
    found = [sightings_of(targets, board, c) for c, targets in enumerate(every)]
    names = [file_name(path.resolve().name if path.is_dir() else path.stem) for path in paths]
    if len(set(names)) < len(names):
        raise InputError(f"{paths[0]}: expected cameras with names of their own, got {', '.join(names)}.")
    return _calibrated(tuple(s for sightings, _ in found for s in sightings), board, every, names, ())


def _left_out(names: Sequence[str]) -> tuple[str, ...]:
    return (f"{len(names)} pictures without the board are left out: {', '.join(names)}.",) if names else ()


def _calibrated(
    sightings: tuple[BoardSighting, ...], board: Board, targets: Sequence[Sequence[Target]], names: Sequence[str], notes: tuple[str, ...]
) -> Calibrated:
    sizes = tuple((each[0].grey.shape[1], each[0].grey.shape[0]) for each in targets)
    try:
        fit = fit_rig(sightings, board, sizes)
    except InputError as error:
        raise InputError(f"{targets[0][0].name}: {error}") from None
    _refuse_poor(fit, board, targets)
    check = cross_validate(fit, board, sizes)
    factor = 1.0 if check is None else check.factor
    lenses = zip(names, fit.rig.lenses, fit.rig.R_cam, fit.rig.t_cam, strict=True)
    calibration = Calibration(
        cameras=tuple(HsvCamera(name, lens, R, t) for name, lens, R, t in lenses),
        covariance=0.5 * (fit.covariance + fit.covariance.T) * factor**2,
        fit=CalibrationFit(
            rms_px=fit.rms_px,
            corners=sum(len(s.corners) for s in fit.bundle.sightings),
            pictures=len(fit.bundle.sightings),
            left_out=fit.left_out,
            cross_validation=check,
        ),
        board=board.words,
        notes=notes if check else (*notes, "Too few pictures for a check by halves: the uncertainty is as stated by the fit."),
    )
    return Calibrated(calibration, fit, tuple(tuple(target.name for target in each) for each in targets))


def _refuse_poor(fit: RigFit, board: Board, targets: Sequence[Sequence[Target]]) -> None:
    """Refuse a fit that is no calibration, with the picture that is worst."""
    residuals = fit.bundle.residuals_px(fit.rig)
    rms = [float(np.sqrt((r**2).mean())) for r in residuals]
    worst = fit.bundle.sightings[int(np.argmax(rms))]
    name = targets[worst.camera][worst.picture].name
    if not fit.rms_px < WORST_RMS_PX:
        raise InputError(
            f"{name}: expected corners that fit the board {board.words} to {WORST_RMS_PX:g} px, got {max(rms):.3g} px RMS in this picture "
            f"and {fit.rms_px:.3g} px in all; is --board right, is the board flat, and are pictures paired rightly?"
        )
    for c, lens in enumerate(fit.rig.lenses):
        sigma = float(np.sqrt(fit.covariance[fit.rig.lens_slice(c).start, fit.rig.lens_slice(c).start])) / lens.fx_px
        if not (fit.settled and sigma < LARGEST_FOCAL_SHARE):
            raise InputError(
                f"{targets[c][0].name} and the others: expected boards tilted against each other (by 30 degrees and more), enough to fix "
                f"the focal length to {LARGEST_FOCAL_SHARE:.0%}, got boards within {_spread_deg(fit, c):.1f} degrees that leave it "
                f"unknown by {sigma:.1%}."
            )


def _spread_deg(fit: RigFit, camera: int) -> float:
    """Largest angle between two boards' normals that a camera saw."""
    numbers = [fit.bundle.placements[s.picture] for s in fit.bundle.sightings if s.camera == camera]
    normals = fit.rig.R_board[numbers][:, :, 2]
    return float(np.rad2deg(np.arccos(np.clip((normals @ normals.T).min(), -1, 1))))
