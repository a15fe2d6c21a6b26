"""The quick gate: the committed baseline holds for the estimator as it is, on its sequences made anew by ``tumble gate`` alone."""

from pathlib import Path

import pytest

from tumble.cli.main import main

pytestmark = pytest.mark.long

BASELINE = Path(__file__).resolve().parents[2] / "baselines" / "quick.json"
LONGEST_S = 900
"""45 sequences through all doors, one after the other: four minutes on a machine with other work."""


@pytest.mark.timeout(LONGEST_S)
def test_the_estimator_is_not_worse_than_its_baseline(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["gate", str(BASELINE), "--out", str(tmp_path / "gate"), "--jobs", "1"]) == 0, capsys.readouterr().out
    said = capsys.readouterr().out
    assert "No worsening shown; errors may be up to " in said
    assert "(34 comparisons; " in said
