"""One effect hidden, looked for with the verbs that a user has, and told at last: what ``tumble challenge hidden`` does."""

import shlex
from pathlib import Path

from datasets.recipes.recipe import EffectRecipe
from datasets.vocabulary.effects import EFFECTS
from tumble.challenge.cases import CAMPAIGNS, TRUTH, Case, campaign_folder
from tumble.challenge.drawing import Counts, Plan, Shape, Sizes, worth_a_look
from tumble.challenge.limits import LimitTable
from tumble.challenge.making import make_item, payload_of
from tumble.cli import main as command_line
from tumble.cli.console import console
from tumble.numbers import rounded
from tumble.output_directory import Run, output_directory

LOOKED_FOR = (
    ("compare", "Where does the model fail?"),
    ("diagnose", "Which effect is missing?"),
    ("explain", "Add it, and watch the error on data that were not fitted"),
)
SIZES = (2.0, 10.0)
"""Range of the effect's size over its 95% detection limit: large enough to be worth a look."""


def show_hidden(shape: Shape, seed: int, table: LimitTable, out: Path, reads: tuple[Path, ...]) -> int:
    """Hide an effect in ``out``, run the verbs of ``LOOKED_FOR`` on its campaign, and tell what was hidden.

    An earlier look in ``out`` is replaced.

    Raises
    ------
    InputError
        Where ``out`` holds something else.
    """
    run = Run("challenge hidden", {"seed": seed}, seed, reads=reads, beside=(CAMPAIGNS, *(verb for verb, _ in LOOKED_FOR)))
    with output_directory(out / TRUTH, run, resume=False, force=True):
        case = worth_a_look(Plan(shape, Counts(1, 0, 0, 0), Sizes(SIZES), table), seed)
        make_item(payload_of(case, out))
        codes = [_looked_for(verb, question, campaign_folder(out, case.name), out / verb) for verb, question in LOOKED_FOR]
    _heading("And the truth:")
    _say_truth(case)
    print(f"report: {out / 'explain' / 'report.html'}\non recordings of your own:\nnext: tumble explain OBSERVATIONS")
    return max(codes, default=0)


def _looked_for(verb: str, question: str, campaign: Path, out: Path) -> int:
    """Run a verb on the campaign; its exit code."""
    words = [verb, str(campaign), "--out", str(out)]
    _heading(f"{question}  {shlex.join(['tumble', *words])}")
    return command_line.run_verb(verb, words[1:])


def _heading(text: str) -> None:
    console().print(f"\n{text}", style="bold", soft_wrap=True)


def _say_truth(case: Case) -> None:
    for effect in case.recipe.effects:
        entry = EFFECTS[effect.key]
        times = f"{case.ratios[effect.key]:.1f} times as large as what is found in 95% of cases"
        sentence = f"hidden was {entry.title} ({entry.stage.value}): {_values(effect)}; {times}. {entry.meaning}."
        console().print(sentence, soft_wrap=True)


def _values(effect: EffectRecipe) -> str:
    units = {p.name: p.unit for p in EFFECTS[effect.key].parameters}
    parts = []
    for name, value in effect.values.items():
        numbers = value if isinstance(value, tuple) else (value,)
        shown = ", ".join(rounded(v, abs(v) / 100 or 1.0) for v in numbers)
        parts.append(f"{name} = {shown} {units[name]}".removesuffix(" 1"))
    return "; ".join(parts)
