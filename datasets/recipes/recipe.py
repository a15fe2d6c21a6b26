"""A recipe: everything that decides what a benchmark of sequences contains, apart from the code itself.

Lengths, speeds and times carry their unit in the name where it is not SI, since people write these by hand.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal


@dataclass(frozen=True)
class ParticleRecipe:
    """Which bodies. ``files`` (PLY/STL/OBJ, cycled over the sequences) or, when empty, the procedural family.

    ``unit`` of the files: ``m``, ``mm``, ``um``, ``km`` or ``any`` (only the shape counts). ``size_mm``: range of the largest extent,
    drawn uniformly per sequence; ``[0, 0]`` keeps the file's own size. ``family``: ``sphere``, ``ellipsoid``, ``cut_stone`` or ``jagged``;
    ``irregularity`` in [0, 1] runs through the family smoothly.
    """

    files: tuple[str, ...] = ()
    unit: Literal["m", "mm", "um", "km", "any"] = "any"
    repair: bool = False
    family: Literal["sphere", "ellipsoid", "cut_stone", "jagged"] = "cut_stone"
    irregularity: float = 0.4
    size_mm: tuple[float, float] = (4.0, 8.0)
    density_kgm3: float = 2650.0
    material: Literal["matte", "rough_metal", "diamond"] = "matte"


@dataclass(frozen=True)
class MotionRecipe:
    """Random free flights that stay in view: uniform speed and spin in the ranges given, isotropic directions."""

    frames: int = 100
    frame_rate_hz: float = 4000.0
    speed_ms: tuple[float, float] = (0.0, 4.0)
    spin_rads: tuple[float, float] = (0.0, 300.0)
    out_of_plane_ms: tuple[float, float] | None = None
    """Range of |v_z| (m/s) where it is to be set apart from the speed; ``None``: directions are isotropic."""
    gravity_ms2: tuple[float, float, float] = (0.0, 9.80665, 0.0)


@dataclass(frozen=True)
class HsvRecipe:
    """The high-speed camera. Principal distance follows from lens and focus: ``f d / (d - f)``."""

    width_px: int = 1024
    height_px: int = 1024
    focal_mm: float = 100.0
    pixel_pitch_um: float = 20.0
    distance_m: float = 0.6
    """Distance of the focal plane, and of the middle of the flights."""
    f_number: float = 16.0
    exposure_us: float = 50.0
    distortion: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)
    principal_point_offset_px: tuple[float, float] = (0.0, 0.0)
    light: Literal["back", "front"] = "back"
    vignetting: float = 0.1
    """Loss of light in the corners (share)."""
    light_falloff: float = 0.2
    """Loss of light at the panel's edge (share)."""


@dataclass(frozen=True)
class FurtherHsvRecipe:
    """A further high-speed camera that films the same flights. What is left out of its optics is as in ``[hsv]``.

    It looks at the middle of the flights from where its optical axis and the first camera's enclose ``angle_deg``; ``around_deg`` says on
    which side of the first camera it stands as that one sees it: 0 on its right, 90 below.

    Stated: its frames are exposed ``delay_frames`` of the time between two pictures later than those of the first camera. What the
    observation says of how well its clock is known: ``offset_sigma_frames`` (of the time between two pictures) and ``rate_sigma``, standard
    deviations. Hidden: ranges of what its clock is really off by, drawn for each sequence: with stamp ``t`` a frame is taken at
    ``t + offset + rate (t - t_0)``, ``t_0`` its first stamp.
    """

    angle_deg: float = 90.0
    around_deg: float = 0.0
    width_px: int | None = None
    height_px: int | None = None
    focal_mm: float | None = None
    pixel_pitch_um: float | None = None
    distance_m: float | None = None
    f_number: float | None = None
    exposure_us: float | None = None
    distortion: tuple[float, float, float, float, float] | None = None
    principal_point_offset_px: tuple[float, float] | None = None
    delay_frames: float = 0.0
    offset_sigma_frames: float = 0.0
    rate_sigma: float = 0.0
    hidden_offset_frames: tuple[float, float] = (0.0, 0.0)
    hidden_rate: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class RigRecipe:
    """The calibration rig: six cameras on icosahedral axes, ``drops`` placements of the particle."""

    drops: int = 10
    width_px: int = 1024
    height_px: int = 768
    focal_px: tuple[float, float] = (65000.0, 88000.0)
    """Range over the six cameras."""
    mm_per_px: float = 0.017
    f_number: float = 64.0
    """Depth of field without diffraction, which is not modelled: the views are sharper than a real lens would make them."""
    rendered: bool | None = None
    """Whether the views are pictures; ``None``: as the tier of the recipe."""
    calibration_px: float = 0.0
    """By how much each view's stated pose is off: moved, and turned at the particle's rim, by N(0, calibration²) of its pixels."""


