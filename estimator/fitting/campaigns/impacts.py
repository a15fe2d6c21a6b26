"""What limits velocities: how much of their uncertainty comes from each thing that is not known exactly.

Of a block ``B`` of parameters (an effect, the body's centre of mass...), with covariance ``C`` of all parameters and ``J`` the derivatives
of (v, omega): ``J C_:B C_BB⁻¹`` is the sensitivity, everything else re-adjusted, and the block's impact is the sensitivity times the
block's uncertainty, after the fit (``C_BB``) or before it (its prior), as in the rankings of nuisance parameters in particle physics
[ATLAS 2012, Phys. Lett. B 716, 1]. What remains where all blocks are known is noise: ``J (C - C_:B C_BB⁻¹ C_B:) Jᵀ`` with ``B`` all of
them. What is possible but was not fitted is apart from both: its impact is what it adds to ``C``
(:mod:`estimator.fitting.campaigns.considered`).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimator.effects.link import EffectModel
from estimator.fitting.campaigns.campaign import Campaign, CampaignFit
from estimator.fitting.campaigns.considered import Considered, stated_rows
from estimator.fitting.campaigns.forced_velocities import velocities_under
from estimator.fitting.stable_inverse import stable_inverse
from estimator.motion.flight import LAYOUT

Array = NDArray[np.float64]
BODY = {"com": "centre of mass of the hull", "inertia": "moments of inertia of the hull", "offset": "outline offset"}
"""Blocks of the flight that are known from the calibrated views, more or less."""
VELOCITY, SPIN = slice(0, 3), slice(3, 6)


@dataclass(frozen=True)
class Impact:
    """What one thing does to velocities.

    Attributes
    ----------
    name : str
        An effect's key, or what of the body.
    fitted : bool
        Whether it was fitted; otherwise it is possible and was considered.
    v_ms, omega_rads : float
        Root mean square over flights of the length of the error that its uncertainty makes; NaN where none was measured.
    v_before_ms, omega_before_rads : float
        The same under what is known of it before the fit; NaN where that is nothing.
    """

    name: str
    fitted: bool
    v_ms: float
    omega_rads: float
    v_before_ms: float
    omega_before_rads: float


@dataclass(frozen=True)
class Impacts:
    """All things, those that matter most for v first; ``noise`` and ``total``: (v in m/s, omega in rad/s), ``size`` theirs over flights."""

    things: tuple[Impact, ...]
    noise: tuple[float, float]
    total: tuple[float, float]
    size: tuple[float, float]


@dataclass(frozen=True)
class _Block:
    """One thing: its columns of a sequence's parameters, and its covariance (b, b) before the fit, NaN where nothing is known."""

    name: str
    fitted: bool
    columns: NDArray[np.int64]
    before: Array


def impacts(campaign: Campaign, fit: CampaignFit, at: Considered) -> Impacts:
    """What limits v and omega at the middle times of a campaign's flights, along those axes along which they were measured."""
    blocks, n = _blocks(campaign, fit, at), len(campaign.sequences)
    after, before, noise, total, size = np.zeros((len(blocks), 2, n)), np.zeros((len(blocks), 2, n)), *np.zeros((3, 2, n))
    inside = np.concatenate([np.zeros(0, dtype=np.int64), *(block.columns for block in blocks if block.fitted)])
    for number, sequence in enumerate(campaign.sequences):
        axes = _measured(campaign, sequence)
        J, value = (each * axes.reshape(-1, *[1] * (each.ndim - 1)) for each in _derivatives(fit, at, number, sequence))
        plain, wide = at.plain.of(number, np.arange(at.own)), at.covariance.of(number, np.arange(at.model.layout.size))
        measured = np.where([axes[VELOCITY].any(), axes[SPIN].any()], 1.0, np.nan)
        for i, block in enumerate(blocks):
            S = _sensitivity(J, plain if block.fitted else wide, block.columns)
            after[i, :, number] = _squares(S @ (plain if block.fitted else wide)[np.ix_(block.columns, block.columns)] @ S.T) * measured
            before[i, :, number] = _squares(S @ block.before @ S.T) * measured
        S = _sensitivity(J, plain, inside)
        own = J[:, : at.own] @ plain @ J[:, : at.own].T
        noise[:, number] = _squares(own - S @ plain[np.ix_(inside, inside)] @ S.T) * measured
        total[:, number], size[:, number] = _squares(J @ wide @ J.T) * measured, _squares(np.outer(value, value)) * measured
    things = [_impact(b, _rms(a), _rms(p)) for b, a, p in zip(blocks, after, before, strict=True)]
    things.sort(key=lambda each: -np.nan_to_num(each.v_ms) if np.isfinite(each.v_ms) else -each.omega_rads)
    return Impacts(tuple(things), _rms(noise), _rms(total), _rms(size))


