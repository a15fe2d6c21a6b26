"""What a gate's sequences are made from: a recipe for each kind that is estimated one by one, and a list of campaigns.

Sizes of hidden effects are written down, not drawn about detection limits: those are the estimator's, and a change of it would move the
sequences that it is judged by.
"""

import tomllib
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from datasets.errors import InputError
from datasets.recipes.recipe import Recipe
from datasets.recipes.toml_files import recipe_from_dict, recipe_to_dict
from datasets.vocabulary.effects import EFFECTS
from tumble.challenge.field_case import MEASURED, FieldCase, Measured
from tumble.challenge.field_drawing import FieldPlan, draw_flights
from tumble.challenge.field_silhouettes import as_flown

ONE_BY_ONE = ("flights", "pictures", "impacts")
"""Kinds of sequences that are estimated one by one, each with a recipe of its own."""
CAMPAIGNS = "campaigns"


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
    try:
        table = tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise InputError(f"{path}: expected the set of a gate (TOML), got no such file.") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: expected the set of a gate as TOML, got something else ({error}).") from None
    if unknown := sorted(set(table) - {"name", CAMPAIGNS, *ONE_BY_ONE}):
        raise InputError(f"{path}: expected name, {', '.join(ONE_BY_ONE)} and campaigns, got {unknown[0]}.")
    if not set(table) - {"name"}:
        raise InputError(f"{path}: expected at least one of {', '.join(ONE_BY_ONE)} and campaigns, got none: there is nothing to compare.")
    recipes = {kind: replace(recipe_from_dict(table[kind], str(path)), name=kind) for kind in ONE_BY_ONE if kind in table}
    campaigns = tuple(_plan(values, path) for values in table.get(CAMPAIGNS, ()))
    names = [plan.name for plan in campaigns]
    if len(set(names)) < len(names):
        raise InputError(f"{path}: expected campaigns of different names, got {max(names, key=names.count)} twice.")
    return GateSet(str(table.get("name", path.stem)), recipes, campaigns)


def _plan(values: Mapping[str, Any], path: Path) -> CampaignPlan:
    try:
        plan = CampaignPlan(**values)
    except TypeError as error:
        raise InputError(f"{path}: at campaigns: expected name, measured, seed, flights, rows and hidden ({error}).") from None
    if plan.measured not in MEASURED:
        raise InputError(f"{path}: campaign {plan.name}: expected measured to be one of {', '.join(MEASURED)}, got {plan.measured}.")
    for key, sizes in plan.hidden.items():
        if key not in EFFECTS or not set(sizes) <= set(EFFECTS[key].names):
            known = ", ".join(EFFECTS[key].names) if key in EFFECTS else "an effect of the catalogue"
            raise InputError(f"{path}: campaign {plan.name}: expected {known}, got {key} = {dict(sizes)}.")
    return plan


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
