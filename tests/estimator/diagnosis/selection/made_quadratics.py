"""Linearised campaigns made by hand: y = X theta + noise of variance one; columns belong to effects of chosen plausible limits."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.effects import EffectEntry, Parameter, Scope, Stage
from estimator.diagnosis.score_tests import Candidates, Column, EfficientScores
from estimator.diagnosis.selection.evidence import Evidence
from estimator.diagnosis.selection.linearised import Linearised
from estimator.effects.link import EffectModel
from estimator.likelihood.rows import NOISE_FREEDOM, AtFit, Density
from estimator.likelihood.time_shifts import JitterTest

Array = NDArray[np.float64]
BOTH = (-1.0, 1.0)
SURE = 1e-9
"""Misfit of a noise that is known: of so many degrees of freedom that what is left of squares hardly changes it."""


@dataclass(frozen=True)
class Made:
    """An effect: its columns (n, q), of one sequence each where ``sequences`` says which, and the plausible ranges of its parameters.

    ``whole``: whether they come in whole numbers.
    """

    columns: Array
    plausible: tuple[tuple[float, float], ...] = (BOTH,)
    sequences: tuple[int, ...] | None = None
    whole: bool = False


def effect(number: int, made: Made) -> EffectModel:
    """The effect of a catalogue that does not exist."""
    parameters = tuple(Parameter(f"p{i}", "1", limits, 1e-3, "") for i, limits in enumerate(made.plausible))
    scope = Scope.CAMPAIGN if made.sequences is None else Scope.SEQUENCE
    entry = EffectEntry(f"e{number}", Stage.DYNAMICS, scope, parameters, "", "")
    return type(f"Made{number}", (EffectModel,), {"entry": entry, "whole": entry.names if made.whole else ()})()


def columns_of(number: int, made: Made) -> list[Column]:
    """Where each column belongs."""
    q = len(made.plausible)
    owners: Sequence[int | None] = [None] * made.columns.shape[1] if made.sequences is None else made.sequences
    return [Column(number, 0, i % q, owner) for i, owner in enumerate(owners)]


def normal(squares: float) -> AtFit:
    """Minus half of what is left of ``squares``: the density where the noise is known."""
    freedom = NOISE_FREEDOM * (squares / SURE - 1.0)
    return AtFit(Density(np.array([SURE]), np.array([freedom]), 0.0), squares, 0.0, 0.0)


def linearised_of(made: Sequence[Made], y: Array, *, noise_known: bool = True, tried: Mapping[int, int] | None = None) -> Linearised:
    """The quadratic of measurements ``y`` (n,); where the noise is not known, its variance is a part of the answer."""
    X = np.concatenate([each.columns for each in made], axis=1)
    columns = tuple(c for number, each in enumerate(made) for c in columns_of(number, each))
    H = X.T @ X
    starts = tuple(np.zeros(((tried or {}).get(n, 1), len(each.plausible))) for n, each in enumerate(made))
    effects = tuple(effect(n, each) for n, each in enumerate(made))
    return Linearised(
        effects=effects,
        own=0,
        scores=EfficientScores(columns, -X.T @ y, H, H),
        information=H,
        pull=X.T @ y,
        misfit=float(y @ y),
        count=None if noise_known else float(len(y)),
        residuals=normal(float(y @ y)),
        candidates=Candidates(effects, starts),
        starts={},
        jitter=JitterTest(0.0, 0.0, 1.0, 0.0),
    )


def evidence_of(made: Sequence[Made], y: Array, *, noise_known: bool = True, tried: Mapping[int, int] | None = None) -> Evidence:
    """Its evidence."""
    return Evidence(linearised_of(made, y, noise_known=noise_known, tried=tried))


def own_columns(sequences: int, rows: int) -> Array:
    """One column (n, s) for each sequence: one in its ``rows`` rows, zero elsewhere."""
    return np.kron(np.eye(sequences), np.ones((rows, 1)))
