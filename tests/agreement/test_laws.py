"""One law that each reduced model keeps: a conservation, a closed solution, or a symmetry of its own.

Nature's realisations are held to such laws in ``tests/synth/effects``. Here no nature is needed; the registry is covered whole.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from datasets.vocabulary.body import Body
from datasets.vocabulary.camera import HsvCamera, Intrinsics
from datasets.vocabulary.effects import EFFECTS, PICTURED
from estimator.appearance.prediction import Prediction, predict
from estimator.data.fit_task import OUTWARD
from estimator.data.seen_by import SeenBy
from estimator.effects.link import Moment, Moving, Places, Setting
from estimator.effects.model import Model, ModelForces
from estimator.effects.registry import MODELS
from estimator.geometry.outline_shape import ANGLES, BLURS_PX, DEPTHS_PX, outline_shape
from estimator.geometry.outline_smear import LEVELS
from estimator.likelihood.time_shifts import gain_of
from estimator.motion.flight import N_PARAMETERS, Flight, inertia_matrix, states
from estimator.motion.rigid_body import States, angular_velocity, rotation_matrices

Array = np.ndarray
GRAVITY, NO_GRAVITY = np.array([0.0, 9.80665, 0.0]), np.zeros(3)
TIMES = np.linspace(0.0, 0.03, 61)
RATIOS = np.array([0.6, 0.8, 1.0])
CAMERA = Intrinsics(1024, 768, 6000.0, 6100.0, 500.0, 390.0)
CENTRE = np.array([500.0, 390.0])
POINTS = CENTRE + np.random.default_rng(2).uniform(-300.0, 300.0, (30, 2))
DEPTHS_M, RADIUS_M = np.linspace(0.6, 0.63, 5), 3e-3
SETTING = Setting(TIMES, 1e-4, GRAVITY, RATIOS)


def flight(gravity: Array = NO_GRAVITY) -> Flight:
    body = Body(np.zeros(3), np.eye(3), RATIOS)
    v, omega = np.array([1.0, -0.5, 0.3]), np.array([50.0, 120.0, -80.0])
    return Flight(0.0, np.array([0.01, -0.02, 0.6]), np.array([0.5, 0.5, 0.5, 0.5]), v, omega, body, np.zeros(3), np.zeros(5), 0.0, gravity)


def flown(key: str, *theta: float, start: Flight | None = None) -> Prediction:
    return predict(start or flight(), Model((MODELS[key],)), np.array(theta), SETTING, TIMES)


def reached(key: str, *theta: float) -> States:
    """States (frame, 1, ·) under a force."""
    forces = ModelForces(Model((MODELS[key],)), np.array([theta]), SETTING)
    return states(flight(), np.zeros((1, N_PARAMETERS)), TIMES, forces)


def corrected(key: str, *theta: float, points: Array = POINTS, times_s: Array | float = 0.0) -> Array:
    return MODELS[key].correct(np.array(theta), points, CAMERA, np.broadcast_to(times_s, len(points)))


def places() -> Places:
    """Made-up tangencies of five sightings with seven views."""
    rng = np.random.default_rng(4)
    angle = rng.uniform(0.0, 2 * np.pi, (5, 7, 2))
    shape, normal = angle.shape, np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    centre = np.column_stack([rng.uniform(-0.04, 0.04, (5, 2)), DEPTHS_M])
    return Places(
        point_px=rng.uniform(0.0, 700.0, (*shape, 2)),
        normal=normal,
        normal_body=np.concatenate([normal, np.zeros((*shape, 1))], axis=-1),
        velocity_px=rng.normal(scale=2e4, size=(*shape, 2)),
        radius_px=rng.uniform(5.0, 60.0, shape),
        mean_radius_px=rng.uniform(20.0, 40.0, 5),
        sharpness=rng.uniform(0.01, 0.2, shape),
        recession=rng.uniform(0.005, 0.1, (*shape, len(BLURS_PX))),
        erosion=np.ones((*shape, len(DEPTHS_PX))),
        dilation=np.ones((*shape, len(DEPTHS_PX))),
        leak=rng.uniform(0.5, 0.9, (*shape, len(DEPTHS_PX))),
        smear=np.zeros((*shape, len(LEVELS))),
        outline_px=CAMERA.project((centre[:, None] + RADIUS_M * np.pad(OUTWARD, ((0, 0), (0, 1)))).reshape(-1, 3)).reshape(5, -1, 2),
        outward=OUTWARD,
        rows_px=np.zeros(5),
        depth_m=DEPTHS_M,
        first_depth_m=np.full(5, 0.6),
        view_ratio=rng.uniform(-0.3, -0.1, shape),
        seen=SeenBy((HsvCamera("hsv", CAMERA, np.eye(3), np.zeros(3)),), np.zeros(5, dtype=np.int64)),
        times_s=np.arange(5) / 4000,
        moving=Moving(ball, np.tile(np.eye(3), (5, 1, 1)), centre, rng.normal(size=(5, 3)), rng.normal(scale=100.0, size=(5, 3))),
    )


def ball(normals: Array) -> Array:
    """Points furthest along normals (..., 3) on a ball."""
    return np.asarray(RADIUS_M * normals / np.linalg.norm(normals, axis=-1, keepdims=True))


def shift(key: str, theta: float, at: Places) -> Array:
    found = MODELS[key].shift(np.array([theta]), at, SETTING)
    assert found is not None
    assert np.abs(found).max() > 1e-3
    return found


def constant_acceleration(key: str) -> None:
    added = np.array([0.3, -0.2, 0.1])
    moved = flown(key, *added).poses.centre[:, 0] - flown(key, 0.0, 0.0, 0.0).poses.centre[:, 0]
    np.testing.assert_allclose(moved, 0.5 * added * TIMES[:, None] ** 2, atol=1e-12)


def frame_rate(key: str) -> None:
    """A clock that is fast by 1 + r shows the flight with v and omega slower by it, and gravity by its square."""
    fast = flown(key, 0.02, start=flight(GRAVITY))
    there = flight(GRAVITY / 1.02**2)
    slow = flown(key, 0.0, start=replace(there, v=there.v / 1.02, omega=there.omega / 1.02))
    np.testing.assert_allclose(fast.poses.centre, slow.poses.centre, atol=1e-12)
    np.testing.assert_allclose(fast.poses.R, slow.poses.R, atol=1e-7)


def clock_offset(key: str) -> None:
    """A clock that is late shows the flight's later moments."""
    late, there = flown(key, 3e-5).poses, predict(flight(), Model(), np.zeros(0), SETTING, TIMES + 3e-5).poses
    np.testing.assert_allclose(late.centre, there.centre, atol=1e-12)
    np.testing.assert_allclose(late.R, there.R, atol=1e-9)


