"""The benchmark of the report measures a page of pictures, here one of three small sequences."""

from dataclasses import replace
from pathlib import Path

import pytest

from datasets.estimate import Estimate, Status
from datasets.recipes.recipe import HsvRecipe, MotionRecipe, RigRecipe
from scripts.benchmarks import bench_report
from tumble.environment import find_chromium


@pytest.mark.skipif(find_chromium() is None, reason="there is no Chromium here; `tumble doctor` says how to get it")
def test_every_figure_is_measured(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("axe_playwright_python")
    camera = HsvRecipe(width_px=160, height_px=160, focal_mm=40.0)
    small = replace(bench_report.RECIPE, motion=MotionRecipe(frames=4), hsv=camera, rig=RigRecipe(drops=1))
    monkeypatch.setattr(bench_report, "RECIPE", small)
    monkeypatch.setattr(bench_report, "TABS", 1)
    monkeypatch.setattr(bench_report, "estimate", lambda *_: Estimate("", Status.NO_CONVERGENCE, "not tried"))
    found = {figure["name"]: figure for figure in bench_report.figures(tmp_path, count=3, distinct=2, jobs=1)}
    assert "size with 12 pictures" in found
    assert found["opening, 3 sequences"]["value"] > 0.0
    for name in ("exit code of tumble report", "files or addresses that the page asked for", "axe, light: serious findings"):
        assert found[name]["value"] == found[name]["limit"] == 0
