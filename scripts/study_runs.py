"""What the studies of accuracy share: cases of the silhouette tier that are made, estimated and scored once and kept.

A case is a recipe of one sequence and labels that say what the study varies. The kept row depends on the recipe and on the code alone:
its name is a hash of the recipe, its folder a hash of the sources of ``datasets``, ``synth`` and ``estimator``. So a killed run goes on
where it was, cases that two studies share are run once, and a changed estimator never shows old numbers.

Repetition ``k`` of every point of a study has the same seed (``SeedSequence([seed, k])``), hence the same particle, flight and spin as
far as the recipe allows: points of an axis differ by what is varied, not by the draw.
"""

import argparse
import hashlib
import json
import os
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from datasets.atomic_files import written_whole
from datasets.recipes.recipe import MotionRecipe, ParticleRecipe, Recipe
from datasets.recipes.toml_files import recipe_from_dict, recipe_to_dict
from datasets.scoring.metrics import COMPONENTS
from datasets.scoring.score import score
from estimator.data.configuration import Configuration
from estimator.measuring.free_flight import estimate
from studies.flights.bodies import SIX, scanned_files
from synth.sequence import build_silhouette_sequence
from tumble.cli.options import add_engine, executor_of
from tumble.engine import Executor, Item, Processes, failures, run
from tumble.one_thread import keep_to_one_thread
from tumble.progress import progress
from tumble.versions import sources_digest

SEED = 20270107
SPEED_MS, SPIN_RADS = (1.0, 2.0), (50.0, 300.0)
PROCEDURAL = tuple((family, irregularity) for irregularity in (0.4, 0.7, 1.0) for family in ("cut_stone", "jagged"))
"""Three regular and three irregular bodies of the procedural family."""
DESCRIBED = ("status", "converged", "n_frames", "n_used", "n_views", "n_symmetries", "irregularity", "speed_ms", "spin_rads")
SCORED = (
    *(f"{kind}{quantity}_percent" for kind in ("", "sigma_", "bound_") for quantity in ("in_plane", "out_of_plane", "angular")),
    *("in_plane_ms", "out_of_plane_ms", "angular_rads"),
    *(f"inside95_{component}" for component in COMPONENTS),
)
"""Columns of the score at mid-sequence."""


@dataclass(frozen=True)
class Case:
    """One sequence: ``labels`` are the columns that say which point of the study it belongs to."""

    labels: Mapping[str, float | int | str]
    recipe: Recipe


@dataclass(frozen=True)
class Options:
    """How to run a study: ``particles`` is a folder of scanned bodies or ``None``, ``repetitions`` overrides those of the size."""

    study: str
    full: bool = False
    particles: Path | None = None
    seed: int = SEED
    repetitions: int | None = None
    executor: Executor = field(default=Processes(2))
    out: Path = Path("out/studies")
    docs: Path = Path("docs")
    quiet: bool = False

    @property
    def name(self) -> str:
        """Name of the study's files: other sizes and other bodies do not overwrite each other."""
        return self.study + ("_scanned" if self.particles else "") + ("_full" if self.full else "")

    def repeated(self, small: int, full: int) -> range:
        """The repetitions of each point."""
        return range(self.repetitions or (full if self.full else small))


def parsed_options(study: str, description: str | None, arguments: Sequence[str] | None = None) -> Options:
    """The options of the command line."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    size = parser.add_mutually_exclusive_group()
    size.add_argument("--small", action="store_true", help="few repetitions: minutes on two cores (default)")
    size.add_argument("--full", action="store_true", help="more points and repetitions: hours")
    parser.add_argument("--particles", type=Path, help="folder with the scanned particles (PLY); without it the project's own bodies")
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--repetitions", type=int, help="sequences per point, instead of the size's")
    add_engine(parser)
    parser.add_argument("--out", type=Path, default=Path("out/studies"), help="where finished cases are kept (default: %(default)s)")
    parser.add_argument("--docs", type=Path, default=Path("docs"), help="where results/ and studies/ are written (default: %(default)s)")
    parser.add_argument("-q", "--quiet", action="store_true", help="no progress")
    given = parser.parse_args(arguments)
    kept = {key: value for key, value in vars(given).items() if key in Options.__dataclass_fields__}
    return Options(study, executor=executor_of(given), **kept)


def case_seed(seed: int, repetition: int) -> int:
    """The recipe's seed of a repetition, the same for all points of a study."""
    return int(np.random.SeedSequence([seed, repetition]).generate_state(1)[0])


def bodies(options: Options) -> tuple[ParticleRecipe, ...]:
    """Six bodies, regular and irregular in turn: the scanned ones or the project's own."""
    if options.particles:
        files = dict(zip(SIX, scanned_files(options.particles), strict=True))
        in_turn = [name for pair in zip(SIX[3:], SIX[:3], strict=True) for name in pair]
        return tuple(ParticleRecipe(files=(files[name],)) for name in in_turn)
    return tuple(ParticleRecipe(family=family, irregularity=a) for family, a in PROCEDURAL)  # type: ignore[arg-type]


def standard_recipe(options: Options, repetition: int) -> Recipe:
    """The sequence that a study varies: body ``repetition`` in turn, 100 frames, 60 views, 1 to 2 m/s, 50 to 300 rad/s."""
    six = bodies(options)
    motion = MotionRecipe(speed_ms=SPEED_MS, spin_rads=SPIN_RADS)
    return Recipe(seed=case_seed(options.seed, repetition), particle=six[repetition % len(six)], motion=motion)


def one_case(payload: dict[str, Any]) -> dict[str, Any]:
    """Make, estimate and score one sequence; writes its row."""
    began = time.process_time()
    observation, truth = build_silhouette_sequence(recipe_from_dict(payload["recipe"], "case of a study"), 0)
    row = score(estimate(observation, Configuration()), truth)
    kept = {key: row[key] for key in ("particle", *DESCRIBED)} | {key: row[f"middle_{key}"] for key in SCORED}
    plain = {key: value.item() if isinstance(value, np.generic) else value for key, value in kept.items()}
    with written_whole(Path(payload["product"])) as path:
        path.write_text(json.dumps({"row": plain, "cpu_s": time.process_time() - began}))
    return {}


def run_cases(cases: Sequence[Case], options: Options) -> tuple[pd.DataFrame, list[str]]:
    """One row per case, labels first, in the order of ``cases``, and what became of those that failed; finished ones are not run again."""
    keep_to_one_thread(os.environ)
    folder = options.out / sources_hash()
    products = [folder / f"{recipe_hash(case.recipe)}.json" for case in cases]
    items = {
        product: Item(product.stem, {"recipe": recipe_to_dict(case.recipe), "product": product}, product)
        for case, product in zip(cases, products, strict=True)
    }
    with progress(options.name, len(items), quiet=options.quiet) as advance:
        outcomes = run(one_case, list(items.values()), executor=options.executor, advance=advance)
    rows = [
        {**case.labels, **json.loads(product.read_text())["row"]} for case, product in zip(cases, products, strict=True) if product.exists()
    ]
    return pd.DataFrame(rows), [f"{outcome.name}: {outcome.message}" for outcome in failures(outcomes)]


def recipe_hash(recipe: Recipe) -> str:
    """A short name for everything that decides a sequence."""
    return hashlib.sha256(json.dumps(recipe_to_dict(recipe), sort_keys=True).encode()).hexdigest()[:20]


def sources_hash() -> str:
    """A short name for the code that decides a row."""
    return sources_digest(("datasets", "estimator", "synth"))[:12]
