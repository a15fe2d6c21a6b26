"""Whether code that has changed since makes the rows of a result as they are: some cases, drawn at random, are made anew.

A change that moves no row of those drawn (a new effect, an error's type, a renamed module) leaves the result of today's code without hours
of measuring; where ``n`` cases are the same, fewer than ``3 / n`` of all are others, with a confidence of 95%.
"""

from dataclasses import fields, replace
from io import StringIO
from typing import Any

import numpy as np
import pandas as pd

from datasets.errors import InputError
from studies.frame.conduct import Conduct, bodies_word, conduct
from studies.frame.results import Again, Result, table_of
from studies.frame.study import Case, Settings, Study

SAME = 1e-4
"""Of a number, or of its column's median size where it is near zero: a tenth of the last digit of a page."""


def made_again(study: Study, result: Result, count: int, how: Conduct) -> tuple[Result, list[str]]:
    """The result with what ``count`` of its cases say, or as it is beside the names of cases that are others now.

    Raises
    ------
    InputError
        Where ``how.particles`` are no bodies of the kind that the result was made with.
    """
    settings, bodies = settings_of(study, result), bodies_word(how.particles)
    if bodies != result.settings["bodies"]:
        raise InputError(f"{study.name}: expected {result.settings['bodies']} bodies as in its result, got {bodies} ones (--particles).")
    every = study.plan.cases(settings, how.particles)
    drawn = np.random.default_rng().choice(len(every), min(count, len(every)), replace=False)
    chosen = [every[k] for k in sorted(drawn)]
    plan = replace(study.plan, cases=lambda settings, particles: chosen)
    now = conduct(replace(study, plan=plan), settings, how)
    rows = pd.read_csv(StringIO(table_of(now.rows)))
    different = [case.name for case in chosen if not _alike(_rows_of(case, rows), _rows_of(case, result.rows), result.rows)]
    if different:
        return result, different
    return replace(result, again=Again(len(chosen), len(every), now.code)), []


def settings_of(study: Study, result: Result) -> Settings:
    """The settings that a result was asked for with."""
    kind: type[Any] = type(study.plan.full)
    told = {each.name: result.settings[each.name] for each in fields(kind)}
    return kind(**{key: tuple(value) if isinstance(value, list) else value for key, value in told.items()})


def _rows_of(case: Case, rows: pd.DataFrame) -> pd.DataFrame:
    """Those with a case's labels, without the time that they took."""
    here = np.ones(len(rows), dtype=np.bool_)
    for key, value in case.labels.items():
        here &= rows[key].to_numpy() == value
    return rows.loc[here, ~rows.columns.str.endswith("cpu_s")]


def _alike(now: pd.DataFrame, before: pd.DataFrame, every: pd.DataFrame) -> bool:
    """Whether two tables hold the same; ``every``: all rows, by whose sizes small numbers are judged.

    A column of which no case that was drawn has anything is not in the table of these.
    """
    if len(now) != len(before) or set(now.columns) - set(before.columns):
        return False
    now = now.reindex(columns=before.columns)
    for name, column in before.items():
        if pd.api.types.is_float_dtype(every[name]):
            size = float(np.nanmedian(np.abs(every[name]))) if every[name].notna().any() else 0.0
            if not np.allclose(now[name].astype(float), column, rtol=SAME, atol=SAME * size, equal_nan=True):
                return False
        elif now[name].astype(str).tolist() != column.astype(str).tolist():
            return False
    return True
