"""The pictures of a sequence, each as plain data: what to render, from where, with which seeds.

Every picture has random streams of its own, derived from the sequence's and the picture's number alone. So pictures can be rendered
in any order, a run that was killed goes on with what it has, and the result is the same to the last bit.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
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
from synth.rendering.exposure import Optics, subframe_times
from synth.rendering.light import lighting
from synth.rendering.rows import Strip, cameras_at, delays_in, poses_at, strips
from synth.rendering.scene import Pose
from synth.rendering.window import Window, whole_picture, window_around
from synth.streams import of_camera, streams

Array = NDArray[np.float64]
Kind = Literal["frame", "view"]

FIRST, REMNANT = "hsv", "hsv remnant"
"""The keys of the first high-speed camera, and of it before what is left of a particle that broke."""
STREAM_OF = {"frame": 0, "view": 1, "frame background": 2, "view background": 3}
EXPOSURE, READ_OUT = 0, 1
RIG_FALLOFF = 0.1
RIG_VIGNETTING = 0.0
REACH = 4.0
"""Standard deviations of an effect's blur that a window reaches beyond the particle."""


@dataclass(frozen=True)
class Shot:
    """One picture: ``camera`` is the key of its optics; ``poses`` one per sub-frame, ``seeds`` for the rays of each.

    ``cameras``, one per sub-frame, where the picture moves; ``strips`` where rows are exposed one after the other; ``blur_px`` the
    standard deviation of the blur that effects add; ``chips``, one per sub-frame, poses of a chip that has broken off.
    """

    kind: Kind
    number: int
    camera: str
    window: Window
    poses: tuple[Pose, ...]
    samples: int
    seeds: tuple[int, ...]
    cameras: tuple[Intrinsics, ...] = ()
    strips: tuple[Strip, ...] = ()
    blur_px: float = 0.0
    chips: tuple[Pose, ...] = ()

    @property
    def further(self) -> str:
        """The key of a further high-speed camera, after a hyphen; nothing of the first one, and of views."""
        return f"-{self.camera}" if self.kind == "frame" and self.camera not in (FIRST, REMNANT) else ""


def picture_stream(recipe: Recipe, index: int, what: str, number: int, part: int, *, camera: int = 0) -> np.random.SeedSequence:
    """The random stream of one part of one picture of sequence ``index``; views that sequences share are the first one's.

    ``camera``: number of the high-speed camera.
    """
    first = 0 if recipe.same_particle else index if recipe.plate is None else index - index % recipe.dropper.runs
    root = streams(recipe.seed, first if what.startswith("view") else index).rendering
    return of_camera(np.random.SeedSequence(root.entropy, spawn_key=(*root.spawn_key, STREAM_OF[what], number, part)), camera)


def hsv_optics(plan: SequencePlan, recipe: Recipe) -> Optics:
    """The optics of the high-speed camera."""
    hsv, camera = recipe.hsv, plan.true_camera
    light = lighting(hsv.light, focus_m=hsv.distance_m, widest_slope=widest_slope(camera), falloff=hsv.light_falloff)
    return Optics(camera, thin_lens(camera, hsv.f_number, hsv.distance_m), light, hsv.vignetting, plan.effects.moving)


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


def frame_shots(plan: SequencePlan, recipe: Recipe, index: int, *, camera: int = 0) -> Iterator[Shot]:
    """The frames of a high-speed camera, by its number; plan and recipe are those that it films."""
    optics, hull = hsv_optics(plan, recipe), hull_points(plan.vertices)
    for number in range(len(plan.true_times_s)):
        yield _frame_shot(plan, recipe, number, picture_stream(recipe, index, "frame", number, EXPOSURE, camera=camera), (optics, hull))


