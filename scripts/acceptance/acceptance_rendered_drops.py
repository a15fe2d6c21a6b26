"""Five particles, ten drops each on a plate in the picture: rendered, measured from nothing, and set against contact models.

``python -m scripts.acceptance.acceptance_rendered_drops --out out/rendered_drops [--experiments 5] [--runs 10] [--seed N] [--jobs 2]``.
Each drop is rendered, measured and scored in one piece of work, so a killed run goes on where it was (with the same seed); its pictures,
300 MB, are removed then, and its outlines stay as an observation of their own, so that ``tumble validate-contact OUT/estimates
--observations OUT/observations`` shows everything. Prints how many impacts were found and how wrong times and velocities are, the largest
RMS ETE of the runs that converged, and what the models make of them. ``--result FILE.json``, ``--page FILE.md`` (with its picture beside
it) write these.
"""

import argparse
import json
import shutil
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from datasets.atomic_files import written_whole
from datasets.dataset_files import observation_folder, truth_folder
from datasets.estimate_files import write_estimate
from datasets.json_documents import plain
from datasets.observation import Observation
from datasets.observation_files import read_observation, write_observation
from datasets.recipes.recipe import DropperRecipe, EffectRecipe, ParticleRecipe, PlateRecipe, Recipe
from datasets.scoring.impacts import impact_table, score_impacts
from datasets.truth_files import read_truth
from estimator.contact_validation.validate import Question, validate
from estimator.data.configuration import Configuration
from estimator.measure import measure
from estimator.outlines.recording import view_outlines_of
from estimator.outlines.sightings import tracks_of
from scripts.acceptance.acceptance_runs import acceptance_parser, run_missing, seed_of, write_figures
from scripts.acceptance.impact_figures import impact_figures, impacts_table, not_found, statuses_of
from synth.rendering.sequence import render_sequence
from tumble.contact_documents import validation_document
from tumble.contact_validating import Known, collected
from tumble.engine import Item
from tumble.reports.contact_charts import draw_experiment, experiments_of, run_label

MODELS = ("stronge_impulse", "hertz_mindlin", "frictionless", "sphere_equivalent")
LARGEST_ETE_PX = 1.5
COMPLIANCE = EffectRecipe("tangential_compliance", {"ratio": 1.0})


def recipe_of(seed: int, experiments: int, runs: int) -> Recipe:
    """Experiments of a particle, a plate and a fall of their own, whose contact has Mindlin's tangential compliance."""
    return Recipe(
        name="rendered_drops",
        seed=seed,
        sequences=experiments * runs,
        tier="rendered",
        particle=ParticleRecipe(irregularity=0.5, size_mm=(4.0, 7.0)),
        plate=PlateRecipe(tilt_deg=(10.0, 30.0)),
        dropper=DropperRecipe(runs=runs, height_mm=(60.0, 150.0)),
        contact_physics=(COMPLIANCE,),
    )


def one_drop(payload: dict[str, Any]) -> dict[str, Any]:
    """Render, measure and score one drop; leaves its outlines, its estimate and the rows of its impacts."""
    out = Path(payload["out"])
    pictures = out / "pictures" / f"{payload['index']:04d}"
    name = render_sequence(recipe_of(payload["seed"], payload["experiments"], payload["runs"]), payload["index"], pictures)
    observation, truth = read_observation(observation_folder(pictures, name)), read_truth(truth_folder(pictures, name))
    began = time.process_time()
    result = measure(observation, Configuration())
    spent = time.process_time() - began
    write_observation(_outlines_alone(observation), observation_folder(out, name))
    write_estimate(result, out / "estimates" / f"{name}.estimate.json")
    ete = float(result.statistics.get("rms_ete_px", float("nan")))
    told = {"status": result.status.value, "message": result.message, "rms_ete_px": ete, "cpu_s": spent}
    rows = [{**row, **told} for row in score_impacts(result, truth)]
    with written_whole(Path(payload["product"])) as path:
        path.write_text(json.dumps(plain(rows)))
    shutil.rmtree(pictures)
    return {"status": result.status.value}


def _outlines_alone(observation: Observation) -> Observation:
    """The observation with what was seen in place of the pictures."""
    views = view_outlines_of(observation.view_recording, observation.views)
    recordings = tuple(track.outlines for track in tracks_of(observation))
    return replace(observation, recordings=recordings, view_recording=views.outlines)


def summary(table: pd.DataFrame, document: Mapping[str, Any], asked: Mapping[str, Any]) -> dict[str, Any]:
    """The figures that are asked for."""
    runs = table.drop_duplicates("sequence")
    accepted = runs[runs["status"] == "converged"]
    return {
        **asked,
        **impact_figures(table),
        "accepted": len(accepted),
        "largest_ete_px": float(accepted["rms_ete_px"].max()),
        "median_ete_px": float(accepted["rms_ete_px"].median()),
        "verdict": document["verdict"],
        "models": [_model(model, document["impacts"]) for model in document["models"]],
        "validation": {key: document[key] for key in ("impacts", "models", "left_out", "broken")},
    }


