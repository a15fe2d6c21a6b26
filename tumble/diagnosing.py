"""What the verbs on a campaign do: compare, diagnose, explain, climb a ladder; each ends in the content of one ``diagnosis.json``."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from datasets.estimate_files import write_estimate
from datasets.json_documents import Document, write_document
from datasets.observation import Observation
from datasets.trajectory import Trajectory
from datasets.vocabulary.effects import Stage, begins, in_words
from estimator.data.configuration import configuration_from_dict
from estimator.diagnosis.adding import Rung, fit_with, ladder
from estimator.diagnosis.diagnose import ALPHA, Diagnosis, Unknown, blind_to, diagnose, diagnosis_at, says_nothing, tested_values
from estimator.diagnosis.explain import ESTABLISHED, Explanation, explain
from estimator.diagnosis.noise_floor import NoiseFloor, noise_floor
from estimator.diagnosis.residual_maps import residual_maps, shown
from estimator.diagnosis.selection.names import left_out, possible_names, widened
from estimator.diagnosis.selection.testing import tests_beside
from estimator.diagnosis.separation import Separation, separations
from estimator.effects.choosing import catalogue, in_cameras
from estimator.effects.link import EffectModel
from estimator.fitting.campaigns.campaign import Campaign, CampaignFit
from estimator.fitting.campaigns.considered import Uncertain, uncertain
from estimator.fitting.campaigns.impacts import impacts
from estimator.reports.campaign_reporting import EffectValue, campaign_estimates, effect_values, settled_fit
from tumble.campaigning import Known, Prepared, contact_words, prepare, repeated_words
from tumble.commands import command
from tumble.diagnosis_documents import (
    campaign_content,
    diagnosis_entry,
    drop_entries,
    explanation_ladder,
    keys_of,
    map_entry,
    noise_floor_entry,
    rms_px,
    rung_entry,
    step_entry,
    value_entries,
    verdict_entry,
)
from tumble.implausible import ball_words, believed, checks, fall_words, gravity_words, unbelieved
from tumble.limiting import beside_words, fact_entries, limits_entry, name_entries, names_sentence, settling
from tumble.reports.map_words import sentence_of
from tumble.reports.noise_floor_words import floor_sentence
from tumble.reports.separation_words import advised
from tumble.reports.verdict import (
    EXPLAINED,
    NOT_ESTABLISHED,
    NOTHING_MORE,
    PART_EXPLAINED,
    Verdict,
    far_off,
    verdict_of,
    verdict_of_explanation,
)
from tumble.reports.words import model_words, rms_word
from tumble.result_files import estimate_path
from tumble.scattering import scattered
from tumble.told_models import doubtful, in_place_values, models_told, told_beside, without_suspected
from tumble.tracked_bodies import axes_words
from tumble.unknowns import law_command, rows_outside_words, spoiled_words, unknown_entry, with_unknown
from tumble.unseen import with_unseen
from tumble.versions import versions

DIAGNOSIS_FILE = "diagnosis.json"
CAMPAIGN_FILE = "campaign.json"
BOOTSTRAP_SEED = 20240229
MOST_TOLD = 3
Told = Callable[[str], None]
VelocityErrors = Callable[[CampaignFit, Prepared], dict[str, Any]]
STAND_IN = "a name may stand in for something that the catalogue lacks."


@dataclass(frozen=True)
class ContactJudged:
    """What the contact of drops lacks: a ``sentence``, the ``missing`` physics by key, and the command that shows ``more``, if any."""

    sentence: str
    missing: tuple[str, ...]
    more: str | None


JudgeContact = Callable[[Path, Sequence[Mapping[str, Any]], Mapping[str, Observation | Trajectory], Told], ContactJudged]
"""From the estimates in a folder, the drops among them and what was recorded, to what the contact lacks; told what is done."""


@dataclass(frozen=True)
class Question:
    """What is asked of a campaign.

    ``source`` the observations, ``configuration`` resolved, ``effects`` in the model (``words`` as the user wrote them), ``also``
    candidates beside the catalogue, ``known`` what is said of trajectories.
    """

    source: Path
    configuration: dict[str, Any]
    effects: tuple[EffectModel, ...]
    words: str
    also: tuple[EffectModel, ...] = ()
    known: Known = field(default_factory=Known)

    def candidates(self, campaign: Prepared) -> dict[str, EffectModel]:
        """Effects on trial: the catalogue and the user's own."""
        cameras = campaign.registered.campaign.cameras
        return {**catalogue(cameras), **in_cameras(self.also, cameras)}

    def command(self, verb: str, effects: Sequence[str]) -> str:
        """A command on the same observations."""
        words = ",".join([*([self.words] if self.words else []), *effects])
        return command(verb, self.source, *self.known.options, *(("--effects", words) if words else ()))


