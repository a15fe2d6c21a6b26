"""Sentences on values that every sequence has for itself: how far they scatter, which stand out, which stated spins they contradict."""

from collections.abc import Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.effects import begins
from estimator.diagnosis.diagnose import ALPHA
from estimator.diagnosis.explain import Explanation
from estimator.effects.instrument.slow_errors import SlowErrors
from estimator.effects.link import EffectModel
from estimator.fitting.campaigns.wald import p_of_zero
from estimator.geometry.robust_scale import robust_sigma
from estimator.measurements.trajectories.misread_spins import Placed, lift_of
from estimator.motion.flight import LAYOUT
from estimator.reports.campaign_reporting import owner_name

Array = NDArray[np.float64]
MOST_TOLD = 12
SMALLEST = 1e-6
"""Share of the largest value below which values of every sequence count as equal."""
MOST_WANDER = 3
"""Sequences that are named of those whose positions wander. What is told, no unknown."""
FAR = 4.0
"""Scatters (standard deviations by the median) from which on the value of one sequence stands out. By judgement."""
SURE = 2.0
"""Standard deviations from which on stated spins tell how much spin lifts."""
ASIDE_DEG = 45.0
"""Angle between the lift that a flight shows and that by its stated spin from which on they contradict: a law of lift may be wrong in size,
but no other direction. By judgement."""


def scattered(explanation: Explanation) -> tuple[str, ...]:
    """How far the values scatter that every sequence has for itself, with the sequences that stand out."""
    told = []
    campaign = explanation.campaign
    for effect, part in zip(explanation.fit.model.effects, explanation.fit.model.slices, strict=True):
        if effect.entry.scope.own and effect.tails and effect.held is not None:
            owners = sorted(set(campaign.sharing(effect.entry.scope)))
            if effect.noise:
                told += _misread(explanation, effect, part) if effect.lifts else []
            elif len(owners) > 1:  # one value scatters about nothing
                name = partial(owner_name, campaign, effect.entry.scope)
                told += _scatter(effect, np.array([explanation.fit.state.theta[i][part] for i in owners]), [name(i) for i in owners])
        elif isinstance(effect, SlowErrors):
            told.append(_wandering(explanation, effect, part))
    return tuple(told)


def _wandering(explanation: Explanation, slow: SlowErrors, part: slice) -> str:
    """By how much positions wander within sequences, and where most; ``part``: the place of ``slow`` errors among the parameters."""
    both = zip(explanation.campaign.sequences, explanation.fit.state.theta, strict=True)
    off = [(task.times_s, slow.tracked(theta[part], np.zeros((len(task.times_s), 3)), task.setting)) for task, theta in both]
    lines = [np.vander(t, 2) @ np.polyfit(t, each, 1) for t, each in off]
    mm = 1e3 * np.array([np.sqrt(np.mean((each - line) ** 2, axis=0)) for (_, each), line in zip(off, lines, strict=True)])
    x, y, z = np.sqrt(np.mean(mm**2, axis=0))
    size = np.linalg.norm(mm, axis=1)
    most = [explanation.campaign.sequences[i].name for i in np.argsort(-size)[:MOST_WANDER]]
    return (
        f"Positions wander within each sequence, differently in each, by {x:.2g}, {y:.2g} and {z:.2g} mm along x, y and z (RMS about a "
        "straight line): counted as slow errors of the tracker, which are in the error bars. "
        f"Most in {_some(most)}, up to {size.max():.2g} mm."
    )


def _scatter(effect: EffectModel, values: Array, names: Sequence[str]) -> list[str]:
    """How far ``values`` (n, q) of sequences scatter, and the ``names`` (n,) of those that stand out."""
    size = np.maximum(robust_sigma(values), SMALLEST * np.abs(values).max())
    there = np.ptp(values, axis=0) > 0.0  # along an axis that nobody measured all are alike
    if not there.any():
        return []
    each = ", ".join(f"{p.name} {s:.2g} {p.unit}" for p, s, some in zip(effect.entry.parameters, size, there, strict=True) if some)
    far = np.sum((values / np.maximum(size, np.finfo(np.float64).tiny)) ** 2, axis=1) > FAR**2 * len(size)
    out_of = [name for name, out in zip(names, far, strict=True) if out]
    out = f"; {len(out_of)} stand out: {_some(out_of)}" if out_of else ""
    return [f"{begins(effect.entry.title)} differs from sequence to sequence, cause unknown: {each}{out}."]


