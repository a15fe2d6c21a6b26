"""The Cramér-Rao bound of the true body by class of body: what the outlines of flights allow anybody to know of their velocities.

``python -m scripts.true_body_bound --particles FOLDER --count 8 --seed N [--correlation PX] [--mass-prior UM MOMENTS PRODUCTS]``.
Sequences are those of :mod:`scripts.study_surface_fit` of that seed; nothing is estimated. Printed: root mean squares over sequences of
one component's bound (:mod:`synth.flight_bound`). ``--mass-prior``: the body's surface is known, its centre of mass to so many
micrometres along each axis, moments and products of its inertia to these shares. ``--each``: a line per sequence.
"""

import argparse
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from datasets.recipes.recipe import NoiseRecipe, ParticleRecipe, Recipe
from datasets.scoring.efficiency import QUANTITIES
from datasets.scoring.metrics import COMPONENTS
from scripts.study_surface_fit import classes
from synth.flight_bound import MassPrior, flight_bound
from synth.sequence import plan_sequence, truth_of

Array = NDArray[np.float64]


def bounds(particle: ParticleRecipe, noise: NoiseRecipe, mass: MassPrior | None, *, seed: int, count: int) -> tuple[list[str], Array]:
    """Names of sequences and standard deviations (count, 6) of their bounds, SI."""
    names, found = [], []
    for index in range(count):
        plan = plan_sequence(Recipe(seed=seed, sequences=index + 1, particle=particle), index)
        bound = flight_bound(truth_of(plan), plan.hsv, noise, mass=mass)
        assert bound is not None
        names.append(f"{plan.name}, {1e3 * plan.descriptors['size_m']:.1f} mm")
        found.append(np.sqrt(np.diag(bound.covariance)))
    return names, np.array(found)


def line(name: str, count: int, sigma: Array) -> str:
    """The quantities' root mean squares over standard deviations (n, 6)."""
    cells = []
    for quantity in QUANTITIES:
        own = sigma[:, [COMPONENTS.index(component) for component in quantity.components]]
        cells.append(f"{quantity.per_si * np.sqrt(np.mean(own**2)):18.4f}")
    return f"{name:36} {count:>3}  {'  '.join(cells)}"


def main() -> int:
    """Compute and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--particles", type=Path, required=True, help="folder with the scanned particles (PLY)")
    parser.add_argument("--count", type=int, default=8, help="sequences of each class")
    parser.add_argument("--seed", type=int, default=20261126)
    parser.add_argument("--correlation", type=float, default=0.0, help="noise.correlation_px")
    parser.add_argument("--mass-prior", type=float, nargs=3, metavar=("UM", "MOMENTS", "PRODUCTS"))
    parser.add_argument("--each", action="store_true", help="a line per sequence")
    arguments = parser.parse_args()
    noise, given = NoiseRecipe(correlation_px=arguments.correlation), arguments.mass_prior
    mass = None if given is None else MassPrior(1e-6 * given[0], given[1], given[2])
    print(f"{'class':36} {'n':>3}  " + "  ".join(f"{f'{q.name}, {q.unit}':>18}" for q in QUANTITIES))
    for name, particle in classes(arguments.particles).items():
        names, sigma = bounds(particle, noise, mass, seed=arguments.seed, count=arguments.count)
        if arguments.each:
            print("\n".join(line(f"  {each}", 1, own[None]) for each, own in zip(names, sigma, strict=True)))
        print(line(name, len(sigma), sigma), flush=True)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
