"""The sequences of a gate made anew: rendered, estimated or solved, and scored; what is still valid in the work folder stays.

A gate is asked because code has changed, so a result is valid only for the code that made it: ``run.json`` of every step holds a
digest of the sources behind it, and a step whose recipe, configuration or sources differ starts from nothing. An interrupted run with
the same ones goes on where it stopped.
"""

import json
import resource
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from datasets.dataset_files import read_dataset, truth_folder
from datasets.errors import InputError, TumbleError
from datasets.estimate import Estimate, Status
from datasets.estimate_files import read_estimate
from datasets.recipes.recipe import Recipe
from datasets.recipes.toml_files import recipe_to_dict
from datasets.scoring.gate import CAMPAIGNS as CAMPAIGNS_KIND
from datasets.scoring.gate import Rows
from datasets.scoring.gate_measures import Row, gate_row
from datasets.truth_files import read_truth
from tumble.challenge.cases import CAMPAIGNS, TRUTH
from tumble.challenge.solving import solve_campaigns
from tumble.configuring import load_configuration
from tumble.differences import first_difference
from tumble.engine import Executor, Outcome, State, failures
from tumble.estimating import estimate_all
from tumble.gate.campaigns import campaign_rows, make_campaigns
from tumble.gate.sets import GateSet
from tumble.output_directory import Run, note_failures, output_directory
from tumble.rendering import render_dataset, variant_of
from tumble.result_files import estimate_path
from tumble.versions import sources_digest, versions
from tumble.written_files import read_run

NATURE, INSTRUMENT = ("datasets", "synth", "tumble.challenge"), ("datasets", "estimator", "tumble.challenge")
"""The packages behind a sequence and behind what is measured of it."""
Measured = Callable[[], tuple[list[Row], tuple[Outcome, ...]]]
"""Rows of a kind, and what became of every item made or measured."""
DATASET, ESTIMATES, ANSWERS = "dataset", "estimates", "answers"


@dataclass(frozen=True)
class Manner:
    """How to run: by which engine, silent or not, from nothing or not."""

    executor: Executor
    quiet: bool
    force: bool


@dataclass(frozen=True)
class Ran:
    """What came of a run: ``rows`` by kind, what ``failed`` of a fault and why, and the ``cpu_s`` of kinds made and measured whole."""

    rows: Rows
    failed: dict[str, str]
    cpu_s: dict[str, float]


def run_set(gate_set: GateSet, out: Path, manner: Manner) -> Ran:
    """Make and measure all sequences of a set; one that failed has a row without numbers.

    Raises
    ------
    TumbleError
        Where a sequence cannot be made: without it there is nothing to compare.
    """
    work: list[tuple[str, Measured]] = [
        (kind, partial(_one_by_one, kind, recipe, out / kind, manner)) for kind, recipe in gate_set.recipes.items()
    ]
    if gate_set.campaigns:
        work.append((CAMPAIGNS_KIND, partial(_campaigns, gate_set, out / CAMPAIGNS_KIND, manner)))
    rows: dict[str, list[Row]] = {}
    failed: dict[str, str] = {}
    cpu_s: dict[str, float] = {}
    for kind, measured in work:
        began = _cpu_s()
        rows[kind], outcomes = measured()
        if all(outcome.state is State.DONE for outcome in outcomes):
            cpu_s[kind] = _cpu_s() - began
        failed |= {f"{kind}/{outcome.name}": outcome.message for outcome in failures(outcomes)}
    return Ran(rows, failed, cpu_s)


def rows_in(kind: str, folder: Path) -> list[Row]:
    """Rows of all sequences of a kind that were run in ``folder``; what has no estimate has no numbers.

    Raises
    ------
    InputError
        Where an estimate is of another sequence than its file says.
    """
    if kind == CAMPAIGNS_KIND:
        return campaign_rows(folder, folder / ANSWERS)
    dataset = folder / DATASET
    return [_row(kind, name, folder / ESTIMATES, truth_folder(dataset, name)) for name in read_dataset(dataset).sequences]


