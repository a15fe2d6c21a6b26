"""Impacts in the silhouette tier: particles dropped on a plate, 40-60 frames before and after, 0.2 px boundary noise, from nothing.

``python -m scripts.acceptance_impacts --out out/impacts_study [--sequences 100] [--seed N] [--jobs 2]``. Every sequence is a particle, a
plate and a fall of its own; the seed is drawn anew, and printed, where none is given. Each is made, estimated and scored in one piece of
work whose rows are written when it is done, so a killed run goes on where it was (with the same seed). Prints the share of impacts found,
the error of their times, errors of the velocities after them, and how often 95% intervals hold the truth, of all impacts and of the first
of each sequence. ``--result FILE.json`` writes these; ``--page FILE.md`` a page of them.
"""

import json
import time
from pathlib import Path
from typing import Any

import numpy as np

from datasets.atomic_files import written_whole
from datasets.recipes.recipe import DropperRecipe, ParticleRecipe, PlateRecipe, Recipe
from datasets.scoring.impacts import impact_table, score_impacts
from estimator.data.configuration import Configuration
from estimator.measure import measure
from scripts.acceptance_runs import acceptance_parser, run_missing, seed_of, write_figures
from scripts.impact_figures import impact_figures, impacts_table, not_found, statuses_of
from synth.sequence import build_silhouette_sequence
from tumble.engine import Item


def recipe_of(seed: int, sequences: int) -> Recipe:
    """One run per experiment: each sequence has a particle, a plate and a fall of its own."""
    particle = ParticleRecipe(irregularity=0.5, size_mm=(4.0, 7.0))
    dropper = DropperRecipe(runs=1, height_mm=(60.0, 150.0))
    return Recipe(seed=seed, sequences=sequences, particle=particle, plate=PlateRecipe(tilt_deg=(10.0, 30.0)), dropper=dropper)


def one_sequence(payload: dict[str, Any]) -> dict[str, Any]:
    """Make, estimate and score one sequence; writes the rows of its impacts."""
    observation, truth = build_silhouette_sequence(recipe_of(payload["seed"], payload["sequences"]), payload["index"])
    began = time.process_time()
    result = measure(observation, Configuration())
    spent = time.process_time() - began
    told = {"status": result.status.value, "message": result.message, "cpu_s": spent}
    rows = [{**row, **told} for row in score_impacts(result, truth)]
    with written_whole(Path(payload["product"])) as path:
        path.write_text(json.dumps([{key: _plain(value) for key, value in row.items()} for row in rows]))
    return {"status": result.status.value}


def _plain(value: Any) -> Any:
    return value.item() if isinstance(value, np.generic) else value


def page(result: dict[str, Any]) -> str:
    """The figures as a page."""
    return f"""# Impacts in the silhouette tier

{result["sequences"]} particles dropped on an inclined plate, 40–60 frames before and after the first impact, 0.2 px boundary noise,
started from nothing. Seed {result["seed"]}; written by `python -m scripts.acceptance_impacts`.

{impacts_table(result)}

Statuses: {statuses_of(result)}. Median computing time {result["median_cpu_s"]:.1f} s.

{not_found(result)}
"""


def main() -> int:
    """Run what is missing, print and write the result."""
    parser = acceptance_parser(__doc__, "out/acceptance_impacts")
    parser.add_argument("--sequences", type=int, default=100)
    arguments = parser.parse_args()
    seed = seed_of(arguments)
    items = []
    for index in range(arguments.sequences):
        product = arguments.out / f"{seed}-{index:04d}.json"
        payload = {"seed": seed, "sequences": arguments.sequences, "index": index, "product": str(product)}
        items.append(Item(product.stem, payload, product))
    run_missing(one_sequence, items, arguments, "sequences")
    table = impact_table([row for item in items if item.product.exists() for row in json.loads(item.product.read_text())])
    table.to_csv(arguments.out / "table.csv", index=False)
    result = {"seed": seed, **impact_figures(table)}
    print(json.dumps(result, indent=1, allow_nan=False))
    write_figures(result, page(result), arguments)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
