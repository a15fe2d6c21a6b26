"""``compare``, ``diagnose``, ``explain``, ``ladder`` and ``estimate --effects`` from the command line: results, reports, bad input."""

import html
import json
import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from datasets.estimate import Status
from datasets.estimate_files import read_estimate
from datasets.json_documents import read_document
from datasets.observation_files import read_observation, write_observation
from datasets.recipes.recipe import EffectRecipe, Recipe
from datasets.truth_files import write_truth
from synth.sequence import build_silhouette_sequence
from tests.estimator.small_campaign import recipe
from tests.tumble.browsing import opened, serious_findings
from tumble.cli.main import main
from tumble.reports.campaign_page import render

pytestmark = pytest.mark.long

DRAG = 4.0
NAMES = ("cut_stone-0000", "cut_stone-0001")
SMALL = recipe(EffectRecipe("quadratic_drag", {"per_length": DRAG}))
WIND = """
import numpy as np
from datasets.vocabulary.effects import EffectEntry, Parameter, Scope, Stage
from estimator.effects.link import EffectModel


class Wind(EffectModel):
    entry = EffectEntry("wind", Stage.DYNAMICS, Scope.CAMPAIGN, (Parameter("push", "m/s2", (-5.0, 5.0), 1e-3, "along x"),), "push", "none")

    def acceleration(self, theta, moment, setting):
        return theta * np.array([1.0, 0.0, 0.0]){spoilt}
"""


def write(made: Recipe, folder: Path) -> Path:
    for i in range(made.sequences):
        observation, _ = build_silhouette_sequence(made, i)
        write_observation(observation, folder / "observations" / observation.name)
    return folder


