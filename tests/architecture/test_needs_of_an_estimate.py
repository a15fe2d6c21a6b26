"""An estimate is the same to the byte where the truth tree is removed and neither Mitsuba nor ``synth`` can be imported.

The blocked program is the ordinary command line in a process of its own. A ``sitecustomize`` module, which Python imports before
anything else and in every worker process too, makes the imports fail and hides the distributions, as if they were not installed.
"""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from datasets.estimate import Status
from datasets.estimate_files import read_estimate
from tumble.cli.main import main

pytestmark = pytest.mark.long

ROOT = Path(__file__).resolve().parents[2]

BLOCKED = ("mitsuba", "drjit", "synth", "datasets.truth_files", "datasets.dataset_files", "datasets.recipes", "datasets.scoring")
"""``datasets.truth`` is not among them: the command line's tables know the type of truth, though none is read."""

SITECUSTOMIZE = f"""
import importlib.metadata
import sys

BLOCKED = {BLOCKED!r}


class Uninstalled:
    @staticmethod
    def find_spec(name, path=None, target=None):
        if any(name == blocked or name.startswith(blocked + ".") for blocked in BLOCKED):
            raise ModuleNotFoundError(f"No module named {{name!r}} (blocked by the test)", name=name)
        return None


sys.meta_path.insert(0, Uninstalled)
installed = importlib.metadata.Distribution.from_name


def found(name):
    if name in BLOCKED:
        raise importlib.metadata.PackageNotFoundError(name)
    return installed(name)


importlib.metadata.Distribution.from_name = staticmethod(found)
"""

SHORT = ("motion.frames=25", "rig.drops=3", "motion.spin_rads=[100, 200]", "motion.speed_ms=[0.3, 0.8]")
SMALL_PICTURES = (
    *('tier="rendered"', "hsv.width_px=320", "hsv.height_px=320", "hsv.focal_mm=80", 'rendering.variant="scalar_rgb"'),
    *("rendering.subframes=2", "rendering.samples_per_subframe=1", "rendering.rig_samples=1"),
    *("rig.width_px=512", "rig.height_px=512", "rig.mm_per_px=0.03"),
)


@pytest.fixture(scope="module")
def blocked(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """The environment of a process in which Mitsuba and ``synth`` are not installed."""
    folder = tmp_path_factory.mktemp("blocked")
    (folder / "sitecustomize.py").write_text(SITECUSTOMIZE, encoding="utf-8")
    return {**os.environ, "PYTHONPATH": os.pathsep.join([str(folder), str(ROOT)])}


def python(environment: dict[str, str], *words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, *words], cwd=ROOT, env=environment, capture_output=True, text=True, check=False)


@pytest.mark.parametrize("name", ["mitsuba", "synth.sequence", "datasets.truth_files", "datasets.scoring.score"])
def test_the_block_works(blocked: dict[str, str], name: str) -> None:
    done = python(blocked, "-c", f"import {name}")
    assert done.returncode == 1
    assert "blocked by the test" in done.stderr


def test_mitsuba_is_hidden_like_a_distribution_that_is_not_installed(blocked: dict[str, str]) -> None:
    done = python(blocked, "-c", "from tumble.versions import versions; print(versions()['mitsuba'], versions()['numpy'])")
    assert done.stdout.startswith("not installed "), done.stderr
    assert "not installed" not in done.stdout.removeprefix("not installed ")


@pytest.mark.parametrize("settings", [SHORT, SHORT + SMALL_PICTURES], ids=["outlines", "frames"])
def test_an_estimate_without_truth_and_mitsuba_is_the_same(blocked: dict[str, str], tmp_path: Path, settings: tuple[str, ...]) -> None:
    assert main(["render", *(word for s in settings for word in ("--set", s)), "--out", str(tmp_path / "dataset"), "-q"]) == 0
    code = main(["estimate", str(tmp_path / "dataset"), "--out", str(tmp_path / "with"), "-q"])
    assert code in (0, 1)
    shutil.rmtree(tmp_path / "dataset" / "truth")
    program = "import sys; from tumble.cli.main import main; sys.exit(main(sys.argv[1:]))"
    done = python(blocked, "-c", program, "estimate", str(tmp_path / "dataset"), "--out", str(tmp_path / "without"), "-q")
    assert done.returncode == code, done.stderr
    (expected,) = (tmp_path / "with").glob("*.estimate.json")
    assert (tmp_path / "without" / expected.name).read_bytes() == expected.read_bytes()
    assert read_estimate(expected).status in {Status.CONVERGED, Status.AMBIGUOUS}, "nothing was measured: the test would compare little"
