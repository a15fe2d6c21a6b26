"""``tumble score``: estimates beside the truth."""

import argparse
import json
from pathlib import Path
from typing import Any

import pandas as pd
from rich.table import Table

from datasets.errors import InputError
from datasets.scoring.collisions import collision_summary
from datasets.scoring.efficiency import efficiency
from datasets.scoring.impacts import impact_summary
from datasets.scoring.table import aggregate, status_counts, worse_sequences
from tumble.cli.console import console
from tumble.cli.options import add_output, verb_parser
from tumble.commands import command
from tumble.output_directory import Run, output_directory
from tumble.reporting import frame_words
from tumble.scoring import (
    COLLISIONS_FILE,
    IMPACTS_FILE,
    TABLE_FILE,
    score_all,
    score_all_collisions,
    score_all_impacts,
    summary,
    write_rows,
    write_scores,
)

SHOWN = (
    "middle_in_plane_percent",
    "middle_out_of_plane_percent",
    "middle_angular_percent",
    "orientation_median_deg",
    "position_median_mm",
)

POOR = ("in_plane", "angular")
"""What decides that a sequence is poor, shown with its own standard deviation."""


def parser() -> argparse.ArgumentParser:
    """The verb's options."""
    verb = verb_parser(
        "score",
        description="Compare estimates with the truth: scores.csv has one tidy row per sequence, scores.json the aggregates.\n"
        "Where the particles hit a plate or one another, impacts.csv has one row per impact; collisions.csv one per pair that collides.\n"
        "Each sequence that is worse is named with its cause.",
        example="tumble score out/estimates --truth out/dataset/truth --out out/scores",
    )
    verb.add_argument("estimates", type=Path, metavar="ESTIMATES", help="a folder of estimates, or one estimate file")
    verb.add_argument("--truth", type=Path, required=True, metavar="FOLDER", help="the dataset's truth folder")
    add_output(verb, default="out/scores")
    return verb


def run(arguments: argparse.Namespace) -> int:
    """Score, store, print."""
    if not arguments.truth.is_dir():
        raise InputError(f"{arguments.truth}: expected the truth folder of a dataset, got nothing.")
    read = {"estimates": arguments.estimates, "truth": arguments.truth}
    described = Run("score", {name: str(path.resolve()) for name, path in read.items()}, reads=tuple(read.values()))
    with output_directory(arguments.out, described, resume=arguments.resume, force=arguments.force) as out:
        table = score_all(arguments.estimates, arguments.truth)
        write_scores(table, out)
        impacts = score_all_impacts(arguments.estimates, arguments.truth)
        collisions = score_all_collisions(arguments.estimates, arguments.truth)
        write_rows(impacts, out / IMPACTS_FILE)
        write_rows(collisions, out / COLLISIONS_FILE)
    struck = {"impacts": impact_summary(impacts)} if len(impacts) else {}
    struck |= {"collisions": collision_summary(collisions)} if len(collisions) else {}
    if arguments.json:
        print(json.dumps({**summary(table), **struck}))
    elif not arguments.quiet:
        say_scores(table)
        if words := frame_words(arguments.estimates):
            console().print(words, soft_wrap=True)
        if len(impacts):
            say_impacts(impact_summary(impacts))
        if len(collisions):
            say_collisions(collision_summary(collisions))
        console().print(f"table: {arguments.out / TABLE_FILE}", soft_wrap=True)
        console().print(f"next: {command('report', arguments.estimates, '--truth', arguments.truth)}", soft_wrap=True)
    return 0


def say_scores(scores: pd.DataFrame) -> None:
    """Aggregates, statuses and the worse sequences for people."""
    out = console()
    statuses = ", ".join(f"{row['n']} {row['status']}" for row in status_counts(scores).to_dict("records"))
    out.print(f"{len(scores)} sequences: {statuses}")
    table = Table("metric", "unit", "median", "5%", "95%", "inside tolerance", "95% intervals that hold truth", box=None, pad_edge=False)
    for row in aggregate(scores).to_dict("records"):
        if row["metric"] in SHOWN:
            table.add_row(
                row["metric"].replace("middle_", "").replace("_", " "),
                row["unit"],
                *(f"{row[key]:.3f}" for key in ("median", "p05", "p95")),
                f"{row['inside_tolerance']:.0%}",
                "–" if pd.isna(row["coverage"]) else f"{row['coverage']:.0%}",
            )
    out.print(table)
    for row in efficiency(scores).to_dict("records"):
        named = f"{row['quantity']}: RMSE {row['rmse']:.3g} {row['unit']}"
        out.print(f"{named}, {row['rmse_over_bound']:.2f} times the bound of the true body ({row['rms_bound']:.3g})", soft_wrap=True)
    for row in worse_sequences(scores).to_dict("records"):
        parts = (f"{name.replace('_', '-')} {row[f'{name}_percent']:.2f} ± {row[f'sigma_{name}_percent']:.2f}%" for name in POOR)
        errors = f" ({', '.join(parts)})"
        measured = not pd.isna(row["in_plane_percent"])
        out.print(f"worse: {row['sequence']}: {row['cause']}{errors if measured else ''}", soft_wrap=True)


def say_impacts(told: dict[str, Any]) -> None:
    """How impacts fared, for people."""
    out = console()
    out.print(f"{told['impacts']} impacts: {told['found']} found")
    if told["found"] == 0:
        return
    out.print(
        f"medians: time {told['median_time_error_frames']:.3f} frames; after the impact {told['median_after_in_plane_percent']:.3f}% "
        f"in plane, {told['median_after_out_of_plane_percent']:.3f}% out of plane, {told['median_after_angular_percent']:.3f}% angular",
        soft_wrap=True,
    )
    out.print(
        f"95% intervals that hold truth: time {told['coverage_time']:.0%}, after the impact v {told['coverage_after_v']:.0%}, "
        f"ω {told['coverage_after_omega']:.0%}",
        soft_wrap=True,
    )


def say_collisions(told: dict[str, Any]) -> None:
    """How collisions of two particles fared, for people."""
    out = console()
    out.print(f"{told['collisions']} collisions of two particles: {told['found']} found")
    if told["found"] == 0:
        return
    out.print(
        f"medians of errors: normal {told['median_normal_error_deg']:.1f}°, e {told['median_restitution_error']:.3f}, impulse ratio "
        f"{told['median_impulse_ratio_error']:.3f}, mass ratio by volumes {told['median_mass_ratio_error']:.4f}, by momentum "
        f"{told['median_momentum_mass_ratio_error']:.4f}; momentum kept in {told['momentum_kept']} of {told['found']}",
        soft_wrap=True,
    )
