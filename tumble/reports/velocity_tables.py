"""The velocity tables of a report: start and middle of the sequence, and both sides of each impact beside the true one."""

from typing import Any

import numpy as np

from datasets.estimate import Estimate, ImpactEstimate
from datasets.truth import AT_ONCE_FRAMES, Impact, Truth, at_once
from tumble.numbers import with_sigma
from tumble.reports.velocities import rows, rows_beside


def velocity_tables(estimate: Estimate, truth: Truth | None) -> list[dict[str, Any]]:
    """The tables of the start of the sequence, of both sides of each impact, and of the middle; those the estimate lacks are left out."""
    start, middle = (
        [_table(f"Velocities at the {where} of the sequence ({v.time_s * 1e3:.3f} ms)", rows(v, truth))] if v is not None else []
        for where, v in (("start", estimate.start), ("middle", estimate.middle))
    )
    sides = [table for number, impact in enumerate(estimate.impacts, start=1) for table in _impact_tables(number, impact, truth)]
    return [*start, *sides, *middle]


def _table(heading: str, found: list[dict[str, Any]]) -> dict[str, Any]:
    return {"heading": heading, "rows": found}


def _impact_tables(number: int, impact: ImpactEstimate, truth: Truth | None) -> list[dict[str, Any]]:
    """Right before and right after an impact, beside the true one that is nearest in time."""
    event = None if truth is None or not truth.impacts else _event_of(impact, truth)
    when = f"{with_sigma(impact.time_s * 1e3, impact.time_sigma_s * 1e3)} ms"
    before = None if event is None else np.concatenate([event[0].v_before, event[0].omega_before])
    after = None if event is None else np.concatenate([event[-1].v_after, event[-1].omega_after])
    return [
        _table(f"Velocities right before impact {number} ({when})", rows_beside(impact.before, before)),
        _table(f"Velocities right after impact {number}", rows_beside(impact.after, after)),
    ]


def _event_of(impact: ImpactEstimate, truth: Truth) -> list[Impact]:
    """The true impact nearest in time; contacts less than a frame apart are one, as they are in scores."""
    frame_s = float(np.median(np.diff(truth.motion.times_s)))
    return min(at_once(list(truth.impacts), AT_ONCE_FRAMES * frame_s), key=lambda event: abs(event[0].time_s - impact.time_s))