def dropped_frames(key: str) -> None:
    """A gap of whole frames shows the undisturbed flight's later frames."""
    gap, there = flown(key, 2.0, 30.0).poses, flown(key, 0.0, 30.0).poses
    np.testing.assert_array_equal(gap.centre[:31], there.centre[:31])
    np.testing.assert_allclose(gap.centre[31:-2], there.centre[33:], atol=1e-12)


def stamp_scatter(key: str) -> None:
    """Stamps that are wholly to blame show the flight at even times, none of it that at the stamps."""
    off = 1e-4 * np.cos(np.arange(61))
    setting = replace(SETTING, times_s=TIMES - off, scatter_s=off)
    for share in (0.0, 0.3, 1.0):
        seen = predict(flight(), Model((MODELS[key],)), np.array([share]), setting, setting.times_s).poses
        np.testing.assert_allclose(seen.centre, states_at(TIMES - (1.0 - share) * off), atol=1e-12)


def states_at(times: Array) -> Array:
    return predict(flight(), Model(), np.zeros(0), SETTING, times).poses.centre


def trigger_jitter(key: str) -> None:
    """Without jitter there is no gain; the gain is that of the deviation, whatever its sign, and ever less beyond it."""
    assert MODELS[key].random
    tau, h = np.random.default_rng(1).normal(scale=1e-5, size=300), np.full(300, 1e12)
    gains = [gain_of(tau, h, sigma) for sigma in (0.0, 5e-6, 1e-5, 4e-5, 1e-3)]
    assert gains[0] == 0.0
    assert gains[2] > gains[1] > 0.0
    assert gains[2] > gains[3] > gains[4]
    assert gain_of(tau, h, -1e-5) == gains[2]


