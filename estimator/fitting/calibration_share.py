"""What the uncertainty of the camera's calibration, of lengths, and of measured gravity adds to that of a flight.

A calibration is not estimated again from a flight, it is considered [Schmidt 1966; Bierman 1977, ch. 8]: with ``H`` the normal matrix at
the fitted flight, ``W`` the weighed derivatives and ``e(p)`` the errors, a lens or a gravity that is off by ``d`` moves the fit by
``-H⁻¹ Wᵀ (de/dp) d``. For ``d`` the columns of ``L``, ``L Lᵀ`` the stated covariance, that gives the columns ``A`` whose ``A Aᵀ`` is
added to the flight's covariance. A gravity that is off enters the velocity at another time directly, too. Where lengths of the views are
off by a factor, the flight is that of a particle of the stated size, with gravity and cameras nearer by it, times the factor. Derivatives
are central differences; the particle's calibrated views, whose cameras are others as a rule, say how well they agree themselves.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from datasets.estimate import Estimate
from datasets.observation import Observation
from datasets.vocabulary.camera import HsvCamera
from estimator.appearance.flight_errors import flown_in, unbiased_errors
from estimator.data.fit_task import FitTask
from estimator.effects.instrument.uncertain_lens import independent_errors
from estimator.fitting.problem import M
from estimator.fitting.refinement import Refined
from estimator.fitting.weighed_tangencies import Linearised
from estimator.fitting.within_sequence import within_equations
from estimator.geometry.silhouettes import Silhouettes
from estimator.motion.flight import Motion

Array = NDArray[np.float64]
Other = Callable[[float], tuple[FitTask, Motion]]
OF_LENGTHS = ("_m", "_ms")
"""How labels of parameters end whose unit has a length in it."""
STEP = 0.01
"""Of the central differences, in standard deviations of the calibration: one of those may move outlines by many times their noise."""


@dataclass(frozen=True)
class CalibrationShare:
    """Moves ``parameters`` (p, c) of a motion with each of c independent errors of the calibration, one standard deviation of each.

    ``gravity`` (3, c) m/s2: by how much the true gravity is then another.
    """

    parameters: Array
    gravity: Array

    def covariance(self, J: Array, since_s: float) -> Array:
        """What it adds to the covariance (6, 6) of (v, omega), of derivatives ``J`` (6, p), ``since_s`` after the flight's own time."""
        moved = J @ self.parameters
        moved[:3] += since_s * self.gravity
        return np.asarray(moved @ moved.T)


def widened(refined: Refined[M], share: CalibrationShare) -> Refined[M]:
    """A refined motion with what its parameters move by in its covariance."""
    return replace(refined, covariance=refined.covariance + share.parameters @ share.parameters.T)


def calibration_share(motion: Motion, at: Linearised, inverse: Array, stated: Observation) -> CalibrationShare | None:
    """The share of a calibration in a fitted motion; ``None`` where no uncertainty is ``stated``.

    ``at``: the outlines there; ``inverse`` (p, p) of the normal matrix.
    """
    errors = errors_of(at.task, motion, stated)
    columns = []
    for other in errors.others:
        (high, high_within), (low, low_within) = (_seen_under(*other(sign * STEP), at) for sign in (1.0, -1.0))
        change = np.where(np.isfinite(high - low), high - low, 0.0)
        change_of_gradient = np.einsum("nksp,nks->p", at.frames.weighted, change) + high_within - low_within
        columns.append(-inverse @ change_of_gradient / (2.0 * STEP))
    return errors.share(np.array(columns).T) if columns else None


@dataclass(frozen=True)
class CalibrationErrors:
    """Independent errors of a calibration: ``others``, each the task and the motion with so many standard deviations of it.

    ``gravity`` (3, c) m/s2 and ``parameters`` (p, c): what they add to gravity and to the motion's parameters directly.
    """

    others: list[Other]
    gravity: Array
    parameters: Array

    def share(self, response: Array) -> CalibrationShare:
        """What they add where the fit answers them with ``response`` (p, c)."""
        return CalibrationShare(response + self.parameters, self.gravity)


def errors_of(task: FitTask, motion: Motion, stated: Observation) -> CalibrationErrors:
    """The errors that the calibration of the cameras of a task, gravity and lengths may have, as they are ``stated``."""
    cameras = enumerate(task.sightings.cameras)
    others = [_through(task, motion, (number, column)) for number, camera in cameras for column in _lens_errors(camera)]
    pulls = [] if stated.gravity_covariance is None else list(independent_errors(stated.gravity_covariance))
    sigma = stated.sigma_length_scale
    lenses, count = len(others), len(others) + len(pulls) + (sigma is not None)
    others += [_pulled(task, motion, pull) for pull in pulls]
    gravity, parameters = np.zeros((3, count)), np.zeros((len(motion.values), count))
    gravity[:, lenses : lenses + len(pulls)] = np.array(pulls).reshape(-1, 3).T
    if sigma is not None:
        others.append(_larger(task, motion, sigma))
        parameters[:, -1] = sigma * np.where([label.endswith(OF_LENGTHS) for label in motion.layout.labels], motion.values, 0.0)
    return CalibrationErrors(others, gravity, parameters)


