"""The challenge's page holds the figures of its result file."""

import json
import sys
from pathlib import Path

import pandas as pd
import pytest

from scripts.acceptance import challenge_page

ROOT = Path(__file__).parents[2]


def acceptance_row(what: str, value: float | str, verdict: str) -> dict[str, object]:
    bounds = {"least": 95.0, "most": "Infinity", "needed": 240, "unit": "%"}
    return {"line": "1", "what": what, "value": value, "low": 91.5, "high": 98.25, "n": 260, **bounds, "verdict": verdict}


def result() -> dict[str, object]:
    sizes = {f"{name}{end}": 0.7 for name in ("half", "in_95_percent") for end in ("", "_low", "_high")} | {"in_95_percent": 1.25}
    effect = {"effect": "gravity", "cases": 9, "within_group": 8, "alone_first": 7, "mean_group": 1.1}
    return {
        "campaign": {"sequences": 4, "frames": 80, "views": 40},
        "tiers": ["silhouette"],
        "counts": {"single": 13, "control": 5},
        "acceptance": [acceptance_row("named first", 96.153, "HELD"), acceptance_row("not judged", "NaN", "TOO FEW CASES")],
        "confusion": {"gravity": {"gravity": 7, "linear_drag": 2}, "nothing": {"nothing": 5}},
        "effects": [{**effect, "parameters": 27, "inside_95": 26, "pull_mean": 0.1, "pull_spread": 0.93}],
        "detection": [{"effect": key, "cases": 13, "found": 11, **sizes} for key in ("all", "gravity")],
        "cpu_s": {"register": 5.2, "diagnose": 7.4, "explain": 25.1},
    }


def test_the_page_copies_the_result(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "challenge.json").write_text(json.dumps(result()))
    cases = pd.DataFrame({"kind": "single", "ratio": [0.6, 1.1, 4.0], "all_found": [False, True, True]})
    cases.to_csv(tmp_path / "challenge_cases.csv", index=False)
    runs = [
        {"campaign": "E/c016", "jobs": jobs, "wall_s": wall, "cpu_s": 318.2, "found": ["gravity"], "same": True}
        for jobs, wall in ((1, 340.0), (2, 211.4))
    ]
    (tmp_path / "time_explain.json").write_text(json.dumps({"of": 90, "asked_s": 300.0, "cores": 2, "runs": runs}))
    page = tmp_path / "page.md"
    told = ["--remark", "Half of the cases."]
    monkeypatch.setattr(sys, "argv", ["page", "--result", str(tmp_path / "challenge.json"), "--page", str(page), *told])
    assert challenge_page.main() == 0
    text = page.read_text()
    assert "single effects run from 0.6 to 4 times" in text
    assert "\n\nHalf of the cases.\n\n" in text
    assert "| 1 | named first | 96.2 (91.5 to 98.2) % | 260 | ≥ 95 % | HELD |" in text
    assert "| 1 | not judged | – | 260 | ≥ 95 % | TOO FEW CASES |" in text
    assert "| gravity | 9 | 7 | linear drag 2 |" in text
    assert "| 9 | 8 | 7 | 0.7 (0.7 to 0.7) | 1.25 (0.7 to 0.7) | 26 of 27 | 0.93 |" in text
    assert (tmp_path / "page.png").stat().st_size > 5000
    assert "of those of 90 campaigns" in text
    assert "300 s are asked: 211 s, HELD" in text
    assert "| E/c016 | gravity | the same | 318 | 1 | 340 |\n| E/c016 | gravity | the same | 318 | 2 | 211 |" in text


def test_the_page_of_rendered_pictures_shows_every_case(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "challenge_rendered.json").write_text(json.dumps({**result(), "tiers": ["rendered"]}))
    row = {"particle": "cut_stone", "own_ratio": 1.5, "within_group": False, "named_first": False, "all_found": False, "false_alarm": False}
    hit = {
        "kind": "single",
        "hidden": "magnus_lift",
        "ratio": 2.25,
        "first": "gravity",
        "group": "gravity+magnus_lift",
        "within_group": True,
    }
    errors = {"base_px": 0.25, "final_px": 0.2}
    miss = {"kind": "single", "hidden": "blooming", "ratio": 1.125, "first": "nothing", "group": ""}
    control = {"kind": "control", "hidden": "", "ratio": float("nan"), "own_ratio": float("nan"), "first": "nothing", "group": ""}
    cases = pd.DataFrame([{**row, **errors, **hit}, {**row, **errors, **miss}, {**row, **control}])
    cases.to_csv(tmp_path / "challenge_rendered_cases.csv", index=False)
    page = tmp_path / "page.md"
    monkeypatch.setattr(sys, "argv", ["page", "--result", str(tmp_path / "challenge_rendered.json"), "--page", str(page)])
    assert challenge_page.main() == 0
    text = page.read_text()
    assert "sizes run from 1.12 to 2.25 times" in text
    assert "| magnus lift | cut stone | 2.25 | 1.5 | gravity | gravity, magnus lift | 0.25 → 0.2 | yes |" in text
    assert "| blooming | cut stone | 1.12 | 1.5 | nothing | – | 0.25 → 0.2 | **no** |" in text
    assert "| nothing | cut stone | – | – | nothing | – | – | yes |" in text
    assert "tumble challenge make --tier rendered --out out/challenge_rendered" in text


@pytest.mark.parametrize("stem", ["challenge", "challenge_rendered"])
def test_the_committed_page_is_what_the_script_writes_from_the_committed_result(stem: str) -> None:
    """But for the remark on that run, a paragraph of its own."""
    page = (ROOT / "docs" / "studies" / f"{stem}.md").read_text(encoding="utf-8")
    result = ROOT / "docs" / "results" / f"{stem}.json"
    found = challenge_page.inputs(result)
    written = challenge_page.page_lines(*found, f"{stem}.png", times=challenge_page.times_beside(result, found[0]))
    before, after = "\n".join(written).split("\n\n![", maxsplit=1)
    assert page.startswith(before)
    assert page.rstrip().endswith(after.rstrip())
