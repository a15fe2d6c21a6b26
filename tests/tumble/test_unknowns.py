"""From a force that no effect of the catalogue is to a plug-in that lowers the error: document, words, report, file, contracts, ladder."""

from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from datasets.json_documents import read_document, write_document
from datasets.vocabulary.effects import EFFECTS
from estimator.appearance.effect_contracts import check_contracts
from estimator.diagnosis import empirical_fit
from estimator.diagnosis.adding import with_effect
from estimator.diagnosis.diagnose import Unknown, diagnose
from estimator.diagnosis.empirical_fit import EmpiricalFit, Removed
from estimator.diagnosis.law import Exponent
from estimator.diagnosis.selection.names import Part, UnderName
from estimator.effects.choosing import catalogue
from estimator.effects.empirical.law_terms import TERMS
from estimator.effects.plug_ins import load_plug_in
from estimator.fitting.campaigns.base_model import base_fit
from estimator.fitting.campaigns.campaign import CampaignFit
from estimator.fitting.campaigns.held_out import HeldOut, held_out
from estimator.measurements.trajectories.registering import register_trajectories
from tests.estimator.made_trajectories import Hidden, Tracker, campaign
from tests.estimator.unknown_campaigns import unknown_campaign
from tests.tumble.test_effect_writing import diagnosis
from tumble.cli.main import main
from tumble.diagnosing import not_applicable
from tumble.diagnosis_documents import Entry
from tumble.limiting import beside_words, names_sentence
from tumble.reports.campaign_page import render
from tumble.reports.verdict import Verdict, verdict_of_explanation
from tumble.unknowns import NO_LAW, _exponent_words, _of_a_few, _place, _sentences, law_command, unknown_entry, with_unknown

NAMES = ("first", "second")
LEFT = "Part of what the campaign shows is explained with gravity. Something is left that no effect of the catalogue explains."
FOUND = Verdict("found", LEFT, ("a remark",), ("gravity",))


@cache
def left() -> tuple[CampaignFit, Unknown, Entry]:
    """Shared by all tests here, so it is asked for before anything is patched."""
    registered = unknown_campaign("outgassing_thrust")
    fit = base_fit(registered.campaign, registered.start)
    rest = diagnose(registered.campaign, fit, {}).unknown
    told: list[str] = []
    entry = unknown_entry(registered.campaign, fit, rest, NAMES, told=told.append)
    assert entry is not None
    assert len(told) == 3
    return fit, rest, entry


def document(folder: Path) -> Path:
    """The entry in a diagnosis, read back as its schema has it."""
    path = diagnosis(folder / "diagnosis.json", None)
    content = {key: value for key, value in read_document(path, "diagnosis").items() if key not in ("format", "schema_version", "sha256")}
    write_document(path, "diagnosis", {**content, "sequences": list(NAMES), "unknown": left()[2]})
    return path


def test_the_document_says_stage_law_and_shapes(tmp_path: Path) -> None:
    entry = read_document(document(tmp_path), "diagnosis")["unknown"]
    assert entry["stage"] == "dynamics"
    assert entry["removed"] > 0.8
    assert entry["before"]["rms_px"] > entry["after"]["rms_px"]
    assert [t["term"] for t in entry["law"]["terms"]].count("body_fixed") == 1
    assert {shape["sequence"] for shape in entry["shapes"]} == set(NAMES)
    assert all(len(shape["value"]) == len(shape["place"]) == len(shape["sigma"]) for shape in entry["shapes"])


def test_the_words_say_stage_share_law_and_what_to_type(tmp_path: Path) -> None:
    verdict = with_unknown(FOUND, left()[2], lambda effects: f"tumble ladder data --effects {','.join(effects)}")
    assert verdict.kind == "found"
    assert verdict.sentence == LEFT.replace("is left", "is missing")
    said = " ".join(verdict.remarks)
    assert "It sits in the dynamics" in said
    assert "a thrust that is fixed to the body" in said
    assert "thrust_1 =" in said
    assert "tumble ladder data --effects gravity,./my_law.py:MyLaw" in said
    assert law_command(tmp_path).startswith(f"tumble effect new MyLaw --from {tmp_path / 'diagnosis.json'}")
    nothing = Verdict("unknown", "None of the known effects explains it.", (), ())
    assert with_unknown(nothing, left()[2], lambda _effects: "").kind == "unknown"
    assert with_unknown(nothing, None, lambda _effects: "") is nothing


