"""Fixtures that every test folder uses."""

import os
from pathlib import Path

import pytest
from hypothesis import settings
from jaxtyping import install_import_hook

settings.register_profile("repeatable", derandomize=True)
settings.load_profile("repeatable")
"""The same examples in every run: a failure is found again by whoever looks for it."""

SHAPES_CHECKED_IN = (
    "datasets.vocabulary",
    "datasets.scoring.angles",
    "synth.motion",
    "synth.particles",
    "synth.rig",
    "synth.silhouette",
)
"""Public functions of these check the shapes they state, in tests only."""

install_import_hook(SHAPES_CHECKED_IN, "beartype.beartype")

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The folder of real particles and outlines; tests that need it are skipped where it is absent."""
    folder = Path(os.environ.get("TUMBLE_SHARED", ROOT.parent / "shared")) / "data"
    if not folder.is_dir():
        pytest.skip("the folder of real data is absent; set TUMBLE_SHARED to where it lies")
    return folder
