"""``tumble bench``: runs the benchmarks in ``scripts/benchmarks/bench_*.py`` and gathers their figures.

A benchmark is a program of its own, so that one cannot warm caches or take memory for another. Run as
``python -m scripts.benchmarks.bench_<name> --json`` it prints a list of figures: ``name``, ``value``, ``unit`` and, where there is one,
``limit`` with ``direction`` (``lower`` or ``higher`` is better).
"""

import argparse
import json
import subprocess
import sys
from importlib import resources
from pathlib import Path
from typing import Any

from rich.table import Table

from datasets.atomic_files import written_whole
from datasets.errors import InputError, TumbleError
from tumble.cli.console import console
from tumble.cli.options import add_output, verb_parser
from tumble.output_directory import Run, output_directory
from tumble.progress import progress

PREFIX = "bench_"
FIGURES_FILE = "figures.json"
Figure = dict[str, Any]


def parser() -> argparse.ArgumentParser:
    """The verb's options."""
    verb = verb_parser(
        "bench",
        description="Time the kernel beside plain NumPy, a whole estimate with its memory, and crop rendering beside full frames.",
        example="tumble bench --only kernel --out out/bench",
    )
    verb.add_argument("--only", action="append", default=[], metavar="NAME", help=f"run this benchmark alone ({', '.join(benchmarks())})")
    add_output(verb, default="out/bench")
    return verb


def benchmarks() -> tuple[str, ...]:
    """Names of the benchmarks there are."""
    folder = resources.files("scripts.benchmarks")
    return tuple(sorted(Path(entry.name).stem.removeprefix(PREFIX) for entry in folder.iterdir() if entry.name.startswith(PREFIX)))


def run(arguments: argparse.Namespace) -> int:
    """Run; exit code 1 when a figure misses its limit."""
    names = tuple(arguments.only) or benchmarks()
    unknown = [name for name in names if name not in benchmarks()]
    if unknown:
        raise InputError(f"--only {unknown[0]}: expected one of {', '.join(benchmarks())}.")
    described = Run("bench", {"only": list(names)}, reads=())
    with output_directory(arguments.out, described, resume=arguments.resume, force=arguments.force) as out:
        figures = _measure_all(names, quiet=arguments.quiet)
        with written_whole(out / FIGURES_FILE) as temporary:
            temporary.write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")
    if arguments.json:
        print(json.dumps(figures))
    elif not arguments.quiet:
        _say(figures)
    return int(not all(within(figure) for entries in figures.values() for figure in entries))


def _measure_all(names: tuple[str, ...], *, quiet: bool) -> dict[str, list[Figure]]:
    figures = {}
    with progress("bench", len(names), quiet=quiet) as advance:
        for name in names:
            figures[name] = measure(name)
            advance(name)
    return figures


def measure(name: str) -> list[Figure]:
    """The figures of one benchmark, run in a process of its own."""
    command = [sys.executable, "-m", f"scripts.benchmarks.{PREFIX}{name}", "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise TumbleError(f"benchmark {name} failed: {done.stderr.strip().splitlines()[-1] if done.stderr.strip() else done.returncode}")
    figures: list[Figure] = json.loads(done.stdout)
    return figures


def within(figure: Figure) -> bool:
    """Whether a figure keeps its limit; one without a limit always does."""
    limit = figure.get("limit")
    if limit is None:
        return True
    return bool(figure["value"] <= limit if figure.get("direction", "lower") == "lower" else figure["value"] >= limit)


def _say(figures: dict[str, list[Figure]]) -> None:
    table = Table("benchmark", "figure", "value", "unit", "limit", "", box=None, pad_edge=False)
    for name, entries in figures.items():
        for figure in entries:
            limit = figure.get("limit")
            sign = "≤" if figure.get("direction", "lower") == "lower" else "≥"
            bound = "" if limit is None else f"{sign} {limit:g}"
            verdict = "" if limit is None else ("kept" if within(figure) else "missed")
            table.add_row(name, figure["name"], f"{figure['value']:.4g}", figure["unit"], bound, verdict)
    console().print(table)
