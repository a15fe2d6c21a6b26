"""Every study: its cases are valid and repeat, its page and picture are made of rows that are made up."""

import ast
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from datasets.recipes.toml_files import recipe_from_dict, recipe_to_dict
from datasets.scoring.metrics import COMPONENTS
from datasets.scoring.score import VECTORS
from studies.flights.scored import DESCRIBED, SCORED
from studies.frame.digests import of_modules, source_of
from studies.frame.pages import text_of, write_pages
from studies.frame.results import Result, write_result
from studies.frame.study import Study
from studies.plans import depth, frame_step, optics, surface_fit
from studies.registry import STUDIES

SIGMA = {"vx": 3e-4, "vy": 3e-4, "vz": 2e-3, "wx": 0.05, "wy": 0.05, "wz": 0.05}
SIZES = {"in_plane": COMPONENTS[:2], "out_of_plane": COMPONENTS[2:3], "angular": COMPONENTS[3:]}
every_study = pytest.mark.parametrize("study", STUDIES, ids=lambda study: study.name)


@every_study
def test_cases_are_valid_and_do_not_depend_on_their_number(study: Study) -> None:
    for size in (study.plan.small, study.plan.full):
        few, more = (study.plan.cases(replace(size, count=count), None) for count in (2, 3))
        assert more[: len(few)] == few
        assert len({case.name for case in more}) == len(more)
        for case in few:
            recipe = recipe_from_dict(dict(case.payload)["recipe"], case.name)
            assert (
                recipe_to_dict(recipe) == json.loads(json.dumps(case.payload["recipe"], default=list))
                or recipe_from_dict(recipe_to_dict(recipe), case.name) == recipe
            )


@every_study
def test_a_plan_names_its_own_file_and_its_task_s(study: Study) -> None:
    named = set(of_modules(study.plan.modules))
    assert study.plan.cases.__module__ in named
    assert study.plan.task.__module__ in named
    assert study.module not in named


