"""Good meshes come in, bad ones are named with what to type."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from datasets.errors import InputError
from synth.particles.mesh_import import metres_per_unit, read_mesh


def box() -> trimesh.Trimesh:
    return trimesh.creation.box((1.0, 2.0, 3.0)).subdivide()


def write(folder: Path, mesh: trimesh.Trimesh, name: str = "body.ply") -> Path:
    path = folder / name
    mesh.export(path)
    return path


@pytest.mark.parametrize("name", ["body.ply", "body.stl", "body.obj"])
def test_every_format_gives_the_body(tmp_path: Path, name: str) -> None:
    assert read_mesh(write(tmp_path, box(), name)).volume == pytest.approx(6.0, rel=1e-6)


def with_hole() -> trimesh.Trimesh:
    return trimesh.Trimesh(box().vertices, box().faces[1:], process=False)


def inside_out() -> trimesh.Trimesh:
    return trimesh.Trimesh(box().vertices, box().faces[:, ::-1], process=False)


def partly_turned() -> trimesh.Trimesh:
    faces = box().faces.copy()
    faces[3] = faces[3][::-1]
    return trimesh.Trimesh(box().vertices, faces, process=False)


def torn_apart() -> trimesh.Trimesh:
    return trimesh.Trimesh(box().vertices[box().faces].reshape(-1, 3), np.arange(3 * len(box().faces)).reshape(-1, 3), process=False)


def with_crumb() -> trimesh.Trimesh:
    crumb = trimesh.creation.box((0.1, 0.1, 0.1)).apply_translation([5, 0, 0])
    crumb.update_faces(np.arange(len(crumb.faces)) > 0)
    return trimesh.util.concatenate([box(), crumb])


def two_bodies() -> trimesh.Trimesh:
    return trimesh.util.concatenate([box(), trimesh.creation.box((0.5, 0.5, 0.5)).apply_translation([5, 0, 0])])


def test_a_hollow_body_is_one_body(tmp_path: Path) -> None:
    cavity = trimesh.creation.box((0.5, 0.5, 0.5))
    cavity.invert()
    assert read_mesh(write(tmp_path, trimesh.util.concatenate([box(), cavity]))).volume == pytest.approx(6.0 - 0.125)


@pytest.mark.parametrize(
    ("mesh", "problem"),
    [
        (with_hole(), "not watertight: 3 open edges"),
        (inside_out(), "point inward"),
        (partly_turned(), "not oriented consistently"),
        (torn_apart(), "not watertight: 144 open edges"),
        (with_crumb(), "not watertight: 3 open edges"),
        (two_bodies(), "it holds 2 separate bodies"),
    ],
)
def test_a_bad_surface_is_named_and_the_repair_mends_it(tmp_path: Path, mesh: trimesh.Trimesh, problem: str) -> None:
    path = write(tmp_path, mesh)
    with pytest.raises(InputError, match=problem) as caught:
        read_mesh(path)
    assert str(path) in str(caught.value)
    assert "particle.repair=true" in str(caught.value)
    mended = read_mesh(path, repair=True)
    assert mended.is_watertight
    assert mended.volume == pytest.approx(6.0, rel=1e-5)


def test_what_cannot_be_mended_is_refused(tmp_path: Path) -> None:
    sheet = trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], process=False)
    with pytest.raises(InputError, match="could not close it"):
        read_mesh(write(tmp_path, sheet), repair=True)


def test_missing_foreign_and_empty_files(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="found none"):
        read_mesh(tmp_path / "nowhere.ply")
    (tmp_path / "notes.txt").write_text("stone")
    with pytest.raises(InputError, match="PLY, STL or OBJ"):
        read_mesh(tmp_path / "notes.txt")
    for name in ("broken.ply", "broken.stl", "broken.obj"):
        (tmp_path / name).write_bytes(b"not a mesh at all")
        with pytest.raises(InputError, match=name):
            read_mesh(tmp_path / name)


def test_a_truncated_file_is_refused(tmp_path: Path) -> None:
    path = write(tmp_path, box())
    path.write_bytes(path.read_bytes()[:-200])
    with pytest.raises(InputError, match=r"body\.ply"):
        read_mesh(path)


def test_millimetres_taken_for_metres() -> None:
    with pytest.raises(InputError, match=r"5\.2 m across.*looks like millimetres taken for metres.*particle\.unit=mm"):
        metres_per_unit(Path("stone.ply"), 5.2, "m")


def test_metres_taken_for_millimetres() -> None:
    with pytest.raises(InputError, match="looks like metres taken for millimetres"):
        metres_per_unit(Path("stone.ply"), 0.0052, "mm")


def test_plausible_units_pass_and_an_unknown_one_is_asked_for() -> None:
    assert metres_per_unit(Path("stone.ply"), 5.2, "mm") == 1e-3
    with pytest.raises(InputError, match="expected m, mm, um or km"):
        metres_per_unit(Path("stone.ply"), 5.2, "any")
