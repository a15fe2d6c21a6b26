"""Impacts of measured trajectories: read, measured all together, one estimate written for each."""

from dataclasses import replace
from pathlib import Path

from datasets.errors import InputError
from datasets.estimate_files import write_estimate
from datasets.trajectory import Trajectory
from datasets.trajectory_files import read_trajectory, trajectories_in
from estimator.measurements.trajectories.impacts import may_have_impacts, measure_impacts
from tumble.campaigning import Known
from tumble.result_files import estimate_path
from tumble.tracked_bodies import body_from_mesh


def trajectories_with_impacts(source: Path, known: Known) -> tuple[list[Trajectory], dict[str, str]]:
    """The trajectories of ``source`` where any of them strikes something, none otherwise; and why others cannot be read."""
    found: list[Trajectory] = []
    left_out: dict[str, str] = {}
    body = None if known.mesh is None else body_from_mesh(known.mesh)
    for path in trajectories_in(source):
        try:
            trajectory = read_trajectory(path, known.surroundings)
        except InputError as error:
            left_out[path.name] = str(error)
            continue
        surroundings = trajectory.surroundings if body is None else replace(trajectory.surroundings, body=body)
        found.append(replace(trajectory, surroundings=surroundings))
    return (found, left_out) if may_have_impacts(found) else ([], {})


def estimate_impacts(trajectories: list[Trajectory], out: Path) -> None:
    """Measure and write."""
    for estimate in measure_impacts(trajectories):
        write_estimate(estimate, estimate_path(out, estimate.name))
