"""Two particles that collide in flight, in the silhouette tier: made, measured from nothing, and scored.

``python -m scripts.acceptance.two_particles --out out/two_particles [--sequences 6] [--seed 20] [--jobs 1] [--result FILE.json] [--page
FILE.md]``. The recipe is ``scripts/acceptance/two_particles.toml``; the seed is its own where none is given, so the figures can be
repeated. Each pair is made, measured and scored in one piece of work whose rows are written when it is done, so a killed run goes on where
it was. Prints the error of the time of impact, errors of v and omega right before and after it, what the collision was against the truth,
and how often 95% intervals hold it. ``--fit tangents`` is without surfaces as unknowns (`surface_fit`), ``--fit samples`` always with them.
"""

import json
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from datasets.atomic_files import written_whole
from datasets.recipes.recipe import Recipe
from datasets.recipes.toml_files import load_recipe
from datasets.scoring.collisions import collision_summary, parts_of, score_collision
from datasets.scoring.impacts import SIDES, impact_summary, impact_table, score_impacts
from estimator.measure import measure
from scripts.acceptance.acceptance_impacts import FITS
from scripts.acceptance.acceptance_runs import acceptance_parser, run_missing, write_figures
from synth.sequence import build_silhouette_sequence
from tumble.engine import Item

RECIPE = Path(__file__).with_suffix(".toml")


def recipe_of(seed: int | None, sequences: int) -> Recipe:
    """The committed recipe with another number of pairs, and another seed where one is given."""
    recipe = load_recipe(RECIPE)
    return replace(recipe, sequences=sequences, seed=recipe.seed if seed is None else seed)


def one_pair(payload: dict[str, Any]) -> dict[str, Any]:
    """Make, measure and score one pair; writes its rows."""
    observation, truth = build_silhouette_sequence(recipe_of(payload["seed"], payload["sequences"]), payload["index"])
    began = time.process_time()
    result = measure(observation, FITS[payload["fit"]])
    frames = observation.further_recordings[0]
    told = {
        "cpu_s": time.process_time() - began,
        "message": result.message,
        "frames": len(frames),
        "merged": sum(outline.empty for outline in frames),  # type: ignore[union-attr]
        "contacts": len(truth.impacts[0].points_world),
    }
    impacts = [{**row, "sequence": name} for name, part, true in parts_of(result, truth) for row in score_impacts(part, true)]
    content = {"collision": {**score_collision(result, truth)[0], **told}, "impacts": impacts}
    with written_whole(Path(payload["product"])) as path:
        path.write_text(json.dumps(_plain(content)))
    return {"status": result.status.value}


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _plain(entry) for key, entry in value.items()}
    if isinstance(value, list):
        return [_plain(entry) for entry in value]
    return value.item() if isinstance(value, np.generic) else value


def summary(parts: list[dict[str, Any]], recipe: Recipe) -> dict[str, Any]:
    """The figures a reader asks for first, and every pair."""
    collisions, impacts = pd.DataFrame([part["collision"] for part in parts]), impact_table([r for part in parts for r in part["impacts"]])
    found = impacts[impacts["found"].astype(bool)]
    errors = {
        f"median_{side}_{key}": float(found[f"{side}_{key}"].median())
        for side in SIDES
        for key in ("in_plane_ms", "out_of_plane_ms", "angular_rads")
        if len(found)
    }
    return {
        "seed": recipe.seed,
        "pairs": len(collisions),
        "statuses": {str(k): int(v) for k, v in collisions["status"].value_counts().items()},
        "impacts": {**impact_summary(impacts), **errors},
        "collisions": collision_summary(collisions),
        "median_cpu_s": float(collisions["cpu_s"].median()),
        "each": json.loads(collisions.to_json(orient="records", double_precision=10)),
        "each_impact": json.loads(_shown(impacts).to_json(orient="records", double_precision=10)),
    }


def _shown(impacts: pd.DataFrame) -> pd.DataFrame:
    """The columns of the impacts that the page shows."""
    keys = ("in_plane_ms", "out_of_plane_ms", "angular_rads", "in_plane_percent", "angular_percent")
    wanted = ["sequence", "found", "time_error_frames", "time_sigma_frames", *(f"{side}_{key}" for side in SIDES for key in keys)]
    return impacts[[column for column in wanted if column in impacts]]


