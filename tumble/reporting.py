"""Collects what a report shows: estimates, and observations and truth where they are at hand."""

from pathlib import Path

from datasets.estimate_files import read_estimate
from datasets.observation_files import read_observation
from datasets.trajectory_files import trajectories_in
from datasets.truth_files import FILE as TRUTH_FILE
from datasets.truth_files import read_truth
from tumble.reports.overlay import estimated_outlines
from tumble.reports.record import Record
from tumble.result_files import estimates_in, observations_in
from tumble.written_files import read_run


def source_of(estimates: Path) -> Path | None:
    """Where the observations of a folder of estimates were read from, as its ``run.json`` says, if they are still there.

    ``None`` for trajectories as well: there is no picture to show.
    """
    run = read_run(estimates)
    source = Path(run["configuration"]["observations"]) if run and "observations" in run["configuration"] else None
    return source if source is not None and source.exists() and not trajectories_in(source) else None


def collect(estimates: Path, observations: Path | None, truth: Path | None) -> list[Record]:
    """One record per estimate, by name."""
    folders = {folder.name: folder for folder in observations_in(observations)} if observations is not None else {}
    return [_record(path, folders, truth) for path in estimates_in(estimates)]


def _record(path: Path, folders: dict[str, Path], truth: Path | None) -> Record:
    estimate = read_estimate(path)
    observation = read_observation(folders[estimate.name]) if estimate.name in folders else None
    known = truth is not None and (truth / estimate.name / TRUTH_FILE).is_file()
    return Record(
        estimate,
        observation,
        read_truth(truth / estimate.name) if known and truth is not None else None,
        () if observation is None else estimated_outlines(estimate, observation),
    )
