"""docs/format.md names every key of a recipe with its unit, default and range as the code has them."""

import re
import tomllib
from dataclasses import MISSING, Field, fields, is_dataclass
from pathlib import Path
from typing import Any, Literal, get_args, get_origin, get_type_hints

import pytest

from datasets.recipes.checks import BOUNDS, FURTHER_BOUNDS
from datasets.recipes.recipe import FurtherHsvRecipe, HsvRecipe, Recipe

TEXT = (Path(__file__).parents[2] / "docs" / "format.md").read_text(encoding="utf-8")
UNITS = {
    **{"mm": "mm", "kgm3": "kg/m³", "hz": "Hz", "ms": "m/s", "rads": "rad/s", "ms2": "m/s²", "px": "px", "um": "µm", "m": "m", "us": "µs"},
    **{"deg": "°", "gpa": "GPa", "e": "e⁻", "dn": "DN"},
}
TABLES = ("particle", "motion", "hsv", "rig", "noise", "rendering", "sensor")
EXAMPLES = ("plate", "dropper", "pair", "contact")
"""Tables that are shown in TOML, with a comment beside each key that needs one."""


def table_type(name: str) -> Any:
    hint = get_type_hints(Recipe)[name]
    return next(arm for arm in (hint, *get_args(hint)) if is_dataclass(arm))


def row(table: str, field: Field[Any], hint: Any) -> str:
    """The first four columns of a key's row."""
    default = "" if field.default is MISSING else value(field.default)
    unit = "mm/px" if field.name == "mm_per_px" else UNITS.get(field.name.rsplit("_", 1)[-1], "")
    return f"| `{field.name}` | {unit} | {default} | {limits(f'{table}.{field.name}', hint)} |".replace("  ", " ")


def value(default: Any) -> str:
    if default is None:
        return "none"
    if isinstance(default, tuple):
        return f"[{', '.join(map(value, default))}]"
    return str(default).lower() if isinstance(default, bool) else f"{default:g}" if isinstance(default, float) else str(default)


def limits(key: str, hint: Any) -> str:
    choices = next((arm for arm in (hint, *get_args(hint)) if get_origin(arm) is Literal), None)
    if choices is not None:
        return ", ".join(str(choice) for choice in get_args(choices))
    bounds = next((each for each in BOUNDS if each.key == key), None)
    return "" if bounds is None else f"{bounds.low:g} to {bounds.high:g}"


def section(table: str) -> str:
    found = re.search(rf"^#### `\[{re.escape(table)}\]`\n(.*?)(?=^#)", TEXT, flags=re.DOTALL | re.MULTILINE)
    assert found, f"docs/format.md should have a section `[{table}]`"
    return found[1]


@pytest.mark.parametrize("table", TABLES)
def test_every_key_is_there(table: str) -> None:
    kind, text = table_type(table), section(table)
    hints = get_type_hints(kind)
    for field in fields(kind):
        assert row(table, field, hints[field.name]) in text
    assert len(re.findall(r"^\| `", text, flags=re.MULTILINE)) == len(fields(kind))


@pytest.mark.parametrize("table", EXAMPLES)
def test_every_key_of_an_example_is_there_with_its_default(table: str) -> None:
    found = next(part for part in re.findall(r"```toml\n(.*?)```", TEXT, flags=re.DOTALL) if f"[{table}]" in part)
    given = tomllib.loads(found)[table]
    kind = table_type(table)
    assert {key: tuple(entry) if isinstance(entry, list) else entry for key, entry in given.items()} == vars(kind())


def test_no_table_is_forgotten() -> None:
    tables = {name for name, hint in get_type_hints(Recipe).items() if get_origin(hint) is not tuple}
    tables = {name for name in tables if any(map(is_dataclass, (get_type_hints(Recipe)[name], *get_args(get_type_hints(Recipe)[name]))))}
    assert tables == {*TABLES, *EXAMPLES}


@pytest.mark.parametrize("key", ["name", "seed", "sequences", "same_particle", "tier", "effects", "contact_physics"])
def test_every_key_of_the_top_is_there(key: str) -> None:
    assert re.search(rf"^\| `{key}` \|", TEXT, flags=re.MULTILINE)


def test_every_key_of_a_further_camera_that_is_not_of_its_optics_is_there() -> None:
    text, optics = section("[further_hsv]"), {field.name for field in fields(HsvRecipe)}
    bounds = {each.key: f"{each.low:g} to {each.high:g}" for each in FURTHER_BOUNDS}
    own = [field for field in fields(FurtherHsvRecipe) if field.name not in optics]
    for field in own:
        unit = "°" if field.name.endswith("_deg") else ""
        assert f"| `{field.name}` | {unit} | {value(field.default)} | {bounds[field.name]} |".replace("  ", " ") in text
    assert {field.name for field in own} == set(bounds)
