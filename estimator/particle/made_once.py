"""What is made of a particle's views once and is the same for every recording of it.

Their silhouettes, the hull and its mass properties, starts, hollows, what the hull casts in the views and how that is biased there.

It is kept as arrays under the digest of what it was made from: outlines, views, the settings that matter and the code. Arrays are kept to
the last bit, so an estimate is the same whether they were there or were made on the way. What depends on a recording (the views in its
camera's likeness, the bias under its flight) is not kept.
"""

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cache
from importlib.metadata import version
from importlib.resources import files
from typing import Any

import numpy as np
from numpy.typing import NDArray

from datasets.errors import InputError
from datasets.observation import CalibratedView
from datasets.vocabulary.body import Body
from datasets.vocabulary.outline import Outline
from datasets.vocabulary.surface_mesh import SurfaceMesh
from estimator.data.configuration import Configuration
from estimator.geometry.outline_bias import DrawnBias
from estimator.geometry.silhouettes import Silhouettes
from estimator.poses.pose_starts import StartCatalogue

Array = NDArray[np.float64]
MAKERS = ("particle", "poses/pose_starts.py", "geometry", "motion/rotation.py", "motion/rigid_body.py", "outlines", "outlines/pictures")
VOCABULARY = "vocabulary"
"""The code whose text counts, of the estimator and of the datasets (cameras and outlines): what it makes may differ when it does."""
LIBRARIES = ("numpy", "scipy", "scikit-image", "opencv-python-headless", "manifold3d", "trimesh", "shapely")
"""Libraries whose version counts."""
SETTINGS = ("hull_resolution", "directions", "foreign_view_ratio")
"""The estimator's settings that the particle depends on."""


@dataclass(frozen=True)
class MadeOnce:
    """Each part or, where it was not made, nothing; see :class:`estimator.particle.particle.Particle`.

    ``convex_vertices`` (v, 3) m, particle frame, ``cast_in_views`` (v, 2) px each.
    """

    hull: SurfaceMesh | None = None
    catalogue: StartCatalogue | None = None
    hollow: float | None = None
    exact_hull: SurfaceMesh | None = None
    convex_vertices: Array | None = None
    cast_in_views: tuple[Array, ...] = ()
    silhouettes: Silhouettes | None = None
    body: Body | None = None
    largest_moment_per_mass: float | None = None
    view_bias: DrawnBias | None = None


NOTHING_MADE = MadeOnce()


def digest_of(outlines: Sequence[Outline], views: Sequence[CalibratedView], configuration: Configuration) -> str:
    """SHA-256 of outlines, views, settings and code."""
    total = hashlib.sha256(_of_code().encode())
    stated = {
        "settings": {name: getattr(configuration, name) for name in SETTINGS},
        "views": [[asdict(v.intrinsics), np.asarray(v.R_cam_particle).tolist(), np.asarray(v.t_cam_particle).tolist()] for v in views],
        "points": [len(outline.points_px) for outline in outlines],
    }
    total.update(json.dumps(stated, sort_keys=True).encode())
    for outline in outlines:
        total.update(np.ascontiguousarray(outline.points_px, dtype=np.float64).tobytes())
    return total.hexdigest()


@cache
def _of_code() -> str:
    total = hashlib.sha256()
    places = [*(files("estimator").joinpath(*name.split("/")) for name in MAKERS), files("datasets").joinpath(VOCABULARY)]
    for place in places:
        sources = sorted((p for p in place.iterdir() if p.name.endswith(".py")), key=lambda p: p.name) if place.is_dir() else [place]
        for source in sources:
            total.update(source.read_bytes())
    for library in LIBRARIES:
        total.update(f"{library} {_version(library)}".encode())
    return total.hexdigest()


def _version(library: str) -> str:
    try:
        return version(library)
    except ModuleNotFoundError:
        return "another name"