@every_study
def test_what_a_plan_imports_of_the_studies_is_named_too(study: Study) -> None:
    """But for the frame, which decides no row."""
    named = set(study.plan.modules)
    for module in named:
        tree = ast.parse(source_of(module).read_text(encoding="utf-8"))
        imported = {str(node.module) for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
        assert {name for name in imported if name.startswith("studies.") and not name.startswith("studies.frame")} <= named


@every_study
def test_other_seeds_are_other_draws(study: Study) -> None:
    one, other = (study.plan.cases(replace(study.plan.small, seed=seed, count=1), None) for seed in (1, 2))
    assert all(a.payload["recipe"]["seed"] != b.payload["recipe"]["seed"] for a, b in zip(one, other, strict=True))


def made_up(study: Study, rng: np.random.Generator, count: int) -> pd.DataFrame:
    """Rows as of an estimator whose error bars are right and twice the bound; the first flight has no measurement."""
    rows = []
    for index, case in enumerate(study.plan.cases(replace(study.plan.small, count=count), None)):
        recipe = recipe_from_dict(dict(case.payload)["recipe"], case.name)
        for labels in own_labels(study, case.payload):
            rows.append({**case.labels, **labels, **made_up_row(study, recipe.motion.frames, rng, index > 0)})
    return pd.DataFrame(rows)


def own_labels(study: Study, payload: Any) -> list[dict[str, Any]]:
    if study.name == "frame_step":
        return [{"step": step} for step in payload["steps"]]
    if study.name == "surface_fit":
        return [{"fit": fit, "fit_cpu_s": 5.0} for fit in surface_fit.FITS]
    if study.name == "two_cameras" and payload["recipe"].get("further_hsv"):
        return [{"clock_error_frames": 0.01, "clock_sigma_frames": 0.01}]
    return [{}] * (6 if study.name == "figure_4" else 1)


def made_up_row(study: Study, frames: int, rng: np.random.Generator, measured: bool) -> dict[str, Any]:
    if study.name == "figure_4":
        return {
            "particle": "p",
            "irregularity": 0.2,
            "error_deg": 10 ** rng.uniform(-2, 1),
            "rms_px": 0.2,
            "next_rms_px": 0.3,
            "cpu_s": 1.0,
        }
    row: dict[str, Any] = {"particle": "p", "irregularity": rng.uniform(0.1, 0.5), "speed_ms": 1.0, "spin_rads": 100.0, "n_frames": frames}
    row |= {"n_used": frames, "n_views": 60, "n_symmetries": 1, "status": "converged" if measured else "ambiguous", "converged": measured}
    error = {c: rng.normal(0, s) if measured else np.nan for c, s in SIGMA.items()}
    for key, components in SIZES.items():
        scale = 1.0 if key != "angular" else 100.0
        sizes = [float(np.linalg.norm([values[c] for c in components])) for values in (error, SIGMA)]
        row |= {f"{key}_{'rads' if key == 'angular' else 'ms'}": sizes[0], f"{key}_percent": 100 * sizes[0] / scale}
        row |= {f"sigma_{key}_percent": 100 * sizes[1] / scale, f"bound_{key}_percent": 100 * sizes[1] / scale}
    for c, s in SIGMA.items():
        row |= {f"pull_{c}": error[c] / s, f"true_bound_{c}": s / 2, f"over_true_bound_{c}": abs(error[c]) / (s / 2)}
    row |= {f"ellipsoid95_{name}": 1.0 for name in VECTORS} | {"mahalanobis2": 6.0, "orientation_max_deg": 0.1}
    assert set(row) == {*DESCRIBED, *SCORED, "orientation_max_deg"}
    return row | {"by_samples": True, "rms_ete_px": rng.uniform(0.1, 0.4), "cpu_s": 10.0}


def result_of(study: Study, count: int) -> Result:
    rows = made_up(study, np.random.default_rng(4), count)
    settings = {"size": "small", "seed": 1, "count": count, "bodies": "procedural"}
    return Result(study.name, settings, of_modules(study.plan.modules), {"estimator": "0" * 12}, {"tumble": "0.1.0"}, (), rows)


@every_study
@pytest.mark.parametrize("count", [2, 6])
def test_page_and_picture_are_made_of_few_rows_and_of_more(study: Study, count: int, tmp_path: Path) -> None:
    result = write_result(result_of(study, count), tmp_path)
    write_pages(study, result, tmp_path)
    page = text_of(study, result)
    assert page.startswith("# ")
    assert f"]({study.name}.png)" in page
    assert f"python -m studies {study.name} --out FOLDER --small --count {count} --seed 1" in page
    assert "nan" not in page
    assert max(len(line) for line in page.splitlines() if line[:1] not in "|!#p") <= 140
    assert 5_000 < (tmp_path / f"{study.name}.png").stat().st_size < 150_000


def test_what_is_outside_is_named_with_its_cause() -> None:
    (study,) = (study for study in STUDIES if study.name == "figure_5")
    result = result_of(study, 12)
    rows = result.rows
    rows.loc[1, ["angular_percent", "orientation_max_deg"]] = [40.0, 30.0]
    rows.loc[2, ["in_plane_percent", "sigma_in_plane_percent"]] = [3.0, 2.0]
    rows.loc[3, "out_of_plane_percent"] = 9.0
    rows.loc[4, ["out_of_plane_percent", "true_bound_vz"]] = [9.0, 0.5]
    page = text_of(study, result)
    for told in ("wrong pose", "as its error bar says", "not explained by its error bar", "physical limit", "not measured: ambiguous"):
        assert told in page


def test_equal_magnification_at_every_focal_length() -> None:
    for case in depth.cases(replace(depth.PLAN.full, count=1), None):
        hsv = recipe_from_dict(dict(case.payload)["recipe"], case.name).hsv
        image = hsv.focal_mm * 1e-3 * hsv.distance_m / (hsv.distance_m - hsv.focal_mm * 1e-3)
        assert image / hsv.distance_m == pytest.approx(depth.MAGNIFICATION)


def test_steps_share_the_middle_of_the_recording() -> None:
    for settings in (frame_step.PLAN.small, frame_step.PLAN.full):
        middle = (settings.frames - 1) // 2
        for step in settings.steps:
            kept = np.arange(settings.frames)[::step]
            assert kept[(len(kept) - 1) // 2] == middle
            assert kept[-1] == settings.frames - 1


def test_variations_of_optics_change_one_thing_each() -> None:
    cases = optics.cases(replace(optics.PLAN.small, count=1), None)
    base, *others = (dict(case.payload)["recipe"] for case in cases)
    for recipe in others:
        parts = {key for key in recipe if recipe[key] != base[key]}
        assert len(parts) == 1
