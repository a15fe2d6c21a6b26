"""The marginal likelihood is the integral that it claims to be, and tails and scatters cost what they should."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import quad, trapezoid
from scipy.special import logsumexp
from scipy.stats import multivariate_normal, multivariate_t, norm
from scipy.stats import t as student

from estimator.diagnosis.selection.evidence import BEYOND, SHARES, Evidence
from estimator.effects.link import TAILS
from estimator.likelihood.rows import NOISE_FREEDOM
from tests.estimator.diagnosis.selection.made_quadratics import BOTH, Made, evidence_of, own_columns

pytestmark = pytest.mark.long

Array = NDArray[np.float64]
ROWS = 30
IMPOSSIBLE = -15.0
"""Nats by which values are refused that nature does not have."""


def noise(seed: int, rows: int = ROWS) -> Array:
    return np.random.default_rng(seed).normal(size=rows)


def column(seed: int) -> Array:
    return np.random.default_rng([seed, 1]).normal(size=(ROWS, 1))


def at_scale(evidence: Evidence, *scales: float) -> float:
    """Log evidence of all effects at given scales of their priors."""
    return evidence._at(range(len(scales)), scales).value


def by_quadrature(x: Array, y: Array, scale: float, limits: tuple[float, float]) -> float:
    """Log integral over one amplitude under its prior, of which one side alone is there where the limits say so."""
    sided = 2.0 if 0.0 in limits else 1.0
    low, high = (BEYOND * each for each in limits)
    precision = float(x[:, 0] @ x[:, 0]) + scale**-2.0
    best = float(np.clip(x[:, 0] @ y / precision, low, high))

    def log_density(theta: float) -> float:
        return float(norm.logpdf(theta, 0.0, scale) - 0.5 * np.sum((y - x[:, 0] * theta) ** 2))

    top, width = log_density(best), 12.0 * precision**-0.5
    low, high = max(low, best - width), min(high, best + width)
    whole = quad(lambda theta: np.exp(log_density(theta) - top), low, high, points=[best], epsabs=0.0, epsrel=1e-10)[0]
    return float(top + np.log(sided * whole))


@pytest.mark.parametrize("scale", [SHARES[0], SHARES[3], SHARES[-1]])
@pytest.mark.parametrize("value", [0.0, 0.3, 0.9])
def test_one_amplitude_is_integrated(scale: float, value: float) -> None:
    x, y = column(1), column(1)[:, 0] * value + noise(2)
    assert at_scale(evidence_of([Made(x)], y), scale) == pytest.approx(by_quadrature(x, y, scale, BOTH), abs=1e-6)


@pytest.mark.parametrize("limits", [(0.0, 1.0), (-1.0, 0.0)])
@pytest.mark.parametrize("value", [-0.6, 0.0, 0.6])
def test_amplitudes_of_one_sign_have_half_of_the_prior(limits: tuple[float, float], value: float) -> None:
    x, y = column(3), column(3)[:, 0] * value + noise(4)
    evidence = evidence_of([Made(x, (limits,))], y)
    assert at_scale(evidence, SHARES[4]) == pytest.approx(by_quadrature(x, y, SHARES[4], limits), abs=1e-6)


def test_a_sign_that_nature_does_not_have_is_refused_and_the_right_one_gains() -> None:
    x = column(3)
    y = 2.0 * x[:, 0] + noise(4)
    wrong, either, right = (evidence_of([Made(x, ((low, high),))], y) for low, high in ((-3.0, 0.0), (-3.0, 3.0), (0.0, 3.0)))
    assert right.log_evidence((0,)) == pytest.approx(either.log_evidence((0,)) + np.log(2.0), abs=1e-6)
    assert wrong.log_evidence((0,)) < wrong.log_evidence(()) < right.log_evidence((0,)) - 20.0


def test_two_amplitudes_are_integrated_together() -> None:
    """Correlated columns of different scales; the posterior lies inside of what is plausible."""
    a = column(5)
    X = np.concatenate([a, 0.8 * a + 0.6 * column(6)], axis=1)
    y, scales = X @ [0.4, -0.3] + noise(7), np.array([SHARES[5], SHARES[4]])
    best = np.linalg.lstsq(X, y, rcond=None)[0]
    top = -0.5 * float(np.sum((y - X @ best) ** 2))
    reach = np.linspace(-8.0, 8.0, 241)
    u, v = (b + reach * s for b, s in zip(best, np.sqrt(np.diag(np.linalg.inv(X.T @ X))), strict=True))
    theta = np.stack(np.meshgrid(u, v, indexing="ij"), axis=-1)
    log_density = norm.logpdf(theta, 0.0, scales).sum(axis=-1) - 0.5 * np.sum((y - theta @ X.T) ** 2, axis=-1) - top
    whole = float(trapezoid(trapezoid(np.exp(log_density), v), u))
    evidence = evidence_of([Made(X[:, :1]), Made(X[:, 1:])], y)
    assert at_scale(evidence, *scales) == pytest.approx(top + np.log(whole), abs=1e-6)


@pytest.mark.parametrize("noise_known", [True, False])
def test_three_amplitudes_are_a_density_of_the_measurements(noise_known: bool) -> None:
    """Normal where the noise is known; Student's where its variance is integrated."""
    X = np.random.default_rng(8).normal(size=(ROWS, 3))
    y = X @ [0.5, -0.2, 0.1] + 1.4 * noise(9)
    evidence = evidence_of([Made(X[:, :2], (BOTH, BOTH)), Made(X[:, 2:])], y, noise_known=noise_known)
    scales = (SHARES[-1], SHARES[5])
    C = np.eye(ROWS) + X @ np.diag(np.array([scales[0], scales[0], scales[1]]) ** 2) @ X.T
    if noise_known:
        laws = [multivariate_normal(np.zeros(ROWS), each) for each in (C, np.eye(ROWS))]
    else:
        laws = [multivariate_t(np.zeros(ROWS), each, df=NOISE_FREEDOM) for each in (C, np.eye(ROWS))]
    exact = float(laws[0].logpdf(y) - laws[1].logpdf(y))
    assert at_scale(evidence, *scales) - evidence.log_evidence(()) == pytest.approx(exact, abs=2e-3)


