"""Many sequences fitted jointly: an initial state for each, the particle, the camera and the effects shared as their scope says.

A problem whose parts are the sequences: what is a sequence's alone is eliminated (:mod:`estimator.fitting.system`), so the whole is linear
in their number.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.effects import Scope
from estimator.effects.model import Model
from estimator.fitting.campaigns.facts import Fact, stated_rows
from estimator.fitting.campaigns.measurement_kind import MeasurementKind
from estimator.fitting.descent import USUAL, Effort, descended
from estimator.fitting.levenberg_marquardt import NormalEquations
from estimator.fitting.stable_inverse import half_log_det
from estimator.fitting.system import Arrangement, System
from estimator.likelihood.composite_likelihood import WeighedFrames
from estimator.likelihood.time_shifts import TimeShifts
from estimator.motion.flight import LAYOUT, N_PARAMETERS, Flight

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Campaign:
    """Sequences with the number of the particle and of the camera each belongs to, and the noise outlines do not show.

    ``recording``: the name of the recording that each sequence is a flight of; empty where every sequence is a whole recording. ``kind``
    says what the sequences are and works on them; all have a ``name`` and a ``setting``. ``facts``: what is stated of the
    parameters of effects beside the sequences. ``cameras``: names of all high-speed cameras, the first one's first.
    """

    sequences: tuple[Any, ...]
    particle: tuple[int, ...]
    camera: tuple[int, ...]
    floor_px: float
    body_noise_px: float
    kind: MeasurementKind
    facts: tuple[Fact, ...] = ()
    recording: tuple[str, ...] = ()
    cameras: tuple[str, ...] = ()

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

    def time_shifts(self, equations: "Sequence[SequenceEquations]") -> list[TimeShifts]:
        """Shifts of the sightings' times of each sequence in each camera."""
        return [shifts for i, each in enumerate(equations) for shifts in self.kind.time_shifts(self, i, each)]

    def part(self, rows: Sequence[int]) -> "Campaign":
        """The sequences ``rows`` alone, in that order; a sequence may be there several times."""
        return replace(
            self,
            sequences=tuple(self.sequences[i] for i in rows),
            particle=tuple(self.particle[i] for i in rows),
            camera=tuple(self.camera[i] for i in rows),
            recording=tuple(self.recording[i] for i in rows) if self.recording else (),
        )


def layout_of(campaign: Campaign, model: Model) -> Arrangement:
    """Where the 21 + q parameters of every sequence lie: a block is one with that of another sequence that shares what is of its scope."""
    scopes, n = model.layout.scopes, len(campaign.sequences)
    sharing = {scope: campaign.sharing(scope) for scope in Scope}
    alone = {scope for scope in Scope if scope.own and len(set(sharing[scope])) == n}
    keys = [[(column, sharing[scope][i]) for column, scope in enumerate(scopes)] for i in range(n)]
    own_first = sorted((key for each in keys for key in each), key=lambda key: scopes[key[0]] not in alone)
    number = {key: k for k, key in enumerate(dict.fromkeys(own_first))}
    places = tuple(np.array([number[key] for key in each], dtype=np.int64) for each in keys)
    return Arrangement(places, len(number), np.flatnonzero([scope in alone for scope in scopes]))


@dataclass(frozen=True)
class CampaignState:
    """A flight and effect parameters ``theta`` (q,) for each sequence; shared ones are equal in all that share them."""

    flights: tuple[Flight, ...]
    theta: tuple[Array, ...]

    @property
    def values(self) -> tuple[Array, ...]:
        """Parameters (21 + q,) of every sequence; rotations are increments, so zero."""
        return tuple(np.concatenate([flight.values, theta]) for flight, theta in zip(self.flights, self.theta, strict=True))

    def moved(self, steps: Iterable[Array]) -> "CampaignState":
        """After steps (21 + q,) of every sequence."""
        each = [np.split(step, [LAYOUT.size]) for step in steps]
        flights = tuple(flight.moved(step) for flight, (step, _) in zip(self.flights, each, strict=True))
        return CampaignState(flights, tuple(theta + step for theta, (_, step) in zip(self.theta, each, strict=True)))


