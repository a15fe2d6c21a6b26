"""Further high-speed cameras: where they stand, when they expose, and the plan of a sequence as each of them films it.

A further camera looks at the middle of the flights, a point on the first camera's optical axis. Its axis is the first one's, turned about a
line across both by the angle between them; so with ``around_deg`` 0 and a level first camera it is level too.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from datasets.recipes.effects import of_one_camera
from datasets.recipes.recipe import FurtherHsvRecipe, Recipe
from datasets.recipes.several_cameras import filmed_by
from datasets.vocabulary.camera import HsvCamera, Intrinsics
from datasets.vocabulary.clock import Clock
from synth.effects import EffectsInForce, effects_in_force
from synth.high_speed_camera import hsv_camera
from synth.plan import Flight, SequencePlan
from synth.streams import of_camera, streams_of

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Filming:
    """What one further camera makes of a sequence, the flight apart.

    ``hsv`` and ``clock`` are what the observation states; frames are taken at ``true_times_s`` (frame,) s with ``true_camera``.
    ``clock_error``: offset (s) and rate by which its clock is off.
    """

    hsv: HsvCamera
    true_camera: Intrinsics
    clock: Clock
    true_times_s: Float[NDArray[np.float64], " frame"]
    effects: EffectsInForce
    clock_error: tuple[float, float]


def further_filmings(recipe: Recipe, index: int, stamps_s: Float[NDArray[np.float64], " frame"]) -> tuple[Filming, ...]:
    """The further cameras of sequence ``index``; ``stamps_s`` (frame,) s are the first camera's."""
    return tuple(_filming(recipe, index, camera, stamps_s) for camera in range(1, len(recipe.further_hsv) + 1))


def _filming(recipe: Recipe, index: int, camera: int, first_stamps_s: Array) -> Filming:
    further, seen, streams = recipe.further_hsv[camera - 1], filmed_by(recipe, camera), streams_of(recipe, index)
    interval_s = 1.0 / recipe.motion.frame_rate_hz
    stamps = first_stamps_s + further.delay_frames * interval_s
    clocks_rng, effects_rng = (np.random.default_rng(of_camera(stream, camera)) for stream in (streams.clocks, streams.effects))
    offset, rate = interval_s * clocks_rng.uniform(*further.hidden_offset_frames), clocks_rng.uniform(*further.hidden_rate)
    effects = effects_in_force(of_one_camera(recipe.effects, camera), index)
    hsv = placed(hsv_camera(seen.hsv), further, recipe.hsv.distance_m, seen.hsv.distance_m, name=f"hsv_{camera + 1}")
    clock = Clock(stamps, seen.hsv.exposure_us * 1e-6, further.offset_sigma_frames * interval_s, further.rate_sigma)
    true = effects.true_times(stamps, effects_rng) + offset + rate * (stamps - stamps[0])
    return Filming(hsv, effects.lens(hsv.intrinsics), clock, true, effects, (float(offset), float(rate)))


def placed(camera: HsvCamera, recipe: FurtherHsvRecipe, middle_m: float, distance_m: float, *, name: str) -> HsvCamera:
    """The camera ``distance_m`` from the point ``middle_m`` in front of the first camera, whose frame is the world's, looking at it."""
    around = np.deg2rad(recipe.around_deg)
    aside = np.array([np.cos(around), np.sin(around), 0.0])
    R_cam_world = Rotation.from_rotvec(np.deg2rad(recipe.angle_deg) * np.cross(aside, [0.0, 0.0, 1.0])).inv().as_matrix()
    middle = np.array([0.0, 0.0, middle_m])
    return replace(camera, name=name, R_cam_world=R_cam_world, t_cam_world=np.array([0.0, 0.0, distance_m]) - R_cam_world @ middle)


def filmed(plan: SequencePlan, filming: Filming, flight: Flight) -> SequencePlan:
    """The plan as a further camera films it."""
    return replace(
        plan,
        hsv=filming.hsv,
        true_camera=filming.true_camera,
        clock=filming.clock,
        true_times_s=filming.true_times_s,
        motion=replace(flight.at(filming.true_times_s), times_s=filming.clock.times_s),
        effects=filming.effects,
        clock_error=filming.clock_error,
    )