def test_values_beyond_twice_what_is_plausible_are_impossible() -> None:
    x = column(10)
    limit = 0.01
    y = 10.0 * limit * 50.0 * x[:, 0] + noise(11)
    evidence = evidence_of([Made(x, ((-limit, limit),))], y)
    free = evidence_of([Made(x, ((-np.inf, np.inf),))], y)
    assert evidence.log_evidence((0,)) - evidence.log_evidence(()) < 5.0
    assert free.log_evidence((0,)) - free.log_evidence(()) > 50.0


@pytest.mark.parametrize("seed", range(4))
def test_numbers_that_the_data_hardly_see_cost_a_family_nothing(seed: int) -> None:
    """What nobody says a range of has one size in its unit, of what is seen best: each number by itself would be a bet of its own."""
    x, hardly = column(13), 1e-4 * np.random.default_rng(seed).normal(size=(ROWS, 9))
    free, y = (-np.inf, np.inf), 0.8 * x[:, 0] + noise(14)
    alone, more = evidence_of([Made(x, (free,))], y), evidence_of([Made(np.hstack([x, hardly]), (free,) * 10)], y)
    assert more.log_evidence((0,)) == pytest.approx(alone.log_evidence((0,)), abs=0.01)


def test_sure_values_beyond_twice_what_is_plausible_are_refused_for_themselves() -> None:
    """Known to a thousandth of the range, a tenth beyond twice of it: refused by more than the prior's density says."""
    x, scale = np.full((ROWS, 1), 200.0), SHARES[-1]
    inside, outside = (at_scale(evidence_of([Made(x)], x[:, 0] * value + noise(12)), scale) for value in (1.8, 2.2))
    by_prior = norm.logpdf(2.2, 0.0, scale) - norm.logpdf(1.8, 0.0, scale)
    assert outside - inside < by_prior + IMPOSSIBLE


def by_all_scales(evidence: Evidence) -> float:
    return float(logsumexp([at_scale(evidence, scale) for scale in SHARES])) - float(np.log(len(SHARES)))


@pytest.mark.parametrize("value", [0.8, 0.95])
def test_of_the_scales_of_what_is_there_the_best_and_its_neighbours_are_nearly_all(value: float) -> None:
    evidence = evidence_of([Made(column(13))], column(13)[:, 0] * value + noise(14))
    assert evidence.log_evidence((0,)) == pytest.approx(by_all_scales(evidence), abs=0.3)


def test_what_is_not_there_is_never_given_more_than_all_scales_together() -> None:
    """Where the data know nothing of an amplitude all scales are alike, of which the best two or three are summed."""
    evidence = evidence_of([Made(column(13))], noise(14))
    whole = by_all_scales(evidence)
    assert whole - np.log(len(SHARES) / 2.0) - 0.01 < evidence.log_evidence((0,)) <= whole


def test_starts_that_were_tried_cost_their_number() -> None:
    x, y = column(15), column(15)[:, 0] + noise(16)
    one, many = (evidence_of([Made(x)], y, tried={0: n}).log_evidence((0,)) for n in (1, 50))
    assert one - many == pytest.approx(np.log(50.0))


