"""``tumble check``: look at observations before anything is fitted."""

import argparse
import json
from pathlib import Path

from tumble.checking.checking import check_all
from tumble.cli.check_words import check_code, check_next, say_check
from tumble.cli.console import console
from tumble.cli.options import add_engine, add_output, executor_of, verb_parser
from tumble.cli.outcomes import report_failures
from tumble.commands import command
from tumble.engine import State
from tumble.output_directory import Run, output_directory
from tumble.read_paths import observations_read
from tumble.result_files import observations_in


def parser() -> argparse.ArgumentParser:
    """The verb's options."""
    verb = verb_parser(
        "check",
        description="Look at observations before anything is fitted: a page for each with the outlines over the frames, contrast,\n"
        "saturation, size, motion and blur in pixels, and which frames will be left out and why.\n"
        "Exit code 1: something speaks against a measurement (it is named).",
        example="tumble check out/run --out out/check",
    )
    verb.add_argument("observations", type=Path, metavar="OBSERVATION", help="an observation, a folder of them, or a dataset")
    add_output(verb, default="out/check")
    add_engine(verb)
    return verb


def run(arguments: argparse.Namespace) -> int:
    """Check; exit code 1 where something speaks against a measurement."""
    observations_in(arguments.observations)
    described = Run("check", {"observations": str(arguments.observations.resolve())}, reads=observations_read(arguments.observations))
    with output_directory(arguments.out, described, resume=arguments.resume, force=arguments.force) as out:
        outcomes = check_all(arguments.observations, out, executor=executor_of(arguments), quiet=arguments.quiet)
        report_failures(out, outcomes, verbose=arguments.verbose)
    done = [outcome for outcome in outcomes if outcome.state is State.DONE]
    if arguments.json:
        print(json.dumps([outcome.result for outcome in done]))
    elif not arguments.quiet:
        for outcome in done:
            say_check(outcome.result, with_values=False)
            console().print(f"page: {arguments.out / f'{outcome.name}.check.html'}", soft_wrap=True)
        console().print(check_next(outcomes, command("estimate", arguments.observations)), soft_wrap=True)
    return check_code(outcomes)