def centre_of_mass(key: str) -> None:
    """Without a force the true centre moves straight, the nominal one on a sphere about it."""
    c = np.array([1e-4, -2e-4, 1.5e-4])
    poses = flown(key, *c).poses
    true = poses.centre[:, 0] + poses.R[:, 0] @ c
    np.testing.assert_allclose(true, flight().x + flight().v * TIMES[:, None], atol=1e-13)
    assert np.abs(np.diff(poses.centre[:, 0], n=2, axis=0)).max() > 1e-7


def inertia_ratios(key: str) -> None:
    """Momentum and energy with the changed moments are kept."""
    found = flown(key, 0.1, -0.06)
    J = inertia_matrix(flight(), np.array([[0.1, -0.06, 0.0, 0.0, 0.0]]))[0]
    np.testing.assert_allclose(J, np.diag(RATIOS * [1.1, 0.94, 1.0]), atol=1e-15)
    R = found.poses.R[:, 0]
    omega_body = np.einsum("nji,nj->ni", R, found.omega)
    L = np.einsum("nij,nj->ni", R, omega_body @ J)
    np.testing.assert_allclose(L, np.broadcast_to(L[0], L.shape), rtol=1e-6)
    energy = np.sum(omega_body @ J * omega_body, axis=1)
    np.testing.assert_allclose(energy, energy[0], rtol=1e-6)


def products_of_inertia(key: str) -> None:
    """Momentum and energy of a body whose principal axes lie elsewhere are kept, and nothing else would keep both."""
    theta = (0.03, -0.05, 0.02)
    found = flown(key, *theta)
    J = inertia_matrix(flight(), np.array([[0.0, 0.0, *theta]]))[0]
    mean = np.sqrt(np.outer(RATIOS, RATIOS))
    np.testing.assert_allclose(J, np.diag(RATIOS) + mean * np.array([[0, 0.03, -0.05], [0.03, 0, 0.02], [-0.05, 0.02, 0]]), atol=1e-15)
    omega_body = np.einsum("nji,nj->ni", found.poses.R[:, 0], found.omega)
    L = np.einsum("nij,nj->ni", found.poses.R[:, 0], omega_body @ J)
    np.testing.assert_allclose(L, np.broadcast_to(L[0], L.shape), rtol=1e-6)
    energy = np.sum(omega_body @ J * omega_body, axis=1)
    np.testing.assert_allclose(energy, energy[0], rtol=1e-6)


def length_scale(key: str) -> None:
    """A scale touches size alone: neither flight nor clock, and it multiplies."""
    np.testing.assert_array_equal(flown(key, 0.02).poses.centre, flown(key, 0.0).poses.centre)
    model = Model((MODELS[key], MODELS[key]))
    assert model.scale(np.array([0.02, 1 / 1.02 - 1])) == pytest.approx(1.0, abs=1e-15)


def linear_drag(key: str) -> None:
    left = np.exp(-8.0 * TIMES)[:, None]
    np.testing.assert_allclose(reached(key, 8.0).v[:, 0], flight().v * left, rtol=1e-10)


def quadratic_drag(key: str) -> None:
    v, v0 = reached(key, 2.0).v[:, 0], np.linalg.norm(flight().v)
    np.testing.assert_allclose(np.linalg.norm(v, axis=1), v0 / (1.0 + 2.0 * v0 * TIMES), rtol=1e-10)
    np.testing.assert_allclose(np.cross(v, flight().v), 0.0, atol=1e-13)


