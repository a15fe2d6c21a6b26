"""The studies: a small case from recipe to row, kept rows, tidy medians, pages that copy their numbers from the result files."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from datasets.recipes.recipe import RigRecipe
from datasets.recipes.toml_files import recipe_from_dict, recipe_to_dict
from datasets.scoring.metrics import COMPONENTS
from scripts import study_benchmark_axes, study_conduct, study_focal_length, study_out_of_plane, study_runs
from scripts.study_conduct import Study, conduct
from scripts.study_pages import overconfidence_in_words
from scripts.study_runs import DESCRIBED, SCORED, Case, Options, case_seed, run_cases, standard_recipe
from scripts.study_summaries import QUANTITIES, inside_in_words, median_interval, summary
from studies.looks.words import number, with_interval
from tumble import versions
from tumble.engine import Serial

STUDIES = (study_benchmark_axes.STUDY, study_focal_length.STUDY, study_out_of_plane.STUDY)
SIGMA = {"vx": 0.3, "vy": 0.3, "vz": 2.0, "wx": 0.5, "wy": 0.5, "wz": 0.5}


def small_case(options: Options, drops: int) -> Case:
    standard = standard_recipe(options, 1)
    return Case({"drops": drops}, replace(standard, motion=replace(standard.motion, frames=16), rig=RigRecipe(drops=drops)))


def test_a_case_from_recipe_to_row_and_not_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(study_runs, "sources_hash", lambda: "these")
    options = Options("study", executor=Serial(), out=tmp_path, quiet=True)
    case = small_case(options, 2)
    table, failed = run_cases([case], options)
    assert failed == []
    assert list(table.columns) == ["drops", "particle", *DESCRIBED, *SCORED]
    row = table.iloc[0]
    assert (row["status"], row["n_frames"], row["n_views"], row["particle"]) == ("converged", 16, 12, "jagged")
    assert 0 < row["in_plane_percent"] < 20
    assert 1.0 <= row["speed_ms"] <= 2.1

    asked = []

    def counted(payload: dict[str, Any]) -> dict[str, Any]:
        asked.append(payload["recipe"]["rig"]["drops"])
        raise RuntimeError("made anew")

    monkeypatch.setattr(study_runs, "one_case", counted)
    again, failed = run_cases([case, small_case(options, 3), case], options)
    assert asked == [3]
    assert len(failed) == 1
    assert "made anew" in failed[0]
    pd.testing.assert_frame_equal(again, pd.concat([table, table], ignore_index=True))


def test_a_changed_estimator_does_not_show_old_numbers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = study_runs.sources_hash()
    for package in ("datasets", "estimator", "synth"):
        (tmp_path / package).mkdir()
        (tmp_path / package / "one.py").write_text("x = 1\n")
    monkeypatch.setattr(versions, "find_spec", lambda package: SimpleNamespace(submodule_search_locations=[str(tmp_path / package)]))
    first = study_runs.sources_hash()
    (tmp_path / "estimator" / "one.py").write_text("x = 2\n")
    assert len({before, first, study_runs.sources_hash()}) == 3


def test_repetitions_share_their_seed_over_the_points_and_differ_among_each_other() -> None:
    options = Options("study", repetitions=6)
    for study in STUDIES:
        cases = study.cases(options)
        seeds = {(case.labels["repetition"], case.recipe.seed) for case in cases}
        assert len(seeds) == len({seed for _, seed in seeds}) == 6
        # Some points of two axes are the same sequence: 100 frames, 60 views and bodies of the irregularity axis.
        assert len({study_runs.recipe_hash(case.recipe) for case in cases}) > 0.9 * len(cases)
    assert case_seed(1, 0) != case_seed(2, 0)


def test_equal_magnification_at_every_focal_length() -> None:
    for case in study_focal_length.cases(Options("study", repetitions=1)):
        hsv = case.recipe.hsv
        image = hsv.focal_mm * 1e-3 * hsv.distance_m / (hsv.distance_m - hsv.focal_mm * 1e-3)
        assert image / hsv.distance_m == pytest.approx(study_focal_length.MAGNIFICATION)


def test_the_recipes_of_all_cases_are_valid() -> None:
    for study in STUDIES:
        for case in (*study.cases(Options("study", repetitions=1)), *study.cases(Options("study", repetitions=1, full=True))):
            assert recipe_from_dict(recipe_to_dict(case.recipe), "case") == case.recipe


def made_up_rows(cases: list[Case], rng: np.random.Generator) -> pd.DataFrame:
    """Rows as of an estimator whose error bars are right; the first point of the irregularity axis has no measurement."""
    rows = []
    for case in cases:
        sphere = case.labels.get("axis") == "irregularity" and case.labels["value"] == 0
        error = {c: rng.normal(0, s) for c, s in SIGMA.items()}
        row = {"particle": "p", "status": "ambiguous" if sphere else "converged", "converged": not sphere}
        row |= {"n_frames": 100, "n_used": 100, "n_views": 60, "n_symmetries": 1, "irregularity": 0.2, "speed_ms": 2.0, "spin_rads": 100.0}
        for q in QUANTITIES:
            total, sigma = (np.nan if sphere else np.linalg.norm([values[c] for c in q.components]) for values in (error, SIGMA))
            row |= {f"{q.key}_percent": total, f"sigma_{q.key}_percent": sigma, f"bound_{q.key}_percent": sigma}
            row[q.absolute] = row[f"{q.key}_percent"] * (1.0 if q.key == "angular" else 0.02)
        row |= {f"inside95_{c}": np.nan if sphere else float(abs(error[c]) < 1.96 * SIGMA[c]) for c in COMPONENTS}
        rows.append({**case.labels, **row})
    return pd.DataFrame(rows)


@pytest.mark.parametrize("study", STUDIES, ids=lambda study: study.name)
def test_pages_and_figures_come_from_the_result_files(study: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(study_conduct, "run_cases", lambda cases, options: (made_up_rows(cases, np.random.default_rng(4)), []))
    assert conduct(study, ["--repetitions", "4", "--docs", str(tmp_path), "-q"]) == 0
    points = pd.read_csv(tmp_path / "results" / f"{study.name}_summary.csv")
    page = (tmp_path / "studies" / f"{study.name}.md").read_text()
    assert list(points.columns[: len(study.by)]) == list(study.by)
    assert not points.duplicated([*study.by, "quantity"]).any()
    for _, row in points[points["n_converged"] > 0].iterrows():
        assert with_interval(row.to_dict()) in page
    assert "nan" not in page
    assert f"]({study.name}.png)" in page
    assert 5_000 < (tmp_path / "studies" / f"{study.name}.png").stat().st_size < 150_000


def test_no_measurement_is_told_and_never_a_number(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(study_conduct, "run_cases", lambda cases, options: (made_up_rows(cases, np.random.default_rng(4)), ["lost: why"]))
    study = study_benchmark_axes.STUDY
    assert conduct(study, ["--repetitions", "3", "--docs", str(tmp_path), "-q"]) == 1
    page = (tmp_path / "studies" / f"{study.name}.md").read_text()
    assert "**Sequences that could not be made and are missing here: 1.**" in page
    assert "0 (3 of 3 *ambiguous*)" in page
    assert "| 0 | 0 of 3 | – | – | – |" in page


def test_right_error_bars_predict_the_median() -> None:
    cases = [Case({"point": 1, "repetition": k}, standard_recipe(Options("study"), 0)) for k in range(1500)]
    points = summary(made_up_rows(cases, np.random.default_rng(5)), ("point",)).set_index("quantity")
    np.testing.assert_allclose(points["predicted"] / points["median"], 1, atol=0.1)
    np.testing.assert_allclose(points["coverage"], 0.95, atol=0.02)
    absolute = summary(made_up_rows(cases, np.random.default_rng(5)), ("point",), absolute=True).set_index("quantity")
    assert absolute.loc["in_plane", "median"] == pytest.approx(points.loc["in_plane", "median"] * 2.0 * 10)
    assert absolute.loc["angular", "median"] == pytest.approx(points.loc["angular", "median"])


def test_the_interval_of_a_median_holds_it_as_often_as_it_says() -> None:
    rng = np.random.default_rng(6)
    held = [low <= 0 <= high for low, high in (median_interval(rng.normal(size=25)) for _ in range(60))]
    assert 0.85 <= np.mean(held) <= 1
    assert np.isnan(median_interval(np.array([1.0, 2.0]))).all()


@pytest.mark.parametrize(
    ("medians", "words"),
    [
        ([0.1, 0.2, 0.3, 0.5], "everywhere"),
        ([0.9, 0.6, np.nan, 0.7], "nowhere"),
        ([0.9, 0.6, 0.4, 0.1], "from 3 mm on"),
        ([0.1, 0.4, 0.6, np.nan], "up to 2 mm"),
        ([0.1, 0.6, 0.4, 0.9], "at 1, 3 mm"),
        ([0.1, 0.6, 0.9, 0.4], "at 1, 4 mm"),
    ],
)
def test_where_the_medians_are_inside_the_tolerance(medians: list[float], words: str) -> None:
    points = pd.DataFrame({"value": [1, 2, 3, 4], "median": medians, "quantity": "in_plane"})
    assert inside_in_words(points, "value", QUANTITIES[0], "mm") == words


def test_error_bars_that_are_too_small_are_named() -> None:
    row = {"quantity": "angular", "unit": "%", "median": 0.9, "predicted": 0.1}
    points = pd.DataFrame([{**row, "mm": 50, "coverage": 0.9}, {**row, "mm": 25, "coverage": 0.25}])
    words = overconfidence_in_words(points, (("mm", "mm"),))
    assert "angular velocity at 25 mm (25% of the intervals hold the truth; median error 0.9, predicted 0.1 %)" in words
    assert "50" not in words
    assert "At no point" in overconfidence_in_words(points[:1], (("mm", "mm"),))


@pytest.mark.parametrize(("value", "text"), [(0.05923, "0.0592"), (12.0, "12"), (1234.5, "1234"), (0.0, "0"), (0.25, "0.25"), (100, "100")])
def test_three_digits_without_exponent(value: float, text: str) -> None:
    assert number(value) == text
