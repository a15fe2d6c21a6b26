"""Finished pictures of an unfinished sequence, so that a run that was killed goes on where it stopped.

A part is what the particle adds to one picture (radiance and coverage in its window), before the sensor. Parts lie in a folder named
after a digest of all that decides them; a changed recipe, mesh, renderer or variant finds none.
"""

import hashlib
import json
import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from datasets.atomic_files import written_whole
from synth.plan import SequencePlan
from synth.rendering.shots import Shot
from synth.rendering.tracer import Traced


@dataclass(frozen=True)
class Parts:
    """The parts of one sequence, in ``folder``."""

    folder: Path

    def has(self, shot: Shot) -> bool:
        """Whether the part of ``shot`` is there; parts are written whole or not at all."""
        return self._path(shot).is_file()

    def load(self, shot: Shot) -> Traced:
        """The part of ``shot``, float32."""
        with np.load(self._path(shot)) as stored:
            return Traced(stored["radiance"], stored["coverage"])

    def store(self, shot: Shot, traced: Traced) -> None:
        """Keep a part, as float32."""
        with written_whole(self._path(shot)) as temporary, temporary.open("wb") as stream:
            np.savez(stream, radiance=traced.radiance.astype(np.float32), coverage=traced.coverage.astype(np.float32))

    def remove(self) -> None:
        """Throw the parts of this sequence away, those of other settings included."""
        shutil.rmtree(self.folder.parent, ignore_errors=True)

    def _path(self, shot: Shot) -> Path:
        return self.folder / f"{shot.kind}{shot.further}-{shot.number:05d}.npz"


def parts_of(plan: SequencePlan, settings: dict[str, Any], root: Path) -> Parts:
    """The parts of ``plan`` below ``root`` that belong to ``settings`` (recipe, sequence number, variant, versions; JSON-like)."""
    digest = hashlib.sha256(json.dumps(settings, sort_keys=True, default=str).encode())
    for array in (plan.vertices, plan.faces, plan.motion.x_world, plan.motion.q_world_body):
        digest.update(np.ascontiguousarray(array).tobytes())
    return Parts(root / plan.name / digest.hexdigest()[:16])
