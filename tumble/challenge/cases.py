"""One case of the challenge: what is hidden in a campaign, and where its files lie.

``campaigns/<name>/observations/<sequence>/`` is for the solver; ``truth/<name>/case.json`` and ``truth/<name>/<sequence>/`` are not. Names
are numbers in an order that was shuffled.
"""

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, TypeVar

from datasets.atomic_files import written_whole
from datasets.errors import InputError
from datasets.json_documents import plain, revived
from datasets.recipes.recipe import Recipe
from datasets.recipes.toml_files import recipe_from_dict, recipe_to_dict

Read = TypeVar("Read")
Kind = Literal["control", "single", "pair", "outside"]
CASE_FILE = "case.json"
CAMPAIGNS, TRUTH = "campaigns", "truth"


@dataclass(frozen=True)
class Case:
    """One campaign: its neutral ``name``, ``kind``, the ``recipe`` it is made from, and how many calibrated ``views`` are shown.

    ``ratios``: of each effect of the recipe its size over the 95% detection limit of the table; NaN where no limit is known.
    """

    name: str
    kind: Kind
    recipe: Recipe
    views: int
    ratios: Mapping[str, float]

    @property
    def keys(self) -> tuple[str, ...]:
        """The effects hidden in it."""
        return tuple(effect.key for effect in self.recipe.effects)

    @property
    def least_ratio(self) -> float:
        """Size of its weakest effect over the detection limit; NaN where there is none."""
        return min(self.ratios.values(), default=math.nan)


def campaign_folder(root: Path, name: str) -> Path:
    """Where the solver finds a campaign."""
    return root / CAMPAIGNS / name


def case_folder(root: Path, name: str) -> Path:
    """Where the truth of a campaign lies."""
    return root / TRUTH / name


def sequence_name(case: str, index: int) -> str:
    """The neutral name of a sequence."""
    return f"{case}-{index + 1}"


def case_to_dict(case: Case) -> dict[str, Any]:
    """A case as plain values."""
    recipe = recipe_to_dict(case.recipe)
    return {"name": case.name, "kind": case.kind, "views": case.views, "ratios": dict(case.ratios), "recipe": recipe}


def case_from_dict(values: Mapping[str, Any]) -> Case:
    """The inverse of :func:`case_to_dict`."""
    recipe = recipe_from_dict(values["recipe"], values["name"])
    return Case(values["name"], values["kind"], recipe, int(values["views"]), {k: float(v) for k, v in values["ratios"].items()})


def write_case(case: Case, path: Path) -> None:
    """Write what is hidden."""
    write_truth_document(case_to_dict(case), path)


def write_truth_document(values: Mapping[str, Any], path: Path) -> None:
    """Write plain values of a case of either challenge."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with written_whole(path) as temporary:
        temporary.write_text(json.dumps(plain(values), indent=1) + "\n", encoding="utf-8")


def read_cases(root: Path) -> tuple[Case, ...]:
    """Every case whose truth lies under ``root``.

    Raises
    ------
    InputError
        Where there is none, or a file is not one of ours.
    """
    return cases_in(root, case_from_dict, "tumble challenge make")


def cases_in(root: Path, from_dict: Callable[[dict[str, Any]], Read], maker: str) -> tuple[Read, ...]:
    """Every case under ``root``, made ``from_dict``; ``maker``: the command that writes such cases."""
    files = sorted((root / TRUTH).glob(f"*/{CASE_FILE}"))
    if not files:
        raise InputError(f"{root}: expected the folder of a challenge with {TRUTH}/<campaign>/{CASE_FILE} in it, found none.")
    return tuple(_read(path, from_dict, maker) for path in files)


def _read(path: Path, from_dict: Callable[[dict[str, Any]], Read], maker: str) -> Read:
    try:
        return from_dict(revived(json.loads(path.read_text(encoding="utf-8"))))
    except (ValueError, KeyError, TypeError) as error:
        raise InputError(f"{path}: expected a case written by `{maker}` ({type(error).__name__}: {error}).") from None