def _model(model: Mapping[str, Any], impacts: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Median differences of held-out predictions from what was measured; some velocities are too loose for RMS."""
    apart = np.array(model["predicted"]) - np.array([impact["after"] for impact in impacts])
    v, omega = (float(np.median(np.linalg.norm(apart[:, part], axis=1))) for part in (slice(0, 3), slice(3, 6)))
    return {"key": model["key"], "title": model["title"], "v_ms": v, "omega_rads": omega, "held_out_log_score": model["held_out_log_score"]}


def picture(document: Mapping[str, Any], path: Path) -> None:
    """Per experiment the speeds after each impact, linear and angular: measured and predicted."""
    experiments = experiments_of(document["impacts"])
    figure = Figure(figsize=(3.4 * len(experiments), 5.0), layout="constrained")
    axes = figure.subplots(2, len(experiments), squeeze=False)
    for column, (name, rows) in enumerate(experiments):
        draw_experiment(axes[0, column], axes[1, column], document, rows)
        axes[0, column].set_title(name, fontsize=9)
        axes[1, column].set_xlabel("run")
        for row in axes[:, column]:
            row.set_xticks(range(len(rows)), [run_label(document["impacts"][k]["name"]) for k in rows], rotation=60)
            if column:
                row.set_ylabel("")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=len(labels), frameon=False)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=110)


def page(result: Mapping[str, Any], picture_name: str) -> str:
    """The figures as a page."""
    models = "\n".join(
        f"| {m['title']} | {m['v_ms']:.4f} | {m['omega_rads']:.2f} | {m['held_out_log_score']:.1f} |" for m in result["models"]
    )
    verdict = result["verdict"]
    return f"""# Drops on a plate, rendered

{result["experiments"]} particles of the project's own, {result["runs"]} drops each, on an inclined plate in the picture; rendered, started
from nothing. Seed {result["seed"]}; written by `python -m scripts.acceptance.acceptance_rendered_drops`.

{impacts_table(result)}

Statuses: {statuses_of(result)}. RMS ETE of the {result["accepted"]} runs that converged: {result["median_ete_px"]:.3f} px in the median,
{result["largest_ete_px"]:.3f} px at most (asked: below {LARGEST_ETE_PX:g} px). Median computing time {result["median_cpu_s"]:.1f} s.

![Speeds after each impact, measured and predicted, five experiments]({picture_name})

Speeds after each impact: high-speed video with 95% intervals beside what contact models say that were fitted to other runs. "03·2" is the
second impact of run 03. Bars that leave the frame are of velocities between impacts a few frames apart.

| model | median difference of v, held out (m/s) | of ω (rad/s) | log score, held out |
| --- | --- | --- | --- |
{models}

The contact was made with Mindlin's tangential compliance; the verdict: {", ".join((verdict["kind"], *verdict["missing"]))}.

{not_found(result)}
"""


def items_of(arguments: argparse.Namespace, seed: int) -> list[Item]:
    """One piece of work per drop."""
    asked = {"seed": seed, "experiments": arguments.experiments, "runs": arguments.runs, "out": str(arguments.out)}
    found = []
    for index in range(arguments.experiments * arguments.runs):
        product = arguments.out / "rows" / f"{seed}-{index:04d}.json"
        found.append(Item(product.stem, {**asked, "index": index, "product": product}, product))
    return found


def rows_of(items: Sequence[Item]) -> list[dict[str, Any]]:
    """Rows of the drops that are done."""
    return [row for item in items if item.product.exists() for row in json.loads(item.product.read_text())]


def main() -> int:
    """Run what is missing, print and write the result."""
    parser = acceptance_parser(__doc__, "out/rendered_drops")
    parser.add_argument("--experiments", type=int, default=5)
    parser.add_argument("--runs", type=int, default=10)
    arguments = parser.parse_args()
    seed = seed_of(arguments)
    items = items_of(arguments, seed)
    for folder in ("rows", "estimates"):
        (arguments.out / folder).mkdir(parents=True, exist_ok=True)
    run_missing(one_drop, items, arguments, "drops")
    table = impact_table(rows_of(items))
    table.to_csv(arguments.out / "table.csv", index=False)
    found = collected(arguments.out / "estimates", arguments.out / "observations", Known())
    validation = validate(found.impacts, Question(models=MODELS, seed=0), print)
    document = plain(validation_document("estimates", validation, found.left_out, found.broken))
    asked = {"seed": seed, "experiments": arguments.experiments, "runs": arguments.runs}
    result = plain(summary(table, document, asked))
    print(json.dumps({key: value for key, value in result.items() if key != "validation"}, indent=1))
    shown = "" if arguments.page is None else f"{arguments.page.stem}.png"
    write_figures(result, page(result, shown), arguments)
    if arguments.page is not None:
        picture(document, arguments.page.with_name(shown))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
