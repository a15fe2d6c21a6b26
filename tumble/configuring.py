"""The estimator's configuration from a TOML file and from ``--set``; resolved, so that a run says what it used."""

import dataclasses
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from datasets.errors import InputError
from estimator.configuration import configuration_from_dict


def load_configuration(path: Path | None, settings: Sequence[str]) -> dict[str, Any]:
    """Every setting of the estimator by name: defaults, then the file, then ``settings`` (``key=value``).

    Raises
    ------
    InputError
        Where the file cannot be read, or a setting is unknown or of the wrong type.
    """
    values = _read(path) if path is not None else {}
    for setting in settings:
        values.update(_parsed(setting))
    return dataclasses.asdict(configuration_from_dict(values))


def _read(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: expected a TOML file, which cannot be read ({error}).") from error
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{path}: expected TOML ({error}).") from None


def _parsed(setting: str) -> dict[str, Any]:
    """One ``key=value``, the value as in TOML."""
    try:
        found = tomllib.loads(setting)
    except tomllib.TOMLDecodeError:
        raise InputError(f'--set {setting}: expected key=value, for instance "minimum_frames=12".') from None
    if not found:
        raise InputError(f'--set {setting}: expected key=value, for instance "minimum_frames=12".')
    return found