def _frame_shot(plan: SequencePlan, recipe: Recipe, number: int, stream: np.random.SeedSequence, seen: tuple[Optics, Array]) -> Shot:
    (optics, hull), rendering, time = seen, recipe.rendering, float(plan.true_times_s[number])
    instants = subframe_times(time, plan.clock.exposure_s, rendering.subframes, np.random.default_rng(stream))
    stamps = instants - time + (plan.clock.times_s[number] - plan.clock.times_s[0])
    poses, cameras, blur = poses_at(plan, instants), cameras_at(plan, stamps), _blur_px(plan, number)
    seeds, chips = ray_seeds(stream, len(poses)), _chip_poses(plan, time, instants)
    window = _window(hull, poses, optics, recipe, Extra(cameras, blur, _chip_points(plan, chips)))
    key = plan.hsv.name if plan.remnant is None or time < plan.remnant.time_s else REMNANT
    shot = Shot("frame", number, key, window, poses, rendering.samples_per_subframe, seeds, cameras, blur_px=blur, chips=chips)
    return _row_by_row(shot, plan, recipe, seen, (instants, stamps)) if plan.effects.rolling else shot


def _chip_poses(plan: SequencePlan, time_s: float, instants_s: Array) -> tuple[Pose, ...]:
    """Poses of a chip at instants (n,) s of the frame at ``time_s``; none before it has broken off."""
    if plan.chip is None or time_s < plan.chip.from_s:
        return ()
    R, t = particle_poses_in_camera(plan.chip.body.body, plan.chip.flight.at(instants_s), plan.hsv)
    return tuple(zip(R, t, strict=True))


def _chip_points(plan: SequencePlan, poses: tuple[Pose, ...]) -> tuple[Array, ...]:
    """Places (v, 3) m, camera frame, of the chip's vertices in each pose."""
    return () if plan.chip is None else tuple(plan.chip.body.vertices @ R.T + t for R, t in poses)


def _row_by_row(shot: Shot, plan: SequencePlan, recipe: Recipe, seen: tuple[Optics, Array], times_s: tuple[Array, Array]) -> Shot:
    """The shot in strips; its window holds the particle at the instants of the rows in which it appears."""
    (optics, hull), (instants, stamps), window = seen, times_s, shot.window
    for _ in range(2):
        delays = delays_in(plan, window)
        every = np.concatenate([instants + delay for delay in delays])
        cameras = cameras_at(plan, np.concatenate([stamps + delay for delay in delays]))
        window = _window(hull, poses_at(plan, every), optics, recipe, Extra(cameras, shot.blur_px))
    return replace(shot, window=window, strips=strips(plan, window, hull, instants, stamps))


def _blur_px(plan: SequencePlan, number: int) -> float:
    depths = (plan.motion.x_world @ plan.hsv.R_cam_world.T + plan.hsv.t_cam_world)[:, 2]
    return float(plan.effects.sigma_px(depths[[number]] - depths[0])[0])


def view_shots(plan: SequencePlan, recipe: Recipe, index: int) -> Iterator[Shot]:
    """The calibrated views; the particle is at rest, so one sub-frame takes all samples."""
    optics, hull = rig_optics(plan, recipe), hull_points(plan.view_vertices)
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


@dataclass(frozen=True)
class Extra:
    """What else decides a window: the ``cameras`` of a moving picture, one per pose, ``blur_px``, and ``chips`` (v, 3) m, one per pose."""

    cameras: tuple[Intrinsics, ...] = ()
    blur_px: float = 0.0
    chips: tuple[Array, ...] = ()


def _window(hull: Array, poses: tuple[Pose, ...], optics: Optics, recipe: Recipe, extra: Extra = Extra()) -> Window:
    if recipe.rendering.full_frames:
        return whole_picture(optics.intrinsics)
    seen = [hull @ R.T + t for R, t in poses]
    seen = [np.concatenate(both) for both in zip(seen, extra.chips, strict=True)] if extra.chips else seen
    points = np.concatenate(seen)
    near, far = max(points[:, 2].min(), 1e-3), max(points[:, 2].max(), 1e-3)
    blur = max(blur_radius_px(optics.lens, optics.intrinsics.fx_px, depth) for depth in (near, far)) + REACH * extra.blur_px
    through = extra.cameras or (optics.intrinsics,) * len(poses)
    px = np.concatenate([camera.project(part) for camera, part in zip(through, seen, strict=True)])
    return window_around(px, recipe.rendering.crop_margin_px + blur, optics.intrinsics)
