"""What the calibrated views say about the particle.

Which of them belong together, the visual hull they carve, the body that fills it, and starts for the pose search.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from datasets.errors import InputError
from datasets.observation import CalibratedView, Made
from datasets.vocabulary.body import Body
from datasets.vocabulary.outline import Outline
from datasets.vocabulary.surface_mesh import SurfaceMesh
from estimator.data.configuration import Configuration
from estimator.data.views import Views
from estimator.geometry.cast_outline import CastingMesh, cast_convex, cast_outline, casting_mesh
from estimator.geometry.epipolar_tangency import PoseSet, tangency_errors
from estimator.geometry.hollows import hollow_beyond_noise
from estimator.geometry.outline_bias import DrawnBias, bias_under, drawn_noise, noise_digest, noise_streams
from estimator.geometry.silhouettes import Silhouettes, like_silhouettes, silhouettes
from estimator.geometry.tangent_hull import Likeness
from estimator.geometry.visual_hull import bounding_ball
from estimator.outlines.pictures.pictured import Pictures, mean_seen
from estimator.particle.exact_hull import exact_hull
from estimator.particle.made_once import NOTHING_MADE, MadeOnce, digest_of, made_of_arrays
from estimator.particle.mass_properties import body_of, largest_moment_per_mass, solid_of
from estimator.particle.tangent_polytope import tangent_polytope
from estimator.particle.view_disagreement import Disagreement, disagreement, misplaced
from estimator.particle.view_faults import agreed_hull, view_fault
from estimator.poses.pose_starts import StartCatalogue, start_catalogue

Array = NDArray[np.float64]
MINIMUM_VIEWS = 3
"""Of a hull: two silhouette cones leave it open."""
LEAST_HOLLOW = 0.01
"""Share of its outlines' convex hulls that a hollow body leaves empty: convex ones show 0.003 at most, jagged ones 0.014 and more.

See notebook 30."""
TOLERANCE_PX = 0.4
"""By how much outlines may be simplified for the exact hull, some two standard deviations of their noise; twice as much blunts spikes.

See notebook 28."""
FINER_IN_VIEWS = 8
"""How much finer than their pixels outlines are drawn in views, which are finer than the camera's."""

COVERAGE = 2.0
"""Standard deviations by which a volume must be above 0 to be a body's: the coverage factor for 95 %.

With c px by which views are misplaced (:class:`Disagreement`), a pixel's size, and area A and volume V of their hull, one is c A / V: 0.01
to 0.07 of real rigs and one with focal lengths off by 10 %, 0.3 to 12 with wrong orders, axes, or rotations of five or six cameras."""

VIEW_DRAWS = 8
"""Pictures that are drawn of every view (notebook 31)."""


@dataclass(frozen=True)
class ViewReport:
    """Agreement of the views with one another: ``rms_px`` (k,) RMS ETE of each view against the others.

    ``foreign`` (k,): which do not belong. ``numbers`` (k,): the views' numbers in the observation, which also counts those
    ``without_outline``.
    """

    rms_px: Array
    foreign: NDArray[np.bool_]
    numbers: NDArray[np.int64]
    without_outline: tuple[int, ...]

    @property
    def left_out(self) -> tuple[int, ...]:
        """Numbers of the views that do not belong."""
        return tuple(self.numbers[self.foreign].tolist())

    @property
    def sentence(self) -> str:
        """Which views do not belong or show nothing, in words; empty when there are none."""
        typical = float(np.median(self.rms_px))
        named = [
            f"view {self.numbers[i]} (RMS ETE {self.rms_px[i]:.1f} px, the others' median {typical:.2f} px)"
            for i in np.flatnonzero(self.foreign)
        ]
        foreign = f"left out as not belonging to this particle or calibration: {', '.join(named)}." if named else ""
        empty = f"left out without a usable outline: view {', '.join(map(str, self.without_outline))}." if self.without_outline else ""
        return " ".join(part for part in (foreign, empty) if part)


WORST_TOLD = 3
"""How many of the views that disagree most are named."""


