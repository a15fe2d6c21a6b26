"""Estimates every observation of a folder, one per item. Reads observations only; truth need not exist."""

from pathlib import Path
from typing import Any

from estimator.configuration import configuration_from_dict
from estimator.pipeline import estimate

from datasets.errors import InputError
from datasets.estimate_files import write_estimate
from datasets.observation_files import FILE as OBSERVATION_FILE
from datasets.observation_files import read_observation
from tumble.engine import Item, Outcome, run
from tumble.progress import progress

SUFFIX = ".estimate.json"


def observations_in(source: Path) -> tuple[Path, ...]:
    """Observation folders of a dataset, of an ``observations`` folder, or ``source`` itself.

    Raises
    ------
    InputError
        Where there is none.
    """
    if (source / OBSERVATION_FILE).is_file():
        return (source,)
    root = source / "observations" if (source / "observations").is_dir() else source
    found = tuple(sorted(path.parent for path in root.glob(f"*/{OBSERVATION_FILE}"))) if root.is_dir() else ()
    if not found:
        came = "nothing like it" if source.exists() else "nothing"
        raise InputError(f"{source}: expected a dataset or an observation ({OBSERVATION_FILE} in it), came {came}.")
    return found


def estimate_path(out: Path, sequence: str) -> Path:
    """Where the estimate of ``sequence`` lies."""
    return out / f"{sequence}{SUFFIX}"


def estimates_in(folder: Path) -> tuple[Path, ...]:
    """Estimate files of a folder, or the file itself.

    Raises
    ------
    InputError
        Where there is none.
    """
    if folder.is_file():
        return (folder,)
    found = tuple(sorted(folder.glob(f"*{SUFFIX}"))) if folder.is_dir() else ()
    if not found:
        raise InputError(f"{folder}: expected estimates (*{SUFFIX}), came {'none' if folder.is_dir() else 'nothing'}.")
    return found


def estimate_all(source: Path, configuration: dict[str, Any], out: Path, *, jobs: int, quiet: bool) -> tuple[Outcome, ...]:
    """Estimate every observation of ``source`` that ``out`` lacks."""
    items = [_item(folder, configuration, out) for folder in observations_in(source)]
    with progress("estimate", len(items), quiet=quiet) as advance:
        return run(estimate_item, items, jobs=jobs, advance=advance)


def estimate_item(payload: dict[str, Any]) -> dict[str, Any]:
    """Estimate one observation and write the result."""
    observation = read_observation(Path(payload["observation"]))
    result = estimate(observation, configuration_from_dict(payload["configuration"]))
    write_estimate(result, Path(payload["product"]))
    return {"status": result.status.value}


def _item(folder: Path, configuration: dict[str, Any], out: Path) -> Item:
    product = estimate_path(out, folder.name)
    payload = {"observation": str(folder), "configuration": configuration, "product": str(product)}
    return Item(folder.name, payload, product)
