"""How much of what a hull says of leaks of light is nature's, by how hollow its outlines are.

``python -m scripts.trials.study_hull_leaks [--bodies 24] [--seed N] [--result docs/results/hull_leaks.json --page
docs/studies/hull_leaks.md]``. Every body is calibrated and filmed once in the silhouette tier; the tables of its hull's outlines
(:mod:`estimator.geometry.outline_shape`) are compared with those of its true outlines in the same frames. Seeds are drawn unless one is
given.
"""

import json
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from datasets.recipes.recipe import MotionRecipe, ParticleRecipe, Recipe, RigRecipe
from estimator.appearance.model_errors import seen_outlines
from estimator.data.configuration import Configuration
from estimator.geometry.hollows import hollow_share
from estimator.geometry.outline_shape import DEPTHS_PX, as_of_a_hull, outline_shape
from estimator.measurements.silhouettes.registration import register
from scripts.trials.body_studies import LARGEST_SEED, body_study_arguments, write_body_study
from synth.sequence import build_silhouette_sequence

Array = NDArray[np.float64]
RECIPE = Recipe(motion=MotionRecipe(frames=24, speed_ms=(1.0, 2.0), spin_rads=(100.0, 200.0)), rig=RigRecipe(drops=6))
DEPTH = 1
"""Number of the loss that is looked at."""
FAMILIES, IRREGULARITY = ("cut_stone", "jagged"), (0.3, 0.8)


def body_row(family: str, irregularity: float, seed: int) -> dict[str, Any]:
    """One body: mean and spread of leaks over the loss, nature's and the hull's, and nature's slope on the hull's, drawn in or not."""
    recipe = replace(RECIPE, seed=seed, particle=ParticleRecipe(family=family, irregularity=irregularity))
    quiet = replace(recipe, noise=replace(recipe.noise, hsv_boundary_px=1e-3, spacing_px=0.25))
    exact, _ = build_silhouette_sequence(quiet, 0)
    registered = register([build_silhouette_sequence(recipe, 0)[0]], Configuration(campaign_surface_fit=0))
    (sequence,), (flight,), (particle,) = registered.campaign.sequences, registered.start.flights, registered.particles
    outlines = seen_outlines(sequence.task, flight, particle.casting_mesh)
    hull = outline_shape(outlines)
    true = outline_shape([exact.recordings[0][int(k)].points_px for k in sequence.task.sightings.frame]).leak[..., DEPTH]
    said, drawn = hull.leak[..., DEPTH], as_of_a_hull(hull, outlines).leak[..., DEPTH]
    return {
        "family": family,
        "irregularity": irregularity,
        "seed": seed,
        "hollow": hollow_share(outlines),
        "nature": [float(true.mean()), float(true.std())],
        "hull": [float(said.mean()), float(said.std())],
        "slope": slope(true, said),
        "slope_drawn_in": slope(true, drawn),
    }


def slope(true: Array, said: Array) -> float:
    """Slope of nature's leaks on what is said of them: 1 where what is said varies as much as it knows."""
    apart = said - said.mean()
    return float((apart * (true - true.mean())).sum() / (apart**2).sum())


def page(result: dict[str, Any]) -> list[str]:
    """The figures as lines of a page."""
    return [
        "# What hulls say of leaks of light",
        "",
        f"Written by `python -m scripts.trials.study_hull_leaks` with seed {result['seed']}. Recession of tangents over the loss of",
        f"{result['loss_px']:g} px, over directions and frames (mean ± standard deviation): of the true outlines, and of those that the",
        "hull casts, an exact one where bodies have hollows. A slope of nature's on the hull's below 1 would attenuate the size of a leak;",
        "the last column is that of what fits use, the hull's drawn towards its mean.",
        "",
        "| body | irregularity | hollow, % | nature | hull | slope | slope, drawn in |",
        "| --- | --- | --- | --- | --- | --- | --- |",
        *(f"| {' | '.join(_cells(row))} |" for row in result["bodies"]),
        "",
        "Medians of the two slopes: "
        + "; ".join(f"{family.replace('_', ' ')} {m['slope']:.2f} and {m['slope_drawn_in']:.2f}" for family, m in result["medians"].items())
        + ".",
    ]


def _cells(row: dict[str, Any]) -> list[str]:
    spreads = [f"{mean:.3f} ± {spread:.3f}" for mean, spread in (row["nature"], row["hull"])]
    slopes = [f"{row[key]:.2f}" for key in ("slope", "slope_drawn_in")]
    return [row["family"].replace("_", " "), f"{row['irregularity']:.2f}", f"{100 * row['hollow']:.1f}", *spreads, *slopes]


def main() -> int:
    """Measure the bodies, print and write what was found."""
    arguments = body_study_arguments(__doc__, 24)
    rng = np.random.default_rng(arguments.seed)
    bodies = []
    for number in range(arguments.bodies):
        bodies.append(body_row(FAMILIES[number % 2], float(rng.uniform(*IRREGULARITY)), int(rng.integers(LARGEST_SEED))))
        print(json.dumps(bodies[-1]), flush=True)
    kept = {family: [b for b in bodies if b["family"] == family] for family in FAMILIES}
    medians = {f: {k: float(np.median([b[k] for b in rows])) for k in ("slope", "slope_drawn_in")} for f, rows in kept.items() if rows}
    result = {"seed": arguments.seed, "loss_px": float(DEPTHS_PX[DEPTH]), "medians": medians, "bodies": bodies}
    print(json.dumps(medians))
    write_body_study(result, page, arguments)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
