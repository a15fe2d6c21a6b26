"""Ten faults and ten harmless changes of the estimator, and fresh noise of the sequences: what the gate is tried on.

A fault replaces one function or constant for the length of a run, as a programming mistake would; observations stay as they are. A
harmless change is another setting, or another order of what is observed or worked on. ``kinds``: where a change acts and is run.
"""

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, nullcontext
from dataclasses import dataclass, replace
from typing import Any
from unittest import mock

import numpy as np

from datasets.observation import Observation
from datasets.trajectory import Trajectory
from datasets.vocabulary.outline import Outline
from estimator.diagnosis.selection import search
from estimator.effects.catalogue.dynamics.quadratic_drag import QuadraticDrag
from estimator.measurements.trajectories import registering
from estimator.outlines import sightings
from estimator.outlines.result import OutlineTrack
from estimator.reports import impact_reporting
from estimator.surface import mass
from synth import streams
from synth.rendering import shots
from tumble.challenge import field_making, field_silhouettes
from tumble.challenge import registering as registering_campaigns

EVEN_ODDS = 20.0
"""Effects that a wrong prior expects to be missing of a campaign: about as many as there are."""
GROWTH_PX = 0.01
"""By how much a sinking threshold widens the outlines from each frame to the next."""
Patch = Callable[[], Any]


@dataclass(frozen=True)
class Change:
    """One change: where it acts, what is replaced while it lasts, settings, what is observed, over how many processes it is run."""

    name: str
    kinds: tuple[str, ...]
    patched: Patch = nullcontext
    configuration: tuple[tuple[str, Any], ...] = ()
    observed: Callable[[Observation], Observation] = lambda observation: observation
    processes: int = 1


@contextmanager
def _replaced(owner: Any, name: str, made: Callable[[Any], Any]) -> Iterator[None]:
    """``owner.name`` replaced by what is ``made`` of it."""
    with mock.patch.object(owner, name, made(getattr(owner, name))):
        yield


def _outlines(of: Callable[[Outline], Outline]) -> Patch:
    """Outlines of high-speed pictures as the estimator gets them."""

    def made(original: Any) -> Any:
        def changed(*arguments: Any, **settings: Any) -> OutlineTrack:
            track = original(*arguments, **settings)
            return OutlineTrack(tuple(replace(frame, outline=of(frame.outline)) for frame in track.frames))

        return changed

    return lambda: _replaced(sightings, "outlines_of", made)


def _sinking_threshold() -> Any:
    def made(original: Any) -> Any:
        def sinking(*arguments: Any, **settings: Any) -> OutlineTrack:
            track = original(*arguments, **settings)
            return OutlineTrack(tuple(replace(f, outline=_widened(f.outline, GROWTH_PX * k)) for k, f in enumerate(track.frames)))

        return sinking

    return _replaced(sightings, "outlines_of", made)


def _widened(outline: Outline, by_px: float) -> Outline:
    if not len(outline.points_px):
        return outline
    from_middle = outline.points_px - outline.points_px.mean(axis=0)
    return Outline(outline.points_px + by_px * from_middle / np.linalg.norm(from_middle, axis=1, keepdims=True))


def _opposite_distortion(observation: Observation) -> Observation:
    """The lens read with the opposite sign, in the search and in the last fit alike."""
    lenses = [replace(each.intrinsics, distortion=tuple(-k for k in each.intrinsics.distortion)) for each in observation.cameras]
    return replace(observation, cameras=tuple(replace(c, intrinsics=lens) for c, lens in zip(observation.cameras, lenses, strict=True)))


def _wrong_axes() -> Any:
    def made(original: Any) -> Any:
        def swapped(surface: Any) -> tuple[float, Any, Any]:
            volume, centre, second = original(surface)
            return volume, centre, second[np.ix_([1, 0, 2], [1, 0, 2])]

        return swapped

    return _replaced(mass, "_integrals", made)


def _halved_covariance() -> Any:
    def made(original: Any) -> Any:
        def halved(*arguments: Any, **settings: Any) -> Any:
            velocity = original(*arguments, **settings)
            return replace(velocity, covariance=0.5 * velocity.covariance)

        return halved

    return _replaced(impact_reporting, "told_velocity", made)


def _late_impacts() -> Any:
    def made(original: Any) -> Any:
        def late(*arguments: Any) -> Any:
            impact = original(*arguments)
            return replace(impact, time_s=impact.time_s + 0.5 / 4000.0)

        return late

    return _replaced(impact_reporting, "_impact", made)


def _wrong_prior() -> Any:
    return _replaced(search, "EXPECTED", lambda _: EVEN_ODDS)


