"""Whether a recipe can be carried out: ranges, units and what has to fit together, in plain sentences."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from datasets.errors import InputError
from datasets.plausibility import LARGEST_UNDISTORTION_ERROR_PX, undistortion_error_px
from datasets.recipes.effects import check_effects
from datasets.recipes.recipe import Recipe
from datasets.vocabulary.camera import Intrinsics


@dataclass(frozen=True)
class Bounds:
    """The values that ``key`` may take; both ends are allowed. ``hint`` says what a value outside usually means."""

    key: str
    low: float
    high: float
    hint: str = ""


BOUNDS = (
    Bounds("seed", 0, 2**63 - 1),
    Bounds("sequences", 1, 1_000_000),
    Bounds("particle.irregularity", 0, 1),
    Bounds("particle.size_mm", 0, 100, "it looks like micrometres taken for millimetres"),
    Bounds("particle.density_kgm3", 1, 30_000, "kilograms per cubic metre are meant: 2650 for quartz"),
    Bounds("motion.frames", 3, 1_000_000, "a motion needs at least three frames"),
    Bounds("motion.frame_rate_hz", 1, 1e8),
    Bounds("motion.speed_ms", 0, 1000, "it looks like millimetres per second"),
    Bounds("motion.spin_rads", 0, 1e5),
    Bounds("motion.out_of_plane_ms", 0, 1000, "it looks like millimetres per second"),
    Bounds("motion.gravity_ms2", -300, 300, "it looks like millimetres taken for metres"),
    Bounds("hsv.width_px", 16, 65_536),
    Bounds("hsv.height_px", 16, 65_536),
    Bounds("hsv.focal_mm", 0.5, 10_000, "millimetres are meant: 100 is a usual lens"),
    Bounds("hsv.pixel_pitch_um", 0.1, 1000, "micrometres are meant: 20 is usual"),
    Bounds("hsv.distance_m", 0.01, 50, "it looks like millimetres taken for metres"),
    Bounds("hsv.f_number", 0.5, 1000),
    Bounds("hsv.exposure_us", 0, 1e6),
    Bounds("hsv.distortion", -100, 100),
    Bounds("hsv.principal_point_offset_px", -65_536, 65_536),
    Bounds("hsv.vignetting", 0, 1),
    Bounds("hsv.light_falloff", 0, 1),
    Bounds("rig.drops", 1, 10_000),
    Bounds("rig.width_px", 16, 65_536),
    Bounds("rig.height_px", 16, 65_536),
    Bounds("rig.focal_px", 10, 1e8),
    Bounds("rig.mm_per_px", 1e-5, 10, "millimetres per pixel are meant: 0.017 is usual"),
    Bounds("rig.f_number", 0.5, 1000),
    Bounds("noise.hsv_boundary_px", 0, 100),
    Bounds("noise.rig_boundary_px", 0, 100),
    Bounds("noise.spacing_px", 0.01, 100),
    Bounds("rendering.subframes", 1, 10_000),
    Bounds("rendering.samples_per_subframe", 1, 1_000_000),
    Bounds("rendering.rig_samples", 1, 1_000_000),
    Bounds("rendering.crop_margin_px", 0, 65_536),
    Bounds("sensor.full_well_e", 1, 1e9),
    Bounds("sensor.read_noise_e", 0, 1e6),
    Bounds("sensor.dark_offset_dn", 0, 65_535),
    Bounds("sensor.saturation", 0.01, 1, "the share of the full well that the open background fills"),
    Bounds("sensor.prnu", 0, 1),
    Bounds("sensor.dsnu_e", 0, 1e6),
)

DARKEST_SHARE = 0.5
"""Of full scale: a larger dark offset leaves no range for light."""

RANGES = ("particle.size_mm", "motion.speed_ms", "motion.spin_rads", "motion.out_of_plane_ms", "rig.focal_px")
"""Pairs that have to be given lowest first."""


def check_recipe(recipe: Recipe, source: str) -> None:
    """Check ranges and what has to fit together.

    Raises
    ------
    InputError
        Naming ``source``, the key, what was expected and what came.
    """
    for bounds in BOUNDS:
        _check_bounds(recipe, bounds, source)
    for key in RANGES:
        pair = value_of(recipe, key)
        if pair is not None and pair[0] > pair[1]:
            raise InputError(f"{source}: {key}: expected [lowest, highest], came [{pair[0]:g}, {pair[1]:g}].")
    for holds, sentence in RELATIONS:
        if not holds(recipe):
            raise InputError(f"{source}: {sentence(recipe)}")
    check_effects(recipe.effects, recipe.sequences, source)


def value_of(recipe: Recipe, key: str) -> Any:
    """The value that a dotted key names."""
    value: Any = recipe
    for part in key.split("."):
        value = getattr(value, part)
    return value


def _check_bounds(recipe: Recipe, bounds: Bounds, source: str) -> None:
    value = value_of(recipe, bounds.key)
    for entry in value if isinstance(value, tuple) else (value,):
        if entry is not None and not (math.isfinite(entry) and bounds.low <= entry <= bounds.high):
            hint = f"; {bounds.hint}" if bounds.hint else ""
            raise InputError(f"{source}: {bounds.key}: expected a value from {bounds.low:g} to {bounds.high:g}, came {entry:g}{hint}.")


def _some_size(recipe: Recipe) -> bool:
    low, high = recipe.particle.size_mm
    return low > 0 or (high == 0 and bool(recipe.particle.files))


def _named(recipe: Recipe) -> bool:
    return bool(recipe.name.strip())


def _exposure_fits(recipe: Recipe) -> bool:
    return recipe.hsv.exposure_us * 1e-6 * recipe.motion.frame_rate_hz <= 1 + 1e-9


def _focusable(recipe: Recipe) -> bool:
    return recipe.hsv.distance_m > recipe.hsv.focal_mm * 1e-3


def _slow_enough(recipe: Recipe) -> bool:
    out = recipe.motion.out_of_plane_ms
    return out is None or out[0] <= recipe.motion.speed_ms[1]


def _dark_offset_fits(recipe: Recipe) -> bool:
    return recipe.sensor.dark_offset_dn <= DARKEST_SHARE * _full_scale_dn(recipe)


def _full_scale_dn(recipe: Recipe) -> int:
    return int(2**recipe.sensor.bit_depth) - 1


def _distortion_can_be_undone(recipe: Recipe) -> bool:
    return undistortion_error_px(_lens(recipe)) <= LARGEST_UNDISTORTION_ERROR_PX


def _lens(recipe: Recipe) -> Intrinsics:
    """The camera's intrinsics without the principal point's offset."""
    hsv = recipe.hsv
    f, d = hsv.focal_mm * 1e-3, hsv.distance_m
    focal_px = f * d / (d - f) / (hsv.pixel_pitch_um * 1e-6)
    return Intrinsics(hsv.width_px, hsv.height_px, focal_px, focal_px, (hsv.width_px - 1) / 2, (hsv.height_px - 1) / 2, hsv.distortion)


RELATIONS: tuple[tuple[Callable[[Recipe], bool], Callable[[Recipe], str]], ...] = (
    (_named, lambda recipe: "name: expected some text, came nothing."),
    (
        _some_size,
        lambda recipe: f"particle.size_mm: expected positive sizes ([0, 0] keeps a file's own size), came {list(recipe.particle.size_mm)}.",
    ),
    (
        _exposure_fits,
        lambda recipe: (
            f"hsv.exposure_us: expected at most {1e6 / recipe.motion.frame_rate_hz:g} (the time between two frames at "
            f"{recipe.motion.frame_rate_hz:g} Hz), came {recipe.hsv.exposure_us:g}."
        ),
    ),
    (
        _focusable,
        lambda recipe: (
            f"hsv.distance_m: expected more than the focal length ({recipe.hsv.focal_mm * 1e-3:g} m), came {recipe.hsv.distance_m:g}."
        ),
    ),
    (
        _slow_enough,
        lambda recipe: (
            f"motion.out_of_plane_ms: expected at most the highest speed ({recipe.motion.speed_ms[1]:g} m/s), "
            f"came {list(recipe.motion.out_of_plane_ms or ())}."
        ),
    ),
    (
        _dark_offset_fits,
        lambda recipe: (
            f"sensor.dark_offset_dn: expected at most {DARKEST_SHARE * _full_scale_dn(recipe):.0f} (half of full scale at "
            f"{recipe.sensor.bit_depth} bit), came {recipe.sensor.dark_offset_dn:g}."
        ),
    ),
    (
        _distortion_can_be_undone,
        lambda recipe: (
            f"hsv.distortion: expected one that can be undone all over the picture, came {list(recipe.hsv.distortion)}, which misses by "
            f"{undistortion_error_px(_lens(recipe)):.3g} px at its edge; the order is k1, k2, p1, p2, k3."
        ),
    ),
)
"""What has to hold between values, and the sentence where it does not."""
