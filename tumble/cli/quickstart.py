"""``tumble quickstart``: the whole way from a recipe to a report, verb by verb, small enough for a coffee break."""

import argparse
import importlib
import json
import shlex
import shutil
import sys
from importlib import resources
from pathlib import Path

from datasets.errors import InputError
from tumble.cli.exit_codes import ALL_MEASURED, INCOMPLETE
from tumble.cli.options import add_jobs, add_output, verb_parser
from tumble.commands import command
from tumble.output_directory import Run, note_failures, output_directory

RECIPE = "demo.toml"


def parser() -> argparse.ArgumentParser:
    """The verb's options."""
    verb = verb_parser(
        "quickstart",
        description="Render two small sequences of a cut stone, estimate, score and report. Needs no data and a few minutes.\n"
        "Every step is an ordinary verb; the commands are printed.",
        example="tumble quickstart --out out/demo",
    )
    add_output(verb, default="out/demo")
    add_jobs(verb)
    return verb


def run(arguments: argparse.Namespace) -> int:
    """Run the steps; the first of which nothing is there to go on with ends it with its exit code."""
    codes = [ALL_MEASURED]
    _refuse_changed_recipe(arguments.out / RECIPE)
    described = Run("quickstart", {"recipe": RECIPE}, reads=())
    with output_directory(arguments.out, described, resume=arguments.resume, force=arguments.force) as out:
        for words in steps(out, _recipe_in(out), arguments):
            codes.append(_step(words, quiet=arguments.quiet or arguments.json))
            if codes[-1] > INCOMPLETE:
                note_failures(out, {f"tumble {words[0]}": f"exit code {codes[-1]}"})
                return codes[-1]
    page = out / "report" / "report.html"
    print(json.dumps({"report": str(page)}) if arguments.json else f"\nThe report: {page}\n{_next(out)}")
    return max(codes)


def steps(out: Path, recipe: Path, arguments: argparse.Namespace) -> list[list[str]]:
    """The commands, as a person would type them."""
    dataset, estimates, truth = str(out / "dataset"), str(out / "estimates"), str(out / "dataset" / "truth")
    again = ["--force"] if arguments.force else ["--resume"]
    jobs = ["--jobs", str(arguments.jobs)]
    return [
        ["render", "--config", str(recipe), "--out", dataset, *jobs, *again],
        ["estimate", dataset, "--out", estimates, *jobs, *again],
        ["score", estimates, "--truth", truth, "--out", str(out / "scores"), *again],
        ["report", estimates, "--truth", truth, "--title", "Tumble: two tosses of a cut stone", "--out", str(out / "report"), *again],
    ]


def _recipe_in(out: Path) -> Path:
    """The demo's recipe, copied to where a person may change it."""
    target = out / RECIPE
    target.write_text(recipe(), encoding="utf-8")
    return target


def recipe() -> str:
    """The demo's recipe."""
    return resources.files("tumble").joinpath(RECIPE).read_text(encoding="utf-8")


def _refuse_changed_recipe(target: Path) -> None:
    """What a person made of the recipe is theirs."""
    if target.is_file() and target.read_text(encoding="utf-8", errors="replace") != recipe():
        raise InputError(f"{target}: expected the demo's recipe, got one that was changed since. Move it away, or choose another --out.")


def _step(words: list[str], *, quiet: bool) -> int:
    if not quiet:
        print(f"\n$ {command(*words)}", flush=True)
    verb = importlib.import_module(f"tumble.cli.{words[0]}")
    return int(verb.run(verb.parser().parse_args([*words[1:], *(["--quiet"] if quiet else [])])))


def _next(out: Path) -> str:
    program = Path(sys.argv[0]).name if shutil.which("tumble") else sys.argv[0]
    return (
        "Open it in a browser. Then change the recipe and go again:\n"
        f"  {shlex.join([program, 'render', '--config', str(out / RECIPE), '--set', 'motion.frames=80', '--out', 'out/mine'])}\n"
        f"  {shlex.join([program, 'estimate', 'out/mine', '--out', 'out/mine-estimates'])}"
    )
