"""The block arrow against the whole system solved at once, and what it costs."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from estimator.effects.model import Model
from estimator.effects.registry import MODELS
from estimator.fitting import system as module
from estimator.fitting.campaigns.campaign import Campaign, layout_of
from estimator.fitting.levenberg_marquardt import NormalEquations
from estimator.fitting.system import Arrangement, System

MODEL = Model((MODELS["uniform_acceleration"], MODELS["quadratic_drag"], MODELS["principal_point"], MODELS["frame_rate"]))
SIZE = MODEL.layout.size


def layout(particle: tuple[int, ...], camera: tuple[int, ...]) -> Arrangement:
    nothing: Any = None
    return layout_of(Campaign((nothing,) * len(particle), particle, camera, 0.0, 0.0, nothing), MODEL)


def system(at: Arrangement) -> System[Any]:
    """Normal equations of sequences, each of full rank, and what is known of all that they share."""
    rng = np.random.default_rng(3)
    J = rng.normal(size=(len(at.places), 3 * SIZE, SIZE))
    told = tuple(SimpleNamespace(H=j.T @ j, g=j.T @ rng.normal(size=len(j))) for j in J)
    precision, values = rng.uniform(0.5, 2.0, at.size), rng.normal(size=at.size)
    return System(told, at, NormalEquations(np.diag(precision), precision * values, 0.0), 0.0)


@pytest.mark.parametrize(
    ("particle", "camera", "shared"),
    [((0, 0, 0), (0, 0, 0), 9 + 1 + 2 + 1), ((0, 0, 1), (0, 1, 1), 2 * (9 + 1 + 2) + 1), ((0, 1, 2), (0, 0, 0), 3 * 9 + 1 + 2 + 1)],
)
def test_eliminating_sequences_gives_the_step_of_the_whole(particle: tuple[int, ...], camera: tuple[int, ...], shared: int) -> None:
    """Eight numbers of a particle and its drag, an offset and two of a camera, one clock; the rest is each sequence's own."""
    at = layout(particle, camera)
    assert at.size == shared
    arrow = system(at)
    known = NormalEquations(np.pad(arrow.known.H, (at.first, 0)), np.pad(arrow.known.g, (at.first, 0)), 0.0)
    found, whole = arrow.solved(), System(arrow.told, Arrangement(at.places, at.p), known, 0.0).solved()
    np.testing.assert_allclose(found.step, -np.linalg.solve(arrow.H, arrow.g), rtol=1e-8, atol=1e-10)
    np.testing.assert_allclose(found.step, whole.step, rtol=1e-8, atol=1e-10)
    np.testing.assert_allclose(found.shared, whole.shared[at.first :, at.first :], rtol=1e-8, atol=1e-10)


def test_a_damped_step_is_that_with_more_of_what_parts_say_of_each_parameter() -> None:
    arrow = system(layout((0, 0, 1), (0, 0, 0)))
    more = tuple(SimpleNamespace(H=each.H + 0.3 * np.diag(np.diag(each.H)), g=each.g) for each in arrow.told)
    expected = replace(arrow, told=more).solved().step
    np.testing.assert_allclose(arrow.solved(0.3).step, expected, rtol=1e-8, atol=1e-10)


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
        system(at).solved()
        assert sorted(sizes) == sorted([len(at.local)] * count + [at.size])
