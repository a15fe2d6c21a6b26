"""Two flights that collide, fitted to all samples: each particle by itself with its own surface, then both at one time of impact.

What outlines of a particle say concerns its own flight and surface alone. So its own joint fit (:mod:`estimator.surface.joint`) holds all
of it: about the flight that it ends with a normal distribution, marginal over the surface. What binds the two, the time of the impact and
hulls that touch, comes to both distributions as facts.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from estimator.fitting.levenberg_marquardt import NormalEquations
from estimator.fitting.problem import Fact, Problem
from estimator.fitting.refinement import Solved, stepped
from estimator.fitting.stable_inverse import scaled_inverse
from estimator.fitting.weighed_tangencies import linearise
from estimator.impacts.contact_split import shift_between
from estimator.motion.flight import THETA, X
from estimator.motion.piecewise import PiecewiseFlight
from estimator.pairs.pair_fit import SHARED, PairFlight, PairRefined, at_one_time
from estimator.surface.joint import JointFit

Array = NDArray[np.float64]
OfBoth = tuple[JointFit[PiecewiseFlight], JointFit[PiecewiseFlight]]


def bound_together(joints: OfBoth, tangents: PairRefined, facts: Sequence[Fact[PairFlight]] = ()) -> PairRefined:
    """Both flights at one time of impact as all samples have them, in place of those of ``tangents``; ``facts``: what else binds them."""
    variances = [joint.covariance[joint.motion.layout[SHARED]][:, joint.motion.layout[SHARED]].item() for joint in joints]
    pair = at_one_time(joints[0].motion, joints[1].motion, (1.0 / variances[0], 1.0 / variances[1]))
    told = [_told_by(joint, which) for which, joint in enumerate(joints)]
    problem: Problem[PairFlight, PiecewiseFlight, NormalEquations] = Problem((), _nothing, (*told, *facts))
    state, system, settled = stepped(problem, pair)
    covariance, settled = scaled_inverse(system.H), settled and all(joint.settled for joint in joints)
    parts = []
    for part, flight, own in zip(tangents.parts, state.both, state.places, strict=True):
        at = linearise(part.at.task, flight, part.at.settings)
        found = replace(part, flight=flight, covariance=covariance[np.ix_(own, own)], settled=part.settled and settled, at=at)
        parts.append(found)
    return Solved(state, covariance, tuple(parts))


def _nothing(*_: object) -> NormalEquations:
    raise AssertionError("a problem of facts alone has no outlines")


def _told_by(joint: JointFit[PiecewiseFlight], which: int) -> Fact[PairFlight]:
    """What the samples of one of the two say of the pair."""
    information = scaled_inverse(joint.covariance)

    def told(pair: PairFlight) -> NormalEquations:
        place, off = pair.places[which], _away(pair.both[which], joint.motion)
        H, g = np.zeros((pair.layout.size,) * 2), np.zeros(pair.layout.size)
        H[np.ix_(place, place)], g[place] = information, information @ off
        return NormalEquations(H, g, 0.5 * float(off @ information @ off))

    return told


def _away(flight: PiecewiseFlight, reference: PiecewiseFlight) -> Array:
    """The parameter step (p,) from a ``reference`` to a flight with the same reference time."""
    step = flight.values - reference.values
    shift = shift_between(reference.first, flight.first)
    step[X], step[THETA] = shift[:3], shift[3:]
    return step
