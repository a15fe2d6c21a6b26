"""``tumble report``: one self-contained HTML page from saved results."""

import argparse
import json
from pathlib import Path

from tumble.cli.options import add_engine, add_output, executor_of, verb_parser
from tumble.cli.outcomes import exit_code, report_failures
from tumble.engine import State
from tumble.output_directory import Run, output_directory
from tumble.read_paths import observations_read, paths_given
from tumble.reporting import collect, source_of
from tumble.reports.page import write_page

PAGE = "report.html"


def parser() -> argparse.ArgumentParser:
    """The verb's options."""
    verb = verb_parser(
        "report",
        description="Write report.html: frames with the outlines seen and estimated over them, residuals, the body in 3D, trajectory,\n"
        "velocities with intervals. It opens from disk and needs no network. Beside it, every number as CSV.",
        example="tumble report out/estimates --truth out/dataset/truth --out out/report",
    )
    verb.add_argument("estimates", type=Path, metavar="ESTIMATES", help="a folder of estimates, or one estimate file")
    verb.add_argument("--observations", type=Path, metavar="FOLDER", help="the observations (default: where the estimates say)")
    verb.add_argument("--truth", type=Path, metavar="FOLDER", help="the dataset's truth folder, to show beside the estimates")
    verb.add_argument("--title", default="Tumble report", help="the page's title (default: %(default)s)")
    add_output(verb, default="out/report")
    add_engine(verb)
    return verb


def run(arguments: argparse.Namespace) -> int:
    """Write the page and print its path."""
    observations = arguments.observations or source_of(arguments.estimates)
    sources = {"estimates": arguments.estimates, "observations": observations, "truth": arguments.truth}
    content = {key: None if path is None else str(path.resolve()) for key, path in sources.items()}
    pictures = observations_read(observations) if observations else ()
    reads = paths_given(arguments.estimates, *pictures, arguments.truth)
    described = Run("report", content, reads=reads)
    with output_directory(arguments.out, described, resume=arguments.resume, force=arguments.force) as out:
        outcomes = collect(
            arguments.estimates, observations, arguments.truth, out=out, executor=executor_of(arguments), quiet=arguments.quiet
        )
        parts = [outcome.result for outcome in outcomes if outcome.state is State.DONE]
        if parts:
            write_page(parts, out / PAGE, title=arguments.title)
        report_failures(out, outcomes, verbose=arguments.verbose)
    path = arguments.out / PAGE
    if not parts:
        return exit_code(outcomes)
    if arguments.json:
        print(json.dumps({"report": str(path)}))
    elif not arguments.quiet:
        print(f"report: {path}")
    return exit_code(outcomes)
