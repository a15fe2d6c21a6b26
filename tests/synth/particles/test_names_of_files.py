"""A mesh file's name becomes that of its sequences."""

from pathlib import Path

import trimesh

from synth.particles.particle import shape_from_file


def test_blanks_and_umlauts_become_what_a_sequence_may_be_called(tmp_path: Path) -> None:
    path = tmp_path / "mein Würfel.ply"
    trimesh.creation.box((1.0, 2.0, 3.0)).export(path)
    assert shape_from_file(path, False).name == "mein_Wurfel"
