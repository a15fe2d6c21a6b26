"""Small observations, truths and estimates that the tests of the formats share."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from datasets.estimate import Estimate, FrameReport, Status, VelocityEstimate
from datasets.observation import CalibratedView, Observation
from datasets.tiff_frames import TiffFrames, write_stack
from datasets.truth import Truth
from datasets.vocabulary.body import Body
from datasets.vocabulary.camera import HsvCamera, Intrinsics
from datasets.vocabulary.clock import Clock
from datasets.vocabulary.outline import Outline
from datasets.vocabulary.state import Motion

FRAMES = 5
WIDTH, HEIGHT = 64, 48


def square_outline(x: float, y: float, half: float = 4.0) -> Outline:
    corners = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    return Outline(corners * half + [x, y])


def make_motion(frames: int, rng: np.random.Generator) -> Motion:
    spin = rng.normal(size=3) * 100
    times = np.arange(frames) / 4000.0
    turned = Rotation.from_rotvec(times[:, None] * spin) * Rotation.random(rng=rng)
    v = np.tile(rng.normal(size=3), (frames, 1)) + times[:, None] * [0.0, 9.80665, 0.0]
    x = [0.0, 0.0, 0.6] + times[:, None] * v[0]
    return Motion(times, x, turned.as_quat(), v, np.tile(spin, (frames, 1)))


def make_truth(name: str = "seq_0000", *, frames: int = FRAMES, seed: int = 1, **changes: Any) -> Truth:
    rng = np.random.default_rng(seed)
    mesh = trimesh.creation.icosphere(subdivisions=1, radius=3e-3)
    truth = Truth(
        name=name,
        motion=make_motion(frames, rng),
        body=Body(rng.normal(size=3) * 1e-4, Rotation.random(rng=rng).as_matrix(), np.array([0.5, 0.8, 1.0])),
        mass_kg=3e-4,
        inertia_kgm2=np.array([1e-9, 1.6e-9, 2e-9]),
        mesh_vertices=np.array(mesh.vertices) * np.pi,
        mesh_faces=np.array(mesh.faces, dtype=np.int64),
        descriptors={"irregularity": 0.4, "sphericity": 0.83},
        effects={"gravity": {"g_ms2": 9.80665}},
        notes={"particle": "cut stone"},
    )
    return replace(truth, **changes)


def make_estimate(truth: Truth, error: np.ndarray, *, sigma: float = 0.01, **changes: Any) -> Estimate:
    """An estimate whose velocities (v, omega) are off by ``error`` (6,)."""
    middle = (len(truth.motion.times_s) - 1) // 2

    def at(frame: int) -> VelocityEstimate:
        v, omega = truth.motion.v_world[frame] + error[:3], truth.motion.omega_world[frame] + error[3:]
        covariance = np.eye(6) * sigma**2
        return VelocityEstimate(float(truth.motion.times_s[frame]), v, omega, covariance, covariance / 1.21)

    estimate = Estimate(
        name=truth.name,
        status=Status.CONVERGED,
        message="converged",
        body=truth.body,
        motion=truth.motion,
        start=at(0),
        middle=at(middle),
        parameters=("vx", "offset_px"),
        values=np.array([1.0, 0.1]),
        covariance=np.eye(2) * 0.3,
        bound=np.eye(2) * 0.1,
        frames=(FrameReport(0, 0, True, "", 0.2, 1.0), FrameReport(0, 1, False, "cut off", float("nan"), float("nan"))),
        statistics={"n_views": 60, "rms_ete_px": 0.21, "missing": float("nan")},
        configuration={"starts": 100},
        versions={"tumble": "0.1.0"},
    )
    return replace(estimate, **changes)


@pytest.fixture
def intrinsics() -> Intrinsics:
    return Intrinsics(WIDTH, HEIGHT, 600.0, 600.0, 31.5, 23.5)


@pytest.fixture
def outline_observation(intrinsics: Intrinsics) -> Observation:
    """Silhouette tier: one camera, five frames, two views; one outline is empty."""
    camera = HsvCamera("hsv", intrinsics, np.eye(3), np.zeros(3))
    outlines = (*(square_outline(20 + 2 * k, 20) for k in range(FRAMES - 1)), Outline(np.zeros((0, 2))))
    views = tuple(
        CalibratedView(intrinsics, Rotation.from_rotvec([0, k, 0]).as_matrix(), np.array([0.0, 0.0, 1.2]), drop=k, camera=k)
        for k in range(2)
    )
    return Observation(
        name="seq_0000",
        cameras=(camera,),
        recordings=(outlines,),
        clock=Clock(np.arange(FRAMES) / 4000.0, 50e-6),
        gravity_world=np.array([0.0, 9.80665, 0.0]),
        views=views,
        view_recording=(square_outline(30, 24, 12.0), square_outline(32, 25, 11.0)),
        mass_kg=3e-4,
    )


@pytest.fixture
def frame_observation(outline_observation: Observation, tmp_path: Path) -> Observation:
    """Rendered tier: the same cameras with 12-bit pictures; the two views have a background each."""
    rng = np.random.default_rng(7)

    def stack(name: str, count: int) -> Path:
        write_stack(tmp_path / name, [rng.integers(0, 4096, (HEIGHT, WIDTH)).astype(np.uint16) for _ in range(count)])
        return tmp_path / name

    recording = TiffFrames(stack("frames.tif", FRAMES), 12, stack("background.tif", 1))
    views = TiffFrames(stack("views.tif", 2), 12, stack("views_background.tif", 2), (1, 0))
    return replace(outline_observation, recordings=(recording,), view_recording=views)


@pytest.fixture
def truth() -> Truth:
    return make_truth()


@pytest.fixture(scope="session")
def truth_of() -> Callable[..., Truth]:
    return make_truth


@pytest.fixture(scope="session")
def estimate_of() -> Callable[..., Estimate]:
    return make_estimate