def arrays_of(made: MadeOnce) -> dict[str, NDArray[np.generic]]:
    """As arrays."""
    arrays: dict[str, Any] = {"hollow": np.array([made.hollow])}
    for name, mesh in (("hull", made.hull), ("exact_hull", made.exact_hull)):
        if mesh is not None:
            arrays |= {f"{name}_vertices": mesh.vertices, f"{name}_faces": mesh.faces}
    if made.catalogue is not None:
        arrays |= {f"catalogue_{name}": value for name, value in vars(made.catalogue).items()}
    if made.convex_vertices is not None:
        arrays["convex_vertices"] = made.convex_vertices
    for name, record in (("silhouettes", made.silhouettes), ("body", made.body)):
        arrays |= {} if record is None else {f"{name}_{part}": value for part, value in vars(record).items()}
    if made.largest_moment_per_mass is not None:
        arrays["largest_moment_per_mass"] = np.array([made.largest_moment_per_mass])
    if made.view_bias is not None:
        arrays |= {"view_bias": made.view_bias.curves, "view_bias_of": np.frombuffer(bytes.fromhex(made.view_bias.of), np.uint8)}
    lengths = [len(outline) for outline in made.cast_in_views]
    arrays["cast_points"] = np.concatenate([np.zeros((0, 2)), *made.cast_in_views])
    arrays["cast_offsets"] = np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64)
    return {name.lower(): np.ascontiguousarray(value) for name, value in arrays.items()}


def made_of_arrays(arrays: Mapping[str, NDArray[np.generic]], where: str) -> MadeOnce:
    """The inverse of :func:`arrays_of`; ``where`` they are from, for messages.

    Raises
    ------
    InputError
        Where the arrays are not those of a particle.
    """
    try:
        hull, exact = _mesh(arrays, "hull"), _mesh(arrays, "exact_hull")
        catalogue = StartCatalogue(
            _floats(arrays["catalogue_r"]), _floats(arrays["catalogue_support"]), _floats(arrays["catalogue_middle"])
        )
        offsets = arrays["cast_offsets"].astype(np.int64)
        cast = tuple(np.split(_floats(arrays["cast_points"]), offsets[1:-1]))
        convex = _floats(arrays["convex_vertices"]) if "convex_vertices" in arrays else None
        return MadeOnce(
            hull=hull,
            catalogue=catalogue,
            hollow=float(arrays["hollow"][0]),
            exact_hull=exact,
            convex_vertices=convex,
            cast_in_views=cast,
            silhouettes=_silhouettes(arrays),
            body=_body(arrays),
            largest_moment_per_mass=float(arrays["largest_moment_per_mass"][0]) if "largest_moment_per_mass" in arrays else None,
            view_bias=_view_bias(arrays),
        )
    except (KeyError, IndexError, ValueError) as error:
        raise InputError(f"{where}: expected the arrays that tumble shape makes, got others ({error}).") from None


def _mesh(arrays: Mapping[str, NDArray[np.generic]], name: str) -> SurfaceMesh | None:
    if f"{name}_vertices" not in arrays:
        return None
    vertices, faces = _floats(arrays[f"{name}_vertices"]), arrays[f"{name}_faces"].astype(np.int64)
    if faces.size and not 0 <= int(faces.min()) <= int(faces.max()) < len(vertices):
        raise ValueError(f"{name}: faces name vertices that are not there")
    return SurfaceMesh(vertices, faces)


def _silhouettes(arrays: Mapping[str, NDArray[np.generic]]) -> Silhouettes | None:
    if "silhouettes_offsets" not in arrays:
        return None
    kept: dict[str, Any] = {name: arrays[f"silhouettes_{name}"] for name in Silhouettes.__dataclass_fields__}
    kept = {name: values.astype(np.int64) if name in ("offsets", "samples") else _floats(values) for name, values in kept.items()}
    found = Silhouettes(**kept)
    counts = np.diff(found.offsets)
    if found.offsets[0] != 0 or counts.min(initial=0) < 0 or {len(found.xy), len(found.sigma_px)} != {int(found.offsets[-1])}:
        raise ValueError("silhouettes: offsets that are not theirs")
    return found


def _body(arrays: Mapping[str, NDArray[np.generic]]) -> Body | None:
    if "body_com_particle" not in arrays:
        return None
    return Body(**{name: _floats(arrays[f"body_{name.lower()}"]) for name in Body.__dataclass_fields__})


def _view_bias(arrays: Mapping[str, NDArray[np.generic]]) -> DrawnBias | None:
    if "view_bias" not in arrays:
        return None
    return DrawnBias(_floats(arrays["view_bias"]), arrays["view_bias_of"].astype(np.uint8).tobytes().hex())


def _floats(values: NDArray[np.generic]) -> Array:
    return np.ascontiguousarray(values, dtype=np.float64)
