"""Public array arguments and fields of the estimator have a shape that a reader is told, those of vectors a unit and a frame."""

import ast

import pytest

from scripts.pages import array_shapes

MOST_UNTOLD = {"shape": 1, "unit": 0, "frame": 0}
"""May only shrink."""


@pytest.mark.parametrize("what", MOST_UNTOLD)
def test_no_more_arrays_are_without(what: str) -> None:
    untold = [f"{a.path.name}:{a.line} {a.owner}: {a.name}" for a in array_shapes.untold(what)]
    assert len(untold) <= MOST_UNTOLD[what], f"write ``name`` (n, 3) m, world frame, into the docstring, or use jaxtyping: {untold}"


@pytest.mark.parametrize(
    ("name", "text", "lacks"),
    [
        ("x", "``x`` (n, 3) m, world frame.", ""),
        ("x_world", "``x_world`` (n, 3) m.", ""),
        ("x_m", "``x_m`` (3,), body axes.", ""),
        ("R_cam_body", "``R_cam_body`` (3, 3).", ""),
        ("x", "``x`` (n, 3), any unit and frame.", ""),
        ("x", "``x`` (n, 2).", ""),
        ("x", "``x`` (n, 3), world frame.", "unit"),
        ("x", "``x`` (n, 3) m.", "frame"),
        ("x", "``x`` in the world frame.", "shape"),
    ],
)
def test_what_a_vector_lacks(name: str, text: str, lacks: str) -> None:
    assert array_shapes.Argument(array_shapes.ESTIMATOR, 1, "f", name, text, whole=False).lacks == lacks


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
