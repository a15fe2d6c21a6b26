"""How large an effect must be to be found: detection limits from what campaigns without any effect say.

At the fit of a control the score test of an effect has, for an effect of the size ``theta``, the noncentrality ``theta' I theta`` with
``I`` the inverse of the covariance of its one-step values; it is found where the statistic passes the threshold of the corrected p-value.
The limit along a direction is the length at which that happens in 95% (50%) of cases [Cox and Hinkley, Theoretical Statistics (1974),
ch. 9]. Particles and flights differ, so the table keeps ``I`` of every control, and cases are drawn from all of them: the shares of the
controls are averaged. For effects that only show where they are large, ``I`` is what their test says in campaigns that have them.

What is outside of the catalogue is told from it only by what the best effect that all sequences share leaves of it; its limit is where
that is found.
"""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.stats import chi2, ncx2

from datasets.atomic_files import written_whole
from datasets.errors import InputError
from datasets.vocabulary.effects import EFFECTS

Array = NDArray[np.float64]
TABLE = Path(__file__).resolve().parents[2] / "docs" / "results" / "detection_limits.json"
"""The committed table."""
SAME = 1e-9
"""Difference of logarithms below which two limits are one."""


@dataclass(frozen=True)
class EffectInformation:
    """What controls, or campaigns with an effect that is large, know of it.

    ``parameters`` its sizes; ``information`` [campaign] (q, q) in the catalogue's units to the power of minus 2 ``power``, of one sequence
    for effects of a sequence, else of the whole campaign; ``tried`` starts of a search; ``power`` of a size that the pictures follow
    linearly (2 for a blur or a spread, whose squares count).
    """

    key: str
    parameters: tuple[str, ...]
    information: tuple[Array, ...]
    tried: int
    power: int


@dataclass(frozen=True)
class OutsideInformation:
    """What campaigns with a ``key`` that is outside of the catalogue know of it beside the best of the effects that sequences share.

    Noncentrality of what is left per ``size`` squared (``strength``, per campaign, in ``unit``⁻²) and its ``degrees`` of freedom.
    """

    key: str
    unit: str
    strength: tuple[float, ...]
    degrees: tuple[int, ...]


@dataclass(frozen=True)
class LimitTable:
    """Detection limits of campaigns of one shape: ``alpha`` the corrected level, ``tests`` the number of effects on trial."""

    alpha: float
    tests: int
    campaign: Mapping[str, Any]
    effects: Mapping[str, EffectInformation]
    outside: Mapping[str, OutsideInformation] = field(default_factory=dict)


def noncentrality(p: float, degrees: int, probability: float) -> float:
    """Noncentrality at which a chi-squared statistic passes the threshold of the p-value ``p`` with ``probability``."""
    threshold = float(chi2.isf(max(p, 1e-300), degrees))
    return float(brentq(lambda size: ncx2.sf(threshold, degrees, size) - probability, 1e-6, 4.0 * threshold + 100.0))


def limits_along(table: LimitTable, key: str, sizes: Array, probability: float = 0.95) -> Array:
    """What ``sizes`` must be multiplied with to be found with ``probability`` in a campaign like each of the controls (c,).

    ``sizes`` (sequences, q) for an effect of a sequence, (1, q) otherwise; catalogue's units.
    """
    p, strength = _level(table, key, sizes), _strength(table, key, sizes)
    wanted = noncentrality(p, sizes.size, probability) if sizes.any() else np.inf
    return np.asarray((wanted / np.maximum(strength, 1e-300)) ** (0.5 / table.effects[key].power))


def limit_along(table: LimitTable, key: str, sizes: Array, probability: float = 0.95) -> float:
    """What ``sizes`` must be multiplied with to be found in the share ``probability`` of campaigns like the controls."""
    each = limits_along(table, key, sizes, probability)
    if not np.all(np.isfinite(each)):
        return float("inf")
    threshold = float(chi2.isf(max(_level(table, key, sizes), 1e-300), sizes.size))
    strength, power = _strength(table, key, sizes), 2.0 * table.effects[key].power
    return _reached(lambda factor: np.asarray(ncx2.sf(threshold, sizes.size, strength * factor**power)), each, probability)


