"""Bundle adjustment: cameras and boards such that the boards' corners appear where they were seen [Triggs et al. 2000].

``u = project(K_c, R_c (R_b X + t_b) + t_c)`` for corner X of the board in placement b. The first camera's frame is the world. Steps turn
frames from the left: ``R <- exp(w) R``. Distortion has a prior (below), everything else is free.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from datasets.vocabulary.calibration import LENS, POSE
from datasets.vocabulary.camera import Intrinsics
from estimator.calibration.sighting import BoardSighting
from estimator.fitting.levenberg_marquardt import NormalEquations

Array = NDArray[np.float64]

RADIAL_PRIOR, TANGENTIAL_PRIOR = 0.1, 0.005
"""Standard deviation of what a radial or tangential term displaces the picture's corner by, as a share of its distance from the centre.

Twice what lenses for these cameras have (a few per cent; decentring 0.1%). It only matters for terms that the pictures do not show at all,
as the highest of a long lens, which would otherwise have no finite covariance."""


@dataclass(frozen=True)
class Rig:
    """Cameras and placements of the board.

    From the world ``R_cam`` (c, 3, 3), ``t_cam`` (c, 3) m; to the world ``R_board`` (b, 3, 3), ``t_board`` (b, 3) m.
    """

    lenses: tuple[Intrinsics, ...]
    R_cam: Array
    t_cam: Array
    R_board: Array
    t_board: Array

    @property
    def camera_parameters(self) -> int:
        """Of all cameras together, the first without a pose."""
        return len(LENS) * len(self.lenses) + len(POSE) * (len(self.lenses) - 1)

    def lens_slice(self, camera: int) -> slice:
        """Where a camera's lens is among the parameters."""
        first = camera * (len(LENS) + len(POSE)) - (len(POSE) if camera else 0)
        return slice(first, first + len(LENS))

    def pose_slice(self, camera: int) -> slice:
        """Where the pose of a camera (not the first) is among the parameters."""
        end = self.lens_slice(camera).stop
        return slice(end, end + len(POSE))

    def board_slice(self, board: int) -> slice:
        """Where a placement is among the parameters."""
        first = self.camera_parameters + len(POSE) * board
        return slice(first, first + len(POSE))


@dataclass(frozen=True)
class Bundle:
    """What was seen, and what is believed.

    ``sightings``, the placement of each picture, corners ``corners_m`` (n, 3) in the board's frame, noise of each sighting (px), and the
    information ``prior`` (p, p).
    """

    sightings: tuple[BoardSighting, ...]
    placements: dict[int, int]
    corners_m: Array
    sigmas_px: tuple[float, ...]
    prior: Array

    def cost(self, rig: Rig) -> float:
        """Half the sum of squares."""
        pairs = zip(self.sightings, self.sigmas_px, strict=True)
        total = sum(float((self._residuals(rig, s) ** 2).sum()) / sigma**2 for s, sigma in pairs)
        off = lens_parameters(rig)
        return 0.5 * (total + float(off @ self.prior @ off))

    def residuals_px(self, rig: Rig) -> list[Array]:
        """Of every sighting (n, 2), seen minus predicted, px."""
        return [-self._residuals(rig, sighting) for sighting in self.sightings]

    def linearise(self, rig: Rig) -> NormalEquations:
        """Normal equations about ``rig``."""
        size = rig.board_slice(len(rig.t_board)).start
        H, g, total = np.zeros((size, size)), np.zeros(size), 0.0
        for sighting, sigma in zip(self.sightings, self.sigmas_px, strict=True):
            r = self._residuals(rig, sighting).ravel() / sigma
            where, J = self._jacobian(rig, sighting)
            J /= sigma
            H[where[:, None], where] += J.T @ J
            g[where] += J.T @ r
            total += float(r @ r)
        n, off = rig.camera_parameters, lens_parameters(rig)
        H[:n, :n] += self.prior
        g[:n] += self.prior @ off
        return NormalEquations(H, g, 0.5 * (total + float(off @ self.prior @ off)))

    def _points(self, rig: Rig, sighting: BoardSighting) -> tuple[Array, Array, Array]:
        """Corners turned by the board, in the world, and in the camera's frame."""
        b = self.placements[sighting.picture]
        turned = self.corners_m[sighting.corners] @ rig.R_board[b].T
        world = turned + rig.t_board[b]
        return turned, world, world @ rig.R_cam[sighting.camera].T + rig.t_cam[sighting.camera]

    def _residuals(self, rig: Rig, sighting: BoardSighting) -> Array:
        return rig.lenses[sighting.camera].project(self._points(rig, sighting)[2]) - sighting.points_px

    def _jacobian(self, rig: Rig, sighting: BoardSighting) -> tuple[Array, Array]:
        """Numbers of the parameters that a sighting depends on, and its derivative (2n, p)."""
        c, b = sighting.camera, self.placements[sighting.picture]
        turned, world, seen = self._points(rig, sighting)
        by_point, by_lens = projection_derivatives(rig.lenses[c], seen)
        in_world = by_point @ rig.R_cam[c]
        parts = [(rig.lens_slice(c), by_lens)]
        if c:
            parts.append((rig.pose_slice(c), np.concatenate([_turning(by_point, world @ rig.R_cam[c].T), by_point], axis=2)))
        parts.append((rig.board_slice(b), np.concatenate([_turning(in_world, turned), in_world], axis=2)))
        where = np.concatenate([np.arange(s.start, s.stop) for s, _ in parts])
        return where, np.concatenate([part for _, part in parts], axis=2).reshape(-1, len(where))


