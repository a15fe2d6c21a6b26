"""Recipes as TOML: strict types, no unknown keys, ``key.sub=value`` overrides, the resolved recipe written back.

TOML has no "nothing": a key that may be absent (``None``) is left out, and an override says ``none``.
"""

import dataclasses
import difflib
import json
import tomllib
import types
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

from datasets.errors import InputError
from datasets.plain_values import LARGEST_INTEGER
from datasets.recipes.checks import check_recipe, without_meaning
from datasets.recipes.recipe import Recipe
from datasets.toml_text import Table, read_toml

COMMAND_LINE = "--set"
Typed = TypeVar("Typed")


def load_recipe(path: Path | None, overrides: Sequence[str] = ()) -> Recipe:
    """The recipe of a TOML file (``None``: the defaults) with overrides ``key.sub=value`` applied in order.

    Raises
    ------
    InputError
        Naming the file or ``--set``, the key, what was expected and what came.
    """
    source = str(path) if path is not None else "recipe"
    recipe: Recipe = _build(Recipe, read_toml(path) if path is not None else {}, source, "")
    for override in overrides:
        recipe = _override(recipe, override)
    check_recipe(recipe, source)
    return recipe


def recipe_from_dict(table: Table, source: str) -> Recipe:
    """The recipe of plain values, for instance ``Dataset.recipe``; ``source`` is named in messages."""
    recipe: Recipe = _build(Recipe, table, source, "")
    check_recipe(recipe, source)
    return recipe


def typed(kind: type[Typed], table: object, source: str, key: str) -> Typed:
    """The dataclass ``kind`` of a table under ``key``: strict types, no unknown keys.

    Raises
    ------
    InputError
        Naming the ``source``, the key, what was expected and what came.
    """
    built: Typed = _build(kind, table, source, f"{key}.")
    return built


def recipe_to_dict(recipe: Recipe) -> Table:
    """The resolved recipe as plain values; what is ``None`` is left out, and what belongs to a plate or a contact where there is none."""
    table = {key: value for key, value in _plain(recipe).items() if value is not None}
    return {key: value for key, value in table.items() if key not in without_meaning(recipe)}


def recipe_to_toml(recipe: Recipe) -> str:
    """The resolved recipe as TOML; :func:`load_recipe` gives the same recipe back."""
    table = recipe_to_dict(recipe)
    top = [f"{key} = {_toml(value)}" for key, value in table.items() if not isinstance(value, dict)]
    sections = [f"\n[{name}]\n{_entries(section)}" for name, section in table.items() if isinstance(section, dict)]
    return "\n".join([*top, *sections]) + "\n"


def _entries(section: Table) -> str:
    return "\n".join(f"{key} = {_toml(value)}" for key, value in section.items())


def _override(recipe: Recipe, override: str) -> Recipe:
    key, equals, text = override.partition("=")
    keys = [part.strip() for part in key.split(".")]
    if not equals or not all(keys):
        raise InputError(f'{COMMAND_LINE} {override}: expected key=value, for instance "motion.frames=50".')
    return _replaced(recipe, keys, text.strip(), override)


def _replaced(part: Any, keys: list[str], text: str, override: str) -> Any:
    """``part`` (a dataclass) with the field that ``keys`` lead to replaced."""
    kind: Any = type(part)
    source = f"{COMMAND_LINE} {override}"
    _check_known(kind, keys[0], source, "")
    hint = get_type_hints(kind)[keys[0]]
    if len(keys) > 1:
        table = next((arm for arm in (hint, *get_args(hint)) if dataclasses.is_dataclass(arm) and get_origin(hint) is not tuple), None)
        if table is None:
            raise InputError(f"{source}: {keys[0]} is a value and has no part {keys[1]}.")
        present = getattr(part, keys[0])
        value = _replaced(_build(table, {}, source, "") if present is None else present, keys[1:], text, override)
    else:
        value = _convert(hint, _parsed(text, hint), source, keys[0])
    return dataclasses.replace(part, **{keys[0]: value})


def _parsed(text: str, hint: Any) -> Any:
    """The TOML value of ``text``; plain text without quotes is taken as text, ``none`` as nothing where that is allowed."""
    if text.lower() == "none" and type(None) in get_args(hint):
        return None
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except ValueError:
        return text


def _check_known(kind: Any, key: str, source: str, prefix: str) -> None:
    known = [field.name for field in dataclasses.fields(kind)]
    if key not in known:
        nearest = difflib.get_close_matches(key, known, n=1, cutoff=0.5)
        hint = f'did you mean "{prefix}{nearest[0]}"?' if nearest else f"known here: {', '.join(known)}."
        raise InputError(f'{source}: unknown key "{prefix}{key}"; {hint}')


