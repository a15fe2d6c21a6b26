"""``tumble report``: one self-contained HTML page from saved results."""

import argparse
import json
from pathlib import Path

from tumble.cli.options import add_output, verb_parser
from tumble.output_directory import Run, output_directory
from tumble.read_paths import observations_read, paths_given
from tumble.reporting import collect, source_of
from tumble.reports.page import write_page

PAGE = "report.html"


def parser() -> argparse.ArgumentParser:
    """The verb's options."""
    verb = verb_parser(
        "report",
        description="Write report.html: frames with the estimated outline over them, errors, trajectory, velocities with intervals.\n"
        "It opens from disk and needs no network.",
        example="tumble report out/estimates --truth out/dataset/truth --out out/report",
    )
    verb.add_argument("estimates", type=Path, metavar="ESTIMATES", help="a folder of estimates, or one estimate file")
    verb.add_argument("--observations", type=Path, metavar="FOLDER", help="the observations (default: where the estimates say)")
    verb.add_argument("--truth", type=Path, metavar="FOLDER", help="the dataset's truth folder, to show beside the estimates")
    verb.add_argument("--title", default="Tumble report", help="the page's title (default: %(default)s)")
    add_output(verb, default="out/report")
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
        write_page(collect(arguments.estimates, observations, arguments.truth), out / PAGE, title=arguments.title)
    path = arguments.out / PAGE
    if arguments.json:
        print(json.dumps({"report": str(path)}))
    elif not arguments.quiet:
        print(f"report: {path}")
    return 0
