"""The study of merged drops: its parts count rightly, and the committed page is that of the committed figures, within acceptance."""

import json

import numpy as np
import pytest

from datasets.recipes.recipe import ParticleRecipe
from scripts.trials import study_shape_page
from scripts.trials.study_shape import CAMERAS, Rendered, _planted, rendered

DOCUMENT = json.loads(study_shape_page.RESULT.read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def made() -> Rendered:
    return rendered("stone", ParticleRecipe(size_mm=(6.0, 6.0)), 5, drops=2)


def test_the_page_is_that_of_the_figures() -> None:
    assert study_shape_page.PAGE.read_text(encoding="utf-8") == "\n".join(study_shape_page.page(DOCUMENT)).rstrip("\n") + "\n"


@pytest.mark.parametrize("part", ["merging", "pictures"])
def test_acceptance_of_merging_holds(part: str) -> None:
    rows = DOCUMENT[part]
    assert len(rows) == 9
    for row in rows:
        assert row["placed"] == 10
        assert row["relative_rotation_deg"]["median"] <= 0.2
        assert row["relative_rotation_deg"]["largest"] <= 1.0


def test_acceptance_of_what_does_not_belong_holds() -> None:
    found = DOCUMENT["foreign"]
    assert found["trials_of_each"] == 40
    assert min(found["named"].values()) >= 0.95 * 40
    assert found["left_out_wrongly"] <= 0.02 * found["of_views"]


def test_acceptance_of_real_outlines_holds() -> None:
    assert len(DOCUMENT["real"]) == 18
    assert all(row.get("right", True) for row in DOCUMENT["real"].values())


def test_acceptance_of_volumes_and_velocities_holds() -> None:
    convex = [row for row in DOCUMENT["volumes"] if row["convexity"] >= study_shape_page.CONVEX]
    assert max(abs(row["volume_error"]) for row in convex if row["views"] == 60) <= 0.02
    assert max(row["inertia_ratio_error"] for row in convex if row["views"] == 60) <= 0.02
    for what in ("volume", "inertia_ratio"):
        assert np.mean([abs(row[f"{what}_error"]) <= 2.0 * row[f"{what}_sigma"] for row in convex]) >= 0.9
    assert max(DOCUMENT["velocities"]["rms_merged_over_given"].values()) <= 1.3
    assert all(row["identical"] for row in DOCUMENT["known"])


def test_nothing_tells_how_the_particle_lay(made: Rendered) -> None:
    for drop, R in zip(made.drops, made.R, strict=True):
        np.testing.assert_allclose(drop.views[0].R_cam_particle, np.eye(3), atol=1e-12)
        np.testing.assert_allclose(drop.views[0].t_cam_particle, 0.0, atol=1e-15)
        assert not np.allclose(R, np.eye(3))


def test_what_is_planted_takes_one_place(made: Rendered) -> None:
    four = [*made.drops, *made.drops, made.drops[0]]
    view = _planted(four, made.drops[1], "view", 7)
    assert [a is b for a, b in zip(view, four, strict=True)] == [True, True, False, True, True]
    assert view[2].outlines[7 % CAMERAS] is made.drops[1].outlines[7 % CAMERAS]
    assert view[2].views is four[2].views
    assert _planted(four, made.drops[1], "set", 2)[2].outlines is made.drops[1].outlines
