"""How accurately v and omega can be measured with this geometry: the covariance of a flight that the recording might show.

The flight is where the outlines are and as fast as they move in the picture; how the particle is turned and spins is not known before a
fit, so several orientations are drawn, each turning by half a turn during the recording. The body's convex hull casts its outlines along
that flight, as noisy as the recorded ones, and the normal equations of the estimate are set up there [Fisher information; the bound of
Cramér and Rao for what is unbiased]. Depth is from the area of the outlines: that of a convex body is a quarter of its surface in the mean
over all orientations [Cauchy 1832].

Valid for a free flight of one particle (of a recording with impacts: the longest stretch without any) that is seen by its first camera in
most frames. The stated uncertainty of its lens and of gravity is in it; outlines' errors other than noise, a calibration that is worse than
it says and a bias of the hull are not, so estimates are at best as good as this.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from datasets.observation import Observation
from datasets.vocabulary.camera import Intrinsics
from datasets.vocabulary.outline import signed_area
from estimator.appearance.hull_outlines import hull_of, like_noise, outline_of
from estimator.data.configuration import Configuration
from estimator.data.fit_task import FitTask, Sightings
from estimator.data.no_measurement import NoMeasurement
from estimator.fitting.calibration_share import calibration_share
from estimator.fitting.refinement import sandwich, system_at
from estimator.fitting.stable_inverse import NothingSeen
from estimator.fitting.tasks import fit_task, refinement_settings
from estimator.measurements.silhouettes.imagined import NEVER_OUTLYING
from estimator.motion.flight import OMEGA, Flight, V, flown
from estimator.outlines.result import OutlineTrack
from estimator.outlines.sightings import usable_sightings
from estimator.particle.particle import Particle, views_like
from estimator.readiness.inspection import Inspection, parabola

Array = NDArray[np.float64]
DRAWS = 5
"""Orientations and spin axes that are drawn; the median over them is promised."""
TURN_RAD = np.pi
"""How far the particle turns during the recording: half a turn shows it from all sides."""


@dataclass(frozen=True)
class Promise:
    """Standard deviations at the recording's middle, medians over drawn orientations.

    ``v_ms`` (3,) m/s along the first camera's axes (x, y across, z in depth), ``omega_rads`` (3,) rad/s alike. ``speed_ms``: of the motion
    across the picture; ``depth_m`` the particle's; ``turn_rads``: the angular speed that is taken.
    """

    v_ms: Array
    omega_rads: Array
    speed_ms: float
    depth_m: float
    turn_rads: float


def promise_of(
    observation: Observation, tracks: tuple[OutlineTrack, ...], inspection: Inspection, particle: Particle, configuration: Configuration
) -> Promise | None:
    """What can be promised of an observation, ``look`` being that at its first camera; ``None`` where too little is seen."""
    try:
        sightings = usable_sightings(observation, tracks, configuration)
    except NoMeasurement:
        return None
    if inspection.times_s is None or len(inspection.free.frame) < configuration.minimum_frames:
        return None
    within = (sightings.frame >= inspection.free.frame[0]) & (sightings.frame <= inspection.free.frame[-1])
    sightings = sightings.take(np.flatnonzero(within))
    rng = np.random.default_rng(configuration.seed)
    views = views_like(particle, sightings.silhouettes, rng)
    task = fit_task(observation, particle, sightings, views, configuration)
    base = _flight(observation, inspection, particle)
    spin = TURN_RAD / float(np.ptp(sightings.times_s))
    found = [_deviations(task, _turned(base, spin, rng), particle, configuration, stated=observation) for _ in range(DRAWS)]
    known = np.array([each for each in found if each is not None])
    if len(known) == 0:
        return None
    R = observation.cameras[0].R_cam_world
    depth = float((R @ base.x + observation.cameras[0].t_cam_world)[2])
    middle = np.median(known, axis=0)
    return Promise(middle[:3], middle[3:], float(np.linalg.norm(base.v)), depth, spin)


def depth_of(particle: Particle, inspection: Inspection, lens: Intrinsics) -> float:
    """Distance (m) at which the particle's mean shadow has the mean area of the outlines of ``look``, of which there is one at least."""
    areas_px2 = [signed_area(inspection.track.frames[f].outline.points_px) for f in inspection.path.frame]
    shadow = ConvexHull(particle.hull.vertices).area / 4.0
    return float(np.sqrt(lens.fx_px * lens.fy_px * shadow / np.mean(areas_px2)))


