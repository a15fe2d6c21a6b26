"""Which effects a user wants: words become effects of the catalogue or plug-ins, and combinations that no data can resolve are refused.

Outlines and calibrated views measure everything in lengths of the particle and times of the clock, both of which velocities and spins
follow; only a known acceleration has metres and seconds of its own. Hence a frame rate and a length scale cannot be found together,
neither can be found beside a free acceleration, and neither without gravity: ``g_seen = g (1 + r)^-2 / (1 + s)``.

A second camera at a known distance sees metres too, and says which of the two scales is wrong (:mod:`estimator.diagnosis.separation`). The
refusal does not look at the cameras: one scale at a time, as long as no campaign asks for both.
"""

import difflib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from datasets.errors import InputError
from datasets.vocabulary.effects import FURTHER_ONLY, OF, OF_A_CAMERA, Scope, Stage, whose
from estimator.effects.link import EffectModel
from estimator.effects.model import overrides
from estimator.effects.plug_ins import LINKS, is_plug_in, load_plug_in
from estimator.effects.registry import MODELS

Array = NDArray[np.float64]
SCALES = ("frame_rate", "length_scale")
"""Effects that only a known acceleration can tell from velocities and spins of another size."""
FREE_ACCELERATIONS = ("gravity", "uniform_acceleration")
THROUGH_AIR = ("linear_drag", "quadratic_drag", "magnus_lift", "saturating_lift")
"""Effects by which a wind acts."""
WIND = "steady_wind"
DRAG_BY_LIFT = "induced_drag"
LIFTS = ("magnus_lift", "saturating_lift", "unmeasured_lift")
NO_GRAVITY = 1e-6
"""Size (m/s²) of a stated gravity that counts as none."""


@dataclass(frozen=True)
class Chosen:
    """An effect and the word that asked for it."""

    word: str
    effect: EffectModel


def fittable() -> dict[str, EffectModel]:
    """Those of the registry that touch a link, or that are drawn anew in every frame."""
    return {key: model for key, model in MODELS.items() if model.random or overrides(model, *LINKS)}


def catalogue(cameras: Sequence[str] = ()) -> dict[str, EffectModel]:
    """The effects that can be fitted to a campaign.

    ``cameras``: names of those of the campaign; with several, what may belong to one of them is there for each.
    """
    return in_cameras(fittable().values(), cameras)


def in_cameras(effects: Iterable[EffectModel], cameras: Sequence[str]) -> dict[str, EffectModel]:
    """Effects by key; with several ``cameras`` those of a camera for each of them, and for all alike where cameras may share the cause."""
    found = [each for effect in effects for each in _of_each(effect, cameras)]
    return {effect.entry.key: effect for effect in found}


def _of_each(effect: EffectModel, cameras: Sequence[str]) -> tuple[EffectModel, ...]:
    if effect.entry.key in FURTHER_ONLY:
        return tuple(effect.of_camera(name) for name in cameras[1:])
    if len(cameras) < 2 or not may_be_of_a_camera(effect):
        return (effect,)
    alike = () if effect.entry.stage is Stage.OPTICS else (effect,)  # no two lenses are one
    return (*alike, *(effect.of_camera(name) for name in cameras))


def may_be_of_a_camera(effect: EffectModel) -> bool:
    """Whether an effect may be one camera's, or one camera's clock's: not what belongs to the particle, nor what is a variance."""
    return effect.entry.stage in OF_A_CAMERA and effect.entry.scope is not Scope.PARTICLE and not effect.random


