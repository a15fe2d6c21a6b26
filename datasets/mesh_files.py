"""Triangle meshes as binary PLY, float64 vertices in metres."""

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from datasets.atomic_files import written_whole
from datasets.errors import InputError
from datasets.schema_errors import shown

LONGEST_HEADER = 65_536
"""Bytes of a PLY file in which its counts are looked for."""


def write_mesh(path: Path, vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> None:
    """Write a triangle mesh as binary PLY with float64 vertices (m)."""
    header = (
        "ply\nformat binary_little_endian 1.0\n"
        f"element vertex {len(vertices)}\nproperty double x\nproperty double y\nproperty double z\n"
        f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    rows = np.empty(len(faces), dtype=[("count", "u1"), ("corners", "<i4", (3,))])
    rows["count"], rows["corners"] = 3, faces
    with written_whole(path) as temporary:
        temporary.write_bytes(header.encode("ascii") + np.ascontiguousarray(vertices, dtype="<f8").tobytes() + rows.tobytes())


def read_mesh(path: Path) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Vertices (v, 3) m and faces (f, 3) of a PLY file, unchanged.

    Raises
    ------
    InputError
        When it is missing, cut off or not a mesh.
    """
    import trimesh  # noqa: PLC0415 - loads networkx: 0.15 s, of no use to who reads no mesh

    try:
        with path.open("rb") as stream:
            _check_counts(stream.read(LONGEST_HEADER), path)
            stream.seek(0)
            mesh = trimesh.load_mesh(stream, file_type="ply", process=False)
        vertices, faces = np.array(mesh.vertices, dtype=np.float64), np.array(mesh.faces, dtype=np.int64)
    except FileNotFoundError:
        raise InputError(f"{path}: there is no such file.") from None
    except InputError:
        raise
    except Exception as error:  # trimesh raises whatever its readers raise
        raise InputError(f"{path}: expected a PLY mesh, got a file that is cut off or of another kind ({error}).") from None
    if len(faces) == 0 or faces.min() < 0 or faces.max() >= len(vertices) or not np.all(np.isfinite(vertices)):
        raise InputError(f"{path}: expected a mesh with faces and finite vertices, got {len(vertices)} vertices and {len(faces)} faces.")
    return vertices, faces


def _check_counts(header: bytes, path: Path) -> None:
    """That a PLY file does not state more vertices or faces than it has bytes."""
    size = path.stat().st_size
    for count in re.findall(rb"element\s+\w+\s+(\d+)", header):
        if len(count) > len(str(size)) or int(count) > size:
            raise InputError(f"{path}: expected at most {size} vertices and faces in {size} bytes, got {shown(count.decode())}.")
