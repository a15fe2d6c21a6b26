"""TOML that people write: recipes, configurations, side-cars; read with one set of errors."""

import tomllib
from pathlib import Path
from typing import Any

from datasets.errors import InputError
from datasets.plain_values import first_fault

Table = dict[str, Any]


def read_toml(path: Path) -> Table:
    """The table of a TOML file.

    Raises
    ------
    InputError
        Naming the file, and the key where a value cannot stay (see :mod:`datasets.plain_values`).
    """
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise InputError(f"{path}: there is no such file.") from None
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: expected TOML in UTF-8 ({error}).") from None
    except OSError as error:
        raise InputError(f"{path}: expected a TOML file, got one that cannot be read ({error.strerror}).") from error
    return parsed_toml(text, str(path))


def parsed_toml(text: str, source: str) -> Table:
    """The table of TOML text from ``source``, which is named in messages.

    Raises
    ------
    InputError
        When it is no TOML, or a value cannot stay.
    """
    try:
        table = tomllib.loads(text)
    except ValueError as error:  # also what Python raises for an integer of thousands of digits
        raise InputError(f"{source}: expected TOML ({error}).") from None
    except RecursionError:
        raise InputError(f"{source}: expected TOML, got tables nested too deeply.") from None
    fault = first_fault(table, "")
    if fault is not None:
        raise InputError(f"{source}: {fault}.")
    return table