MEDIANS = (
    ("time of impact (frames)", "median_time_error_frames", "{:.3f}"),
    *(
        entry
        for side in SIDES
        for entry in (
            (f"in-plane v {side} (mm/s)", f"median_{side}_in_plane_ms", "{:.2f}"),
            (f"out-of-plane v {side} (mm/s)", f"median_{side}_out_of_plane_ms", "{:.1f}"),
            (f"in-plane v {side} (%)", f"median_{side}_in_plane_percent", "{:.3f}"),
            (f"ω {side} (rad/s)", f"median_{side}_angular_rads", "{:.2f}"),
            (f"ω {side} (%)", f"median_{side}_angular_percent", "{:.3f}"),
        )
    ),
)


def page(result: dict[str, Any]) -> str:
    """The figures as a page."""
    impacts, collisions = result["impacts"], result["collisions"]
    medians = "\n".join(f"| {name} | {_number(impacts, key, form)} |" for name, key, form in MEDIANS)
    rows = "\n".join(_row(each) for each in result["each"])
    statuses = ", ".join(f"{count} {status}" for status, count in result["statuses"].items())
    held = ", ".join(
        f"{name} {collisions[f'coverage_{key}']:.0%}"
        for name, key in (("e", "restitution"), ("impulse ratio", "impulse_ratio"), ("mass ratio by momentum", "momentum_mass_ratio"))
        if f"coverage_{key}" in collisions
    )
    return f"""# Two particles that collide

{result["pairs"]} pairs of cut stones that collide once in flight, seen by one camera in outlines with 0.2 px boundary noise, 60
calibrated views of each. Seed {result["seed"]}; written by `python -m scripts.acceptance.two_particles`. Where the two hide one another the
pictures show one outline, and those are left out: what is known of the impact comes from before and after.

Statuses: {statuses}. Median computing time {result["median_cpu_s"]:.0f} s per pair.

Medians of errors over the two impacts of every pair:

| | |
| --- | --- |
{medians}

Share of 95% intervals that hold the truth: time {_number(impacts, "coverage_time", "{:.0%}")}, v after
{_number(impacts, "coverage_after_v", "{:.0%}")}, ω after {_number(impacts, "coverage_after_omega", "{:.0%}")}; {held}.

Out-of-plane velocities are loose, as one camera sees them, and with them the direction of the impulse. {result["pairs"]} pairs say little
about how often intervals hold.

What each collision was, measured and (true). The mass ratio is by the volumes of the hulls, with one density taken for granted, and by the
two jumps of velocity; momentum is kept where they agree.

| pair | merged | normal off by | e | impulse ratio | mass ratio, volumes | by momentum | momentum kept |
| --- | --- | --- | --- | --- | --- | --- | --- |
{rows}
"""


def _number(told: dict[str, Any], key: str, form: str) -> str:
    scale = 1e3 if key.endswith("_ms") else 1.0
    return form.format(scale * told[key]) if key in told else "–"


def _row(each: dict[str, Any]) -> str:
    name = each["sequence"]
    if not each["found"]:
        return f"| {name} | {each['merged']} of {each['frames']} | {each['status']} | | | | | |"
    values = [
        f"{each[key]:.3f} ± {each[f'{key}_sigma']:.3f} ({each[f'{key}_true']:.3f})"
        for key in ("restitution", "impulse_ratio", "mass_ratio", "momentum_mass_ratio")
    ]
    off = f"{each['normal_error_deg']:.1f}° ± {each['normal_sigma_deg']:.1f}°"
    kept = "yes" if each["momentum_kept"] else "no"
    return f"| {name} | {each['merged']} of {each['frames']} | {off} | {' | '.join(values)} | {kept} |"


def main() -> int:
    """Run what is missing, print and write the result."""
    parser = acceptance_parser(__doc__, "out/two_particles")
    parser.add_argument("--sequences", type=int, default=6)
    parser.add_argument("--fit", choices=list(FITS), default="default")
    arguments = parser.parse_args()
    recipe = recipe_of(arguments.seed, arguments.sequences)
    items = []
    for index in range(arguments.sequences):
        product = arguments.out / f"{arguments.fit}-{recipe.seed}-{index:04d}.json"
        payload = {"seed": recipe.seed, "sequences": arguments.sequences, "index": index, "fit": arguments.fit, "product": product}
        items.append(Item(product.stem, payload, product, apart=("sequences",)))
    run_missing(one_pair, items, arguments, "pairs")
    parts = [json.loads(item.product.read_text()) for item in items if item.product.exists()]
    result = summary(parts, recipe)
    print(json.dumps({key: value for key, value in result.items() if key not in {"each", "each_impact"}}, indent=1, allow_nan=False))
    write_figures(result, page(result), arguments)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
