"""Whether a recipe can be carried out: ranges, units and what has to fit together, in plain sentences."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from datasets.errors import InputError
from datasets.plausibility import LARGEST_UNDISTORTION_ERROR_PX, undistortion_error_px
from datasets.plausible_pace import FASTEST_MS
from datasets.recipes.effects import KNOWN, check_cameras, check_contact_physics, check_effects
from datasets.recipes.recipe import Recipe
from datasets.recipes.several_cameras import filmed_by
from datasets.vocabulary.camera import LARGEST_PICTURE_PX, Intrinsics
from datasets.vocabulary.effects import Stage


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
    Bounds("motion.speed_ms", 0, FASTEST_MS, "it looks like millimetres per second"),
    Bounds("motion.spin_rads", 0, 1e5),
    Bounds("motion.out_of_plane_ms", 0, FASTEST_MS, "it looks like millimetres per second"),
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
    Bounds("rig.calibration_px", 0, 100),
    Bounds("noise.hsv_boundary_px", 0, 100),
    Bounds("noise.rig_boundary_px", 0, 100),
    Bounds("noise.spacing_px", 0.01, 100),
    Bounds("noise.correlation_px", 0, 100),
    Bounds("rendering.subframes", 1, 10_000),
    Bounds("rendering.samples_per_subframe", 1, 1_000_000),
    Bounds("rendering.rig_samples", 1, 1_000_000),
    Bounds("rendering.crop_margin_px", 0, 65_536),
    Bounds("plate.tilt_deg", 0, 80),
    Bounds("plate.elevation_deg", -30, 30, "the camera looks nearly along the plate"),
    Bounds("plate.size_mm", 1, 1000, "millimetres are meant"),
    Bounds("plate.youngs_gpa", 1e-3, 2000, "gigapascals are meant: 210 for steel"),
    Bounds("plate.poisson", -0.99, 0.5),
    Bounds("plate.velocity_ms", -10, 10, "it looks like millimetres per second"),
    Bounds("plate.normal_error_deg", 0, 20),
    Bounds("plate.offset_error_mm", 0, 10),
    Bounds("dropper.runs", 1, 100_000),
    Bounds("dropper.height_mm", 0.1, 20_000, "millimetres are meant: 200 gives 2 m/s"),
    Bounds("dropper.height_scatter_mm", 0, 1000),
    Bounds("dropper.place_scatter_mm", 0, 100),
    Bounds("dropper.orientation_scatter_deg", 0, 180),
    Bounds("dropper.spin_rads", 0, 1e5),
    Bounds("dropper.spin_scatter_rads", 0, 1e4),
    Bounds("dropper.frames_before", 1, 100_000),
    Bounds("dropper.frames_after", 1, 100_000),
    Bounds("pair.closing_ms", 0.01, 100, "it looks like millimetres per second"),
    Bounds("pair.impact_parameter", 0, 1, "the centres pass each other within the sum of the radii"),
    Bounds("pair.out_of_plane_deg", 0, 90),
    Bounds("pair.drift_ms", 0, 100, "it looks like millimetres per second"),
    Bounds("pair.frames_before", 1, 100_000),
    Bounds("pair.frames_after", 1, 100_000),
    Bounds("contact.restitution", 0.05, 1, "no contact gives back more than it took; below 0.05 particles stay on the plate"),
    Bounds("contact.friction", 0, 2),
    Bounds("contact.youngs_gpa", 1e-3, 2000, "gigapascals are meant: 1143 for diamond"),
    Bounds("contact.poisson", -0.99, 0.5),
    Bounds("contact.corner_radius_mm", 1e-3, 100),
    Bounds("sensor.full_well_e", 1, 1e9),
    Bounds("sensor.read_noise_e", 0, 1e6),
    Bounds("sensor.dark_offset_dn", 0, 65_535),
    Bounds("sensor.saturation", 0.01, 1, "the share of the full well that the open background fills"),
    Bounds("sensor.prnu", 0, 1),
    Bounds("sensor.dsnu_e", 0, 1e6),
)

FURTHER_BOUNDS = (
    Bounds("angle_deg", 10, 170, "between the optical axes; closer ones see the same"),
    Bounds("around_deg", -360, 360),
    Bounds("delay_frames", -1000, 1000, "of the time between two pictures"),
    Bounds("offset_sigma_frames", 0, 1000, "of the time between two pictures"),
    Bounds("rate_sigma", 0, 0.1, "1e-5 is usual"),
    Bounds("hidden_offset_frames", -1000, 1000, "of the time between two pictures"),
    Bounds("hidden_rate", -0.1, 0.1, "1e-5 is usual"),
)
"""Of each of ``[[further_hsv]]``; its optics have the bounds of ``[hsv]``."""

LEAST_GRAVITY_MS2 = 0.1
SCATTERS = 4.0
"""Standard deviations of the release's height that the shortest fall is lower."""
DARKEST_SHARE = 0.5
"""Of full scale: a larger dark offset leaves no range for light."""