@dataclass(frozen=True)
class SequenceEquations:
    """One sequence linearised: residuals, their weights, and the normal equations of its 21 + q parameters.

    ``errors`` are the kind's own; all have ``e`` (n, ...), zero where there is none, ``seen`` (n, ...) where there is one, ``J`` (n, ...,
    21 + q) and the ``prediction`` behind them; n sightings.
    """

    errors: Any
    frames: WeighedFrames

    @property
    def H(self) -> Array:
        """Normal matrix (21 + q, 21 + q)."""
        return self.frames.H

    @property
    def g(self) -> Array:
        """Gradient (21 + q,)."""
        return self.frames.g

    def half_log_det_of_flight(self, held: NDArray[np.int64]) -> float:
        """Of what it says of its flight, for noise as stated: what the integral over flights leaves, in which fits differ.

        Beside it that of parameters ``held`` (k,) of the model, which are the sequence's own, priors included. Where there is lift,
        positions say more of a spin that was read once, and less of what acts beside it.
        """
        flight = self.H[:N_PARAMETERS, :N_PARAMETERS]
        found = half_log_det(self.errors.noise**2 * flight)
        if not len(held):
            return found
        both = np.concatenate([np.arange(N_PARAMETERS), N_PARAMETERS + held])
        return found + half_log_det(self.H[np.ix_(both, both)]) - half_log_det(flight)


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
    precision = np.zeros(model.layout.size)
    precision[LAYOUT.size :] = model.precision_at(theta) * model.each_parameter(shares)
    if not precision.any():
        return frames
    pull = np.concatenate([np.zeros(LAYOUT.size), theta]) * precision
    return replace(frames, H=frames.H + np.diag(precision), g=frames.g + pull, known=frames.known + np.diag(precision))


def shared_prior(campaign: Campaign, layout: Arrangement, model: Model, state: CampaignState) -> NormalEquations:
    """What is known of the shared parameters: body, outline offset and effects that are held, and the facts that are stated."""
    precision, values = np.zeros(layout.size), np.zeros(layout.size)
    common = model.precision * model.each_parameter(np.array([not e.entry.scope.own for e in model.effects], dtype=np.float64))
    for sequence, each, place in zip(campaign.sequences, state.values, layout.place, strict=True):
        own = np.concatenate([campaign.kind.precision(sequence), common])
        precision[place] = own[layout.shared]
        values[place] = each[layout.shared]
    A, y = stated_rows(campaign.facts, model, layout)
    off = A @ values - y
    cost = 0.5 * float(values @ (precision * values)) + 0.5 * float(off @ off)
    return NormalEquations(np.diag(precision) + A.T @ A, precision * values + A.T @ off, cost)


def own_cost(campaign: Campaign, model: Model, state: CampaignState) -> float:
    """What priors cost (nats) of effects of which there is a value for every sequence or recording."""
    shares = [_own_shares(campaign, i, model) for i in range(len(state.theta))]
    return sum(float((model.prior_cost(each) * share)[share > 0.0].sum()) for each, share in zip(state.theta, shares, strict=True))


@dataclass(frozen=True)
class CampaignFit:
    """A fitted campaign: its state, the equations there, the layout, whether it settled, and its cost."""

    model: Model
    state: CampaignState
    equations: tuple[SequenceEquations, ...]
    layout: Arrangement
    settled: bool
    cost: float

    def system(self, campaign: Campaign) -> System[SequenceEquations]:
        """The campaign linearised where the fit is."""
        return System(self.equations, self.layout, shared_prior(campaign, self.layout, self.model, self.state), self.cost)


@dataclass(frozen=True)
class _Problem:
    """A campaign under a model, as a problem whose states have costs."""

    campaign: Campaign
    model: Model
    layout: Arrangement

    def moved(self, state: CampaignState, step: Array) -> CampaignState:
        """After a ``step`` (p,) of all parameters."""
        return state.moved(step[place] for place in self.layout.places)

    def tried(self, state: CampaignState, most: float) -> Callable[[], System[SequenceEquations]] | None:
        """What linearises the campaign at a state; ``None`` where that costs more than ``most``, or cannot be said."""
        residuals, data = [], 0.0
        for number, sequence in enumerate(self.campaign.sequences):
            residuals.append(_residuals(self.campaign, number, state, self.model))
            data += self.campaign.kind.cost(sequence, residuals[-1])
            if data > most:
                return None
        known = shared_prior(self.campaign, self.layout, self.model, state)
        cost = float(data + known.cost + own_cost(self.campaign, self.model, state))
        return partial(self._linearised, state, residuals, known, cost) if cost <= most else None

    def _linearised(self, state: CampaignState, residuals: Sequence[Any], known: NormalEquations, cost: float) -> System[SequenceEquations]:
        told = tuple(_equations(self.campaign, i, each, state, self.model) for i, each in enumerate(residuals))
        return System(told, self.layout, known, cost)

    def agreed(self, state: CampaignState) -> CampaignState:
        """The state with shared parameters set to their mean over those that share them."""
        total, count = np.zeros((2, self.layout.p))
        for values, place in zip(state.values, self.layout.places, strict=True):
            total[place] += values
            count[place] += 1
        return state.moved((total / count)[place] - values for values, place in zip(state.values, self.layout.places, strict=True))


def fit_campaign(campaign: Campaign, start: CampaignState, model: Model, effort: Effort = USUAL) -> CampaignFit:
    """Gauss-Newton from a start with the costs of all sequences and priors.

    Raises
    ------
    RanAway
        Where ``start`` cannot be flown, or nothing is seen of it.
    """
    problem = _Problem(campaign, model, layout_of(campaign, model))
    end = descended(problem, problem.agreed(start), effort)
    return CampaignFit(model, end.state, end.system.told, problem.layout, end.settled, end.system.cost)