@dataclass(frozen=True)
class Particle:
    """The particle as the views show it: hull, body, start catalogue, the views in use and how they agree.

    ``seen``: the views' outlines, with the noise that the views show among themselves where that is more than the outlines'.
    ``fault``: what is likely wrong with views that disagree, in a sentence. ``made``: what a particle file keeps, not made again, and in
    any case the views' silhouettes. ``recalibrated_px``: by how much a fit moved and turned views to where ``calibrated`` has them, a
    standard deviation; 0: they are where they were stated.
    """

    outlines: tuple[Outline, ...]
    calibrated: tuple[CalibratedView, ...]
    seen: Silhouettes
    poses: PoseSet
    hull: SurfaceMesh
    body: Body
    catalogue: StartCatalogue
    report: ViewReport
    disagreement: Disagreement
    fault: str = ""
    made: MadeOnce = NOTHING_MADE
    recalibrated_px: float = 0.0

    @property
    def extent_m(self) -> float:
        """Largest extent (m) of the hull along its principal axes."""
        return float(np.ptp(self.hull.vertices @ self.body.R_particle_body, axis=0).max())

    @property
    def sentence(self) -> str:
        """What is to be said of the views: which do not belong or show nothing, and that they disagree; empty where they are in order."""
        return " ".join(part for part in (self.report.sentence, self._disagreement_sentence, self.fault) if part)

    @cached_property
    def contradictory(self) -> bool:
        """Whether the views show no body: a mistake is found, or moving the hull's surface as they are misplaced may take its volume."""
        misplaced_m = self.disagreement.calibration_px * float(np.median(self.sample_m))
        if self.fault or misplaced_m == 0.0:
            return bool(self.fault)
        solid = solid_of(self.hull)
        return bool(solid.volume <= COVERAGE * misplaced_m * solid.area)

    @property
    def _disagreement_sentence(self) -> str:
        among = self.disagreement
        if not among.beyond_noise:
            return ""
        numbers = self.report.numbers[~self.report.foreign]
        worst = [f"view {numbers[i]} ({among.view_rms_px[i]:.2f} px)" for i in np.argsort(-among.view_rms_px)[:WORST_TOLD]]
        so = (
            "they contradict one another, and no body is measured"
            if self.contradictory
            else f"each is misplaced by about {among.calibration_px:.2f} px, by its calibration or by light that leaks through the "
            "particle, which the uncertainties contain"
        )
        return (
            f"the calibrated views disagree with one another by {among.rms_px:.2f} px RMS, and the noise of their outlines explains "
            f"{among.expected_px:.2f} px: {so}. They disagree most with {', '.join(worst)}: inspect these pictures, and check the "
            "calibration."
        )

    @cached_property
    def hollow(self) -> float:
        """Mean share of the convex hulls of the views' outlines that the body leaves empty."""
        if self.made.hollow is not None:
            return self.made.hollow
        return hollow_beyond_noise([outline.points_px for outline in self.outlines])

    @cached_property
    def casting_hull(self) -> SurfaceMesh:
        """What casts the body's outlines: its exact visual hull where it has hollows (seconds), the carved one where it has none."""
        if self.hollow <= LEAST_HOLLOW:
            return self.hull
        if self.made.exact_hull is not None:
            return self.made.exact_hull
        try:
            return exact_hull(self.outlines, self.calibrated, tolerance_px=TOLERANCE_PX)
        except InputError:
            return self.hull  # noise keeps the views' cones apart

    @cached_property
    def casting_mesh(self) -> CastingMesh:
        """The casting hull with its edges."""
        return casting_mesh(self.casting_hull)

    @cached_property
    def convex_vertices(self) -> Array:
        """Vertices (v, 3) m of the polytope of the views' tangent planes, or the carved hull's where noise leaves no polytope."""
        if self.made.convex_vertices is not None:
            return self.made.convex_vertices
        try:
            return tangent_polytope(self.seen, self.poses, self.body.com_particle)
        except InputError:
            return self.hull.vertices

    @cached_property
    def cast_in_views(self) -> tuple[Array, ...]:
        """Outlines (v, 2) px that the body casts in the calibrated views, sharp: of the exact hull, or of the polytope."""
        if self.made.cast_in_views:
            return self.made.cast_in_views
        views = [(v.intrinsics, v.R_cam_particle, v.t_cam_particle) for v in self.calibrated]
        if not self.has_exact_hull:
            return tuple(cast_convex(self.convex_vertices, *view) for view in views)
        return tuple(cast_outline(self.casting_mesh, *view, finer=FINER_IN_VIEWS) for view in views)

    def bias_of_views(self, *, pairs: int, rng: np.random.Generator) -> DrawnBias:
        """Bias of the tangents of the views as they were seen, over ``pairs`` of draws; not made again where kept for the same draws."""
        cast = self.cast_in_views
        drawn = drawn_noise(cast, float(np.median(self.seen.noise_px)), self.seen.samples, pairs=pairs, rng=rng)
        kept, of = self.made.view_bias, noise_digest(drawn)
        return kept if kept is not None and kept.of == of else DrawnBias(bias_under(cast, drawn), of)

    def once(self, configuration: Configuration) -> MadeOnce:
        """All that recordings of this particle share, made here where it is not there yet."""
        exact = self.has_exact_hull
        for_views, _ = noise_streams(np.random.default_rng(configuration.seed))
        return MadeOnce(
            silhouettes=self.made.silhouettes,
            body=self.body,
            largest_moment_per_mass=self.largest_moment_per_mass,
            view_bias=self.bias_of_views(pairs=configuration.bias_pairs, rng=for_views),
            hull=self.hull,
            catalogue=self.catalogue,
            hollow=self.hollow,
            exact_hull=self.casting_hull if exact else None,
            convex_vertices=None if exact else self.convex_vertices,
            cast_in_views=self.cast_in_views,
        )

    @property
    def has_exact_hull(self) -> bool:
        """Whether the casting hull is an exact one."""
        return self.casting_hull is not self.hull

    @cached_property
    def largest_moment_per_mass(self) -> float:
        """Largest principal moment over mass (m²) of the uniform hull."""
        if self.made.largest_moment_per_mass is not None:
            return self.made.largest_moment_per_mass
        return largest_moment_per_mass(self.hull)

    @property
    def sample_m(self) -> Array:
        """Size (m) of one pixel at the particle in each view."""
        depth = (self.poses.R @ self.body.com_particle + self.poses.t)[:, 2]
        return np.asarray(depth / self.seen.focal_px[:, 0])


