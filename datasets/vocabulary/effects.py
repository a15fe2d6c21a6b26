"""The catalogue of physical effects: each one's name, stage, parameters, units, plausible ranges and meaning, said once for everybody.

``synth`` realises an effect at high fidelity, ``estimator`` as a reduced, differentiable model; the two share only this declaration. The
meaning is an equation in the vocabulary of the project (world frame: that of the first high-speed camera; ``u`` the outward unit normal of
the outline in the picture, px; ``delta`` the displacement of the outline along ``u``, px, positive outwards). A parameter of 0 is
always "no effect" unless its entry says otherwise.
"""

from dataclasses import dataclass
from enum import StrEnum

OF = "@"
"""Between the key of an effect and the name of the only camera that has it."""


def of_camera(key: str, camera: str) -> str:
    """The key of an effect that one camera alone has: ``focal_length@side``."""
    return f"{key}{OF}{camera}"


def whose(key: str) -> tuple[str, str]:
    """The effect that a key is about, and the name of the only camera that has it; none where it is of no camera alone."""
    effect, _, camera = key.partition(OF)
    return effect, camera


def in_words(key: str) -> str:
    """An effect's key as it is said: ``focal length of camera side``."""
    effect, camera = whose(key)
    return effect.replace("_", " ") + (f" of camera {camera}" if camera else "")


def begins(words: str) -> str:
    """Words as a sentence begins with them; names in them keep their letters."""
    return words[:1].upper() + words[1:]


class Stage(StrEnum):
    """Where in the chain from particle to outline an effect acts, in the order of evaluation."""

    CLOCK = "clock"
    BODY = "body"
    DYNAMICS = "dynamics"
    CONTACT = "contact"
    OPTICS = "optics"
    EXPOSURE = "exposure"
    SEGMENTATION = "segmentation"
    TRACKING = "tracking"
    GYROSCOPE = "gyroscope"


OF_A_CAMERA = (Stage.CLOCK, Stage.OPTICS, Stage.EXPOSURE, Stage.SEGMENTATION)
"""Stages whose effects may be those of one high-speed camera alone."""


class Scope(StrEnum):
    """Whose property a parameter is: sequences of one campaign share it, or have one each.

    A recording with impacts holds several flights, each of which is a sequence of its own. What belongs to the ``RECORDING`` is the same in
    all flights of it; what belongs to a ``SEQUENCE`` may change at an impact.
    """

    SEQUENCE = "sequence"
    RECORDING = "recording"
    PARTICLE = "particle"
    CAMERA = "camera"
    CAMPAIGN = "campaign"

    @property
    def own(self) -> bool:
        """Whether there is a value for every sequence or for every recording, of which nobody expects that they are alike."""
        return self in (Scope.SEQUENCE, Scope.RECORDING)


@dataclass(frozen=True)
class Parameter:
    """One number of an effect.

    ``plausible``: values (in ``unit``) that nature or a laboratory is expected to produce; ``step``: a change that is small but moves
    outlines visibly, for derivatives and starts.
    """

    name: str
    unit: str
    plausible: tuple[float, float]
    step: float
    meaning: str


@dataclass(frozen=True)
class EffectEntry:
    """What an effect is called, where it acts, what its parameters mean, and where to read more.

    ``searched``: names of parameters in which the effect is not linear near zero (a frequency, a frame number), found by a search.
    """

    key: str
    stage: Stage
    scope: Scope
    parameters: tuple[Parameter, ...]
    meaning: str
    reference: str
    searched: tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """The parameters' names."""
        return tuple(p.name for p in self.parameters)

    @property
    def sizes(self) -> tuple[str, ...]:
        """The parameters that say how strong an effect is: where all are 0 there is no effect."""
        return tuple(name for name in self.names if name not in self.searched) or self.names

    @property
    def title(self) -> str:
        """The name in words."""
        return in_words(self.key)


def _xyz(name: str, unit: str, limit: float, step: float, meaning: str) -> tuple[Parameter, ...]:
    return tuple(Parameter(f"{name}_{axis}", unit, (-limit, limit), step, f"{meaning}, along {axis}") for axis in "xyz")


