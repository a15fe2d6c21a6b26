"""What is left that no effect of the catalogue explains: fitted, as a part of ``diagnosis.json``, and in words."""

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from datasets.observation import Observation
from datasets.trajectory import Trajectory
from datasets.vocabulary.effects import Stage, in_words
from estimator.diagnosis.diagnose import ALPHA, Unknown
from estimator.diagnosis.empirical_fit import SUPERFLUOUS, EmpiricalFit, LawFit, Removed, fit_empirical
from estimator.diagnosis.empirical_shape import Shape, empirical_shapes
from estimator.diagnosis.explain import ESTABLISHED
from estimator.diagnosis.law import Exponent, Regressed
from estimator.effects.empirical.families import ForceField, ZoomInTime
from estimator.effects.empirical.law_effect import law_formula
from estimator.effects.empirical.law_terms import Term
from estimator.effects.link import EffectModel
from estimator.effects.parameter_values import Z95
from estimator.fitting.campaigns.campaign import Campaign, CampaignFit
from estimator.fitting.campaigns.wald import wald_p
from estimator.measurements.trajectories.impacts import rows_outside
from estimator.measurements.trajectories.task import TrajectoryTask
from estimator.reports.misfit_words import p_words
from tumble.commands import command
from tumble.diagnosis_documents import Entry, held_out_entry
from tumble.numbers import compact
from tumble.reports.verdict import Verdict, percent
from tumble.reports.words import FAMILY_WORDS, rms_word

PLUG_IN, CLASS = "my_law.py", "MyLaw"
NO_LAW = (
    "No law of velocity, spin, place, body axes and time predicts what was not fitted better than the model without it: the curves in the "
    "report are what is known of it."
)


def unknown_entry(
    campaign: Campaign,
    fit: CampaignFit,
    left: Unknown | None,
    names: Sequence[str],
    *,
    told: Callable[[str], None] = lambda _sentence: None,
) -> Entry | None:
    """What is left of a fit, as the document has it; ``None`` where nothing is."""
    if left is None or not left.present:
        return None
    told("no effect of the catalogue explains what is left; fitting empirical terms")
    found = fit_empirical(campaign, fit, left, told=told)
    return {
        "stage": left.stage.value,
        "family": left.test.effect.entry.key,
        "adapted": adapted_to(left.test.effect),
        "p": left.p,
        "families": [
            {
                "family": t.effect.entry.key,
                "stage": t.effect.entry.stage.value,
                "p": t.p,
                "statistic": t.statistic,
                "columns": len(t.columns),
            }
            for t in left.tests
        ],
        "terms": [effect.entry.key for effect in found.terms],
        **_removed_entry(found.removed, names),
        "shapes": [_shape_entry(shape, names) for shape in empirical_shapes(campaign, found)],
        "law": law_entry(found.law, names) if found.law is not None and found.described else None,
        "superfluous": list(superfluous(campaign, found)),
        "sentences": [
            *_sentences(left, found, superfluous(campaign, found), campaign.kind.unit),
            *_of_several(campaign, found, names),
            *_of_a_few(found.removed, names),
        ],
    }


def adapted_to(family: EffectModel) -> Entry:
    """What a family was adapted to: the time (s) that a zoom is scaled over, the place (m) that a field of force is about."""
    if isinstance(family, ZoomInTime):
        return {"length_s": family.length_s}
    return {"middle_m": [float(x) for x in family.middle]} if isinstance(family, ForceField) else {}


def superfluous(campaign: Campaign, found: EmpiricalFit) -> tuple[str, ...]:
    """Effects of the model that are compatible with zero once a law that describes what is left is in it."""
    if found.law is None or not found.described:
        return ()
    fit, covariance = found.law.fit, found.law.covariance
    free = [(e, effect) for e, effect in enumerate(fit.model.effects[:-1]) if not effect.instrument and not effect.random]
    return tuple(effect.entry.key for e, effect in free if wald_p(campaign, fit, covariance, e) > SUPERFLUOUS)


def _removed_entry(removed: Removed, names: Sequence[str]) -> Entry:
    return {
        "before": held_out_entry(removed.before, names),
        "after": held_out_entry(removed.after, names),
        "floor_px": removed.floor_px,
        "removed": removed.share,
    }


def _shape_entry(shape: Shape, names: Sequence[str]) -> Entry:
    return {
        "of": shape.of,
        "unit": shape.unit,
        "over": list(shape.over),
        "axes": list(shape.axes),
        "sequence": None if shape.sequence is None else names[shape.sequence],
        "place": shape.place,
        "value": shape.value,
        "sigma": shape.sigma,
    }


