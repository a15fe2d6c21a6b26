"""The truth of a sequence as a folder: ``truth.json``, ``mesh.ply``, ``motion.npz`` and, in the rendered tier, ``masks.tif``.

Where the particle broke, ``mesh_remnant.ply`` is what is left of it. A second particle has the folder ``companion`` within.
A mesh is a binary PLY with float64 vertices, which any mesh viewer opens and which loses nothing. Closed to the estimator.
"""

from pathlib import Path
from typing import Any

import numpy as np

from datasets import state_entries
from datasets.array_files import read_arrays, write_arrays
from datasets.covariances import check_covariance
from datasets.errors import InputError
from datasets.impact_entries import impact, impact_entry, remnant, remnant_entry
from datasets.json_documents import read_document, revived, write_document
from datasets.mesh_files import read_mesh, write_mesh
from datasets.tiff_frames import FrameStackWriter, TiffFrames
from datasets.truth import MotionBound, Remnant, Truth
from datasets.vocabulary.frames import is_rotation

FILE = "truth.json"
MESH_FILE = "mesh.ply"
MOTION_FILE = "motion.npz"
MASKS_FILE = "masks.tif"
REMNANT_FILE = "mesh_remnant.ply"
COMPANION_FOLDER = "companion"
MASK_BITS = 1


def write_truth(truth: Truth, folder: Path) -> None:
    """Write ``truth`` to ``folder``; ``truth.json`` comes last.

    Masks that lie in ``folder`` as ``masks.tif`` already are referred to, not copied.

    Raises
    ------
    TumbleError
        When the disk does not take it.
    """
    folder.mkdir(parents=True, exist_ok=True)
    write_arrays(folder / MOTION_FILE, state_entries.motion_arrays(truth.motion))
    write_mesh(folder / MESH_FILE, truth.mesh_vertices, truth.mesh_faces)
    _store_masks(truth, folder / MASKS_FILE)
    content = {
        "name": truth.name,
        "body": state_entries.body_entry(truth.body),
        "mass_kg": truth.mass_kg,
        "inertia_kgm2": truth.inertia_kgm2,
        "mesh": MESH_FILE,
        "motion": MOTION_FILE,
        "masks": None if truth.masks is None else MASKS_FILE,
        "symmetries": truth.symmetries,
        "descriptors": truth.descriptors,
        "effects": truth.effects,
        "notes": truth.notes,
    }
    if truth.plate is not None:
        content["plate"] = state_entries.plate_entry(truth.plate)
    if truth.plate is not None or truth.impacts:
        content["impacts"] = [impact_entry(impact) for impact in truth.impacts]
    if truth.bound is not None:
        content["bound"] = {"time_s": truth.bound.time_s, "covariance": truth.bound.covariance}
    if truth.companion is not None:
        write_truth(truth.companion, folder / COMPANION_FOLDER)
        content["companion"] = COMPANION_FOLDER
    if truth.remnant is not None:
        write_mesh(folder / REMNANT_FILE, truth.remnant.mesh_vertices, truth.mesh_faces)
        content["remnant"] = remnant_entry(truth.remnant, REMNANT_FILE)
    write_document(folder / FILE, "truth", content)


def read_truth(folder: Path) -> Truth:
    """Read the truth of a sequence.

    Raises
    ------
    InputError
        Naming the file, what was expected and what came.
    """
    if not folder.is_dir():
        raise InputError(f"{folder}: expected the folder of a truth, got {'a file' if folder.exists() else 'nothing'}.")
    document = read_document(folder / FILE, "truth")
    motion_path = folder / document["motion"]
    arrays = read_arrays(motion_path, tuple(state_entries.MOTION_FIELDS))
    fault = state_entries.motion_fault(arrays)
    if fault is not None:
        raise InputError(f"{motion_path}: {fault}.")
    vertices, faces = read_mesh(folder / document["mesh"])
    symmetries = state_entries.array(document["symmetries"], (3, 3))
    odd = next((k for k, S in enumerate(symmetries) if not is_rotation(S)), None)
    if odd is not None:
        raise InputError(f"{folder / FILE}: at $.symmetries[{odd}]: expected a rotation, got another matrix.")
    masks, plate, remnant, companion = (document.get(key) for key in ("masks", "plate", "remnant", "companion"))
    return Truth(
        name=document["name"],
        motion=state_entries.motion(arrays),
        body=state_entries.body(document["body"]),
        mass_kg=float(document["mass_kg"]),
        inertia_kgm2=state_entries.array(document["inertia_kgm2"]),
        mesh_vertices=vertices,
        mesh_faces=faces,
        symmetries=symmetries,
        descriptors=revived(document["descriptors"]),
        effects=revived(document["effects"]),
        notes=revived(document["notes"]),
        masks=None if masks is None else TiffFrames(folder / masks, MASK_BITS),
        plate=None if plate is None else state_entries.plate(plate),
        impacts=tuple(impact(entry) for entry in document.get("impacts", ())),
        remnant=None if remnant is None else _remnant(remnant, folder, len(vertices)),
        companion=None if companion is None else read_truth(folder / companion),
        bound=None if "bound" not in document else _bound(document["bound"], folder / FILE),
    )


def _bound(entry: dict[str, Any], path: Path) -> MotionBound:
    covariance = state_entries.square(entry["covariance"])
    check_covariance(covariance, f"{path}: at $.bound.covariance")
    if not np.all(np.diag(covariance) > 0):
        raise InputError(f"{path}: at $.bound.covariance: expected variances above 0, got 0.")
    return MotionBound(float(entry["time_s"]), covariance)


def _remnant(entry: dict[str, Any], folder: Path, count: int) -> Remnant:
    vertices, _ = read_mesh(folder / entry["mesh"])
    if len(vertices) != count:
        raise InputError(f"{folder / entry['mesh']}: expected the {count} vertices of the whole particle, got {len(vertices)}.")
    return remnant(entry, vertices)


def _store_masks(truth: Truth, path: Path) -> None:
    masks = truth.masks
    if masks is None or (isinstance(masks, TiffFrames) and path.exists() and masks.path.resolve() == path.resolve()):
        return
    with FrameStackWriter(path) as writer:
        for k in range(len(masks)):
            writer.append(masks.read(k))
