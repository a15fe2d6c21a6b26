"""The tossed cube and its measured impacts: whole trajectories, its rounded edges and its inertia as the impacts show them, contact points.

The cube has the half-width h; its edges are taken as rounded with one radius r, so that it touches a plane with one of eight spheres of
radius r about the corners of a cube of half-width h - r, whatever its orientation. With S = sum |n·axis| the centre is then h S - r (S - 1)
above the plane: impacts tell r. Angular impulse over impulse, kappa Δomega = lever × Δv, tells kappa = inertia over mass, taken as the same
about every axis, and how far the centre of mass is from the cube's middle, which is what is tracked.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise, product
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from datasets.estimate import Estimate, ImpactEstimate
from datasets.trajectory import Surroundings, Trajectory
from datasets.vocabulary.body import Body
from datasets.vocabulary.plate import Plate
from estimator.contact.clump import Clump
from estimator.contact.solid import BodyState, Solid, SolidHull
from estimator.contact_validation.measured import MeasuredImpact
from scripts.real.real_tosses import GRAVITY_MS2, HALF_WIDTH_M, RATE_HZ, resting_height

Array = NDArray[np.float64]
MASS_KG = 0.37
NEAR_BOARD_M = 0.008
"""Height of the lowest nominal corner at an impact with the board; a hand that lets go is further up."""
CLEAR_SPREAD = 0.1
"""Of a frame: impacts whose parts are further apart in time are several contacts."""
FLAT_M = 0.003
"""A corner that lies higher than the lowest by less than this touches with it: 1.6° for an edge."""
BOARD = Plate(np.zeros(3), np.array([0.0, 0.0, 1.0]), normal_sigma_rad=np.deg2rad(0.2), offset_sigma_m=3e-4)
"""Tilt and height of the board as cubes at rest show them."""
CORNER_SIGMA_M = 5e-4
SIGNS = np.array(list(product((-1.0, 1.0), repeat=3)))


@dataclass(frozen=True)
class Cube:
    """``rounding_m`` of the edges, ``kappa_m2`` inertia over mass, ``centre`` (3,) m of mass from the cube's middle, body axes."""

    rounding_m: float
    kappa_m2: float
    centre: Array

    @property
    def inner(self) -> Array:
        """Centres (8, 3) m of the spheres that touch, from the centre of mass."""
        return np.asarray((HALF_WIDTH_M - self.rounding_m) * SIGNS - self.centre)

    @property
    def solid(self) -> Solid:
        """Mass, volume and inertia."""
        return Solid(MASS_KG, (2.0 * HALF_WIDTH_M) ** 3, self.kappa_m2 * MASS_KG * np.eye(3))

    @property
    def clump(self) -> Clump:
        """The spheres; they touch a plane exactly where the rounded cube does."""
        return Clump(self.solid, self.inner, np.full(8, self.rounding_m))

    def levers(self, R: Array) -> Array:
        """Lowest points (8, 3) m of the spheres from the centre of mass, world axes."""
        return self.inner @ R.T - self.rounding_m * BOARD.normal_world


@dataclass(frozen=True)
class CubeImpact:
    """An impact with the board: which toss, its ``number`` there, the record, and what the instrument says beside it."""

    toss: int
    number: int
    record: ImpactEstimate
    spread_s: float
    rows_in_contact: int

    @property
    def R(self) -> Array:
        """World from body (3, 3)."""
        return np.asarray(Rotation.from_quat(self.record.q_world_body).as_matrix())

    @property
    def clear(self) -> bool:
        """One contact, of no duration as far as can be seen."""
        return self.rows_in_contact == 0 and self.spread_s <= CLEAR_SPREAD / RATE_HZ

    @property
    def jump(self) -> Array:
        """Δv and Δomega (6,)."""
        after, before = self.record.after, self.record.before
        return np.concatenate([after.v_world - before.v_world, after.omega_world - before.omega_world])


def scale_of(path: Path) -> float:
    """What lengths are to be multiplied by so that the cube at rest has its half-width."""
    return HALF_WIDTH_M / float(np.median(resting_height(path)))


def whole_tosses(path: Path, centre: Array) -> list[Trajectory]:
    """Every toss from hand to rest, lengths to scale; the centre of mass lies at ``centre`` (3,) m in the tracked frame."""
    scale = scale_of(path)
    surroundings = Surroundings(np.array([0.0, 0.0, -GRAVITY_MS2]), Body(centre, np.eye(3), np.ones(3)))
    with np.load(path) as archive:
        data, offsets = archive["data"], archive["offsets"]
    tosses = []
    for number, (first, last) in enumerate(pairwise(offsets)):
        rows = data[first:last]
        q = rows[:, [4, 5, 6, 3]] / np.linalg.norm(rows[:, 3:7], axis=1, keepdims=True)
        bare = Trajectory(
            f"toss_{number:02d}", np.arange(len(rows)) / RATE_HZ, scale * rows[:, :3], q, None, None, None, None, surroundings
        )
        tosses.append(bare)
    return tosses


