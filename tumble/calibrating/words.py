"""A calibration in words and rows, for the screen and the page."""

import numpy as np
from scipy.spatial.transform import Rotation

from datasets.vocabulary.calibration import LENS, POSE, Calibration

SHOWN = {"fx_px": "focal length x", "fy_px": "focal length y", "cx_px": "principal point x", "cy_px": "principal point y"}


def camera_rows(calibration: Calibration, number: int) -> list[tuple[str, str, str]]:
    """Name, value and standard deviation of every parameter of a camera, and its pose in the first camera's frame."""
    camera = calibration.cameras[number]
    lens = camera.intrinsics
    values = dict(zip(LENS, (lens.fx_px, lens.fy_px, lens.cx_px, lens.cy_px, *lens.distortion), strict=True))
    first = number * (len(LENS) + len(POSE)) - (len(POSE) if number else 0)
    count = len(LENS) + (len(POSE) if number else 0)
    known = calibration.covariance is not None
    variances = np.zeros(count) if calibration.covariance is None else np.diag(calibration.covariance)[first : first + count]
    sigma = np.sqrt(np.maximum(variances, 0.0))
    rows = []
    for k, (name, value) in enumerate(values.items()):
        unit = " px" if name in SHOWN else ""
        shown = f"{value:.3f}{unit}" if unit else f"{value:.6g}"
        rows.append((SHOWN.get(name, name), shown, f"{sigma[k]:.2g}{unit}" if known else "not stated"))
    if number:
        turn = np.rad2deg(Rotation.from_matrix(camera.R_cam_world).as_rotvec())
        angle, place = sigma[len(LENS) : len(LENS) + 3], sigma[len(LENS) + 3 :]
        rows.append(("turned from camera 1", _three(turn, 4, "°"), _three(np.rad2deg(angle), 5, "°") if known else "not stated"))
        rows.append(("t_cam_world", _three(1e3 * camera.t_cam_world, 4, "mm"), _three(1e3 * place, 5, "mm") if known else "not stated"))
    return rows


def gravity_rows(calibration: Calibration) -> list[tuple[str, str, str]]:
    """The direction of gravity with the standard deviation of its angle."""
    if calibration.gravity_world is None:
        return []
    sigma = "not stated"
    if calibration.gravity_covariance is not None:
        size = float(np.linalg.norm(calibration.gravity_world))
        spread = np.sqrt(np.maximum(np.linalg.eigvalsh(calibration.gravity_covariance), 0.0)) / size
        sigma = f"{np.rad2deg(spread[-1]):.3g}° at worst, {np.rad2deg(spread[-2]):.3g}° across"
    return [("gravity in the first camera's frame", _three(calibration.gravity_world, 4, "m/s²"), sigma)]


def _three(values: object, digits: int, unit: str) -> str:
    return "(" + ", ".join(f"{float(value):.{digits}f}" for value in np.asarray(values)) + f") {unit}"


def verdict_of(calibration: Calibration) -> str:
    """One sentence on how far to believe it."""
    fit = calibration.fit
    if fit is None:
        return "No pictures of a board stand behind it." if calibration.covariance is None and calibration.cameras else "Measured."
    said = f"{fit.corners} corners in {fit.pictures} pictures fit to {fit.rms_px:.3f} px ({fit.left_out} left out)."
    check = fit.cross_validation
    if check is None:
        return f"{said} There are too few pictures to check the stated uncertainty by halves."
    chance = f"chi-square {check.chi_square:.1f} for {check.degrees_of_freedom}, p = {check.p_value:.2g}"
    if check.honest:
        return f"{said} Two halves of the pictures agree within the stated uncertainty ({chance}): it is honest."
    return f"{said} Two halves of the pictures differ by more than was stated ({chance}): it is widened by {check.factor:.2g}."
