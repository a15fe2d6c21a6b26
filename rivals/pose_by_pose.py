"""Frame-by-frame pose, then smoothing: the visual hull is laid onto every outline by itself, and velocities are read off the poses.

A pose makes the support function of the hull's outline that of the frame's, in 72 directions, by Levenberg and Marquardt; the first frame
is tried from many orientations, each later one begins where the last ended. Positions are smoothed by the parabola under known gravity,
orientations about the middle by a cubic of the rotation vector (a local polynomial [Savitzky and Golay 1964], 1.5 rad to both sides).
"""

import sys
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from datasets.estimate import Estimate
from datasets.observation import Observation
from rivals.flight import Flight, Told, estimate_of
from rivals.hull import Hull, hull_of
from rivals.joining import joined
from rivals.seen import Seen, frames_seen

Array = NDArray[np.float64]
STARTS = 100
KEPT = 8
"""Orientations of the first frame that are tried, and how many of the best are followed."""
FOLLOWED = 15
"""Frames after which the best is chosen."""
TURN = 1.5
"""Rad: how far the body turns, to both sides of the middle, in the frames that the angular velocity is read off."""
_ANGLES = 2 * np.pi * np.arange(72) / 72
DIRECTIONS = np.column_stack([np.cos(_ANGLES), np.sin(_ANGLES)])


@dataclass(frozen=True)
class Poses:
    """``x`` (n, 3) m and ``turns`` (n) world from body, with the misses (n,) of their outlines (px, root mean square)."""

    x: Array
    turns: Rotation
    misses: Array


def measure(obs: Observation) -> Estimate:
    """Velocities read off the poses."""
    hull, seen = hull_of(obs), frames_seen(obs)
    at_s, flight, covariance = smoothed(poses_of(obs, hull, seen), seen.times_s, obs.gravity_world)
    return estimate_of(obs, Told(flight, at_s, covariance, hull.body, seen.rows))


def poses_of(obs: Observation, hull: Hull, seen: Seen) -> Poses:
    """A pose for every frame that is seen."""
    frames = [(outline @ DIRECTIONS.T).max(axis=0) for outline in seen.outlines]
    lay = _Laid(obs, hull.corners)
    depth = _depth(obs, hull, seen)
    first = lay.place(seen.outlines[0].mean(axis=0), depth)
    tried = [lay.onto(frames[0], first, turn, 15) for turn in Rotation.random(STARTS, rng=np.random.default_rng(0))]
    best = sorted(tried, key=lambda pose: pose[2])[:KEPT]
    followed = [_follow(lay, frames[:FOLLOWED], pose) for pose in best]
    chosen = min(followed, key=lambda track: sum(pose[2] ** 2 for pose in track))
    track = chosen + _follow(lay, frames[FOLLOWED:], chosen[-1])
    return Poses(np.array([x for x, _, _ in track]), Rotation.concatenate([turn for _, turn, _ in track]), np.array([m for *_, m in track]))


def smoothed(poses: Poses, times_s: Array, gravity: Array) -> tuple[float, Flight, Array]:
    """The middle instant (s), the flight there, and its covariance (12, 12) of x, v, rotation and omega by the poses' scatter."""
    middle = (len(times_s) - 1) // 2
    t = times_s - times_s[middle]
    design = np.column_stack([np.ones_like(t), t])
    free = poses.x - 0.5 * gravity * t[:, None] ** 2
    line = np.linalg.lstsq(design, free, rcond=None)[0]
    left = free - design @ line
    scatter = left.T @ left / max(len(t) - 2, 1)
    turned = (poses.turns[middle] * poses.turns[middle - 1].inv()).magnitude() + 1e-6
    turn, omega, spread = _turning(poses.turns, t, middle, max(4, int(TURN / turned)))
    covariance = np.zeros((12, 12))
    covariance[:6, :6] = np.kron(np.linalg.inv(design.T @ design), scatter)
    covariance[6:, 6:] = spread
    return float(times_s[middle]), Flight(line[0], line[1], turn.as_quat(), omega), covariance


