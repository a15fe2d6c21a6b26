"""What benchmark sets there are, and what each is made of."""

import csv
import tomllib
from dataclasses import dataclass, replace
from pathlib import Path

from datasets.errors import InputError
from datasets.recipes.recipe import Recipe
from datasets.recipes.toml_files import recipe_from_dict
from datasets.truth import Truth

FOLDER = Path(__file__).parent / "sets"
COLUMNS = ("dataset", "sequence", "time_s", "vx", "vy", "vz", "wx", "wy", "wz")
"""Of a list of targets: v (m/s) and omega (rad/s) in the world frame at mid-sequence."""
SAME = 1e-9
"""How far a target may be off, relative to the largest of its three components, on another machine."""


@dataclass(frozen=True)
class BenchmarkSet:
    """A set: what it is and why, its ``licence`` (SPDX), when this ``version`` was ``published``, how large it is, and what makes it.

    Either ``recipes`` by the name of their dataset, or the words of a ``challenge`` (``tumble challenge make ...``).
    """

    name: str
    version: str
    published: str
    title: str
    what: str
    why: str
    licence: str
    megabytes: float
    minutes: float
    recipes: dict[str, Recipe]
    challenge: tuple[str, ...] = ()

    @property
    def seeds(self) -> tuple[int, ...]:
        """All seeds; they are public, so what is hidden is hidden from an instrument only."""
        drawn = [int(self.challenge[k + 1]) for k, word in enumerate(self.challenge) if word == "--seed"]
        return (*(recipe.seed for recipe in self.recipes.values()), *drawn)


Target = dict[str, str | float]


def set_names() -> tuple[str, ...]:
    """Of all sets."""
    return tuple(sorted(path.stem for path in FOLDER.glob("*.toml")))


def read_set(name: str) -> BenchmarkSet:
    """The set of that name.

    Raises
    ------
    InputError
        Where there is none.
    """
    if name not in set_names():
        raise InputError(f"{name}: expected a benchmark set, one of {', '.join(set_names())}.")
    path = FOLDER / f"{name}.toml"
    table = tomllib.loads(path.read_text(encoding="utf-8"))
    recipes = {key: replace(recipe_from_dict(entry, str(path)), name=key) for key, entry in table.pop("datasets", {}).items()}
    return BenchmarkSet(name=name, recipes=recipes, challenge=tuple(table.pop("challenge", ())), **table)


def targets_file(name: str) -> Path:
    """The committed list of what is to be measured in a set."""
    return FOLDER / f"{name}.targets.csv"


def read_targets(path: Path) -> list[Target]:
    """The rows of a committed list."""
    with path.open(encoding="utf-8", newline="") as stream:
        return [{key: value if key in COLUMNS[:2] else float(value) for key, value in row.items()} for row in csv.DictReader(stream)]


def target_of(dataset: str, truth: Truth) -> Target:
    """What is to be measured in one sequence."""
    middle = (len(truth.motion.times_s) - 1) // 2
    numbers = (truth.motion.times_s[middle], *truth.motion.v_world[middle], *truth.motion.omega_world[middle])
    return {"dataset": dataset, "sequence": truth.name, **dict(zip(COLUMNS[2:], map(float, numbers), strict=True))}


def differing(made: list[Target], listed: list[Target]) -> list[str]:
    """Sentences for sequences that are not those of the list."""
    by_name = {(row["dataset"], row["sequence"]): row for row in made}
    said = []
    for row in listed:
        found = by_name.pop((row["dataset"], row["sequence"]), None)
        if found is None:
            said.append(f"{row['dataset']}/{row['sequence']}: expected by the list of targets, got none")
        elif (off := _largest_difference(found, row)) > SAME:
            said.append(f"{row['dataset']}/{row['sequence']}: expected the velocities of the list of targets, got others by {off:.1e}")
    return said + [f"{dataset}/{sequence}: not in the list of targets" for dataset, sequence in by_name]


def _largest_difference(one: Target, other: Target) -> float:
    def off(keys: tuple[str, ...]) -> float:
        size = max(abs(float(other[key])) for key in keys) or 1.0
        return max(abs(float(one[key]) - float(other[key])) for key in keys) / size

    return max(off(COLUMNS[2:3]), off(COLUMNS[3:6]), off(COLUMNS[6:9]))