def _turning(by_point: Array, points: Array) -> Array:
    """Derivative (n, 2, 3) by a small turn of ``points``: ``d(exp(w) p)/dw = -[p]x``, so that each row becomes ``p x row``."""
    return np.cross(points[:, None, :], by_point)


def projection_derivatives(lens: Intrinsics, points_cam: Array) -> tuple[Array, Array]:
    """Derivatives of pixel coordinates by the point (n, 2, 3) and by the lens (n, 2, 9) in the order of ``LENS``.

    ``points_cam`` (n, 3) m.
    """
    k1, k2, p1, p2, k3 = lens.distortion
    depth = points_cam[:, 2]
    x, y = points_cam[:, 0] / depth, points_cam[:, 1] / depth
    r2 = x * x + y * y
    radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    slope = 2 * (k1 + r2 * (2 * k2 + 3 * r2 * k3))  # of ``radial`` along x is ``slope * x``
    cross = x * y * slope + 2 * p1 * x + 2 * p2 * y
    bend = np.empty((len(x), 2, 2))
    bend[:, 0, 0] = radial + x * x * slope + 2 * p1 * y + 6 * p2 * x
    bend[:, 1, 1] = radial + y * y * slope + 6 * p1 * y + 2 * p2 * x
    bend[:, 0, 1] = bend[:, 1, 0] = cross
    focal = np.array([lens.fx_px, lens.fy_px])
    ideal = np.zeros((len(x), 2, 3))
    ideal[:, 0, 0] = ideal[:, 1, 1] = 1 / depth
    ideal[:, 0, 2], ideal[:, 1, 2] = -x / depth, -y / depth
    by_lens = np.zeros((len(x), 2, len(LENS)))
    by_lens[:, 0, 0] = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
    by_lens[:, 1, 1] = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
    by_lens[:, 0, 2] = by_lens[:, 1, 3] = 1.0
    for column, power in ((4, r2), (5, r2**2), (8, r2**3)):
        by_lens[:, 0, column], by_lens[:, 1, column] = x * power, y * power
    by_lens[:, 0, 6], by_lens[:, 1, 6] = 2 * x * y, r2 + 2 * y * y
    by_lens[:, 0, 7], by_lens[:, 1, 7] = r2 + 2 * x * x, 2 * x * y
    by_lens[:, :, 4:] *= focal[None, :, None]
    return focal[None, :, None] * (bend @ ideal), by_lens


def moved(rig: Rig, step: Array) -> Rig:
    """The rig moved by a step of all its parameters.

    ``step`` (p,) of lenses, of the poses of all cameras but the first, and of the board's placements.
    """
    R_cam, t_cam = rig.R_cam.copy(), rig.t_cam.copy()
    for c in range(1, len(rig.lenses)):
        pose = step[rig.pose_slice(c)]
        R_cam[c] = Rotation.from_rotvec(pose[:3]).as_matrix() @ R_cam[c]
        t_cam[c] = t_cam[c] + pose[3:]
    boards = step[rig.camera_parameters :].reshape(-1, len(POSE))
    return replace(
        rig,
        lenses=tuple(with_lens(lens, lens_vector(lens) + step[rig.lens_slice(c)]) for c, lens in enumerate(rig.lenses)),
        R_cam=R_cam,
        t_cam=t_cam,
        R_board=Rotation.from_rotvec(boards[:, :3]).as_matrix() @ rig.R_board,
        t_board=rig.t_board + boards[:, 3:],
    )


def lens_vector(lens: Intrinsics) -> Array:
    """A lens in the order of ``LENS``."""
    return np.array([lens.fx_px, lens.fy_px, lens.cx_px, lens.cy_px, *lens.distortion])


def with_lens(lens: Intrinsics, values: Array) -> Intrinsics:
    """The lens with these values, in the order of ``LENS``; ``values`` (9,)."""
    fx, fy, cx, cy, k1, k2, p1, p2, k3 = values.tolist()
    return replace(lens, fx_px=fx, fy_px=fy, cx_px=cx, cy_px=cy, distortion=(k1, k2, p1, p2, k3))


def lens_parameters(rig: Rig) -> Array:
    """All lenses among the cameras' parameters (p,), zero for poses."""
    values = np.zeros(rig.camera_parameters)
    for c, lens in enumerate(rig.lenses):
        values[rig.lens_slice(c)] = lens_vector(lens)
    return values


def lens_prior(rig: Rig) -> Array:
    """Information (p, p) of the prior of distortion, whose mean is none; nothing of everything else."""
    information = np.zeros(rig.camera_parameters)
    for c, lens in enumerate(rig.lenses):
        rho = 0.5 * np.hypot(lens.width_px, lens.height_px) / (0.5 * (lens.fx_px + lens.fy_px))
        radial = [RADIAL_PRIOR / rho**power for power in (2, 4, 6)]
        tangential = TANGENTIAL_PRIOR / rho
        sigma = np.array([radial[0], radial[1], tangential, tangential, radial[2]])
        information[rig.lens_slice(c)] = np.concatenate([np.zeros(4), sigma**-2])
    return np.diag(information)
