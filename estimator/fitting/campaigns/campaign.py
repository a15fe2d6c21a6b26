"""Many sequences fitted jointly: an initial state for each, the particle, the camera and the effects shared as their scope says.

The normal equations are a block arrow: local blocks (the state and the effects of one sequence) touch one another only through the shared
parameters. Eliminating the local blocks costs the same for every sequence, so the whole is linear in their number [Triggs et al. 2000,
section 6].
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import accumulate, chain, repeat
from operator import mul
from typing import Any

import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.effects import Scope
from estimator.effects.model import Model
from estimator.fitting.campaigns.facts import Fact, stated_rows
from estimator.fitting.campaigns.measurement_kind import MeasurementKind
from estimator.fitting.stable_inverse import stable_inverse
from estimator.likelihood.composite_likelihood import WeighedFrames
from estimator.motion.flight import COM, INERTIA, N_PARAMETERS, OFFSET, Flight, moved
from estimator.motion.rigid_body import RanAway

Array = NDArray[np.float64]
Index = NDArray[np.int64]
STATE = 12
"""Parameters of a flight that every sequence has for itself: position, turn, velocity, spin."""
MOST_STEPS, HALVINGS, SHORTER, SETTLED = 15, 5, 0.3, 0.05
"""Steps of a fit; shares of a step that are tried, each the fraction ``SHORTER`` of the one before; a step below ``SETTLED`` standard
deviations ends it. By judgement."""
STILL, STILL_COST, STILL_SHARE = 0.35, 0.1, 1e-4
"""A fit also ends where a step below ``STILL`` standard deviations changes the cost by less than ``STILL_COST``, a small fraction of what
tells models apart, or than ``STILL_SHARE`` of it: tangents that jump from corner to corner keep large misfits from settling further
(notebook 27)."""
PATIENCE = 3
"""Steps that lower the cost by less than ``STILL_SHARE`` of it before a fit is given up where it was best: large misfits wander.

See notebook 26."""
FIXED = 1e12
"""Times the prior's information on what is considered that a fit is given: it stays where it is."""
FALLING, MOST_FALLING = 0.01, 40
"""A fit whose last step lowered the cost by more than the share ``FALLING`` of it goes on beyond its steps, up to ``MOST_FALLING``.

See notebook 33."""


@dataclass(frozen=True)
class Campaign:
    """Sequences with the number of the particle and of the camera each belongs to, and the noise outlines do not show.

    ``recording``: the name of the recording that each sequence is a flight of; empty where every sequence is a whole recording. ``kind``
    says what the sequences are and works on them; all have a ``name`` and a ``setting``. ``facts``: what is stated of the
    parameters of effects beside the sequences.
    """

    sequences: tuple[Any, ...]
    particle: tuple[int, ...]
    camera: tuple[int, ...]
    floor_px: float
    body_noise_px: float
    kind: MeasurementKind
    facts: tuple[Fact, ...] = ()
    recording: tuple[str, ...] = ()

    def sharing(self, scope: Scope) -> tuple[int, ...]:
        """Of every sequence, the first one with which it shares what is of a ``scope``."""
        n = len(self.sequences)
        each = tuple(range(n))
        groups: dict[Scope, tuple[int, ...] | tuple[str, ...]] = {
            Scope.SEQUENCE: each,
            Scope.RECORDING: self.recording or each,
            Scope.PARTICLE: self.particle,
            Scope.CAMERA: self.camera,
            Scope.CAMPAIGN: (0,) * n,
        }
        of = groups[scope]
        return tuple(of.index(group) for group in of)

    @property
    def recordings(self) -> tuple[str, ...]:
        """The name of every sequence's recording."""
        return self.recording or tuple(each.name for each in self.sequences)

    def flights_beside(self, number: int) -> int:
        """How many sequences are of the recording of sequence ``number``, itself among them."""
        return self.recording.count(self.recording[number]) if self.recording else 1

    def part(self, rows: Sequence[int]) -> "Campaign":
        """The sequences ``rows`` alone, in that order; a sequence may be there several times."""
        return replace(
            self,
            sequences=tuple(self.sequences[i] for i in rows),
            particle=tuple(self.particle[i] for i in rows),
            camera=tuple(self.camera[i] for i in rows),
            recording=tuple(self.recording[i] for i in rows) if self.recording else (),
        )


