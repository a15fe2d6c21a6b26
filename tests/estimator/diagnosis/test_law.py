"""Sparse regression of laws on made-up scores: the right terms, exponents and values, and nothing where there is nothing."""

from typing import cast

import numpy as np
import pytest
from numpy.typing import NDArray

from estimator.diagnosis.law import MARGIN, Law, find_law
from estimator.diagnosis.pooled_scores import LINKS, PooledScores
from estimator.effects.empirical.force_curves import DEGREES
from estimator.effects.empirical.law_terms import TERMS, Link
from estimator.effects.link import Moment
from estimator.motion.rigid_body import rotation_matrices

Array = NDArray[np.float64]
BY_KEY = {term.key: term for term in TERMS}
SEQUENCES, NODES, DURATION_S = 4, 24, 0.02
NODE, WEIGHT = np.polynomial.legendre.leggauss(NODES)
PROJECTOR = (2.0 * np.array(DEGREES) + 1.0)[:, None] / 2.0 * np.polynomial.legendre.legvander(NODE, DEGREES[-1]).T * WEIGHT
SIZE = SEQUENCES * len(DEGREES) * 3


def moments() -> Moment:
    """Straight flights with steady spins, at all nodes of all sequences."""
    rng = np.random.default_rng(3)
    time = 0.5 * DURATION_S * (NODE + 1.0)
    parts = []
    for _ in range(SEQUENCES):
        v, omega = rng.uniform(-3.0, 3.0, 3), rng.uniform(-150.0, 150.0, 3)
        x = np.array([0.0, 0.0, 0.6]) + rng.uniform(-0.02, 0.02, 3) + (time - 0.5 * DURATION_S)[:, None] * v
        half = 0.5 * time[:, None] * omega
        angle = np.linalg.norm(half, axis=1, keepdims=True)
        q = np.hstack([np.sin(angle) * half / np.maximum(angle, 1e-12), np.cos(angle)])
        parts.append(
            (time[:, None], x, np.tile(v, (NODES, 1)), np.tile(omega, (NODES, 1)), np.tile(omega, (NODES, 1)), rotation_matrices(q))
        )
    time_s, *others = (np.concatenate(each) for each in zip(*parts, strict=True))
    return Moment(cast(float, time_s), *others)


def pooled(*truth: tuple[str, list[float]], noise: float = 1.0, force_ms2: float = 0.02) -> PooledScores:
    """Every coefficient measured alone, forces within ``force_ms2`` and torques a thousand times worse, under a true law."""
    design: dict[Link, Array] = {link: np.zeros((2 * SIZE, SEQUENCES, len(DEGREES), 3)) for link in LINKS}
    for number, (link, sigma) in enumerate(zip(LINKS, (force_ms2, 1e3 * force_ms2), strict=True)):
        rows = number * SIZE + np.arange(SIZE)
        design[link].reshape(2 * SIZE, SIZE)[rows, np.arange(SIZE)] = 1.0 / sigma
    made = PooledScores(np.zeros(2 * SIZE), design, moments(), PROJECTOR, SEQUENCES)
    y = noise * np.random.default_rng(7).standard_normal(2 * SIZE)
    for key, theta in truth:
        term, values = BY_KEY[key], np.array(theta)
        y += made.columns(term, values[None, term.amplitudes :])[0] @ values[: term.amplitudes]
    return PooledScores(y, design, made.moments, PROJECTOR, SEQUENCES)


def law_of(*truth: tuple[str, list[float]], force_ms2: float = 0.02) -> Law:
    found = find_law(pooled(*truth, force_ms2=force_ms2))
    assert found is not None
    return found


def test_noise_alone_has_no_law() -> None:
    assert find_law(pooled()) is None


def test_a_thrust_that_is_fixed_to_the_body() -> None:
    law = law_of(("body_fixed", [1.0, -2.0, 0.5]), ("torque_body_fixed", [300.0, 0.0, -200.0]))
    assert set(law.best.keys) == {"body_fixed", "torque_body_fixed"}
    places = {t.term.key: 3 * i for i, t in enumerate(law.best.terms)}
    thrust = law.best.amplitudes[places["body_fixed"] :][:3]
    np.testing.assert_allclose(thrust, [1.0, -2.0, 0.5], atol=0.02)
    assert law.explained > 0.98
    assert law.exponents == ()


@pytest.mark.parametrize("power", [1.0, 2.0])
def test_the_exponent_of_a_drag(power: float) -> None:
    law = law_of(("against_velocity", [0.8, power]))
    assert law.best.keys == ("against_velocity",)
    (exponent,) = law.exponents
    assert exponent.taken == power
    assert exponent.interval[0] < power < exponent.interval[1]
    assert exponent.interval[1] - exponent.interval[0] < 0.5
    assert law.best.amplitudes[0] == pytest.approx(0.8, rel=0.05)


def test_an_exponent_that_is_no_usual_one_is_kept() -> None:
    (exponent,) = law_of(("against_velocity", [0.8, 1.5])).exponents
    assert exponent.taken == exponent.best == pytest.approx(1.5, abs=0.15)


def test_a_wall() -> None:
    law = law_of(("towards_plane", [2.0, 0.3, 0.2, 0.07, 2.0]), force_ms2=0.005)
    assert law.best.keys == ("towards_plane",)
    azimuth, elevation, position, _ = law.best.terms[0].shape
    n = np.array([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)])
    true = np.array([np.cos(0.2) * np.cos(0.3), np.cos(0.2) * np.sin(0.3), np.sin(0.2)])
    assert np.degrees(np.arccos(n @ true)) < 3.0
    assert position == pytest.approx(0.07, abs=0.03)
    (exponent,) = law.exponents
    assert exponent.interval[0] < 2.0 < exponent.interval[1]
    assert exponent.taken == 2.0


def test_a_point() -> None:
    law = law_of(("towards_point", [2.0, 0.03, 0.02, 0.66, 2.0]), force_ms2=0.005)
    assert law.best.keys == ("towards_point",)
    np.testing.assert_allclose(law.best.terms[0].shape[:3], [0.03, 0.02, 0.66], atol=0.01)


def test_what_the_catalogue_has_is_an_alternative_at_most() -> None:
    law = law_of(("constant", [0.5, 0.0, 0.0]))
    assert law.best.keys != ("constant",)
    assert ("constant",) in [each.keys for each in law.alternatives]
    assert all(each.criterion <= law.best.criterion + MARGIN for each in law.alternatives)
