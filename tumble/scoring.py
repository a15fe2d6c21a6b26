"""Scores a folder of estimates against the truth and stores the tables."""

import json
from pathlib import Path

import pandas as pd

from datasets.atomic_files import written_whole
from datasets.estimate_files import read_estimate
from datasets.scoring.impacts import impact_table, score_impacts
from datasets.scoring.score import Row, score
from datasets.scoring.table import aggregate, coverage, score_table, status_counts, worse_sequences
from datasets.truth_files import read_truth
from tumble.result_files import estimates_in

TABLE_FILE = "scores.csv"
SUMMARY_FILE = "scores.json"
IMPACTS_FILE = "impacts.csv"
GROUPS = ("n_frames", "n_views", "irregularity", "particle")


def score_all(estimates: Path, truth: Path) -> pd.DataFrame:
    """One row per estimate; ``truth`` is the truth tree of the dataset."""
    return score_table([score_one(path, truth) for path in estimates_in(estimates)])


def score_one(estimate: Path, truth: Path) -> Row:
    """The row of one estimate."""
    measured = read_estimate(estimate)
    return score(measured, read_truth(truth / measured.name))


def score_all_impacts(estimates: Path, truth: Path) -> pd.DataFrame:
    """One row per true impact of the sequences that were estimated; no rows where nothing was hit."""
    measured = [read_estimate(path) for path in estimates_in(estimates)]
    return impact_table([row for estimate in measured for row in score_impacts(estimate, read_truth(truth / estimate.name))])


def write_impacts(impacts: pd.DataFrame, out: Path) -> None:
    """``impacts.csv``, one tidy row per impact."""
    with written_whole(out / IMPACTS_FILE) as temporary:
        impacts.to_csv(temporary, index=False)


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
        "statuses": records(status_counts(table)),
        "worse_sequences": records(worse_sequences(table)),
        "rows": records(table),
    }


def records(table: pd.DataFrame) -> list[dict[str, object]]:
    """Rows of a table as JSON values, NaN as null."""
    found: list[dict[str, object]] = json.loads(table.to_json(orient="records", double_precision=15))
    return found
