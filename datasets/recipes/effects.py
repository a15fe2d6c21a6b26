"""The effects of a recipe: whether they are known and complete, and their sizes in one sequence."""

import difflib
import math
from collections.abc import Iterable, Sequence

from datasets.errors import InputError
from datasets.recipes.recipe import EffectRecipe
from datasets.recipes.synth_only import SYNTH_ONLY
from datasets.vocabulary.effects import EFFECTS, EffectEntry, Scope

KNOWN: dict[str, EffectEntry] = {**EFFECTS, **SYNTH_ONLY}
"""Everything that nature can be told to have, in the order of evaluation within each stage."""


def check_effects(effects: Sequence[EffectRecipe], sequences: int, source: str) -> None:
    """Check that every effect and parameter is known and given once, and that lists have one number per sequence.

    Raises
    ------
    InputError
        Naming ``source``, the effect, what was expected and what came.
    """
    keys = [effect.key for effect in effects]
    for k, effect in enumerate(effects):
        if effect.key not in KNOWN:
            raise InputError(f'{source}: effects[{k}].key: unknown effect "{effect.key}"; {_nearest(effect.key, KNOWN)}')
        if effect.key in keys[:k]:
            raise InputError(f'{source}: effects[{k}].key: "{effect.key}" is there twice; expected each effect once.')
        _check_parameters(effect, KNOWN[effect.key], f"{source}: effects[{k}] ({effect.key})")
        for name, value in effect.values.items():
            _check_value(value, KNOWN[effect.key], sequences, f"{source}: effects[{k}] ({effect.key}): {name}")


def values_in_sequence(effect: EffectRecipe, index: int) -> dict[str, float]:
    """Every parameter of ``effect`` (catalogue's units) in sequence ``index``; what the recipe leaves out is 0.

    Raises
    ------
    InputError
        Where a list has no number for this sequence.
    """
    found = dict.fromkeys(KNOWN[effect.key].names, 0.0)
    for name, value in effect.values.items():
        if isinstance(value, tuple) and index >= len(value):
            raise InputError(f"effects ({effect.key}): {name}: expected a number for sequence {index}, came {len(value)} numbers.")
        found[name] = float(value[index] if isinstance(value, tuple) else value)
    return found


def sizes(entry: EffectEntry) -> tuple[str, ...]:
    """The parameters that say how strong an effect is: where all are 0 there is no effect."""
    return tuple(name for name in entry.names if name not in entry.searched) or entry.names


def _check_parameters(effect: EffectRecipe, entry: EffectEntry, where: str) -> None:
    for name in effect.values:
        if name not in entry.names:
            raise InputError(f'{where}: unknown parameter "{name}"; {_nearest(name, entry.names)}')
    missing = [name for name in entry.searched if name not in effect.values]
    if missing:
        raise InputError(f"{where}: expected a value for {', '.join(missing)}, came {', '.join(effect.values) or 'none'}.")


def _check_value(value: float | tuple[float, ...], entry: EffectEntry, sequences: int, where: str) -> None:
    if isinstance(value, tuple):
        if entry.scope is not Scope.SEQUENCE:
            raise InputError(f"{where}: expected one number, since all sequences share it (scope {entry.scope.value}), came a list.")
        if len(value) != sequences:
            raise InputError(f"{where}: expected a number or a list of {sequences}, one per sequence, came a list of {len(value)}.")
    for number in value if isinstance(value, tuple) else (value,):
        if not math.isfinite(number):
            raise InputError(f"{where}: expected a finite number, came {number:g}.")


def _nearest(name: str, known: Iterable[str]) -> str:
    names = list(known)
    near = difflib.get_close_matches(name, names, n=3, cutoff=0.5)
    return f"did you mean {', '.join(near)}?" if near else f"known: {', '.join(names)}."