@dataclass(frozen=True)
class NoiseRecipe:
    """Silhouette tier: outlines sampled every ``spacing_px``, each sample displaced along the outline's normal by N(0, sigma²).

    ``correlation_px``: distance along an outline over which the displacements' correlation falls to 1/e; 0: independent ones.
    """

    hsv_boundary_px: float = 0.2
    rig_boundary_px: float = 0.2
    spacing_px: float = 1.0
    correlation_px: float = 0.0


@dataclass(frozen=True)
class RenderingRecipe:
    """How carefully to render. ``variant`` ``auto``: LLVM where it safely works, scalar otherwise."""

    subframes: int = 8
    samples_per_subframe: int = 4
    rig_samples: int = 16
    crop_margin_px: int = 8
    variant: Literal["auto", "scalar_rgb", "llvm_ad_rgb", "scalar_mono", "llvm_ad_mono"] = "auto"
    full_frames: bool = False


@dataclass(frozen=True)
class SensorRecipe:
    """The sensor after EMVA 1288; electrons (e-), digital numbers (DN)."""

    bit_depth: Literal[8, 10, 12] = 12
    full_well_e: float = 20000.0
    read_noise_e: float = 15.0
    dark_offset_dn: float = 64.0
    saturation: float = 0.8
    """Share of the full well that the open background fills."""
    prnu: float = 0.005
    dsnu_e: float = 5.0


@dataclass(frozen=True)
class EffectRecipe:
    """One physical effect in force: its ``key`` (``datasets/vocabulary/effects.py``, ``datasets/recipes/synth_only.py``) and sizes.

    ``values``: a number per parameter, in the catalogue's unit; parameters left out are 0. An effect that every sequence has a size
    of its own of (scope ``sequence``) also takes a list of numbers, one per sequence. ``camera``: number of the only high-speed camera
    that has it, 0 that of ``[hsv]``; ``None``: all have it.
    """

    key: str
    values: Mapping[str, float | tuple[float, ...]] = field(default_factory=dict)
    camera: int | None = None


@dataclass(frozen=True)
class PlateRecipe:
    """A steel plate under a dropper, seen nearly along its surface; tilt and target differ from experiment to experiment.

    ``tilt_deg``: range of the normal's angle against the vertical, in the picture, to either side. ``elevation_deg``: of the camera above
    the surface at the target; below 0 the plate hides what touches it. ``size_mm``: across the picture, along the viewing direction,
    thickness. ``stated``: whether the observation tells the plane, with errors of standard deviation ``normal_error_deg`` (about each of
    two axes) and ``offset_error_mm``, which it tells too.
    """

    tilt_deg: tuple[float, float] = (10.0, 35.0)
    elevation_deg: float = 0.5
    size_mm: tuple[float, float, float] = (80.0, 20.0, 5.0)
    youngs_gpa: float = 210.0
    poisson: float = 0.3
    velocity_ms: tuple[float, float, float] = (0.0, 0.0, 0.0)
    stated: bool = True
    normal_error_deg: float = 0.1
    offset_error_mm: float = 0.02


