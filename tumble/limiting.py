"""What was stated, what limits v and omega, and a number under each of its names: as documents and in words."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from datasets.vocabulary.effects import begins, in_words
from estimator.diagnosis.selection.groups import FACTOR
from estimator.diagnosis.selection.names import Part, UnderName
from estimator.fitting.campaigns.campaign import Campaign, CampaignFit
from estimator.fitting.campaigns.facts import Fact
from estimator.fitting.campaigns.impacts import Impact, Impacts
from tumble.numbers import compact
from tumble.reports.verdict import NOTHING_KNOWN

Entry = dict[str, Any]
NAMED = 0.2
"""Share of the mean square error from which a thing is named as what limits a velocity."""
SEEN = 2.0
"""Standard deviations by which a model without an effect has to miss what is stated of it before that is said."""
ROUNDING = 1e-9
"""Of a velocity's standard deviation, what is none but for rounding."""
LEAST_SHARE = 0.01
"""Probability of a name below which its digits say nothing."""
SETTLED_BY = {
    "length_scale": "'length=100mm±0.2mm measured 98.0mm' (a length that is known and was recorded)",
    "frame_rate": "'frame_rate=0±1e-5' (a checked clock)",
    "gravity": "'gravity=9.807±0.003m/s2' (the size of gravity)",
}
"""What a user can type to state an effect; of all others its parameter."""


def fact_entries(campaign: Campaign, fit: CampaignFit) -> list[Entry]:
    """Every fact with what the fitted model has in its place."""
    return [_fact_entry(fact, fit) for fact in campaign.facts]


def facts_told(facts: Sequence[Entry]) -> list[str]:
    """A sentence for each statement; several facts of one alike are told once."""
    return list(dict.fromkeys(fact["sentence"] for fact in facts))


def _fact_entry(fact: Fact, fit: CampaignFit) -> Entry:
    theta = fit.state.theta[0]
    parts = [(fit.model.slices[fit.model.keys.index(key)], weights) for key, weights in fact.weights if key in fit.model.keys]
    model = float(sum(np.dot(weights, theta[part]) for part, weights in parts))
    misses = (model - fact.value) / fact.sigma
    found = _against(bool(parts), model, misses)
    sentence = f"Stated: {fact.words}. {begins(in_words(fact.effects[0]))}: {compact(fact.value, fact.sigma)}, {found}."
    entry = {"words": fact.words, "effects": list(fact.effects), "value": fact.value, "sigma": fact.sigma}
    return {**entry, "model": model, "misses": misses, "sentence": sentence}


def _against(there: bool, model: float, misses: float) -> str:
    """What a model says to a fact that it misses by ``misses`` standard deviations."""
    if there:
        return f"fitted {model:.3g}, {abs(misses):.1f} σ from that"
    lacks = "not in the model; v and ω are the less certain for it"
    return lacks if abs(misses) < SEEN else f"{lacks}, and the model without it is {abs(misses):.1f} σ off"


def limits_entry(found: Impacts) -> Entry:
    """What limits v and omega."""
    return {
        "things": [_thing(each, found.total) for each in found.things],
        "noise": _pair(found.noise),
        "total": _pair(found.total),
        "size": _pair(found.size),
        "sentence": limits_sentence(found),
    }


def _thing(each: Impact, total: tuple[float, float]) -> Entry:
    kind = "fitted" if each.fitted else "possible"
    return {
        "name": each.name,
        "kind": kind,
        **_pair((_rounded(each.v_ms, total[0]), _rounded(each.omega_rads, total[1]))),
        "v_before_ms": _rounded(each.v_before_ms, total[0]),
        "omega_before_rads": _rounded(each.omega_before_rads, total[1]),
    }


def _rounded(value: float, total: float) -> float:
    """None where it is that but for rounding."""
    return 0.0 if value < ROUNDING * total else value


def _pair(values: tuple[float, float]) -> Entry:
    return {"v_ms": values[0], "omega_rads": values[1]}


