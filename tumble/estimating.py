"""Estimates every observation of a folder, one per item. Reads observations only; truth need not exist."""

from pathlib import Path
from typing import Any

from datasets.estimate_files import write_estimate
from datasets.observation_files import read_observation
from datasets.particle_files import read_particle, with_particle
from estimator.data.configuration import configuration_from_dict
from estimator.measure import measure
from tumble.engine import Executor, Item, Outcome, run
from tumble.notes import tell_notes
from tumble.progress import progress
from tumble.result_files import estimate_path, observations_in


def estimate_all(
    source: Path, configuration: dict[str, Any], out: Path, *, executor: Executor, quiet: bool, particle: Path | None = None
) -> tuple[Outcome, ...]:
    """Estimate every observation of ``source`` that ``out`` lacks; ``particle``: the particle file to take the views from, not theirs."""
    items = [_item(folder, configuration, out, particle) for folder in observations_in(source)]
    with progress("estimate", len(items), quiet=quiet) as advance:
        outcomes = run(estimate_item, items, executor=executor, advance=advance)
    tell_notes((note for outcome in outcomes for note in outcome.result.get("notes", ())), quiet=quiet)
    return outcomes


def estimate_item(payload: dict[str, Any]) -> dict[str, Any]:
    """Estimate one observation and write the result."""
    observation = read_observation(Path(payload["observation"]))
    if payload["particle"] is not None:
        observation = with_particle(observation, read_particle(Path(payload["particle"])))
    result = measure(observation, configuration_from_dict(payload["configuration"]))
    write_estimate(result, Path(payload["product"]))
    return {"status": result.status.value, "notes": list(observation.notes)}


def _item(folder: Path, configuration: dict[str, Any], out: Path, particle: Path | None) -> Item:
    product = estimate_path(out, folder.name)
    payload = {"observation": folder, "configuration": configuration, "product": product, "particle": particle}
    return Item(folder.name, payload, product)
