"""A dark room for tests: Mitsuba's scalar variant, a mesh, a small camera, and how to take a picture of it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from datasets.vocabulary.camera import Intrinsics
from synth.rendering.camera import ThinLens
from synth.rendering.exposure import Optics, expose, film_of
from synth.rendering.light import lighting
from synth.rendering.materials import material
from synth.rendering.scene import ParticleModel, Pose
from synth.rendering.tracer import Traced, Tracer, make_tracer
from synth.rendering.variant import activate, available_variants
from synth.rendering.window import Window, whole_picture

FOCUS_M = 0.6
PINHOLE = ThinLens(0.0, FOCUS_M)


@dataclass(frozen=True)
class Room:
    """A particle in front of a camera."""

    tracer: Tracer
    optics: Optics

    def take(
        self, poses: Sequence[Pose], *, samples: int, window: Window | None = None, seed: int = 1, chips: Sequence[Pose] = ()
    ) -> Traced:
        """The particle's light and coverage in ``window`` (the whole picture)."""
        where = whole_picture(self.optics.intrinsics) if window is None else window
        seeds = range(seed, seed + len(poses))
        return expose(self.tracer, self.optics, where, poses, samples=samples, seeds=list(seeds), chips=chips)


def pebble() -> trimesh.Trimesh:
    """A lopsided convex body of 3 mm, so that every mistake of orientation shows."""
    mesh = trimesh.creation.icosphere(subdivisions=2, radius=1.0)
    x, y, z = mesh.vertices.T
    mesh.vertices = 1e-3 * np.column_stack([1.5 * x + 0.4 * x * x, 1.1 * y + 0.3 * x * y, 0.9 * z])
    return mesh


def plate() -> trimesh.Trimesh:
    """A thin square of 4 mm, facing the camera at the identity."""
    return trimesh.creation.box(extents=[4e-3, 4e-3, 1e-5])


def camera(**changes: object) -> Intrinsics:
    """96 x 80 px of 0.1 mm at the focal plane."""
    values = {"width_px": 96, "height_px": 80, "fx_px": 6000.0, "fy_px": 6000.0, "cx_px": 47.5, "cy_px": 39.5, "pixel_pitch_m": 2e-5}
    return Intrinsics(**{**values, **changes})


def room(mesh: trimesh.Trimesh, *, intrinsics: Intrinsics | None = None, **changes: object) -> Room:
    """A room with a back light; ``changes``: ``lens``, ``light`` ("back" or "front"), ``surface``, ``chip``."""
    lens = changes.get("lens", PINHOLE)
    light = lighting(changes.get("light", "back"), focus_m=lens.focus_m, widest_slope=0.1, falloff=0.2)
    optics = Optics(camera() if intrinsics is None else intrinsics, lens, light, 0.1)
    particle = ParticleModel(mesh.vertices, mesh.faces, material(changes.get("surface", "matte")))
    mi = activate(changes.get("variant", "scalar_rgb"))
    chip = ParticleModel(*changes["chip"], particle.material) if "chip" in changes else None
    return Room(make_tracer(mi, particle, film_of(optics), light, np.array([0.0, 0.0, lens.focus_m]), chip=chip), optics)


def pose(x_mm: float = 0.0, y_mm: float = 0.0, z_m: float = FOCUS_M, turn: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Pose:
    """A pose in the camera frame; ``turn`` is a rotation vector (rad)."""
    return Rotation.from_rotvec(turn).as_matrix(), np.array([1e-3 * x_mm, 1e-3 * y_mm, z_m])


@pytest.fixture(name="room")
def room_maker():
    return room


@pytest.fixture(name="pose")
def pose_maker():
    return pose


@pytest.fixture(name="camera")
def camera_maker():
    return camera


@pytest.fixture(name="pebble")
def pebble_mesh():
    return pebble()


@pytest.fixture(name="plate")
def plate_mesh():
    return plate()


@pytest.fixture(name="llvm")
def llvm_variant():
    """The LLVM variant's name, asked for when the test needs it."""

    def name() -> str:
        working = [variant.name for variant in available_variants() if variant.works and variant.name.startswith("llvm")]
        if not working:
            pytest.skip("no libLLVM that Dr.Jit can use safely")
        return working[0]

    return name
