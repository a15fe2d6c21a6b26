"""A most probable model whose values no such thing has: it explains nothing; what was stated is looked at first."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from datasets.observation import Observation
from datasets.trajectory import Trajectory
from datasets.vocabulary.effects import EFFECTS, in_words, whose
from estimator.fitting.campaigns.considered import Uncertain
from estimator.measurements.trajectories.free_flights import share_of_gravity
from estimator.reports.campaign_reporting import EffectValue
from tumble.numbers import compact
from tumble.reports.verdict import Verdict

Array = NDArray[np.float64]
GRAVITY_OFF_MS2 = EFFECTS["gravity"].parameters[0].plausible[1]
"""How far off a stated gravity is expected to be at most (m/s²)."""
CLEAR = 3.0
"""Standard deviations from which a tilt is told."""


def unbelieved(values: Sequence[EffectValue]) -> tuple[str, ...]:
    """Effects of which most sequences' own values lie outside of what is plausible, in words.

    A value that sequences share is bounded by the evidence; own values are held by their scatter alone.
    """
    own: dict[tuple[str, str], list[bool]] = {}
    for value in values:
        if (key := whose(value.effect)[0]) in EFFECTS and EFFECTS[key].scope.own:
            own.setdefault((value.effect, value.parameter.name), []).append(value.plausible)
    return tuple(dict.fromkeys(in_words(effect) for (effect, _), plausible in own.items() if 2 * sum(plausible) < len(plausible)))


def believed(verdict: Verdict, odd: Sequence[str], observations: Mapping[str, Observation | Trajectory]) -> Verdict:
    """The verdict, or that no plausible model was found, where effects are ``odd``: :func:`unbelieved`."""
    if not odd:
        return verdict
    sentence = (
        f"No model of plausible values explains the campaign: in the most probable one {', '.join(odd)} is larger than what the catalogue "
        "expects. Check first what was stated: gravity, units, times."
    )
    remarks = tuple(dict.fromkeys((*fall_words(observations), *verdict.remarks)))
    return replace(verdict, kind="judged", sentence=sentence, remarks=remarks, add=())


def fall_words(observations: Mapping[str, Observation | Trajectory]) -> Iterator[str]:
    """How tracked positions fall, whatever the model."""
    told = [each for each in observations.values() if isinstance(each, Trajectory)]
    shares = [share_of_gravity(each.times_s, each.x_world, each.surroundings.gravity_world) for each in told]
    known = [share for share in shares if share is not None]
    if known:
        share, size = float(np.median(known)), float(np.median([np.linalg.norm(t.surroundings.gravity_world) for t in told]))
        air = " Lift, drag or wind make that, too." if abs(share - 1.0) * size > GRAVITY_OFF_MS2 else ""
        yield f"Positions fall with {share:.3g} times the stated gravity (along it, median of {len(known)} sequences).{air}"


def gravity_words(observations: Mapping[str, Observation | Trajectory], of: Uncertain) -> tuple[str, ...]:
    """How far a gravity that a fit has changed is off the stated direction, where it is: then a frame or a camera is not level."""
    if "gravity" not in of.fit.model.keys:
        return ()
    observation, columns = next(iter(observations.values())), of.fit.model.layout.columns(["gravity"])
    stated = np.asarray(observation.surroundings.gravity_world if isinstance(observation, Trajectory) else observation.gravity_world)
    size = float(np.linalg.norm(stated))
    if size == 0.0:
        return ()
    across = np.eye(3) - np.outer(stated, stated) / size**2
    off = across @ of.fit.state.theta[0][of.fit.model.slices[of.fit.model.keys.index("gravity")]]
    length, along = float(np.linalg.norm(off)), off / max(float(np.linalg.norm(off)), np.finfo(np.float64).tiny)
    sigma = float(np.sqrt(along @ of.of_values.of(0, columns) @ along))
    if length <= CLEAR * sigma or length == 0.0:
        return ()
    angle, error = np.degrees([length / size, sigma / size])
    return (
        f"The fitted gravity points {compact(float(angle), float(error))} degrees off the stated direction: a frame or a camera that is "
        "not level by as much shows the same.",
    )


def ball_words(observations: Mapping[str, Observation | Trajectory], *, stated: bool) -> Iterator[str]:
    """That a body whose turning was measured counts as a ball, where nobody has ``stated`` its moments of inertia."""
    if stated:
        return
    read = [each for each in observations.values() if isinstance(each, Trajectory)]
    turning = [each for each in read if each.gyro is not None or each.q_world_tracked is not None]
    if turning and all(np.ptp(each.surroundings.body.inertia_ratios) == 0.0 for each in turning):
        yield (
            "The body counts as a ball, of equal moments of inertia, whose spin never changes by itself: if it is none, state "
            "inertia_ratios in trajectory.toml, or --mesh."
        )


def checks(observations: Mapping[str, Observation | Trajectory], *, shape_stated: bool) -> Iterator[str]:
    """What to check where a model is far from what was measured; ``shape_stated``: whether the moments of inertia are."""
    yield from ball_words(observations, stated=shape_stated)
    yield "Check that nothing held or touched the body in any row or frame, and what is stated of it."
    read = [each for each in observations.values() if isinstance(each, Trajectory)]
    if any(sigma is None for each in read for sigma in _noise_of(each)):
        yield "State the noise (sigma_...): of noise that is not stated, what no smooth curve in time follows counts as noise."


def _noise_of(trajectory: Trajectory) -> Iterator[Array | None]:
    """Standard deviations of what was measured."""
    each = trajectory
    measured = ((each.x_world, each.sigma_x), (each.q_world_tracked, each.sigma_theta), (each.omega_world, each.sigma_omega))
    for values, sigma in (*measured, (each.gyro, each.sigma_gyro)):
        if values is not None and np.isfinite(values).any():
            yield sigma
