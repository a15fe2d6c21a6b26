"""The last fit with the surface as a nuisance: every outline sample of every picture of every recording, and of every view.

Unknown are the surface's corners and whatever else the recordings have: a motion its parameters, the flights of a campaign those of their
model. Samples of views bear on the surface alone, those of frames on both; corners are held by what is believed of surfaces
(:mod:`estimator.surface.evenness`), the body's mass properties by those of the surface.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Generic, Protocol, Self, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from datasets.vocabulary.body import Body
from estimator.data.fit_task import Prior, Sightings
from estimator.fitting.adequacy import Misfit, misfit_of
from estimator.fitting.levenberg_marquardt import NormalEquations
from estimator.fitting.problem import Fact, M, M_co, prior_equations, with_facts
from estimator.fitting.stable_inverse import NothingSeen, scaled_inverse
from estimator.fitting.tasks import HOLLOW_MOMENTS, HOLLOW_PRODUCTS
from estimator.motion.flight import COM, INERTIA, OFFSET
from estimator.motion.slow_errors import slow_errors
from estimator.particle.particle import Particle
from estimator.surface.arrow import Eliminated, Noise, Whole, eliminated, weighed, with_columns
from estimator.surface.evenness import Believed
from estimator.surface.frame_samples import moved_by, samples_of_frames, seen_under
from estimator.surface.mass import N_MASS, mass_response
from estimator.surface.samples import MovedViews, Samples, views_of
from estimator.surface.shape import ALIGNED, SHARP, Shape, believed_in, own_noise_px
from estimator.surface.star_surface import Surface, star_surface
from estimator.surface.surface_scale import scaled_step

Array = NDArray[np.float64]
Index = NDArray[np.int64]
R = TypeVar("R", bound="Recorded")
MOST_ROUNDS = 20
"""With the last scale of bends, after which a fit that has not settled is given up: fits of trial runs settled within one to six, those
that began with it within thirteen."""
SETTLED, TURNED = 0.3, 0.6
"""Share of the standard deviations that ends the fit. Samples that change the edge they meet throw it about by as much and more, so that
every step that turns back shortens all that follow by the second number: their mean is what is looked for."""
HELD = 1e-4
"""Standard deviation of what is held: of an offset in px, of an effect's parameter in its steps. One that is free while the mesh still cuts
edges off takes that up and draws the surface along: a rendered cut stone ended at -0.033 px, whose samples lie at -0.002 px from its true
outlines. Beside a leak of light and defocus that were free a surface ran away."""
SURFACE_OFF = 3.0
"""How many times further than its covariance says the surface moves a motion: edges are drawn by noise, too, which no covariance about the
end tells. Over 24 trial flights of 20 to 40 frames with 18 to 60 views it was 3.1 (smooth 2.5, stones 3.0, cut 4.3, jagged 2.4). Frames of
one flight show little of it: their own scale of the surface is about one (notebook 66)."""
COM_SHARE, MOMENTS, PRODUCTS = 0.0006, 0.005, 0.002
"""Standard deviations of what a uniform surface's centre of mass (over its extent) and inertia (relative) are off by. In trial runs with 60
views five scanned bodies were within 0.0007, 0.007 and 0.003; one with a hollow was off by 0.003, 0.009 and 0.005."""
HOLLOW_COM = 0.02
"""The same of the centre of mass, over the extent, were all of the outlines' convex hulls hollow: what no outline shows goes with what some
do. Three bodies of the challenge with hollow shares of 0.001, 0.03 and 0.09 were off by 0.0004, 0.0009 and 0.0027."""


class Recorded(Protocol):
    """One recording of the particle under what is thought of its motion."""

    @property
    def own_px(self) -> float:
        """Noise that its outlines show by themselves."""

    @property
    def place(self) -> Index:
        """Where its parameters (c,) lie among all."""

    @property
    def mass(self) -> Array:
        """Mass properties (8,) of its body as deviations from the nominal one; all recordings share them."""

    def samples(self, surface: Surface) -> Samples:
        """Its samples beside the outlines that a surface casts, with derivatives by its parameters (c,)."""

    def moved(self, step: Array) -> Self:
        """The same after a ``step`` (c,) of its parameters."""


@dataclass(frozen=True)
class Known:
    """What is known of the p parameters of all recordings beside their samples.

    ``body``: the nominal one, whose mass properties lie at ``mass`` (8,); ``information`` (p, p) and ``pull`` (p,): of priors and facts,
    and their gradient. ``offset`` (k,): where offsets of outlines lie, and whatever else moves these in pictures, that are held within
    standard deviations ``within`` (k,) until the mesh follows the edges.
    """

    body: Body
    mass: Index
    information: Array
    pull: Array
    offset: Index = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    within: Array | float = HELD

    @property
    def held(self) -> "Known":
        """With the offsets where they are."""
        information = self.information.copy()
        information[self.offset, self.offset] += 1.0 / np.square(self.within)
        return replace(self, information=information)

    @property
    def size(self) -> int:
        """How many parameters there are."""
        return len(self.pull)

    def beside(self, views: MovedViews) -> "Known":
        """With the moves of views after all others."""
        information = block_diag(self.information, views.information)
        return replace(self, information=information, pull=np.concatenate([self.pull, views.information @ views.unknown]))


@dataclass(frozen=True)
class Joined(Generic[R]):
    """The ``recorded`` at the end with the ``covariance`` (p, p) of all their parameters, and the ``surface``.

    ``settled``: whether the steps became small. ``noise_px``: effective noise that samples of views and of every recording were found to
    have, ``outline_noise_px`` what their outlines show by themselves; ``last``: the equations that it ended with; ``views``: with their
    moves.
    """

    recorded: tuple[R, ...]
    covariance: Array
    surface: Surface
    noise_px: tuple[float, ...]
    outline_noise_px: tuple[float, ...]
    settled: bool
    last: "Last"
    views: MovedViews


@dataclass(frozen=True)
class Last:
    """The last equations ``fitted``, the ``whole`` rows of mass properties in them, what was ``known``, the ``step`` (p,) they ask for."""

    fitted: Eliminated
    whole: Whole
    known: Known
    step: Array


def joined(
    particle: Particle,
    shape: Shape,
    recorded: Sequence[R],
    known: Callable[[Sequence[R]], Known],
    *,
    huber: float,
    seed: int,
    first: int = SHARP,
    end: int = SHARP + MOST_ROUNDS,
    shifted: int = SHARP + MOST_ROUNDS,
    views_px: float = 0.0,
) -> Joined[R]:
    """Surface and motions by steps that take all along, from a ``shape`` and what the recordings begin with.

    ``known`` says what is known where the recordings are. ``huber``: standard deviations beyond which a sample's influence stays constant;
    ``seed`` of the random signs; ``first``: the round of :func:`estimator.surface.shape.scale_in` to begin with, 0 for a hull, and ``end``:
    the one before which to end;
    ``shifted``: from which on views are free to be moved, by as much as they show; ``views_px``: by how much their
    outlines are drawn too large.
    """
    recorded, surface, rng, size = list(recorded), shape.surface, np.random.default_rng(seed), known(recorded).size
    views = views_of(particle, views_px)
    own = own_noise_px(particle.seen), *(each.own_px for each in recorded)
    noise = tuple(Noise.white(px) for px in (shape.noise_px, *own[1:]))
    settled, gain, last = False, 1.0, np.zeros(size)
    for number in range(first, end):
        about, believe, views = known(recorded), believed_in(surface, number), replace(views, free=number >= shifted)
        about = (about if number >= SHARP else about.held).beside(views)
        fitted, whole = _linearised(particle, (surface, believe), (views, *recorded), about, noise=noise, huber=huber)
        covariance = scaled_inverse(fitted.H + about.information)
        step = -covariance @ (fitted.g + about.pull)
        sizes = step[:size] / np.sqrt(np.maximum(np.diag(covariance)[:size], 1e-300))
        gain *= TURNED if last @ sizes < 0.0 and number > SHARP else 1.0
        ended = Last(fitted, whole, about, step)
        noise, last = fitted.noise(step, rng) if number >= ALIGNED else noise, sizes
        surface = surface.moved(fitted.corners(gain * step))
        views = views.moved(gain * step[size:], np.diag(covariance)[size:])
        recorded = [each.moved(gain * step[each.place]) for each in recorded]
        settled = bool(gain * np.max(np.abs(sizes)) < SETTLED)
        if settled and number >= SHARP:
            break
    noise_px = tuple(each.px for each in noise)
    return Joined(tuple(recorded), covariance[:size, :size], surface, noise_px, own, settled, ended, views)


def free_from(particle: Particle) -> int:
    """The round from which on views are free to move: the first, where they disagree.

    Samples that are off alike all along an outline count as few, and would leave the views where they are.
    """
    return 0 if particle.disagreement.beyond_noise else ALIGNED


def _linearised(
    particle: Particle,
    surfaced: tuple[Surface, Believed],
    shown: tuple[MovedViews, *tuple[R, ...]],
    about: Known,
    *,
    noise: Sequence[Noise],
    huber: float,
) -> tuple[Eliminated, Whole]:
    """The equations without the surface, and the rows of mass properties in them; noise of views first, then of every recording.

    ``surfaced``: the surface and what is believed of it; ``shown``: the views, then the recordings.
    """
    (surface, believe), (views, *recorded) = surfaced, shown
    shifts = np.arange(about.size - len(views.unknown), about.size)
    samples, place = [each.samples(surface) for each in shown], (shifts, *(each.place for each in recorded))
    groups = [weighed(each, believe, px, huber, where) for each, px, where in zip(samples, noise, place, strict=True)]
    whole = _mass_rows(surface, recorded[0].mass, about, usual_deviation(particle))
    return eliminated(groups, believe, whole), whole


def usual_deviation(particle: Particle) -> Array:
    """Standard deviations (8,) that a body's mass properties have from those of its surface: more where its outlines show hollows."""
    usual = np.array([COM_SHARE * particle.extent_m] * 3 + [MOMENTS] * 2 + [PRODUCTS] * 3)
    hollow = np.array([HOLLOW_COM * particle.extent_m] * 3 + [HOLLOW_MOMENTS] * 2 + [HOLLOW_PRODUCTS] * 3)
    return np.hypot(usual, particle.hollow * hollow)