OF_A_PLATE = ("dropper",)
OF_A_CONTACT = ("contact", "contact_physics")
"""What means nothing without a plate, and without a plate or a pair."""

OF_A_PAIR = ("adhesion", "tangential_compliance", "velocity_dependent_restitution")
"""The contact physics of two particles; the rest is a plate's."""

NOT_BESIDE_A_PLATE = (Stage.OPTICS, Stage.EXPOSURE, Stage.SEGMENTATION)
"""Stages whose effects act on particles, not on the still picture of a plate."""

RANGES = (
    *("particle.size_mm", "motion.speed_ms", "motion.spin_rads", "motion.out_of_plane_ms", "rig.focal_px"),
    *("plate.tilt_deg", "dropper.height_mm", "dropper.spin_rads", "dropper.frames_before", "dropper.frames_after"),
    *("pair.closing_ms", "pair.impact_parameter", "pair.out_of_plane_deg", "pair.drift_ms", "pair.frames_before", "pair.frames_after"),
)
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
        _check_range(recipe, key, source)
    _check_further_hsv(recipe, source)
    check_effects(recipe.effects, recipe.sequences, source)
    check_cameras(recipe.effects, 1 + len(recipe.further_hsv), source)
    for holds, sentence in RELATIONS:
        if not holds(recipe):
            raise InputError(f"{source}: {sentence(recipe)}")
    check_contact_physics(recipe.contact_physics, recipe.sequences, source)


def _check_further_hsv(recipe: Recipe, source: str) -> None:
    for k, further in enumerate(recipe.further_hsv):
        where, seen = f"{source}: further_hsv[{k}]", filmed_by(recipe, k + 1)
        for bounds in FURTHER_BOUNDS:
            _check_bounds(further, bounds, where)
        for key in ("hidden_offset_frames", "hidden_rate"):
            _check_range(further, key, where)
        for bounds in (each for each in BOUNDS if each.key.startswith("hsv.")):
            _check_bounds(seen, bounds, where)
        for holds, sentence in OF_OPTICS:
            if not holds(seen):
                raise InputError(f"{where}: {sentence(seen)}")


def _check_range(recipe: Any, key: str, source: str) -> None:
    pair = value_of(recipe, key)
    if pair is not None and pair[0] > pair[1]:
        raise InputError(f"{source}: {key}: expected [lowest, highest], got [{pair[0]:g}, {pair[1]:g}].")


def value_of(recipe: Any, key: str) -> Any:
    """The value that a dotted key of a recipe, or of a part of one, names; ``None`` where there is no such table."""
    value = recipe
    for part in key.split("."):
        value = getattr(value, part) if value is not None else None
    return value


def _check_bounds(recipe: Any, bounds: Bounds, source: str) -> None:
    value = value_of(recipe, bounds.key)
    for entry in value if isinstance(value, tuple) else (value,):
        if entry is not None and not (math.isfinite(entry) and bounds.low <= entry <= bounds.high):
            hint = f"; {bounds.hint}" if bounds.hint else ""
            raise InputError(f"{source}: {bounds.key}: expected a value from {bounds.low:g} to {bounds.high:g}, got {entry:g}{hint}.")