def board_impacts(estimates: Sequence[Estimate], centre: Array) -> list[CubeImpact]:
    """Impacts of estimates in which the cube touches the board."""
    found = []
    for toss, estimate in enumerate(estimates):
        told = estimate.statistics["impacts"]
        for number, record in enumerate(estimate.impacts):
            one = CubeImpact(toss, number, record, float(told[number]["spread_s"]), int(told[number]["rows_in_contact"]))
            height = middle_height(one, centre) - HALF_WIDTH_M * np.abs(one.R[2]).sum()
            if abs(height) < NEAR_BOARD_M and one.jump[2] > 0.0:
                found.append(one)
    return found


def middle_height(impact: CubeImpact, centre: Array) -> float:
    """Height (m) of the cube's middle."""
    return float(impact.record.x_world[2] - impact.R[2] @ centre)


def rounding_of(impacts: Sequence[CubeImpact], centre: Array) -> tuple[float, float, float]:
    """Radius (m) of the edges, the board's height (m) where it is left free, and the RMS (m) that both leave."""
    S = np.array([np.abs(i.R[2]).sum() for i in impacts])
    deep = HALF_WIDTH_M * S - np.array([middle_height(i, centre) for i in impacts])
    A = np.column_stack([S - 1.0, -np.ones_like(S)])
    (radius, height), *_ = np.linalg.lstsq(A, deep, rcond=None)
    return float(radius), float(height), float(np.sqrt(np.mean((A @ [radius, height] - deep) ** 2)))


@dataclass(frozen=True)
class Mass:
    """``kappa_m2`` and how far the centre of mass is from where it was taken to be, ``shift`` (3,) m, with standard deviations.

    ``agreement``: correlation of kappa times the change of spin with lever times impulse, over all impacts.
    """

    kappa_m2: float
    kappa_sigma_m2: float
    shift: Array
    shift_sigma: Array
    agreement: float


def mass_of(impacts: Sequence[CubeImpact], cube: Cube) -> Mass:
    """From kappa Δomega = (lever - R shift) × Δv of all impacts, by robust least squares."""
    push = np.array([np.cross(lowest_lever(cube, i), i.jump[:3]) for i in impacts])
    turn = np.array([i.jump[3:] for i in impacts])
    shifts = np.array([[np.cross(i.R[:, k], i.jump[:3]) for k in range(3)] for i in impacts])
    A = np.concatenate([turn[:, :, None], np.swapaxes(shifts, 1, 2)], axis=2).reshape(-1, 4)
    b = push.ravel()
    first = np.linalg.lstsq(A, b, rcond=None)[0]
    scale = 1.5 * float(np.median(np.abs(A @ first - b)))
    found = least_squares(lambda p: A @ p - b, first, loss="soft_l1", f_scale=scale)
    sigma = np.sqrt(np.diag(np.linalg.inv(found.jac.T @ found.jac)) * 2.0 * found.cost / (len(b) - 4))
    known = found.x[0] * turn + np.einsum("nki,k->ni", shifts, found.x[1:])
    agreement = float(np.sum(push * known) / np.sqrt(np.sum(push**2) * np.sum(known**2)))
    return Mass(float(found.x[0]), float(sigma[0]), found.x[1:], sigma[1:], agreement)


def lowest_lever(cube: Cube, impact: CubeImpact) -> Array:
    """From the centre of mass to the point that touches (3,) m, world axes."""
    levers = cube.levers(impact.R)
    return np.asarray(levers[int(np.argmin(levers[:, 2]))])


def clearances(cube: Cube, impact: CubeImpact) -> Array:
    """Heights (8,) m of the corners over the lowest, ascending."""
    heights = cube.levers(impact.R)[:, 2]
    return np.asarray(np.sort(heights) - heights.min())


def kind(cube: Cube, impact: CubeImpact) -> str:
    """What touches: "corner", "edge" or "face"."""
    over = clearances(cube, impact)
    return "face" if over[2] < FLAT_M else "edge" if over[1] < FLAT_M else "corner"


def measured(cube: Cube, impact: CubeImpact) -> MeasuredImpact:
    """The impact as contact models see it; the particle's corners are the points of the rounded cube that this board can touch."""
    record, R = impact.record, impact.R
    corners = cube.levers(R) @ R
    state = BodyState(record.x_world, R, record.before.v_world, record.before.omega_world)
    after = np.concatenate([record.after.v_world, record.after.omega_world])
    run = f"toss_{impact.toss:02d}"
    hull = SolidHull(cube.solid, corners)
    return MeasuredImpact(run, "tosses", impact.number, state, after, record.covariance, replace(BOARD), hull, CORNER_SIGMA_M)