def view_poses(views: Sequence[CalibratedView]) -> PoseSet:
    """The views' poses, packed."""
    return PoseSet(np.stack([v.R_cam_particle for v in views]).astype(float), np.stack([v.t_cam_particle for v in views]).astype(float))


def particle_of(
    outlines: Sequence[Outline], views: Sequence[CalibratedView], configuration: Configuration, stored: Made | None = None
) -> Particle:
    """Check the views against one another, carve the hull and take its mass properties; ``stored``: what was made of such views before.

    Raises
    ------
    InputError
        Where fewer than three views have an outline and belong together.
    """
    arrays = None if stored is None else stored.load(digest_of(outlines, views, configuration))
    made = NOTHING_MADE if arrays is None else made_of_arrays(arrays, str(stored))
    present = [i for i, o in enumerate(outlines) if not o.empty]
    absent = tuple(i for i, o in enumerate(outlines) if o.empty)
    if len(present) < MINIMUM_VIEWS:
        raise InputError(
            f"calibrated views: expected at least {MINIMUM_VIEWS} with a usable outline, got {len(present)} of {len(outlines)}"
        )
    outlines, views = [outlines[i] for i in present], [views[i] for i in present]
    seen = made.silhouettes or silhouettes(outlines, [v.intrinsics for v in views])
    made = replace(made, silhouettes=seen)
    agreement = view_agreement(seen, view_poses(views), bounding_ball(outlines, views)[0], configuration.foreign_view_ratio)
    report = ViewReport(*agreement, np.array(present, dtype=np.int64), absent)
    kept = np.flatnonzero(~report.foreign).tolist()
    if len(kept) < MINIMUM_VIEWS:
        fault = view_fault(outlines, views)
        said = f"calibrated views: expected at least {MINIMUM_VIEWS} that agree with one another; {report.sentence} {fault}"
        raise InputError(said.rstrip())
    every = outlines, views
    outlines, views, seen = [outlines[i] for i in kept], [views[i] for i in kept], seen.take(kept)
    hull = made.hull or agreed_hull(outlines, views, resolution=configuration.hull_resolution)
    body = made.body or body_of(hull)
    among = disagreement(seen, view_poses(views), body.com_particle)
    return Particle(
        outlines=tuple(outlines),
        calibrated=tuple(views),
        seen=misplaced(seen, among.calibration_px),
        poses=view_poses(views),
        hull=hull,
        body=body,
        catalogue=made.catalogue or start_catalogue(hull.vertices, body.com_particle, directions=configuration.directions),
        report=report,
        disagreement=among,
        fault=view_fault(*every) if among.beyond_noise else "",
        made=made,
    )