@dataclass(frozen=True)
class Layout:
    """Where parameters live.

    ``local`` (l,): columns of a sequence's 21 + q that are its own; ``shared`` (21 + q - l,): the others, and ``place``
    (21 + q - l,) of each sequence, where each of those lies among the ``size`` shared parameters.
    """

    local: Index
    shared: Index
    place: tuple[Index, ...]
    size: int


def scopes_of(model: Model) -> tuple[Scope, ...]:
    """What shares each of a sequence's 21 + q columns."""
    nominal = (*[Scope.SEQUENCE] * STATE, *[Scope.PARTICLE] * 8, Scope.CAMERA)
    return (*nominal, *(e.entry.scope for e in model.effects for _ in e.entry.parameters))


def layout_of(campaign: Campaign, model: Model) -> Layout:
    """The layout of a campaign's parameters under a model."""
    scopes = scopes_of(model)
    sharing = {scope: campaign.sharing(scope) for scope in Scope}
    alone = [scope for scope in Scope if scope.own and len(set(sharing[scope])) == len(campaign.sequences)]
    local = np.array([i for i, s in enumerate(scopes) if s in alone], dtype=np.int64)
    shared = np.array([i for i, s in enumerate(scopes) if s not in alone], dtype=np.int64)
    number: dict[tuple[int, int], int] = {}
    place = []
    for sequence in range(len(campaign.sequences)):
        keys = [(int(column), sharing[scopes[column]][sequence]) for column in shared]
        place.append(np.array([number.setdefault(key, len(number)) for key in keys], dtype=np.int64))
    return Layout(local, shared, tuple(place), len(number))


@dataclass(frozen=True)
class CampaignState:
    """A flight and effect parameters ``theta`` (q,) for each sequence; shared ones are equal in all that share them."""

    flights: tuple[Flight, ...]
    theta: tuple[Array, ...]


@dataclass(frozen=True)
class SequenceEquations:
    """One sequence linearised: residuals, their weights, and the normal equations of its 21 + q parameters.

    ``errors`` are the kind's own; all have ``e`` (n, ...), zero where there is none, ``seen`` (n, ...) where there is one, ``J`` (n, ...,
    21 + q) and the ``prediction`` behind them; n sightings.
    """

    errors: Any
    frames: WeighedFrames


def sequence_equations(campaign: Campaign, number: int, state: CampaignState, model: Model) -> SequenceEquations:
    """Linearise sequence ``number``."""
    return _equations(campaign, number, _residuals(campaign, number, state, model), state, model)


def _residuals(campaign: Campaign, number: int, state: CampaignState, model: Model) -> Any:
    return campaign.kind.residuals(campaign, number, state.flights[number], model, state.theta[number])


def _equations(campaign: Campaign, number: int, residuals: Any, state: CampaignState, model: Model) -> SequenceEquations:
    theta = state.theta[number]
    linear = campaign.kind.equations(campaign, number, residuals, model, theta)
    return replace(linear, frames=_with_own_prior(linear.frames, model, theta, _own_shares(campaign, number, model)))


def _own_shares(campaign: Campaign, number: int, model: Model) -> Array:
    """Of every effect (e,), the share of its prior that belongs to a sequence: flights divide that of their recording's values.

    Nothing of effects that are not own: their priors are in :func:`shared_prior`.
    """
    shares = {Scope.SEQUENCE: 1.0, Scope.RECORDING: 1.0 / campaign.flights_beside(number)}
    return np.array([shares.get(effect.entry.scope, 0.0) for effect in model.effects])


