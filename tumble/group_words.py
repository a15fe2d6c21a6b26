"""One number with several names, in words: what these data cannot tell apart, with its value under each name."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from tumble.numbers import compact

AS_LIKELY = 20.0
"""Odds beyond which a name stays in its group only since the data cannot tell it apart: what is plausible a priori speaks against it."""
NUMBERS = {2: "two", 3: "three", 4: "four", 5: "five"}


def value_words(value: Mapping[str, Any], *, scatter: bool) -> str:
    """A value with its standard deviation, or the scatter of the values of the sequences."""
    unit = "" if value["unit"] == "1" else f" {value['unit']}"
    of = f" ({value['sequence']})" if value["sequence"] else ""
    name = value["parameter"].replace("_", " ")
    return f"{name} scatters by {value['value']:.2g}{unit}" if scatter else f"{name} = {compact(value['value'], value['sigma'])}{unit}{of}"


def odds_words(log_odds: float) -> str:
    """Odds of another name against the first."""
    return f"{np.exp(min(log_odds, 0.0)):.2g} : 1" if log_odds > -np.log(AS_LIKELY) else "as likely, less probable a priori"


def count_words(count: int) -> str:
    """A small number in words."""
    return NUMBERS.get(count, str(count))
