"""What the gate compares of every kind of sequence, and the rows of a run: lower is better in all."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from datasets.errors import InputError
from datasets.estimate import Estimate, Status
from datasets.scoring.impacts import score_impacts
from datasets.scoring.metrics import metric
from datasets.scoring.score import matching_frames, score
from datasets.truth import Truth

Row = dict[str, Any]


@dataclass(frozen=True)
class Measure:
    """One figure of a sequence: its ``key``, what it is in ``words``; ``nats``: it is a logarithm already.

    ``floor``: what is at least added to it before ratios are taken, in its own unit: an error below that is as good as none.
    """

    key: str
    words: str
    floor: float
    nats: bool = False


PERCENT, DEGREES, MILLIMETRES, FRAMES = 1e-3, 1e-3, 1e-4, 1e-4
METRES_PER_SECOND, RADIANS_PER_SECOND = 1e-5, 1e-4
SQUARED, HELD_OUT = 0.01, 0.01
"""Floors of measures by unit (of squared errors over what is stated and of held-out errors: in their expected value), by judgement: far
below what any set measures, so that they act only where half of a baseline's errors are zero."""

FLIGHT = (
    Measure("middle_in_plane_percent", "error of v in the picture's plane", PERCENT),
    Measure("middle_out_of_plane_percent", "error of v in depth", PERCENT),
    Measure("middle_angular_percent", "error of omega", PERCENT),
    Measure("orientation_median_deg", "error of the orientation", DEGREES),
    Measure("position_in_plane_mm", "error of the position in the picture's plane", MILLIMETRES),
    Measure("middle_mahalanobis2", "squared errors over what is stated", SQUARED),
    Measure("sigma_percent", "stated standard deviations", PERCENT),
)
IMPACT = (
    Measure("time_frames", "error of the time of impact", FRAMES),
    Measure("before_in_plane_percent", "error of v before, in the picture's plane", PERCENT),
    Measure("before_angular_percent", "error of omega before", PERCENT),
    Measure("after_in_plane_percent", "error of v after, in the picture's plane", PERCENT),
    Measure("after_angular_percent", "error of omega after", PERCENT),
    Measure("mahalanobis2", "squared errors over what is stated", SQUARED),
    Measure("time_sigma_frames", "stated standard deviation of the time", FRAMES),
)
CAMPAIGN = (
    Measure("names_nats", "surprise at what was hidden", 0.0, nats=True),
    Measure("velocity_ms", "error of v", METRES_PER_SECOND),
    Measure("angular_rads", "error of omega", RADIANS_PER_SECOND),
    Measure("velocity_chi2", "squared errors of v and omega over what is stated", SQUARED),
    Measure("parameter_percent", "error of the hidden effects' parameters", PERCENT),
    Measure("parameter_chi2", "their squared errors over what is stated", SQUARED),
    Measure("held_out", "held-out error", HELD_OUT),
)
MEASURES: Mapping[str, tuple[Measure, ...]] = {"flights": FLIGHT, "pictures": FLIGHT, "impacts": IMPACT, "campaigns": CAMPAIGN}
"""Of every kind, in the order in which kinds are run."""


def gate_row(kind: str, estimate: Estimate, truth: Truth) -> Row:
    """The row of one sequence of a kind that is estimated for itself; a wrong pose that converged is not measured.

    Raises
    ------
    InputError
        When the estimate is of another sequence.
    """
    if estimate.name != truth.name:
        raise InputError(f'expected the estimate of sequence "{truth.name}", got that of "{estimate.name}".')
    told = {"sequence": truth.name, "status": estimate.status.value}
    row, right = _impact(estimate, truth) if kind == "impacts" else _flight(estimate, truth)
    none = [measure.words for measure in MEASURES[kind] if math.isnan(row[measure.key])]
    if right and none:
        told["status"] = f"{estimate.status.value}, but no number for the {none[0]}"
    return {**told, "measured": right and not none, **row}


def _flight(estimate: Estimate, truth: Truth) -> tuple[Row, bool]:
    """Of a flight; whether it converged with a right pose."""
    row = score(estimate, truth)
    sigmas = [row[f"middle_sigma_{part}_percent"] for part in ("in_plane", "out_of_plane", "angular")]
    own = {"sigma_percent": float(np.prod(sigmas) ** (1 / len(sigmas))), "position_in_plane_mm": _position_in_plane_mm(estimate, truth)}
    wrong = row["orientation_median_deg"] > metric("orientation_median_deg").tolerance
    found = {measure.key: own.get(measure.key, row.get(measure.key)) for measure in FLIGHT}
    return found, estimate.status is Status.CONVERGED and not wrong


def _position_in_plane_mm(estimate: Estimate, truth: Truth) -> float:
    """Median distance to the true centre of mass across the first camera's optical axis; in depth it is some ten times as large."""
    if estimate.motion is None or estimate.status is not Status.CONVERGED:
        return math.nan
    apart = estimate.motion.x_world - truth.motion.x_world[matching_frames(estimate.motion.times_s, truth)]
    return 1e3 * float(np.median(np.hypot(apart[:, 0], apart[:, 1])))


def _impact(estimate: Estimate, truth: Truth) -> tuple[Row, bool]:
    """Of the first impact; whether it was found."""
    impacts = score_impacts(estimate, truth)
    if not impacts or not impacts[0]["found"]:
        return dict.fromkeys((measure.key for measure in IMPACT), math.nan), False
    row = impacts[0]
    own = {"time_frames": row["time_error_frames"], "mahalanobis2": row["before_mahalanobis2"] + row["after_mahalanobis2"]}
    return {measure.key: own.get(measure.key, row.get(measure.key)) for measure in IMPACT}, True