def _mass_rows(surface: Surface, now: Array, about: Known, deviation: Array) -> Whole:
    """The recordings' mass properties ``now`` (8,) are those of the surface within a ``deviation`` (8,)."""
    mass, by_motion = mass_response(surface, about.body), np.zeros((N_MASS, about.size))
    by_motion[:, about.mass] = np.diag(1.0 / deviation)
    return Whole((now - mass.values) / deviation, by_motion, mass.by_corner / deviation)


@dataclass(frozen=True)
class RecordedMotion(Generic[M_co]):
    """A motion of p parameters and the sightings that recorded it."""

    sightings: Sightings
    motion: M_co

    @property
    def own_px(self) -> float:
        """In the median."""
        return own_noise_px(self.sightings.silhouettes)

    @property
    def place(self) -> Index:
        """All there are (p,)."""
        return np.arange(self.motion.layout.size)

    @property
    def mass(self) -> Array:
        """The first flight's (8,)."""
        return np.concatenate([self.motion.first.com, self.motion.first.inertia])

    def samples(self, surface: Surface) -> Samples:
        """Those of the frames."""
        return samples_of_frames(surface, self.sightings, self.motion)

    def moved(self, step: Array) -> "RecordedMotion[M_co]":
        """After a ``step`` (p,) of the motion's parameters."""
        return replace(self, motion=self.motion.moved(step))


