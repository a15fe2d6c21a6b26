"""``tumble effect new``: templates and laws as plug-ins that are loaded, keep the contracts, and do what the law says; bad input."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from datasets.json_documents import write_document
from estimator.effects.empirical.families import EMPIRICAL, ForceField, ZoomInTime
from estimator.effects.empirical.law_effect import law_formula
from estimator.effects.empirical.law_terms import TERMS, Term
from estimator.effects.link import EffectModel, Moment, Setting
from estimator.effects.plug_ins import load_plug_in
from tumble.cli.main import main
from tumble.effect_writing import KINDS, effect_key
from tumble.unknowns import adapted_to

SETTING = Setting(np.arange(5) / 4000.0, 5e-5, np.array([0.0, 9.8, 0.0]), np.ones(3))
EVERY = [term.key for term in TERMS]
HELD = {"rms_px": 0.2, "errors": 100, "per_sequence_px": {"a": 0.2}}
REMOVED = {"before": HELD, "after": {**HELD, "rms_px": 0.13}, "floor_px": 0.12, "removed": 0.8}


def diagnosis(
    path: Path, terms: tuple[Term, ...] | None, *, unknown: bool = True, family: str = "smooth_force", adapted: dict[str, Any] | None = None
) -> Path:
    """A diagnosis in which a law of ``terms`` was found, each parameter 0.1 k."""
    values = [
        {"term": t.key, "parameter": p.name, "unit": p.unit, "value": 0.1 * (k + 1), "sigma": 0.01, "interval": [0.0, 1.0]}
        for t in terms or ()
        for k, p in enumerate(t.parameters)
    ]
    law: dict[str, Any] = {
        "formula": law_formula(terms or ()),
        "words": "a law",
        "terms": [{"term": t.key, "link": t.link, "words": t.words, "formula": t.formula} for t in terms or ()],
        "values": values,
        "exponents": [],
        "explained": 0.9,
        **REMOVED,
        "alternatives": [],
    }
    left = {
        "stage": "dynamics",
        "family": family,
        "adapted": adapted or {},
        "p": 1e-9,
        "families": [],
        "terms": ["force_curve"],
        **REMOVED,
        "shapes": [],
        "law": law if terms else None,
        "superfluous": [],
        "sentences": ["It sits somewhere."],
    }
    verdict = {"kind": "unknown", "sentence": "", "remarks": [], "add": [], "next": ""}
    empty = dict.fromkeys(("noise_floor", "maps", "diagnosis", "steps", "ladder"))
    told = {"verb": "explain", "source": "x", "sequences": ["a"], "left_out": {}, "model": [], "settled": True, "rms_ete_px": 0.1}
    content = {**told, **empty, "values": [], "configuration": {}, "versions": {}, "verdict": verdict}
    write_document(path, "diagnosis", {**content, "unknown": left if unknown else None})
    return path


def written(folder: Path, *words: str) -> EffectModel:
    out = folder / "mine.py"
    assert main(["effect", "new", "MyLaw", "--out", str(out), "--quiet", *words]) == 0
    return load_plug_in(f"{out}:MyLaw")


def moment() -> Moment:
    rng = np.random.default_rng(1)
    R = np.linalg.qr(rng.normal(size=(2, 3, 3)))[0]
    return Moment(0.003, rng.uniform(0.5, 1.0, (2, 3)), rng.normal(size=(2, 3)), rng.normal(size=(2, 3)), rng.normal(size=(2, 3)), R)


@pytest.mark.parametrize("key", EVERY)
def test_a_law_of_one_term_is_that_term(key: str, tmp_path: Path) -> None:
    (term,) = (t for t in TERMS if t.key == key)
    effect = written(tmp_path, "--from", str(diagnosis(tmp_path / "diagnosis.json", (term,))))
    assert effect.entry.names == tuple(p.name for p in term.parameters)
    assert effect.entry.searched == tuple(p.name for p in term.shapes)
    (start,) = effect.starts(SETTING)
    np.testing.assert_array_equal(start[: term.amplitudes], 0.0)
    np.testing.assert_allclose(start[term.amplitudes :], 0.1 * np.arange(term.amplitudes + 1, len(start) + 1))
    theta = np.tile(0.1 * np.arange(1, len(start) + 1), (2, 1))
    np.testing.assert_array_equal(getattr(effect, term.link)(theta, moment(), SETTING), term.function(theta, moment()))


def test_a_law_of_every_term_sums_forces_and_torques(tmp_path: Path) -> None:
    effect = written(tmp_path, "--from", str(diagnosis(tmp_path / "diagnosis.json", TERMS)))
    theta = np.concatenate([np.tile(0.1 * np.arange(1, len(t.parameters) + 1), (2, 1)) for t in TERMS], axis=1)
    for link in ("acceleration", "torque"):
        parts = [t.function(np.tile(0.1 * np.arange(1, len(t.parameters) + 1), (2, 1)), moment()) for t in TERMS if t.link == link]
        np.testing.assert_allclose(getattr(effect, link)(theta, moment(), SETTING), np.sum(parts, axis=0), rtol=1e-12)


def test_an_unknown_without_a_law_becomes_its_empirical_term(tmp_path: Path) -> None:
    effect = written(tmp_path, "--from", str(diagnosis(tmp_path / "diagnosis.json", None, family="zoom_in_time")))
    assert effect.entry.key == "my_law"
    assert effect.entry.names == ("z1", "z2", "z3", "z4", "z5", "z6", "z7")


def test_an_empirical_term_is_of_the_flights_it_was_found_in(tmp_path: Path) -> None:
    zoom, field = EMPIRICAL["zoom_in_time"], EMPIRICAL["force_field"]
    assert isinstance(zoom, ZoomInTime)
    assert isinstance(field, ForceField)
    found = diagnosis(tmp_path / "zoom.json", None, family="zoom_in_time", adapted=adapted_to(zoom.over(0.035)))
    (tmp_path / "a").mkdir()
    times = np.linspace(0.0, 0.035, 9)
    mine = written(tmp_path / "a", "--from", str(found))
    assert isinstance(mine, ZoomInTime)
    np.testing.assert_array_equal(mine.growth(times), zoom.over(0.035).growth(times))
    found = diagnosis(tmp_path / "field.json", None, family="force_field", adapted=adapted_to(field.about(np.array([0.1, -0.2, 0.5]))))
    there = written(tmp_path, "--from", str(found))
    assert isinstance(there, ForceField)
    np.testing.assert_array_equal(there.middle, [0.1, -0.2, 0.5])


@pytest.mark.parametrize("kind", KINDS)
def test_every_template_keeps_the_contracts(kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    written(tmp_path, "--kind", kind)
    assert main(["effect", "check", f"{tmp_path / 'mine.py'}:MyLaw", "--json"]) == 0
    kept = json.loads(capsys.readouterr().out)
    assert len(kept) == 5
    assert all(each["kept"] for each in kept)


def test_the_key_of_a_class() -> None:
    assert effect_key("MyWind2Go") == "my_wind2_go"
    assert set(asdict(KINDS["force"])) >= {"stage", "scope", "method"}


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ((), "expected a name"),
        (("My-Law", "--kind", "force"), 'got "My-Law"'),
        (("Gravity", "--kind", "force"), "is an effect of the catalogue"),
        (("MyLaw",), "got neither"),
        (("MyLaw", "--kind", "force", "--from", "diagnosis.json"), "got both"),
        (("MyLaw", "--from", "nowhere.json"), "there is no such file"),
        (("MyLaw", "--from", "nothing.json"), "nothing unknown"),
        (("MyLaw", "--kind", "force", "--out", "law.txt"), "expected the name of a Python file"),
        (("MyLaw", "--kind", "force", "--out", "there.py"), "is there already"),
    ],
)
def test_what_cannot_be_written(
    words: tuple[str, ...], sentence: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    diagnosis(Path("nothing.json"), None, unknown=False)
    Path("there.py").write_text("mine\n", encoding="utf-8")
    assert main(["effect", "new", *words]) == 2
    assert sentence in capsys.readouterr().err
    assert Path("there.py").read_text(encoding="utf-8") == "mine\n"
    assert not Path("my_law.py").exists()


HOSTILE = 'a"""\nimport os; os.remove("victim")\n"""\\'


def everywhere(value: Any, text: str) -> Any:
    """The same document with ``text`` in place of every sentence."""
    if isinstance(value, dict):
        return {key: everywhere(each, text) if key not in KNOWN_WORDS else each for key, each in value.items()}
    if isinstance(value, list):
        return [everywhere(each, text) for each in value]
    return text if isinstance(value, str) else value


KNOWN_WORDS = {"verb", "kind", "term", "parameter", "family", "link", "terms", "stage", "format", "sha256"}


@pytest.mark.parametrize("terms", [None, TERMS[:3]])
def test_no_text_of_a_diagnosis_gets_into_the_file(terms: tuple[Term, ...] | None, tmp_path: Path) -> None:
    kept = {"schema_version"}
    document = json.loads(diagnosis(tmp_path / "plain.json", terms, family="zoom_in_time").read_text(encoding="utf-8"))
    content = {k: v for k, v in everywhere(document, HOSTILE).items() if k not in kept | {"format", "sha256"}}
    if terms is not None:
        content["unknown"]["law"]["terms"] = [
            {**entry, **dict.fromkeys(("words", "formula"), HOSTILE)} for entry in document["unknown"]["law"]["terms"]
        ]
    write_document(tmp_path / "hostile.json", "diagnosis", content)
    (tmp_path / "plain").mkdir()
    (tmp_path / "hostile").mkdir()
    texts = []
    for name in ("plain", "hostile"):
        written(tmp_path / name, "--from", str(tmp_path / f"{name}.json"))
        texts.append((tmp_path / name / "mine.py").read_text(encoding="utf-8").replace(str(tmp_path / name), ""))
    assert "victim" not in texts[1]
    assert texts[0] == texts[1]


@pytest.mark.parametrize("name", ['it"""s.py', "back\\slash.py", "new\nline.py"])
def test_the_name_of_the_file_ends_no_docstring(name: str, tmp_path: Path) -> None:
    assert main(["effect", "new", "MyLaw", "--kind", "force", "--out", str(tmp_path / name), "--quiet"]) == 0
    assert load_plug_in(f"{tmp_path / name}:MyLaw").entry.key == "my_law"


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"law": None, "family": "os.remove"}, "expected a family of"),
        ({"law": None, "family": "zoom_in_time", "adapted": {"length_s": float("nan")}}, "at $.unknown.adapted.length_s: expected number"),
    ],
)
def test_what_is_not_known_is_refused(change: dict[str, Any], sentence: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    document = json.loads(diagnosis(tmp_path / "d.json", None).read_text(encoding="utf-8"))
    content = {k: v for k, v in document.items() if k not in {"format", "schema_version", "sha256"}}
    write_document(tmp_path / "d.json", "diagnosis", {**content, "unknown": {**content["unknown"], **change}})
    assert main(["effect", "new", "MyLaw", "--from", str(tmp_path / "d.json"), "--out", str(tmp_path / "mine.py")]) == 2
    assert sentence in capsys.readouterr().err
    assert not (tmp_path / "mine.py").exists()
