"""``tumble effect``: the catalogue, its page, and contracts of an effect of one's own."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from datasets.observation_files import write_observation
from datasets.recipes.recipe import RigRecipe
from datasets.vocabulary.effects import EFFECTS
from synth.sequence import build_silhouette_sequence
from tests.estimator import small_campaign
from tests.tumble.test_campaign_verbs import WIND
from tumble.cli.main import main
from tumble.effect_checking import check_effect
from tumble.effect_pages import COMMAND, catalogue_page

ROOT = Path(__file__).resolve().parents[2]


def test_the_page_of_the_catalogue_is_current() -> None:
    page = (ROOT / "docs" / "effects.md").read_text(encoding="utf-8")
    assert page == catalogue_page(), f"docs/effects.md is out of date; type: {COMMAND}"


def test_the_page_has_every_effect_and_parameter(tmp_path: Path) -> None:
    assert main(["effect", "list", "--write", str(tmp_path / "effects.md")]) == 0
    text = (tmp_path / "effects.md").read_text(encoding="utf-8")
    for key, entry in EFFECTS.items():
        section = text.split(f"### `{key}`")[1].split("###")[0]
        assert all(f"| `{p.name}` | {p.unit} |" in section for p in entry.parameters)


def test_list(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["effect", "list"]) == 0
    out = capsys.readouterr().out
    assert all(key in out for key in EFFECTS)
    assert main(["effect", "list", "--json"]) == 0
    assert set(json.loads(capsys.readouterr().out)) == set(EFFECTS)


def test_an_effect_on_sharpness_is_checked_on_a_recording_of_many_views(tmp_path: Path) -> None:
    """With more than 16, campaigns are of samples, without the tables of tangents that contracts are tried on."""
    seen = build_silhouette_sequence(replace(small_campaign.recipe(frames=12), rig=RigRecipe(drops=3)), 0)[0]
    write_observation(seen, tmp_path / "observations" / "many")
    assert len(seen.views) > 16
    assert [each for each in check_effect("defocus_growth", tmp_path) if not each.kept] == []


def test_check_a_plug_in(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "my_wind.py"
    path.write_text(WIND.replace("{spoilt}", ""), encoding="utf-8")
    assert main(["effect", "check", f"{path}:Wind"]) == 0
    assert "BROKEN" not in capsys.readouterr().out
    path.write_text(WIND.replace("{spoilt}", " * np.nan"), encoding="utf-8")
    assert main(["effect", "check", f"{path}:Wind", "--json"]) == 1
    found = json.loads(capsys.readouterr().out)
    assert all("not finite" in each["found"] for each in found)


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("check",), "expected an effect"),
        (("check", "gravty"), "did you mean gravity"),
        (("check", "gravity,magnus_lift"), "expected one effect to check, got 2"),
        (("check", "./nowhere.py:Wind"), "expected the Python file of an effect"),
    ],
)
def test_what_cannot_be_checked(words: tuple[str, ...], sentence: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["effect", *words]) == 2
    assert sentence in capsys.readouterr().err


HEAD = WIND.split("    def acceleration")[0]
LINK = "    def acceleration(self, theta, moment, setting):\n        "


@pytest.mark.parametrize(
    ("text", "code", "sentence"),
    [
        (f"{HEAD}{LINK}import os; os._exit(0)", 1, "BROKEN  it ends, and leaves its process alone: it ended the process that it ran in"),
        (f"{HEAD}{LINK}\n        while True: pass", 1, "BROKEN  it ends, and leaves its process alone: no answer within 1 s"),
        ("import os; os._exit(0)", 2, "expected an effect, got a file that ends its process while it is read"),
        ("while True: pass", 2, "got a file of which reading does not end: no answer within 1 s"),
    ],
)
def test_a_plug_in_that_exits_or_loops_is_caught(
    text: str, code: int, sentence: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "my_wind.py").write_text(text, encoding="utf-8")
    assert main(["effect", "check", f"{tmp_path / 'my_wind.py'}:Wind", "--limit", "1"]) == code
    said = capsys.readouterr()
    assert sentence in said.out + said.err