def magnus_lift(key: str) -> None:
    v = reached(key, 0.3).v[:, 0]
    np.testing.assert_allclose(np.linalg.norm(v, axis=1), np.linalg.norm(flight().v), rtol=1e-7)
    assert np.abs(v - flight().v).max() > 0.1


def spin_damping(key: str) -> None:
    """Angular momentum keeps its direction and decays; the flight's path is not touched."""
    there = reached(key, 8.0)
    L = there.L[:, 0]
    np.testing.assert_allclose(L, L[0] * np.exp(-8.0 * TIMES)[:, None], rtol=1e-9)
    omega = angular_velocity(there.q[:, 0], L, np.broadcast_to(np.diag(1 / RATIOS), (len(L), 3, 3)))
    R = rotation_matrices(there.q[:, 0])
    np.testing.assert_allclose(np.einsum("nij,nj->ni", R, np.einsum("nji,nj->ni", R, omega) * RATIOS), L, atol=1e-9)
    np.testing.assert_array_equal(there.v[:, 0], np.broadcast_to(flight().v, (len(L), 3)))


def nutation_damping(key: str) -> None:
    """The size of the angular momentum is kept, energy falls; the flight's path is not touched."""
    there = reached(key, 8.0)
    L = there.L[:, 0]
    np.testing.assert_allclose(np.linalg.norm(L, axis=1), np.linalg.norm(L[0]), rtol=1e-8)
    omega = angular_velocity(there.q[:, 0], L, np.broadcast_to(np.diag(1 / RATIOS), (len(L), 3, 3)))
    assert (np.diff(np.sum(omega * L, axis=1)) < 0.0).all()
    np.testing.assert_array_equal(there.v[:, 0], np.broadcast_to(flight().v, (len(L), 3)))


def radial_distortion(key: str) -> None:
    """Points stay on their ray from the principal point, opposite points opposite, the centre where it is."""
    focal = np.array([6000.0, 6100.0])
    there = (corrected(key, 1.5, 150.0) - CENTRE) / focal
    before = (POINTS - CENTRE) / focal
    np.testing.assert_allclose(there[:, 0] * before[:, 1], there[:, 1] * before[:, 0], atol=1e-15)
    opposite = (corrected(key, 1.5, 150.0, points=2 * CENTRE - POINTS) - CENTRE) / focal
    np.testing.assert_allclose(opposite, -there, atol=1e-15)
    np.testing.assert_array_equal(corrected(key, 1.5, 150.0, points=CENTRE[None]), CENTRE[None])


def tangential_distortion(key: str) -> None:
    """Opposite points move the same way, to first order; the centre stays; p1 and p2 are one law with the axes exchanged."""
    moved = corrected(key, 1e-5, -2e-5) - POINTS
    opposite = corrected(key, 1e-5, -2e-5, points=2 * CENTRE - POINTS) - (2 * CENTRE - POINTS)
    np.testing.assert_allclose(opposite, moved, atol=1e-6)
    np.testing.assert_array_equal(corrected(key, 1e-3, 1e-3, points=CENTRE[None]), CENTRE[None])
    square = replace(CAMERA, fy_px=6000.0)
    first = MODELS[key].correct(np.array([1e-3, 0.0]), POINTS, square, np.zeros(30)) - CENTRE
    exchanged = CENTRE + (POINTS - CENTRE)[:, ::-1]
    second = MODELS[key].correct(np.array([0.0, 1e-3]), exchanged, square, np.zeros(30)) - CENTRE
    np.testing.assert_allclose(second[:, ::-1], first, atol=1e-10)


def principal_point(key: str) -> None:
    np.testing.assert_allclose(corrected(key, 3.0, -2.0) - POINTS, np.broadcast_to([-3.0, 2.0], POINTS.shape), atol=1e-12)