def prepared(question: Question, *, quiet: bool) -> Prepared:
    """The campaign of a question."""
    configuration = configuration_from_dict(question.configuration)
    return prepare(question.source, configuration, (*question.effects, *question.also), quiet=quiet, known=question.known)


def fitted(campaign: Prepared, effects: Sequence[EffectModel]) -> tuple[Prepared, CampaignFit]:
    """The campaign fitted with ``effects``, and as it is at that fit."""
    followed, fit = fit_with(campaign.registered.campaign, campaign.registered.start, effects)
    at = campaign.at(followed)
    return at, settled_fit(at.registered, fit)


def estimated(
    question: Question, campaign: Prepared, out: Path, *, of: Uncertain | None = None, in_place: Sequence[EffectValue] = ()
) -> Document:
    """Fit with the question's effects (or take ``of``), write an estimate per sequence and ``campaign.json``; its content.

    ``in_place``: values of what was found and the fit lacks, since something unknown has its place.
    """
    if of is None:
        campaign, fit = fitted(campaign, question.effects)
        of = uncertain(campaign.registered.campaign, fit, question.candidates(campaign))
    fit, at = of.fit, of.at
    configuration = configuration_from_dict(question.configuration)
    for estimate in campaign_estimates(campaign.registered, campaign.observations, fit, at, configuration):
        write_estimate(estimate, estimate_path(out, estimate.name))
    values = effect_values(campaign.registered, fit, of.of_values)
    content = {
        **campaign_content(campaign.registered.campaign, fit, at.fitted, values),
        "values_in_place": value_entries(in_place),
        "facts": fact_entries(campaign.registered.campaign, fit),
        "limits": limits_entry(impacts(campaign.registered.campaign, fit, at)),
        "source": str(question.source.resolve()),
        "left_out": campaign.left_out,
        "configuration": question.configuration,
        "versions": versions(),
    }
    write_document(out / CAMPAIGN_FILE, "campaign", content)
    return content


def compared(question: Question, campaign: Prepared, told: Told) -> Document:
    """Model against measurement: the noise floor, maps of the residuals, and whether any effect would fit."""
    campaign, fit = fitted(campaign, question.effects)
    registered = campaign.registered
    told("fit")
    maps = residual_maps(registered.campaign, fit)
    found = diagnose(registered.campaign, fit, question.candidates(campaign))
    told("maps and evidence")
    floor, at = _floor(registered.campaign, fit), _sure(found)
    missing = floor.explainable(*at)
    telling = [sentence_of(each) for each in shown(maps) if each.significant][:MOST_TOLD]
    none = ("No map shows where.",) if missing and not telling else ()
    judged = Verdict("judged", floor_sentence(floor, registered.campaign.kind.unit, at), (*telling, *none), ())
    verdict = _unless_too_short(found, judged, floor, campaign)
    content = _content("compare", question, campaign, uncertain(campaign.registered.campaign, fit, question.candidates(campaign)))
    return {
        **content,
        "noise_floor": noise_floor_entry(floor, registered.campaign, at),
        "maps": [map_entry(each) for each in maps],
        "verdict": _told(campaign, verdict, question.command("diagnose" if missing else "estimate", ())),
    }