def _some_size(recipe: Recipe) -> bool:
    low, high = recipe.particle.size_mm
    return low > 0 or (high == 0 and bool(recipe.particle.files))


def _named(recipe: Recipe) -> bool:
    return bool(recipe.name.strip())


def _exposure_fits(recipe: Recipe) -> bool:
    return recipe.hsv.exposure_us * 1e-6 * recipe.motion.frame_rate_hz <= 1 + 1e-9


def _focusable(recipe: Recipe) -> bool:
    return recipe.hsv.distance_m > recipe.hsv.focal_mm * 1e-3


def _pictures_fit(recipe: Recipe) -> bool:
    return max(part.width_px * part.height_px for part in (recipe.hsv, recipe.rig)) <= LARGEST_PICTURE_PX


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


def without_meaning(recipe: Recipe) -> tuple[str, ...]:
    """The tables of a recipe that mean nothing in it."""
    plate = () if recipe.plate is not None else OF_A_PLATE
    contact = () if recipe.plate is not None or recipe.pair is not None else OF_A_CONTACT
    return (*plate, *contact, *(() if recipe.further_hsv else ("further_hsv",)))


def _plate_where_needed(recipe: Recipe) -> bool:
    return all(getattr(recipe, part) == getattr(Recipe(), part) for part in without_meaning(recipe))


def _plate_or_pair(recipe: Recipe) -> bool:
    return recipe.plate is None or recipe.pair is None


def _pair_in_outlines(recipe: Recipe) -> bool:
    return recipe.pair is None or (recipe.tier == "silhouette" and not recipe.rig.rendered)


def _pair_without_effects(recipe: Recipe) -> bool:
    return recipe.pair is None or not recipe.effects


def _several_film_flights(recipe: Recipe) -> bool:
    return not recipe.further_hsv or (recipe.plate is None and recipe.pair is None)


def _pair_of_corners(recipe: Recipe) -> bool:
    return recipe.pair is None or bool(recipe.particle.files) or recipe.particle.family in {"cut_stone", "jagged"}


def _pair_physics(recipe: Recipe) -> bool:
    return recipe.pair is None or all(option.key in OF_A_PAIR for option in recipe.contact_physics)


def _plate_can_be_drawn(recipe: Recipe) -> bool:
    if recipe.plate is None or recipe.tier == "silhouette":
        return True
    return not any(recipe.plate.velocity_ms) and not any(KNOWN[effect.key].stage in NOT_BESIDE_A_PLATE for effect in recipe.effects)


def _plate_has_gravity(recipe: Recipe) -> bool:
    return recipe.plate is None or math.hypot(*recipe.motion.gravity_ms2[:2]) > LEAST_GRAVITY_MS2


def _fall_is_long_enough(recipe: Recipe) -> bool:
    return recipe.plate is None or recipe.dropper.frames_before[1] / recipe.motion.frame_rate_hz < _shortest_fall_s(recipe)


def _shortest_fall_s(recipe: Recipe) -> float:
    lowest = recipe.dropper.height_mm[0] - SCATTERS * recipe.dropper.height_scatter_mm
    return math.sqrt(max(0.0, 2e-3 * lowest / math.hypot(*recipe.motion.gravity_ms2)))