def _pulled(task: FitTask, motion: Motion, pull: Array) -> Other:
    """A gravity that is off by so many times a ``pull`` (3,)."""
    first = motion.first
    return lambda times: (task, motion.with_first(replace(first, gravity_world=first.gravity_world + times * pull)))


def _larger(task: FitTask, motion: Motion, sigma: float) -> Other:
    """A particle that is larger by so many times ``sigma``, relative, in its own lengths: cameras and gravity are smaller."""
    first, sightings = motion.first, task.sightings

    def larger(times: float) -> tuple[FitTask, Motion]:
        factor = 1.0 / (1.0 + times * sigma)
        cameras = tuple(replace(camera, t_cam_world=factor * camera.t_cam_world) for camera in sightings.cameras)
        nearer = replace(task, sightings=replace(sightings, cameras=cameras))
        return nearer, motion.with_first(replace(first, gravity_world=factor * first.gravity_world))

    return larger


def _seen_under(task: FitTask, motion: Motion, of: Linearised) -> tuple[Array, Array]:
    """Errors (n, k, 2) px of the pairs with views, NaN where there is none, and the gradient (p,) of those within the sequence."""
    predicted, settings = flown_in(motion, task.sightings), of.settings
    errors = unbiased_errors(task, motion.first, predicted)
    within = within_equations(task, motion, predicted, of.S, most_pairs=settings.within_pairs, floor_px=settings.floor_px)
    return np.where(errors.told[..., :2], errors.error[..., :2], np.nan), within.g


def _lens_errors(camera: HsvCamera) -> Sequence[Array]:
    return [] if camera.lens_covariance is None else list(independent_errors(camera.lens_covariance))


def _through(task: FitTask, motion: Motion, error: tuple[int, Array]) -> Other:
    """The task as one camera would have it whose lens is off by so many times an ``error`` (its number, (9,))."""
    number, off = error
    given, first = task.sightings.cameras[number].intrinsics, task.sightings.silhouettes
    own = np.flatnonzero(task.sightings.camera == number)
    rows = _rows(first, own)

    def through(times: float) -> tuple[FitTask, Motion]:
        lens = given.with_numbers(given.numbers + times * off)
        xy, focal = first.xy.copy(), first.focal_px.copy()
        xy[rows], focal[own] = lens.normalise(first.points_px[rows]), (lens.fx_px, lens.fy_px)
        cameras = tuple(replace(c, intrinsics=lens) if k == number else c for k, c in enumerate(task.sightings.cameras))
        return replace(task, sightings=replace(task.sightings, cameras=cameras, silhouettes=replace(first, xy=xy, focal_px=focal))), motion

    return through


def _rows(hulls: Silhouettes, which: NDArray[np.int64]) -> NDArray[np.int64]:
    """Vertices of some hulls."""
    parts = [np.arange(hulls.offsets[i], hulls.offsets[i + 1]) for i in which]
    return np.concatenate([np.zeros(0, dtype=np.int64), *parts])


def calibration_statistics(share: Array, whole: Array) -> dict[str, Any]:
    """Standard deviations of v (m/s) and omega (rad/s), root sums of squares, by the calibration alone and of all.

    ``share``, ``whole`` (6, 6): covariances.
    """
    names = (("v_ms", slice(0, 3)), ("omega_rads", slice(3, 6)))
    return {name: {"calibration": _size(share[part, part]), "all": _size(whole[part, part])} for name, part in names}


def calibration_sentence(shares: dict[str, Any]) -> str:
    """Where the calibration has the larger share of a variance, that it has; nothing otherwise."""
    told = (("v_ms", "v", "m/s"), ("omega_rads", "ω", "rad/s"))
    limited = [
        f"{name} (± {shares[key]['calibration']:.2g} of ± {shares[key]['all']:.2g} {unit})"
        for key, name, unit in told
        if 2.0 * shares[key]["calibration"] ** 2 > shares[key]["all"] ** 2
    ]
    return f"The stated calibration, not the outlines, limits {' and '.join(limited)}." if limited else ""


NOT_CONSIDERED = (
    "The stated uncertainty of the camera, of lengths and of gravity is not in these error bars, only in those of single particles "
    "measured one by one."
)


def with_what_is_missing(estimate: Estimate, observation: Observation) -> Estimate:
    """The estimate; where a calibration's uncertainty is stated and not in its error bars, its message says so."""
    if estimate.middle is None or "calibration" in estimate.statistics or not states_calibration(observation):
        return estimate
    return replace(estimate, message=f"{estimate.message} {NOT_CONSIDERED}".strip())


def states_calibration(observation: Observation) -> bool:
    """Whether an observation says that its camera or gravity is not known exactly."""
    stated = (observation.gravity_covariance, *(camera.lens_covariance for camera in observation.cameras))
    return observation.sigma_length_scale is not None or any(each is not None and bool(each.any()) for each in stated)


def _size(covariance: Array) -> float:
    return float(np.sqrt(np.trace(covariance)))