_ENTRIES = (
    EffectEntry(
        "frame_rate",
        Stage.CLOCK,
        Scope.CAMPAIGN,
        (Parameter("relative", "1", (-0.05, 0.05), 1e-4, "true frame rate over the nominal one, minus 1"),),
        "true time = nominal time / (1 + relative), counted from the first frame",
        "Without a known force it is degenerate with v and omega; gravity breaks that",
    ),
    EffectEntry(
        "dropped_frames",
        Stage.CLOCK,
        Scope.RECORDING,
        (
            Parameter("count", "frames", (0.0, 5.0), 0.01, "how many frames are missing"),
            Parameter("after_frame", "1", (0.0, 1e6), 1.0, "number of the last frame before the gap"),
        ),
        "every frame after ``after_frame`` was taken ``count`` nominal frame intervals later than its time stamp says",
        "Common in recorders that write time stamps by counting",
        searched=("after_frame",),
    ),
    EffectEntry(
        "trigger_jitter",
        Stage.CLOCK,
        Scope.CAMPAIGN,
        (Parameter("sigma", "s", (0.0, 1e-4), 1e-7, "standard deviation of the frames' true times about their time stamps"),),
        "true time_i = nominal time_i + sigma N(0, 1), independent per frame: a random effect",
        "Laird and Ware, Random-effects models for longitudinal data, Biometrics 38 (1982) 963",
        searched=("sigma",),
    ),
    EffectEntry(
        "stamp_scatter",
        Stage.CLOCK,
        Scope.CAMPAIGN,
        (Parameter("share", "1", (0.0, 1.0), 1e-3, "of the stamps' scatter about even times: what is their own error"),),
        "true time = stamp + share (even - stamp), even = t_0 + T k the even times nearest to a sequence's stamps, k whole numbers: frames "
        "were taken at even intervals, and stamps were rounded or read late",
        "Olson, A passive solution to the sensor synchronization problem, IROS (2010) 1059",
    ),
    EffectEntry(
        "clock_offset",
        Stage.CLOCK,
        Scope.CAMERA,
        (Parameter("offset", "s", (-1e-3, 1e-3), 1e-7, "how much later than stamped frames were taken"),),
        "every frame of a further camera was taken ``offset`` later than its stamp says, by the clock of the first camera",
        "Caspi and Irani, Spatio-temporal alignment of sequences, IEEE Trans. PAMI 24 (2002) 1409",
    ),
    EffectEntry(
        "centre_of_mass",
        Stage.BODY,
        Scope.PARTICLE,
        tuple(
            Parameter(f"c{i}", "m", (-5e-4, 5e-4), 1e-6, f"displacement along principal axis {i} of the uniform body") for i in (1, 2, 3)
        ),
        "the centre of mass lies at c, body axes, from that of the uniform body; moments about it are those of the uniform body",
        "Goldstein, Classical Mechanics (1980), ch. 5",
    ),
    EffectEntry(
        "inertia_ratios",
        Stage.BODY,
        Scope.PARTICLE,
        tuple(Parameter(f"e{i}", "1", (-0.3, 0.3), 1e-4, f"relative change of moment {i} against the largest one") for i in (1, 2)),
        "principal moments I1 (1 + e1), I2 (1 + e2), I3 about the axes of the uniform body",
        "Goldstein, Classical Mechanics (1980), ch. 5",
    ),
    EffectEntry(
        "products_of_inertia",
        Stage.BODY,
        Scope.PARTICLE,
        tuple(
            Parameter(f"e{i}{j}", "1", (-0.1, 0.1), 1e-4, f"product of axes {i} and {j} over the geometric mean of their moments")
            for i, j in ((1, 2), (1, 3), (2, 3))
        ),
        "entries Iij = eij sqrt(Ii Ij) of the inertia matrix about the axes of the uniform body, Ii its moments: principal axes lie "
        "elsewhere, or a sensor's axes do",
        "Goldstein, Classical Mechanics (1980), ch. 5; dynamic unbalance, ISO 21940-2",
    ),
    EffectEntry(
        "length_scale",
        Stage.BODY,
        Scope.CAMPAIGN,
        (Parameter("relative", "1", (-0.05, 0.05), 1e-4, "true size of the particle over that of its calibration, minus 1"),),
        "the particle in flight is (1 + relative) times as large as the calibrated views say (lengths of the rig are wrong)",
        "Hartley and Zisserman, Multiple View Geometry (2004), ch. 10: scale of a reconstruction",
    ),
    EffectEntry(
        "view_outline_offset",
        Stage.SEGMENTATION,
        Scope.PARTICLE,
        (Parameter("offset", "px", (-3.0, 3.0), 1e-2, "displacement in pixels of the calibrated views"),),
        "outlines of all calibrated views are displaced by offset, outwards",
        "Forbes, PhD thesis, University of Cape Town (2007), ch. 4",
    ),
    EffectEntry(
        "gravity",
        Stage.DYNAMICS,
        Scope.CAMPAIGN,
        _xyz("dg", "m/s2", 0.5, 1e-3, "true minus stated gravity, world frame"),
        "dv/dt = g_stated + dg: size or direction of gravity in the camera's frame is wrong",
        "A camera that is not level by 3 degrees turns gravity by 0.5 m/s2; over the Earth its size differs by 0.05 m/s2",
    ),
    EffectEntry(
        "uniform_acceleration",
        Stage.DYNAMICS,
        Scope.RECORDING,
        _xyz("a", "m/s2", 5.0, 1e-3, "acceleration in this sequence, world frame"),
        "dv/dt = g + a, another a in every sequence (a charged particle, a steady draught, an accelerated camera)",
        "Goldstein, Classical Mechanics (1980), ch. 4",
    ),
    EffectEntry(
        "linear_drag",
        Stage.DYNAMICS,
        Scope.PARTICLE,
        (Parameter("rate", "1/s", (0.0, 20.0), 1e-3, "drag over momentum"),),
        "dv/dt = g - rate v",
        "Stokes, Trans. Camb. Phil. Soc. 9 (1851) 8; holds for Re < 1",
    ),
    EffectEntry(
        "quadratic_drag",
        Stage.DYNAMICS,
        Scope.PARTICLE,
        (Parameter("per_length", "1/m", (0.0, 5.0), 1e-3, "c = rho_air C_D A / (2 m)"),),
        "dv/dt = g - per_length |v| v",
        "Clift, Grace and Weber, Bubbles, Drops and Particles (1978), ch. 6; holds for Re > 1000",
    ),
    EffectEntry(
        "magnus_lift",
        Stage.DYNAMICS,
        Scope.PARTICLE,
        (Parameter("coefficient", "1", (-0.5, 0.5), 1e-5, "lift over m omega x v"),),
        "dv/dt = g + coefficient (omega x v)",
        "Rubinow and Keller, J. Fluid Mech. 11 (1961) 447",
    ),
    EffectEntry(
        "saturating_lift",
        Stage.DYNAMICS,
        Scope.PARTICLE,
        (
            Parameter("coefficient", "1", (-0.5, 0.5), 1e-5, "lift over m omega x v of a slow spin"),
            Parameter("length", "m", (0.0, 1.0), 1e-4, "speed over spin at which half of that is left; 0: magnus_lift"),
        ),
        "dv/dt = g + coefficient (omega x v) / (1 + length |omega| / |v|): lift that grows less than the spin",
        "Nathan, Am. J. Phys. 76 (2008) 119: C_L = S / (0.4 + 2.32 S) for balls, S = r omega / v, so length = 5.8 r",
        searched=("length",),
    ),
    EffectEntry(
        "induced_drag",
        Stage.DYNAMICS,
        Scope.PARTICLE,
        (Parameter("ratio", "1", (0.0, 2.0), 1e-3, "drag that lift brings, over the lift"),),
        "dv/dt = g - ratio |l| v / |v|, l the acceleration by lift: drag that grows with the spin as lift does, none without lift",
        "Davies, J. Appl. Phys. 20 (1949) 821: lift and drag of golf balls both grow with the spin",
    ),
    EffectEntry(
        "unmeasured_lift",
        Stage.DYNAMICS,
        Scope.SEQUENCE,
        tuple(Parameter(f"w_{axis}", "1/s", (-5.0, 5.0), 1e-3, f"lift coefficient times unmeasured spin, along {axis}") for axis in "xyz"),
        "dv/dt = g + w x v, another w in every sequence: lift of a spin that nobody measured, or that was measured wrongly (w: that of the "
        "true spin beside the measured one)",
        "Rubinow and Keller, J. Fluid Mech. 11 (1961) 447",
    ),
    EffectEntry(
        "unmeasured_drag",
        Stage.DYNAMICS,
        Scope.SEQUENCE,
        (Parameter("rate", "1/s", (-5.0, 5.0), 1e-3, "drag over momentum, beside that of the other effects"),),
        "dv/dt = g - rate v, another rate in every sequence: drag of a spin that was measured wrongly",
        "Davies, J. Appl. Phys. 20 (1949) 821: drag of golf balls grows with the spin",
    ),
    EffectEntry(
        "steady_wind",
        Stage.DYNAMICS,
        Scope.CAMPAIGN,
        _xyz("w", "m/s", 5.0, 1e-3, "velocity of the air, world frame"),
        "drag and lift act with v - w in the place of v; alone it does nothing",
        "Hoerner, Fluid-Dynamic Drag (1965), ch. 1: forces of a fluid depend on the velocity against it",
    ),
    EffectEntry(
        "spin_damping",
        Stage.DYNAMICS,
        Scope.PARTICLE,
        (Parameter("rate", "1/s", (0.0, 50.0), 1e-3, "torque over angular momentum"),),
        "dL/dt = -rate L",
        "Lamb, Hydrodynamics (1932), art. 334: viscous torque on a sphere",
    ),
    EffectEntry(
        "nutation_damping",
        Stage.DYNAMICS,
        Scope.PARTICLE,
        (Parameter("rate", "1/s", (0.0, 50.0), 1e-3, "torque over largest moment and the part of omega that lies across L"),),
        "dL/dt = -rate I3 (omega - (omega . l) l), l the direction of L, I3 the largest moment: a wobble about the axis of I3 decays, "
        "of equal moments I1 across it with rate (I3 - I1) / I1. The size of L stays, its direction to first order in rate over precession",
        "Hummel, Frisbee Flight Simulation (2003): damping of pitch and roll; Bracewell and Garriott, Nature 182 (1958) 760: energy sink",
    ),
    EffectEntry(
        "radial_distortion",
        Stage.OPTICS,
        Scope.CAMERA,
        (
            Parameter("k1", "1", (-5.0, 5.0), 1e-3, "second-order coefficient, on top of the stated one"),
            Parameter("k2", "1", (-500.0, 500.0), 1e-1, "fourth-order coefficient, on top of the stated one"),
        ),
        "x_d = x (1 + k1 r2 + k2 r4) in normalised coordinates of the high-speed camera",
        "Brown, Photogrammetric Engineering 37 (1971) 855",
    ),
    EffectEntry(
        "tangential_distortion",
        Stage.OPTICS,
        Scope.CAMERA,
        tuple(Parameter(f"p{i}", "1", (-0.02, 0.02), 1e-6, "decentring coefficient, on top of the stated one") for i in (1, 2)),
        "x_d = x + 2 p1 x y + p2 (r2 + 2 x2), y_d = y + p1 (r2 + 2 y2) + 2 p2 x y",
        "Brown, Photogrammetric Engineering 37 (1971) 855",
    ),
    EffectEntry(
        "principal_point",
        Stage.OPTICS,
        Scope.CAMERA,
        tuple(Parameter(f"d{axis}", "px", (-50.0, 50.0), 1e-1, f"true minus stated principal point along {axis}") for axis in "xy"),
        "the optical axis meets the picture at (cx + dx, cy + dy)",
        "Hartley and Zisserman, Multiple View Geometry (2004), ch. 6",
    ),
    EffectEntry(
        "pixel_aspect",
        Stage.OPTICS,
        Scope.CAMERA,
        (Parameter("relative", "1", (-0.02, 0.02), 1e-5, "fy over the stated one, minus 1"),),
        "v = fy (1 + relative) y / z + cy",
        "Hartley and Zisserman, Multiple View Geometry (2004), ch. 6",
    ),
    EffectEntry(
        "focal_length",
        Stage.OPTICS,
        Scope.CAMERA,
        (Parameter("relative", "1", (-0.2, 0.2), 1e-4, "true focal length over the stated one, minus 1"),),
        "fx and fy are (1 + relative) times the stated ones; nearly degenerate with depth for one distant camera",
        "Hartley and Zisserman, Multiple View Geometry (2004), ch. 6",
    ),
    EffectEntry(
        "camera_vibration",
        Stage.OPTICS,
        Scope.CAMPAIGN,
        (
            Parameter("sine_x", "px", (-10.0, 10.0), 1e-2, "amplitude of sin(2 pi f t) along x"),
            Parameter("sine_y", "px", (-10.0, 10.0), 1e-2, "amplitude of sin(2 pi f t) along y"),
            Parameter("cosine_x", "px", (-10.0, 10.0), 1e-2, "amplitude of cos(2 pi f t) along x"),
            Parameter("cosine_y", "px", (-10.0, 10.0), 1e-2, "amplitude of cos(2 pi f t) along y"),
            Parameter("frequency", "Hz", (20.0, 1000.0), 1.0, "frequency f"),
        ),
        "the picture moves by sine sin(2 pi f t) + cosine cos(2 pi f t), px, t the time stamp counted from the sequence's first frame",
        "A camera on a post rings at tens to hundreds of hertz",
        searched=("frequency",),
    ),
    EffectEntry(
        "defocus_growth",
        Stage.OPTICS,
        Scope.CAMERA,
        (Parameter("blur", "px/m", (0.0, 100.0), 0.5, "standard deviation of the blur per metre from the focal plane"),),
        "picture blurred with a Gaussian of s = blur |z - z_focus|, outline at the half level: delta = -s2 / (2 rho + 1.3 s), rho the "
        "outline's radius of curvature (px); z_focus is the depth of the particle in the sequence's first frame",
        "Verbeek and van Vliet, IEEE Trans. Pattern Anal. Mach. Intell. 16 (1994) 726: blurred edges recede with curvature",
        searched=("blur",),
    ),
    EffectEntry(
        "motion_blur_threshold",
        Stage.EXPOSURE,
        Scope.CAMERA,
        (Parameter("bias", "1", (-0.4, 0.4), 1e-3, "0.5 minus the level of darkness at which the outline is drawn"),),
        "delta = bias |u . w| T, w the outline's velocity in the picture (px/s), T the exposure: leading and trailing edges both move "
        "(in pictures, whose edges are blurred at rest, too, to where both blurs together reach the level), "
        "and corners narrower across the motion than the dark share of the blur recede further, at the half level, too",
        "Design rule of every half-level contour: only at level 0.5 blur leaves the middle of the exposure in place",
    ),
    EffectEntry(
        "rolling_shutter",
        Stage.EXPOSURE,
        Scope.CAMERA,
        (Parameter("line_time", "s", (-3e-7, 3e-7), 1e-10, "time from one row to the next"),),
        "the row y is exposed at t + line_time (y - (height - 1) / 2)",
        "Ait-Aider, Andreff, Lavest and Martinet, ECCV (2006)",
    ),
    EffectEntry(
        "outline_offset",
        Stage.SEGMENTATION,
        Scope.CAMERA,
        (Parameter("offset", "px", (-2.0, 2.0), 1e-3, "displacement in pixels of the high-speed camera"),),
        "delta = offset",
        "Forbes, PhD thesis, University of Cape Town (2007), ch. 4",
    ),
    EffectEntry(
        "blooming",
        Stage.SEGMENTATION,
        Scope.CAMERA,
        (Parameter("loss", "px", (0.0, 3.0), 1e-3, "recession of the outline where the back-light is brightest"),),
        "delta = -loss (1 - r2 / R2), r the distance from the picture's centre, R half its diagonal: bright background spills over the rim",
        "EMVA Standard 1288 (2021); charge spilling from saturated pixels",
    ),
    EffectEntry(
        "rim_light_leak",
        Stage.SEGMENTATION,
        Scope.PARTICLE,
        (Parameter("loss", "px", (0.0, 3.0), 1e-3, "recession of the outline at an infinitely long flat stretch"),),
        "delta = -loss f / (1 + f), f(u) the length of outline whose normals lie within 10 degrees of u, over 0.349 times the outline's "
        "mean radius (perimeter / 2 pi), largest within 3 px: facets along the line of sight let light through, corners recede with them",
        "Light leaks through facets near the rim of refracting particles; measured on rendered diamond",
    ),
    EffectEntry(
        "position_distortion",
        Stage.TRACKING,
        Scope.CAMPAIGN,
        (
            Parameter("k", "1", (-0.01, 0.01), 1e-4, "displacement over distance from the middle, at the distance R"),
            *(Parameter(f"p_{axis}", "1", (-0.01, 0.01), 1e-4, f"displacement over R at R, decentred along {axis}") for axis in "xyz"),
        ),
        "measured x = x + R (k |u|^2 u + |u|^2 p + 2 (p . u) u), u = (x - c) / R, c the middle of all positions of the campaign, R the "
        "root mean square of their distances from it: what a volume calibrated with wrong lens distortion does to positions",
        "Brown, Photogrammetric Engineering 37 (1971) 855, in space; Luhmann and others, Close-Range Photogrammetry and 3D Imaging (2014)",
    ),
    EffectEntry(
        "perspective",
        Stage.TRACKING,
        Scope.CAMPAIGN,
        tuple(Parameter(f"q_{axis}", "1", (-0.02, 0.02), 1e-4, f"growth of the scale over the distance R along {axis}") for axis in "xyz"),
        "measured x = c + R u / (1 - q . u), u = (x - c) / R, c and R as of position_distortion: the scale of a plane that is filmed at an "
        "angle, or of a volume whose cameras stand otherwise than they were calibrated, changes across it",
        "Hartley and Zisserman, Multiple View Geometry in Computer Vision (2004), ch. 2 and 10",
    ),
    EffectEntry(
        "gyroscope_bias",
        Stage.GYROSCOPE,
        Scope.CAMPAIGN,
        _xyz("b", "rad/s", 0.5, 1e-4, "reading at rest"),
        "reading = omega + b, along the tracked frame's axes",
        "IEEE Std 952-1997, annex B: model of a gyroscope's errors",
    ),
    EffectEntry(
        "gyroscope_scale",
        Stage.GYROSCOPE,
        Scope.CAMPAIGN,
        tuple(Parameter(f"s_{axis}", "1", (-0.1, 0.1), 1e-4, f"reading over angular velocity about {axis}, minus 1") for axis in "xyz"),
        "reading_i = omega_i (1 + s_i), along the tracked frame's axes",
        "IEEE Std 952-1997, annex B: model of a gyroscope's errors",
    ),
)

