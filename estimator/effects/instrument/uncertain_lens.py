"""The lens of a camera, as uncertain as its calibration states: an error of it that is shared by all recordings of that camera.

Not an effect that is asked for but an unknown of the instrument, always in the model. With ``L Lᵀ`` the stated covariance of the lens, its
numbers are those stated plus ``L`` times amplitudes of variance one, as single estimates consider them
(:mod:`estimator.fitting.calibration_share`); two cameras that film one flight also say which amplitudes those are. Valid for errors that
are small beside the numbers.
"""

from collections.abc import Iterable, Iterator

import numpy as np

from datasets.vocabulary.camera import HsvCamera, Intrinsics
from datasets.vocabulary.effects import EffectEntry, Parameter, Scope, Stage, of_camera
from estimator.effects.instrument.surface_amplitudes import STEP, WIDEST
from estimator.effects.link import Array, EffectModel


class UncertainLens(EffectModel):
    """``errors`` (k, 9) of fx, fy, cx, cy (px), k1, k2, p1, p2, k3 of a ``camera``, each as large as one standard deviation."""

    instrument = True

    def __init__(self, camera: str, errors: Array) -> None:
        self.camera, self.errors = camera, errors
        self.held: tuple[float, ...] = (1.0,) * len(errors)
        self.entry = EffectEntry(
            of_camera("uncertain_lens", camera),
            Stage.OPTICS,
            Scope.CAMERA,
            tuple(Parameter(f"e{i}", "1", (-WIDEST, WIDEST), STEP, "amplitude of an error of the lens") for i in range(len(errors))),
            "numbers of the lens = stated ones + errors times amplitudes",
            "Triggs et al., Bundle adjustment, 2000, section 6",
        )

    def correct(self, theta: Array, points_px: Array, camera: Intrinsics, times_s: Array) -> Array:
        """Where the lens as it is stated would have shown the points (v, 2) px."""
        del times_s
        lens = camera.with_numbers(camera.numbers + theta @ self.errors)
        return camera.distort(lens.normalise(points_px))


def independent_errors(covariance: Array) -> Iterator[Array]:
    """Independent errors (n,) each, one standard deviation large, whose squares sum to a covariance (n, n)."""
    scale = np.sqrt(np.diag(covariance))
    scale[scale == 0.0] = 1.0
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    rounding = len(values) * np.finfo(np.float64).eps * values[-1]
    for value, vector in zip(values, vectors.T, strict=True):
        if value > rounding:
            yield np.sqrt(value) * scale * vector


def uncertain_lenses(cameras: Iterable[HsvCamera]) -> tuple[UncertainLens, ...]:
    """Of every camera whose calibration states an uncertainty, by name: that of its most uncertain focal length among all recordings."""
    widest: dict[str, Array] = {}
    for camera in cameras:
        stated = camera.lens_covariance
        if stated is not None and stated.any() and (camera.name not in widest or stated[0, 0] > widest[camera.name][0, 0]):
            widest[camera.name] = stated
    return tuple(UncertainLens(name, np.array(list(independent_errors(covariance)))) for name, covariance in widest.items())