def sensitivities(campaign: Campaign, fit: CampaignFit, at: Considered) -> dict[str, Array]:
    """By what (v, omega) at the middle time of each of n flights change with the q parameters of every possible effect: (n, 6, q), SI.

    World axes, everything fitted re-adjusted; zero along axes that were not measured.
    """
    layout, found = at.model.layout, dict[str, list[Array]]()
    for number, sequence in enumerate(campaign.sequences):
        J, _ = _derivatives(fit, at, number, sequence)
        J, C = J * _measured(campaign, sequence)[:, None], at.covariance.of(number, np.arange(layout.size))
        for effect in at.model.effects[len(fit.model.effects) :]:
            key = effect.entry.key
            found.setdefault(key, []).append(_sensitivity(J, C, layout.columns([key])))
    return {key: np.array(each) for key, each in found.items()}


def _measured(campaign: Campaign, sequence: Any) -> NDArray[np.bool_]:
    """Along which axes (6,) v and omega of a flight were measured."""
    return ~np.isin(LAYOUT.columns(["v", "omega"]), campaign.kind.unmeasured(sequence))


def _derivatives(fit: CampaignFit, at: Considered, number: int, sequence: Any) -> tuple[Array, Array]:
    """Derivatives (6, 21 + q + r) of (v, omega) at a flight's middle time by all parameters, and their values (6,)."""
    times = sequence.setting.times_s
    known = np.diag(at.covariance.of(number, np.arange(LAYOUT.size))) == 0.0
    middle = float(times[(len(times) - 1) // 2])
    value, J = velocities_under(fit.state.flights[number], at.model, at.theta[number], sequence.setting, middle, known=known)
    return J, value


def _sensitivity(J: Array, C: Array, columns: NDArray[np.int64]) -> Array:
    """What (v, omega) change by with each of some parameters (6, b), all others re-adjusted."""
    return J[:, : len(C)] @ C[:, columns] @ stable_inverse(C[np.ix_(columns, columns)])


def _blocks(campaign: Campaign, fit: CampaignFit, at: Considered) -> list[_Block]:
    """The things that are uncertain."""
    layout = at.model.layout
    C, known, found = at.covariance.of(0, np.arange(layout.size)), campaign.kind.precision(campaign.sequences[0]), []
    varied = {name: layout.columns([name])[np.diag(C)[layout[name]] > 0.0] for name in layout.names}
    for key, name in BODY.items():
        columns = varied[key]
        if len(columns):
            found.append(_Block(name, True, columns, np.diag(1.0 / known[columns]) if known[columns].all() else _nothing(columns)))
    for effect in at.model.effects:
        key, columns = effect.entry.key, varied[effect.entry.key]
        if effect.random or not len(columns):
            continue
        fitted = key in fit.model.keys
        before = _before(campaign, effect, columns - layout[key].start) if fitted else C[np.ix_(columns, columns)]
        found.append(_Block(key, fitted, columns, before))
    return found


def _before(campaign: Campaign, effect: EffectModel, kept: NDArray[np.int64]) -> Array:
    """Covariance of parameters ``kept`` (b,) of an effect before the fit: the prior that holds it or its plausible range, and facts."""
    limits = np.array([max(map(abs, p.plausible)) for p in effect.entry.parameters])
    sigma = limits if effect.held is None else np.minimum(np.array(effect.held), limits)
    stated = stated_rows(campaign.facts, effect.entry.key)
    information = np.diag(sigma**-2.0) + (stated.T @ stated if len(stated) else 0.0)
    return stable_inverse(information)[np.ix_(kept, kept)] if np.isfinite(sigma).all() else _nothing(kept)


def _nothing(columns: NDArray[np.int64]) -> Array:
    return np.full((len(columns), len(columns)), np.nan)


def _squares(covariance: Array) -> Array:
    """Traces (2,) of the parts of v and omega."""
    return np.array([np.trace(covariance[part, part]) for part in (VELOCITY, SPIN)])


def _rms(squares: Array) -> tuple[float, float]:
    """Root mean squares over the flights in which they were measured."""
    seen = [row[~np.isnan(row)] for row in squares]
    v, omega = (float(np.sqrt(max(row.mean(), 0.0))) if len(row) else float("nan") for row in seen)
    return v, omega


def _impact(block: _Block, after: Sequence[float], before: Sequence[float]) -> Impact:
    return Impact(block.name, block.fitted, after[0], after[1], before[0], before[1])