def _build(kind: Any, table: Any, source: str, prefix: str) -> Any:
    """The dataclass ``kind`` of a table; missing keys take their defaults."""
    if not isinstance(table, dict):
        raise InputError(f"{source}: {prefix.rstrip('.')}: expected a table, got {_shown(table)}.")
    hints = get_type_hints(kind)
    for key in table:
        _check_known(kind, key, source, prefix)
    absent = [field.name for field in dataclasses.fields(kind) if _required(field) and field.name not in table]
    if absent:
        raise InputError(f"{source}: {prefix.rstrip('.')}: expected a value for {', '.join(absent)}, got {_shown(table)}.")
    return kind(**{key: _convert(hints[key], value, source, f"{prefix}{key}") for key, value in table.items()})


def _required(field: dataclasses.Field[Any]) -> bool:
    return field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING


def _convert(hint: Any, value: Any, source: str, key: str) -> Any:
    """``value`` as the type ``hint``, strictly: no text for numbers, no truth values for integers."""
    if dataclasses.is_dataclass(hint):
        return _build(hint, value, source, f"{key}.")
    origin = get_origin(hint)
    if origin in (Union, types.UnionType):
        return None if value is None else _convert(_arm(get_args(hint), value), value, source, key)
    if origin is Mapping:
        return _convert_mapping(get_args(hint)[1], value, source, key)
    if origin is tuple:
        return _convert_tuple(get_args(hint), value, source, key)
    if origin is Literal and value in get_args(hint) and not isinstance(value, bool):
        return value
    if isinstance(value, int) and abs(value) > LARGEST_INTEGER:
        raise InputError(f"{source}: {key}: expected {_described(hint)} of at most 64 bit, got a longer one.")
    if hint is float and isinstance(value, int) and not isinstance(value, bool):
        return float(value)
    if origin is not Literal and type(value) is hint:
        return value
    raise InputError(f"{source}: {key}: expected {_described(hint)}, got {_shown(value)}.")


def _arm(arms: tuple[Any, ...], value: Any) -> Any:
    """The kind of several that a value is to be: the list where it is one, otherwise the first."""
    kinds = [arm for arm in arms if arm is not type(None)]
    lists = [arm for arm in kinds if get_origin(arm) is tuple]
    return lists[0] if lists and isinstance(value, list | tuple) else kinds[0]


def _convert_mapping(hint: Any, value: Any, source: str, key: str) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise InputError(f"{source}: {key}: expected a table, got {_shown(value)}.")
    return {name: _convert(hint, entry, source, f"{key}.{name}") for name, entry in value.items()}


def _convert_tuple(arms: tuple[Any, ...], value: Any, source: str, key: str) -> tuple[Any, ...]:
    if not isinstance(value, list | tuple):
        raise InputError(f"{source}: {key}: expected a list, got {_shown(value)}.")
    if arms[-1] is Ellipsis:
        arms = (arms[0],) * len(value)
    if len(value) != len(arms):
        raise InputError(f"{source}: {key}: expected a list of {len(arms)}, got {_shown(value)}.")
    return tuple(_convert(arm, entry, source, f"{key}[{k}]") for k, (arm, entry) in enumerate(zip(arms, value, strict=True)))


def _described(hint: Any) -> str:
    if get_origin(hint) is Literal:
        return "one of " + ", ".join(json.dumps(choice) for choice in get_args(hint))
    return {int: "an integer", float: "a number", bool: "true or false", str: "text"}[hint]


def _shown(value: Any) -> str:
    return json.dumps(value, default=str)


def _plain(value: Any) -> Any:
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        entries = {field.name: _plain(getattr(value, field.name)) for field in dataclasses.fields(value)}
        return {key: entry for key, entry in entries.items() if entry is not None}
    if isinstance(value, Mapping):
        return {key: _plain(entry) for key, entry in value.items()}
    return [_plain(entry) for entry in value] if isinstance(value, tuple) else value


def _toml(value: Any) -> str:
    """A TOML value; JSON's spelling of text, truth values, numbers and lists is TOML's, apart from infinities."""
    if isinstance(value, list):
        return "[" + ", ".join(_toml(entry) for entry in value) + "]"
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(key, ensure_ascii=False)} = {_toml(entry)}" for key, entry in value.items()) + "}"
    if isinstance(value, float):
        return repr(value)
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
