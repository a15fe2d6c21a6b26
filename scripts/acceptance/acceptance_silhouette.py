"""The benchmark of the silhouette tier: scanned particles, 100 frames, 60 views, 0.2 px boundary noise, started from nothing.

``python -m scripts.acceptance.acceptance_silhouette --particles FOLDER --out out/silhouette [--sequences 120] [--jobs 2]``. Every sequence
is made, estimated and scored in one piece of work whose row is written when it is done, so a killed run goes on where it was. Prints
medians relative to speed and spin, shares inside the tolerances, coverage, error over the bound, and each worse sequence with its cause.
``--result FILE.json`` writes these, and beside them ``FILE.csv``: speed, spin and errors of every sequence.
"""

import argparse
import json
import time
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from datasets.atomic_files import written_whole
from datasets.recipes.recipe import ParticleRecipe, Recipe
from datasets.scoring.efficiency import efficiency
from datasets.scoring.metrics import COMPONENTS
from datasets.scoring.score import score
from datasets.scoring.table import coverage, score_table, status_counts, worse_sequences
from estimator.data.configuration import Configuration
from estimator.measuring.free_flight import estimate
from studies.flights.bodies import scanned_files
from synth.flight_bound import with_bound
from synth.sequence import build_silhouette_sequence
from tumble.cli.options import add_engine, executor_of
from tumble.engine import Item, failures, run
from tumble.progress import progress

ERRORS = ["middle_in_plane_percent", "middle_out_of_plane_percent", "middle_angular_percent", "middle_angular_rads"]


def one_sequence(payload: dict[str, Any]) -> dict[str, Any]:
    """Make, estimate and score one sequence; writes its row."""
    recipe = Recipe(seed=payload["seed"], sequences=payload["sequences"], particle=ParticleRecipe(files=tuple(payload["files"])))
    observation, truth = build_silhouette_sequence(recipe, payload["index"])
    truth = with_bound(truth, observation.cameras[0], recipe.noise)
    began = time.process_time()
    result = estimate(observation, Configuration())
    row = {**score(result, truth), "estimate_cpu_s": time.process_time() - began, "message": result.message}
    with written_whole(Path(payload["product"])) as path:
        path.write_text(json.dumps({key: _plain(value) for key, value in row.items()}))
    return {"status": row["status"]}


def _plain(value: Any) -> Any:
    return value.item() if isinstance(value, np.generic) else value


def summary(table: pd.DataFrame) -> dict[str, Any]:
    """The figures a reader asks for first."""
    errors = {key: table[f"middle_{key}_percent"] for key in ("in_plane", "out_of_plane", "angular")}
    covered = coverage(table)
    ratio = covered.assign(square=covered["rmse_over_bound"] ** 2).groupby("instant")["square"].mean() ** 0.5
    worse = worse_sequences(table)
    return {
        "seed": int(table.attrs["seed"]),
        "sequences": len(table),
        "status": status_counts(table).to_dict("records"),
        "median_percent": {key: float(value.median()) for key, value in errors.items()},
        "share_in_plane_within_0.5_percent": float((errors["in_plane"] <= 0.5).mean()),
        "share_angular_within_1_percent": float((errors["angular"] <= 1.0).mean()),
        "coverage": covered.round(4).to_dict("records"),
        "coverage_v": float(covered[covered["component"].str.startswith("v")]["coverage"].mean()),
        "coverage_omega": float(covered[covered["component"].str.startswith("w")]["coverage"].mean()),
        "median_error_over_bound": {c: float(np.nanmedian(np.abs(table[f"middle_over_bound_{c}"])) / 0.6745) for c in COMPONENTS},
        "rmse_over_bound": {str(k): float(v) for k, v in ratio.items()},
        "over_bound_of_true_body": efficiency(table).to_dict("records"),
        "median_estimate_cpu_s": float(table["estimate_cpu_s"].median()),
        "worse": [{k: None if isinstance(v, float) and np.isnan(v) else v for k, v in row.items()} for row in worse.to_dict("records")],
        "worse_causes": {str(k): int(v) for k, v in worse["cause"].value_counts().items()},
    }


def slim(table: pd.DataFrame) -> pd.DataFrame:
    """What a page needs of every sequence, in the order they were drawn."""
    number = table["sequence"].str.rsplit("-", n=1).str[-1].astype(int)
    return table.assign(number=number).sort_values("number")[["sequence", "speed_ms", "spin_rads", *ERRORS]]


def main() -> int:
    """Run what is missing, print and write the result."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--particles", type=Path, required=True, help="folder with the scanned particles (PLY)")
    parser.add_argument("--out", type=Path, default=Path("out/acceptance_silhouette"))
    parser.add_argument("--result", type=Path, help="where to write the summary as JSON; a CSV comes beside it")
    parser.add_argument("--sequences", type=int, default=120)
    parser.add_argument("--seed", type=int, default=43003731)
    add_engine(parser)
    arguments = parser.parse_args()
    files = scanned_files(arguments.particles)
    arguments.out.mkdir(parents=True, exist_ok=True)
    common = {"seed": arguments.seed, "sequences": arguments.sequences, "files": files}
    items = []
    for index in range(arguments.sequences):
        product = arguments.out / f"{arguments.seed}-{index:04d}.json"
        items.append(Item(product.stem, {**common, "index": index, "product": product}, product, apart=("sequences",)))
    with progress("sequences", len(items), quiet=False) as advance:
        outcomes = run(one_sequence, items, executor=executor_of(arguments), advance=advance)
    for outcome in failures(outcomes):
        print(f"{outcome.name} failed: {outcome.message}")
    table = score_table([json.loads(item.product.read_text()) for item in items if item.product.exists()])
    table.to_csv(arguments.out / "table.csv", index=False)
    table.attrs["seed"] = arguments.seed
    result = summary(table)
    text = json.dumps(result, indent=1, allow_nan=False)
    print(text)
    if arguments.result:
        arguments.result.parent.mkdir(parents=True, exist_ok=True)
        arguments.result.write_text(text + "\n")
        slim(table).to_csv(arguments.result.with_suffix(".csv"), index=False, float_format="%.6g", lineterminator="\n")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
