"""Scores a folder of estimates against the truth and stores the tables."""

import json
from pathlib import Path

import pandas as pd

from datasets.atomic_files import written_whole
from datasets.estimate_files import read_estimate
from datasets.scoring.collisions import parts_of, score_collision
from datasets.scoring.efficiency import efficiency
from datasets.scoring.impacts import impact_table, score_impacts
from datasets.scoring.score import Row, score
from datasets.scoring.table import aggregate, coverage, ellipsoid_coverage, score_table, status_counts, worse_sequences
from datasets.truth_files import read_truth
from tumble.reports.words import adequate
from tumble.result_files import estimates_in

TABLE_FILE = "scores.csv"
SUMMARY_FILE = "scores.json"
IMPACTS_FILE = "impacts.csv"
COLLISIONS_FILE = "collisions.csv"
GROUPS = ("n_frames", "n_views", "irregularity", "particle")


def score_all(estimates: Path, truth: Path) -> pd.DataFrame:
    """One row per estimated particle; ``truth`` is the truth tree of the dataset."""
    return score_table([row for path in estimates_in(estimates) for row in score_particles(path, truth)])


def score_one(estimate: Path, truth: Path) -> Row:
    """The row of one estimate; of its first particle where it has two."""
    return score_particles(estimate, truth)[0]


def score_particles(estimate: Path, truth: Path) -> list[Row]:
    """The row of one estimate, and of its second particle; ``misfit``: whether it says of itself that its residuals are not noise."""
    measured = read_estimate(estimate)
    parts = parts_of(measured, read_truth(truth / measured.name))
    return [{**score(part, true), "sequence": name, "misfit": not adequate(measured)} for name, part, true in parts]


def score_all_impacts(estimates: Path, truth: Path) -> pd.DataFrame:
    """One row per true impact of the sequences that were estimated; no rows where nothing was hit."""
    measured = [read_estimate(path) for path in estimates_in(estimates)]
    parts = [part for estimate in measured for part in parts_of(estimate, read_truth(truth / estimate.name))]
    return impact_table([{**row, "sequence": name} for name, part, true in parts for row in score_impacts(part, true)])


def score_all_collisions(estimates: Path, truth: Path) -> pd.DataFrame:
    """One row per sequence of two particles that collide; no rows where there are none."""
    measured = [read_estimate(path) for path in estimates_in(estimates)]
    return pd.DataFrame([row for estimate in measured for row in score_collision(estimate, read_truth(truth / estimate.name))])


def write_rows(rows: pd.DataFrame, path: Path) -> None:
    """``impacts.csv`` or ``collisions.csv``: one tidy row each; no file where there are none."""
    if len(rows):
        with written_whole(path) as temporary:
            rows.to_csv(temporary, index=False)


def write_scores(table: pd.DataFrame, out: Path) -> None:
    """``scores.csv``, one tidy row per sequence, and ``scores.json``, the aggregates."""
    with written_whole(out / TABLE_FILE) as temporary:
        table.to_csv(temporary, index=False)
    with written_whole(out / SUMMARY_FILE) as temporary:
        temporary.write_text(json.dumps(summary(table), indent=1) + "\n", encoding="utf-8")


def summary(table: pd.DataFrame) -> dict[str, object]:
    """Every aggregate as JSON; what is unknown is null."""
    groups = {name: records(aggregate(table, name)) for name in GROUPS if table[name].notna().any()}
    return {
        "all": records(aggregate(table)),
        "by": groups,
        "coverage": records(coverage(table)),
        "ellipsoids": records(ellipsoid_coverage(table)),
        "efficiency": records(efficiency(table)),
        "statuses": records(status_counts(table)),
        "worse_sequences": records(worse_sequences(table)),
        "rows": records(table),
    }


def records(table: pd.DataFrame) -> list[dict[str, object]]:
    """Rows of a table as JSON values, NaN as null."""
    found: list[dict[str, object]] = json.loads(table.to_json(orient="records", double_precision=15))
    return found
