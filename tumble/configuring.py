"""The estimator's configuration from a TOML file and from ``--set``; resolved, so that a run says what it used."""

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from datasets.errors import InputError
from datasets.toml_text import parsed_toml, read_toml
from estimator.data.configuration import configuration_from_dict


def load_configuration(path: Path | None, settings: Sequence[str]) -> dict[str, Any]:
    """Every setting of the estimator by name: defaults, then the file, then ``settings`` (``key=value``).

    Raises
    ------
    InputError
        Where the file cannot be read, or a setting is unknown or of the wrong type.
    """
    values = _from_file(path) if path is not None else {}
    for setting in settings:
        values.update(_parsed(setting))
    return dataclasses.asdict(configuration_from_dict(values))


def _from_file(path: Path) -> dict[str, Any]:
    """The settings of a file, checked by themselves so that a wrong one is told with the file's name."""
    values = read_toml(path)
    try:
        configuration_from_dict(values)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    return values


def _parsed(setting: str) -> dict[str, Any]:
    """One ``key=value``, the value as in TOML."""
    try:
        found = parsed_toml(setting, f"--set {setting}")
    except InputError:
        raise InputError(f'--set {setting}: expected key=value, for instance "minimum_frames=12".') from None
    if not found:
        raise InputError(f'--set {setting}: expected key=value, for instance "minimum_frames=12".')
    return found