def _drag_of_power_one() -> Any:
    return _replaced(QuadraticDrag, "acceleration", lambda _: lambda _self, theta, moment, _setting: -theta * moment.through_air)


def _trajectories(of: Callable[[Trajectory], Trajectory]) -> Patch:
    return lambda: _replaced(registering_campaigns, "read_trajectory", lambda original: lambda *arguments: of(original(*arguments)))


def _light_gravity() -> Any:
    def made(original: Any) -> Any:
        def light(trajectory: Trajectory) -> Any:
            around = replace(trajectory.surroundings, gravity_world=trajectory.surroundings.gravity_world * 9.7 / 9.81)
            return original(replace(trajectory, surroundings=around))

        return light

    return _replaced(registering, "task_of", made)


def _rolled(outline: Outline) -> Outline:
    return Outline(np.roll(outline.points_px, len(outline.points_px) // 3, axis=0))


def _rounded(trajectory: Trajectory) -> Trajectory:
    return replace(trajectory, x_world=trajectory.x_world * (1.0 + 1e-12))


def _turned_sign(trajectory: Trajectory) -> Trajectory:
    q = trajectory.q_world_tracked
    return trajectory if q is None else replace(trajectory, q_world_tracked=-q)


def _reversed_campaign() -> Any:
    return _replaced(registering_campaigns, "trajectories_in", lambda original: lambda folder: original(folder)[::-1])


def _reversed_views(observation: Observation) -> Observation:
    recording: Any = tuple(observation.view_recording)[::-1]
    return replace(observation, views=observation.views[::-1], view_recording=recording)


FAULTS = (
    Change("lens distortion with the opposite sign", ("flights",), observed=_opposite_distortion),
    Change("pixel centres at half a pixel", ("pictures",), _outlines(lambda o: Outline(o.points_px + 0.5) if len(o.points_px) else o)),
    Change("first two axes of inertia swapped", ("flights",), _wrong_axes),
    Change("covariance halved", ("impacts",), _halved_covariance),
    Change("impacts told half a frame late", ("impacts",), _late_impacts),
    Change("threshold sinks: outlines grow by 0.01 px a frame", ("pictures",), _sinking_threshold),
    Change("prior of effects: even odds", ("campaigns",), _wrong_prior),
    Change("quadratic drag with power one", ("campaigns",), _drag_of_power_one),
    Change("every second sample of outlines dropped", ("flights",), _outlines(lambda o: Outline(o.points_px[::2]))),
    Change("gravity of 9.7 m/s2", ("campaigns",), _light_gravity),
)
HARMLESS = (
    Change("another seed", ("flights", "impacts"), configuration=(("seed", 1),)),
    Change("more pose starts", ("flights",), configuration=(("pose_starts", 96),)),
    Change("hull of 72 instead of 64 voxels", ("pictures",), configuration=(("hull_resolution", 72),)),
    Change("views in another order", ("flights",), observed=_reversed_views),
    Change("more viewing directions in the catalogue", ("pictures",), configuration=(("directions", 900),)),
    Change("outlines that begin at another sample", ("impacts",), _outlines(_rolled)),
    Change("positions rounded at 1e-12", ("campaigns",), _trajectories(_rounded)),
    Change("quaternions with the opposite sign", ("campaigns",), _trajectories(_turned_sign)),
    Change("flights of campaigns in another order", ("campaigns",), _reversed_campaign),
    Change("two processes", ("campaigns",), processes=2),
)


@contextmanager
def fresh_noise(number: int) -> Iterator[None]:
    """The same sequences with other noise: of outlines, of sensors and of trajectories."""

    def of_streams(original: Any) -> Any:
        def drawn(seed: int, index: int, *, same_particle: bool = False) -> streams.Streams:
            own, other = (original(each, index, same_particle=same_particle) for each in (seed, seed + 1_000_003 * number))
            return replace(own, hsv_noise=other.hsv_noise, rig_noise=other.rig_noise, rendering=other.rendering)

        return drawn

    def of_trajectories(original: Any) -> Any:
        return lambda case, flight: original(replace(case, seed=case.seed + 1_000_003 * number), flight)

    def of_outlines(original: Any) -> Any:
        return lambda *given: original(*given[:-1], np.random.default_rng([number, int(given[-1].integers(2**31))]))

    with ExitStack() as stack:
        for module in (streams, shots):
            stack.enter_context(_replaced(module, "streams", of_streams))
        stack.enter_context(_replaced(field_making, "measured", of_trajectories))
        stack.enter_context(_replaced(field_silhouettes, "messy", of_outlines))
        yield