def pixel_aspect(key: str) -> None:
    there = corrected(key, 0.01) - CENTRE
    np.testing.assert_allclose(there * [1.0, 1.01], POINTS - CENTRE, atol=1e-12)


def focal_length(key: str) -> None:
    """Angles about the principal point stay, distances from it shrink alike."""
    np.testing.assert_allclose((corrected(key, 0.05) - CENTRE) * 1.05, POINTS - CENTRE, atol=1e-12)


def camera_vibration(key: str) -> None:
    """All points move alike, with no mean over a period and the opposite way half a period later."""
    theta, phase = (1.0, -1.5, 0.8, 0.6, 200.0), np.arange(20) / 4000.0
    moved = np.array([corrected(key, *theta, times_s=t) - POINTS for t in phase])
    np.testing.assert_allclose(moved, np.broadcast_to(moved[:, :1], moved.shape), atol=1e-12)
    np.testing.assert_allclose(moved.mean(axis=0), 0.0, atol=1e-12)
    np.testing.assert_allclose(moved[:10], -moved[10:], atol=1e-12)
    assert np.abs(moved).max() > 1.0


def defocus_growth(key: str) -> None:
    """Before and behind the focal plane alike, nothing in it, always inwards, with the square of a small blur, as tabled for others."""
    at = places()
    behind = shift(key, 80.0, at)
    before = shift(key, 80.0, replace(at, depth_m=2 * at.first_depth_m - at.depth_m))
    np.testing.assert_allclose(before, behind, atol=1e-12)
    assert np.all(behind[0] == 0.0)
    assert np.all(behind[1:] < 0.0)
    small = MODELS[key].shift(np.array([1e-3]), at, SETTING)
    s2 = (1e-3 * (at.depth_m - at.first_depth_m)) ** 2
    np.testing.assert_allclose(small, -s2[:, None, None] / BLURS_PX[0] * at.recession[..., 0], rtol=1e-12)
    for s, tabled in zip(BLURS_PX, np.moveaxis(at.recession, -1, 0), strict=True):
        theta = s / (at.depth_m[-1] - at.first_depth_m)
        np.testing.assert_allclose(shift(key, theta, at)[-1], -s * tabled[-1], rtol=1e-9)


def motion_blur_threshold(key: str) -> None:
    """Leading and trailing edges alike: the other way round it is the same; along the motion there is none."""
    at = places()
    np.testing.assert_array_equal(shift(key, 0.2, replace(at, velocity_px=-at.velocity_px)), shift(key, 0.2, at))
    along = np.stack([-at.normal[..., 1], at.normal[..., 0]], axis=-1)
    none = MODELS[key].shift(np.array([0.2]), replace(at, velocity_px=1e4 * along), SETTING)
    np.testing.assert_allclose(none, 0.0, atol=1e-12)


def rolling_shutter(key: str) -> None:
    """Backwards and read from the other end it is the same; a ball that moves across the rows and is seen round was an ellipse."""
    at, line_time = places(), 2e-7
    there = shift(key, line_time, at)
    back = replace(at, moving=replace(at.moving, v_cam=-at.moving.v_cam, omega_cam=-at.moving.omega_cam))
    np.testing.assert_allclose(shift(key, -line_time, back), there, atol=1e-11)
    y, z = at.moving.centre_cam[:, 1:].T
    rows = CAMERA.cy_px + CAMERA.fy_px * y / z - (CAMERA.height_px - 1) / 2
    np.testing.assert_allclose(MODELS[key].delays(np.array([line_time]), rows), line_time * rows)
    across = replace(at.moving, v_cam=np.tile([4.0, 0.0, 0.0], (5, 1)), omega_cam=np.zeros((5, 3)))
    moved = shift(key, line_time, replace(at, moving=across, rows_px=rows))
    shear = (line_time * CAMERA.fx_px / z * 4.0)[:, None, None]
    u, rx, ry = at.normal, *(RADIUS_M * focal / z[:, None, None] for focal in (CAMERA.fx_px, CAMERA.fy_px))
    reach = np.hypot(rx * u[..., 0], ry * u[..., 1]) - np.hypot(rx * u[..., 0], ry * (u[..., 1] - shear * u[..., 0]))
    np.testing.assert_allclose(moved, reach, atol=0.02 * np.abs(moved).max())


