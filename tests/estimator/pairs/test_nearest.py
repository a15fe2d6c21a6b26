"""Nearest places of two convex bodies, beside what nature's own search of features finds, which shares no code with it."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from datasets.vocabulary.body import Body
from estimator.motion.flight import Flight
from estimator.motion.piecewise import Bounce, PiecewiseFlight
from estimator.pairs.nearest import nearest
from estimator.pairs.pair_fit import PairFlight
from estimator.pairs.touching import Hulls, gap_and_derivative, touching

BOX = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])


def test_a_corner_before_a_face() -> None:
    corner = BOX @ Rotation.align_vectors([[-1.0, 0.0, 0.0]], [[1.0, 1.0, 1.0]])[0].as_matrix().T
    for gap in (0.02, -0.02):
        found = nearest(corner + np.array([1.0 + 3**0.5 + gap, 0.2, -0.1]), BOX)
        assert found.gap_m == pytest.approx(gap, abs=1e-8)
        assert found.normal == pytest.approx([1.0, 0.0, 0.0], abs=1e-8)
        assert found.point == pytest.approx([1.0 + gap / 2, 0.2, -0.1], abs=1e-8)


def test_edge_before_edge_and_face_before_face() -> None:
    a, b = (BOX @ Rotation.from_euler(axis, 45, degrees=True).as_matrix().T for axis in "zy")
    found = nearest(a + np.array([2 * 2**0.5 + 0.01, 0.0, 0.0]), b)
    assert found.gap_m == pytest.approx(0.01, abs=1e-8)
    assert found.normal == pytest.approx([1.0, 0.0, 0.0], abs=1e-8)
    flat = nearest(BOX + np.array([2.01, 0.3, 0.0]), BOX)
    assert flat.gap_m == pytest.approx(0.01, abs=1e-8)
    assert flat.normal == pytest.approx([1.0, 0.0, 0.0], abs=1e-6)
    assert -0.7 - 1e-6 <= flat.point[1] <= 1.0 + 1e-6


def _flight(x: list[float], rng: np.random.Generator) -> PiecewiseFlight:
    body = Body(np.zeros(3), np.eye(3), np.array([0.6, 0.8, 1.0]))
    first = Flight(
        time_s=0.0,
        x=np.array(x),
        q=Rotation.random(rng=rng).as_quat(),
        v=0.3 * rng.normal(size=3),
        omega=50 * rng.normal(size=3),
        body=body,
        com=np.zeros(3),
        inertia=np.zeros(5),
        offset_px=0.0,
        gravity_world=np.array([0.0, 9.8, 0.0]),
    )
    return PiecewiseFlight(first, (Bounce(4e-3, rng.normal(size=3), 50 * rng.normal(size=3)),))


def test_the_gaps_derivative_where_hulls_touch() -> None:
    rng = np.random.default_rng(3)
    pair = PairFlight(_flight([0.0, 0.0, 0.6], rng), _flight([0.0058, 0.001, 0.6005], rng))
    hulls = Hulls((1e-3 * rng.normal(size=(40, 3)), 1e-3 * rng.normal(size=(40, 3))), np.array([3e-5, 4e-5]))
    for _ in range(20):
        gap, J = gap_and_derivative(pair, hulls)
        closing = np.zeros(pair.layout.size)
        x = pair.layout["second_x"]
        closing[x] = -gap * J[x] / (J[x] @ J[x])
        pair = pair.moved(closing)
    gap, J = gap_and_derivative(pair, hulls)
    assert abs(gap) < 1e-9
    widths = pair.layout.steps
    numeric = np.zeros(pair.layout.size)
    for k in np.flatnonzero(widths):
        step = np.zeros(pair.layout.size)
        step[k] = widths[k]
        forth, back = (gap_and_derivative(pair.moved(sign * step), hulls)[0] for sign in (1.0, -1.0))
        numeric[k] = (forth - back) / (2 * widths[k])
    scale = np.abs(numeric * widths).max()
    assert np.abs((J - numeric) * widths).max() < 2e-4 * scale
    known = touching(pair, hulls)
    assert known.H == pytest.approx(np.outer(J, J) / 25e-10, rel=1e-9)
