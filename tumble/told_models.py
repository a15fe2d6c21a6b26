"""Which of two models each part of an explanation is of: the most probable set's fit, or the one without what is unknown.

Values, v and omega are of the most probable set, in whose fit an empirical family stands for what is unknown. Residuals are judged
without it, or nothing would be left to see: noise floor, maps, tests and ladder are of the last model without a family.
"""

from collections.abc import Iterator
from dataclasses import replace

from datasets.vocabulary.effects import in_words
from estimator.diagnosis.explain import ESTABLISHED, Explanation
from estimator.diagnosis.selection.groups import FACTOR
from estimator.diagnosis.selection.names import left_out
from estimator.diagnosis.selection.path import At
from estimator.fitting.campaigns.campaign_covariance import campaign_covariance
from estimator.reports.campaign_reporting import EffectValue, effect_values
from tumble.campaigning import Prepared
from tumble.diagnosis_documents import keys_of
from tumble.numbers import compact
from tumble.reports.verdict import Verdict, percent, value_words
from tumble.reports.words import model_words, names_in_words


def models_told(explanation: Explanation) -> tuple[str, ...]:
    """A sentence that says which parts are of which model; none where both are the same."""
    best, last = explanation.path[-1], explanation.last
    if best is last:
        return ()
    what, judged = ("Values, v", "Noise floor, maps, tests and ladder") if explanation.found else ("v", "Noise floor, maps and tests")
    beside = f"{what} and ω are those beside what is unknown, of this model: {', '.join(model_words(keys_of(best.fit)))}."
    without = f"{judged} are of the model without what is unknown: {', '.join(model_words(keys_of(last.fit)))}."
    return (" ".join([beside, without, *_in_place_words(explanation)]),)


def _in_place_words(explanation: Explanation) -> list[str]:
    """That some values are of the model without what is unknown."""
    names = ", ".join(map(names_in_words, explanation.in_place))
    return [f"So are the values of {names}: in the first model something unknown has that place."] if names else []


def in_place_values(explanation: Explanation, campaign: Prepared) -> tuple[EffectValue, ...]:
    """Values of what is told in the place of something unknown, by the fit without that."""
    values = effect_values(campaign.at(explanation.campaign).registered, explanation.fit, explanation.covariance)
    return tuple(value for value in values if value.effect in explanation.in_place)


def told_beside(verdict: Verdict, explanation: Explanation) -> Verdict:
    """The verdict with the effects of the catalogue that are not improbable where something unknown was found, before its other remarks."""
    if explanation.left is None or not explanation.left.present:
        return verdict
    elsewhere = {*explanation.found, *explanation.path[-1].keys, *(key for step in explanation.steps for key in step.group)}
    others = [f for f in explanation.diagnosis.findings if f.probability > 1.0 / (1.0 + FACTOR) and f.key not in elsewhere]
    told = [f"{in_words(f.key)} ({percent(f.probability)}; {value_words(f)})" for f in sorted(others, key=lambda f: -f.probability)]
    likely = (f"In its place, or beside it, may be: {', '.join(told)}.",) if told else ()
    return replace(verdict, remarks=(*likely, *verdict.remarks))


def doubtful(explanation: Explanation) -> dict[str, float]:
    """Effects of the most probable set that are not established, and the probabilities that they, or what may be in their place, are there.

    Not those that are drawn anew in every frame: they are noise, whose size the fit has read.
    """
    best = explanation.path[-1]
    known = {step.added: step.sure for step in explanation.steps if not step.established}
    beside = {each.key: each.probability for each in left_out(best, explanation.fit.model.keys) if not each.unknown}
    drawn = {effect.entry.key for effect in best.fit.model.effects if effect.random}
    return {key: p for key, p in (known | beside).items() if p < ESTABLISHED and key in best.keys and key not in drawn}


def without_suspected(explanation: Explanation, campaign: Prepared) -> Iterator[str]:
    """Values without an effect that is not established, in sentences, where they differ by more than their standard deviation."""
    best = explanation.path[-1]
    beside = [each.key for each in left_out(best, explanation.fit.model.keys) if not each.unknown and each.probability < ESTABLISHED]
    for key in (*(step.added for step in explanation.steps if not step.established), *beside):
        fewer = [at for at in explanation.path if set(at.keys) == set(best.keys) - {key}]
        if not fewer:
            continue
        here, there = ({(v.effect, v.parameter.name, v.sequence): v for v in _values(at, campaign)} for at in (best, fewer[-1]))
        moved = [v for place, v in there.items() if place in here and abs(v.value - here[place].value) > here[place].sigma]
        told = [f"{in_words(v.effect)} {v.parameter.name} {compact(v.value, v.sigma)}{_unit(v)}{_of(v)}" for v in moved]
        if told:
            yield f"Without {in_words(key)}, which is not established, values would be others: {', '.join(told)}."


def _values(at: At, campaign: Prepared) -> tuple[EffectValue, ...]:
    return effect_values(campaign.at(at.campaign).registered, at.fit, campaign_covariance(at.campaign, at.fit))


def _unit(value: EffectValue) -> str:
    return "" if value.parameter.unit == "1" else f" {value.parameter.unit}"


def _of(value: EffectValue) -> str:
    return f" of {value.sequence}" if value.sequence else ""