def view_agreement(seen: Silhouettes, poses: PoseSet, centre: Array, ratio: float) -> tuple[Array, NDArray[np.bool_]]:
    """ETE of every view with every other: ``rms_px`` and ``foreign`` of :class:`ViewReport`, each (k,).

    A view is foreign when its median whitened error is ``ratio`` times that of the views without it.
    ``centre`` (3,) m, particle frame.
    """
    k = len(seen)
    foreign = np.zeros(k, dtype=np.bool_)
    errors = tangency_errors(seen, poses, seen, poses, pivot_particle=centre, weight=1.0 - np.eye(k))
    z = np.where(errors.valid[:, :, None], np.abs(errors.error[:, :, :2]) / np.sqrt(errors.variance[:, :, :2]), np.nan)
    plain = np.where(errors.valid[:, :, None], errors.error[:, :, :2] ** 2, np.nan)
    rms = np.sqrt(_nanmean(plain.reshape(k, -1)))
    for _ in range(k - MINIMUM_VIEWS):
        rest = np.flatnonzero(~foreign)
        typical = np.array([_nanmedian(z[i, rest]) for i in rest])
        worst = int(np.argmax(typical))
        if typical[worst] <= ratio * max(float(np.median(typical)), 0.5):
            break
        foreign[rest[worst]] = True
    return rms, foreign


def views_like(particle: Particle, first: Silhouettes, rng: np.random.Generator, pictures: Pictures | None = None) -> Views:
    """The views as the HSV camera would have seen them where it is the coarser one, otherwise as they are.

    ``pictures``: how its pictures showed outlines; without them outlines are made as noisy and as coarse as its own, but not pictured.
    """
    spacing = hsv_spacing(particle, first)
    noise = float(np.median(first.noise_px[first.samples > 0]))
    likeness = [Likeness(spacing_px=s, noise_px=noise * s) for s in spacing.tolist()]
    coarser = float(np.median(spacing)) > 1.0
    intrinsics = [v.intrinsics for v in particle.calibrated]
    shown = (partial(mean_seen, pictures=pictures.typical(1), draws=VIEW_DRAWS, rng=rng)) if pictures is not None else None
    if not coarser:
        return Views(particle.seen, particle.poses, particle.body.com_particle)
    seen = like_silhouettes(particle.outlines, intrinsics, likeness, rng, shown)
    return Views(misplaced(seen, particle.disagreement.calibration_px), particle.poses, particle.body.com_particle)


def hsv_spacing(particle: Particle, first: Silhouettes) -> Array:
    """Pixels (k,) of each view per sample of the HSV camera's outlines ``first``."""
    sizes = particle.sample_m
    perimeter = float(np.median(particle.seen.samples * sizes))
    return np.asarray(perimeter / float(np.median(first.samples[first.samples > 0])) / sizes)


def _nanmedian(values: Array) -> float:
    finite = values[np.isfinite(values)]
    return float(np.median(finite)) if finite.size else 0.0


def _nanmean(rows: Array) -> Array:
    return np.array([float(np.mean(r[np.isfinite(r)])) if np.isfinite(r).any() else 0.0 for r in rows])
