"""What to think of a validation, in words: which contact physics is missing, whether it can be told apart, and what to do next."""

from collections.abc import Sequence
from dataclasses import dataclass

from estimator.contact_validation.ladder import Ladder, Rung
from estimator.contact_validation.laws.models import ADDITIONS
from estimator.contact_validation.next_contacts import TOGETHER_S
from estimator.contact_validation.quantities import Contact, inconsistent

NOTHING, FOUND, ALIKE, FRICTIONLESS = "nothing missing", "found", "found, cannot be told apart", "no friction seen"
TITLES = {p.key: p.title for p in ADDITIONS}
MEANINGS = {p.key: p.meaning for p in ADDITIONS}
ADVICE = {
    "tangential_compliance": "model the contact with tangential springs (Hertz–Mindlin), or state the compliance found",
    "velocity_dependent_restitution": "state restitution as a function of speed; drops from several heights sharpen it",
    "adhesion": "add a cohesion model; slower drops would show it more",
    "plate_tilt": "measure the plate's plane anew and give it with --plate",
    "yielding_plate": "clamp the plate or use a heavier one, or give its mass to the model",
}
AT_A_BOUND = 1e-3
"""Part of a parameter's range: a value as near to an end of it lies there."""
BAD_SHARE = 0.3
"""Part of the impacts whose jumps do not belong to one contact, above which that is the first thing to check."""


@dataclass(frozen=True)
class ContactVerdict:
    """``kind`` in a word or two, the ``sentence``, the ``missing`` physics by key, ``remarks``, and what to do ``next``."""

    kind: str
    sentence: str
    missing: tuple[str, ...]
    remarks: tuple[str, ...]
    next: str


def contact_verdict(ladder: Ladder, best: str, contacts: Sequence[Contact], shared: Sequence[str]) -> ContactVerdict:
    """The verdict of a ladder; ``best``: title of the model that predicts held-out impacts best; ``shared``: by corners, not judged by."""
    remarks = (*_odd(contacts), *_shared(shared), *_at_a_bound(ladder), f"Of the models compared, {best} predicts held-out impacts best.")
    if not ladder.rungs[1].accepted and not ladder.missing:
        sentence = "These impacts do not show friction: a frictionless impulse predicts held-out impacts as well as one with friction."
        return ContactVerdict(FRICTIONLESS, sentence, (), remarks, "drop with more tangential speed or spin; then validate again")
    if not ladder.missing:
        sentence = (
            "The rigid impulse with Coulomb friction predicts held-out impacts as well as any addition to it: no contact physics is "
            f"missing that these impacts could show.{_nearest(ladder)}"
        )
        return ContactVerdict(NOTHING, sentence, (), remarks, _more(ladder))
    added = [r for r in ladder.accepted if r.key in TITLES]
    words = "; then ".join(_step(rung) for rung in added)
    rivals = [f"{TITLES[key]} does nearly as well as {TITLES[first]}" for first, keys in ladder.alike.items() for key in keys]
    told = f" These impacts cannot tell them apart: {'; '.join(rivals)}." if rivals else ""
    sentence = f"Missing from the rigid impulse with friction: {words}.{told}"
    advice = "; ".join(ADVICE[r.key] for r in added)
    return ContactVerdict(ALIKE if rivals else FOUND, sentence, ladder.missing, remarks, advice)


def _at_a_bound(ladder: Ladder) -> tuple[str, ...]:
    """Constants of the last model that lie where their search ends."""
    fitted = ladder.accepted[-1].judged.fitted
    found = [
        f"{p.name.replace('_', ' ')} = {v:.3g}"
        for p, v in zip(fitted.model.parameters, fitted.values, strict=True)
        if min(abs(v - bound) for bound in p.bounds if bound != 0.0) < AT_A_BOUND * (p.bounds[1] - p.bounds[0])
    ]
    words = "these lie where the search ends, so the impacts do not tell them" if len(found) > 1 else "it lies where the search ends"
    return (f"{', '.join(found)}: {words}; look at the plate's normal and the impacts that fit worst.",) if found else ()


def _step(rung: Rung) -> str:
    gained = rung.gained
    assert gained is not None
    fitted = rung.judged.fitted
    new = {p.name for physics in ADDITIONS if physics.key == rung.key for p in physics.parameters}
    values = ", ".join(
        f"{p.name.replace('_', ' ')} {v:.3g} ± {s:.1g}{'' if p.unit == '1' else ' ' + p.unit}"
        for p, v, s in zip(fitted.model.parameters, fitted.values, fitted.sigmas, strict=True)
        if p.name in new
    )
    score = f"held-out log score +{gained.total / 2:.1f}, chance gives {gained.chance / 2:.1f}"
    return f"{TITLES[rung.key]} ({MEANINGS[rung.key]}; {values}; {score})"


def _nearest(ladder: Ladder) -> str:
    last = ladder.rungs[-1]
    if last.gained is None or last.accepted:
        return " None fits even the impacts that it is fitted to better than chance lets one more number do."
    return (
        f" The nearest, {TITLES[last.key]}, changes the held-out log score by {last.gained.total / 2:+.1f} (95% of resampled sets of runs: "
        f"{last.gained.low / 2:.1f} to {last.gained.high / 2:.1f}; chance gives {last.gained.chance / 2:.1f})."
    )


def _more(ladder: Ladder) -> str:
    scatter = ladder.accepted[-1].judged.fitted.scatter
    scattered = f"; restitution scatters by {scatter:.3f} from impact to impact"
    return f"use these constants{scattered}. More runs, heights and tilts would show smaller effects"


def _odd(contacts: Sequence[Contact]) -> tuple[str, ...]:
    odd = inconsistent(contacts)
    if not odd:
        return ()
    many = len(odd) > BAD_SHARE * len(contacts)
    why = "several corners touched, the hull or the plate is wrong there" + (", or the particle broke" if many else "")
    return (f"The jumps of velocity and spin do not belong to one contact at the lowest corner in {', '.join(odd)}: {why}.",)


def _shared(names: Sequence[str]) -> tuple[str, ...]:
    if not names:
        return ()
    within = f"within {1e3 * TOGETHER_S:g} ms of the first"
    return (f"Another corner strikes the plate {within} in {', '.join(names)}: models of one contact are not judged by these.",)


def broken_verdict(broken: Sequence[str], runs: int) -> ContactVerdict | None:
    """The verdict where most of ``runs`` runs are of particles that broke: nothing can be said of contacts then."""
    if len(broken) < BROKEN_SHARE * runs:
        return None
    sentence = (
        f"The particle broke in {len(broken)} of {runs} runs: its pictures fit the calibrated views worse after the impact than before it. "
        "Velocities after such an impact are not those of the particle that was calibrated, so contact models are not judged by them."
    )
    following = "look at the particle, calibrate it anew, and drop it lower; runs before it broke can be validated by themselves"
    return ContactVerdict(BROKE, sentence, ("chip",), (f"Broken: {', '.join(broken)}.",), following)


BROKE = "the particle broke"
BROKEN_SHARE = 0.5
"""Share of the runs in which the particle broke, from which on that is said of all. By judgement."""
