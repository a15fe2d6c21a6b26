"""``tumble render``: a recipe becomes a dataset folder."""

import argparse
import json
from pathlib import Path

from datasets.recipes.toml_files import load_recipe, recipe_to_dict
from tumble.cli.options import add_configuration, add_engine, add_output, executor_of, verb_parser
from tumble.cli.outcomes import exit_code, report_failures, what_next
from tumble.commands import command
from tumble.engine import Outcome, State
from tumble.output_directory import Run, output_directory
from tumble.read_paths import paths_given
from tumble.rendering import render_dataset, variant_of


def parser() -> argparse.ArgumentParser:
    """The verb's options."""
    verb = verb_parser(
        "render",
        description="Make a dataset from a recipe: observations/ for the estimator and, apart from it, truth/.\n"
        "Without --config the recipe's defaults hold; docs/format.md describes every key.",
        example="tumble render --set sequences=4 --set motion.frames=60 --out out/dataset",
    )
    add_configuration(verb, what="the recipe")
    add_output(verb, default="out/dataset")
    add_engine(verb)
    return verb


def run(arguments: argparse.Namespace) -> int:
    """Render; exit code 1 when a sequence failed, 2 when all did."""
    recipe = load_recipe(arguments.config, arguments.settings)
    described = Run(
        "render",
        recipe_to_dict(recipe),
        recipe.seed,
        variant_of(recipe),
        reads=(*paths_given(arguments.config), *map(Path, recipe.particle.files)),
    )
    with output_directory(arguments.out, described, resume=arguments.resume, force=arguments.force) as out:
        outcomes = render_dataset(recipe, out, executor=executor_of(arguments), quiet=arguments.quiet)
        report_failures(out, outcomes, verbose=arguments.verbose)
    _say(outcomes, out, arguments)
    return exit_code(outcomes)


def _say(outcomes: tuple[Outcome, ...], out: Path, arguments: argparse.Namespace) -> None:
    made = sum(outcome.state is not State.FAILED for outcome in outcomes)
    if arguments.json:
        print(json.dumps({"dataset": str(out), "sequences": made, "failed": len(outcomes) - made}))
    elif not arguments.quiet:
        then = command("estimate", out, "--out", out.parent / "estimates") if made else None
        print(f"{made} of {len(outcomes)} sequences are in {out}\n{what_next(then)}")