Relations = tuple[tuple[Callable[[Recipe], bool], Callable[[Recipe], str]], ...]
OF_OPTICS: Relations = (
    (
        _exposure_fits,
        lambda recipe: (
            f"hsv.exposure_us: expected at most {1e6 / recipe.motion.frame_rate_hz:g} (the time between two frames at "
            f"{recipe.motion.frame_rate_hz:g} Hz), got {recipe.hsv.exposure_us:g}."
        ),
    ),
    (
        _focusable,
        lambda recipe: (
            f"hsv.distance_m: expected more than the focal length ({recipe.hsv.focal_mm * 1e-3:g} m), got {recipe.hsv.distance_m:g}."
        ),
    ),
    (
        _pictures_fit,
        lambda recipe: (
            f"hsv.width_px: expected pictures of at most {LARGEST_PICTURE_PX:.0e} px, got {recipe.hsv.width_px} x {recipe.hsv.height_px} "
            f"(hsv) and {recipe.rig.width_px} x {recipe.rig.height_px} (rig)."
        ),
    ),
    (
        _distortion_can_be_undone,
        lambda recipe: (
            f"hsv.distortion: expected one that can be undone all over the picture, got {list(recipe.hsv.distortion)}, which misses by "
            f"{undistortion_error_px(_lens(recipe)):.3g} px at its edge; the order is k1, k2, p1, p2, k3."
        ),
    ),
)
"""What has to hold of the optics of every high-speed camera."""

RELATIONS: Relations = (
    (_named, lambda recipe: "name: expected some text, got nothing."),
    (
        _some_size,
        lambda recipe: f"particle.size_mm: expected positive sizes ([0, 0] keeps a file's own size), got {list(recipe.particle.size_mm)}.",
    ),
    (
        _slow_enough,
        lambda recipe: (
            f"motion.out_of_plane_ms: expected at most the highest speed ({recipe.motion.speed_ms[1]:g} m/s), "
            f"got {list(recipe.motion.out_of_plane_ms or ())}."
        ),
    ),
    (
        _dark_offset_fits,
        lambda recipe: (
            f"sensor.dark_offset_dn: expected at most {DARKEST_SHARE * _full_scale_dn(recipe):.0f} (half of full scale at "
            f"{recipe.sensor.bit_depth} bit), got {recipe.sensor.dark_offset_dn:g}."
        ),
    ),
    (
        _plate_where_needed,
        lambda recipe: (
            f"plate: expected the table of a plate, since {', '.join((*OF_A_PLATE, *OF_A_CONTACT))} need one, got "
            f"{'a pair: a dropper is for a plate' if recipe.pair is not None else 'none'}."
        ),
    ),
    (_plate_or_pair, lambda _: "pair: expected particles that fall on a plate or two that collide, got both tables."),
    (
        _pair_in_outlines,
        lambda recipe: f'tier: expected "silhouette" for a pair, whose pictures are not rendered, got "{recipe.tier}" or a rendered rig.',
    ),
    (
        _pair_without_effects,
        lambda recipe: f"effects: expected none on a pair, got {', '.join(effect.key for effect in recipe.effects)}.",
    ),
    (
        _pair_of_corners,
        lambda recipe: f'particle.family: expected bodies with edges for a pair, "cut_stone" or "jagged", got "{recipe.particle.family}".',
    ),
    (
        _pair_physics,
        lambda recipe: (
            f"contact_physics: expected {', '.join(OF_A_PAIR)} for a pair, got "
            f"{', '.join(option.key for option in recipe.contact_physics)}."
        ),
    ),
    (
        _plate_can_be_drawn,
        lambda recipe: (
            'tier: expected "silhouette" for a plate that moves and for effects on the picture beside a plate, which are not rendered, '
            f'got "{recipe.tier}".'
        ),
    ),
    (
        _plate_has_gravity,
        lambda recipe: f"motion.gravity_ms2: expected gravity across the viewing direction, got {list(recipe.motion.gravity_ms2)}.",
    ),
    (
        _fall_is_long_enough,
        lambda recipe: (
            f"dropper.frames_before: expected at most {_shortest_fall_s(recipe) * recipe.motion.frame_rate_hz:.0f} frames, as long as the "
            f"shortest fall of dropper.height_mm lasts, got {recipe.dropper.frames_before[1]}."
        ),
    ),
    (
        _several_film_flights,
        lambda recipe: f"further_hsv: expected one camera for {'a plate' if recipe.pair is None else 'a pair'}, got several.",
    ),
    *OF_OPTICS,
)
"""What has to hold between values, and the sentence where it does not."""
