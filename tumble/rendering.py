"""Makes a dataset from a recipe, one sequence per item; observations and truth go to trees of their own."""

import json
from pathlib import Path
from typing import Any

from datasets.atomic_files import written_whole
from datasets.dataset_files import Dataset, observation_folder, truth_folder, write_dataset
from datasets.observation_files import write_observation
from datasets.recipes.recipe import Recipe
from datasets.recipes.toml_files import recipe_from_dict, recipe_to_dict
from datasets.truth_files import write_truth
from synth.flight_bound import with_bound
from synth.rendering.sequence import render_sequence, rig_is_rendered
from synth.rendering.variant import choose_variant
from synth.sequence import build_silhouette_sequence
from tumble.engine import Executor, Item, Outcome, State, run
from tumble.progress import PULSE, progress, write_pulse
from tumble.versions import versions

FINISHED = "finished"
"""Folder of the markers of finished sequences."""


def variant_of(recipe: Recipe) -> str | None:
    """The renderer variant that this machine uses for ``recipe``; ``None`` where nothing is rendered."""
    rendered = recipe.tier == "rendered" or rig_is_rendered(recipe)
    return choose_variant(recipe.rendering.variant) if rendered else None


def render_dataset(recipe: Recipe, out: Path, *, executor: Executor, quiet: bool) -> tuple[Outcome, ...]:
    """Render every sequence of ``recipe`` that ``out`` lacks, then write ``dataset.json`` with those that are there."""
    items = [_item(recipe, index, out) for index in range(recipe.sequences)]
    for stale in (out / FINISHED).glob(f"*{PULSE}"):
        stale.unlink(missing_ok=True)
    with progress("render", len(items), quiet=quiet, pulses=out / FINISHED) as advance:
        outcomes = run(render_item, items, executor=executor, advance=advance)
    names = tuple(
        json.loads(item.product.read_text(encoding="utf-8"))["name"]
        for item, outcome in zip(items, outcomes, strict=True)
        if outcome.state is not State.FAILED
    )
    write_dataset(Dataset(recipe.name, names, recipe.seed, recipe_to_dict(recipe), versions(), variant_of(recipe)), out)
    return outcomes


def render_item(payload: dict[str, Any]) -> dict[str, Any]:
    """Make one sequence; its marker is written last."""
    recipe = recipe_from_dict(payload["recipe"], "recipe")
    out, index = Path(payload["out"]), int(payload["index"])
    product = Path(payload["product"])
    name = _render(recipe, index, out, product.with_suffix(PULSE)) if variant_of(recipe) else _project(recipe, index, out)
    result = {"name": name}
    with written_whole(product) as temporary:
        temporary.write_text(json.dumps(result) + "\n", encoding="utf-8")
    return result


def _project(recipe: Recipe, index: int, out: Path) -> str:
    observation, truth = build_silhouette_sequence(recipe, index)
    truth = with_bound(truth, observation.cameras[0], recipe.noise)
    write_truth(truth, truth_folder(out, truth.name))
    write_observation(observation, observation_folder(out, observation.name))
    return observation.name


def _render(recipe: Recipe, index: int, out: Path, pulse: Path) -> str:
    try:
        return render_sequence(recipe, index, out, advance=lambda done, total: write_pulse(pulse, done, total))
    finally:
        pulse.unlink(missing_ok=True)


def _item(recipe: Recipe, index: int, out: Path) -> Item:
    product = out / FINISHED / f"{index:04d}.json"
    payload = {"recipe": recipe_to_dict(recipe), "index": index, "out": out, "product": product}
    return Item(f"{index:04d}", payload, product)