@dataclass(frozen=True)
class DropperRecipe:
    """Experiments of ``runs`` runs each: one particle, one nominal release and one plate per experiment, and scatter from run to run.

    Sequence ``i`` is run ``i % runs`` of experiment ``i // runs``. Ranges hold what is drawn once per experiment: the height of the fall,
    the spin at release (its axis and the orientation are isotropic), and, per sequence, whole frames before and after the impact.
    """

    runs: int = 10
    height_mm: tuple[float, float] = (50.0, 200.0)
    height_scatter_mm: float = 1.0
    place_scatter_mm: float = 0.3
    orientation_scatter_deg: float = 3.0
    spin_rads: tuple[float, float] = (0.0, 40.0)
    spin_scatter_rads: float = 4.0
    frames_before: tuple[int, int] = (40, 60)
    frames_after: tuple[int, int] = (40, 60)


@dataclass(frozen=True)
class PairRecipe:
    """Two particles of ``[particle]`` that collide once in flight, near the middle of the picture.

    ``closing_ms``: range of their relative speed, ``out_of_plane_deg`` of its angle against the picture: the larger, the longer one hides
    the other. ``impact_parameter``: how far from one another their centres' paths would pass, as a share of the sum of the two mean radii.
    ``drift_ms``: speed of the common centre of mass. ``frames_before`` and ``frames_after`` the collision are whole.
    """

    closing_ms: tuple[float, float] = (0.6, 1.5)
    impact_parameter: tuple[float, float] = (0.0, 0.6)
    out_of_plane_deg: tuple[float, float] = (0.0, 25.0)
    drift_ms: tuple[float, float] = (0.0, 0.5)
    frames_before: tuple[int, int] = (40, 50)
    frames_after: tuple[int, int] = (40, 50)


@dataclass(frozen=True)
class ContactRecipe:
    """The contact with a plate or of two particles: Stronge's ``restitution``, Coulomb's ``friction``, elasticity, rounded corners."""

    restitution: float = 0.6
    friction: float = 0.15
    youngs_gpa: float = 70.0
    poisson: float = 0.2
    corner_radius_mm: float = 0.3


@dataclass(frozen=True)
class Recipe:
    """A whole benchmark: ``sequences`` sequences of one tier from one seed.

    ``same_particle``: all sequences are of one particle, seen with one set of calibrated views (a campaign); otherwise each
    sequence draws its own. With a ``plate``, particles are dropped on it instead of flying at random (``motion`` then says only
    frame rate and gravity); ``contact_physics``: what is hidden in the contact (``datasets/vocabulary/contact_physics.py``). With a
    ``pair``, two of them collide in flight (``motion`` says frame rate, gravity and spin). ``further_hsv``: more high-speed cameras that
    film the same flights.
    """

    name: str = "benchmark"
    seed: int = 1
    sequences: int = 1
    same_particle: bool = False
    tier: Literal["silhouette", "rendered"] = "silhouette"
    particle: ParticleRecipe = field(default_factory=ParticleRecipe)
    motion: MotionRecipe = field(default_factory=MotionRecipe)
    hsv: HsvRecipe = field(default_factory=HsvRecipe)
    further_hsv: tuple[FurtherHsvRecipe, ...] = ()
    rig: RigRecipe = field(default_factory=RigRecipe)
    noise: NoiseRecipe = field(default_factory=NoiseRecipe)
    rendering: RenderingRecipe = field(default_factory=RenderingRecipe)
    sensor: SensorRecipe = field(default_factory=SensorRecipe)
    effects: tuple[EffectRecipe, ...] = ()
    plate: PlateRecipe | None = None
    pair: PairRecipe | None = None
    dropper: DropperRecipe = field(default_factory=DropperRecipe)
    contact: ContactRecipe = field(default_factory=ContactRecipe)
    contact_physics: tuple[EffectRecipe, ...] = ()