def law_entry(law: LawFit, names: Sequence[str]) -> Entry:
    """A law with its values, exponents and alternatives."""
    return {
        "formula": law_formula(law.terms),
        "words": law_words(law.terms),
        "terms": [{"term": t.key, "link": t.link, "words": t.words, "formula": t.formula} for t in law.terms],
        "values": law_values(law),
        "exponents": [_exponent_entry(e) for e in law.law.exponents if e.term in [t.key for t in law.terms]],
        "explained": law.law.explained,
        **_removed_entry(law.removed, names),
        "alternatives": [_alternative_entry(each, law.law.best) for each in law.law.alternatives],
    }


def law_values(law: LawFit) -> list[Entry]:
    """The fitted parameters of a law; an exponent that was taken for known has no standard deviation."""
    effect, part = law.fit.model.effects[-1], law.fit.model.slices[-1]
    columns = law.fit.model.layout.columns([effect.entry.key])
    sigmas = np.sqrt(np.maximum(np.diag(law.covariance.of(0, columns)), 0.0))
    of = [t.key for t in law.terms for _ in t.parameters]
    return [
        {
            "term": term,
            "parameter": p.name,
            "unit": p.unit,
            "value": float(value),
            "sigma": float(sigma),
            "interval": [float(value - Z95 * sigma), float(value + Z95 * sigma)],
        }
        for term, p, value, sigma in zip(of, effect.entry.parameters, law.fit.state.theta[0][part], sigmas, strict=True)
    ]


def _exponent_entry(e: Exponent) -> Entry:
    return {"term": e.term, "parameter": e.parameter, "best": e.best, "interval": list(e.interval), "taken": e.taken}


def _alternative_entry(each: Regressed, best: Regressed) -> Entry:
    terms = tuple(t.term for t in each.terms)
    return {
        "terms": [t.key for t in terms],
        "words": law_words(terms),
        "formula": law_formula(terms),
        "criterion": each.criterion - best.criterion,
    }


def law_words(terms: Sequence[Term]) -> str:
    """A law in words."""
    return " and ".join(t.words for t in terms)


def _sentences(left: Unknown, found: EmpiricalFit, needless: Sequence[str], unit: str) -> list[str]:
    """What was found, for people; residuals are in ``unit``."""
    rms = f"held-out RMS {rms_word(unit)}"
    words = " and ".join(FAMILY_WORDS[effect.entry.key] for effect in found.terms)
    removed = found.removed
    before, after = (f"{each.rms_px:.4f} {unit}" for each in (removed.before, removed.after))
    sits = _place(left)
    if removed.after.rms_px < removed.before.rms_px:
        said = [
            f"{sits}: with {words} of no stated law the {rms} goes from {before} to {after}, {removed.share:.0%} of the excess over the "
            f"noise floor ({removed.floor_px:.4f} {unit})."
        ]
    else:
        said = [f"{sits}, but {words} of no stated law would not predict what was not fitted: the {rms} goes from {before} to {after}."]
    law = found.law
    if law is None:
        return [*said, NO_LAW] if left.stage is Stage.DYNAMICS else said
    if not found.described:
        return [*said, _nearest_law(law, rms, unit)]
    values = ", ".join(f"{v['parameter']} = {compact(v['value'], v['sigma'])} {v['unit']}".removesuffix(" 1") for v in law_values(law))
    said.append(
        f"The simplest law for it has {len(law_values(law))} numbers, {law_words(law.terms)}: {law_formula(law.terms)} with {values}. "
        f"It brings the {rms} to {law.removed.after.rms_px:.4f} {unit} ({law.removed.share:.0%} of the excess)."
    )
    said += _exponents(law)
    others = [law_words([t.term for t in each.terms]) for each in law.law.alternatives[:MOST_OTHERS]]
    if others:
        said.append(f"These data do not rule out: {'; '.join(others)}.")
    if needless:
        said.append(f"Beside this law nothing is left for {', '.join(map(in_words, needless))}: leave it out.")
    return said


def _place(left: Unknown) -> str:
    """At which stage something unknown sits, where its test is significant."""
    if left.p < ALPHA:
        return f"It sits in the {left.stage.value} ({p_words(left.p)})"
    return f"These data do not show where it sits (most probably in the {left.stage.value}, without a significant test)"


def _nearest_law(law: LawFit, rms: str, unit: str) -> str:
    """That the best law leaves more than curves of no law do."""
    said = (
        f"No law that was tried describes it: the nearest, {law_words(law.terms)}, brings the {rms} to "
        f"{law.removed.after.rms_px:.4f} {unit} only ({law.removed.share:.0%} of the excess)."
    )
    return " ".join([said, *_exponents(law)])


def _exponents(law: LawFit) -> list[str]:
    """What is known of those of the terms that stay."""
    terms = {term.key: term for term in law.terms}
    return [_exponent_words(e, terms[e.term]) for e in law.law.exponents if e.term in terms]


def _of_several(campaign: Campaign, found: EmpiricalFit, names: Sequence[str]) -> Iterator[str]:
    """Whose the values of a law are, where there are several particles."""
    particles = len(set(campaign.particle))
    if found.described and particles > 1:
        yield f"Each of the {particles} particles has values of its own in this law; those told are of the particle of {names[0]}."