def _unless_too_short(found: Diagnosis, verdict: Verdict, floor: NoiseFloor, campaign: Prepared) -> Verdict:
    """The verdict, or that the campaign is too short to say anything or the model far off, where most effects would not show in it."""
    if not says_nothing(found):
        return verdict
    short = far_off(verdict_of(found), _checks(campaign)) if floor.beyond else verdict_of(found)
    return replace(short, remarks=(*short.remarks, verdict.sentence, *verdict.remarks))


def _floor(campaign: Campaign, fit: CampaignFit) -> NoiseFloor:
    return noise_floor(campaign, fit, np.random.default_rng(BOOTSTRAP_SEED))


def diagnosed(question: Question, campaign: Prepared, out: Path, told: Told) -> Document:
    """Every effect that is not in the model on trial."""
    campaign, fit = fitted(campaign, question.effects)
    told("fit")
    found = diagnose(campaign.registered.campaign, fit, question.candidates(campaign))
    told("evidence")
    verdict = verdict_of(found)
    tests, group = [f.test for f in found.findings], [found.group]
    apart = separations(campaign.registered, fit, tests, group)[0] if verdict.kind == "found" else ()
    verdict = replace(verdict, remarks=(*verdict.remarks, *settling(found.group)))
    verdict = advised(verdict, apart, question.command("diagnose", ()))
    left = found.unknown if verdict.kind == "unknown" and campaign.misstated is None else None
    rest = None if left is None else unknown_entry(campaign.registered.campaign, fit, left, campaign.names)
    odd = not all(value.plausible for finding in found.findings if finding.key in found.missing for value in tested_values(finding.test))
    if odd or _a_force(rest):
        verdict = replace(verdict, remarks=(*_of_the_path(campaign), *verdict.remarks))
    floor = _below(_floor(campaign.registered.campaign, fit), rest)
    verdict = _beyond_noise(verdict, floor, campaign, _sure(found))
    of = uncertain(campaign.registered.campaign, fit, question.candidates(campaign))
    content = _content("diagnose", question, campaign, of)
    limits = content["limits"]
    return {
        **content,
        "limits": limits if found.missing else with_unseen(limits, campaign.registered.campaign, of, found.findings),
        "diagnosis": diagnosis_entry(found, campaign.names, apart),
        "noise_floor": noise_floor_entry(floor, campaign.registered.campaign, _sure(found)),
        "unknown": rest,
        "verdict": _told(
            campaign,
            with_unknown(verdict, rest, partial(question.command, "ladder")),
            law_command(out) if rest else _next(question, verdict),
        ),
    }


def _beyond_noise(verdict: Verdict, floor: NoiseFloor, campaign: Prepared, at: tuple[float, float]) -> Verdict:
    """The verdict, or that no known effect explains what residuals have beyond noise, where none is told for it."""
    if verdict.kind == "unknown" or not floor.beyond:
        return verdict
    told = floor_sentence(floor, campaign.registered.campaign.kind.unit, at)
    if verdict.kind == "found":
        if NOTHING_MORE not in verdict.sentence:
            return verdict
        left = f"Residuals are still {floor.reduced**0.5:.1f} times the noise, and no known effect is behind it: {STAND_IN}"
        before = verdict.sentence.partition(NOTHING_MORE)[0]
        sentence = f"{before.replace(EXPLAINED, PART_EXPLAINED)}{left}"
        return replace(verdict, sentence=sentence, remarks=(told, *verdict.remarks))
    if verdict.kind == "says nothing":
        return far_off(verdict, (told, *_checks(campaign)))
    explains = (
        "no known effect does." if verdict.kind == "nothing missing" else f"no known effect is established for it. {verdict.sentence}"
    )
    sentence = f"There is something to explain, and {explains}".replace(f" {NOT_ESTABLISHED}", "")
    ball = ball_words(campaign.observations, stated=campaign.shape_stated)
    return replace(verdict, kind="judged", sentence=sentence, remarks=(told, *ball, *verdict.remarks))


def _checks(campaign: Prepared) -> tuple[str, ...]:
    """What to check where a model is far from what was measured."""
    return tuple(checks(campaign.observations, shape_stated=campaign.shape_stated))