@dataclass(frozen=True)
class JointFit(Generic[M_co]):
    """``motion`` with its ``covariance`` (p, p), its ``bound`` (p, p), were the surface known, and the ``surface``.

    ``settled``: whether the steps became small.

    ``noise_px``: effective noise that samples of views and of frames were found to have, ``outline_noise_px`` what their outlines show by
    themselves; ``scale``: how much further from what views and prior prefer the surface is than they say. ``sightings`` that were fitted;
    ``last``: the equations that it ended with; ``views`` with their moves.
    """

    motion: M_co
    covariance: Array
    bound: Array
    surface: Surface
    noise_px: tuple[float, ...]
    outline_noise_px: tuple[float, ...]
    settled: bool
    scale: float
    sightings: Sightings
    last: Last
    views: MovedViews


def joint_fit(
    particle: Particle, sightings: Sightings, motion: M, known: Callable[[M], NormalEquations], *, huber: float, seed: int
) -> JointFit[M]:
    """Surface and one motion, from a motion that the tangents gave and the hull of the views and of the frames under it.

    ``known``: what priors and facts say of the motion's parameters. ``huber``: standard deviations beyond which a sample's influence stays
    constant; ``seed`` of the random signs.
    """

    def about(recorded: Sequence[RecordedMotion[M]]) -> Known:
        motion = recorded[0].motion
        told = known(motion)
        return Known(motion.first.body, np.r_[COM, INERTIA], told.H, told.g, np.r_[OFFSET])

    shape = Shape(star_surface(particle, seen_under(motion, sightings)), own_noise_px(particle.seen))
    begun = motion.with_first(replace(motion.first, offset_px=0.0))
    start = [RecordedMotion(sightings.take(rows), begun) for rows in by_camera(sightings)]
    found = joined(particle, shape, start, about, huber=huber, seed=seed, first=0, shifted=free_from(particle))
    last = found.last
    end = scaled_step(last.fitted, last.whole, last.known.information, last.known.pull)
    p = len(end.step)
    motion = found.recorded[0].motion.moved(end.step - last.step[:p])
    bound = scaled_inverse((last.known.information + last.fitted.of_motions(last.whole))[:p, :p])
    return JointFit(
        motion,
        bound + SURFACE_OFF**2 * (end.covariance - bound),
        bound,
        found.surface,
        found.noise_px,
        found.outline_noise_px,
        found.settled,
        end.scale,
        sightings,
        last,
        found.views,
    )