def test_a_force_for_which_there_is_no_law_is_said_to_have_none(monkeypatch: pytest.MonkeyPatch) -> None:
    fit, rest, _ = left()
    monkeypatch.setattr(empirical_fit, "find_law", lambda _pooled, **_: None)
    entry = unknown_entry(unknown_campaign("outgassing_thrust").campaign, fit, rest, NAMES)
    assert entry is not None
    assert entry["law"] is None
    assert entry["sentences"][-1] == NO_LAW


def test_a_curve_that_predicts_no_better_is_not_said_to_explain() -> None:
    _, rest, entry = left()
    worse = SimpleNamespace(rms_px=2.0 * entry["before"]["rms_px"])
    found = SimpleNamespace(
        terms=[SimpleNamespace(entry=SimpleNamespace(key="force_curve"))],
        removed=SimpleNamespace(before=SimpleNamespace(rms_px=entry["before"]["rms_px"]), after=worse),
        law=None,
    )
    (said, _) = _sentences(rest, cast(EmpiricalFit, found), (), "σ")
    assert "but a force over time of no stated law would not predict what was not fitted" in said
    assert "%" not in said


def _held_out(*each: float) -> HeldOut:
    return HeldOut(tuple(np.full(10, rms**2) for rms in each), (np.ones(10),) * len(each))


def test_a_law_that_predicts_worse_than_curves_is_told_without_values() -> None:
    """Of ten shots of a ball a wall was told, with its place, that took 6 % of the excess where curves took 38 %."""
    _, rest, _ = left()
    before = SimpleNamespace(rms_px=1.06)
    law = SimpleNamespace(
        terms=[SimpleNamespace(key="towards_plane", words="an attraction along one axis")],
        removed=SimpleNamespace(before=before, after=_held_out(1.04, 1.10, 0.99), share=0.06),
        law=SimpleNamespace(exponents=()),
    )
    found = SimpleNamespace(
        terms=[SimpleNamespace(entry=SimpleNamespace(key="force_curve"))],
        removed=SimpleNamespace(before=before, after=_held_out(0.95, 0.98, 0.93), share=0.38, floor_px=0.74),
        law=law,
        described=False,
    )
    said = _sentences(rest, cast(EmpiricalFit, found), (), "σ")
    assert said[-1].startswith("No law that was tried describes it: the nearest, an attraction along one axis, brings")
    assert "simplest law" not in " ".join(said)
    assert not EmpiricalFit.described.fget(found)  # type: ignore[attr-defined]