def outline_offset(key: str) -> None:
    assert np.all(shift(key, 0.5, places()) == 0.5)


def view_outline_offset(key: str) -> None:
    """Magnified by the ratio of scales, of which it has the sign; an offset of the frames is not magnified."""
    at = places()
    np.testing.assert_allclose(shift(key, 0.5, replace(at, view_ratio=3 * at.view_ratio)), 3 * shift(key, 0.5, at), rtol=1e-14)
    assert np.all(np.sign(shift(key, 0.5, at)) == np.sign(at.view_ratio))


def saturating_lift(key: str) -> None:
    """The plain lift at a length of 0, half of it where the length is speed over spin; no work."""
    start, length = flight(), float(np.linalg.norm(flight().v) / np.linalg.norm(flight().omega))
    at = Moment(0.0, start.x[None], start.v[None], start.omega[None], start.omega[None], np.eye(3)[None])
    plain = MODELS["magnus_lift"].acceleration(np.array([[0.2]]), at, SETTING)
    lifts = [MODELS[key].acceleration(np.array([[0.2, each]]), at, SETTING) for each in (0.0, length)]
    np.testing.assert_allclose(lifts[0], plain)
    np.testing.assert_allclose(lifts[1], 0.5 * np.asarray(plain))
    assert abs(float(np.asarray(lifts[1])[0] @ start.v)) < 1e-12


def induced_drag(key: str) -> None:
    """Along the flight, as large as the ratio says of the sum of all lifts, whatever their order; nothing where nothing lifts."""
    start, ratio = flight(), 0.3
    y = States(start.x[None], np.array([[0.0, 0.0, 0.0, 1.0]]), start.v[None], start.omega[None])
    model = Model((MODELS[key], MODELS["magnus_lift"], MODELS["unmeasured_lift"]))
    theta = np.array([[ratio, 0.2, 0.1, -0.4, 0.3]])
    lifts = ModelForces(Model(model.effects[1:]), theta[:, 1:], SETTING).acceleration(0.0, y, start.omega[None])
    added = ModelForces(model, theta, SETTING).acceleration(0.0, y, start.omega[None]) - lifts
    np.testing.assert_allclose(added, -ratio * np.linalg.norm(lifts) * start.v[None] / np.linalg.norm(start.v), rtol=1e-12)
    alone = ModelForces(Model((MODELS[key],)), theta[:, :1], SETTING).acceleration(0.0, y, start.omega[None])
    assert not alone.any()


def unmeasured_drag(key: str) -> None:
    """Linear drag."""
    np.testing.assert_allclose(flown(key, 0.7).poses.centre, flown("linear_drag", 0.7).poses.centre)


def steady_wind(key: str) -> None:
    """In a frame that moves with the air the flight is that in still air; nothing happens without drag."""
    w, c = np.array([0.4, -0.3, 0.2]), np.array([2.0])
    model = Model((MODELS["quadratic_drag"], MODELS[key]))
    blown = predict(flight(), model, np.concatenate([c, w]), SETTING, TIMES)
    still = flown("quadratic_drag", *c, start=replace(flight(), v=flight().v - w))
    np.testing.assert_allclose(blown.poses.centre, still.poses.centre + w * TIMES[:, None, None], atol=1e-10)
    np.testing.assert_allclose(flown(key, *w).poses.centre, flown("gravity", 0.0, 0.0, 0.0).poses.centre, atol=1e-12)


def gyroscope_bias(key: str) -> None:
    """The reading at rest."""
    np.testing.assert_allclose(MODELS[key].reading(np.array([0.1, 0.2, 0.3]), np.zeros((4, 3))), np.tile([0.1, 0.2, 0.3], (4, 1)))