def _with_own_prior(frames: WeighedFrames, model: Model, theta: Array, shares: Array) -> WeighedFrames:
    precision = np.concatenate([np.zeros(N_PARAMETERS), model.precision_at(theta) * model.each_parameter(shares)])
    if not precision.any():
        return frames
    pull = np.concatenate([np.zeros(N_PARAMETERS), theta]) * precision
    return replace(frames, H=frames.H + np.diag(precision), g=frames.g + pull, known=frames.known + np.diag(precision))


@dataclass(frozen=True)
class Prior:
    """What is known of the shared parameters beside the sequences: ``information`` (p, p), ``gradient`` (p,) and ``cost`` at a state."""

    information: Array
    gradient: Array
    cost: float

    @classmethod
    def diagonal(cls, precision: Array, values: Array) -> "Prior":
        """Independent normal priors about zero of parameters that are at ``values`` (p,); ``precision`` (p,)."""
        return cls(np.diag(precision), precision * values, 0.5 * float(values @ (precision * values)))


def shared_prior(campaign: Campaign, layout: Layout, model: Model, state: CampaignState) -> Prior:
    """The prior of body, outline offset and effects that are held, and the facts that are stated, as fits use it.

    Parameters that are considered and not estimated stay where they are.
    """
    return _prior(campaign, layout, model, state, campaign.kind.considered)


def marginal_prior(campaign: Campaign, layout: Layout, model: Model, state: CampaignState) -> Prior:
    """The same as tests and evidence use it: over all that parameters may be, those that are considered among them."""
    return _prior(campaign, layout, model, state, ())


def _prior(campaign: Campaign, layout: Layout, model: Model, state: CampaignState, fixed: Sequence[int]) -> Prior:
    """Of all shared parameters; the columns ``fixed`` stay where they are."""
    precision, values = np.zeros(layout.size), np.zeros(layout.size)
    common = model.precision * model.each_parameter(np.array([not e.entry.scope.own for e in model.effects], dtype=np.float64))
    for sequence, flight, theta, place in zip(campaign.sequences, state.flights, state.theta, layout.place, strict=True):
        own = np.concatenate([campaign.kind.precision(sequence), common])
        own[list(fixed)] *= FIXED
        precision[place] = own[layout.shared]
        values[place] = _vector(flight, theta)[layout.shared]
    held = Prior.diagonal(precision, values)
    if not campaign.facts:
        return held
    A, y = stated_rows(campaign.facts, model, layout)
    off = A @ values - y
    return Prior(held.information + A.T @ A, held.gradient + A.T @ off, held.cost + 0.5 * float(off @ off))


def _vector(flight: Flight, theta: Array) -> Array:
    """Parameters (21 + q,) that a prior may hold or sequences may share; the state's own are zero."""
    vector = np.zeros(N_PARAMETERS + len(theta))
    vector[COM], vector[INERTIA], vector[OFFSET], vector[N_PARAMETERS:] = flight.com, flight.inertia, flight.offset_px, theta
    return vector


@dataclass(frozen=True)
class ArrowSolution:
    """Gauss-Newton step: ``local`` [sequence] (l,), ``shared`` (size,), and the shared parameters' normal matrix after elimination.

    ``schur`` (size, size); ``inverses`` (s, l, l): those of the local blocks.
    """

    local: tuple[Array, ...]
    shared: Array
    schur: Array
    inverses: Array


def solve_arrow(equations: Sequence[SequenceEquations], layout: Layout, prior: Prior, *, damping: float = 0.0) -> ArrowSolution:
    """Eliminate the local blocks, solve for the shared parameters, substitute back.

    ``damping``: of every normal matrix so much of its diagonal is added to it [Marquardt 1963].
    """
    H, g = prior.information.copy(), prior.gradient.copy()
    every, gradients = np.stack([each.frames.H for each in equations]), np.stack([each.frames.g for each in equations])[..., None]
    full = every + damping * every * np.eye(every.shape[-1]) if damping > 0.0 else every
    own, others = layout.local, layout.shared
    inverses, cross = stable_inverse(full[:, own[:, None], own]), full[:, others[:, None], own]
    left = full[:, others[:, None], others] - cross @ inverses @ np.swapaxes(cross, 1, 2)
    pull = gradients[:, others] - cross @ (inverses @ gradients[:, own])
    for of_one, pull_of_one, place in zip(left, pull, layout.place, strict=True):
        H[np.ix_(place, place)] += of_one
        g[place] += pull_of_one[:, 0]
    shared = -stable_inverse(H) @ g
    there = np.stack([shared[place] for place in layout.place])[..., None]
    local = -inverses @ (gradients[:, own] + every[:, own[:, None], others] @ there)
    return ArrowSolution(tuple(local[..., 0]), shared, H, inverses)


