"""Epipolar tangency error after the paper: eight numbers drawn, Runge-Kutta, no weights, at most a hundred starts.

Planes through the centre of a frame's camera and that of a calibrated view, tangent to the particle, touch both outlines; where a pose
is wrong they do not agree, by the epipolar tangency error [Hernandez, Schmitt and Cipolla, IEEE PAMI 29 (2007) 343]. Its squares, those of
all frames against all views alike, are minimised. Position and velocity across the line of sight begin where the outlines' centroids are
seen. That leaves eight numbers: depth and its velocity, which begin as the outlines' size has them, and orientation and angular velocity,
which are drawn (which eight the paper means is our reading). Of 2000 draws the hundred of the smallest error before any step are starts;
each is followed over the first frames, all twelve numbers free, until one ends below half a pixel. The best is followed over twice as many,
and so on. What ends above 1.5 px, the paper's selection, is no measurement. Mass properties are those of the visual hull.
"""

import sys
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import OptimizeResult, least_squares
from scipy.spatial.transform import Rotation

from datasets.estimate import Estimate
from datasets.observation import Observation
from rivals import centroids
from rivals.flight import Flight, Told, estimate_of, motion_of
from rivals.hull import Hull, hull_of
from rivals.joining import joined
from rivals.seen import Seen, frames_seen, outlines_of, rays, support_points

Array = NDArray[np.float64]
STARTS = 100
ENOUGH_PX, SELECTED_PX = 0.5, 1.5
"""Root mean square of the error below which no other start is tried, and above which the paper leaves a flight out."""
FEW, MANY = (12, 12), (40, 60)
"""Frames and views of a start and of the last refinement at most, spread evenly."""
BEGUN = 24
"""Frames that a start is followed over."""
FASTEST = 300.0
"""Random spins are up to this (rad/s), whatever their axis."""
STEPS = np.repeat([1e-4, 1e-2, 0.05, 5.0], 3)
"""Of x (m), v (m/s), rotation (rad) and omega (rad/s): what one unit of the optimiser's is."""


def measure(obs: Observation) -> Estimate:
    """The flight of the smallest epipolar tangency error."""
    hull, seen = hull_of(obs), frames_seen(obs)
    tracked = centroids.measure(obs)
    if tracked.motion is None:
        raise ValueError("expected centroids that follow a parabola, got none")
    x, v = tracked.motion.x_world[0], tracked.motion.v_world[0]
    frames = min(BEGUN, len(seen.rows))
    flight, end = min(_ends(_Pairs(obs, hull, seen, (frames, *FEW)), x, v), key=lambda found: found[1].cost)
    while frames < len(seen.rows):
        frames = min(2 * frames, len(seen.rows))
        flight, end = _descended(_Pairs(obs, hull, seen, (frames, *FEW)), flight)
    flight, end = _descended(_Pairs(obs, hull, seen, (frames, *MANY)), flight)
    if _rms(end) > SELECTED_PX:
        raise ValueError(f"expected an epipolar tangency error below {SELECTED_PX} px, got {_rms(end):.1f} px")
    jacobian: Array = np.asarray(end.jac) / STEPS
    covariance = np.linalg.inv(jacobian.T @ jacobian) * 2 * end.cost / (len(end.fun) - len(STEPS))
    return estimate_of(obs, Told(flight, 0.0, covariance, hull.body, seen.rows))


def _ends(pairs: "_Pairs", x: Array, v: Array) -> Iterator[tuple[Flight, OptimizeResult]]:
    """Where random starts end, of many the best by their error before any step; none after the first that is enough."""
    rng = np.random.default_rng(0)
    turns = Rotation.random(STARTS * 20, rng=rng).as_quat()
    spins = rng.normal(size=(STARTS * 20, 3))
    spins *= (rng.uniform(0.0, FASTEST, STARTS * 20) / np.linalg.norm(spins, axis=1))[:, None]
    flights = [Flight(x, v, q, omega) for q, omega in zip(turns, spins, strict=True)]
    for flight in sorted(flights, key=lambda flight: float(np.mean(pairs.errors(flight) ** 2)))[:STARTS]:
        end = _descended(pairs, flight)
        yield end
        if _rms(end[1]) < ENOUGH_PX:
            return


