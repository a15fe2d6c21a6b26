"""Drops onto a plate in the challenge: what is measured of impacts against what was true, and the figures that they are held to.

An impact is one of nature's contacts where exactly one happens between the frames that the flights before and after it are seen in, or near
them. Where more happen there, the pictures show their sum, and no interval of one of them is asked for.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.stats import chi2

from datasets.truth import Impact, Truth
from datasets.truth_files import read_truth
from tumble.challenge.cases import Case, case_folder
from tumble.challenge.figures import Figure, share, share_of_rows

Array = NDArray[np.float64]
CLOSE_FRAMES = 3
"""Contacts within so many frames of one another are not found one by one (:mod:`estimator.impacts.impact_search`)."""
INSIDE = float(chi2.isf(0.05, 3))
PARTS = (("v", slice(0, 3)), ("omega", slice(3, 6)))


def impact_rows(case: Case, root: Path, answer: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Errors of v (m/s) and omega (rad/s) before and after every impact that was one contact, each with its chi-squared of 3."""
    rows = []
    for found in answer.get("impacts", ()):
        truth = read_truth(case_folder(root, case.name) / found["recording"])
        true = _between(truth, found["between_s"])
        if len(true) == 1:
            row = {"case": case.name, "kind": case.kind, "recording": found["recording"], "spread_s": found["spread_s"]}
            rows.append({**row, **_errors(found, true[0])})
    return rows


def _between(truth: Truth, ends_s: Array) -> list[Impact]:
    """The contacts between two frames, which are named by their time stamps, or ``CLOSE_FRAMES`` beside them."""
    stamps = truth.motion.times_s
    times = np.array(truth.notes.get("true_times_s", stamps))
    last, first = (int(np.argmin(np.abs(stamps - end))) for end in ends_s)
    start, end = times[max(last - CLOSE_FRAMES, 0)], times[min(first + CLOSE_FRAMES, len(times) - 1)]
    return [impact for impact in truth.impacts if start <= impact.time_s <= end]


def _errors(found: Mapping[str, Any], true: Impact) -> dict[str, float]:
    covariance, row = np.array(found["covariance"]), {}
    sides = {"before": (true.v_before, true.omega_before), "after": (true.v_after, true.omega_after)}
    for k, (side, velocities) in enumerate(sides.items()):
        error = np.array(found[side]) - np.concatenate(velocities)
        C = covariance[6 * k : 6 * k + 6, 6 * k : 6 * k + 6]
        for name, part in PARTS:
            row[f"{name}_{side}"] = float(np.linalg.norm(error[part]))
            row[f"{name}_{side}_chi2"] = float(error[part] @ np.linalg.solve(C[part, part], error[part]))
    return row


def drops_figures(cases: pd.DataFrame, impacts: pd.DataFrame) -> list[Figure]:
    """The lines of drops onto a plate."""
    singles, controls = cases[cases["kind"] == "single"], cases[cases["kind"] == "control"]
    own = singles[singles["own_ratio"] >= 1.0]
    found = [
        share(
            "drops",
            "hidden beside a plate: first or in its group, of those above the limit in their very campaign",
            own["within_group"] | own["named_first"],
            least=90.0,
            needed=20,
        ),
        share("drops", "the same of all that were hidden", singles["within_group"] | singles["named_first"]),
        share("drops", "false alarms on controls beside a plate", controls["false_alarm"], most=5.0, needed=20),
    ]
    for side in ("before", "after") if len(impacts) else ():
        for name, word in (("v", "v"), ("omega", "ω")):
            hits = impacts[f"{name}_{side}_chi2"] <= INSIDE
            found.append(share_of_rows("drops", f"{word} {side} the impact inside its 95% ellipsoid", hits, impacts["case"]))
    return found