def _a_force(rest: Document | None) -> bool:
    """Whether what no effect explains sits in the dynamics."""
    return rest is not None and rest["stage"] == Stage.DYNAMICS.value


def _of_the_path(campaign: Prepared) -> tuple[str, ...]:
    """What in the paths themselves looks like a force: rows in no free flight, and another gravity than the stated one."""
    return (*rows_outside_words(campaign.observations, campaign.touching), *fall_words(campaign.observations))


def _below(floor: NoiseFloor, rest: Document | None) -> NoiseFloor:
    """The floor of a fit, where something unknown was found no higher than beside that: what is left of it counts as noise that repeats.

    Where more than the noise is ``allowed``, the floor beside the unknown has that in it, and says nothing of this one.
    """
    if rest is None or floor.allowed != 1.0 or not 0.0 < rest["floor_px"] < floor.floor_px:
        return floor
    more = (floor.floor_px / rest["floor_px"]) ** 2
    return replace(
        floor,
        floor_px=rest["floor_px"],
        repeated_px=floor.repeated_px / more**0.5,
        reduced=more * floor.reduced,
        interval=(more * floor.interval[0], more * floor.interval[1]),
        per_sequence=more * floor.per_sequence,
    )


def _sure(found: Diagnosis) -> tuple[float, float]:
    """Of a diagnosis, the p-value below which something is missing, and that level: the evidence decides where both differ."""
    return (min(found.p, 0.5 * ALPHA) if found.missing else max(found.p, ALPHA)), ALPHA


def _step_entries(explanation: Explanation, campaign: Prepared) -> tuple[list[Document], list[Separation]]:
    """The steps, and what would separate the groups of the effects that were found."""
    begun = explanation.begun
    tests = tests_beside(begun.trial.evidence.of)
    at = campaign.at(begun.campaign).registered
    apart = separations(at, begun.fit, tests, [step.group for step in explanation.steps])
    entries = [step_entry(step, campaign.names, each) for step, each in zip(explanation.steps, apart, strict=True)]
    return entries, [separation for each in apart for separation in each]


def _uncertain(question: Question, campaign: Prepared, explanation: Explanation) -> Uncertain:
    """The most probable set, with its uncertainty by what it considers and by what is not established in it."""
    best, registered = explanation.path[-1], campaign.registered
    names = possible_names(best, explanation.groups)
    fit = settled_fit(registered, best.fit)
    return uncertain(registered.campaign, fit, question.candidates(campaign), names, doubtful(explanation))


