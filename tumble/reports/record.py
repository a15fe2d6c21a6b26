"""What a report knows of one sequence: the estimate, and what else is at hand."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from datasets.estimate import Estimate
from datasets.observation import Observation
from datasets.truth import Truth

Polygon = NDArray[np.float64]


@dataclass(frozen=True)
class Record:
    """One sequence of a report.

    ``observation`` and ``truth`` are ``None`` where they are not at hand. ``outlines_px[c][i]``: the estimated outline (n, 2), px, of
    frame ``i`` of camera ``c``, ``None`` where there is none.
    """

    estimate: Estimate
    observation: Observation | None = None
    truth: Truth | None = None
    outlines_px: tuple[Sequence[Polygon | None], ...] = ()