def _flight(observation: Observation, inspection: Inspection, particle: Particle) -> Flight:
    """The flight, not turned, along the centres' parabola at the depth that the outlines' area says."""
    camera = observation.cameras[0]
    lens = camera.intrinsics
    assert inspection.times_s is not None
    z = depth_of(particle, inspection, lens)
    coefficients, _ = parabola(inspection)
    centre = lens.normalise(coefficients[:1])[0]
    x_cam = z * np.append(centre, 1.0)
    v_cam = z * np.append(coefficients[1] / [lens.fx_px, lens.fy_px], 0.0)
    return Flight(
        time_s=float(inspection.times_s[inspection.free.frame].mean()),
        x=camera.R_cam_world.T @ (x_cam - camera.t_cam_world),
        q=np.array([0.0, 0.0, 0.0, 1.0]),
        v=camera.R_cam_world.T @ v_cam,
        omega=np.zeros(3),
        body=particle.body,
        com=np.zeros(3),
        inertia=np.zeros(5),
        offset_px=0.0,
        gravity_world=np.asarray(observation.gravity_world, dtype=np.float64),
    )


def _turned(base: Flight, spin_rads: float, rng: np.random.Generator) -> Flight:
    axis = rng.standard_normal(3)
    q = np.asarray(Rotation.random(rng=rng).as_quat(), dtype=np.float64)
    return Flight(**{**vars(base), "q": q, "omega": spin_rads * axis / np.linalg.norm(axis)})


def _deviations(task: FitTask, flight: Flight, particle: Particle, configuration: Configuration, *, stated: Observation) -> Array | None:
    """Standard deviations (6,) of v and omega of a flight as its own outlines would show it; ``None`` where they do not determine it."""
    imagined = _as_seen(task, flight, particle)
    if imagined is None:
        return None
    system = system_at(imagined, flight, refinement_settings(configuration))
    (at,) = system.told
    frames = replace(at.frames, chi2=at.frames.count.astype(np.float64))  # errors are to be as large as the noise model says
    try:
        covariance = sandwich(replace(system, told=(replace(at, frames=frames),)))
    except NothingSeen:
        return None
    share = calibration_share(flight, at, system.solved().shared, stated)
    covariance = covariance if share is None else covariance + share.parameters @ share.parameters.T
    R = imagined.sightings.cameras[0].R_cam_world
    v, omega = (R @ covariance[part, part] @ R.T for part in (V, OMEGA))
    return np.sqrt(np.concatenate([np.diag(v), np.diag(omega)]))


def _as_seen(task: FitTask, flight: Flight, particle: Particle) -> FitTask | None:
    """The task with the outlines that the particle's convex hull casts along ``flight``, as noisy as the recorded ones.

    ``None`` where the flight goes behind a camera.
    """
    sightings = task.sightings
    predicted = flown(flight, sightings.times_s)
    corners = hull_of(particle)
    R = sightings.R_cam_world @ predicted.R[:, 0]
    centre = np.einsum("nij,nj->ni", sightings.R_cam_world, predicted.centre[:, 0]) + sightings.t_cam_world
    if float(centre[:, 2].min()) <= float(np.linalg.norm(corners, axis=1).max()):
        return None
    lenses = [sightings.cameras[c].intrinsics for c in sightings.camera]
    polygons = [outline_of(corners @ a.T + b, lens) for a, b, lens in zip(R, centre, lenses, strict=True)]
    seen = like_noise(polygons, lenses, sightings.silhouettes)
    shown = Sightings(seen, sightings.camera, sightings.frame, sightings.times_s, sightings.cameras)
    return FitTask(shown, task.views, task.prior, NEVER_OUTLYING, task.weight)
