"""What a gate's sequences are made from: a recipe for each kind that is estimated one by one, and a list of campaigns.

Sizes of hidden effects are written down, not drawn about detection limits: those are the estimator's, and a change of it would move the
sequences that it is judged by.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from datasets.errors import InputError
from datasets.names import file_name
from datasets.recipes.recipe import Recipe
from datasets.recipes.toml_files import recipe_from_dict, recipe_to_dict, typed
from datasets.scoring.gate import CAMPAIGNS
from datasets.toml_text import read_toml
from datasets.vocabulary.effects import EFFECTS
from tumble.challenge.field_case import FieldCase, Measured
from tumble.challenge.field_drawing import FieldPlan, draw_flights
from tumble.challenge.field_silhouettes import as_flown

ONE_BY_ONE = ("flights", "pictures", "impacts")
"""Kinds of sequences that are estimated one by one, each with a recipe of its own."""
LEAST_ROWS = 3
"""Of a flight of a campaign: as of a recipe's ``motion.frames``."""


@dataclass(frozen=True)
class CampaignPlan:
    """A campaign: what is ``measured`` of how many ``flights`` of so many ``rows`` (frames), and what is ``hidden``.

    ``hidden``: values of parameters by effect, the same in all flights. ``seed``: of flights and of all noise.
    """

    name: str
    measured: Measured
    seed: int
    flights: int = 6
    rows: int = 50
    hidden: Mapping[str, Mapping[str, float]] = field(default_factory=dict)


@dataclass(frozen=True)
class GateSet:
    """The sequences of a gate: ``recipes`` by kind, and ``campaigns``."""

    name: str
    recipes: Mapping[str, Recipe]
    campaigns: tuple[CampaignPlan, ...]

    def content(self) -> dict[str, Any]:
        """Everything that decides the sequences, with all defaults, as plain values."""
        campaigns = {plan.name: asdict(plan) for plan in self.campaigns}
        return {"recipes": {kind: recipe_to_dict(recipe) for kind, recipe in self.recipes.items()}, "campaigns": campaigns}

    def content_by_kind(self) -> dict[str, dict[str, Any]]:
        """The same, of each kind that there is: what the run that makes its sequences is described by."""
        content = self.content()
        return {**content["recipes"], **({CAMPAIGNS: {CAMPAIGNS: content["campaigns"]}} if self.campaigns else {})}

    @property
    def meshes(self) -> tuple[Path, ...]:
        """Files of particles that the recipes name."""
        return tuple(Path(file) for recipe in self.recipes.values() for file in recipe.particle.files)


def read_set(path: Path) -> GateSet:
    """The set in a TOML file.

    Raises
    ------
    InputError
        Where the file is missing or is no set.
    """
    table = read_toml(path)
    if unknown := sorted(set(table) - {"name", CAMPAIGNS, *ONE_BY_ONE}):
        raise InputError(f"{path}: expected name, {', '.join(ONE_BY_ONE)} and campaigns, got {unknown[0]}.")
    if not set(table) - {"name"}:
        raise InputError(f"{path}: expected at least one of {', '.join(ONE_BY_ONE)} and campaigns, got none: there is nothing to compare.")
    recipes = {kind: _recipe(kind, table[kind], path) for kind in ONE_BY_ONE if kind in table}
    campaigns = _plans(table.get(CAMPAIGNS, []), path)
    return GateSet(str(table.get("name", path.stem)), recipes, campaigns)


def _recipe(kind: str, table: Any, path: Path) -> Recipe:
    if not isinstance(table, dict):
        raise InputError(f"{path}: {kind}: expected a recipe as a table, [{kind}], got {table}.")
    return replace(recipe_from_dict(table, f"{path}: {kind}"), name=kind)


def _plans(tables: Any, path: Path) -> tuple[CampaignPlan, ...]:
    if not isinstance(tables, list):
        raise InputError(f"{path}: {CAMPAIGNS}: expected tables, each under [[{CAMPAIGNS}]], got {tables}.")
    plans = tuple(typed(CampaignPlan, table, str(path), f"{CAMPAIGNS}[{number}]") for number, table in enumerate(tables))
    for number, plan in enumerate(plans):
        _check(plan, f"{path}: {CAMPAIGNS}[{number}]")
    names = [plan.name for plan in plans]
    if len(set(names)) < len(names):
        raise InputError(f"{path}: expected campaigns of different names, got {max(names, key=names.count)} twice.")
    return plans


def _check(plan: CampaignPlan, where: str) -> None:
    if plan.name != file_name(plan.name):
        raise InputError(f'{where}.name: expected a name that a folder can have, as "{file_name(plan.name)}", got "{plan.name}".')
    for key, least in (("seed", 0), ("flights", 1), ("rows", LEAST_ROWS)):
        if (value := getattr(plan, key)) < least:
            raise InputError(f"{where}.{key}: expected at least {least}, got {value}.")
    for key, sizes in plan.hidden.items():
        if key not in EFFECTS:
            raise InputError(f"{where}.hidden: expected an effect of the catalogue, got {key}.")
        if unknown := [name for name in sizes if name not in EFFECTS[key].names]:
            raise InputError(f"{where}.hidden.{key}: expected {', '.join(EFFECTS[key].names)}, got {unknown[0]}.")


def case_of(plan: CampaignPlan) -> FieldCase:
    """The campaign: flights and noise as the field has them, and what is hidden.

    Raises
    ------
    InputError
        Where a flight does not stay in the picture.
    """
    drawn = FieldPlan(1, (plan.flights, plan.flights), (plan.rows, plan.rows), (plan.measured,))
    case = draw_flights(drawn, plan.name, np.random.default_rng(plan.seed))
    count = len(case.flights)
    hidden = {key: {name: (float(size),) * count for name, size in sizes.items()} for key, sizes in plan.hidden.items()}
    case = replace(case, hidden=hidden, over_limit=dict.fromkeys(hidden, float("nan")))
    return case if case.scene is None else as_flown(case)