def by_camera(sightings: Sightings) -> list[Index]:
    """The rows of each camera that has some, whose samples have a noise of their own; sightings are in the order of cameras."""
    return [np.flatnonzero(sightings.camera == camera) for camera in np.unique(sightings.camera)]


def slow_misfit(joint: JointFit[M]) -> Misfit | None:
    """Whether slow errors of the poses are left where the fit has ended, the surface free to answer to them.

    ``None`` where the sightings do not determine them. Of 36 made flights of 100 frames in which nothing
    is missing ``p`` was below 0.1 three times and above 0.9 seven times (trial run).
    """
    slow, p, last = slow_errors(joint.sightings.times_s, joint.motion), joint.motion.layout.size, joint.last
    if not slow.segments:
        return None
    frames = last.fitted.groups[1:]
    rows = by_camera(joint.sightings)
    columns = [
        moved_by(each.pictures.by_pose, each.pictures.starts, slow.basis[of])
        for each, of in zip(frames, rows, strict=True)
        if each.pictures
    ]
    fitted, whole = with_columns(last.fitted, last.whole, columns, p)
    k = slow.basis.shape[2]
    try:
        end = scaled_step(fitted, whole, _with_unknown(last.known.information, p, k), np.insert(last.known.pull, np.full(k, p), 0.0))
    except NothingSeen:
        return None
    of_frames = zip(frames, joint.outline_noise_px[1:], strict=True)
    left = np.concatenate([group.noise.px / own * group.r for group, own in of_frames])
    found = end.step[p : p + k], end.covariance[p : p + k, p : p + k]
    return misfit_of(found, end.covariance, slow, joint.motion.layout, noise_ratio=float(np.sqrt(np.mean(left**2))))


def _with_unknown(information: Array, at: int, k: int) -> Array:
    """An ``information`` (p, p) with k parameters of which nothing is known, from place ``at`` on."""
    none = np.full(k, at)
    return np.asarray(np.insert(np.insert(information, none, 0.0, axis=0), none, 0.0, axis=1))


def beside_the_surface(prior: Prior, facts: Sequence[Fact[M]] = ()) -> Callable[[M], NormalEquations]:
    """What is known of a motion whose mass properties the surface says: the prior of the outlines' offset, those of impacts, and facts."""

    def known(motion: M) -> NormalEquations:
        layout, values = motion.layout.held({"offset": prior.known["offset"]}), motion.values
        return with_facts(prior_equations(layout.precision, values), facts, motion)

    return known