def stepped(state: CampaignState, layout: Layout, solution: ArrowSolution, share: float = 1.0) -> CampaignState:
    """The state after a share of a step."""
    flights, theta = [], []
    for flight, own, place, local in zip(state.flights, state.theta, layout.place, solution.local, strict=True):
        step = np.zeros(N_PARAMETERS + len(own))
        step[layout.local] = share * local
        step[layout.shared] = share * solution.shared[place]
        flights.append(moved(flight, step[:N_PARAMETERS]))
        theta.append(own + step[N_PARAMETERS:])
    return CampaignState(tuple(flights), tuple(theta))


@dataclass(frozen=True)
class CampaignFit:
    """A fitted campaign: its state, the equations there, the layout, whether it settled, and its cost."""

    model: Model
    state: CampaignState
    equations: tuple[SequenceEquations, ...]
    layout: Layout
    settled: bool
    cost: float


def fit_campaign(
    campaign: Campaign,
    start: CampaignState,
    model: Model,
    *,
    most_steps: int = MOST_STEPS,
    most_falling: int = MOST_FALLING,
    dampings: Sequence[float] = (),
) -> CampaignFit:
    """Gauss-Newton with step halving, weights refreshed at every step; ends, too, where :data:`PATIENCE` steps in a row gain nothing.

    ``most_steps``: after which a fit ends that no longer falls fast (:data:`FALLING`); one that does ends after ``most_falling``.
    ``dampings``: tried in turn where no share of a step lowers the cost.

    Raises
    ------
    RanAway
        Where ``start`` cannot be flown, or nothing is seen of it.
    """
    layout = layout_of(campaign, model)
    state = _agreed(start, layout)
    equations = _linearised(campaign, state, model)
    cost = _cost(campaign, (layout, model), state, [each.errors for each in equations])
    if not np.isfinite(cost):
        raise RanAway("nothing is seen of the flights that a fit starts from")
    settled, least, mark, in_vain, falls = False, (cost, state, equations), cost, 0, False
    for step in range(max(most_steps, most_falling)):
        if step >= most_steps and not falls:
            break
        solution = solve_arrow(equations, layout, shared_prior(campaign, layout, model, state))
        size = _relative_size(solution)
        lower = _lowered(campaign, (layout, model), (cost, state, equations), solution, dampings)
        if lower is None:
            break
        (new_cost, state, equations), damped = lower
        still = size < SETTLED or (size < STILL and abs(cost - new_cost) < max(STILL_COST, STILL_SHARE * cost))
        falls = new_cost < cost * (1.0 - FALLING)
        settled, cost = still and not damped, new_cost
        mark, in_vain = (cost, 0) if cost < mark * (1.0 - STILL_SHARE) else (mark, in_vain + 1)
        least = min(least, (cost, state, equations), key=lambda found: found[0])
        if settled or in_vain == PATIENCE:
            break
    if not settled:
        cost, state, equations = least
    return CampaignFit(model, state, equations, layout, settled, cost)


_Costed = tuple[float, CampaignState, tuple[SequenceEquations, ...]]


