"""How many contacts an impact was: one, two that the pictures between them tell apart, or more than can be told.

Contacts less than two frames apart look like one impact with a pose before and another one after it
(:mod:`estimator.impacts.loose_contact`). Where that shows, two contacts are tried; with a picture between them they are measured one by one
(:mod:`estimator.impacts.contact_split`). Otherwise the impact stays one, from the first contact to the last: its two flights are no longer
held to one pose, so that the velocities before and after it are right, and its uncertainties are widened by the spread in time.

In drops of cut stones chi-square (5 expected) was at most 13 for single contacts and at least 55 for pairs 0.2 to 1.4 frames apart.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from estimator.data.fit_task import FitTask
from estimator.fitting.stable_inverse import NothingSeen
from estimator.fitting.trajectory import fit
from estimator.fitting.weighed_tangencies import Refinement
from estimator.impacts.contact_split import apart, parted, split_starts
from estimator.impacts.impact_judging import unfit
from estimator.impacts.loose_contact import loosened, spread_needed, spread_of
from estimator.impacts.piecewise_fit import PiecewiseRefined, refine_piecewise, spread_at, widened_by
from estimator.motion.piecewise import TIME, PiecewiseFlight, named
from estimator.motion.rigid_body import RanAway

CLEAR_CHI_SQUARE = 30.0
"""Of 5: above it an impact was more than one contact."""
MOST_SPLITS = 3
"""Impacts of a sequence that are taken apart. By judgement."""
LOOSEST_FRAMES = 0.25
"""Standard deviation of a contact's time, above which two contacts cannot be distinguished."""

Prepared = Callable[[PiecewiseFlight], FitTask]
"""What the last refinement of a flight works on."""


@dataclass(frozen=True)
class Spread:
    """What outlines say against one contact: ``chi_square`` of 5 of the pose's shift, and the ``spread_s`` in time that it asks for."""

    chi_square: float
    spread_s: float

    @property
    def clear(self) -> bool:
        """Whether it was more than one contact."""
        return self.chi_square > CLEAR_CHI_SQUARE


@dataclass(frozen=True)
class SeparatedContacts:
    """A flight whose contacts were looked at: ``spreads`` of its impacts, numbers of the ``loose`` ones, of several contacts.

    ``widened``: these are held to one pose all the same, since the outlines speak against the flight without, and only widen the intervals.
    """

    refined: PiecewiseRefined
    spreads: tuple[Spread, ...]
    loose: tuple[int, ...]
    widened: bool = False


def separated_contacts(
    task: FitTask, refined: PiecewiseRefined, prepared: Prepared, settings: Refinement, *, frame_s: float
) -> SeparatedContacts:
    """``refined`` with impacts that were several contacts split where pictures lie between them, and loosened where none does."""
    spreads = _spreads(refined, prepared, settings)
    for _ in range(MOST_SPLITS):
        split = _with_one_split(task, (refined, spreads), prepared, settings, frame_s=frame_s)
        if split is None:
            break
        refined, spreads = split, _spreads(split, prepared, settings)
    numbers = tuple(k for k, s in enumerate(spreads) if s.clear)
    if not numbers:
        return SeparatedContacts(refined, spreads, ())
    flight = refined.flight
    for number in numbers:
        try:
            sides = parted(task, flight, number, frame_s)
            flight = flight if sides is None else apart(flight, sides)
        except RanAway:
            continue
    found = []
    for start in (flight, refined.flight):
        try:
            loose, wider = _loose(start, spreads, numbers)
            found.append(SeparatedContacts(refine_piecewise(prepared(start), loose, settings), wider, numbers))
        except RanAway:
            continue
        if _fits(found[-1].refined, refined):
            break
    found = [told for told in found if unfit(told.refined) is None] or found
    best = min(found, key=lambda told: told.refined.noise.mean_square, default=None)
    if best is not None and (unfit(best.refined) is None or unfit(refined) is not None):
        return best
    loose, told = _loose(refined.flight, spreads, numbers)
    return SeparatedContacts(widened_by(prepared(refined.flight), refined, settings, loose), told, numbers, widened=True)


def _fits(loose: PiecewiseRefined, held: PiecewiseRefined) -> bool:
    """Whether a loosened flight is one to stay with: it has to leave less than the one that was held together."""
    return loose.settled and loose.noise.mean_square <= held.noise.mean_square


def _loose(flight: PiecewiseFlight, spreads: tuple[Spread, ...], numbers: tuple[int, ...]) -> tuple[PiecewiseFlight, tuple[Spread, ...]]:
    """The flight with impacts loosened, each as far as the flights beside it miss one another."""
    told = list(spreads)
    for number in numbers:
        flight = loosened(flight, number, spreads[number].spread_s)
        z = spread_of(flight, number)
        if z.any():
            told[number] = replace(told[number], spread_s=float(np.sqrt(np.mean(z**2))))
            flight = loosened(flight, number, told[number].spread_s)
    return flight, tuple(told)


def _spreads(refined: PiecewiseRefined, prepared: Prepared, settings: Refinement) -> tuple[Spread, ...]:
    task, found = prepared(refined.flight), []
    for number in range(len(refined.flight.bounces)):
        try:
            z, covariance = spread_at(task, refined.flight, number, settings)
            found.append(Spread(max(float(z @ np.linalg.solve(covariance, z)), 0.0), spread_needed(z, covariance)))
        except NothingSeen:  # whether there were several contacts
            found.append(Spread(0.0, 0.0))
    return tuple(found)


def _with_one_split(
    task: FitTask, known: tuple[PiecewiseRefined, tuple[Spread, ...]], prepared: Prepared, settings: Refinement, *, frame_s: float
) -> PiecewiseRefined | None:
    """The refined flight with its clearest impact as two contacts, where that fits better."""
    refined, spreads = known
    for number in sorted(range(len(spreads)), key=lambda k: -spreads[k].chi_square):
        try:
            sides = parted(task, refined.flight, number, frame_s) if spreads[number].clear else None
            starts = [] if sides is None else split_starts(task, refined.flight, sides, frame_s)
            if not starts:
                continue
            flight = min((fit(task, start) for start in starts), key=lambda s: s.equations.cost).state
            split = refine_piecewise(prepared(flight), flight, settings)
        except RanAway:
            continue
        if _told(split, number, frame_s) and split.noise.mean_square < refined.noise.mean_square:
            return split
    return None


def _told(split: PiecewiseRefined, number: int, frame_s: float) -> bool:
    """Whether the times of impact ``number`` and the next are known well enough to speak of two contacts."""
    variances = np.diag(split.covariance)[split.flight.layout.columns(named(TIME, k) for k in (number, number + 1))]
    return bool(split.settled and np.all(variances < (LOOSEST_FRAMES * frame_s) ** 2))


def contact_sentences(told: SeparatedContacts, frame_s: float) -> list[str]:
    """What to say of impacts that were more than one contact and could not be told apart."""
    return [
        f"impact {number + 1} was more than one contact: its pose would have to jump as far as it flies in "
        f"{told.spreads[number].spread_s / frame_s:.1f} frames. Another contact is near that pictures do not tell apart from it: "
        "the velocities before and after are measured, and widened by that."
        for number in told.loose
    ]