def explained(question: Question, campaign: Prepared, out: Path, told: Told, *, judged: JudgeContact | None = None) -> Document:
    """The whole loop; also writes the estimates of the most probable set, by which the contact of drops is ``judged``."""
    names = campaign.names
    explanation = explain(campaign.registered.campaign, campaign.registered.start, question.candidates(campaign), told=told)
    best, last = explanation.path[-1], explanation.diagnosis
    campaign = campaign.at(best.campaign)
    registered = campaign.registered
    of = _uncertain(question, campaign, explanation)
    groups = tuple(widened(group, of) for group in explanation.groups)
    in_place = in_place_values(explanation, campaign)
    written = estimated(question, campaign, out, of=of, in_place=in_place)
    named = [each.key for group in groups for each in group]
    begun = diagnosis_at(explanation.begun)
    seen = {finding.key for finding in begun.findings} - set(blind_to(begun))
    verdict = _settled(verdict_of_explanation(verdict_of(last, named=named, seen=seen), explanation), written["settled"], explanation)
    drops = drop_entries(registered.campaign)
    contact = judged(out, drops, campaign.observations, told) if judged is not None and drops and written["settled"] else None
    steps, apart = _step_entries(explanation, campaign)
    axes = (*axes_words(campaign.observations, explanation.found), *gravity_words(campaign.observations, of))
    unnamed = (*beside_words(left_out(best, explanation.fit.model.keys)), *models_told(explanation))
    said = (*filter(None, map(names_sentence, groups)), *without_suspected(explanation, campaign), *axes, *scattered(explanation), *unnamed)
    verdict = replace(verdict, remarks=(*said, *verdict.remarks, *([] if contact is None else [contact.sentence])))
    verdict = advised(verdict, apart if explanation.found else [], question.command("explain", ()))
    shown = (value for value in effect_values(registered, of.fit, of.at.plain) if value.effect in explanation.found)
    odd = unbelieved([*shown, *in_place])
    left = None if odd or campaign.misstated else explanation.left
    rest = unknown_entry(explanation.campaign, explanation.fit, left, names, told=told)
    if _a_force(rest):
        verdict = replace(verdict, remarks=(*_of_the_path(campaign), *verdict.remarks))
    floor = _below(_floor(explanation.campaign, explanation.fit), rest)
    verdict, write = _with_left(question, out, verdict, left, rest)
    verdict = _beyond_noise(told_beside(verdict, explanation), floor, campaign, _sure(last))
    told_by = believed(verdict, odd, campaign.observations)
    more = write or (contact and contact.more) or _ladder_command(question, [*explanation.noise, *explanation.found])
    content, beside = _content("explain", question, campaign, of), diagnosis_at(best, ended=True).findings
    return {
        **content,
        "limits": with_unseen(content["limits"], registered.campaign, of, beside, _single_keys(named)),
        "model_of_residuals": keys_of(explanation.fit),
        "values_in_place": value_entries(in_place),
        "names": name_entries(groups),
        "noise_floor": noise_floor_entry(floor, explanation.campaign, _sure(last)),
        "maps": [map_entry(each) for each in residual_maps(explanation.campaign, explanation.fit)],
        "begun": diagnosis_entry(begun, names),
        "diagnosis": diagnosis_entry(last, names),
        "steps": steps,
        "ladder": explanation_ladder(explanation, names),
        "unknown": rest,
        "verdict": _told(campaign, told_by, more if told_by is verdict else question.command("compare", ())),
        "contact": None if contact is None else {"sentence": contact.sentence, "missing": list(contact.missing)},
    }


def _with_left(question: Question, out: Path, verdict: Verdict, left: Unknown | None, rest: Document | None) -> tuple[Verdict, str]:
    """The verdict with what is left, and the command that writes a law for it, where it is established."""
    sure, write = 1.0 if left is None else left.sure, law_command(out)
    told = with_unknown(verdict, rest, partial(question.command, "ladder"), sure=sure, write=write)
    return told, write if rest and sure >= ESTABLISHED else ""


def climbed(question: Question, campaign: Prepared, told: Told, errors: VelocityErrors | None) -> Document:
    """The held-out error with one effect more on every rung; those of the velocities, too, where ``errors`` knows the truth."""
    rungs = list(ladder(campaign.registered.campaign, campaign.registered.start, question.effects, told=told))
    at_first = diagnose(rungs[0].campaign, rungs[0].fit, question.candidates(campaign))
    last, campaign = rungs[-1].fit, campaign.at(rungs[-1].campaign)
    registered = campaign.registered
    first, final = rungs[0].held_out.rms_px, rungs[-1].held_out.rms_px
    unit = registered.campaign.kind.unit
    sentence = (
        f"With {', '.join(e.entry.title for e in question.effects)} the RMS {rms_word(unit)} on frames and sequences that were not fitted "
        f"{'falls' if final < first else 'does not fall'}: {first:.4f} {unit} to {final:.4f} {unit} ({final / first - 1.0:+.0%})."
    )
    remarks = tuple(_useless(rung.added, question) for before, rung in pairwise(rungs) if rung.added and not _lowers(before, rung))
    content = _content("ladder", question, campaign, uncertain(campaign.registered.campaign, last, question.candidates(campaign)))
    floor = _floor(registered.campaign, last)
    verdict = Verdict("judged", sentence, remarks, ())
    if rungs[0].held_out.worse_by_chance(rungs[-1].held_out) >= ALPHA:
        verdict = _unless_too_short(at_first, verdict, floor, campaign)
    return {
        **content,
        "noise_floor": noise_floor_entry(floor, registered.campaign, (1.0, 0.0)),
        "ladder": [rung_entry(r, campaign.names, None if errors is None else errors(r.fit, campaign), registered.campaign) for r in rungs],
        "verdict": _told(campaign, verdict, question.command("diagnose", ())),
    }


