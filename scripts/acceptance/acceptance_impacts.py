"""Impacts in the silhouette tier: particles dropped on a plate, 40-60 frames before and after, 0.2 px boundary noise, from nothing.

``python -m scripts.acceptance.acceptance_impacts --out out/impacts_study [--sequences 100] [--seed N] [--jobs 2]``. Every sequence is a
particle, a plate and a fall of its own; the seed is drawn anew, and printed, where none is given. Each is made, estimated and scored in one
piece of work whose rows are written when it is done, so a killed run goes on where it was (with the same seed). Prints the share of impacts
found, the error of their times, errors of the velocities after them, and how often 95% intervals hold the truth, of all impacts and of the
first of each sequence. ``--result FILE.json`` writes these; ``--page FILE.md`` a page of them.

``--fits tangents samples [--bodies cut jagged smooth --particles FOLDER]``: each sequence by tangents and by samples (`surface_fit`), and
instead of the above the errors of both beside one another: of the velocities before the first impact and after the last, of restitution and
of the ratio of impulses, with pulls and the share of 95% intervals and ellipsoids that hold the truth.
"""

import json
import time
from pathlib import Path
from typing import Any

import numpy as np

from datasets.atomic_files import written_whole
from datasets.estimate import Estimate
from datasets.recipes.recipe import DropperRecipe, ParticleRecipe, PlateRecipe, Recipe
from datasets.scoring.impacts import impact_table, score_impacts
from datasets.truth import Truth
from estimator.data.configuration import Configuration
from estimator.measure import measure
from scripts.acceptance.acceptance_runs import acceptance_parser, run_missing, seed_of, write_figures
from scripts.acceptance.impact_figures import (
    compared_figures,
    compared_table,
    contact_errors,
    impact_figures,
    impacts_table,
    not_found,
    statuses_of,
)
from studies.flights.bodies import REGULAR
from synth.sequence import build_silhouette_sequence
from tumble.engine import Item

FITS = {
    "default": Configuration(),
    "tangents": Configuration(surface_fit=0),
    "samples": Configuration(surface_fit=2, offset_prior_px=0.001),
}
"""By samples, outlines have no offset here, and who knows that states it: beside gravity their size alone says how far away a body is."""

FITTED = {
    "default": "as by default",
    "tangents": "by tangents alone (`surface_fit = 0`; no longer the default)",
    "samples": "by samples (`surface_fit = 2`)",
}
"""How the page says it."""


def particle_of(body: str, particles: str) -> ParticleRecipe:
    """The particles of a kind of ``body``; scanned ones lie in the folder ``particles``."""
    if body == "smooth":
        return ParticleRecipe(files=tuple(str(Path(particles) / f"{name}.ply") for name in REGULAR), size_mm=(4.0, 7.0))
    return ParticleRecipe(family="jagged" if body == "jagged" else "cut_stone", irregularity=0.5, size_mm=(4.0, 7.0))


def recipe_of(seed: int, sequences: int, particle: ParticleRecipe) -> Recipe:
    """One run per experiment: each sequence has a particle, a plate and a fall of its own."""
    dropper = DropperRecipe(runs=1, height_mm=(60.0, 150.0))
    return Recipe(seed=seed, sequences=sequences, particle=particle, plate=PlateRecipe(tilt_deg=(10.0, 30.0)), dropper=dropper)


def one_sequence(payload: dict[str, Any]) -> dict[str, Any]:
    """Make, estimate and score one sequence; writes the rows of its impacts."""
    recipe = recipe_of(payload["seed"], payload["sequences"], particle_of(payload["body"], payload["particles"]))
    observation, truth = build_silhouette_sequence(recipe, payload["index"])
    rows, told = [], {}
    for fit in payload["fits"]:
        began = time.process_time()
        result = measure(observation, FITS[fit])
        spent = time.process_time() - began
        told = {"status": result.status.value, "message": result.message, "cpu_s": spent, "fit": fit, "body": payload["body"]}
        rows += [{**row, **told} for row in _scored(result, truth)]
    with written_whole(Path(payload["product"])) as path:
        path.write_text(json.dumps([{key: _plain(value) for key, value in row.items()} for row in rows]))
    return {"status": told["status"]}


def _scored(result: Estimate, truth: Truth) -> list[dict[str, Any]]:
    """The rows of a sequence's impacts; what contact models are fitted to, where the first was a single contact."""
    rows = score_impacts(result, truth)
    if rows and rows[0]["found"] and rows[0]["contacts"] == 1:
        nearest = min(result.impacts, key=lambda impact: abs(impact.time_s - truth.impacts[0].time_s))
        rows[0] |= contact_errors(nearest, truth.impacts[0])
    return rows


def _plain(value: Any) -> Any:
    return value.item() if isinstance(value, np.generic) else value


def page(result: dict[str, Any]) -> str:
    """The figures as a page."""
    return f"""# Impacts in the silhouette tier

{result["sequences"]} particles dropped on an inclined plate, 40–60 frames before and after the first impact, 0.2 px boundary noise,
started from nothing, fitted {FITTED[result.get("fit", "tangents")]}. Seed {result["seed"]};
written by `python -m scripts.acceptance.acceptance_impacts`.

{impacts_table(result)}

Statuses: {statuses_of(result)}. Median computing time {result["median_cpu_s"]:.1f} s.

{not_found(result)}
"""


def main() -> int:
    """Run what is missing, print and write the result."""
    parser = acceptance_parser(__doc__, "out/acceptance_impacts")
    parser.add_argument("--sequences", type=int, default=100, help="of each kind of body")
    parser.add_argument("--fits", nargs="+", choices=list(FITS), default=["tangents"])
    parser.add_argument("--bodies", nargs="+", choices=["cut", "jagged", "smooth"], default=["cut"])
    parser.add_argument("--particles", default="", help="folder with the scanned particles (PLY)")
    arguments = parser.parse_args()
    seed, items = seed_of(arguments), []
    asked = {key: getattr(arguments, key) for key in ("sequences", "fits", "particles")}
    for body in arguments.bodies:
        for index in range(arguments.sequences):
            product = arguments.out / f"{body}-{'-'.join(arguments.fits)}-{seed}-{index:04d}.json"
            items.append(
                Item(product.stem, {"seed": seed, "body": body, "index": index, "product": product, **asked}, product, apart=("sequences",))
            )
    run_missing(one_sequence, items, arguments, "sequences")
    table = impact_table([row for item in items if item.product.exists() for row in json.loads(item.product.read_text())])
    table.to_csv(arguments.out / "table.csv", index=False)
    if len(arguments.fits) > 1:
        bodies = {body: compared_figures({fit: part for fit, part in of.groupby("fit")}) for body, of in table.groupby("body", sort=False)}
        told, text = {"seed": seed, "bodies": bodies}, compared_table(bodies, arguments.fits)
    else:
        told = {"seed": seed, "fit": arguments.fits[0], **impact_figures(table)}
        text = page(told)
    print(json.dumps(told, indent=1, allow_nan=False))
    write_figures(told, text, arguments)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