def gyroscope_scale(key: str) -> None:
    """Twice the spin is read as twice as much, and nothing at rest."""
    s, omega = np.array([0.01, -0.02, 0.03]), np.array([[1.0, 2.0, 3.0], [0.0, 0.0, 0.0]])
    read = MODELS[key].reading(s, omega)
    np.testing.assert_allclose(read[0] / omega[0] - 1.0, s)
    np.testing.assert_allclose(MODELS[key].reading(s, 2.0 * omega), 2.0 * read)
    assert not read[1].any()


def position_distortion(key: str) -> None:
    """Nothing in the middle; k R at the distance R, eight times that at twice it, radially; of p as much across, thrice as much along."""
    setting = replace(SETTING, middle_world=np.array([1.0, 2.0, 3.0]), reach_m=0.5)
    along = np.array([2.0, -1.0, 2.0]) / 3.0
    x = setting.middle_world + np.array([[0.0], [0.5], [1.0]]) * along
    seen = MODELS[key].tracked(np.array([0.02, 0.0, 0.0, 0.0]), x, setting)
    np.testing.assert_allclose(seen - x, np.array([[0.0], [0.01], [0.08]]) * along, atol=1e-15)
    across = setting.middle_world + 0.5 * np.eye(3)[:2]
    seen = MODELS[key].tracked(np.array([0.0, 0.02, 0.0, 0.0]), across, setting)
    np.testing.assert_allclose(seen - across, [[0.03, 0.0, 0.0], [0.01, 0.0, 0.0]], atol=1e-15)


def perspective(key: str) -> None:
    """At the distance R along the axis the camera is nearer by the share q, further at the other side, and as it was across it."""
    setting = replace(SETTING, middle_world=np.array([1.0, 2.0, 3.0]), reach_m=0.5)
    step = 1e-4 * np.array([0.0, 1.0, 0.0])
    for side in (1.0, -1.0, 0.0):
        x = setting.middle_world + np.array([[0.5 * side, 0.0, 0.0]]) + np.array([[-0.5], [0.5]]) * step
        seen = MODELS[key].tracked(np.array([0.02, 0.0, 0.0]), x, setting)
        np.testing.assert_allclose(np.linalg.norm(seen[1] - seen[0]) / np.linalg.norm(step), 1.0 / (1.0 - 0.02 * side), rtol=1e-9)
    np.testing.assert_array_equal(MODELS[key].tracked(np.array([0.02, 0.0, 0.0]), setting.middle_world[None], setting)[0], [1.0, 2.0, 3.0])


def unmeasured_lift(key: str) -> None:
    """Across the velocity, so that no energy is lost, and as the lift of a spin of that size."""
    at = Moment(0.0, np.zeros((1, 3)), np.array([[3.0, -2.0, 1.0]]), np.array([[0.0, 40.0, 10.0]]), np.zeros((1, 3)), np.eye(3)[None])
    pushed = MODELS[key].acceleration(0.01 * at.omega, at, SETTING)
    np.testing.assert_allclose(pushed, MODELS["magnus_lift"].acceleration(np.array([[0.01]]), at, SETTING))
    assert abs(float(np.asarray(pushed)[0] @ at.v[0])) < 1e-12


def blooming(key: str) -> None:
    """Alike on circles about the picture's middle, all of it there, none in its corners."""
    middle, angle = np.array([511.5, 383.5]), np.linspace(0, 6, 70).reshape(5, 7, 2)
    ring = middle + 200.0 * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    around = shift(key, 1.0, replace(places(), point_px=ring))
    assert np.ptp(around) < 1e-12
    assert np.all(around < -0.5)
    np.testing.assert_allclose(shift(key, 1.0, replace(places(), point_px=np.broadcast_to(middle, ring.shape))), -1.0)
    corner = MODELS[key].shift(np.array([1.0]), replace(places(), point_px=np.zeros(ring.shape)), SETTING)
    np.testing.assert_allclose(corner, 0.0, atol=1e-12)