def test_what_comes_in_whole_numbers_is_not_there_by_a_tenth_or_by_less_than_none() -> None:
    """A tenth of a missing frame in every sequence fits rounded time stamps, and gains hundreds of nats."""
    x = 50.0 * own_columns(5, ROWS // 5)
    for size, there in ((0.1, False), (1.0, True), (-1.0, False)):
        made = Made(x, (BOTH,), tuple(range(5)), whole=True)
        evidence = evidence_of([made], size * x.sum(axis=1) + noise(19), tried={0: 20})
        assert len(evidence.rows(0)) == (5 if there else 0)
        assert (evidence.log_evidence((0,)) > evidence.log_evidence(())) == there


def test_the_posterior_is_that_of_ridge_regression_at_the_best_scale() -> None:
    x = column(17)
    y = 0.7 * x[:, 0] + noise(18)
    fitted = evidence_of([Made(x)], y).fitted((0,))
    (scale,) = fitted.scaled.scales
    precision = float(x[:, 0] @ x[:, 0]) + scale**-2.0
    assert fitted.mean[0] == pytest.approx(float(x[:, 0] @ y) / precision)
    assert fitted.sigma[0] == pytest.approx(precision**-0.5)
    assert fitted.log_likelihood == pytest.approx(-0.5 * float(np.sum((y - x[:, 0] * fitted.mean[0]) ** 2)), abs=0.05)


# Values of every sequence

SEQUENCES, EACH = 40, 5
SMALL, FAR = 0.05, 0.9


def campaign(values: Array, *, shared: float = 0.0) -> Evidence:
    """Forty sequences with values of their own (effect 1) beside a shared cause (effect 0), noise known."""
    own = own_columns(SEQUENCES, EACH)
    rng = np.random.default_rng(19)
    cause = np.kron(rng.uniform(0.5, 1.5, SEQUENCES), np.ones(EACH))[:, None]
    gain = 100.0
    y = gain * (own @ values + cause[:, 0] * shared) + rng.normal(size=len(cause))
    return evidence_of([Made(gain * cause), Made(gain * own, (BOTH,), tuple(range(SEQUENCES)))], y)


def scatter(size: float, *, outlying: int = 0) -> Array:
    values = size * np.random.default_rng(20).normal(size=SEQUENCES)
    values[:outlying] = FAR * np.array([1.0, -1.0, 1.0])[:outlying]
    return values


def as_normal(evidence: Evidence) -> float:
    """The most that normal values of every sequence, without tails, would be worth, whatever their scatter."""
    of, rows = evidence.of, evidence.of.rows(1)
    G, b = of.information[np.ix_(rows, rows)], of.pull[rows]
    found = []
    for scale in SHARES:
        K = np.eye(len(rows)) + scale**2 * G
        found.append(-0.5 * (of.misfit - scale**2 * b @ np.linalg.solve(K, b)) - 0.5 * np.linalg.slogdet(K)[1])
    return float(max(found))


def test_a_scatter_with_tails_prefers_a_few_outlying_sequences_to_a_wide_scatter() -> None:
    """Three of forty lie eighteen times as far as the others scatter: they do not widen what the others are given."""
    few, none = campaign(scatter(SMALL, outlying=3)), campaign(scatter(SMALL))
    scales = [e.scaled((1,)).scales[0] for e in (few, none)]
    assert scales[0] == scales[1] < 2.0 * SMALL
    assert few.log_evidence((1,)) > as_normal(few) + 10.0
    fitted = few.fitted((1,))
    np.testing.assert_allclose(fitted.mean[:3], [FAR, -FAR, FAR], atol=0.02)


def test_without_outliers_tails_cost_little() -> None:
    none = campaign(scatter(SMALL))
    assert none.log_evidence((1,)) > as_normal(none) - 6.0


def test_values_of_every_sequence_cost_by_their_scatter() -> None:
    """What is gained per sequence is that of noise over scatter, not that of noise over the whole range."""
    costs = []
    for size in (0.01, 0.1):
        evidence = campaign(scatter(size))
        best = float(np.sum(evidence.of.pull[evidence.of.rows(1)] ** 2 / np.diag(evidence.of.information)[evidence.of.rows(1)]))
        costs.append(0.5 * best - (evidence.log_evidence((1,)) - evidence.log_evidence(())))
    assert costs[1] - costs[0] == pytest.approx(SEQUENCES * np.log(10.0), rel=0.25)


@pytest.mark.parametrize("size", [0.01, 0.05])
def test_a_shared_cause_and_a_small_scatter_beat_free_values(size: float) -> None:
    """Free values fit as well; they pay for a scatter as wide as the shared cause made it."""
    evidence = campaign(scatter(size), shared=0.5)
    both, free, shared = (evidence.log_evidence(s) for s in ((0, 1), (1,), (0,)))
    assert both > free + 20.0
    assert both > shared + 20.0
    fitted = evidence.fitted((0, 1))
    assert fitted.mean[list(fitted.rows).index(0)] == pytest.approx(0.5, abs=0.02)
    assert evidence.scaled((0, 1)).scales[1] < evidence.scaled((1,)).scales[0]


def test_without_scatter_the_shared_cause_is_alone() -> None:
    evidence = campaign(np.zeros(SEQUENCES), shared=0.5)
    assert evidence.log_evidence((0,)) > evidence.log_evidence((0, 1))
    assert evidence.log_evidence((0,)) > evidence.log_evidence((1,)) + 100.0


def test_without_a_shared_cause_nothing_speaks_for_one() -> None:
    evidence = campaign(scatter(0.3))
    assert evidence.log_evidence((0, 1)) - evidence.log_evidence((1,)) < 3.0
    assert evidence.log_evidence((1,)) > evidence.log_evidence((0,)) + 100.0


def test_the_evidence_of_a_set_does_not_depend_on_what_was_asked_before() -> None:
    values = scatter(SMALL, outlying=3)
    fresh = {s: campaign(values, shared=0.2).log_evidence(s) for s in ((0, 1), (1,))}
    first, then = campaign(values, shared=0.2), campaign(values, shared=0.2)
    in_order, reversed_order = [first.log_evidence(s) for s in ((), (0,), (1,), (0, 1))], [then.log_evidence(s) for s in ((0, 1), (1,))]
    assert in_order[2] == pytest.approx(fresh[(1,)], abs=0.2)
    assert in_order[3] == pytest.approx(fresh[(0, 1)], abs=0.2)
    assert reversed_order[1] == pytest.approx(fresh[(1,)], abs=0.2)


def test_sequences_that_show_unlike_numbers_of_an_effects_parameters_are_weighed_all_the_same() -> None:
    """Of three sequences one shows one of an effect's two parameters alone."""
    X = np.zeros((18, 5))
    X[:12, :4] = np.kron(np.eye(2), np.random.default_rng(21).normal(size=(6, 2)))
    X[12:, 4] = 1.0
    y = X @ np.array([0.5, -0.4, 0.3, 0.2, 0.5]) * 30.0 + np.random.default_rng(22).normal(size=18)
    evidence = evidence_of([Made(30.0 * X, (BOTH, BOTH), (0, 0, 1, 1, 2))], y)
    assert evidence.log_evidence((0,)) > evidence.log_evidence(()) + 50.0
    np.testing.assert_allclose(evidence.fitted((0,)).mean, [0.5, -0.4, 0.3, 0.2, 0.5], atol=0.1)


def under_student(information: float, pull: float, width: float) -> float:
    """Log integral of one sequence's likelihood over its value under Student's prior."""
    middle, sigma = pull / information, information**-0.5
    low, high = max(-40.0 * width, middle - 12.0 * sigma), min(40.0 * width, middle + 12.0 * sigma)
    low, high = min(low, middle - 12.0 * sigma), max(high, middle + 12.0 * sigma)

    def density(v: float) -> float:
        return float(student.pdf(v / width, TAILS) / width * np.exp(-0.5 * information * (v - middle) ** 2))

    points = sorted({p for p in (0.0, middle, -5.0 * width, 5.0 * width) if low < p < high})
    return 0.5 * pull * middle + float(np.log(quad(density, low, high, points=points, limit=500, epsabs=0.0, epsrel=1e-6)[0]))


@pytest.mark.parametrize("outlying", [0, 3])
@pytest.mark.parametrize("gain", [1.0, 30.0, 1000.0])
def test_values_of_every_sequence_are_integrated_under_students_prior(gain: float, outlying: int) -> None:
    """From sequences that show nothing of them to ones that show every digit: within a fortieth of a nat for each of forty."""
    scale, rng = float(SHARES[4]), np.random.default_rng(23)
    values = scale * rng.normal(size=SEQUENCES)
    values[:outlying] = FAR
    X = gain * own_columns(SEQUENCES, EACH)
    evidence = evidence_of([Made(X, (BOTH,), tuple(range(SEQUENCES)))], X @ values + rng.normal(size=len(X)))
    of = evidence.of
    exact = sum(under_student(float(g), float(b), scale) for g, b in zip(np.diag(of.information), of.pull, strict=True))
    assert at_scale(evidence, scale) - evidence.log_evidence(()) == pytest.approx(exact, abs=SEQUENCES / 40.0)
