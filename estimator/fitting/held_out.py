"""How well a model predicts what was not used to fit it.

Sequences are dealt into two halves: what they share is fitted on one half, and the other half is judged with it. A sequence that is judged
still needs its own state: every fourth frame is judged with the state that the three others give, four times in turn, so that every frame
counts once. The state without a quarter is the state with it less one Gauss-Newton step (PRESS, [Allen 1974]).

What the other half leaves open of an effect, those three quarters settle: its value there is a prior with the other half's information. An
effect that shows in one sequence alone, as moments of inertia do where only one spins fast, would else be judged with values that nothing
tells. What the other half does tell holds, for a sequence is a small part of what is known of an effect that all show.

What is known to be small (the hull's errors of mass, the outline offset, the instrument's discrepancy) may not be more than ``MOST``
standard deviations of its prior when a model is judged: a base model that borrows a missing effect from there does not predict.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimator.effects.model import Model
from estimator.fitting.campaign import (
    ArrowSolution,
    Campaign,
    CampaignFit,
    CampaignState,
    Layout,
    SequenceEquations,
    fit_campaign,
    layout_of,
    sequence_equations,
    shared_prior,
    solve_arrow,
    stepped,
)
from estimator.fitting.stable_inverse import stable_inverse
from estimator.motion.flight import COM, INERTIA, N_PARAMETERS, OFFSET

Array = NDArray[np.float64]
QUARTERS = 4
MOST = 2.0
LOCAL_STEPS, SETTLED = 6, 0.05


@dataclass(frozen=True)
class HeldOut:
    """RMS (px, or the unit of the kind of measurement) of the errors held out, per sequence and of all, and their number."""

    rms_px: float
    per_sequence_px: Array
    errors: int


def held_out(campaign: Campaign, state: CampaignState, model: Model) -> HeldOut:
    """Judge a model on frames and sequences that it was not fitted to; ``state`` is where fits start."""
    n = len(campaign.sequences)
    halves = [np.arange(start, n, 2) for start in range(2)] if n > 1 else [np.arange(1)]
    squares, counts = np.zeros(n), np.zeros(n)
    for number, judged in enumerate(halves):
        learned_from = halves[1 - number] if n > 1 else judged
        half = _part(campaign, learned_from)
        learned = _learned(half, fit_campaign(half, _state_of(state, learned_from), model, most_steps=6), alone=n == 1)
        for i in judged:
            squares[i], counts[i] = _judge(campaign, int(i), (state, learned), model)
    squares[counts == 0] = np.inf  # the flight has left all outlines behind
    per_sequence = np.sqrt(squares / np.maximum(counts, 1))
    return HeldOut(float(np.sqrt(squares.sum() / max(counts.sum(), 1))), per_sequence, int(counts.sum()))


@dataclass(frozen=True)
class _Learned:
    """What other sequences tell: their ``state``, and the ``information`` (c, c) they have on ``columns`` (c,) of effects that are free."""

    state: CampaignState
    columns: NDArray[np.int64]
    information: Array


def _learned(campaign: Campaign, fit: CampaignFit, *, alone: bool) -> _Learned:
    """What a fit to a part of the sequences tells of the others; ``alone``: it is fitted to what it judges, and tells nothing."""
    model, layout = fit.model, fit.layout
    free = np.concatenate([np.zeros(N_PARAMETERS, dtype=np.bool_), model.precision == 0.0])
    rows = np.flatnonzero(free[layout.shared])
    if alone or not len(rows):
        return _Learned(fit.state, layout.shared[rows], np.zeros((len(rows), len(rows))))
    schur = solve_arrow(fit.equations, layout, shared_prior(campaign, layout, model, fit.state)).schur
    place = layout.place[0][rows]
    return _Learned(fit.state, layout.shared[rows], stable_inverse(stable_inverse(schur)[np.ix_(place, place)]))


def _part(campaign: Campaign, rows: NDArray[np.int64]) -> Campaign:
    return replace(
        campaign,
        sequences=tuple(campaign.sequences[i] for i in rows),
        particle=tuple(campaign.particle[i] for i in rows),
        camera=tuple(campaign.camera[i] for i in rows),
    )


def _state_of(state: CampaignState, rows: NDArray[np.int64]) -> CampaignState:
    return CampaignState(tuple(state.flights[i] for i in rows), tuple(state.theta[i] for i in rows))


def _judge(campaign: Campaign, number: int, known: tuple[CampaignState, _Learned], model: Model) -> tuple[float, float]:
    """Sum of squares and number of the errors of one sequence, each frame's predicted from the frames of the other quarters."""
    own, learned = known
    sequence = campaign.sequences[number]
    layout = layout_of(campaign, model)
    alone = replace(_part(campaign, np.array([number])), sequences=(sequence,))
    state = _with_shared(_state_of(own, np.array([number])), learned.state, layout)
    state = _within_priors(state, campaign.kind.precision(sequence), model)
    columns = np.concatenate([layout.local, learned.columns])
    rest = np.setdiff1d(layout.shared, learned.columns)
    one = Layout(columns, rest, (np.arange(len(rest)),), len(rest))
    prior = np.zeros((len(columns), len(columns)))
    prior[len(layout.local) :, len(layout.local) :] = learned.information
    began = state.theta[0]
    equations = sequence_equations(alone, 0, state, model)
    for _ in range(LOCAL_STEPS):
        H, g = _with_prior(equations, columns, prior, state.theta[0] - began)
        inverse = stable_inverse(H)
        step = -inverse @ g
        state = stepped(state, one, ArrowSolution((step,), np.zeros(len(rest)), np.zeros((0, 0))))
        equations = sequence_equations(alone, 0, state, model)
        if np.max(np.abs(step) / np.sqrt(np.maximum(np.diag(inverse), 1e-300))) < SETTLED:
            break
    normal = _with_prior(equations, columns, prior, state.theta[0] - began)
    e = np.concatenate([_left_out(equations, columns, normal, start) for start in range(QUARTERS)])
    return float(np.sum(e**2)), float(equations.errors.seen.sum())