def _misread(explanation: Explanation, effect: EffectModel, part: slice) -> list[str]:
    """Which flights do not curve as the spin that is stated of them makes them, and not by chance.

    ``effect`` is the lift of what stated spins are wrong by, ``part`` its place among the parameters. Where the lift by stated spins may
    as well be none, that is told: it has no side.
    """
    model, tasks = explanation.fit.model, explanation.campaign.sequences
    by_spin = [(e, p) for e, p in zip(model.effects, model.slices, strict=True) if e.lifts and not e.of_unmeasured_spin]
    if not by_spin:  # a plug-in's force goes by the spin, and is no lift that is known as one
        return []
    count, believed = len(tasks), [number for number, task in enumerate(tasks) if not task.misread]
    if max(_times_sigma(explanation, number, by_spin) for number in believed) < SURE:
        return [f"How much spin lifts, the stated spins of these {count} flights do not tell: every flight has a lift of its own."]
    aside = {number for number in believed if _to_another_side(explanation, number, by_spin, (effect, part))}
    names = [task.name for number, task in enumerate(tasks) if task.misread or number in aside]
    if not names:
        return []
    return [
        f"Stated spins contradict flights, which curve otherwise, in {len(names)} of {count}: {_some(names)}. "
        "Check axis, sign, and of which flight each was read; the lift is fitted there, whatever was read."
    ]


def _to_another_side(explanation: Explanation, number: int, by_spin: Sequence[Placed], beside: Placed) -> bool:
    """Whether flight ``number`` curves to another side than lift ``by_spin`` says, and not by chance; ``beside``: what that lacks."""
    theta, part = explanation.fit.state.theta[number], beside[1]
    lift = _lift(explanation, number, by_spin, theta)
    shown = lift + _lift(explanation, number, [beside], theta)
    aside = lift @ shown < np.cos(np.radians(ASIDE_DEG)) * np.linalg.norm(lift) * np.linalg.norm(shown)
    covariance = explanation.covariance.of(number, LAYOUT.size + np.arange(part.start, part.stop))
    return bool(aside) and p_of_zero(theta[part], covariance) < ALPHA / len(explanation.campaign.sequences)


def _times_sigma(explanation: Explanation, number: int, by_spin: Sequence[Placed]) -> float:
    """Size of the lift that the stated spin makes in a flight, in its standard deviations by the laws' parameters."""
    theta, at = explanation.fit.state.theta[number], np.concatenate([np.arange(part.start, part.stop) for _, part in by_spin])
    steps = [parameter.step for effect, _ in by_spin for parameter in effect.entry.parameters]
    slopes = []
    for place, step in zip(at, steps, strict=True):
        off = np.where(np.arange(len(theta)) == place, step, 0.0)
        up, down = (_lift(explanation, number, by_spin, theta + sign * off) for sign in (1.0, -1.0))
        slopes.append((up - down) / (2.0 * step))
    lift = _lift(explanation, number, by_spin, theta)
    size = float(np.linalg.norm(lift))
    along = np.array(slopes) @ lift / max(size, np.finfo(np.float64).tiny)
    sigma = float(np.sqrt(along @ explanation.covariance.of(number, LAYOUT.size + at) @ along))
    return size / sigma if sigma > 0.0 else np.inf


def _lift(explanation: Explanation, number: int, effects: Sequence[Placed], theta: Array) -> Array:
    """What ``effects`` accelerate flight ``number`` by (3,) m/s² at its reference time, under parameters ``theta`` (q,)."""
    return lift_of(explanation.fit.state.flights[number].first, explanation.campaign.sequences[number].setting, effects, theta)


def _some(names: Sequence[str]) -> str:
    """The first few of some names."""
    return ", ".join(names[:MOST_TOLD]) + (", …" if len(names) > MOST_TOLD else "")
