"""How an instrument joins the benchmark: it reads observations and writes estimates. An own one needs no more than this does.

``python -m rivals.centroids DATASET --out ESTIMATES``, then ``tumble leaderboard DATASET --of centroids=ESTIMATES``.
"""

import argparse
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from datasets.errors import InputError, TumbleError
from datasets.estimate import Estimate, Status
from datasets.estimate_files import read_estimate, write_estimate
from datasets.file_digests import file_sha256
from datasets.observation import Observation
from datasets.observation_files import read_observation

Measure = Callable[[Observation], Estimate]
SUFFIX = ".estimate.json"
BAD_INPUT = 2


def joined(name: str, measure: Measure, arguments: Sequence[str] | None = None) -> int:
    """The command line of an instrument: measures each observation of a dataset. Estimates that are there stay, unless ``--force``."""
    parser = argparse.ArgumentParser(prog=f"python -m rivals.{name}", description=sys.modules[measure.__module__].__doc__)
    parser.add_argument("observations", type=Path, help="a dataset, or a folder of observations")
    parser.add_argument("--out", type=Path, required=True, help="where estimates are written")
    parser.add_argument("--force", action="store_true", help="measure again what was measured")
    given = parser.parse_args(arguments)
    try:
        folders = observations_in(given.observations)
    except TumbleError as error:
        print(f"rivals.{name}: {error}", file=sys.stderr)
        return BAD_INPUT
    code = 0
    for count, folder in enumerate(folders, start=1):
        try:
            status = _one(name, measure, folder, given)
            print(f"{name}: {count} of {len(folders)}, {folder.name}: {status.value}", flush=True)
        except TumbleError as error:
            print(f"rivals.{name}: {error}", file=sys.stderr)
            code = BAD_INPUT
    return code


def _one(name: str, measure: Measure, folder: Path, given: argparse.Namespace) -> Status:
    """Measure one observation, unless it was; what was measured of another one of its name is refused."""
    path = given.out / f"{folder.name}{SUFFIX}"
    mark = file_sha256(folder / "observation.json")
    if path.is_file() and not given.force:
        kept = read_estimate(path)
        if kept.configuration.get("observation") != mark:
            raise InputError(f"{path}: expected an estimate of {folder}, got one of another observation. Choose another --out, or --force.")
        return kept.status
    estimate = measured(name, measure, folder)
    given.out.mkdir(parents=True, exist_ok=True)
    write_estimate(replace(estimate, configuration={**estimate.configuration, "observation": mark}), path)
    return estimate.status


def observations_in(source: Path) -> list[Path]:
    """The folders of the observations of a dataset or of a folder of observations, in the order of their names; truth is no observation.

    Raises
    ------
    InputError
        Where there are none.
    """
    inside = source / "observations"
    found = sorted(path.parent for path in (inside if inside.is_dir() else source).glob("*/observation.json"))
    if not found:
        raise InputError(f"{source}: expected a dataset or a folder of observations, got none in it.")
    return found


def measured(name: str, measure: Measure, folder: Path) -> Estimate:
    """The estimate of one observation; what the instrument cannot do is ``no convergence``, told with the reason."""
    observation = read_observation(folder)
    try:
        estimate = measure(observation)
    except (ValueError, RuntimeError, ArithmeticError, LookupError, TypeError, np.linalg.LinAlgError) as error:
        estimate = Estimate(observation.name, Status.NO_CONVERGENCE, f"{type(error).__name__}: {error}")
    return replace(estimate, versions={**estimate.versions, "instrument": name})
