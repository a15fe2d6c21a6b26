"""Triangle meshes as binary PLY, float64 vertices in metres."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from datasets.atomic_files import written_whole


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