def limits_sentence(found: Impacts) -> str:
    """What limits v and omega, in a sentence each."""
    told = []
    for i, (letter, unit) in enumerate((("v", "m/s"), ("ω", "rad/s"))):
        total, size = found.total[i], found.size[i]
        if not np.isfinite(total):
            continue
        things = [(in_words(t.name), (t.v_ms, t.omega_rads)[i]) for t in found.things]
        ranked = sorted([*things, ("noise", found.noise[i])], key=lambda each: -each[1])
        named = [each for each in ranked if each[1] ** 2 > NAMED * total**2] or ranked[:1]
        by = ", ".join(f"{name} ({value:.2g})" for name, value in named)
        told.append(f"{letter} is known to {total:.2g} {unit}{_share(total, size)}, limited by {by}")
    return "; ".join(told) + "." if told else ""


def _share(total: float, size: float) -> str:
    return f", {total / size:.2%} of its size" if size > 0.0 else ""


def name_entries(groups: Sequence[Sequence[UnderName]]) -> list[Entry]:
    """Groups as a document has them."""
    return [{"added": group[0].key, "sentence": names_sentence(group), "names": [_name_entry(name) for name in group]} for group in groups]


def _name_entry(name: UnderName) -> Entry:
    values = [
        {"parameter": p.name, "unit": p.unit, "value": float(value), "sigma": float(sigma)}
        for part in name.parts
        for p, value, sigma in zip(part.parameters, part.mean, part.sigma, strict=True)
    ]
    return {"effect": name.key, "probability": name.probability, "unknown": name.unknown, "values": [] if name.unknown else values}


def names_sentence(group: Sequence[UnderName]) -> str:
    """A number under each of its names, and what would settle which it is; without names that are zero, which stand for nothing.

    Empty where one name alone is left.
    """
    group = [*group[:1], *(name for name in group[1:] if not _nothing(name))]
    known = [_under(name) for name in group if not name.unknown]
    unknown = sum(name.probability for name in group if name.unknown)
    names = [*known, *([f"{NOTHING_KNOWN} ({_odds(unknown)})"] if unknown else [])]
    single = [name for name in group if name.key in SETTLED_BY]
    ways = [f"{SETTLED_BY[name.key]}, to ±{_well_enough(name, group)} or better" for name in single]
    settled = f" State one of them with --known, and it is settled: {'; '.join(ways)}." if ways else ""
    return f"One number, {len(names)} names: {' or '.join(names)}.{settled}" if len(names) > 1 else ""


def _nothing(name: UnderName) -> bool:
    """Whether all values of a name are zero within their error bars."""
    values, sigmas = (np.concatenate([getattr(part, of) for part in name.parts]) for of in ("mean", "sigma"))
    return len(values) > 0 and bool(np.all(np.abs(values) <= sigmas))


def beside_words(left_out: Sequence[UnderName]) -> tuple[str, ...]:
    """What the most probable set has beside something unknown, not established, in a sentence; none where there is nothing."""
    told = [_under(name) for name in left_out if not name.unknown]
    return (f"In the most probable set beside what is unknown, though not established: {'; '.join(told)}.",) if told else ()


def settling(group: Sequence[str]) -> tuple[str, ...]:
    """What a user can state so that a group of effects is settled, in a sentence; none where there is nothing that he could."""
    ways = [SETTLED_BY[key] for key in group if key in SETTLED_BY]
    return (f"State one of them with --known, and it is settled: {'; '.join(ways)}.",) if len(group) > 1 and ways else ()


def _under(name: UnderName) -> str:
    return f"{' with '.join(_part(part) for part in name.parts)} ({_odds(name.probability)})"


def _odds(probability: float) -> str:
    return f"{probability:.0%}" if probability >= LEAST_SHARE else f"< {LEAST_SHARE:.0%}"


def _part(part: Part) -> str:
    values = ", ".join(
        f"{p.name} {compact(value, sigma)}{'' if p.unit == '1' else ' ' + p.unit}"
        for p, value, sigma in zip(part.parameters, part.mean, part.sigma, strict=True)
    )
    return " ".join([in_words(part.key), *([values] if values else [])])


def _well_enough(name: UnderName, group: Sequence[UnderName]) -> str:
    """How well it has to be known: so that none of it, or all, loses a likelihood of ``FACTOR`` beyond what the names have now."""
    lead = max(other.probability for other in group) / max(min(other.probability for other in group), 1e-12)
    (part,) = name.parts
    sigma = float(np.linalg.norm(part.mean)) / np.sqrt(2.0 * np.log(FACTOR * max(lead, 1.0)))
    unit = part.parameters[0].unit
    return f"{sigma:.2%}" if unit == "1" else f"{sigma:.2g} {unit}"
