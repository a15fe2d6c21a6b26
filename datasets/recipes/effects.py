"""The effects of a recipe: whether they are known and complete, and their sizes in one sequence."""

import difflib
import math
from collections.abc import Iterable, Mapping, Sequence

from datasets.errors import InputError
from datasets.recipes.recipe import EffectRecipe
from datasets.recipes.synth_only import SYNTH_ONLY
from datasets.vocabulary.contact_physics import CONTACT_PHYSICS
from datasets.vocabulary.effects import EFFECTS, FURTHER_ONLY, OF_A_CAMERA, EffectEntry

KNOWN: dict[str, EffectEntry] = {**EFFECTS, **SYNTH_ONLY}
"""Everything that nature can be told to have, in the order of evaluation within each stage."""


def check_effects(effects: Sequence[EffectRecipe], sequences: int, source: str) -> None:
    """Check that every effect and parameter is known and given once, and that lists have one number per sequence.

    Raises
    ------
    InputError
        Naming ``source``, the effect, what was expected and what came.
    """
    _check_list(effects, KNOWN, sequences, f"{source}: effects")


def check_contact_physics(options: Sequence[EffectRecipe], sequences: int, source: str) -> None:
    """Check what is hidden in a contact as :func:`check_effects` checks effects; but no value may be below 0, apart from angles.

    Raises
    ------
    InputError
        Naming ``source``, the entry, what was expected and what came.
    """
    _check_list(options, CONTACT_PHYSICS, sequences, f"{source}: contact_physics")
    for k, option in enumerate(options):
        for parameter in CONTACT_PHYSICS[option.key].parameters:
            value = option.values.get(parameter.name, 0.0)
            if parameter.plausible[0] >= 0 and not (isinstance(value, float) and value >= 0):
                raise InputError(
                    f"{source}: contact_physics[{k}] ({option.key}): {parameter.name}: expected no negative number, got {value}."
                )


def of_one_camera(effects: Sequence[EffectRecipe], camera: int) -> list[EffectRecipe]:
    """The effects that are in force where a high-speed camera films, by its number from 0."""
    return [effect for effect in effects if effect.camera in (None, camera)]


def check_cameras(effects: Sequence[EffectRecipe], cameras: int, source: str) -> None:
    """Check that an effect of one camera alone is one that a camera or its clock can have, and names a camera that there is.

    Raises
    ------
    InputError
        Naming ``source``, the effect, what was expected and what came.
    """
    for k, effect in enumerate(effects):
        where = f"{source}: effects[{k}] ({effect.key}).camera"
        if effect.key in FURTHER_ONLY and not effect.camera:
            raise InputError(f"{where}: expected a number from 1, since it is of a further camera, got {effect.camera}.")
        if effect.camera is None:
            continue
        if not 0 <= effect.camera < cameras:
            raise InputError(f"{where}: expected a number from 0 to {cameras - 1}, since there are {cameras} cameras, got {effect.camera}.")
        if KNOWN[effect.key].stage not in OF_A_CAMERA:
            raise InputError(
                f"{where}: expected none, since all cameras see what it does (stage {KNOWN[effect.key].stage}), got {effect.camera}."
            )


def hidden_in_contact(options: Sequence[EffectRecipe]) -> dict[str, dict[str, float]]:
    """Every parameter (catalogue's units) of what is hidden in the contact; entries whose sizes are all 0 are left out."""
    values = {option.key: _values(option, CONTACT_PHYSICS[option.key], 0) for option in options}
    return {key: found for key, found in values.items() if any(found[name] for name in CONTACT_PHYSICS[key].sizes)}


def _check_list(effects: Sequence[EffectRecipe], known: Mapping[str, EffectEntry], sequences: int, where: str) -> None:
    keys = [(effect.key, effect.camera) for effect in effects]
    for k, effect in enumerate(effects):
        if effect.key not in known:
            raise InputError(f'{where}[{k}].key: unknown effect "{effect.key}"; {_nearest(effect.key, known)}')
        if any(effect.key == key and (effect.camera == camera or None in (effect.camera, camera)) for key, camera in keys[:k]):
            raise InputError(f'{where}[{k}].key: "{effect.key}" is there twice; expected each effect once.')
        _check_parameters(effect, known[effect.key], f"{where}[{k}] ({effect.key})")
        for name, value in effect.values.items():
            _check_value(value, known[effect.key], sequences, f"{where}[{k}] ({effect.key}): {name}")


def values_in_sequence(effect: EffectRecipe, index: int) -> dict[str, float]:
    """Every parameter of ``effect`` (catalogue's units) in sequence ``index``; what the recipe leaves out is 0.

    Raises
    ------
    InputError
        Where a list has no number for this sequence.
    """
    return _values(effect, KNOWN[effect.key], index)


def _values(effect: EffectRecipe, entry: EffectEntry, index: int) -> dict[str, float]:
    found = dict.fromkeys(entry.names, 0.0)
    for name, value in effect.values.items():
        if isinstance(value, tuple) and index >= len(value):
            raise InputError(f"effects ({effect.key}): {name}: expected a number for sequence {index}, got {len(value)} numbers.")
        found[name] = float(value[index] if isinstance(value, tuple) else value)
    return found


def _check_parameters(effect: EffectRecipe, entry: EffectEntry, where: str) -> None:
    for name in effect.values:
        if name not in entry.names:
            raise InputError(f'{where}: unknown parameter "{name}"; {_nearest(name, entry.names)}')
    missing = [name for name in entry.searched if name not in effect.values]
    if missing:
        raise InputError(f"{where}: expected a value for {', '.join(missing)}, got {', '.join(effect.values) or 'none'}.")


def _check_value(value: float | tuple[float, ...], entry: EffectEntry, sequences: int, where: str) -> None:
    if isinstance(value, tuple):
        if not entry.scope.own:
            raise InputError(f"{where}: expected one number, since all sequences share it (scope {entry.scope.value}), got a list.")
        if len(value) != sequences:
            raise InputError(f"{where}: expected a number or a list of {sequences}, one per sequence, got a list of {len(value)}.")
    for number in value if isinstance(value, tuple) else (value,):
        if not math.isfinite(number):
            raise InputError(f"{where}: expected a finite number, got {number:g}.")


def _nearest(name: str, known: Iterable[str]) -> str:
    names = list(known)
    near = difflib.get_close_matches(name, names, n=3, cutoff=0.5)
    return f"did you mean {', '.join(near)}?" if near else f"known: {', '.join(names)}."