def _lowered(
    campaign: Campaign, kind: tuple[Layout, Model], at: _Costed, solution: ArrowSolution, dampings: Sequence[float]
) -> tuple[_Costed, bool] | None:
    """The first of ever shorter steps, then of ever more damped ones, that does not raise the cost, and whether it is damped.

    Only a step that is taken is linearised, and what raises the cost is not looked at to its end.
    """
    (layout, model), (cost, state, equations) = kind, at
    most = cost * (1.0 + STILL_SHARE)
    prior = shared_prior(campaign, layout, model, state)
    shares = accumulate(repeat(SHORTER, HALVINGS - 1), mul, initial=1.0)
    shorter = ((stepped(state, layout, solution, share), False) for share in shares)
    damped = ((stepped(state, layout, solve_arrow(equations, layout, prior, damping=d)), True) for d in dampings)
    for trial, is_damped in chain(shorter, damped):
        try:
            residuals = _no_dearer(campaign, trial, model, most)
        except RanAway:
            continue
        if residuals is None:
            continue
        new_cost = _cost(campaign, kind, trial, residuals)
        if new_cost <= most:
            new = tuple(_equations(campaign, i, each, trial, model) for i, each in enumerate(residuals))
            return (new_cost, trial, new), is_damped
    return None


def _no_dearer(campaign: Campaign, state: CampaignState, model: Model, most: float) -> list[Any] | None:
    """The residuals of all sequences; ``None`` where those of the first of them alone cost more than ``most``."""
    found, cost = [], 0.0
    for number, sequence in enumerate(campaign.sequences):
        found.append(_residuals(campaign, number, state, model))
        cost += campaign.kind.cost(sequence, found[-1])
        if cost > most:
            return None
    return found


def _linearised(campaign: Campaign, state: CampaignState, model: Model) -> tuple[SequenceEquations, ...]:
    return tuple(sequence_equations(campaign, i, state, model) for i in range(len(campaign.sequences)))


def _agreed(state: CampaignState, layout: Layout) -> CampaignState:
    """The state with shared parameters set to their mean over those that share them."""
    total, count = np.zeros(layout.size), np.zeros(layout.size)
    vectors = []
    for flight, theta, place in zip(state.flights, state.theta, layout.place, strict=True):
        vector = _vector(flight, theta)
        vectors.append(vector)
        total[place] += vector[layout.shared]
        count[place] += 1
    mean = total / np.maximum(count, 1)
    flights, thetas = [], []
    for flight, vector, place in zip(state.flights, vectors, layout.place, strict=True):
        vector[layout.shared] = mean[place]
        flights.append(replace(flight, com=vector[COM], inertia=vector[INERTIA], offset_px=float(vector[OFFSET][0])))
        thetas.append(vector[N_PARAMETERS:])
    return CampaignState(tuple(flights), tuple(thetas))


def _cost(
    campaign: Campaign, kind: tuple[Layout, Model], state: CampaignState, residuals: Sequence[Any], like: Sequence[Any] | None = None
) -> float:
    """Half the mean Huber cost per error times the number of sightings' independent errors, plus the prior's."""
    layout, model = kind
    noise = like or [None] * len(residuals)
    data = sum(campaign.kind.cost(sequence, each, by) for sequence, each, by in zip(campaign.sequences, residuals, noise, strict=True))
    shares = [_own_shares(campaign, i, model) for i in range(len(state.theta))]
    own = sum(float((model.prior_cost(theta) * share)[share > 0.0].sum()) for theta, share in zip(state.theta, shares, strict=True))
    return float(data + shared_prior(campaign, layout, model, state).cost + own)


def _relative_size(solution: ArrowSolution) -> float:
    """Largest step over its standard deviation."""
    deviation = np.sqrt(np.maximum(np.diag(stable_inverse(solution.schur)), 1e-300))
    largest = float(np.max(np.abs(solution.shared) / deviation, initial=0.0, where=deviation > 1e-150))
    variance, local = np.diagonal(solution.inverses, axis1=1, axis2=2), np.stack(solution.local)
    return max(largest, float(np.max(np.abs(local) / np.sqrt(np.maximum(variance, 1e-300)), initial=0.0, where=variance > 1e-150)))
