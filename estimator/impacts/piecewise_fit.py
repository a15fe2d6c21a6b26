"""The last refinement of all segments of a flight with impacts: one pose at each impact, its time among the parameters.

A problem like that of one free flight (:mod:`estimator.fitting.refinement`); only its blocks and their sensitivities come from
:mod:`estimator.motion.piecewise`. So the second segment's silhouettes speak of the first segment's pose and the other way round, and the
covariance goes through the impact.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from estimator.data.fit_task import FitTask
from estimator.fitting.problem import Fact
from estimator.fitting.refinement import Refined, refine, sandwich, spread, system_at, with_noise_at
from estimator.fitting.weighed_tangencies import Refinement
from estimator.impacts.loose_contact import LONGEST_SPREAD_S, loosened
from estimator.impacts.plate_contact import PlateTask, held_by_plate
from estimator.motion.piecewise import SHIFT, PiecewiseFlight, named

Array = NDArray[np.float64]
FAR_MEAN_SQUARE, MOST_AGAIN = 4.0, 2
"""Of errors over their stated variance: above it the noise is read again, so many times at most (notebook 15)."""
PiecewiseRefined = Refined[PiecewiseFlight]


def refine_piecewise(task: FitTask, flight: PiecewiseFlight, settings: Refinement, plate: PlateTask | None = None) -> PiecewiseRefined:
    """The refined flight; with ``plate``, it is held to one.

    The size of the noise is read off the errors of the flight that came. Where these are far above it, because frames around an impact were
    left out and the flight after it was not yet found, it is read again where the steps led.
    """
    facts = facts_of(plate, task)
    refined = refine(task, flight, settings, facts)
    for _ in range(MOST_AGAIN):
        if refined.noise.mean_square <= FAR_MEAN_SQUARE:
            break
        again = refine(task, refined.flight, settings, facts)
        if again.noise.mean_square >= refined.noise.mean_square:
            break
        refined = again
    return refined


def facts_of(plate: PlateTask | None, task: FitTask) -> tuple[Fact[PiecewiseFlight], ...]:
    """What a ``plate`` that holds a flight says besides its outlines; nothing where there is none."""
    return () if plate is None else (lambda there: held_by_plate(plate, there, task.sightings.times_s).equations,)


def widened_by(task: FitTask, refined: PiecewiseRefined, settings: Refinement, loose: PiecewiseFlight) -> PiecewiseRefined:
    """A refined flight, not moved, with intervals that allow for impacts of several contacts, those that are ``loose`` in the same flight.

    The covariance is the one with these loosened, and the step to where that would lead, times itself.
    """
    system = system_at(with_noise_at(task, refined.flight)[0], loose, settings)
    own = loose.layout.columns(refined.flight.layout.names)
    covariance, bound = (matrix[np.ix_(own, own)] for matrix in spread(system))
    step = system.solved().step[own]
    return replace(refined, covariance=covariance + np.outer(step, step), bound=bound)


def spread_at(task: FitTask, flight: PiecewiseFlight, number: int, settings: Refinement) -> tuple[Array, Array]:
    """What the outlines say of a shift at impact ``number`` of a refined flight: z (5,) s, from one step, and its covariance."""
    loose = loosened(flight, number, LONGEST_SPREAD_S)
    system, shift = system_at(with_noise_at(task, flight)[0], loose, settings), loose.layout[named(SHIFT, number)]
    return system.solved().step[shift], sandwich(system)[shift, shift]
