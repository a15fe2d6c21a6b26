"""What the uncertainty of the camera's calibration, and of measured gravity, adds to that of a flight.

A calibration is not estimated again from a flight, it is considered [Schmidt 1966; Bierman 1977, ch. 8]: with ``H`` the normal matrix at
the fitted flight, ``W`` the weighed derivatives and ``e(p)`` the errors, a lens or a gravity that is off by ``d`` moves the fit by
``-H⁻¹ Wᵀ (de/dp) d``. For ``d`` the columns of ``L``, ``L Lᵀ`` the stated covariance, that gives the columns ``A`` whose ``A Aᵀ`` is
added to the flight's covariance. A gravity that is off enters the velocity at another time directly, too. Derivatives are central
differences; the particle's calibrated views, whose cameras are others as a rule, say how well they agree themselves.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from datasets.estimate import Estimate, VelocityEstimate
from datasets.observation import Observation
from datasets.vocabulary.camera import HsvCamera
from estimator.appearance.flight_errors import unbiased_errors
from estimator.data.fit_task import FitTask
from estimator.fitting.refinement import Linearised, Refined, Refinement, linearise, scaled_inverse
from estimator.fitting.within_sequence import within_equations
from estimator.geometry.silhouettes import Silhouettes
from estimator.motion.flight import Flight, FlightPoses, poses_and_sensitivity, velocity_sensitivity

Array = NDArray[np.float64]
State = TypeVar("State")
Other = Callable[[float], tuple[FitTask, State]]
STEP = 0.01
"""Of the central differences, in standard deviations of the calibration: one of those may move outlines by many times their noise."""


@dataclass(frozen=True)
class CalibrationShare:
    """Moves ``parameters`` (21, c) of a flight with each of c independent errors of the calibration, one standard deviation of each.

    ``gravity`` (3, c) m/s2: by how much the true gravity is then another.
    """

    parameters: Array
    gravity: Array

    def covariance(self, J: Array, since_s: float) -> Array:
        """What it adds to the covariance (6, 6) of (v, omega), of derivatives ``J`` (6, 21), ``since_s`` after the flight's own time."""
        moved = J @ self.parameters
        moved[:3] += since_s * self.gravity
        return np.asarray(moved @ moved.T)


def calibration_share(
    task: FitTask, flight: Flight, settings: Refinement, gravity_covariance: Array | None = None
) -> CalibrationShare | None:
    """The share of a calibration in a refined flight; ``None`` where no uncertainty is stated.

    ``gravity_covariance`` (3, 3) m²/s⁴, world frame.
    """
    others, gravity = calibration_errors(task, flight, gravity_covariance, _under)
    if not others:
        return None
    at = linearise(task, flight, settings)

    def seen(task: FitTask, flight: Flight) -> tuple[Array, Array]:
        return seen_under(task, flight, poses_and_sensitivity(flight, task.sightings.times_s)[0], (at, settings))

    return CalibrationShare(calibration_moves(at, others, seen), gravity)


def calibration_errors(
    task: FitTask, flight: State, gravity_covariance: Array | None, under: Callable[[State, Array], State]
) -> tuple[list[Other[State]], Array]:
    """Independent errors of the calibration, each the task and the flight with so many times of it, and what they add to gravity (3, c).

    ``under``: a flight under a gravity that is another by (3,) m/s2.
    ``gravity_covariance`` (3, 3) m²/s⁴, world frame.
    """
    cameras = enumerate(task.sightings.cameras)
    lenses = [_through(task, flight, (number, column)) for number, camera in cameras for column in _lens_errors(camera)]
    pulls = [] if gravity_covariance is None else list(_columns(gravity_covariance))
    gravity = np.zeros((3, len(lenses) + len(pulls)))
    gravity[:, len(lenses) :] = np.array(pulls).reshape(-1, 3).T

    def pulled(pull: Array) -> Other[State]:
        return lambda times: (task, under(flight, times * pull))

    return [*lenses, *(pulled(pull) for pull in pulls)], gravity


