"""An estimate as one JSON file, and beside it the surface of the particle as a mesh, where the fit found it.

Arrays are nested lists; floats round-trip exactly and the same estimate gives the same bytes (sorted keys, no time of writing).
"""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from datasets import measured_entries, state_entries
from datasets.atomic_files import write_failure
from datasets.errors import InputError
from datasets.estimate import Estimate, FrameReport, Status
from datasets.json_documents import Document, read_document, revived, write_document
from datasets.mesh_files import read_mesh, write_mesh
from datasets.vocabulary.surface_mesh import SurfaceMesh

SUFFIXES = (".estimate.json", ".json")


def surface_file(path: Path, *, companion: bool = False) -> Path:
    """Where the surface of the estimate ``path``, or its companion's, lies: ``flight.estimate.json`` has ``flight.surface.ply``."""
    stem = next((path.name.removesuffix(suffix) for suffix in SUFFIXES if path.name.endswith(suffix)), path.name)
    return path.with_name(f"{stem}.surface{'.companion' if companion else ''}.ply")


def write_estimate(estimate: Estimate, path: Path) -> None:
    """Write ``estimate`` to ``path``, its surface beside it; the surface of an earlier one is removed.

    Raises
    ------
    TumbleError
        When the disk does not take it.
    """
    _write_surface(estimate, surface_file(path))
    _write_surface(estimate.companion, surface_file(path, companion=True))
    write_document(path, "estimate", _content(estimate))


def _write_surface(estimate: Estimate | None, path: Path) -> None:
    if estimate is not None and estimate.surface is not None:
        write_mesh(path, estimate.surface.vertices, estimate.surface.faces)
        return
    try:
        path.unlink(missing_ok=True)
    except OSError as error:
        raise write_failure(path, error) from error


def _content(estimate: Estimate) -> Document:
    companion = {} if estimate.companion is None else {"companion": _content(estimate.companion)}
    return {
        "name": estimate.name,
        "status": estimate.status.value,
        "message": estimate.message,
        "body": None if estimate.body is None else state_entries.body_entry(estimate.body),
        "motion": None if estimate.motion is None else state_entries.motion_arrays(estimate.motion),
        "start": measured_entries.velocity_entry(estimate.start),
        "middle": measured_entries.velocity_entry(estimate.middle),
        "parameters": estimate.parameters,
        "values": estimate.values,
        "covariance": estimate.covariance,
        "bound": estimate.bound,
        "frames": [vars(frame) for frame in estimate.frames],
        "statistics": estimate.statistics,
        "configuration": estimate.configuration,
        "versions": estimate.versions,
        **measured_entries.entries(estimate),
        **companion,
    }


def read_estimate(path: Path) -> Estimate:
    """Read an estimate; without a surface where its file has been left behind.

    Raises
    ------
    InputError
        Naming the file, what was expected and what came.
    """
    estimate = _with_surface(_estimate(read_document(path, "estimate"), path), surface_file(path))
    if estimate.companion is None:
        return estimate
    return replace(estimate, companion=_with_surface(estimate.companion, surface_file(path, companion=True)))


def _with_surface(estimate: Estimate, path: Path) -> Estimate:
    return replace(estimate, surface=SurfaceMesh(*read_mesh(path))) if path.exists() else estimate


def _estimate(document: Document, path: Path) -> Estimate:
    _check(document, path)
    motion, body = document["motion"], document["body"]
    return Estimate(
        name=document["name"],
        status=Status(document["status"]),
        message=document["message"],
        body=None if body is None else state_entries.body(body),
        motion=None if motion is None else state_entries.motion(motion),
        start=measured_entries.velocity(document["start"]),
        middle=measured_entries.velocity(document["middle"]),
        parameters=tuple(document["parameters"]),
        values=state_entries.array(document["values"]),
        covariance=state_entries.square(document["covariance"]),
        bound=state_entries.square(document["bound"]),
        frames=tuple(_frame(entry) for entry in document["frames"]),
        statistics=revived(document["statistics"]),
        configuration=revived(document["configuration"]),
        versions=document["versions"],
        segments=measured_entries.segments(document),
        impacts=measured_entries.impacts(document),
        companion=_estimate(document["companion"], path) if "companion" in document else None,
        collision=measured_entries.collision(document),
    )


def _frame(entry: dict[str, Any]) -> FrameReport:
    rms_ete_px, rms_whitened = float(entry["rms_ete_px"]), float(entry["rms_whitened"])
    return FrameReport(entry["camera"], entry["frame"], entry["used"], entry["reason"], rms_ete_px, rms_whitened)


def _check(document: Document, path: Path) -> None:
    """What a schema cannot say: sizes that have to agree, a measurement where the status promises one."""
    count = len(document["parameters"])
    if len(document["values"]) != count:
        raise InputError(f"{path}: at $.values: expected {count} entries (one per parameter), got {len(document['values'])}.")
    for name in ("covariance", "bound"):
        shape = np.shape(document[name]) if all(len(row) == len(document[name]) for row in document[name]) else "rows of unequal length"
        if shape not in ((count, count), (0,)):
            raise InputError(f"{path}: at $.{name}: expected a square matrix of {count} rows, got {shape}.")
    fault = state_entries.motion_fault(document["motion"]) if document["motion"] is not None else None
    if fault is not None:
        raise InputError(f"{path}: at $.motion: {fault}.")
    if document["status"] == Status.CONVERGED and document["middle"] is None:
        raise InputError(f'{path}: at $.middle: expected velocities, since the status is "converged", got null.')
