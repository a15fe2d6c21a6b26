"""What every effect must keep, those of the catalogue and users' own: checks on one sequence at hand.

* Zero is no effect: with all parameters at zero the errors are those of the model without it.
* Its derivatives are right: the fit's columns agree with central differences of the errors over the whole chain. Tangencies may jump to the
  next vertex in between, so most of them must agree, not all.
* Shapes are kept and numbers finite, at zero and at plausible values (a plug-in's links are watched, see
  :mod:`estimator.effects.plug_ins`).
* The same arguments give the same answer, and are not changed.
* It acts: a parameter moves outlines, or else no data can find it.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from datasets.errors import InputError
from estimator.appearance.model_errors import ModelErrors, SequenceTask, model_errors
from estimator.effects.instrument.curvature_bias import CurvatureBias
from estimator.effects.link import EffectModel, Setting
from estimator.effects.model import Model, overrides
from estimator.effects.plug_ins import LINKS
from estimator.motion.flight import N_PARAMETERS, Flight

Array = NDArray[np.float64]
SAME_PX = 1e-9
"""Change of an error that counts as none: rounding of errors of some pixels."""
AGREE, MOST = 0.02, 0.9
"""Relative difference within which a derivative agrees, and the share of tangencies of which it must."""
PLAUSIBLE_SHARE = 0.2
"""Share of a plausible limit at which an effect is tried, or 50 of its steps where that is less: well seen, hardly curved. By judgement."""
INVISIBLE_PX = 1e-9
"""Movement of outlines, root mean square, that counts as none: rounding."""
OF_LINKS = ("derivatives", "it acts")
"""Contracts that an effect drawn anew in every frame cannot be held to, since it is a variance and touches no link, nor one that does
nothing to pictures by itself: what a tracker or a gyroscope reports, air that moves, or a drag that goes with the lift of others."""
BY_THEMSELVES = tuple(link for link in LINKS if link not in ("tracked", "reading", "air"))
NOTHING = "no parameter to differentiate"


@dataclass(frozen=True)
class Kept:
    """One contract: its name, whether it is kept, and what was found."""

    name: str
    kept: bool
    found: str


def check_contracts(effect: EffectModel, sequence: SequenceTask, flight: Flight) -> tuple[Kept, ...]:
    """All contracts of an effect, on one sequence and its flight; a contract that cannot be tried is not kept.

    The predicted bias of outlines is left out: it is tabulated over the angle, and fits leave its slope out of their columns.
    """
    sequence = replace(sequence, task=replace(sequence.task, bias=None))
    checks: dict[str, Check] = {
        "zero is no effect": _zero_is_no_effect,
        "the same twice": _pure,
        "finite where plausible": _finite_when_plausible,
        "derivatives": _derivatives,
        "it acts": _acts,
    }
    if effect.random or effect.of_lift or not overrides(effect, *BY_THEMSELVES):
        checks = {name: check for name, check in checks.items() if name not in OF_LINKS}
    return tuple(_tried(name, check, (effect, sequence, flight)) for name, check in checks.items())


Check = Callable[[EffectModel, SequenceTask, Flight], tuple[bool, str]]


def _tried(name: str, check: Check, at: tuple[EffectModel, SequenceTask, Flight]) -> Kept:
    try:
        found = check(*at)
    except InputError as error:
        return Kept(name, False, str(error))
    return Kept(name, *found)


def _errors(effect: EffectModel | None, theta: Array, sequence: SequenceTask, flight: Flight) -> ModelErrors:
    base = CurvatureBias()
    model = Model((base,) if effect is None else (base, effect))
    return model_errors(sequence, flight, model, np.concatenate([np.zeros(len(base.entry.parameters)), theta]))


def zeros(effect: EffectModel, setting: Setting) -> Array:
    """No effect: parameters (q,) with every amplitude at zero, searched ones where a search begins."""
    starts = effect.starts(setting)
    return starts[len(starts) // 2].astype(np.float64)


def plausible(effect: EffectModel, setting: Setting) -> Array:
    """Parameters (q,) within the plausible range, away from zero, that move outlines by no more than some pixels."""
    theta = zeros(effect, setting)
    for i, parameter in enumerate(effect.entry.parameters):
        if parameter.name in effect.entry.sizes:
            low, high = parameter.plausible
            end = high if abs(high) >= abs(low) else low
            theta[i] += np.sign(end) * min(PLAUSIBLE_SHARE * abs(end), 50.0 * parameter.step)
    return theta


def _zero_is_no_effect(effect: EffectModel, sequence: SequenceTask, flight: Flight) -> tuple[bool, str]:
    without = _errors(None, np.zeros(0), sequence, flight).e
    there = _errors(effect, zeros(effect, sequence.setting), sequence, flight).e
    largest = float(np.abs(there - without).max())
    return largest <= SAME_PX, f"at zero the errors change by at most {largest:.1e} px (allowed: {SAME_PX:.0e})"


def _pure(effect: EffectModel, sequence: SequenceTask, flight: Flight) -> tuple[bool, str]:
    theta = plausible(effect, sequence.setting)
    kept = theta.copy()
    first = _errors(effect, theta, sequence, flight).e
    again = _errors(effect, theta, sequence, flight).e
    same = bool(np.array_equal(first, again) and np.array_equal(theta, kept))
    return same, "asked twice, it answers the same" if same else "asked twice, it answers differently, or it changes its arguments"


def _finite_when_plausible(effect: EffectModel, sequence: SequenceTask, flight: Flight) -> tuple[bool, str]:
    theta = plausible(effect, sequence.setting)
    e = _errors(effect, theta, sequence, flight).e
    named = ", ".join(f"{p.name} = {value:g} {p.unit}" for p, value in zip(effect.entry.parameters, theta, strict=True))
    return bool(np.all(np.isfinite(e))), f"tried with {named}"


def _derivatives(effect: EffectModel, sequence: SequenceTask, flight: Flight) -> tuple[bool, str]:
    theta = plausible(effect, sequence.setting)
    there = _errors(effect, theta, sequence, flight)
    worst, told = 1.0, NOTHING
    for number, parameter in smooth(effect):
        change = np.zeros(len(theta))
        change[number] = parameter
        high, low = (_errors(effect, theta + sign * change, sequence, flight) for sign in (1.0, -1.0))
        share = _agreeing(there, (high, low, parameter), N_PARAMETERS + len(CurvatureBias.entry.parameters) + number)
        if share < worst or told == NOTHING:
            name = effect.entry.parameters[number].name
            worst, told = (
                share,
                f"{share:.0%} of the derivatives by {name} agree with finite differences within {AGREE:.0%} (needed: {MOST:.0%})",
            )
    return worst >= MOST, told


def smooth(effect: EffectModel) -> Iterable[tuple[int, float]]:
    """Parameters in which an effect is smooth, with a step."""
    for number, parameter in enumerate(effect.entry.parameters):
        if parameter.name in effect.entry.sizes:
            yield number, parameter.step


def _agreeing(there: ModelErrors, ends: tuple[ModelErrors, ModelErrors, float], column: int) -> float:
    """Share of tangencies, of those that stay at their vertex, at which the column is the difference quotient."""
    high, low, step = ends
    stays = (high.tangency.tangency == low.tangency.tangency)[:, :, :2] & np.repeat(there.tangency.valid[:, :, None], 2, axis=2)
    if not stays.any():
        return 0.0
    slope = (high.e - low.e)[stays] / (2.0 * step)
    stated = there.J[..., column][stays]
    size = float(np.sqrt(np.mean(slope**2)))
    return float(np.mean(np.abs(stated - slope) <= AGREE * np.abs(slope) + AGREE * size + 1e-9))


def _acts(effect: EffectModel, sequence: SequenceTask, flight: Flight) -> tuple[bool, str]:
    without = _errors(None, np.zeros(0), sequence, flight).e
    theta = plausible(effect, sequence.setting)
    moved = float(np.sqrt(np.mean((_errors(effect, theta, sequence, flight).e - without) ** 2)))
    return moved > INVISIBLE_PX, f"outlines move by {moved:.2g} px RMS"
