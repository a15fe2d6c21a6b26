"""A particle as a folder: ``particle.json``, the outlines of its calibrated views, and what was made of them once. See ``docs/format.md``.

It has no clock and no high-speed camera: every recording of this particle takes its views from here.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from datasets.json_documents import Document, read_document, revived, write_document
from datasets.made_files import KIND, PARTICLE_FILE, Arrays, MadeFile, made_of_entry, write_made
from datasets.observation import CalibratedView, Observation
from datasets.observation_files import view_entry, view_of_entry
from datasets.outline_files import read_outlines, write_outlines
from datasets.plausibility import check_view_set
from datasets.rounded_rotations import nearest_rotation
from datasets.vocabulary.outline import Outline

OUTLINES_FILE = "view_outlines.npz"


@dataclass(frozen=True)
class ParticleFile:
    """A particle's calibrated ``views`` and their ``outlines`` (px).

    ``mass_kg`` where it was weighed; ``merging``, ``shape`` and ``checks``: what was found (plain values, see ``docs/format.md``);
    ``notes`` in sentences; ``made``: what is kept of it, where it was read from ``folder``.
    """

    name: str
    views: tuple[CalibratedView, ...]
    outlines: tuple[Outline, ...]
    mass_kg: float | None = None
    merging: Mapping[str, Any] | None = None
    shape: Mapping[str, Any] = field(default_factory=dict)
    checks: Mapping[str, Any] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    folder: Path | None = None
    made: MadeFile | None = None


def write_particle(particle: ParticleFile, folder: Path, made: tuple[str, Arrays] | None = None) -> None:
    """Write a particle; ``made``: the digest of what it was made from, and the arrays. ``particle.json`` comes last."""
    folder.mkdir(parents=True, exist_ok=True)
    write_outlines(folder / OUTLINES_FILE, particle.outlines)
    content: Document = {
        "name": particle.name,
        "mass_kg": particle.mass_kg,
        "views": {"recording": {"kind": "outlines", "file": OUTLINES_FILE}, "cameras": [view_entry(view) for view in particle.views]},
        "made": None if made is None else write_made(folder, *made),
        "merging": particle.merging,
        "shape": particle.shape,
        "checks": particle.checks,
        "notes": particle.notes,
    }
    write_document(folder / PARTICLE_FILE, KIND, content)


def read_particle(folder: Path) -> ParticleFile:
    """Read a particle from its folder.

    Raises
    ------
    InputError
        Naming the file, the place in it, what was expected and what came.
    """
    path = folder / PARTICLE_FILE
    document = read_document(path, KIND)
    views = tuple(view_of_entry(entry) for entry in document["views"]["cameras"])
    outlines = read_outlines(folder / document["views"]["recording"]["file"], len(views))
    check_view_set(views, outlines, path)
    return ParticleFile(
        name=document["name"],
        views=tuple(map(_rounded, views)),
        outlines=outlines,
        mass_kg=document.get("mass_kg"),
        merging=revived(document["merging"]),
        shape=revived(document["shape"]),
        checks=revived(document["checks"]),
        notes=tuple(document["notes"]),
        folder=folder,
        made=made_of_entry(folder, document["made"]),
    )


def _rounded(view: CalibratedView) -> CalibratedView:
    return replace(view, R_cam_particle=nearest_rotation(np.asarray(view.R_cam_particle)))


def is_particle(path: Path) -> bool:
    """Whether ``path`` is the folder of a particle file."""
    return (path / PARTICLE_FILE).is_file()


def with_particle(observation: Observation, particle: ParticleFile) -> Observation:
    """The observation with the views of ``particle``, and its mass where the observation states none."""
    return replace(
        observation,
        views=particle.views,
        view_recording=particle.outlines,
        mass_kg=observation.mass_kg if observation.mass_kg is not None else particle.mass_kg,
        particle=particle.folder,
        made=particle.made,
    )