def chosen_effects(words: str) -> tuple[EffectModel, ...]:
    """The effects of a list with commas, ``gravity,quadratic_drag,./my_wind.py:Wind``, in its order.

    Raises
    ------
    InputError
        Where one is unknown (the nearest names are offered), there twice, or contradicts another.
    """
    chosen = [Chosen(word, _effect(word)) for word in (part.strip() for part in words.split(",")) if word]
    if not chosen:
        raise InputError(f"--effects {words!r}: expected at least one effect; `tumble effect list` shows them.")
    for number, each in enumerate(chosen):
        if each.effect.entry.key in [before.effect.entry.key for before in chosen[:number]]:
            raise InputError(f'--effects: "{each.word}" is there twice; expected each effect once.')
    # A wind is added when what it acts by is there.
    effects = tuple(each.effect for each in sorted(chosen, key=lambda each: each.effect.entry.key == WIND))
    refuse_contradictions([e.entry.key for e in effects])
    return effects


def _effect(word: str) -> EffectModel:
    if is_plug_in(word):
        return load_plug_in(word)
    key, camera = whose(word)
    if OF in word and not camera:
        raise InputError(f'--effects: "{word}": expected the name of a camera behind {OF}, got none.')
    found = fittable().get(key)
    if found is None:
        near = difflib.get_close_matches(key, fittable(), n=3, cutoff=0.4)
        offered = f"did you mean {', '.join(near)}?" if near else "`tumble effect list` shows the known ones."
        raise InputError(f'--effects: unknown effect "{key}"; {offered}')
    if camera and not may_be_of_a_camera(found):
        raise InputError(f'--effects: "{word}": expected {key} without a camera, since all cameras see what it does, got camera {camera}.')
    return found.of_camera(camera) if camera else found


def refuse_contradictions(keys: Sequence[str]) -> None:
    """Refuse effects that no data can tell apart.

    Raises
    ------
    InputError
        With the reason.
    """
    reason = excluded(keys)
    if reason is not None:
        raise InputError(f"--effects: {reason}" + (" Take one of them." if "contradict" in reason else ""))


def excluded(keys: Sequence[str]) -> str | None:
    """Why no model can have all of some effects; ``None`` where one can.

    An effect with one value per sequence is held by their scatter, so a model can have it beside what all sequences share.
    """
    of_all = [key for key in keys if not whose(key)[1]]
    return lacking(keys) or one_number([key for key in of_all if key not in MODELS or not MODELS[key].entry.scope.own])


def contradiction(keys: Sequence[str]) -> str | None:
    """Why effects do nothing together, or no data can tell them apart; ``None`` where some can."""
    return lacking(keys) or one_number(keys)


def lacking(keys: Sequence[str]) -> str | None:
    """What an effect acts through and effects lack; users' own may be that, too. ``None`` where they lack nothing."""
    for key, through, how in ((WIND, THROUGH_AIR, "acts through drag or lift"), (DRAG_BY_LIFT, LIFTS, "goes with lift")):
        if key in keys and not any(other in through or other not in MODELS for other in keys):
            return f"{key} {how} alone; expected one of {', '.join(through)} beside it."
    return None


def one_number(keys: Sequence[str]) -> str | None:
    """Why no data can tell effects apart; ``None`` where some can."""
    scales = [key for key in keys if key in SCALES]
    if len(scales) > 1:
        return (
            "frame_rate and length_scale contradict each other: both only change how large gravity looks, "
            "g (1 + r)^-2 / (1 + s), so that one number would have to give two."
        )
    free = [key for key in keys if key in FREE_ACCELERATIONS]
    if scales and free:
        return (
            f"{scales[0]} and {free[0]} contradict each other: {scales[0]} only shows in how large gravity looks, "
            f"and {free[0]} makes that free."
        )
    return None


def refuse_without_gravity(keys: Sequence[str], gravity_world: Sequence[Array]) -> None:
    """Refuse scales of time and length where no sequence has gravity: ``gravity_world`` (3,) m/s² of each.

    Raises
    ------
    InputError
        With the reason.
    """
    scales = [key for key in keys if key in SCALES]
    if scales and all(np.linalg.norm(g) < NO_GRAVITY for g in gravity_world):
        raise InputError(
            f"--effects: {scales[0]} cannot be found in force-free flight: velocities and spins scale with it, and without gravity nothing "
            "in the pictures does not. Leave it out, or state gravity in the observations."
        )
