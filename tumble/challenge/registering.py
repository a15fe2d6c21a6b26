"""Campaigns found and fitted sequence by sequence, once for all that start from there.

Solving and the oracle start from the same registration, which takes as long as either. It may be kept in a folder that both are given; a
kept one is taken only where the campaign's files, the configuration and the software are those it was made with.
"""

import hashlib
import json
import pickle
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import datasets
import estimator
from datasets.atomic_files import written_whole
from datasets.observation_files import read_observation
from datasets.trajectory_files import read_trajectory, trajectories_in
from estimator.data.configuration import configuration_from_dict
from estimator.fitting.campaigns.registered import Registered
from estimator.measurements.silhouettes.registration import register
from estimator.measurements.trajectories.registering import register_trajectories
from tumble.result_files import observations_in
from tumble.versions import versions

SUFFIX = ".registered.pickle"
OBSERVATIONS = "observations"


def registered_campaign(folder: Path, configuration: Mapping[str, Any], kept: Path | None = None) -> Registered:
    """The campaign of a ``folder``, found and fitted sequence by sequence; from the folder ``kept``, and left there, if one is given.

    Kept files are pickles, which can run code: only a folder of one's own is to be given.
    """
    if kept is None:
        return _registered(folder, configuration)
    path, origin = kept / f"{folder.name}{SUFFIX}", _origin(folder, configuration)
    found = _read(path, origin)
    if found is None:
        found = _registered(folder, configuration)
        kept.mkdir(parents=True, exist_ok=True)
        with written_whole(path) as temporary:
            temporary.write_bytes(origin.encode() + pickle.dumps(found, protocol=pickle.HIGHEST_PROTOCOL))
    return found


def _registered(folder: Path, configuration: Mapping[str, Any]) -> Registered:
    tracked = trajectories_in(folder / OBSERVATIONS)
    if tracked:
        return register_trajectories([read_trajectory(path, {}) for path in tracked])
    return register([read_observation(path) for path in observations_in(folder)], configuration_from_dict(dict(configuration)))


def _origin(folder: Path, configuration: Mapping[str, Any]) -> str:
    """Digest of everything a registration depends on, the code included."""
    digest = hashlib.sha256(json.dumps([configuration, versions()], sort_keys=True, default=str).encode())
    for package in (estimator, datasets):
        for path in sorted(Path(package.__path__[0]).rglob("*.py")):
            digest.update(path.read_bytes())
    tracked = trajectories_in(folder / OBSERVATIONS)
    folders = (folder / OBSERVATIONS,) if tracked else observations_in(folder)
    for path in sorted(each for observation in folders for each in observation.rglob("*") if each.is_file()):
        digest.update(str(path.relative_to(folder)).encode())
        digest.update(hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()


def _read(path: Path, origin: str) -> Registered | None:
    """The kept registration, if it is of that ``origin``."""
    content = path.read_bytes() if path.is_file() else b""
    if content[: len(origin)] != origin.encode():
        return None
    try:
        found = pickle.loads(content[len(origin) :])
    except (pickle.UnpicklingError, EOFError):  # cut off
        return None
    return found if isinstance(found, Registered) else None