def test_a_law_that_does_not_describe_it_is_in_no_document(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nor in the page, or in a plug-in, which are made of documents."""
    fit, rest, entry = left()
    assert entry["law"] is not None
    monkeypatch.setattr(EmpiricalFit, "described", property(lambda _self: False))
    found = unknown_entry(unknown_campaign("outgassing_thrust").campaign, fit, rest, NAMES)
    assert found is not None
    assert found["law"] is None
    assert found["superfluous"] == []
    assert "No law that was tried describes it" in found["sentences"][-1]


def test_something_unknown_that_is_not_established_is_suspected() -> None:
    entry = left()[2]
    found = Verdict(
        "found", "The campaign is explained with gravity. Something is left that no effect of the catalogue explains.", (), ("gravity",)
    )
    told = with_unknown(found, entry, lambda _effects: "tumble ladder", sure=0.91, write="tumble effect new")
    assert "To go on with what is suspected: tumble effect new, and then: tumble ladder" in told.remarks
    assert told.sentence == (
        "The campaign is explained with gravity. Suspected beside them, though not established: something that no effect of the "
        "catalogue explains (91.0%)."
    )
    alone = with_unknown(Verdict("judged", "Nothing is established.", (), ()), entry, lambda _effects: "", sure=0.91)
    assert alone.sentence == "Suspected, though not established: something that no effect of the catalogue explains (91.0%)."


def test_a_number_has_the_unknown_among_its_names_once() -> None:
    drag = UnderName((Part("linear_drag", (EFFECTS["linear_drag"].parameters[0],), np.array([0.2]), np.array([0.02])),), 0.497)
    unknown = [UnderName((Part(key, (), np.zeros(0), np.zeros(0)),), 0.25, unknown=True) for key in ("volume_warp", "force_field")]
    jitter = UnderName((Part("trigger_jitter", (), np.zeros(0), np.zeros(0)),), 0.003)
    told = names_sentence((drag, *unknown, jitter))
    assert told == (
        "One number, 3 names: linear drag rate 0.200 ± 0.020 1/s (50%) or trigger jitter (< 1%) or something that no known effect "
        "describes (50%)."
    )


def test_a_name_whose_values_are_zero_stands_for_nothing() -> None:
    def named(key: str, value: float, sigma: float, probability: float) -> UnderName:
        return UnderName((Part(key, EFFECTS[key].parameters[:1], np.array([value]), np.array([sigma])),), probability)

    clock, wind, drag = (
        named("frame_rate", 7e-3, 1e-3, 0.98),
        named("steady_wind", 0.0, 2.5e-3, 0.01),
        named("linear_drag", 0.2, 0.02, 0.01),
    )
    assert names_sentence((clock, wind)) == ""
    assert names_sentence((clock, wind, drag)).startswith("One number, 2 names: frame rate relative 0.0070 ± 0.0010 (98%) or linear drag")


def test_a_place_is_named_where_its_test_is_significant_only() -> None:
    rest = left()[1]
    assert _place(rest).startswith("It sits in the dynamics (p ")
    assert (
        _place(replace(rest, p=0.45)) == "These data do not show where it sits (most probably in the dynamics, without a significant test)"
    )


def test_what_is_probable_beside_something_unknown_is_told_with_its_values() -> None:
    lift = UnderName((Part("magnus_lift", (EFFECTS["magnus_lift"].parameters[0],), np.array([5e-4]), np.array([2e-4])),), 0.88)
    family = UnderName((Part("volume_warp", (), np.zeros(0), np.zeros(0)),), 0.97, unknown=True)
    assert beside_words([family, lift]) == (
        "In the most probable set beside what is unknown, though not established: magnus lift coefficient (5.0 ± 2.0)e-04 (88%).",
    )
    assert beside_words([family]) == ()


def explanation(*found: str, left: bool = False, sure: float = 0.99) -> Any:
    steps = [SimpleNamespace(added=key, sure=sure, established=sure > 0.95, names=()) for key in found]
    return SimpleNamespace(found=found, steps=steps, left=SimpleNamespace(present=left), diagnosis=SimpleNamespace(probability=0.8))


def test_the_verdict_has_the_other_names_of_what_was_found() -> None:
    """Those that are not improbable, and that have a name."""

    def named(probability: float, *keys: str, unknown: bool = False) -> UnderName:
        return UnderName(tuple(Part(key, (), np.zeros(0), np.zeros(0)) for key in keys), probability, unknown)

    found = explanation("gravity")
    found.steps[0].names = (
        named(0.4, "gravity"),
        named(0.3, "quadratic_drag"),
        named(0.16, "linear_drag", "steady_wind"),
        named(0.1, "force_field", unknown=True),
        named(0.04, "frame_rate"),
    )
    last = Verdict("found", "The model misses something.", (), ("gravity",))
    assert verdict_of_explanation(last, found).sentence == (
        "The campaign is explained with gravity (or, which these data do not tell from it, quadratic drag or linear drag with steady "
        "wind). Then nothing more is missing, unless something that no known effect describes has the place of gravity (10.0%)."
    )
    found.diagnosis = SimpleNamespace(probability=0.4, findings=())
    told = verdict_of_explanation(last, found).sentence
    assert told.startswith("Part of what the campaign shows is explained with gravity (or")
    assert told.endswith("Or something that no known effect describes has the place of gravity (10.0%).")


def test_what_is_less_probable_than_something_unknown_is_not_told_as_the_explanation() -> None:
    def named(key: str, probability: float, *, unknown: bool) -> UnderName:
        return UnderName((Part(key, (), np.zeros(0), np.zeros(0)),), probability, unknown)

    last, found = Verdict("found", "The model misses something.", (), ("gravity",)), explanation("gravity", "spin_damping")
    found.steps[0].names = (named("gravity", 1.0, unknown=False),)
    found.steps[1].names = (named("spin_damping", 0.36, unknown=False), named("torque_curve", 0.64, unknown=True))
    assert verdict_of_explanation(last, found).sentence == (
        "Part of what the campaign shows is explained with gravity. Beside that is something that no known effect describes (64.0%) or, "
        "less probably, spin damping. Then nothing more is missing."
    )
    found.steps = found.steps[1:]
    assert verdict_of_explanation(last, found).sentence.startswith(
        "What is missing is something that no known effect describes (64.0%) or,"
    )


def test_what_is_left_is_told_beside_what_was_found() -> None:
    last = Verdict("found", "The model misses something. Centre of mass explains 72% of the excess.", ("a remark",), ("centre_of_mass",))
    assert verdict_of_explanation(last, explanation()) is last
    verdict = verdict_of_explanation(last, explanation("gravity", left=True))
    assert verdict.kind == "found"
    assert verdict.add == ("gravity",)
    assert verdict.sentence == LEFT
    told = with_unknown(verdict, left()[2], lambda effects: f"tumble ladder data --effects {','.join(effects)}")
    assert "entre of mass" not in told.sentence
    assert "Once that plug-in is written: tumble ladder data --effects gravity,./my_law.py:MyLaw" in told.remarks
    assert verdict_of_explanation(last, explanation("gravity")).sentence.endswith("Then nothing more is missing.")
    suspected = verdict_of_explanation(last, explanation("gravity", sure=0.8)).sentence
    assert suspected.startswith("Nothing is established. Suspected")
    assert "not established: gravity or something in its place (80.0%)" in suspected


def test_the_report_shows_curves_and_law(tmp_path: Path) -> None:
    page = render(read_document(document(tmp_path), "diagnosis"))
    section = page.split('<section id="unknown">')[1].split("</section>")[0]
    assert section.count("<svg") == len(left()[2]["shapes"]) == 8
    assert "Force, body axes, first, m/s2" in section
    assert "thrust 1" in section


def test_the_plug_in_keeps_the_contracts_and_lowers_the_error(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "my_law.py"
    assert main(["effect", "new", "MyLaw", "--from", str(document(tmp_path)), "--out", str(out)]) == 0
    assert f"tumble effect check {out}:MyLaw" in capsys.readouterr().out
    effect = load_plug_in(f"{out}:MyLaw")
    registered = unknown_campaign("outgassing_thrust")
    fit, _, entry = left()
    kept = check_contracts(effect, registered.campaign.sequences[0], registered.start.flights[0])
    assert all(each.kept for each in kept)
    at, better = with_effect(registered.campaign, fit, effect)
    after = held_out(at, better.state, better.model).rms_px
    squares = [rms**2 for rms in (entry["before"]["rms_px"], after, entry["floor_px"])]
    assert squares[0] - squares[1] > 0.8 * (squares[0] - squares[2])
    assert after == pytest.approx(entry["law"]["after"]["rms_px"], rel=0.05)


def test_where_nothing_is_left_nothing_is_said() -> None:
    fit, rest, _ = left()
    registered = unknown_campaign("outgassing_thrust")
    assert unknown_entry(registered.campaign, fit, Unknown(rest.test, 1.0, rest.tests, present=False), NAMES) is None


def test_what_is_on_trial_beside_two_names_of_one_number_is_not_listed_as_not_on_trial() -> None:
    registered = register_trajectories(campaign(8, Hidden(), Tracker(rows=20), sequences=2))
    listed = not_applicable(registered.campaign, catalogue(), ("uniform_acceleration", "frame_rate"))
    assert not {"linear_drag", "gravity", "length_scale"} & set(listed)
    assert {"rolling_shutter", "gyroscope_bias"} <= set(listed)


@pytest.mark.parametrize(("key", "friction"), [("against_spin", True), ("against_velocity", True), ("towards_point", False)])
def test_an_exponent_of_zero_is_dry_friction_where_the_law_is_against_a_motion(key: str, friction: bool) -> None:
    """A pull that does not fall with distance is none."""
    (term,) = (each for each in TERMS if each.key == key)
    said = _exponent_words(Exponent(key, term.power or "", 0.02, (0.0, 0.1), 0.0), term)
    assert ("dry friction" in said) is friction
    assert "the law takes 0" in said


def _removed(before: list[float], after: list[float]) -> Removed:
    """Curves that bring sums of squares of one row of each sequence from some to others."""
    counts = tuple(np.ones(1) for _ in before)
    return Removed(*(HeldOut(tuple(np.array([each]) for each in squares), counts) for squares in (before, after)), 0.5)


def test_sequences_that_have_most_of_an_unknown_are_named_where_they_are_few() -> None:
    names = [f"shot_{i}" for i in range(8)]
    (sentence,) = _of_a_few(_removed([1.0, 9.0, 1.0, 6.0, 1.0, 1.0, 1.0, 1.0], [1.0, 1.0, 0.5, 1.0, 1.2, 1.0, 0.5, 1.0]), names)
    assert sentence.startswith("2 of 8 sequences have 93% of that fall of the held-out error: shot_1, shot_3.")
    assert not list(_of_a_few(_removed([2.0] * 8, [1.0] * 8), names))
    assert not list(_of_a_few(_removed([1.0] * 8, [1.0] * 8), names))
    assert not list(_of_a_few(_removed([5.0, 1.0], [1.0, 1.0]), names[:2]))