def _of_a_few(removed: Removed, names: Sequence[str]) -> Iterator[str]:
    """Which sequences have most of it, where those are a few of many."""
    pairs = zip(removed.before.squares, removed.after.squares, strict=True)
    gains = np.maximum([float(before.sum() - after.sum()) for before, after in pairs], 0.0)
    order = np.argsort(-gains)
    few = 1 + int(np.searchsorted(np.cumsum(gains[order]), MOST_OF_IT * gains.sum()))
    if gains.any() and few <= FEW * len(names):
        share = gains[order[:few]].sum() / gains.sum()
        told = [names[i] for i in order[:few].tolist()]
        yield (
            f"{few} of {len(names)} sequences have {share:.0%} of that fall of the held-out error: {', '.join(told)}. Check these "
            f"recordings first, and leave them out for once: --without {','.join(told)}"
        )


MOST_OTHERS = 3
MOST_OF_IT, FEW = 0.6, 0.25
"""Share of what held-out errors fall by, and of the sequences that have it: where fewer do, it is rather theirs than the campaign's.

By judgement."""


def _exponent_words(e: Exponent, term: Term) -> str:
    name = e.parameter.replace("_", " ")
    always = ", the same however fast: dry friction does that" if term.positive and not e.taken else ""
    return f"The {name} is {e.best:.1f} (95%: {e.interval[0]:.1f} to {e.interval[1]:.1f}); the law takes {e.taken:.3g}{always}."


def with_unknown(
    verdict: Verdict, entry: Entry | None, ladder: Callable[[Sequence[str]], str], *, sure: float = 1.0, write: str = ""
) -> Verdict:
    """The verdict with what is left beside it; ``ladder``: the command that tries effects beside those the user gave.

    ``sure``: probability, 0 to 1, that something is missing there; ``write``: the command that makes a plug-in of it.
    """
    if entry is None:
        return verdict
    opening = "Something is missing that no effect of the catalogue explains."
    if sure < ESTABLISHED:
        beside = " beside them" if verdict.kind == "found" else ""
        opening = f"Suspected{beside}, though not established: something that no effect of the catalogue explains ({percent(sure)})."
    if verdict.kind == "found":
        opening = f"{verdict.sentence.split(' Something is left')[0].split(' Then nothing')[0]} {opening}"
    kind = verdict.kind if verdict.kind == "found" else "unknown"
    kept = [key for key in verdict.add if key not in entry["superfluous"]] if verdict.kind == "found" else []
    begun = "Once that plug-in is written" if sure >= ESTABLISHED else f"To go on with what is suspected: {write}, and then"
    then = f"{begun}: {ladder([*kept, f'./{PLUG_IN}:{CLASS}'])}"
    return replace(verdict, kind=kind, sentence=opening, remarks=(*entry["sentences"], then, *verdict.remarks))


def rows_outside_words(observations: Mapping[str, Observation | Trajectory], touching: Collection[str]) -> tuple[str, ...]:
    """That a contact looks like an unknown force, too, where rows lie in no free flight of trajectories that were not cut before one."""
    outside = rows_outside([t for name, t in observations.items() if isinstance(t, Trajectory) and name not in touching])
    if not outside:
        return ()
    told = ", ".join(f"{name} ({rows})" for name, rows in list(outside.items())[:MOST_OTHERS])
    more = " and others" if len(outside) > MOST_OTHERS else ""
    return (
        f"A contact does that, too: in {len(outside)} of {len(observations)} sequences some rows fall otherwise than in one free "
        f"flight: {told}{more}. If something is touched there, cut the trajectories before it.",
    )


def spoiled_words(sequences: Iterable[object]) -> tuple[str, ...]:
    """Which rows of trajectories are set aside, since they are far off those before and after them."""
    tasks = [each for each in sequences if isinstance(each, TrajectoryTask)]
    with_some = [each for each in tasks if each.spoiled]
    if not with_some:
        return ()
    count, rows = sum(len(each.spoiled) for each in with_some), sum(len(each.times_s) for each in tasks)
    told = "; ".join(f"{each.name} at {_times(each)}" for each in with_some[:MOST_OTHERS])
    more = " and others" if len(with_some) > MOST_OTHERS else ""
    where = f"in {len(with_some)} of {len(tasks)} sequences: {told}{more}"
    return (f"Not used, as far off the rows before and after them: {count} of {rows} rows, {where}.",)


def _times(task: TrajectoryTask) -> str:
    """When the rows are that are set aside."""
    times = [f"{task.times_s[row]:.6g}" for row in sorted(task.spoiled)]
    return f"{', '.join(times[:MOST_OTHERS])}{', ...' if len(times) > MOST_OTHERS else ''} s"


def law_command(out: Path) -> str:
    """How to make a plug-in of what a diagnosis in ``out`` found."""
    return command("effect", "new", CLASS, "--from", out / "diagnosis.json", "--out", PLUG_IN)