def _with_prior(equations: SequenceEquations, columns: NDArray[np.int64], prior: Array, gone: Array) -> tuple[Array, Array]:
    """Normal matrix and gradient of ``columns`` with a ``prior`` on effects, from whose values these have ``gone`` (q,)."""
    away = np.concatenate([np.zeros(N_PARAMETERS), gone])[columns]
    return equations.frames.H[np.ix_(columns, columns)] + prior, equations.frames.g[columns] + prior @ away


def _left_out(equations: SequenceEquations, columns: NDArray[np.int64], normal: tuple[Array, Array], start: int) -> Array:
    """Errors of every fourth frame from ``start`` on, under the state that the other frames give."""
    frames, errors = equations.frames, equations.errors
    n = len(errors.e)
    out = np.zeros(n, dtype=np.bool_)
    out[start::QUARTERS] = True
    e, J = errors.e[out].ravel(), errors.J[out][..., columns].reshape(-1, len(columns))
    W = frames.weighted[out][..., columns].reshape(-1, len(columns))
    step = -stable_inverse(normal[0] - J.T @ W) @ (normal[1] - W.T @ e)
    return np.asarray(e + J @ step)


def _with_shared(own: CampaignState, learned: CampaignState, layout: Layout) -> CampaignState:
    """One sequence's own state with what sequences share taken from others (of the same particle and camera)."""
    flight, theta = own.flights[0], own.theta[0].copy()
    other, values = learned.flights[0], learned.theta[0]
    shared = layout.shared[layout.shared >= N_PARAMETERS] - N_PARAMETERS
    theta[shared] = values[shared]
    flight = replace(flight, com=other.com, inertia=other.inertia, offset_px=other.offset_px)
    return CampaignState((flight,), (theta,))


def _within_priors(state: CampaignState, precision: Array, model: Model) -> CampaignState:
    """The state with everything that a prior holds brought within ``MOST`` of its standard deviations."""
    limit = MOST / np.sqrt(np.maximum(np.concatenate([precision, model.precision]), 1e-300))
    flight = state.flights[0]
    flight = replace(
        flight,
        com=np.clip(flight.com, -limit[COM], limit[COM]),
        inertia=np.clip(flight.inertia, -limit[INERTIA], limit[INERTIA]),
        offset_px=float(np.clip(flight.offset_px, -limit[OFFSET], limit[OFFSET])[0]),
    )
    return CampaignState((flight,), (np.clip(state.theta[0], -limit[N_PARAMETERS:], limit[N_PARAMETERS:]),))