def rim_light_leak(key: str) -> None:
    """Half the loss on a circle of any size, and on each side of a rectangle what its length over the perimeter says."""
    at, angle = places(), np.linspace(0.0, 2 * np.pi, 720, endpoint=False)
    for radius in (20.0, 60.0):
        circle = outline_shape([radius * np.column_stack([np.cos(angle), np.sin(angle)])]).leak[0]
        np.testing.assert_allclose(shift(key, 1.0, replace(at, leak=np.broadcast_to(circle[7], at.leak.shape))), -0.5, rtol=0.05)
    long, short = 160.0, 40.0
    sides = outline_shape([np.array([[0.0, 0.0], [long, 0.0], [long, short], [0.0, short]])]).leak[0]
    for length, normal in ((short, 0), (long, ANGLES // 4)):
        f = length / (2 * np.deg2rad(10.0) * (2 * long + 2 * short) / (2 * np.pi))
        receding = shift(key, 1.0, replace(at, leak=np.broadcast_to(sides[normal], at.leak.shape)))
        np.testing.assert_allclose(receding, -f / (1 + f), rtol=0.02)
    assert not MODELS[key].shift(np.zeros(1), at, SETTING).any()


LAWS: dict[str, Callable[[str], None]] = {
    law.__name__: law
    for law in (
        *(frame_rate, dropped_frames, trigger_jitter, centre_of_mass, inertia_ratios, length_scale, linear_drag, quadratic_drag),
        *(products_of_inertia, nutation_damping, clock_offset, stamp_scatter),
        *(magnus_lift, spin_damping, radial_distortion, tangential_distortion, principal_point, pixel_aspect, focal_length),
        *(camera_vibration, defocus_growth, motion_blur_threshold, rolling_shutter, outline_offset, view_outline_offset, blooming),
        *(
            rim_light_leak,
            saturating_lift,
            induced_drag,
            steady_wind,
            unmeasured_lift,
            unmeasured_drag,
            position_distortion,
            perspective,
            gyroscope_bias,
            gyroscope_scale,
        ),
    )
} | {"gravity": constant_acceleration, "uniform_acceleration": constant_acceleration}


@pytest.mark.parametrize("key", EFFECTS)
def test_the_reduced_model_keeps_its_law(key: str) -> None:
    LAWS[key](key)


@pytest.mark.parametrize("key", PICTURED)
def test_a_flight_led_astray_tells_nothing_of_that_moment_and_spoils_no_other(key: str) -> None:
    """What a trial step throws out of the world has places that are no numbers; the look at it must come back to refuse it."""
    at, theta = places(), np.full(len(MODELS[key].entry.parameters), 0.3)
    nowhere = {
        name: np.concatenate([values[:-1], np.full_like(values[-1:], np.nan)])
        for name, values in vars(at).items()
        if isinstance(values, np.ndarray) and len(values) == len(at.depth_m) and values.dtype == np.float64
    }
    with np.errstate(invalid="ignore"):  # as looks have it
        sane, astray = (Model((MODELS[key],)).shift(theta, each, SETTING) for each in (at, replace(at, **nowhere)))
    np.testing.assert_array_equal(astray[:-1], sane[:-1])
    assert np.isnan(astray[-1]).any() or not sane.any() or key == "outline_offset"


def test_a_shutter_tells_nothing_where_one_point_of_the_outline_is_nowhere() -> None:
    at = places()
    velocity = at.outline_velocity_px.copy()
    velocity[-1, 3] = np.nan
    vars(at)["outline_velocity_px"] = velocity  # in place of what would be computed
    astray = MODELS["rolling_shutter"].shift(np.array([1e-7]), at, SETTING)
    assert astray is not None
    assert np.isfinite(astray[:-1]).all()
    assert not np.isinf(astray).any()
    assert np.isnan(astray[-1]).any()
