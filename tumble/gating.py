"""The sequences of a baseline made anew: rendered from its recipe, estimated, scored; what is still valid in the work folder stays.

A gate is asked because code has changed, so a result is valid only for the code that made it: ``run.json`` of both steps holds a
digest of the sources behind them, and a step whose recipe, configuration or sources differ starts from nothing. An interrupted run
with the same ones goes on where it stopped.
"""

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from datasets.errors import InputError, TumbleError
from datasets.estimate import Estimate, Status
from datasets.recipes.recipe import Recipe
from datasets.recipes.toml_files import recipe_to_dict
from datasets.scoring.gate import load_baseline
from datasets.scoring.score import Row, score
from datasets.truth_files import read_truth
from tumble.configuring import load_configuration
from tumble.differences import first_difference
from tumble.engine import Executor, Outcome, State, failures
from tumble.estimating import estimate_all
from tumble.output_directory import Run, note_failures, output_directory
from tumble.rendering import render_dataset, variant_of
from tumble.result_files import estimate_path
from tumble.scoring import score_one
from tumble.versions import sources_digest, versions
from tumble.written_files import read_run

NATURE, INSTRUMENT = ("datasets", "synth"), ("datasets", "estimator")
"""The packages behind a dataset and behind an estimate."""


@dataclass(frozen=True)
class Manner:
    """How to run: by which engine, silent or not, from nothing or not."""

    executor: Executor
    quiet: bool
    force: bool


def recipe_file(baseline: Path) -> Path:
    """The recipe that ``baseline`` names.

    Raises
    ------
    InputError
        Where it names none, or one that is not there.
    """
    named = load_baseline(baseline).recipe
    if not named:
        raise InputError(f'{baseline}: expected "recipe", the file its sequences are made from, came none. Give --estimates and --truth.')
    found = baseline.parent / named
    if not found.is_file():
        raise InputError(f"{baseline}: expected its recipe {found}, came nothing.")
    return found


def rows_of_recipe(recipe: Recipe, out: Path, manner: Manner) -> tuple[list[Row], tuple[Outcome, ...]]:
    """Scores of every sequence of ``recipe``, and the outcomes of the estimates; one that failed scores as no convergence.

    Raises
    ------
    TumbleError
        Where a sequence cannot be made: without it there is nothing to compare.
    """
    dataset, estimates = out / "dataset", out / "estimates"
    _render(recipe, dataset, manner)
    outcomes = _estimate(dataset, estimates, manner)
    return [_row(outcome, estimates, dataset / "truth") for outcome in outcomes], outcomes


def _render(recipe: Recipe, out: Path, manner: Manner) -> None:
    run = Run("render", recipe_to_dict(recipe) | _made_by(NATURE), recipe.seed, variant_of(recipe), reads=())
    outcomes = _kept_if_valid(out, run, manner, lambda: render_dataset(recipe, out, executor=manner.executor, quiet=manner.quiet))
    for failed in failures(outcomes):
        raise TumbleError(f"sequence {failed.name} cannot be made, so there is nothing to compare: {failed.message}")


def _estimate(dataset: Path, out: Path, manner: Manner) -> tuple[Outcome, ...]:
    configuration = load_configuration(None, [])
    made = (read_run(dataset) or {})["configuration"]
    content = {**configuration, "observations": str(dataset.resolve()), "dataset": made} | _made_by(INSTRUMENT)
    run = Run("estimate", content, reads=(dataset,))
    return _kept_if_valid(out, run, manner, lambda: estimate_all(dataset, configuration, out, executor=manner.executor, quiet=manner.quiet))


def _made_by(packages: tuple[str, ...]) -> dict[str, object]:
    return {"made_by": {"sources": sources_digest(packages), "versions": versions()}}


def _kept_if_valid(out: Path, run: Run, manner: Manner, work: Callable[[], tuple[Outcome, ...]]) -> tuple[Outcome, ...]:
    """Do ``work`` in ``out``: on top of what is there when it was made in the same way, otherwise from nothing."""
    before = (read_run(out) or {}).get("configuration")
    same = before is not None and not first_difference(before, json.loads(json.dumps(run.configuration)))
    valid = same and not manner.force
    with output_directory(out, run, resume=valid, force=not valid):
        outcomes = work()
        note_failures(out, {outcome.name: outcome.message for outcome in failures(outcomes)})
    return outcomes


def _row(outcome: Outcome, estimates: Path, truth: Path) -> Row:
    if outcome.state is not State.FAILED:
        return score_one(estimate_path(estimates, outcome.name), truth)
    return score(Estimate(outcome.name, Status.NO_CONVERGENCE, outcome.message), read_truth(truth / outcome.name))
