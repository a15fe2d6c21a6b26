"""Public array arguments and fields of the estimator have a shape that a reader is told."""

import ast

import pytest

from scripts import array_shapes

MOST_UNTOLD = 4
"""May only shrink."""


def test_no_more_arrays_are_without_a_shape() -> None:
    untold = [f"{a.path.name}:{a.line} {a.owner}: {a.name}" for a in array_shapes.untold()]
    assert len(untold) <= MOST_UNTOLD, f"write ``name`` (n, 3) and the unit into the docstring, or annotate with jaxtyping: {untold}"


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("Points ``x`` (n, 3) m.", True),
        ("``x``, ``y`` (n,) px.", True),
        ("``x`` and ``y`` (f, m, 3).", True),
        ("``x``: the rest (21 + q - l,).", True),
        ("``x`` (..., 2), normals.", True),
        ("x (6 s, 6 s) of steps.", True),
        ("Points (n, 3) m.", False),
        ("``x`` of ``y`` (n, 3).", False),
        ("``x``, in metres (SI units hold).", False),
        ("``x_m`` (n, 3).", False),
    ],
)
def test_what_counts_as_told(text: str, *, told: bool) -> None:
    assert array_shapes.tells(text, "x") is told


@pytest.mark.parametrize(
    ("annotation", "array"),
    [
        ("Array", True),
        ("NDArray[np.int64]", True),
        ("Array | None", True),
        ("tuple[Model, Array]", True),
        ("Sequence[Array]", True),
        ("Float[NDArray[np.float64], 'n 3']", False),
        ("Callable[[Array], Array]", False),
        ("Intrinsics", False),
    ],
)
def test_what_counts_as_an_array(annotation: str, *, array: bool) -> None:
    path = array_shapes.ESTIMATOR / "geometry" / "tangent_hull.py"
    assert array_shapes.is_array(path, ast.parse(annotation, mode="eval").body) is array