@pytest.fixture(scope="module")
def dragged(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two sequences with strong drag."""
    return write(SMALL, tmp_path_factory.mktemp("dragged"))


@pytest.fixture
def verb(tmp_path: Path) -> Callable[..., int]:
    def run(name: str, source: Path, *more: str) -> int:
        return main([name, str(source), "--out", str(tmp_path / name), *more])

    return run


@pytest.fixture(scope="module")
def explained(dragged: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished run of ``explain``."""
    out = tmp_path_factory.mktemp("explained")
    assert main(["explain", str(dragged), "--out", str(out), "-q"]) == 0
    return out


@pytest.fixture(scope="module")
def compared(dragged: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished run of ``compare``."""
    out = tmp_path_factory.mktemp("compared")
    assert main(["compare", str(dragged), "--out", str(out), "-q"]) == 0
    return out


@pytest.fixture(scope="module")
def measured(dragged: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished run of ``estimate --effects``."""
    out = tmp_path_factory.mktemp("measured")
    assert main(["estimate", str(dragged), "--effects", "quadratic_drag", "--out", str(out), "-q"]) == 0
    return out


@pytest.fixture
def plug_in(tmp_path: Path) -> Callable[..., str]:
    def make(spoilt: str = "") -> str:
        path = tmp_path / "my_wind.py"
        path.write_text(WIND.replace("{spoilt}", spoilt), encoding="utf-8")
        return f"{path}:Wind"

    return make


def result(folder: Path) -> dict[str, Any]:
    return read_document(folder / "diagnosis.json", "diagnosis")


def says(capsys: pytest.CaptureFixture[str], *parts: str) -> None:
    error = capsys.readouterr().err
    assert [part for part in parts if part not in error] == [], error
    assert "Traceback" not in error


# What the verbs find


def test_diagnose_names_drag_and_its_size(
    dragged: Path, verb: Callable[..., int], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert verb("diagnose", dragged) == 0
    found = result(tmp_path / "diagnose")
    first = found["diagnosis"]["group"]
    assert found["verdict"]["kind"] == "found"
    assert "quadratic_drag" in first
    candidates = {c["effect"]: c for c in found["diagnosis"]["candidates"]}
    value = candidates["quadratic_drag"]["values"][0]
    assert value["unit"] == "1/m"
    assert abs(value["value"] - DRAG) < 4.0 * value["sigma"]
    assert value["plausible"]
    assert candidates["quadratic_drag"]["p"] < 1e-3
    assert candidates["quadratic_drag"]["share"] > 0.5
    out = capsys.readouterr().out
    assert "The model misses something" in out
    assert re.search(r"next: tumble ladder \S+ --effects (quadratic|linear)_drag", out)


def test_with_the_effect_in_the_model_nothing_is_missing(dragged: Path, verb: Callable[..., int], tmp_path: Path) -> None:
    assert verb("diagnose", dragged, "--effects", "quadratic_drag", "-q") == 0
    found = result(tmp_path / "diagnose")
    assert found["verdict"]["kind"] == "nothing missing"
    assert found["model"] == ["quadratic_drag"]
    assert "quadratic_drag" not in {c["effect"] for c in found["diagnosis"]["candidates"]}
    (value,) = found["values"]
    assert value["interval"][0] < DRAG < value["interval"][1]


def test_compare_says_that_there_is_something(dragged: Path, compared: Path, capsys: pytest.CaptureFixture[str]) -> None:
    found = result(compared)
    assert found["noise_floor"]["explainable"]
    assert {m["name"] for m in found["maps"]} >= {"time", "place", "radius", "outline_direction", "body_direction", "spin_phase", "view"}
    assert found["verdict"]["next"] == f"tumble diagnose {dragged}"
    assert main(["compare", str(dragged), "--out", str(compared), "--resume", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["verdict"] == found["verdict"]


def test_explain_adds_drag_and_writes_estimates(explained: Path) -> None:
    found = result(explained)
    assert found["steps"][0]["group"][0] == found["steps"][0]["added"]
    assert "drag" in found["steps"][0]["added"]
    assert found["steps"][0]["probability"] > 0.5
    assert found["steps"][0]["worth"] > 0.0
    assert found["steps"][0]["odds"][0] == 0.0
    assert found["begun"]["missing"]
    assert found["ladder"][1]["held_out"]["rms_px"] < found["ladder"][0]["held_out"]["rms_px"]
    assert {read_estimate(explained / f"{name}.estimate.json").name for name in NAMES} == set(NAMES)
    assert read_document(explained / "campaign.json", "campaign")["effects"][0]["key"] == "curvature_bias"


def test_the_ladder_falls(dragged: Path, verb: Callable[..., int], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for i, name in enumerate(NAMES):
        write_truth(build_silhouette_sequence(SMALL, i)[1], tmp_path / "truth" / name)
    assert verb("ladder", dragged, "--effects", "quadratic_drag", "--truth", str(tmp_path / "truth")) == 0
    rungs = result(tmp_path / "ladder")["ladder"]
    assert [rung["added"] for rung in rungs] == [None, "quadratic_drag"]
    assert rungs[1]["fitted_rms_px"] < rungs[0]["fitted_rms_px"]
    assert rungs[1]["velocity"]["v_percent"] < rungs[0]["velocity"]["v_percent"]
    assert set(rungs[0]["held_out"]["per_sequence_px"]) == set(NAMES)
    assert "+ quadratic_drag" in capsys.readouterr().out


def test_estimate_with_effects_measures_velocities(measured: Path) -> None:
    for i, name in enumerate(NAMES):
        estimate = read_estimate(measured / f"{name}.estimate.json")
        _, truth = build_silhouette_sequence(SMALL, i)
        assert estimate.status is Status.CONVERGED
        assert estimate.middle is not None
        k = (len(truth.motion.times_s) - 1) // 2
        error = np.concatenate(
            [estimate.middle.v_world - truth.motion.v_world[k], estimate.middle.omega_world - truth.motion.omega_world[k]]
        )
        assert np.all(np.abs(error) < 4.0 * np.sqrt(np.diag(estimate.middle.covariance)))
        assert estimate.parameters[-1] == "quadratic_drag.per_length"
        assert estimate.covariance.shape == (len(estimate.parameters),) * 2


def test_sequences_share_what_their_scope_says(measured: Path) -> None:
    campaign = read_document(measured / "campaign.json", "campaign")
    rows = [sequence["rows"] for sequence in campaign["sequences"]]
    assert rows[0][-1] == rows[1][-1], "sequences of one particle share its drag"
    assert set(rows[0][:12]).isdisjoint(rows[1][:12]), "each has a state of its own"
    assert np.shape(campaign["covariance"]) == (max(map(max, rows)) + 1,) * 2
    (value,) = campaign["values"]
    assert value["interval"][0] < DRAG < value["interval"][1]


def test_estimates_of_a_campaign_can_be_scored(measured: Path, tmp_path: Path) -> None:
    for i, name in enumerate(NAMES):
        write_truth(build_silhouette_sequence(SMALL, i)[1], tmp_path / "truth" / name)
    assert main(["score", str(measured), "--truth", str(tmp_path / "truth"), "--out", str(tmp_path / "scores"), "-q"]) == 0


def test_a_finished_run_is_not_done_again(dragged: Path, measured: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = (measured / "campaign.json").stat().st_mtime_ns
    again = ["estimate", str(dragged), "--out", str(measured), "-q"]
    assert main([*again, "--effects", "quadratic_drag"]) == 2
    says(capsys, "run of `tumble estimate`", "--resume", "--force")
    assert main([*again, "--effects", "gravity", "--resume"]) == 2
    says(capsys, "--resume needs the same run, but configuration.effects was 'quadratic_drag' and is now 'gravity'")
    assert main([*again, "--effects", "quadratic_drag", "--resume"]) == 0
    assert (measured / "campaign.json").stat().st_mtime_ns == before


# The report


def test_the_report_says_what_the_document_says(compared: Path) -> None:
    text = (compared / "report.html").read_text(encoding="utf-8")
    found = result(compared)
    shown = re.sub(r"\s+", " ", html.unescape(re.sub(r"<[^>]+>", "", text)))
    assert found["verdict"]["sentence"] in shown
    for entry in found["maps"]:
        assert entry["sentence"] in shown
    assert text.count('class="chart"') == len(found["maps"]) + 1
    assert not re.findall(r'(?:src|href)="(?!data:)[^#]', text), "the page would load something"
    assert "NaN" not in text
    assert "#0102" not in text, "a stand-in colour was left"


def test_the_page_can_be_used_by_everybody(compared: Path) -> None:
    with opened(compared / "report.html") as tab:
        assert serious_findings(tab) == []
        assert tab.page.locator("figure details tbody tr").count() >= len(result(compared)["maps"])


def test_the_ladder_and_candidates_are_on_the_page(explained: Path) -> None:
    text = (explained / "report.html").read_text(encoding="utf-8")
    found = result(explained)
    for candidate in found["diagnosis"]["candidates"]:
        assert candidate["effect"].replace("_", " ") in text
    assert f"{found['ladder'][0]['held_out']['rms_px']:.4f} px" in text
    assert f"<h2>{found['steps'][0]['added'].replace('_', ' ').capitalize()}" in text
    found["steps"][0]["added"] = "focal_length@Left_2"
    assert "<h2>Focal length of camera Left_2" in render(found)
    assert "Probability to be in the model" in text


# Bad input


@pytest.mark.parametrize(
    ("name", "words", "parts"),
    [
        ("estimate", ("--effects", "quadratic_drg"), ('unknown effect "quadratic_drg"', "did you mean quadratic_drag")),
        ("diagnose", ("--effects", "gravity,gravity"), ('"gravity" is there twice',)),
        ("ladder", ("--effects", "frame_rate,gravity"), ("contradict each other",)),
        ("compare", ("--effects", "frame_rate,length_scale"), ("contradict each other",)),
        ("ladder", (), ("expected --effects",)),
        ("explain", ("--effects", "gravity"), ("chooses effects itself",)),
        ("explain", ("--also", "./nowhere.py:Wind"), ("nowhere.py: expected the Python file of an effect",)),
        ("diagnose", ("--set", "hubber=3"), ("hubber", "huber")),
    ],
)
def test_words_that_are_wrong(
    dragged: Path, verb: Callable[..., int], capsys: pytest.CaptureFixture[str], name: str, words: tuple[str, ...], parts: tuple[str, ...]
) -> None:
    assert verb(name, dragged, *words) == 2
    says(capsys, *parts)


def test_a_frame_rate_in_force_free_flight(
    dragged: Path, verb: Callable[..., int], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in NAMES:
        folder = shutil.copytree(dragged / "observations" / name, tmp_path / "observations" / name)
        document = json.loads((folder / "observation.json").read_text(encoding="utf-8"))
        document["gravity_world"] = [0.0, 0.0, 0.0]
        del document["sha256"]
        (folder / "observation.json").write_text(json.dumps(document), encoding="utf-8")
    assert verb("estimate", tmp_path, "--effects", "frame_rate") == 2
    says(capsys, "frame_rate cannot be found in force-free flight")


def test_a_plug_in_joins_the_candidates(dragged: Path, verb: Callable[..., int], plug_in: Callable[..., str], tmp_path: Path) -> None:
    assert verb("diagnose", dragged, "--also", plug_in(), "-q") == 0
    assert "wind" in {c["effect"] for c in result(tmp_path / "diagnose")["diagnosis"]["candidates"]}


@pytest.mark.parametrize(
    ("spoilt", "parts"),
    [
        (" * np.nan", ("not finite", "push = ", "at frame ")),
        ("[:2]", ("array of shape", "2)")),
        (" / moment.density", ("raised AttributeError", "density", "push = ", "at frame ")),
    ],
)
def test_a_plug_in_that_misbehaves(
    dragged: Path,
    verb: Callable[..., int],
    plug_in: Callable[..., str],
    capsys: pytest.CaptureFixture[str],
    spoilt: str,
    parts: tuple[str, ...],
) -> None:
    word = plug_in(spoilt)
    assert verb("estimate", dragged, "--effects", word) == 2
    says(capsys, word, "acceleration()", *parts)


def test_a_broken_sequence_is_left_out_and_named(
    dragged: Path, verb: Callable[..., int], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in NAMES:
        shutil.copytree(dragged / "observations" / name, tmp_path / "observations" / name)
    shutil.copytree(dragged / "observations" / NAMES[0], tmp_path / "observations" / "broken")
    (tmp_path / "observations" / "broken" / "outlines_hsv.npz").write_bytes(b"not a file of outlines")
    shutil.copytree(dragged / "observations" / NAMES[0], tmp_path / "observations" / "same")
    assert verb("estimate", tmp_path, "--effects", "quadratic_drag", "-q") == 1
    says(capsys, "broken is left out", "outlines_hsv.npz", "same is left out", f"expected a name of its own, got {NAMES[0]}")
    campaign = read_document(tmp_path / "estimate" / "campaign.json", "campaign")
    assert [sequence["name"] for sequence in campaign["sequences"]] == list(NAMES)
    assert sorted(campaign["left_out"]) == ["broken", "same"]
    run = json.loads((tmp_path / "estimate" / "run.json").read_text(encoding="utf-8"))
    assert run["state"] == "finished_with_failures"
    assert sorted(failure["item"] for failure in run["failures"]) == ["broken", "same"]


def test_a_sequence_that_cannot_be_measured_is_left_out_and_named(
    dragged: Path, verb: Callable[..., int], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copytree(dragged / "observations" / NAMES[0], tmp_path / "observations" / NAMES[0])
    short, _ = build_silhouette_sequence(recipe(frames=6), 1)
    write_observation(short, tmp_path / "observations" / "short")
    assert read_observation(tmp_path / "observations" / "short").name == NAMES[1]
    assert verb("estimate", tmp_path, "--effects", "quadratic_drag", "-q") == 1
    says(capsys, f"{NAMES[1]} is left out: 6 usable pictures, at least 8 are needed")


def test_nothing_but_broken_sequences(tmp_path: Path, verb: Callable[..., int], capsys: pytest.CaptureFixture[str]) -> None:
    write(recipe(frames=6), tmp_path)
    assert verb("diagnose", tmp_path, "-q") == 2
    says(capsys, "no sequence of this campaign can be measured", *NAMES, "6 usable pictures")


def test_a_campaign_too_short_to_say_anything(tmp_path: Path, verb: Callable[..., int], capsys: pytest.CaptureFixture[str]) -> None:
    write(recipe(frames=9, sequences=1), tmp_path)
    for name, effects in (("diagnose", ()), ("compare", ()), ("ladder", ("--effects", "gravity"))):
        assert verb(name, tmp_path, *effects) == 2
        out = capsys.readouterr().out
        assert "too short to say anything" in out
        assert "It is blind to: " in out
        assert result(tmp_path / name)["verdict"]["kind"] == "says nothing"
