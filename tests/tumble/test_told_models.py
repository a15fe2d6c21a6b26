"""Which model the parts of an explanation are of: in its documents, in its words and on its page."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from datasets.json_documents import Document, read_document
from estimator.effects.empirical.families import EMPIRICAL
from tests.estimator.measurements.trajectories.test_warped_volume import STRETCH, TWIST, tosses, warped
from tests.tumble.test_effect_writing import diagnosis
from tests.tumble.test_trajectory_verbs import write_csv
from tumble.cli.main import main
from tumble.reports.campaign_page import render
from tumble.reports.words import FAMILY_WORDS, model_words
from tumble.told_models import models_told

WARP = "something unknown (volume warp: a warp of the volume that positions are measured in)"


@pytest.fixture(scope="module")
def explained(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of ``explain`` on tosses in a volume that the tracker twists, which has the place of an acceleration of every toss."""
    folder = tmp_path_factory.mktemp("twisted")
    for trajectory in warped([trajectory for trajectory, _ in tosses(0.0)], STRETCH, TWIST):
        write_csv(trajectory, folder)
    (folder / "trajectory.toml").write_text("gravity_world = [0.0, 0.0, -9.81]\n")
    assert main(["explain", str(folder), "--out", str(folder / "out"), "-q"]) == 0
    return folder / "out"


def said_by(folder: Path, kind: str) -> Document:
    return read_document(folder / f"{kind}.json", kind)


def test_a_diagnosis_says_which_model_its_parts_are_of(explained: Path) -> None:
    found = said_by(explained, "diagnosis")
    assert "volume_warp" in found["model"]
    assert "uniform_acceleration" not in found["model"]
    assert "volume_warp" not in found["model_of_residuals"]
    assert set(found["model_of_residuals"]) == set(found["ladder"][-1]["model"]) == {step["added"] for step in found["steps"]}
    assert {value["effect"] for value in found["values"]} == set(found["model"]) - {"volume_warp"}
    assert {value["effect"] for value in found["values_in_place"]} == {"uniform_acceleration"}
    (told,) = [remark for remark in found["verdict"]["remarks"] if "without what is unknown" in remark]
    assert WARP in told


def test_values_that_are_told_in_the_unknowns_place_are_in_the_campaign_too(explained: Path) -> None:
    campaign, found = said_by(explained, "campaign"), said_by(explained, "diagnosis")
    assert campaign["values_in_place"] == found["values_in_place"] != []
    keys = {effect["key"] for effect in campaign["effects"]}
    assert "volume_warp" in keys
    assert not {value["effect"] for value in campaign["values_in_place"]} & keys
    assert {value["effect"] for value in campaign["values"]} <= keys


def test_the_page_has_both_models(explained: Path) -> None:
    page = (explained / "report.html").read_text(encoding="utf-8")
    summary = page.split('<p id="summary">')[1].split("</p>")[0]
    assert WARP in summary
    in_place = page.split('<section id="values-in-place">')[1].split("</section>")[0]
    assert "Uniform acceleration: what each sequence asks for" in in_place
    for part in ("ladder", "noise-floor", "candidates", "maps"):
        section = page.split(f'<section id="{part}">')[1].split("</section>")[0]
        assert "Of the model without what is unknown: " in section


def test_a_diagnosis_of_before_has_one_model(tmp_path: Path) -> None:
    old = read_document(diagnosis(tmp_path / "diagnosis.json", None), "diagnosis")
    assert "model_of_residuals" not in old
    page = render(old)
    assert "none (free flight under the stated gravity)" in page
    assert "without what is unknown" not in page


def at(*keys: str) -> Any:
    effects = tuple(SimpleNamespace(instrument=False, entry=SimpleNamespace(key=key)) for key in keys)
    return SimpleNamespace(fit=SimpleNamespace(model=SimpleNamespace(effects=effects)))


def test_velocities_beside_the_unknown_are_said_to_be_where_nothing_was_found() -> None:
    told: Any = SimpleNamespace(path=(at(), at("volume_warp")), last=at(), found=(), in_place=())
    assert models_told(told) == (
        f"v and ω are those beside what is unknown, of this model: {WARP}. "
        "Noise floor, maps and tests are of the model without what is unknown: free flight.",
    )


def test_values_in_the_unknowns_place_are_said_to_be_of_the_other_model() -> None:
    best, last = at("volume_warp", "gravity"), at("gravity", "uniform_acceleration")
    told: Any = SimpleNamespace(path=(best,), last=last, found=("gravity", "uniform_acceleration"), in_place=("uniform_acceleration",))
    (sentence,) = models_told(told)
    assert sentence == (
        f"Values, v and ω are those beside what is unknown, of this model: gravity, {WARP}. "
        "Noise floor, maps, tests and ladder are of the model without what is unknown: gravity, uniform acceleration. "
        "So are the values of uniform acceleration: in the first model something unknown has that place."
    )
    assert models_told(SimpleNamespace(path=(last,), last=last)) == ()  # type: ignore[arg-type]


def test_every_family_has_words() -> None:
    assert set(EMPIRICAL) <= set(FAMILY_WORDS)
    assert model_words(["image_warp@side", "gravity"]) == [
        "gravity",
        "something unknown (image warp of camera side: a warp of the picture)",
    ]
    assert model_words([]) == ["free flight"]
