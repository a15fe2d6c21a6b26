"""The catalogue of effects as a page of the documentation, made from the declarations."""

from datasets.vocabulary.effects import EFFECTS, EffectEntry, Parameter, Stage
from estimator.effects.choosing import fittable
from estimator.effects.link import HOLLOW_THROUGHOUT
from estimator.effects.registry import MODELS

COMMAND = "tumble effect list --write docs/effects.md"
HEAD = f"""# The catalogue of effects

Made by `{COMMAND}`; do not edit by hand. Each effect is declared once, in
[`datasets/vocabulary/effects.py`](../datasets/vocabulary/effects.py); `synth/effects/` realises it in made-up recordings,
`estimator/effects/` as a model that can be fitted. A parameter of 0 is no effect unless its meaning says otherwise. Parameters
marked "searched" are found by a search, all others by derivatives.

An effect of your own is one Python file: `--effects gravity,./my_wind.py:Wind`; `tumble effect check ./my_wind.py:Wind` says whether
it keeps the contracts.
"""
OVERVIEW = "| effect | stage | one value per | parameters |\n| --- | --- | --- | --- |"


def catalogue_page() -> str:
    """The page's text."""
    parts = [HEAD, "\n".join([OVERVIEW, *(_line(entry) for entry in EFFECTS.values())])]
    for stage in Stage:
        entries = [entry for entry in EFFECTS.values() if entry.stage is stage]
        if entries:
            parts += [f"## {stage.value.capitalize()}", "\n\n".join(_section(entry) for entry in entries)]
    return "\n\n".join(part.strip() for part in parts) + "\n"


def _line(entry: EffectEntry) -> str:
    """One effect in the overview."""
    parameters = ", ".join(f"{p.name} ({p.unit})" if p.unit != "1" else p.name for p in entry.parameters)
    return f"| [`{entry.key}`](#{entry.key}) | {entry.stage.value} | {entry.scope.value} | {parameters} |"


def _section(entry: EffectEntry) -> str:
    """One effect: meaning, table of its parameters, source."""
    fitted = (
        "" if entry.key in fittable() else " It is known in made-up recordings only, or as a variance: it is not fitted as a parameter."
    )
    rows = "\n".join(_row(p, entry) for p in entry.parameters)
    return (
        f"### `{entry.key}`\n\n{_sentence(entry.meaning)} One value per {entry.scope.value}.{fitted}\n\n"
        f"| parameter | unit | plausible | meaning |\n| --- | --- | --- | --- |\n{rows}\n\n"
        f"{_accuracy(entry)}Source: {entry.reference.rstrip('.')}."
    )


def _accuracy(entry: EffectEntry) -> str:
    """How far the fitted sizes may be off for the model's own sake."""
    model = MODELS.get(entry.key)
    if model is None or not model.accuracy:
        return ""
    on_spikes = f", {100 * model.accuracy_on(HOLLOW_THROUGHOUT):.0f}% on bodies with hollows" if model.accuracy_at_spikes else ""
    return f"Fitted sizes are accurate to {100 * model.accuracy:g}%{on_spikes} (one standard deviation beside that of noise).\n\n"


def _row(parameter: Parameter, entry: EffectEntry) -> str:
    low, high = parameter.plausible
    searched = " (searched)" if parameter.name in entry.searched else ""
    return f"| `{parameter.name}` | {parameter.unit} | {low:g} to {high:g} | {_cell(parameter.meaning)}{searched} |"


def _sentence(text: str) -> str:
    """Text that markdown shows as it is."""
    shown = _cell(text).rstrip(".")
    return f"{shown[0].upper() if not _formula(shown) else shown[0]}{shown[1:]}."


def _formula(text: str) -> bool:
    """Whether a text begins with an equation, in which case letters keep their size."""
    return "=" in text.split(":", maxsplit=1)[0]


def _cell(text: str) -> str:
    return text.replace("``", "`").replace("|", "\\|").replace("*", "\\*")
