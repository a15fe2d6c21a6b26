"""``tumble benchmark``: named, versioned sets of sequences that everybody can make, check and cite."""

import argparse
import json
from pathlib import Path

from datasets.dataset_files import read_dataset, truth_folder
from datasets.errors import InputError, TumbleError
from datasets.truth_files import read_truth
from tumble.benchmarks.papers import MANIFEST, TARGETS, against_manifest, card, write_papers, write_targets
from tumble.benchmarks.sets import BenchmarkSet, Target, differing, read_set, read_targets, set_names, target_of, targets_file
from tumble.cli.console import console
from tumble.cli.exit_codes import ALL_MEASURED, INCOMPLETE
from tumble.cli.main import run_verb
from tumble.cli.options import Part, add_engine, add_output, add_parts, executor_of, run_part, verb_parser
from tumble.cli.outcomes import exit_code, report_failures
from tumble.commands import command
from tumble.engine import Outcome, failures
from tumble.output_directory import Run, output_directory
from tumble.rendering import render_dataset

DATASETS, CHALLENGE = "datasets", "challenge"


def parser() -> argparse.ArgumentParser:
    """The verb's options."""
    verb = verb_parser(
        "benchmark",
        description="Named, versioned sets of sequences: what each is and why, make it, check that a copy is whole and the right one.",
        example="tumble benchmark make free_flight --out out/free_flight",
    )
    add_parts(verb, PARTS)
    return verb


def run(arguments: argparse.Namespace) -> int:
    """Run one part."""
    return run_part(arguments, PARTS)


def _no_options(part: argparse.ArgumentParser) -> None:
    pass


def _list(arguments: argparse.Namespace) -> int:
    for name in set_names():
        told = read_set(name)
        console().print(
            f"{name} {told.version}: {told.title}. {told.megabytes:g} MB, {told.minutes:g} minutes", soft_wrap=True, markup=False
        )
    return ALL_MEASURED


def _name_option(part: argparse.ArgumentParser) -> None:
    part.add_argument("set", metavar="SET", help=f"one of {', '.join(set_names())}")


def _show(arguments: argparse.Namespace) -> int:
    console().print(card(read_set(arguments.set)), soft_wrap=True, markup=False, highlight=False)
    return ALL_MEASURED


def _make_options(part: argparse.ArgumentParser) -> None:
    _name_option(part)
    add_output(part, default="out/benchmark")
    add_engine(part)


def _make(arguments: argparse.Namespace) -> int:
    told = read_set(arguments.set)
    if not arguments.quiet:
        console().print(
            f"{told.name} {told.version}: some {told.megabytes:g} MB, about {told.minutes:g} minutes on two cores", markup=False
        )
    if arguments.resume and (arguments.out / MANIFEST).is_file() and (said := against_manifest(arguments.out)):
        raise InputError(
            f"{arguments.out}: expected a set to go on with, got one whose files differ from its manifest: {said[0]}. Use --force."
        )
    described = Run("benchmark make", {"set": told.name, "version": told.version}, reads=())
    with output_directory(arguments.out, described, resume=arguments.resume, force=arguments.force) as out:
        outcomes = _datasets(told, out, arguments)
        report_failures(out, outcomes, verbose=arguments.verbose)
        if told.challenge:
            _challenge(told, out, arguments)
        elif not failures(outcomes):
            write_targets(_targets(told, out), out / TARGETS)
        if not failures(outcomes):
            write_papers(told, out)
    code = exit_code(outcomes) if outcomes else ALL_MEASURED
    if code == ALL_MEASURED and not arguments.quiet:
        console().print(f"next: {command('benchmark', 'verify', arguments.out)}", soft_wrap=True)
    return code


def _datasets(told: BenchmarkSet, out: Path, arguments: argparse.Namespace) -> tuple[Outcome, ...]:
    outcomes: list[Outcome] = []
    for name, recipe in told.recipes.items():
        outcomes += render_dataset(recipe, out / DATASETS / name, executor=executor_of(arguments), quiet=arguments.quiet)
    return tuple(outcomes)


def _challenge(told: BenchmarkSet, out: Path, arguments: argparse.Namespace) -> None:
    words = [*told.challenge, "--out", str(out / CHALLENGE), "-q", *(["--resume"] if (out / CHALLENGE).exists() else [])]
    words += ["--scheduler", arguments.scheduler] if arguments.scheduler else ["--jobs", str(arguments.jobs)]
    words += ["--time-limit", str(arguments.time_limit)] if arguments.time_limit else []
    if run_verb("challenge", words) != ALL_MEASURED:
        raise TumbleError(f"{out / CHALLENGE}: not all campaigns could be made, as told above. The same command with --resume goes on.")


def _targets(told: BenchmarkSet, out: Path) -> list[Target]:
    folders = {name: out / DATASETS / name for name in told.recipes}
    return [
        target_of(name, read_truth(truth_folder(folder, sequence)))
        for name, folder in folders.items()
        for sequence in read_dataset(folder).sequences
    ]


def _verify_options(part: argparse.ArgumentParser) -> None:
    part.add_argument("folder", type=Path, metavar="FOLDER", help="a set, as `tumble benchmark make` writes it")
    part.add_argument("--set", metavar="SET", help="which set it is to be (default: what its run.json says)")


def _verify(arguments: argparse.Namespace) -> int:
    said = against_manifest(arguments.folder)
    name, version = _named(arguments.folder)
    told = read_set(arguments.set or name)
    if (name, version) != (told.name, told.version):
        said.append(f"run.json: expected {told.name} {told.version}, got {name} {version}")
    if told.recipes and not said:
        said += differing(_targets(told, arguments.folder), read_targets(targets_file(told.name)))
    for sentence in said:
        console().print(sentence, soft_wrap=True, markup=False)
    if not arguments.quiet:
        same = f", and {told.name} {told.version}" if told.recipes else "; which campaigns a challenge has, no list says"
        verdict = f"{len(said)} differences" if said else f"whole{same}"
        console().print(f"{arguments.folder}: {verdict}", soft_wrap=True, markup=False)
    return INCOMPLETE if said else ALL_MEASURED


def _named(folder: Path) -> tuple[str, str]:
    try:
        made = json.loads((folder / "run.json").read_text(encoding="utf-8"))["configuration"]
        return str(made["set"]), str(made["version"])
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(f"{folder / 'run.json'}: expected the name and version of a benchmark set, got none.") from error


PARTS: tuple[Part, ...] = (
    ("list", "all sets, with their size", _no_options, _list),
    ("show", "the card of a set", _name_option, _show),
    ("make", "make a set", _make_options, _make),
    ("verify", "check that a copy of a set is whole and the right one", _verify_options, _verify),
)
