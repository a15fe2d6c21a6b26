"""The Cramér-Rao bound of the true body by class of body: what the outlines of flights allow anybody to know of their velocities.

``python -m scripts.trials.true_body_bound --particles FOLDER --count 8 --seed N [--correlation PX] [--mass-prior UM MOMENTS PRODUCTS]``.
Classes of bodies are those of :mod:`studies.plans.surface_fit`; nothing is estimated. Printed: root mean squares over sequences of
one component's bound (:mod:`synth.flight_bound`). ``--mass-prior``: the body's surface is known, its centre of mass to so many
micrometres along each axis, moments and products of its inertia to these shares. ``--each``: a line per sequence. ``--oracle``: besides,
errors of :mod:`tests.reference.true_body_oracle` on the same sequences over the bound, and how many of its 95% ellipsoids hold the truth.
"""

import argparse
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from datasets.observation import Observation
from datasets.recipes.recipe import NoiseRecipe, ParticleRecipe, Recipe
from datasets.scoring.efficiency import QUANTITIES, Quantity
from datasets.scoring.metrics import COMPONENTS
from datasets.scoring.score import ELLIPSOID_95, VECTORS
from datasets.truth import Truth
from studies.plans.surface_fit import classes
from synth.flight_bound import MassPrior, flight_bound
from synth.sequence import build_silhouette_sequence
from tests.reference.true_body_oracle import Oracle

Array = NDArray[np.float64]
ROUNDS = 2
"""Of the oracle, which starts from the truth; two more change errors by some hundredths of their bound."""


def bounded(particle: ParticleRecipe, noise: NoiseRecipe, *, seed: int, count: int) -> Iterator[tuple[Observation, Truth]]:
    """Sequences of a class of body."""
    for index in range(count):
        yield build_silhouette_sequence(Recipe(seed=seed, sequences=index + 1, particle=particle, noise=noise), index)


def line(name: str, count: int, sigma: Array) -> str:
    """The quantities' root mean squares over standard deviations (n, 6)."""
    cells = [f"{quantity.per_si * _rms(sigma, quantity):18.4f}" for quantity in QUANTITIES]
    return f"{name:36} {count:>3}  {'  '.join(cells)}"


def oracle_line(errors: Array, covariances: Array) -> str:
    """Root mean squares of errors (n, 6) each over its bound, of covariances (n, 6, 6), and shares of ellipsoids that hold the truth."""
    ratios = errors / np.sqrt(np.diagonal(covariances, axis1=1, axis2=2))
    cells = [f"{_rms(ratios, quantity):18.2f}" for quantity in QUANTITIES]
    whole = []
    for name, own in VECTORS.items():
        distance = np.einsum("ni,nij,nj->n", errors[:, own], np.linalg.inv(covariances[:, own, own]), errors[:, own])
        whole.append(f"{name} {100 * np.mean(distance <= ELLIPSOID_95):.0f}%")
    return f"{'  oracle over bound':36} {'':>3}  {'  '.join(cells)}  95% ellipsoids: {', '.join(whole)}"


def _rms(values: Array, quantity: Quantity) -> float:
    own = values[:, [COMPONENTS.index(component) for component in quantity.components]]
    return float(np.sqrt(np.mean(own**2)))


def main() -> int:
    """Compute and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--particles", type=Path, required=True, help="folder with the scanned particles (PLY)")
    parser.add_argument("--count", type=int, default=8, help="sequences of each class")
    parser.add_argument("--seed", type=int, default=20261126)
    parser.add_argument("--classes", nargs="+", default=["smooth", "stones", "cut", "jagged"])
    parser.add_argument("--correlation", type=float, default=0.0, help="noise.correlation_px")
    parser.add_argument("--mass-prior", type=float, nargs=3, metavar=("UM", "MOMENTS", "PRODUCTS"))
    parser.add_argument("--each", action="store_true", help="a line per sequence")
    parser.add_argument("--oracle", action="store_true", help="estimates that know the body, too")
    arguments = parser.parse_args()
    if arguments.oracle and arguments.mass_prior:
        parser.error("expected --oracle or --mass-prior, got both: the oracle knows the mass properties")
    noise, given = NoiseRecipe(correlation_px=arguments.correlation), arguments.mass_prior
    mass = None if given is None else MassPrior(1e-6 * given[0], given[1], given[2])
    print(f"{'class':36} {'n':>3}  " + "  ".join(f"{f'{q.name}, {q.unit}':>18}" for q in QUANTITIES))
    for name in arguments.classes:
        particle = classes(arguments.particles)[name]
        covariances, errors = [], []
        for observation, truth in bounded(particle, noise, seed=arguments.seed, count=arguments.count):
            bound = flight_bound(truth, observation.cameras[0], noise, mass=mass)
            assert bound is not None
            covariances.append(bound.covariance)
            if arguments.each:
                print(line(f"  {truth.name}, {1e3 * truth.descriptors['size_m']:.1f} mm", 1, np.sqrt(np.diag(bound.covariance))[None]))
            if arguments.oracle:
                oracle = Oracle(truth, observation.cameras[0], noise, observation.gravity_world)
                errors.append(oracle.error([outline.points_px for outline in observation.recordings[0]], rounds=ROUNDS))
        print(line(name, len(covariances), np.sqrt(np.diagonal(covariances, axis1=1, axis2=2))), flush=True)
        if errors:
            print(oracle_line(np.array(errors), np.array(covariances)), flush=True)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
