"""How large an effect must be to be found: detection limits from what campaigns without any effect say.

At the fit of a control the score test of an effect has, for an effect of the size ``theta``, the noncentrality ``theta' I theta`` with
``I`` the inverse of the covariance of its one-step values; it is found where the statistic passes the threshold of the corrected p-value.
The limit along a direction is the length at which that happens in 95% (50%) of cases [Cox and Hinkley, Theoretical Statistics (1974),
ch. 9]. It varies from one particle and flight to the next; the table keeps ``I`` of every control, and a limit is the median over them.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.stats import chi2, ncx2

from datasets.atomic_files import written_whole
from datasets.errors import InputError
from datasets.vocabulary.effects import EFFECTS, Scope

Array = NDArray[np.float64]
TABLE = Path(__file__).resolve().parents[2] / "docs" / "results" / "detection_limits.json"
"""The committed table."""


@dataclass(frozen=True)
class EffectInformation:
    """What controls know of one effect.

    ``parameters`` its sizes; ``information`` [control] (q, q) in the catalogue's units to the power of minus 2 ``power``, of one sequence
    for effects of a sequence, else of the whole campaign; ``tried`` starts of a search; ``power`` of a size that the pictures follow
    linearly (2 for a blur or a spread, whose squares count).
    """

    key: str
    parameters: tuple[str, ...]
    information: tuple[Array, ...]
    tried: int
    power: int


@dataclass(frozen=True)
class LimitTable:
    """Detection limits of campaigns of one shape: ``alpha`` the corrected level, ``tests`` the number of effects on trial."""

    alpha: float
    tests: int
    campaign: Mapping[str, Any]
    effects: Mapping[str, EffectInformation]


def noncentrality(p: float, degrees: int, probability: float) -> float:
    """Noncentrality at which a chi-squared statistic passes the threshold of the p-value ``p`` with ``probability``."""
    threshold = float(chi2.isf(max(p, 1e-300), degrees))
    return float(brentq(lambda size: ncx2.sf(threshold, degrees, size) - probability, 1e-6, 4.0 * threshold + 100.0))


def limits_along(table: LimitTable, key: str, sizes: Array, probability: float = 0.95) -> Array:
    """What ``sizes`` must be multiplied with to reach the limit, in each control (c,).

    ``sizes`` (sequences, q) for an effect of a sequence, (1, q) otherwise; catalogue's units.
    """
    effect = table.effects[key]
    active = int(np.any(sizes != 0, axis=1).sum())
    searches = len(sizes) if EFFECTS[key].scope is Scope.SEQUENCE else 1
    p = table.alpha / table.tests / float(effect.tried) ** searches
    wanted = noncentrality(p, sizes.size, probability) if active else np.inf
    linear = sizes**effect.power
    strength = np.array([float(np.einsum("si,ij,sj->", linear, matrix, linear)) for matrix in effect.information])
    return np.asarray((wanted / np.maximum(strength, 1e-300)) ** (0.5 / effect.power))


def limit_along(table: LimitTable, key: str, sizes: Array, probability: float = 0.95) -> float:
    """The median of :func:`limits_along` over the controls."""
    return float(np.median(limits_along(table, key, sizes, probability)))


def axis_limits(table: LimitTable, key: str, *, sequences: int) -> list[dict[str, Any]]:
    """Of each parameter alone (in every sequence alike, where sequences have their own): median limits and the range over controls."""
    effect, rows = table.effects[key], []
    own = EFFECTS[key].scope is Scope.SEQUENCE
    for i, name in enumerate(effect.parameters):
        sizes = np.zeros((sequences if own else 1, len(effect.parameters)))
        sizes[:, i] = 1.0
        half, most = limits_along(table, key, sizes, 0.5), limits_along(table, key, sizes, 0.95)
        unit = next(p.unit for p in EFFECTS[key].parameters if p.name == name)
        rows.append(
            {
                "parameter": name,
                "unit": unit,
                "found_in_half": float(np.median(half)),
                "found_in_95_percent": float(np.median(most)),
                "lowest": float(most.min()),
                "highest": float(most.max()),
            }
        )
    return rows


def write_table(table: LimitTable, path: Path) -> None:
    """Write the table with the limits of single parameters for people."""
    sequences = int(table.campaign["sequences"])
    effects = {
        key: {
            "limits": axis_limits(table, key, sequences=sequences),
            **{k: v for k, v in asdict(effect).items() if k != "information"},
            "information": [matrix.tolist() for matrix in effect.information],
        }
        for key, effect in table.effects.items()
    }
    document = {"alpha": table.alpha, "tests": table.tests, "campaign": dict(table.campaign), "effects": effects}
    path.parent.mkdir(parents=True, exist_ok=True)
    with written_whole(path) as temporary:
        temporary.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


def read_table(path: Path) -> LimitTable:
    """Read a table.

    Raises
    ------
    InputError
        Where there is none or it is not one of ours.
    """
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
        effects = {key: _effect(entry) for key, entry in document["effects"].items()}
        return LimitTable(float(document["alpha"]), int(document["tests"]), document["campaign"], effects)
    except FileNotFoundError:
        raise InputError(f"{path}: expected a table of detection limits, found nothing; `tumble challenge limits` writes one.") from None
    except (ValueError, KeyError, TypeError) as error:
        raise InputError(f"{path}: expected a table written by `tumble challenge limits` ({type(error).__name__}: {error}).") from None


def _effect(entry: Mapping[str, Any]) -> EffectInformation:
    matrices: Sequence[Any] = entry["information"]
    information = tuple(np.array(matrix, dtype=np.float64) for matrix in matrices)
    return EffectInformation(entry["key"], tuple(entry["parameters"]), information, int(entry["tried"]), int(entry["power"]))