def _lowers(before: Rung, rung: Rung) -> bool:
    """Whether a rung's held-out error is below that of the one before."""
    return rung.held_out.rms_px < before.held_out.rms_px


def not_applicable(campaign: Campaign, candidates: Mapping[str, EffectModel], model: Sequence[str]) -> dict[str, str]:
    """Why some candidates cannot be on trial beside the effects of a ``model``."""
    reasons = {key: campaign.kind.why_not(campaign, effect) for key, effect in candidates.items() if key not in model}
    return {key: reason for key, reason in reasons.items() if reason is not None}


def _useless(key: str, question: Question) -> str:
    """What to think of an effect that does not lower the held-out error."""
    name = begins(in_words(key))
    if any(e.random for e in question.effects if e.entry.key == key):
        return f"{name} is drawn anew in every frame: nobody can predict it, so it lowers no held-out error. What counts is its size."
    return f"{name} does not lower it: it does not belong in the model."


def _told(campaign: Prepared, verdict: Verdict, then: str) -> Document:
    """A verdict as a part of a document, with what was cut beside it; in its place what is stated wrongly, where something is."""
    if campaign.misstated is not None:
        verdict, then = Verdict("judged", campaign.misstated.sentence, (), ()), campaign.misstated.mend
    touching = (*contact_words(campaign.touching, len(campaign.observations)), *repeated_words(campaign.observations))
    spoiled = spoiled_words(campaign.registered.campaign.sequences)
    return verdict_entry(replace(verdict, remarks=(*touching, *spoiled, *verdict.remarks)), then)


def _single_keys(names: Sequence[str]) -> set[str]:
    """The effects in names, of which one may be two effects together."""
    return {key for name in names for key in name.split("+")}


def _content(verb: str, question: Question, campaign: Prepared, of: Uncertain) -> Document:
    """What every verb says."""
    fit, at = of.fit, of.at
    return {
        "verb": verb,
        "source": str(question.source.resolve()),
        "unit": campaign.registered.campaign.kind.unit,
        "not_applicable": not_applicable(campaign.registered.campaign, question.candidates(campaign), keys_of(fit)),
        "sequences": list(campaign.names),
        "drops": drop_entries(campaign.registered.campaign),
        "contact": None,
        "left_out": campaign.left_out,
        "model": keys_of(fit),
        "model_of_residuals": keys_of(fit),
        "settled": fit.settled,
        "rms_ete_px": rms_px(fit),
        "values": value_entries(effect_values(campaign.registered, fit, of.of_values)),
        "values_in_place": [],
        "facts": fact_entries(campaign.registered.campaign, fit),
        "limits": {**limits_entry(impacts(campaign.registered.campaign, fit, at)), "unseen": None},
        "names": [],
        "noise_floor": None,
        "maps": None,
        "diagnosis": None,
        "begun": None,
        "steps": None,
        "ladder": None,
        "unknown": None,
        "configuration": question.configuration,
        "versions": versions(),
    }


def _next(question: Question, verdict: Verdict) -> str:
    if verdict.kind == "found":
        return question.command("ladder", verdict.add)
    if verdict.kind == "unknown":
        return question.command("compare", ())
    return question.command("estimate", ())


def _ladder_command(question: Question, found: list[str]) -> str:
    return question.command("ladder" if found else "estimate", found)


def _settled(verdict: Verdict, settled: bool, explanation: Explanation) -> Verdict:
    """The verdict, and that no velocity is measured where the last fit did not settle."""
    if settled:
        return verdict
    names = ", ".join(model_words(keys_of(explanation.path[-1].fit)))
    sentence = f"{verdict.sentence} The fit with {names} did not settle: its velocities are not reported."
    return replace(verdict, sentence=sentence)
