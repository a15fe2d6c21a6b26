"""What a user states as a part of the evidence: rows beside those of the data, on effects in the fit and on all others on trial.

A fact ``fᵀ theta = y ± s`` adds ``(fᵀ theta - y)² / s²`` to ``S(theta)`` of :class:`estimator.diagnosis.selection.linearised.Linearised`:
``G += f fᵀ / s²``, ``b += f y / s²``, ``S(0) += y² / s²``. A set without the fact's effects keeps its misfit.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.score_tests import Column
from estimator.diagnosis.selection.linearised import Linearised
from estimator.effects.link import EffectModel
from estimator.fitting.campaigns.campaign import Campaign
from estimator.fitting.campaigns.facts import Fact

Array = NDArray[np.float64]


def with_facts(of: Linearised, campaign: Campaign) -> Linearised:
    """A linearised campaign with the campaign's facts in its quadratic."""
    rows = list(_rows(campaign, of.columns, of.effects))
    if not rows:
        return of
    F, y = np.array([row for row, _ in rows]), np.array([value for _, value in rows])
    count, known = None if of.count is None else of.count + len(rows), F.T @ F
    misfit = of.misfit + float(y @ y)
    return replace(of, information=of.information + known, pull=of.pull + F.T @ y, misfit=misfit, count=count, stated=known)


def _rows(campaign: Campaign, columns: Sequence[Column], effects: Sequence[EffectModel]) -> Iterator[tuple[Array, float]]:
    """Row (c,) and right-hand side of every fact, over its standard deviation, for each particle or camera that it holds of."""
    for fact in campaign.facts:
        seen: set[tuple[float, ...]] = set()
        for sequence in range(len(campaign.sequences)):
            row = _row(fact, sequence, campaign, (columns, effects))
            if row.any() and tuple(row.tolist()) not in seen:
                seen.add(tuple(row.tolist()))
                yield row, fact.value / fact.sigma


def _row(fact: Fact, sequence: int, campaign: Campaign, of: tuple[Sequence[Column], Sequence[EffectModel]]) -> Array:
    columns, effects = of
    weights = dict(fact.weights)
    row = np.zeros(len(columns))
    for i, column in enumerate(columns):
        entry = effects[column.effect].entry
        owner = campaign.sharing(entry.scope)[sequence]
        if entry.key in weights and column.sequence in (None, owner):
            row[i] = weights[entry.key][column.parameter] / fact.sigma
    return row