EFFECTS: dict[str, EffectEntry] = {entry.key: entry for entry in _ENTRIES}
"""The catalogue by key, in no order of importance."""

TRACKED_ONLY = (
    "stamp_scatter",
    "products_of_inertia",
    "saturating_lift",
    "induced_drag",
    "steady_wind",
    "unmeasured_lift",
    "unmeasured_drag",
    "nutation_damping",
    "position_distortion",
    "perspective",
    "gyroscope_bias",
    "gyroscope_scale",
)
"""Effects on trial in trajectories alone: those of a tracker or a gyroscope, those that flights of centimetres before a camera do not
show, and products of inertia, of which outlines know what the surface does not say as part of every fit."""
FURTHER_ONLY = ("clock_offset",)
"""Effects of a further high-speed camera against the first one: with one camera there is nothing to compare."""
PICTURED: dict[str, EffectEntry] = {key: entry for key, entry in EFFECTS.items() if key not in (*TRACKED_ONLY, *FURTHER_ONLY)}
"""The catalogue of what one camera's pictures can show."""

FLATNESS_HALF_ANGLE_DEG = 10.0
"""Half width of the range of normals that counts as one facet in ``rim_light_leak``."""
FLATNESS_REACH_PX = 3.0
"""Length of outline within which the flattest stretch counts there."""
