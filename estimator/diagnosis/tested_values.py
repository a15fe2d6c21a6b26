"""The values that a test lets expect, one by one."""

from dataclasses import dataclass

from datasets.vocabulary.effects import Parameter
from estimator.diagnosis.score_tests import ScoreTest
from estimator.effects.parameter_values import WithInterval

LEAST_P = 1e-16


@dataclass(frozen=True)
class TestedValue(WithInterval):
    """One parameter of an effect on trial; ``sequence``: number of the sequence it belongs to, ``None`` where sequences share it."""

    __test__ = False
    parameter: Parameter
    sequence: int | None
    value: float
    sigma: float


def p_words(p: float, name: str = "p ") -> str:
    """A p-value for people; what is below all that an approximation can know is not told apart."""
    return f"{name}= {p:.1e}" if p > LEAST_P else f"{name}< {LEAST_P:.0e}"


def tested_values(test: ScoreTest) -> tuple[TestedValue, ...]:
    """All values of a test; an effect that is random has no columns, and its one value is a standard deviation."""
    parameters = test.effect.entry.parameters
    places = [(c.parameter, c.sequence) for c in test.columns] or [(0, None)]
    values = []
    for row, (number, sequence) in enumerate(places[: len(test.theta)]):
        sigma = float(max(test.covariance[row, row], 0.0)) ** 0.5
        values.append(TestedValue(parameters[number], sequence, float(test.theta[row]), sigma))
    return tuple(values)
