"""The block arrow against the whole system solved at once, and what it costs."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from estimator.effects.model import Model
from estimator.effects.registry import MODELS
from estimator.fitting.campaigns import campaign as module
from estimator.fitting.campaigns.campaign import Campaign, Layout, Prior, layout_of, solve_arrow
from estimator.motion.flight import N_PARAMETERS

MODEL = Model((MODELS["uniform_acceleration"], MODELS["quadratic_drag"], MODELS["principal_point"], MODELS["frame_rate"]))
SIZE = N_PARAMETERS + MODEL.size


def layout(particle: tuple[int, ...], camera: tuple[int, ...]) -> Layout:
    nothing: Any = None
    return layout_of(Campaign((nothing,) * len(particle), particle, camera, 0.0, 0.0, nothing), MODEL)


def equations(count: int) -> list[Any]:
    """Normal equations of sequences, each of full rank."""
    rng = np.random.default_rng(3)
    J = rng.normal(size=(count, 3 * SIZE, SIZE))
    return [SimpleNamespace(frames=SimpleNamespace(H=j.T @ j, g=j.T @ rng.normal(size=len(j)))) for j in J]


def dense(seen: list[Any], at: Layout, precision: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Steps of all local parameters (sequence, l) and of the shared ones, from one normal matrix of everything."""
    width, n = len(at.local), len(seen)
    H, g = np.zeros((n * width + at.size,) * 2), np.zeros(n * width + at.size)
    for i, (each, place) in enumerate(zip(seen, at.place, strict=True)):
        to = np.zeros(SIZE, dtype=np.int64)
        to[at.local], to[at.shared] = i * width + np.arange(width), n * width + place
        H[np.ix_(to, to)] += each.frames.H
        g[to] += each.frames.g
    shared = slice(n * width, None)
    H[shared, shared] += np.diag(precision)
    g[shared] += precision * values
    step = -np.linalg.solve(H, g)
    return step[: n * width].reshape(n, width), step[shared]


@pytest.mark.parametrize(
    ("particle", "camera", "shared"),
    [((0, 0, 0), (0, 0, 0), 9 + 1 + 2 + 1), ((0, 0, 1), (0, 1, 1), 2 * (9 + 1 + 2) + 1), ((0, 1, 2), (0, 0, 0), 3 * 9 + 1 + 2 + 1)],
)
def test_eliminating_sequences_gives_the_step_of_the_whole(particle: tuple[int, ...], camera: tuple[int, ...], shared: int) -> None:
    """Eight numbers of a particle and its drag, an offset and two of a camera, one clock; the rest is each sequence's own."""
    at, seen = layout(particle, camera), equations(3)
    assert at.size == shared
    rng = np.random.default_rng(4)
    precision, values = rng.uniform(0.5, 2.0, at.size), rng.normal(size=at.size)
    found = solve_arrow(seen, at, Prior.diagonal(precision, values))
    local, common = dense(seen, at, precision, values)
    assert np.allclose(np.stack(found.local), local, rtol=1e-8, atol=1e-10)
    assert np.allclose(found.shared, common, rtol=1e-8, atol=1e-10)


def test_the_cost_is_linear_in_the_number_of_sequences(monkeypatch: pytest.MonkeyPatch) -> None:
    """No matrix is inverted that grows with it: one of each sequence's own size, and one of what all share."""
    sizes: list[int] = []
    inverse = module.stable_inverse

    def counted(matrix: np.ndarray, *rest: Any) -> np.ndarray:
        sizes.extend([matrix.shape[-1]] * int(np.prod(matrix.shape[:-2])))
        return inverse(matrix, *rest)

    monkeypatch.setattr(module, "stable_inverse", counted)
    for count in (2, 8):
        sizes.clear()
        at = layout((0,) * count, (0,) * count)
        solve_arrow(equations(count), at, Prior.diagonal(np.ones(at.size), np.zeros(at.size)))
        assert sorted(sizes) == sorted([len(at.local)] * count + [at.size])
