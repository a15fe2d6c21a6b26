"""The directions of the arrows hold, and the packages imported are this project's."""

import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import datasets

ROOT = Path(__file__).resolve().parents[2]


def test_import_contracts_hold() -> None:
    done = subprocess.run(
        [sys.executable, "-c", "from importlinter.cli import lint_imports_command; lint_imports_command()"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout
    assert "7 kept, 0 broken" in done.stdout


def test_no_import_is_excepted_from_the_contracts() -> None:
    linter = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"]
    assert [contract["name"] for contract in linter["contracts"] if "ignore_imports" in contract] == []


def test_datasets_is_ours_and_only_a_docstring() -> None:
    assert Path(datasets.__file__).resolve() == ROOT / "datasets" / "__init__.py"
    code = compile((ROOT / "datasets" / "__init__.py").read_text(encoding="utf-8"), "datasets", "exec")
    assert code.co_names == ("__doc__",)


@pytest.mark.parametrize("name", ["mitsuba", "drjit", "synth", "datasets.truth", "datasets.scoring"])
def test_the_estimator_loads_without(name: str) -> None:
    block = f"import sys; sys.modules[{name!r}] = None; import estimator.measure; assert sys.modules[{name!r}] is None"
    done = subprocess.run([sys.executable, "-c", block], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