def _descended(pairs: "_Pairs", start: Flight) -> tuple[Flight, OptimizeResult]:
    def errors(step: Array) -> Array:
        return pairs.errors(start.moved(step * STEPS))

    end = least_squares(errors, np.zeros(len(STEPS)), method="lm", max_nfev=12 * (len(STEPS) + 1))
    return start.moved(end.x * STEPS), end


def _rms(end: OptimizeResult) -> float:
    return float(np.sqrt(2 * end.cost / len(end.fun)))


def _spread(count: int, most: int) -> NDArray[np.int64]:
    return np.unique(np.linspace(0, count - 1, min(count, most)).astype(np.int64))


@dataclass(frozen=True)
class _Sighting:
    """The centre (3,) (m) of a view's camera and the directions (s, 3) in which the outline is seen, particle frame."""

    centre: Array
    rays: Array


class _Pairs:
    """Epipolar tangency errors of the first so many frames, of which so many, against so many calibrated views."""

    def __init__(self, obs: Observation, hull: Hull, seen: Seen, most: tuple[int, int, int]) -> None:
        self.obs, self.body = obs, hull.body
        frames, views = _spread(most[0], most[1]), _spread(len(obs.views), most[2])
        camera = obs.cameras[0]
        self.times = seen.times_s[frames]
        self.frames = np.array([rays(camera.intrinsics, support_points(seen.outlines[k])) @ camera.R_cam_world for k in frames])
        outlines = outlines_of(obs.view_recording)
        sightings = [_sighting(obs, k, outlines[k]) for k in views if len(outlines[k])]
        self.centres = np.array([sighting.centre for sighting in sightings])
        self.views = np.array([sighting.rays for sighting in sightings])
        self.camera = -camera.R_cam_world.T @ camera.t_cam_world
        self.focal = camera.intrinsics.fx_px

    def errors(self, flight: Flight) -> Array:
        """Of both tangents of every pair (2 f v,), px in the frame's picture."""
        motion = motion_of(flight, self.times, self.body, self.obs.gravity_world)
        turn = Rotation.from_quat(motion.q_world_body).as_matrix() @ self.body.R_particle_body.T  # world from particle
        centre = self.body.com_particle + np.einsum("fji,fj->fi", turn, self.camera - motion.x_world)
        seen = np.einsum("fsj,fji->fsi", self.frames, turn)
        base = centre[:, None] - self.centres
        base = base / np.linalg.norm(base, axis=2)[..., None]
        towards = self.body.com_particle - centre
        up = np.cross(base, towards[:, None])
        up /= np.linalg.norm(up, axis=2)[..., None]
        ahead = np.cross(up, base)
        here = [np.einsum("fvi,fsi->fvs", axis, seen) for axis in (ahead, up)]
        there = [np.einsum("fvi,vsi->fvs", axis, self.views) for axis in (ahead, up)]
        angles, theirs = np.arctan2(here[1], here[0]), np.arctan2(there[1], there[0])
        lever = self.focal * np.linalg.norm(towards, axis=1)[:, None] ** -1 * np.einsum("fvi,fi->fv", ahead, towards)
        both = [(angles.max(axis=2) - theirs.max(axis=2)) * lever, (angles.min(axis=2) - theirs.min(axis=2)) * lever]
        return np.array(both).ravel()


def _sighting(obs: Observation, k: int, outline: Array) -> _Sighting:
    view = obs.views[k]
    directions = rays(view.intrinsics, support_points(outline)) @ view.R_cam_particle
    return _Sighting(-view.R_cam_particle.T @ view.t_cam_particle, directions)


if __name__ == "__main__":
    sys.exit(joined("epipolar_tangency", measure))