def _turning(turns: Rotation, t: Array, k: int, half: int) -> tuple[Rotation, Array, Array]:
    """Orientation, omega (3,) (rad/s, world frame) and their covariance (6, 6) at row ``k``, by a cubic over ``half`` rows either side."""
    rows = np.arange(max(0, k - half), min(len(t), k + half + 1))
    unit = np.abs(t[rows]).max()
    vectors = (turns[rows] * turns[k].inv()).as_rotvec()
    design = np.vander(t[rows] / unit, 4, increasing=True)
    fitted = np.linalg.lstsq(design, vectors, rcond=None)[0]
    left = vectors - design @ fitted
    shape = np.linalg.inv(design.T @ design)[:2, :2] / np.outer([1.0, unit], [1.0, unit])
    spread = np.kron(shape, left.T @ left / max(len(rows) - 4, 1))
    return Rotation.from_rotvec(fitted[0]) * turns[k], fitted[1] / unit, spread


class _Laid:
    """Lays a convex hull onto outlines of the first camera."""

    def __init__(self, obs: Observation, corners: Array) -> None:
        self.camera, self.corners = obs.cameras[0], corners

    def place(self, centre: Array, depth: float) -> Array:
        """The point (3,) (world, m) that is seen at ``centre`` (px), so far away."""
        ray = np.append(self.camera.intrinsics.normalise(centre[None])[0], 1.0)
        found: Array = (ray * depth - self.camera.t_cam_world) @ self.camera.R_cam_world
        return found

    def supports(self, x: Array, turn: Rotation) -> Array:
        """The support function (px) of the hull's outline in :data:`DIRECTIONS`."""
        world = turn.apply(self.corners) + x
        pixels = self.camera.intrinsics.project(world @ self.camera.R_cam_world.T + self.camera.t_cam_world)
        found: Array = (pixels @ DIRECTIONS.T).max(axis=0)
        return found

    def onto(self, frame: Array, x: Array, turn: Rotation, steps: int = 8) -> tuple[Array, Rotation, float]:
        """The pose near a start, and the root mean square (px) of what it misses."""
        depth = (self.camera.R_cam_world @ x + self.camera.t_cam_world)[2]
        unit = depth / self.camera.intrinsics.fx_px

        def missed(step: Array) -> Array:
            shift = np.array([step[0], step[1], 50 * step[2]]) * unit
            return self.supports(x + shift @ self.camera.R_cam_world, Rotation.from_rotvec(step[3:] / 100) * turn) - frame

        found = least_squares(missed, np.zeros(6), method="lm", max_nfev=7 * steps)
        step = found.x
        shift = np.array([step[0], step[1], 50 * step[2]]) * unit
        moved = x + shift @ self.camera.R_cam_world
        return moved, Rotation.from_rotvec(step[3:] / 100) * turn, float(np.sqrt(np.mean(found.fun**2)))


def _follow(lay: _Laid, frames: list[Array], start: tuple[Array, Rotation, float]) -> list[tuple[Array, Rotation, float]]:
    """Poses of frames in their order; each begins where the two before it point to."""
    track: list[tuple[Array, Rotation, float]] = []
    before, last = start, start
    for frame in frames:
        ahead = last[1] * before[1].inv() * last[1] if track else last[1]
        x = 2 * last[0] - before[0] if track else last[0]
        before, last = last, min((lay.onto(frame, x, ahead), lay.onto(frame, x, last[1])), key=lambda pose: pose[2])
        track.append(last)
    return track


def _depth(obs: Observation, hull: Hull, seen: Seen) -> float:
    """How far away (m) the first frame's outline is: as large as the hull is on average over all orientations."""
    size = np.mean([np.ptp(hull.corners @ d) for d in Rotation.random(200, rng=np.random.default_rng(0)).apply([1.0, 0.0, 0.0])])
    width = np.mean([np.ptp(seen.outlines[0] @ d) for d in DIRECTIONS])
    return float(obs.cameras[0].intrinsics.fx_px * size / width)


if __name__ == "__main__":
    sys.exit(joined("pose_by_pose", measure))
