"""Which of two models each part of an explanation is of: the most probable set's fit, or the one without what is unknown.

Values, v and omega are of the most probable set, in whose fit an empirical family stands for what is unknown. Residuals are judged
without it, or nothing would be left to see: noise floor, maps, tests and ladder are of the last model without a family.
"""

from estimator.diagnosis.explain import Explanation
from estimator.reports.campaign_reporting import EffectValue, effect_values
from tumble.campaigning import Prepared
from tumble.diagnosis_documents import keys_of
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