def calibration_moves(at: Linearised, others: Sequence[Other[State]], seen: Callable[[FitTask, State], tuple[Array, Array]]) -> Array:
    """By how much each of c errors moves the p parameters (p, c); ``seen``: errors and gradient as of :func:`seen_under`."""
    inverse, columns = scaled_inverse(at.H), []
    for other in others:
        (high, high_within), (low, low_within) = (seen(*other(sign * STEP)) for sign in (1.0, -1.0))
        change = np.where(np.isfinite(high - low), high - low, 0.0)
        change_of_gradient = np.einsum("nksp,nks->p", at.frames.weighted, change) + high_within - low_within
        columns.append(-inverse @ change_of_gradient / (2.0 * STEP))
    return np.array(columns).reshape(-1, len(at.g)).T


def seen_under(task: FitTask, flight: Flight, predicted: FlightPoses, of: tuple[Linearised, Refinement]) -> tuple[Array, Array]:
    """Errors (n, k, 2) px of the pairs with views, NaN where there is none, and the gradient (p,) of those within the sequence."""
    at, settings = of
    errors = unbiased_errors(task, flight, predicted)
    within = within_equations(task, flight, predicted, at.S, most_pairs=settings.within_pairs, floor_px=settings.floor_px)
    return np.where(errors.told[..., :2], errors.error[..., :2], np.nan), within.g


def _columns(covariance: Array) -> Iterator[Array]:
    """Independent errors (n,) each, one standard deviation large, whose squares sum to a covariance (n, n)."""
    scale = np.sqrt(np.diag(covariance))
    scale[scale == 0.0] = 1.0
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    for value, vector in zip(values, vectors.T, strict=True):
        if value > 0.0:
            yield np.sqrt(value) * scale * vector


def _lens_errors(camera: HsvCamera) -> Sequence[Array]:
    return [] if camera.lens_covariance is None else list(_columns(camera.lens_covariance))


def _through(task: FitTask, flight: State, error: tuple[int, Array]) -> Other[State]:
    """The task as one camera would have it whose lens is off by so many times an ``error`` (its number, (9,))."""
    number, off = error
    given, first = task.sightings.cameras[number].intrinsics, task.sightings.silhouettes
    own = np.flatnonzero(task.sightings.camera == number)
    rows = _rows(first, own)

    def through(times: float) -> tuple[FitTask, State]:
        lens = given.with_numbers(given.numbers + times * off)
        xy, focal = first.xy.copy(), first.focal_px.copy()
        xy[rows], focal[own] = lens.normalise(first.points_px[rows]), (lens.fx_px, lens.fy_px)
        return replace(task, sightings=replace(task.sightings, silhouettes=replace(first, xy=xy, focal_px=focal))), flight

    return through


def _under(flight: Flight, pull: Array) -> Flight:
    return replace(flight, gravity_world=flight.gravity_world + pull)


def _rows(hulls: Silhouettes, which: NDArray[np.int64]) -> NDArray[np.int64]:
    """Vertices of some hulls."""
    parts = [np.arange(hulls.offsets[i], hulls.offsets[i + 1]) for i in which]
    return np.concatenate([np.zeros(0, dtype=np.int64), *parts])


def calibration_statistics(refined: Refined, share: CalibrationShare, velocity: VelocityEstimate) -> dict[str, Any]:
    """Standard deviations of v (m/s) and omega (rad/s) at a time, root sums of squares, by the calibration alone and of all."""
    J = velocity_sensitivity(refined.flight, velocity.time_s)
    of_it = share.covariance(J, velocity.time_s - refined.flight.time_s)
    names = (("v_ms", slice(0, 3)), ("omega_rads", slice(3, 6)))
    return {name: {"calibration": _size(of_it[part, part]), "all": _size(velocity.covariance[part, part])} for name, part in names}


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
    "The stated uncertainty of the camera and of gravity is not in these error bars, only in those of single particles measured one by one."
)


def with_what_is_missing(estimate: Estimate, observation: Observation) -> Estimate:
    """The estimate; where a calibration's uncertainty is stated and not in its error bars, its message says so."""
    if estimate.middle is None or "calibration" in estimate.statistics or not states_calibration(observation):
        return estimate
    return replace(estimate, message=f"{estimate.message} {NOT_CONSIDERED}".strip())


def states_calibration(observation: Observation) -> bool:
    """Whether an observation says that its camera or gravity is not known exactly."""
    stated = (observation.gravity_covariance, *(camera.lens_covariance for camera in observation.cameras))
    return any(each is not None and bool(each.any()) for each in stated)


def _size(covariance: Array) -> float:
    return float(np.sqrt(np.trace(covariance)))