def outside_limit(table: LimitTable, key: str, probability: float = 0.95) -> float:
    """Size at which what the catalogue leaves of an effect outside of it is found in the share ``probability`` of cases."""
    found = table.outside[key]
    degrees, strength = np.array(found.degrees), np.maximum(np.array(found.strength), 1e-300)
    threshold = chi2.isf(table.alpha / table.tests, degrees)
    each = np.sqrt([noncentrality(table.alpha / table.tests, int(d), probability) for d in degrees] / strength)
    return _reached(lambda size: np.asarray(ncx2.sf(threshold, degrees, strength * size**2)), each, probability)


def _reached(found: Callable[[float], Array], each: Array, probability: float) -> float:
    """The size at which the shares ``found`` in every campaign average ``probability``; ``each`` (c,): where each reaches it."""
    low, high = np.log(each.min()), np.log(each.max())
    if high - low < SAME:
        return float(each[0])
    return float(np.exp(brentq(lambda x: float(np.mean(found(float(np.exp(x))))) - probability, low, high)))


def _level(table: LimitTable, key: str, sizes: Array) -> float:
    """The p-value that a test of one effect has to pass, for all that is tried."""
    searches = len(sizes) if EFFECTS[key].scope.own else 1
    return table.alpha / table.tests / float(table.effects[key].tried) ** searches


def _strength(table: LimitTable, key: str, sizes: Array) -> Array:
    """Noncentrality (c,) of ``sizes`` in each control."""
    linear = sizes ** table.effects[key].power
    return np.array([float(np.einsum("si,ij,sj->", linear, matrix, linear)) for matrix in table.effects[key].information])


def axis_limits(table: LimitTable, key: str, *, sequences: int) -> list[dict[str, Any]]:
    """Limits of each parameter alone (in every sequence alike, where sequences have their own), and their range over controls."""
    effect, rows = table.effects[key], []
    own = EFFECTS[key].scope.own
    for i, name in enumerate(effect.parameters):
        sizes = np.zeros((sequences if own else 1, len(effect.parameters)))
        sizes[:, i] = 1.0
        every = limits_along(table, key, sizes, 0.95)
        unit = next(p.unit for p in EFFECTS[key].parameters if p.name == name)
        rows.append(
            {
                "parameter": name,
                "unit": unit,
                "found_in_half": limit_along(table, key, sizes, 0.5),
                "found_in_95_percent": limit_along(table, key, sizes),
                "lowest": float(every.min()),
                "highest": float(every.max()),
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
    outside = {
        key: {
            "limits": {"found_in_half": outside_limit(table, key, 0.5), "found_in_95_percent": outside_limit(table, key)},
            **asdict(each),
        }
        for key, each in table.outside.items()
    }
    document = {"alpha": table.alpha, "tests": table.tests, "campaign": dict(table.campaign), "effects": effects, "outside": outside}
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
        outside = {key: _outside(entry) for key, entry in document.get("outside", {}).items()}
        return LimitTable(float(document["alpha"]), int(document["tests"]), document["campaign"], effects, outside)
    except FileNotFoundError:
        raise InputError(f"{path}: expected a table of detection limits, found nothing; `tumble challenge limits` writes one.") from None
    except (ValueError, KeyError, TypeError) as error:
        raise InputError(f"{path}: expected a table written by `tumble challenge limits` ({type(error).__name__}: {error}).") from None


def _effect(entry: Mapping[str, Any]) -> EffectInformation:
    matrices: Sequence[Any] = entry["information"]
    information = tuple(np.array(matrix, dtype=np.float64) for matrix in matrices)
    return EffectInformation(entry["key"], tuple(entry["parameters"]), information, int(entry["tried"]), int(entry["power"]))


def _outside(entry: Mapping[str, Any]) -> OutsideInformation:
    strength, degrees = tuple(float(v) for v in entry["strength"]), tuple(int(v) for v in entry["degrees"])
    return OutsideInformation(entry["key"], entry["unit"], strength, degrees)
