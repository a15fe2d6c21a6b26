"""The pictures of a sequence, each as plain data: what to render, from where, with which seeds.

Every picture has random streams of its own, derived from the sequence's and the picture's number alone. So pictures can be rendered
in any order, a run that was killed goes on with what it has, and the result is the same to the last bit.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from datasets.observation import CalibratedView
from datasets.recipes.recipe import Recipe
from datasets.vocabulary.camera import Intrinsics
from synth.plan import SequencePlan, particle_poses_in_camera
from synth.rendering.camera import blur_radius_px, thin_lens
from synth.rendering.exposure import Optics, Pose, subframe_times
from synth.rendering.light import lighting
from synth.rendering.window import Window, whole_picture, window_around
from synth.streams import streams

Array = NDArray[np.float64]
Kind = Literal["frame", "view"]

STREAM_OF = {"frame": 0, "view": 1, "frame background": 2, "view background": 3}
EXPOSURE, READ_OUT = 0, 1
RIG_FALLOFF = 0.1
RIG_VIGNETTING = 0.0


@dataclass(frozen=True)
class Shot:
    """One picture: ``camera`` is the key of its optics; ``poses`` one per sub-frame, ``seeds`` for the rays of each."""

    kind: Kind
    number: int
    camera: str
    window: Window
    poses: tuple[Pose, ...]
    samples: int
    seeds: tuple[int, ...]


def picture_stream(recipe: Recipe, index: int, what: str, number: int, part: int) -> np.random.SeedSequence:
    """The random stream of one part of one picture of sequence ``index``."""
    root = streams(recipe.seed, index).rendering
    return np.random.SeedSequence(root.entropy, spawn_key=(*root.spawn_key, STREAM_OF[what], number, part))


def hsv_optics(plan: SequencePlan, recipe: Recipe) -> Optics:
    """The optics of the high-speed camera."""
    hsv, camera = recipe.hsv, plan.hsv.intrinsics
    light = lighting(hsv.light, focus_m=hsv.distance_m, widest_slope=widest_slope(camera), falloff=hsv.light_falloff)
    return Optics(camera, thin_lens(camera, hsv.f_number, hsv.distance_m), light, hsv.vignetting)


def rig_optics(plan: SequencePlan, recipe: Recipe) -> dict[int, Optics]:
    """The optics of every camera of the calibration rig, back-lit and focused where the particles come to lie."""
    numbers = sorted({view.camera for view in plan.views})
    return {number: _rig_camera([view for view in plan.views if view.camera == number], plan, recipe) for number in numbers}


def _rig_camera(views: list[CalibratedView], plan: SequencePlan, recipe: Recipe) -> Optics:
    camera = views[0].intrinsics
    focus = float(np.median([(view.R_cam_particle @ plan.body.com_particle + view.t_cam_particle)[2] for view in views]))
    light = lighting("back", focus_m=focus, widest_slope=widest_slope(camera), falloff=RIG_FALLOFF)
    return Optics(camera, thin_lens(camera, recipe.rig.f_number, focus), light, RIG_VIGNETTING)


def widest_slope(camera: Intrinsics) -> float:
    """The largest ``|x/z|`` or ``|y/z|`` that the picture shows."""
    u, v = np.meshgrid([-0.5, camera.width_px / 2, camera.width_px - 0.5], [-0.5, camera.height_px / 2, camera.height_px - 0.5])
    return float(np.abs(camera.normalise(np.column_stack([u.ravel(), v.ravel()]))).max())


def frame_shots(plan: SequencePlan, recipe: Recipe, index: int) -> Iterator[Shot]:
    """The frames of the high-speed camera."""
    optics, hull = hsv_optics(plan, recipe), hull_points(plan.vertices)
    rendering = recipe.rendering
    for number, time in enumerate(plan.clock.times_s):
        stream = picture_stream(recipe, index, "frame", number, EXPOSURE)
        instants = subframe_times(float(time), plan.clock.exposure_s, rendering.subframes, np.random.default_rng(stream))
        R, t = particle_poses_in_camera(plan.body, plan.flight.at(instants), plan.hsv)
        poses = tuple(zip(R, t, strict=True))
        window = _window(hull, poses, optics, recipe)
        yield Shot("frame", number, "hsv", window, poses, rendering.samples_per_subframe, ray_seeds(stream, len(poses)))


def view_shots(plan: SequencePlan, recipe: Recipe, index: int) -> Iterator[Shot]:
    """The calibrated views; the particle is at rest, so one sub-frame takes all samples."""
    optics, hull = rig_optics(plan, recipe), hull_points(plan.vertices)
    for number, view in enumerate(plan.views):
        poses = ((view.R_cam_particle, view.t_cam_particle),)
        window = _window(hull, poses, optics[view.camera], recipe)
        seeds = ray_seeds(picture_stream(recipe, index, "view", number, EXPOSURE), 1)
        yield Shot("view", number, rig_key(view.camera), window, poses, recipe.rendering.rig_samples, seeds)


def rig_key(camera: int) -> str:
    """The key of a rig camera's optics."""
    return f"rig{camera}"


def ray_seeds(stream: np.random.SeedSequence, count: int) -> tuple[int, ...]:
    """Seeds for Mitsuba's samplers."""
    return tuple(int(word) for word in stream.generate_state(count))


def hull_points(vertices: Float[NDArray[np.float64], "v 3"]) -> Float[NDArray[np.float64], "h 3"]:
    """The vertices (m) that can ever be the outermost ones of a picture."""
    return vertices[ConvexHull(vertices).vertices]


def _window(hull: Array, poses: tuple[Pose, ...], optics: Optics, recipe: Recipe) -> Window:
    if recipe.rendering.full_frames:
        return whole_picture(optics.intrinsics)
    points = np.concatenate([hull @ R.T + t for R, t in poses])
    near, far = max(points[:, 2].min(), 1e-3), max(points[:, 2].max(), 1e-3)
    blur = max(blur_radius_px(optics.lens, optics.intrinsics.fx_px, depth) for depth in (near, far))
    return window_around(optics.intrinsics.project(points), recipe.rendering.crop_margin_px + blur, optics.intrinsics)