def _one_by_one(kind: str, recipe: Recipe, out: Path, manner: Manner) -> tuple[list[Row], tuple[Outcome, ...]]:
    dataset, estimates = out / DATASET, out / ESTIMATES
    made = Run("render", recipe_to_dict(recipe) | _made_by(NATURE), recipe.seed, variant_of(recipe), reads=())
    rendered = _kept_if_valid(dataset, made, manner, lambda: render_dataset(recipe, dataset, executor=manner.executor, quiet=manner.quiet))
    _all_made(rendered)
    configuration = load_configuration(None, [])
    content = {**configuration, "observations": str(dataset.resolve()), **_read_from(dataset), **_made_by(INSTRUMENT)}
    described = Run("estimate", content, reads=(dataset,))
    outcomes = _kept_if_valid(
        estimates,
        described,
        manner,
        lambda: estimate_all(dataset, configuration, estimates, executor=manner.executor, quiet=manner.quiet),
    )
    return rows_in(kind, out), (*rendered, *outcomes)


def _campaigns(gate_set: GateSet, out: Path, manner: Manner) -> tuple[list[Row], tuple[Outcome, ...]]:
    plans, truth, answers = gate_set.campaigns, out / TRUTH, out / ANSWERS
    content = gate_set.content_by_kind()[CAMPAIGNS_KIND] | _made_by(NATURE)
    made = Run("challenge make", content, reads=(), beside=(CAMPAIGNS,))
    written = _kept_if_valid(truth, made, manner, lambda: make_campaigns(plans, out, executor=manner.executor, quiet=manner.quiet))
    _all_made(written)
    configuration = load_configuration(None, [])
    content = {**configuration, "challenge": str(out.resolve()), **_read_from(truth), **_made_by(INSTRUMENT)}
    described = Run("challenge solve", content, reads=(out / CAMPAIGNS,))
    outcomes = _kept_if_valid(
        answers, described, manner, lambda: solve_campaigns(out, configuration, answers, executor=manner.executor, quiet=manner.quiet)
    )
    return rows_in(CAMPAIGNS_KIND, out), (*written, *outcomes)


def _all_made(outcomes: tuple[Outcome, ...]) -> None:
    for failed in failures(outcomes):
        raise TumbleError(f"sequence {failed.name} cannot be made, so there is nothing to compare: {failed.message}")


def _made_by(packages: tuple[str, ...]) -> dict[str, Any]:
    return {"made_by": {"sources": sources_digest(packages), "versions": versions()}}


def _read_from(made: Path) -> dict[str, Any]:
    """What the folder of sequences says that it was made from."""
    return {"dataset": (read_run(made) or {})["configuration"]}


def _kept_if_valid(out: Path, run: Run, manner: Manner, work: Callable[[], tuple[Outcome, ...]]) -> tuple[Outcome, ...]:
    """Do ``work`` in ``out``: on top of what is there when it was made in the same way, otherwise from nothing."""
    before: Mapping[str, Any] | None = (read_run(out) or {}).get("configuration")
    same = before is not None and not first_difference(before, json.loads(json.dumps(run.configuration)))
    valid = same and not manner.force
    with output_directory(out, run, resume=valid, force=not valid):
        outcomes = work()
        note_failures(out, {outcome.name: outcome.message for outcome in failures(outcomes)})
    return outcomes


def _row(kind: str, name: str, estimates: Path, truth: Path) -> Row:
    path = estimate_path(estimates, name)
    estimate = read_estimate(path) if path.is_file() else Estimate(name, Status.NO_CONVERGENCE, "no estimate")
    try:
        return gate_row(kind, estimate, read_truth(truth))
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def _cpu_s() -> float:
    """CPU time (s) of this process and of the workers that have ended."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(each.ru_utime + each.ru_stime for each in used)
